"""Rows of printed tables: columns by heading, and numbers in them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from fractions import Fraction

NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+)(?:[eE][+-]?[0-9]{1,3})?")

# A row has to agree in itself to this many units of the last digit.
AGREEMENT = Fraction(2)


def is_number(text: str) -> bool:
    """True if a text is a number, with a point or a comma.

    >>> [is_number(text) for text in ("-1,5", "+.5", "----#----", "1.2.3")]
    [True, True, False, False]
    """
    return NUMBER.fullmatch(text) is not None


def with_point(text: str) -> str:
    """A number with a point instead of its comma."""
    return text.replace(",", ".")


def agrees(actual: str, nominal: str, deviation: str, signed: bool = True) -> bool:
    """True if a deviation is the actual value less the nominal, perhaps but for its sign, as far
    as these are numbers.

    >>> agrees("1,002", "1", "0,002"), agrees("1.002", "1.000", "0.003"), agrees("1", "2", "")
    (True, True, True)
    """
    texts = [with_point(text) for text in (actual, nominal, deviation)]
    if not all(is_number(text) for text in texts):
        return True
    a, b, c = (Fraction(text) for text in texts)
    digits = min(len(text.partition(".")[2]) for text in texts)
    apart = a - b - c if signed else abs(a - b) - abs(c)
    return abs(apart) <= AGREEMENT / 10**digits


def headings(cells: Sequence[str], names_known: Mapping[str, str]) -> dict[str, int]:
    """Where each column is that is known by its heading; the first, if several are called so.

    >>> headings(["Name", "Ist-Wert"], {"istwert": "actual"})
    {'actual': 1}
    """
    places_of_columns: dict[str, int] = {}
    for i, cell in enumerate(cells):
        plain = re.sub(r"[^a-z+\-]", "", cell.casefold())
        name = names_known.get(plain) or names_known.get(plain.replace("-", ""))
        if name:
            places_of_columns.setdefault(name, i)
    return places_of_columns
