"""What a kind of error model consists of: its keys in a file, and the model made of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from ..inputs.messages import Steps
from ..inputs.settings import Settings
from .protocol import ErrorModel

Corner = tuple[float, ...]


def _nothing(settings: Any, dimension: int) -> tuple[tuple[Steps, str], ...]:
    return ()


@dataclass(frozen=True)
class ErrorModelKind:
    """A kind of error model.

    `build` makes the model of the `settings` for a volume from a lower to an upper corner in
    metres, with as many co-ordinates as one of `dimensions`. `wrong` tells what is wrong with
    settings for so many dimensions, as (path in the settings, text) pairs; `with_defaults` states
    defaults that depend on their number.
    """

    settings: type[Settings]
    build: Callable[[Any, Corner, Corner], ErrorModel]
    dimensions: tuple[int, ...] = (2, 3)
    wrong: Callable[[Any, int], Iterable[tuple[Steps, str]]] = _nothing
    with_defaults: Callable[[Any, int], Settings] = lambda settings, dimension: settings
