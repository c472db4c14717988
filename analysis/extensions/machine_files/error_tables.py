"""Tables of one parametric error: positions and values, with comments on where and how it was
measured.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import (
    ExperimentError,
    Mark,
    Message,
    QuantityError,
    format_length,
    hint,
    listing,
    nearest,
    parse_length,
    read_text,
    shorten,
)
from ballplate.simulator.machines import AXIS_ERRORS

from .curve_files import BANDWIDTH, read_numbered_curves
from .curves import Points
from .description import Three
from .straightness import Criterion

COMMENT = re.compile(r"\s*#\s*(.*?)\s*$")

# Words that may be meant for a key, and what a value without its colon looks like.
OTHER_WORDS = {"offset": "probe", "reflector": "probe", "criterion": "straightness"}
VALUE = re.compile(r"=|\d\s*(mm|m|[uµμ]m|in)\b|^(table|end points|least squares|minimum zone)$")
MOST_WORDS = 3

# Part of an axis by which a table may go beyond it, or fall short of it; with wide spacing it may
# by one more point.
MARGIN, WIDEST = 0.05, 0.25


@dataclass(frozen=True)
class ErrorTable:
    """A measured error: its points and bandwidth along the axis, and the content of comments.

    `line` has the positions of other axes by name; `note` is about means of several runs.
    """

    points: Points
    bandwidth: Points | None
    line: dict[str, float]
    probe: Three
    criterion: Criterion | None
    on_table: bool = False
    note: str = ""


def parse_line(text: str) -> dict[str, float]:
    """Read a line along an axis, given by positions of other axes.

    :raises QuantityError: written otherwise.

    >>> parse_line("y = 600 mm, z = 0.2 m")
    {'y': 0.6, 'z': 0.2}
    """
    _refuse_decimal_comma(text)
    values = {}
    for part in text.split(","):
        name, equals, value = (piece.strip() for piece in part.partition("="))
        if not equals or name not in AXIS_NAMES:
            raise QuantityError(
                f'"{shorten(part)}" is not a position of an axis; write for example y = 600 mm, z ='
                " 200 mm"
            )
        if name in values:
            raise QuantityError(f"{name} is given twice; give it once")
        try:
            values[name] = parse_length(value)
        except QuantityError as error:
            raise QuantityError(f"{name}: {error}") from None
    if len(values) > 2:
        raise QuantityError("a line needs an axis along which it runs; leave that one out")
    return values


def _refuse_decimal_comma(text: str) -> None:
    comma = re.search("[0-9]+,[0-9]+", text)
    if comma is not None:
        raise QuantityError(f'"{comma[0]}" has a decimal comma; write {comma[0].replace(",", ".")}')


# In one piece: everything that is wrong with a file is collected before any of it is refused.
def read_error_table(path: Path, name: str, axis: tuple[float, float] | None = None) -> ErrorTable:
    """Read the table of the error `name` from a CSV file such as
    position_mm,EYX_um,EYX_bandwidth_um.

    Where the ends of the `axis` are given, in metres, the table should cover it.

    :raises ExperimentError: all faults of the file at once.
    """
    messages: list[Message] = []
    stated_values: dict[str, tuple[Mark, str]] = {}
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        match = COMMENT.match(line)
        if match is None:
            continue
        mark = Mark(str(path), number, match.start(1) + 1)
        key, colon, value = match[1].partition(":")
        if not colon or key.rstrip() not in KEYS:
            # Any other comment is one.
            if (meant := _meant(match[1])) is not None:
                text = (
                    f'unknown "{shorten(key.rstrip())}{colon}"; did you mean "{meant}:"? If not,'
                    " reword the comment"
                )
                messages.append(mark.message("", text))
        elif (key := key.rstrip()) in stated_values:
            messages.append(
                mark.message(
                    "", f'"{key}:" is already in line {stated_values[key][0].line}; remove one'
                )
            )
        else:
            begin = match.end(1) - len(value.lstrip()) + 1
            stated_values[key] = (Mark(str(path), number, begin), value.strip())
    values: dict[str, Any] = {}
    for key, (mark, text) in stated_values.items():
        try:
            values[key] = KEYS[key](text)
        except QuantityError as error:
            messages.append(mark.message("", str(error)))
    line_of, along = values.get("line", {}), AXIS_NAMES[AXIS_ERRORS[name].axis]
    if along in line_of:
        mark = stated_values["line"][0]
        messages.append(mark.message("", f"the line runs along {along}; leave it out"))
    curves: dict[str, Points] = {}
    note = ""
    try:
        curves, numbers, note = read_numbered_curves(path, bandwidths=True)
        if axis is not None:
            messages += _range(str(path), next(iter(curves.values())).positions, numbers, axis)
    except ExperimentError as error:
        messages += error.messages
    other_curves = [curve for curve in curves if curve.removesuffix(BANDWIDTH) != name]
    if curves and (other_curves or name not in curves):
        text = f"the file should have {name}" + (
            f" alone, but has {listing(other_curves)}" if other_curves else ""
        )
        messages.append(Message(str(path), 0, 0, "", f"{text}; write one file for each error"))
    elif not AXIS_ERRORS[name].is_straightness:
        text = f"{name} is not a straightness error; remove this line"
        messages += [
            stated_values[key][0].message("", text)
            for key in ("straightness", "straightedge")
            if key in stated_values
        ]
    bandwidth = curves.get(name + BANDWIDTH)
    if bandwidth is not None and min(bandwidth.values) < 0:
        messages.append(
            Message(
                str(path), 0, 0, "", "a bandwidth is below zero; write half the width of the band"
            )
        )
    if messages:
        raise ExperimentError(sorted(messages))
    return ErrorTable(
        curves[name],
        bandwidth,
        line_of,
        values.get("probe", (0.0, 0.0, 0.0)),
        values.get("straightness"),
        "straightedge" in stated_values,
        note,
    )


def _meant(comment: str) -> str | None:
    """The key that a comment is meant for, if it looks as if."""
    head, colon, _ = comment.partition(":")
    words = re.findall(r"[a-z]+", head.partition("=")[0].casefold())
    if colon and len(words) <= MOST_WORDS:
        for word in words:
            if (key := OTHER_WORDS.get(word) or nearest(word, KEYS)) is not None:
                return key
    first, _, remainder = comment.partition(" ")
    word_stem = first.casefold().rstrip("=:,")
    return word_stem if word_stem in KEYS and VALUE.search(remainder) else None


def _range(
    file: str, positions: tuple[float, ...], numbers: tuple[int, ...], axis: tuple[float, float]
) -> list[Message]:
    """Return the fault of the ends of a table whose points are in lines `numbers`."""
    lower, upper = axis
    length = upper - lower
    messages = []
    for k, beside, end, sign, word in ((0, 1, lower, -1.0, "begins"), (-1, -2, upper, 1.0, "ends")):
        beyond = sign * (positions[k] - end)
        spacing = min(abs(positions[beside] - positions[k]), WIDEST * length)
        if beyond > MARGIN * length or -beyond > max(MARGIN * length, spacing):
            text = (
                f"the table {word} at {format_length(positions[k])}, but the axis is"
                f" {format_length(lower)} to {format_length(upper)}; give positions of the axis, in"
                " the unit of the header, and cover the axis"
            )
            messages.append(Message(file, numbers[k], 1, "", text))
    return messages


def parse_point(text: str) -> Three:
    """Read three co-ordinates.

    :raises QuantityError: written otherwise.

    >>> parse_point("0 mm, 0.5 m, -100 mm")
    (0.0, 0.5, -0.1)
    """
    parts = text.strip().strip("[]").split(",")
    if len(parts) != 3:
        _refuse_decimal_comma(text)
        raise QuantityError(
            f"has {len(parts)} co-ordinates; give three, such as 0 mm, 0 mm, -100 mm"
        )
    x, y, z = (parse_length(part.strip()) for part in parts)
    return x, y, z


def _criterion(text: str) -> str:
    if text not in get_args(Criterion):
        advice = hint(text, get_args(Criterion))
        raise QuantityError(f'unknown criterion "{shorten(text)}"; {advice}')
    return text


def _table(text: str) -> bool:
    if text != "table":
        raise QuantityError(f'unknown place "{shorten(text)}"; write table, or leave the line out')
    return True


# What comments may state, and how it is read.
KEYS: Mapping[str, Callable[[str], object]] = {
    "line": parse_line,
    "straightness": _criterion,
    "straightedge": _table,
    "probe": parse_point,
}
