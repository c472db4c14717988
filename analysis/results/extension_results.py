"""Protocols of extensions' results that the kernel uses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Protocol

from ballplate.presentation.formatting import Data
from ballplate.simulator.inputs.extensions import function, optional_function


class SpaceView(Protocol):
    """A picture in space, which a notebook shows."""

    def save(self, path: str | Path) -> None: ...

    def _repr_html_(self) -> str: ...


class AskedResult(Protocol):
    """A result that prints as lines of text and as plain data."""

    def lines(self) -> list[str]: ...

    def to_dict(self) -> Data: ...


class PredictedAssumptions(AskedResult, Protocol):
    """Assumptions of a prediction; `doubling` are those that more than double U6, the largest
    first: what is assumed, and a line of text.
    """

    @property
    def doubling(self) -> Sequence[tuple[str, str]]: ...

    def words_of(self, name: str) -> str: ...

    def summary(self) -> list[str]: ...


class AskedAssumptions(AskedResult, Protocol):
    """Answers of readings to assumptions; `verdict` has the causes that contradict them, of which
    one `explains` the residuals if none may be further terms of the error model.
    """

    @property
    def verdict(self) -> tuple[str, ...]: ...

    @property
    def explains(self) -> bool: ...


class IssuedCertificate(AskedResult, Protocol):
    """A plate's co-ordinates in its own axes, by their `datum`; `texts` are files by name."""

    @property
    def datum(self) -> str: ...

    def texts(self, path: str | Path) -> Mapping[Path, str]: ...


def shown_in_space(result: object) -> SpaceView:
    """Return the view of a prediction or a fit.

    :raises MissingExtensionError: the extension that draws it is not installed.
    """
    view: SpaceView = function("view")(result)
    return view


def picture_in_space(result: object) -> str:
    """Return the view as HTML for a notebook; empty without the extension that draws it."""
    view = optional_function("view")
    return "" if view is None else str(view(result)._repr_html_())
