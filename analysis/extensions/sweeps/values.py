"""Values of axes: texts for tables, numbers, ranges, and subsets of lists."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from itertools import combinations
from typing import Any

from ballplate.simulator.inputs import (
    QUANTITY,
    Mapping,
    Node,
    QuantityError,
    Scalar,
    Sequence,
    child,
    exact_number,
    parse_angle,
    parse_duration,
    parse_length,
    parse_ratio,
    shorten,
    to_python,
)

from .model import Unit

KINDS: tuple[tuple[Unit, Callable[[object], float]], ...] = (
    ("m", parse_length),
    ("rad", parse_angle),
    ("1", parse_ratio),
    ("h", lambda value: parse_duration(value) / 3600.0),
)


def label(node: Node) -> str:
    """Return a value as a short text.

    >>> from ballplate.simulator.inputs.yamltree import parse_tree
    >>> label(parse_tree("[5, 750 mm]", ""))
    '[5, 750 mm]'
    """
    return shorten(_text(to_python(node)), 200)


def _text(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_text(item)}" for key, item in value.items()) + "}"
    if isinstance(value, tuple):
        return "[" + ", ".join(map(_text, value)) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    return "" if value is None else str(value)


def numeric(value: object) -> tuple[float, Unit]:
    """Return a number or quantity in SI units with its unit; NaN without unit for anything else.

    Durations are in hours.

    >>> numeric("750 mm"), numeric(5), numeric("90 min"), numeric("z low")[1]
    ((0.75, 'm'), (5.0, '1'), (1.5, 'h'), '')
    """
    if isinstance(value, int | float) and not isinstance(value, bool):
        # A float cannot represent every larger whole number.
        is_exact = abs(value) <= (2**53 if isinstance(value, int) else 1e300)
        return (float(value), "1") if is_exact else (math.nan, "")
    if isinstance(value, str) and len(value) < 100:
        for unit, parse in KINDS:
            try:
                return parse(value), unit
            except QuantityError:
                continue
    return math.nan, ""


def of_range(
    first: object, last: object, count: int | None, step: object, logarithmic: bool, most: int
) -> list[str | int | float]:
    """Return the values of a range, computed exactly, in the unit of its ends.

    :raises ValueError: ends that are no quantities of one unit, a step in the opposite direction,
        or more values than `most`.

    >>> of_range("300 mm", "750 mm", 4, None, False, 100)
    ['300 mm', '450 mm', '600 mm', '750 mm']
    >>> of_range(4, 10, None, 2, False, 100)
    [4, 6, 8, 10]
    """
    low, unit = _exact(first, "from")
    high, unit_of_last = _exact(last, "to")
    if unit_of_last != unit:
        raise ValueError(
            f'from and to have the units "{unit}" and "{unit_of_last}"; write both in the same unit'
        )
    if (count is None) == (step is None):
        raise ValueError("a range needs count or step; give one of the two")
    if count is None:
        difference, unit_of_step = _exact(step, "step")
        if unit_of_step != unit:
            raise ValueError(
                f'step has the unit "{unit_of_step}", from and to "{unit}"; write all in the same'
                " unit"
            )
        if difference == 0 or (high - low) / difference < 0:
            raise ValueError("step leads away from to; change its sign, or exchange from and to")
        if logarithmic:
            raise ValueError("spacing: logarithmic applies to count; replace step by count")
        count = int((high - low) / difference) + 1
    else:
        difference = (high - low) / (count - 1)
    if count > most:
        raise ValueError(f"the range has {count} values; {most} are the limit")
    if logarithmic:
        if low <= 0 or high <= 0:
            raise ValueError("spacing: logarithmic needs ends above zero")
        try:
            ratio = float(high / low) ** (1.0 / (count - 1))
        except OverflowError:
            raise ValueError(
                "the ends are too far apart; bring them nearer to each other"
            ) from None
        inner = [Fraction(f"{float(low) * ratio**k:.10g}") for k in range(1, count - 1)]
        return [_written(value, unit) for value in (low, *inner, high)]
    return [_written(low + k * difference, unit) for k in range(count)]


def _exact(value: object, key: str) -> tuple[Fraction, str]:
    """Return a number and its unit as written."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError(f"{key} is missing; give from, to and count or step")
    text = str(value)
    quantity = QUANTITY.fullmatch(text.strip()) if len(text) < 100 else None
    if quantity is None:
        raise ValueError(
            f'{key}: "{shorten(text)}" is neither a number nor a quantity; write for example'
            ' "300 mm"'
        )
    return exact_number(quantity[1]), (quantity[2] or "").strip()


def _written(value: Fraction, unit: str) -> str | int | float:
    if not unit and value.denominator == 1:
        return int(value)
    number = float(value)
    if not unit:
        return number
    return f"{int(value)} {unit}" if value.denominator == 1 else f"{number!r} {unit}"


def entry_names(node: Node) -> list[str] | None:
    """Return the names of the entries of a list; None unless all have one."""
    if not isinstance(node, Sequence):
        return None
    names = [child(item, "name") if isinstance(item, Mapping) else item for item in node.items]
    if not all(isinstance(name, Scalar) for name in names):
        return None
    return [_text(to_python(name)) for name in names if name is not None]


def subset_count(total: int, fixed: int, sizes: tuple[int, ...]) -> int:
    """Return the number of subsets of `total` entries that include `fixed` given ones.

    >>> subset_count(5, 2, (3,)), len(subsets([*"abcde"], ("a", "b"), tuple("abcde"), (3,)))
    (3, 3)
    """
    return sum(math.comb(total - fixed, size - fixed) for size in sizes if fixed <= size <= total)


def subsets(
    names: list[str], always: tuple[str, ...], among: tuple[str, ...], sizes: tuple[int, ...]
) -> list[tuple[str, tuple[str, ...]]]:
    """Return labelled subsets of the entries of a list, by size, then in the order of the list."""
    free = [k for k, name in enumerate(names) if name in among and name not in always]
    fixed = [k for k, name in enumerate(names) if name in always]
    labelled = []
    for size in sizes:
        if size < len(fixed):
            continue
        for chosen in combinations(free, size - len(fixed)):
            kept = sorted([*fixed, *chosen])
            labelled.append((_subset_label(names, kept), tuple(names[k] for k in kept)))
    return labelled


def _subset_label(names: list[str], chosen: list[int]) -> str:
    """Return the names in a subset, or the names outside it if that is shorter.

    >>> _subset_label(["a", "b", "c", "d"], [0, 1, 3]), _subset_label(["a", "b", "c", "d"], [0, 3])
    ('all but c', 'a + d')
    """
    without = [name for k, name in enumerate(names) if k not in chosen]
    if 2 * len(without) < len(chosen):
        return f"all but {' and '.join(without)}" if without else "all"
    return " + ".join(names[k] for k in chosen)
