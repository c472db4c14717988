"""Pool of a design in the studio: its outlines in the volume, and groups that fill the volume."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, floor
from typing import Any

import numpy as np
from ballplate.extensions.repair.written import plane_of
from ballplate.extensions.repair.yamltext import TextChange
from ballplate.presentation import Data
from ballplate.simulator.experiment import Experiment, Position
from ballplate.simulator.geometry import AXIS_INDEX, IN_PLANE_AXES, BallLayout
from ballplate.simulator.inputs import (
    QuantityError,
    Step,
    Steps,
    parse_length,
    to_python,
    typed_length,
)
from ballplate.simulator.machines import Array

# Outlines that are drawn, and candidates that are named.
MOST_OUTLINES, MOST_NAMED = 1000, 2000

# Ends of ranges are whole tenths of a millimetre.
TENTH = 1e-4

GROUP_KEYS = frozenset({"planes", "levels", "corners", "centres"})


def pool_of(experiment: Experiment) -> dict[str, Any]:
    """Return the candidates of an experiment's pool besides its own positions, as plain data:
    their names, the corners of their outlines in metres, each once, why others were dropped,
    forbidden boxes within the volume, and the probes that usually read each plane.
    """
    pool, volume = experiment.pool, experiment.machine.volume
    candidates = [] if pool is None else [one for one in pool.candidates if not one.drawn]
    places = [one.item for one in candidates if isinstance(one.item, Position)]
    outlines: dict[Any, None] = {}
    for place in places:
        rows = np.round(_outline(place, experiment.layouts[place.artefact]), 5).tolist()
        outlines.setdefault(tuple(map(tuple, rows)))
    out = set[str]()
    for limit in () if pool is None else pool.at_most:
        if pool is not None and limit.count == 0:
            out |= {pool.candidates[k].name for k in limit.members}
    boxes = [
        [np.maximum(box[0], volume.lower).tolist(), np.minimum(box[1], volume.upper).tolist()]
        for box in map(np.array, _boxes(experiment))
    ]
    return {
        "count": len(places),
        "dropped": {} if pool is None else dict(pool.dropped),
        "names": [place.name for place in places if place.name not in out][:MOST_NAMED],
        "left_out": sorted(out),
        "outlines": list(outlines)[:MOST_OUTLINES],
        "more": max(0, len(outlines) - MOST_OUTLINES),
        "boxes": boxes,
        "probes": _usual_probes(experiment, places),
    }


def _outline(place: Position, layout: BallLayout) -> Array:
    """Return the corners (4, d) of the rectangle around an artefact's balls in its own plane."""
    low, high = layout.coordinates.min(axis=0), layout.coordinates.max(axis=0)
    ends = [(low, low), (high, low), (high, high), (low, high)]
    corners = np.array([(x[0], y[1], low[2]) for x, y in ends])
    return corners[:, : len(place.pose.origin)] @ place.pose.rotation.T + place.pose.origin


def _boxes(experiment: Experiment) -> list[Array]:
    limits = (to_python(experiment.tree).get("pool") or {}).get("limits") or {}
    boxes = []
    for region in limits.get("forbidden") or ():
        ends = np.array([[-np.inf] * 3, [np.inf] * 3])
        for axis, lengths in region.items():
            ends[:, AXIS_INDEX[axis]] = [parse_length(length) for length in lengths]
        boxes.append(ends[:, : experiment.dimension])
    return boxes


def _usual_probes(experiment: Experiment, places: Sequence[Position]) -> dict[str, list[str]]:
    """Return the probes of the first position or candidate in each plane, or else all."""
    planes = ("z",) if experiment.dimension == 2 else ("x", "y", "z")
    usual = {plane: list(experiment.probes) for plane in planes}
    for place in (*reversed(places), *reversed(experiment.positions)):
        found = plane_of(place.pose.rotation)
        if experiment.dimension == 2 or found is not None:
            usual["z" if found is None else found[0]] = list(place.probes)
    return usual


def filling(
    experiment: Experiment,
    artefact: str,
    probes: Mapping[str, Sequence[str]],
    turns: Sequence[int],
    count: int,
) -> list[Data]:
    """Return groups of candidates of an artefact that fill the volume with `count` levels and
    places along each axis, in planes with given `probes` and quarter `turns`.

    :raises ExperimentError: a plane is unknown, has no probe, or no room for the artefact.
    """
    settings, layout = to_python(experiment.tree), experiment.layouts[artefact]
    size = np.ptp(layout.coordinates[:, :2], axis=0)
    is_square = bool(abs(size[0] - size[1]) < TENTH)
    ways = [list(turns)] if is_square else [[t for t in turns if t % 2 == k] for k in (0, 1)]
    edge = _edge(experiment)
    groups = []
    for plane, names in probes.items():
        unknown = [name for name in names if name not in experiment.probes]
        if plane not in AXIS_INDEX or unknown or not names:
            text = f"no probe {unknown[0]}" if unknown else f"no probe reads plane {plane}"
            raise experiment.refused(("pool",), text)
        offsets = np.array(
            [np.zeros(experiment.dimension), *(experiment.probes[name].offset for name in names)]
        )
        volume = experiment.machine.volume
        low, high = (volume.lower + offsets).max(axis=0), (volume.upper + offsets).min(axis=0)
        for some in filter(None, ways):
            sides = size[::-1] if some[0] % 2 else size
            group: Data = {"artefact": artefact} if len(experiment.layouts) > 1 else {}
            if experiment.dimension == 3:
                k = AXIS_INDEX[plane]
                group |= {"planes": [plane], "levels": _range(low[k], high[k], count)}
            along = zip(IN_PLANE_AXES[plane], sides, strict=True)
            group["corners"] = {
                axis: _range(low[k] + edge, high[k] - side - edge, count)
                for axis, side in along
                for k in [AXIS_INDEX[axis]]
            }
            if None in (group.get("levels", ""), *group["corners"].values()):
                text = f"{artefact} has no room across {plane} with {', '.join(names)}"
                raise experiment.refused(("pool",), f"{text}; leave this plane out")
            group["quarter_turns"] = some[0] if len(some) == 1 else some
            groups.append(group | ({"probes": list(names)} if "probes" in settings else {}))
    if not groups:
        raise experiment.refused(("pool",), "no plane to fill; choose at least one, and a turn")
    return groups


def _edge(experiment: Experiment) -> float:
    limits = (to_python(experiment.tree).get("pool") or {}).get("limits") or {}
    try:
        return parse_length(limits.get("edge", "0 mm"))
    except QuantityError:
        return 0.0


def _range(first: float, last: float, count: int) -> Any:
    """Return evenly spaced lengths as a file states them, one where there is little room; None if
    the first is beyond the last.
    """
    low, high = ceil(first / TENTH - 1e-6), floor(last / TENTH + 1e-6)
    if low > high:
        return None
    start, end = (typed_length(round(tenths * TENTH, 9)) for tenths in (low, high))
    return start if count < 2 or high - low < count else {"from": start, "to": end, "count": count}


def refilled(data: Any, artefact: str, groups: Sequence[Data]) -> list[TextChange]:
    """Return the changes of a file's `data` that replace the groups of an artefact in its pool;
    single candidates and groups of other artefacts stay.
    """
    entries = (data.get("pool") or {}).get("candidates") or ()
    gone = [
        k
        for k, entry in enumerate(entries)
        if GROUP_KEYS & entry.keys() and str(entry.get("artefact", artefact)) == artefact
    ]
    steps: Steps = ("pool", "candidates")
    if not entries:
        return [_deep(data, steps, list(groups), "set")]
    common = list(zip(gone, groups, strict=False))
    changes = [TextChange((*steps, k), group) for k, group in common]
    changes += [TextChange(steps, group, "append") for group in groups[len(common) :]]
    return changes + [TextChange((*steps, k), kind="remove") for k in gone[len(common) :][::-1]]


def added(data: Any, steps: Steps, value: Any) -> TextChange:
    """Return the change that adds an entry to a list, with what is missing above it."""
    return _deep(data, steps, value, "append")


def _deep(data: Any, steps: Steps, value: Any, kind: Any) -> TextChange:
    for k, step in enumerate(steps):
        if not data or step not in data:
            value = [value] if kind == "append" else value
            for below in reversed(steps[k + 1 :]):
                value = {below: value}
            # What is there and empty is replaced as a whole.
            return TextChange(steps[: k + 1], value)
        data = data[step]
    return TextChange(steps, value, kind)


def taken(data: Any, steps: Steps, index: int) -> TextChange:
    """Return the change that removes an entry of a list, with what holds nothing else."""
    above: list[Any] = [data]
    for step in steps:
        above.append(above[-1][step])
    path: tuple[Step, ...] = (*steps, index)
    while len(path) > 1 and len(above[len(path) - 1]) == 1:
        path = path[:-1]
    return TextChange(path, kind="remove")
