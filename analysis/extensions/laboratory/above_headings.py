"""Information in the lines above the headings of a table, which applies to all its rows."""

from __future__ import annotations

import re
from collections.abc import Iterable

from ballplate.simulator.inputs import shorten

from .heading_words import WORDS
from .headings import HeadingError

# Lines above the headings that say what all rows have.
ABOVE = {
    **{role: "|".join(WORDS[role]).replace(" ", "[ -]?") for role in ("position", "probe")},
    "unit": "|".join(
        (*WORDS["unit"], r"(?:(?:all )?values|lengths?|(?:alle )?(?:werte|angaben)) in\b")
    ),
}
# Characters of such a line.
LONGEST_LINE = 300


def said_above(lines: Iterable[str]) -> dict[str, str]:
    """Return position, probe and unit stated for all rows.

    :raises HeadingError: two lines contradict each other.
    """
    statements: dict[str, str] = {}
    for text in (text[:LONGEST_LINE] for text in lines):
        for role, pattern in ABOVE.items():
            match = re.match(
                rf'[\s#"]*(?:{pattern})(?:["\s]*[:=;,\t|]|(?<=\bin)\s)\s*"?(.*?)["\s;,|]*$',
                text,
                re.IGNORECASE,
            )
            if match is None or not match[1]:
                continue
            if statements.setdefault(role, match[1]) != match[1]:
                raise HeadingError(
                    f'two lines above the headings state a {role}, "{shorten(statements[role])}"'
                    " and"
                    f' "{shorten(match[1])}"; write which under readings'
                )
    return statements
