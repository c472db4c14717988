"""Protocols of extensions' results that the kernel uses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Protocol

from ballplate.presentation.formatting import Data


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


class IssuedCertificate(AskedResult, Protocol):
    """A plate's co-ordinates in its own axes, by their `datum`; `texts` are files by name."""

    @property
    def datum(self) -> str: ...

    def texts(self, path: str | Path) -> Mapping[Path, str]: ...
