"""The section `plan` of a sweep file: cases that choose from a pool, and axes of its limits."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal

from ballplate.simulator.inputs import Node, Problems, Sequence, hint, written

from .model import Choice, Limit, Planning, SweepAxis, Unit
from .sweep_settings import PlanSettings
from .values import label

# Values of a range of counts.
MOST_COUNTS = 1000

# Keys of the section, with what they limit and the unit of their axes.
LIMITS: dict[str, tuple[Literal["seconds", "readings", "positions"], Unit]] = {
    "hours": ("seconds", "h"),
    "positions": ("positions", "1"),
    "readings": ("readings", "1"),
}


def read_limits(
    settings: PlanSettings | None, root: Node, problems: Problems
) -> tuple[Planning | None, list[SweepAxis]]:
    """Return how the cases of a sweep file choose, None if they do not, with an axis for each limit
    of several values; errors go to `problems`.
    """
    if settings is None:
        return None, []
    from ballplate.extensions.planning import DESCRIPTIONS

    if settings.criterion not in DESCRIPTIONS:
        text = f'there is no criterion "{settings.criterion}"'
        problems.add(("plan", "criterion"), f"{text}; {hint(settings.criterion, DESCRIPTIONS)}")
    common: list[Limit] = []
    axes = []
    for key, (limited, unit) in LIMITS.items():
        stated = getattr(settings, key)
        node = written(root, "plan", key)
        values = list(_values(stated)) if stated is not None else []
        if node is None or not values:
            if stated is not None:
                problems.add(("plan", key), "the range has no value, or too many; write 4 to 12")
            continue
        if isinstance(stated, tuple | str):
            texts = list(map(label, node.items)) if isinstance(node, Sequence) else map(str, values)
            choices = tuple(
                Choice(text, (), value / 3600.0 if unit == "h" else value, limit=(limited, value))
                for text, value in zip(texts, values, strict=True)
            )
            axes.append(SweepAxis(f"{key} limit", choices, unit))
        else:
            common.append((limited, values[0]))
    return Planning(settings.criterion, settings.seed, tuple(common)), axes


def _values(stated: Any) -> Iterator[float]:
    """Yield the values of a limit; none of a range that falls or is too long."""
    if isinstance(stated, str):
        low, high = map(int, stated.split(" to "))
        yield from range(low, high + 1) if high - low < MOST_COUNTS else ()
    else:
        yield from stated if isinstance(stated, tuple) else (stated,)
