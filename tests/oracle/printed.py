"""Figures as commands print them, taken from the text and compared with numbers."""

from __future__ import annotations

import math
import re

import pytest
from ballplate.cli import main

FACTORS = {"µm": 1e-6, "µrad": 1e-6, "mm": 1e-3, "ppm": 1e-6, "µm/m": 1e-6}
FACTORS["arcsec"] = math.pi / 180 / 3600
NUMBER = r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?"


def output_of(capsys: pytest.CaptureFixture[str], *arguments: object, status: int = 0) -> str:
    """What a command prints, which ends with a status."""
    capsys.readouterr()
    ended = main([str(argument) for argument in arguments])
    captured = capsys.readouterr()
    assert ended == status, captured.err
    return captured.out


def step_of(value: float, digits: int) -> float:
    """The last of the significant digits of a value."""
    return float(10.0 ** (math.floor(math.log10(abs(value))) - digits + 1)) if value else 0.0


def agrees(text: str, value: float, digits: int = 4) -> bool:
    """Whether a figure is a value to its significant digits; a tenth of the last one is rounding.

    >>> agrees("0.1235", 0.123456), agrees("0.123", 0.123456), agrees("-", math.nan)
    (True, False, True)
    """
    if math.isnan(value):
        return text == "-"
    return text != "-" and within(text, value, step_of(value, digits))


def within(text: str, value: float, step: float) -> bool:
    """Whether a figure is a value rounded to a step."""
    return abs(float(text) - value) <= 0.6 * step + 1e-12


def cells(line: str) -> list[str]:
    """What stands in the columns of a line, which two blanks or more are between."""
    return re.split(r" {2,}", line.strip())


def table(text: str, heading: str) -> list[list[str]]:
    """Rows of the table whose heading begins so, to the next empty line."""
    lines = text.splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith(heading))
    block = "\n".join(lines[start + 1 :]).split("\n\n")[0]
    return [cells(line) for line in block.splitlines() if not line.startswith("(")]


def place(text: str) -> list[float]:
    """A point "(1, 2, 3) mm" in metres."""
    return [1e-3 * float(one) for one in re.findall(NUMBER, text)]
