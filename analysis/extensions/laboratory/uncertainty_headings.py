"""Which uncertainty the heading of a column of readings says it holds: a standard or an expanded
one, or does not say.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Literal

Kind = Literal["standard", "expanded", "unclear"]

STANDARD = frozenset(("u", "standard uncertainty", "std uncertainty", "standardunsicherheit"))
EXPANDED = frozenset(
    (
        *("expanded uncertainty", "erweiterte unsicherheit", "erweiterte messunsicherheit"),
        *("expanded measurement uncertainty", "expanded u"),
    )
)
# A u in lower case is a standard uncertainty; one with a coverage probability is not, as a rule.
UNCLEAR = frozenset(
    (
        *("uncertainty", "unsicherheit", "messunsicherheit", "measurement uncertainty", "unc"),
        *("u 95", "uncertainty 95", "unsicherheit 95"),
    )
)
FACTORS = frozenset(("k", "coverage factor", "k factor", "k faktor", "erweiterungsfaktor"))

_FACTOR = re.compile(
    r"[\s_,;]*[\[(]?\s*(?<![^\W\d_])k[\s_]*=?[\s_]*([0-9]+(?:[.,][0-9]+)?)\s*[\])]?", re.IGNORECASE
)


# What a heading says of an uncertainty: which it is, its coverage factor, and its unit.
HeadedUncertainty = tuple[Kind, str | None, str | None]


def headed_uncertainty(
    cell: str, heading: Callable[[str], tuple[str, str | None]]
) -> HeadedUncertainty | None:
    """What a heading says of an uncertainty; None where it is none of an uncertainty.

    `heading` takes a heading apart into its name, folded, and its unit. With a coverage factor an
    uncertainty is expanded, unless it is called a standard one: these contradict each other.
    """
    match = _FACTOR.search(cell)
    remainder = cell if match is None else f"{cell[: match.start()]} {cell[match.end() :]}".strip()
    factor = None if match is None else match[1].replace(",", ".")
    name, unit = heading(remainder)
    if name in EXPANDED:
        return "expanded", factor, unit
    is_capital = name == "u" and remainder.lstrip().startswith("U")
    if name in UNCLEAR or is_capital:
        return "unclear" if factor is None else "expanded", factor, unit
    if name in STANDARD:
        is_standard = factor is None or float(factor) == 1.0
        return "standard" if is_standard else "unclear", factor, unit
    return None
