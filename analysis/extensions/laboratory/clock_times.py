"""Times of readings as clocks show them: of a day, or with their date."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

from ballplate.simulator.inputs import Mark, Message, shorten

DAY_FIRST = re.compile(r"([0-9]{1,2})\.([0-9]{1,2})\.([0-9]{4})[\sT,]+(.+)")
TIME_OF_DAY = re.compile(r"([0-9]{1,2}):([0-9]{2})(?::([0-9]{2}(?:[.,][0-9]{1,9})?))?")
LONGEST = 60
# Kinds of times, which have different beginnings.
OF_DAY, OF_DATE, OF_ZONE = "times of a day", "dates without a zone", "dates with a zone"


class ClockError(ValueError):
    """A text that is no clock time; says what would be right."""


@dataclass(frozen=True)
class ClockTime:
    """Seconds from the beginning that all times of a kind have."""

    kind: str
    seconds: float


def clock_time(text: str) -> ClockTime:
    """Read a time of a day, or one with its date, by ISO 8601 or with the day first and points.

    :raises ClockError: the text is not a time.

    >>> clock_time("10:05"), clock_time("22.11.2026 10:05:30").seconds % 60
    (ClockTime(kind='times of a day', seconds=36300.0), 30.0)
    >>> clock_time("2026-11-22T10:05:00Z").seconds - clock_time("2026-11-22 10:04+00:00").seconds
    60.0
    """
    plain = text.strip()
    if match := TIME_OF_DAY.fullmatch(plain):
        hours, minutes = int(match[1]), int(match[2])
        seconds = float((match[3] or "0").replace(",", "."))
        if hours < 24 and minutes < 60 and seconds < 60.0:
            return ClockTime(OF_DAY, 3600.0 * hours + 60.0 * minutes + seconds)
    if match := DAY_FIRST.fullmatch(plain):
        time = match[4] if re.match("[0-9]{2}:", match[4]) else f"0{match[4]}"
        plain = f"{match[3]}-{match[2]:>02}-{match[1]:>02}T{time}"
    try:
        if len(plain) > LONGEST or ":" not in plain:
            raise ValueError(plain)
        moment = datetime.fromisoformat(plain)
    except ValueError:
        raise ClockError(
            f'"{shorten(text)}" is no time of a clock; write 10:05:30 or 2026-11-22T10:05:30, or'
            " name the column with the unit of its numbers, such as time_s"
        ) from None
    if moment.tzinfo is None:
        return ClockTime(OF_DATE, moment.replace(tzinfo=UTC).timestamp())
    return ClockTime(OF_ZONE, moment.timestamp())


# Where a time stands, as it is written, and what it is.
ReadTime = tuple[Mark, str, ClockTime]


def wrong_times(times: Sequence[ReadTime]) -> tuple[Message, ...]:
    """Faults of times of readings in the order of their rows, with their texts: they are of
    different kinds, or of a day and go back, so that they may be of several days.
    """
    if not times:
        return ()
    kind = times[0][2].kind
    before = times[0]
    for mark, text, time in times[1:]:
        if time.kind != kind:
            wrong = f"{time.kind}, and others are {kind}; write all of one kind"
            return (mark.message("", wrong),)
        if kind == OF_DAY and time.seconds < before[2].seconds:
            there = "" if before[0].file == mark.file else f"{before[0].file}, "
            wrong = (
                f"the time goes back from {shorten(before[1])} ({there}line {before[0].line}) to"
                f" {shorten(text)}, which may be of another day; write dates, as in"
                " 2026-11-22T10:05, or order the rows and the files by time"
            )
            return (mark.message("", wrong),)
        before = mark, text, time
    return ()
