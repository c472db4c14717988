"""The section `plan` of a sweep file: cases that choose from a pool, and axes of its limits."""

from __future__ import annotations

from typing import Literal

from ballplate.simulator.inputs import Node, Problems, Sequence, hint, written

from .axes import check_labels
from .model import Choice, Limit, Planning, SweepAxis, Unit
from .sweep_settings import PlanSettings
from .values import label

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
        if not isinstance(stated, tuple):
            common += [] if stated is None else [(limited, stated)]
            continue
        node = written(root, "plan", key)
        texts = map(label, node.items) if isinstance(node, Sequence) else map(str, stated)
        choices = tuple(
            Choice(text, (), value / 3600.0 if unit == "h" else value, limit=(limited, value))
            for text, value in zip(texts, stated, strict=True)
        )
        axes.append(SweepAxis(f"{key} limit", choices, unit))
        check_labels(("plan", key), choices, problems)
    return Planning(settings.criterion, settings.seed, tuple(common)), axes
