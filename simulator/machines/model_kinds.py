"""A type of error model: its keys in a file, and its model."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.settings import Settings
from ballplate.simulator.inputs.trust import Trust
from ballplate.simulator.inputs.unusable import UnusableError

from .protocol import ErrorModel

Corner = tuple[float, ...]


class CustomModelError(UnusableError, ValueError):
    """A user's error model is unusable; `key` is the key at fault, "object" or "options"."""

    def __init__(self, text: str, key: str = "object") -> None:
        self.key = key
        super().__init__(text)


@dataclass(frozen=True)
class ErrorModelKind:
    """A type of error model.

    `build` makes the model from `settings` for a volume between two corners in metres;
    `dimensions` lists the possible numbers of co-ordinates. `wrong` returns faults of the settings
    for a number of dimensions as (path in the settings, text) pairs; `with_defaults` states
    defaults that depend on this number. `read` completes the settings from files, found from the
    folder of the experiment; it raises ExperimentError. What `is_code` is run to be built.
    """

    settings: type[Settings]
    build: Callable[[Any, Corner, Corner], ErrorModel]
    dimensions: tuple[int, ...] = (2, 3)
    wrong: Callable[[Any, int], Iterable[tuple[Steps, str]]] = lambda settings, dimension: ()
    with_defaults: Callable[[Any, int], Settings] = lambda settings, dimension: settings
    read: Callable[[Any, Path, Trust], None] = lambda settings, folder, trust: None
    is_code: bool = False
