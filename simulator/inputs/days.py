"""Days of the calendar in files and options."""

from __future__ import annotations

import re
from datetime import date
from typing import Annotated

from pydantic import AfterValidator


def parse_day(text: str) -> date:
    """Return the day that a text such as 2026-11-22 names.

    :raises ValueError: it is no day.

    >>> parse_day("2026-11-22").year
    2026
    """
    try:
        if re.fullmatch(r"[0-9]{4}-[0-9]{2}-[0-9]{2}", text):
            return date.fromisoformat(text)
    except ValueError:
        pass
    raise ValueError(f'"{text[:20]}" is no day; write it as 2026-11-22')


def stated_day(text: str) -> str:
    """Return a text that names a day, unchanged.

    :raises ValueError: it is no day.
    """
    parse_day(text)
    return text


Day = Annotated[str, AfterValidator(stated_day)]
"""A day in a file."""
