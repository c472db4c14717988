"""Pool of a design in the studio: its outlines in the volume, and groups that fill the volume."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, floor
from typing import Any

import numpy as np
from ballplate.extensions.repair.candidates import PLANES, probes_across
from ballplate.extensions.repair.yamltext import TextChange
from ballplate.presentation import Data
from ballplate.simulator.experiment import Experiment, Position
from ballplate.simulator.geometry import AXIS_INDEX, IN_PLANE_AXES, Axis, corner_points
from ballplate.simulator.inputs import to_python, typed_length

# Outlines that are drawn.
MOST_OUTLINES = 1000

# Ends of ranges are whole tenths of a millimetre.
TENTH = 1e-4

GROUP_KEYS = frozenset({"planes", "levels", "corners", "centres"})


def pool_of(experiment: Experiment) -> Data:
    """Return the candidates of an experiment's pool besides its own positions, as plain data:
    their count and, in words, why others were dropped, the corners of their outlines in metres,
    each once, forbidden boxes within the volume, and the probes that usually read each plane.
    """
    pool, (lower, upper) = experiment.pool, experiment.machine.volume.corners
    candidates, dropped = ((), {}) if pool is None else (pool.candidates, pool.dropped)
    items = [candidate.item for candidate in candidates if not candidate.drawn]
    places = [item for item in items if isinstance(item, Position)]
    outlines: dict[Any, None] = {}
    for place in places:
        rows = np.round(corner_points(place.pose, experiment.layouts[place.artefact]), 5).tolist()
        outlines.setdefault(tuple(map(tuple, rows)))
    artefact = next(iter(experiment.layouts))
    planes: dict[str, Axis | None] = dict(zip(PLANES, PLANES, strict=True))
    if experiment.dimension == 2:
        planes = {"z": None}
    return {
        "count": len(places),
        "words": "No candidates yet: fill the volume. " * (not places)
        + f"{len(places)} candidates besides the positions"
        + "; left out: " * bool(dropped)
        + ", ".join(f"{number} {reason}" for reason, number in dropped.items()),
        "outlines": list(outlines)[:MOST_OUTLINES],
        "boxes": [] if pool is None else np.clip(pool.forbidden, lower, upper),
        "probes": {
            plane: probes_across(experiment, artefact, axis) for plane, axis in planes.items()
        },
    }


def filled(
    experiment: Experiment,
    artefact: str,
    probes: Mapping[str, Sequence[str]],
    turns: Sequence[int],
    count: int,
) -> list[TextChange]:
    """Return the changes of the file that fill the volume with an artefact: groups of candidates at
    `count` levels and places along each axis, in planes with given `probes` and quarter `turns`.

    They replace its other groups; single candidates and other artefacts stay.

    :raises ExperimentError: there is no plane, or no room for the artefact in one.
    """
    settings, pool = to_python(experiment.tree), experiment.pool
    volume, dimension = experiment.machine.volume, experiment.dimension
    edge = (pool.edge if pool is not None else None) or 0.0
    common: Data = {"artefact": artefact} if len(experiment.layouts) > 1 else {}
    groups: list[Data] = []
    size = np.ptp(experiment.layouts[artefact].coordinates[:, :2], axis=0)
    by_size: dict[tuple[float, ...], list[int]] = {}
    for turn in turns:
        turned = np.round(size[::-1] if turn % 2 else size, 9)
        by_size.setdefault(tuple(turned), []).append(turn)
    for plane, names in probes.items():
        # Both balls and scale readings stay within the volume.
        offsets = [np.zeros(dimension), *(experiment.probes[name].offset for name in names)]
        low = (volume.lower + offsets).max(axis=0)
        high = (volume.upper + offsets).min(axis=0)
        along = [AXIS_INDEX[axis] for axis in IN_PLANE_AXES[plane]]
        for sides, of_size in by_size.items():
            first, last = low.copy(), high.copy()
            first[along] += edge
            last[along] -= np.add(sides, edge)
            ends = zip(AXIS_INDEX, first, last, strict=False)
            lengths = {axis: _range(start, end, count) for axis, start, end in ends}
            if None in lengths.values():
                text = f"{artefact} has no room across {plane} with {', '.join(names)}"
                raise experiment.refused(("pool",), f"{text}; leave this plane out")
            level = {} if dimension == 2 else {"planes": [plane], "levels": lengths.pop(plane)}
            turned = {"quarter_turns": of_size[0] if len(of_size) == 1 else of_size}
            read = {"probes": list(names)} if "probes" in settings else {}
            groups.append(common | level | {"corners": lengths} | turned | read)
    if not groups:
        raise experiment.refused(("pool",), "no plane to fill; choose at least one, and a turn")
    return _refilled(settings, artefact, groups)


def _range(first: float, last: float, count: int) -> Any:
    """Return evenly spaced lengths as a file states them, one where there is little room; None if
    the first is beyond the last.
    """
    low, high = ceil(first / TENTH - 1e-6), floor(last / TENTH + 1e-6)
    if low > high:
        return None
    start, end = (typed_length(round(tenths * TENTH, 9)) for tenths in (low, high))
    return start if count < 2 or high - low < count else {"from": start, "to": end, "count": count}


def _refilled(settings: Data, artefact: str, groups: Sequence[Data]) -> list[TextChange]:
    """Return the changes that replace the groups of an artefact in a file's pool."""
    entries, steps = (settings.get("pool") or {}).get("candidates") or (), ("pool", "candidates")
    if not entries:
        return [TextChange(steps, list(groups))]
    old = [
        k
        for k, entry in enumerate(entries)
        if GROUP_KEYS & entry.keys() and str(entry.get("artefact", artefact)) == artefact
    ]
    replaced = zip(old, groups, strict=False)
    return [
        *(TextChange((*steps, k), group) for k, group in replaced),
        *(TextChange(steps, group, "append") for group in groups[len(old) :]),
        *(TextChange((*steps, k), kind="remove") for k in reversed(old[len(groups) :])),
    ]
