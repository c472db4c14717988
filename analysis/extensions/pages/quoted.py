"""Values of a page, each quoted from the plain data that the command's --json prints.

A page states no other value of a result, and gives the source of each: `data-path` is the path in
the data (as in RFC 6901, with the result's name in front), `value` the number there, and
`data-factor` its multiplier.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from ballplate.presentation import amount_of, number, percent, to_uncertainty

from .elements import Html, element

UNDETERMINED = "undetermined"


@dataclass(frozen=True)
class QuotedData:
    """Plain data of a result below its `path`."""

    path: str
    data: Any

    def at(self, *steps: str | int) -> QuotedData:
        """Return the data below further steps."""
        path, data = self.path, self.data
        for step in steps:
            path += "/" + str(step).replace("~", "~0").replace("/", "~1")
            data = data[step]
        return QuotedData(path, data)

    def __contains__(self, key: str) -> bool:
        return bool(self.data.get(key))

    def __len__(self) -> int:
        return len(self.data)

    def each(self) -> Iterator[QuotedData]:
        """The parts of a list, or of a mapping."""
        keys = self.data if isinstance(self.data, dict) else range(len(self.data))
        for key in keys:
            yield self.at(key)

    def number(self, *steps: str | int, factor: float = 1.0, digits: int = 4) -> Html:
        """A number times a factor, with significant digits."""
        quoted = self.at(*steps)
        if quoted.data is None:
            return quoted._shown(UNDETERMINED, factor)
        shown = (
            str(quoted.data)
            if isinstance(quoted.data, int)
            else number(factor * quoted.data, digits)
        )
        return quoted._shown(shown, factor)

    def micro(self, *steps: str | int, factor: float = 1.0, digits: int = 4) -> Html:
        """A small number in micrometres, microradians or parts per million."""
        return self.number(*steps, factor=1e6 * factor, digits=digits)

    def amount(self, value: str, unit: str, uncertainty: str | None = None) -> tuple[Html, str]:
        """A value with the unit it reads well in; to its uncertainty where that is named."""
        quantity, unit_text = self.at(value), str(self.data[unit])
        factor, shown = amount_of(1.0, unit_text)
        u = None if uncertainty is None else self.data[uncertainty]
        if quantity.data is None or uncertainty is None:
            return quantity.number(factor=factor), shown
        text = to_uncertainty(factor * quantity.data, math.nan if u is None else factor * u)
        return quantity._shown(text, factor), shown

    def share(self, *steps: str | int) -> Html:
        """A share in percent."""
        quoted = self.at(*steps)
        return quoted._shown(percent(quoted.data), 100.0)

    def text(self, *steps: str | int) -> Html:
        """Return a text of the data, unchanged."""
        quoted = self.at(*steps)
        return element("span", str(quoted.data), data_path=quoted.path)

    def _shown(self, text: str, factor: float) -> Html:
        value = None if self.data is None else repr(self.data)
        times = None if factor == 1.0 else repr(factor)
        return element("data", text, value=value, data_path=self.path, data_factor=times)
