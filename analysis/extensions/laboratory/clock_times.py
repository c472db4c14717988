"""Times of readings as clocks show them: of a day, or with their date."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import UTC, datetime

from ballplate.simulator.inputs import Mark, Message, QuantityError, shorten

DAY_FIRST = re.compile(r"([0-9]{1,2})\.([0-9]{1,2})\.([0-9]{4})[\sT,]+(.+)")
TIME_OF_DAY = re.compile(r"([0-9]{1,2}):([0-9]{2})(?::([0-9]{2}(?:[.,][0-9]{1,9})?))?")
LONGEST = 60
# Kinds of times, which have different beginnings.
OF_DAY, OF_DATE, OF_ZONE = "times of a day", "dates without a zone", "dates with a zone"


def clock_time(text: str) -> tuple[str, float]:
    """Return the kind of a time, and its seconds from the beginning that all of the kind have: of a
    day, or with its date, by ISO 8601 or with the day first and points.

    :raises QuantityError: the text is not a time.

    >>> clock_time("10:05"), clock_time("22.11.2026 10:05:30")[1] % 60
    (('times of a day', 36300.0), 30.0)
    >>> clock_time("2026-11-22T10:05:00Z")[1] - clock_time("2026-11-22 10:04+00:00")[1]
    60.0
    """
    plain = text.strip()
    if match := TIME_OF_DAY.fullmatch(plain):
        hours, minutes = int(match[1]), int(match[2])
        seconds = float((match[3] or "0").replace(",", "."))
        if hours < 24 and minutes < 60 and seconds < 60.0:
            return OF_DAY, 3600.0 * hours + 60.0 * minutes + seconds
    if match := DAY_FIRST.fullmatch(plain):
        time = match[4] if re.match("[0-9]{2}:", match[4]) else f"0{match[4]}"
        plain = f"{match[3]}-{match[2]:>02}-{match[1]:>02}T{time}"
    try:
        if len(plain) > LONGEST or ":" not in plain:
            raise ValueError(plain)
        moment = datetime.fromisoformat(plain)
    except ValueError:
        raise QuantityError(
            f'"{shorten(text)}" is no time of a clock; write 10:05:30 or 2026-11-22T10:05:30, or'
            " name the column with the unit of its numbers, such as time_s"
        ) from None
    if moment.tzinfo is None:
        return OF_DATE, moment.replace(tzinfo=UTC).timestamp()
    return OF_ZONE, moment.timestamp()


# Where a time stands, as it is written, its kind and its seconds.
ReadTime = tuple[Mark, str, str, float]


def wrong_times(times: Sequence[ReadTime]) -> tuple[Message, ...]:
    """Faults of times of readings in the order of their rows, with their texts: they are of
    different kinds, or of a day and go back, so that they may be of several days.
    """
    if not times:
        return ()
    before = times[0]
    kind = before[2]
    for time in times[1:]:
        mark, text, other_kind, seconds = time
        if other_kind != kind:
            wrong = f"{other_kind}, and others are {kind}; write all of one kind"
            return (mark.message("", wrong),)
        if kind == OF_DAY and seconds < before[3]:
            there = "" if before[0].file == mark.file else f"{before[0].file}, "
            wrong = (
                f"the time goes back from {shorten(before[1])} ({there}line {before[0].line}) to"
                f" {shorten(text)}, which may be of another day; write dates, as in"
                " 2026-11-22T10:05, or order the rows and the files by time"
            )
            return (mark.message("", wrong),)
        before = time
    return ()
