"""Tables read by the quick way are what exact arithmetic and the careful way make of them, to the
last bit.
"""

from __future__ import annotations

import math
from decimal import Decimal
from fractions import Fraction
from itertools import product
from pathlib import Path

import pytest
from ballplate.simulator.inputs.messages import ExperimentError, Message
from ballplate.simulator.inputs.quantities import LENGTH_UNITS, plain_number, power_of_ten
from ballplate.simulator.inputs.tables import FileRow, read_table
from hypothesis import given
from hypothesis import strategies as st

NUMBERS = st.from_regex(r"[+-]?[0-9]{1,15}(\.[0-9]{1,30})?", fullmatch=True).filter(str.isascii)
CELLS = [
    "0",
    "-0",
    "-0.000",
    "+12.5",
    "007",
    "1e3",
    ".5",
    "5.",
    "1e-400",
    "1e300",
    "0.0000000000000000000000001",
    "",
    "a",
]


@given(NUMBERS, st.sampled_from(sorted(LENGTH_UNITS)))
def test_plain_numbers_are_the_nearest_ones(number: str, unit: str) -> None:
    found = plain_number(number, power_of_ten(LENGTH_UNITS[unit]))
    exact = Fraction(Decimal(number)) * LENGTH_UNITS[unit]
    if unit == "in" or (exact and not Fraction(1, 10**18) <= abs(exact) <= 10**6):
        # Right at the limits the fraction and the float nearest to it may lie on different sides.
        assert (
            found is None
            or abs(abs(exact) / 10**6 - 1) < 1e-15
            or abs(abs(exact) * 10**18 - 1) < 1e-15
        )
    else:
        assert found is not None
        assert (found, math.copysign(1.0, found)) == (
            float(exact),
            math.copysign(1.0, float(exact)),
        )


def _read(path: Path, unit: str, lines: list[str]) -> tuple[tuple[FileRow, ...], list[Message]]:
    path.write_text("\n".join([f"ball,x_{unit},y_{unit}", *lines]) + "\n", encoding="utf-8")
    problems: list[Message] = []
    try:
        return read_table(path, ["ball"], ["x", "y"], ["z"], problems), problems
    except ExperimentError as error:
        return (), list(error.messages)


@pytest.mark.parametrize("cell", CELLS)
def test_quoted_rows_are_the_same_as_plain_ones(tmp_path: Path, cell: str) -> None:
    """A row with a quotation mark goes the careful way."""
    path = tmp_path / "t.csv"
    for unit, name in product(("mm", "um", "in", "m"), ("r1c1", " spaced ", "'=1+1", "")):
        plain, of_plain = _read(path, unit, [f"{name}, {cell} ,2.5", f"b,1,{cell}"])
        quoted, of_quoted = _read(path, unit, [f'"{name.strip()}", {cell} ,2.5', f'"b",1,{cell}'])
        assert repr(plain) == repr(quoted), (unit, name)
        assert [(o.line, o.text) for o in of_plain] == [(o.line, o.text) for o in of_quoted]
