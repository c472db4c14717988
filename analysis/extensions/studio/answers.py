"""The studio's view of a design, to be made plain data: its objects, its uncertainties, maps of
them, and motions of undetermined directions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from time import perf_counter
from typing import Any

import numpy as np
from ballplate.extensions.maps.length_map import length_map
from ballplate.extensions.pages.level_maps import MISSED
from ballplate.extensions.pages.page_facts import target_in_words
from ballplate.extensions.repair.written import plane_of
from ballplate.presentation import Data, percent, picked, uncertainty_words
from ballplate.rank import Verdict, verdict
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.design import locations
from ballplate.simulator.estimation import Linearisation, linearise
from ballplate.simulator.experiment import Experiment, Position, lay_out
from ballplate.simulator.geometry import ball_coordinates, even_grid, without_rigid_motion
from ballplate.simulator.inputs import Target, service
from ballplate.uncertainty import Quantity, uncertainties

from ..planning import run_sheet
from .level_slices import LEVELS, in_slices, point_map
from .motions import moved_balls, moved_points, null_motions, weak_motions

# Nodes of the lattice along each axis: edges of it that bend are drawn as curves.
NODES = 9

# Nodes of the map of points along each axis, and of that of lengths, which has all lengths between.
MAP_NODES, LENGTH_NODES = 11, 9


@single_threaded
def summary(experiment: Experiment, moving: bool = False) -> dict[str, Any]:
    """Return rank, lengths and tasks of a design compared with the target, as plain data in metres,
    with the seconds of computation.

    While something is `moving`, undetermined directions are counted, but not described.
    """
    start = perf_counter()
    design, target = lay_out(experiment), experiment.target_uncertainty
    linearisation = linearise(design)
    # Dimensions take a second.
    symbols = ("U6", "tasks") if moving else ("U6", "tasks", "dimensions")
    quantities = uncertainties(linearisation, target=target, symbols=symbols)
    part = quantities.get("dimensions")
    expected, lengths = experiment.expected_rank_deficiency, quantities.get("U6")
    judged = None if moving else verdict(linearisation, expected, target)
    return {
        "title": experiment.title,
        "rank": {
            "deficiency": linearisation.deficiency,
            "expected": expected,
            "parameters": design.parameter_count,
            "observations": design.observation_count,
            "directions": [] if judged is None else _directions(judged),
        },
        "quantities": rows(quantities),
        "target": target_in_words(experiment),
        "within": lengths and lengths.within_target,
        "shares": _shares(experiment, quantities),
        "met": _met(quantities, linearisation.deficiency == (expected or 0), judged),
        "worst": _worst(linearisation, lengths),
        "part": part and service("part_for_studio")(design, part),
        "doubts": experiment.doubts,
        "seconds": perf_counter() - start,
    }


def _shares(experiment: Experiment, quantities: Mapping[str, Quantity]) -> list[str]:
    """Return the share of the distances, and of the measuring tasks, that meet their targets."""
    return [
        f"{percent(quantity.within_target)} of "
        + (
            f"{quantity.count:,} distances are within the target {target_in_words(experiment)}"
            if quantity.symbol == "U6"
            else f"the {quantity.description} are within their targets"
        )
        + f" ({uncertainty_words(quantity.coverage_factor)})"
        for quantity in quantities.values()
        if quantity.within_target is not None
    ]


def _met(quantities: Mapping[str, Quantity], is_expected: bool, judged: Verdict | None) -> str:
    """Return whether targets are met or missed, or undecided since something is undetermined that
    the file does not expect, or weakly determined; empty without targets.
    """
    shares = [quantity.within_target for quantity in quantities.values()]
    stated = [share for share in shares if share is not None]
    if not stated or min(stated) < 1.0:
        return "missed" if stated else ""
    is_weak = judged is not None and bool(judged.weak)
    return "met" if is_expected and not is_weak else "undecided"


def _directions(judged: Verdict) -> list[Data]:
    undetermined = [{"words": str(direction), "weak": False} for direction in judged.null]
    return undetermined + [{"words": str(direction), "weak": True} for direction in judged.weak]


def _worst(linearisation: Linearisation, lengths: Quantity | None) -> Data | None:
    """Return the ends of the length with the largest standard uncertainty, at scale readings."""
    if lengths is None or lengths.pair is None:
        return None
    first, second = linearisation.design.evaluation.points[list(lengths.pair)]
    return {"from": first, "to": second, "uncertainty": lengths.maximum}


def rows(quantities: Mapping[str, Quantity]) -> list[Data]:
    """Return what is shown of each quantity; no average is shown over parts of several units."""
    names = ("symbol", "description", "maximum", "average", "unit", "count", "undetermined")
    shown = [each for each in quantities.values() if ", " not in each.unit]
    return [picked(each, *names, "largest", "within_target") for each in shown]


def hours_of(experiment: Experiment) -> Data:
    """Return the `hours` that the positions of an experiment, read for planning, take in a short
    order, and whether their times are `usual` ones, as the file states none.
    """
    planned = experiment if experiment.pool else experiment.with_({"pool": {}})
    assert planned.pool is not None
    drawn = [candidate for candidate in planned.pool.candidates if candidate.drawn]
    hours = run_sheet(drawn, planned.pool.changes).hours
    return {"hours": hours, "usual": planned is not experiment}


def scene(experiment: Experiment, problems: Mapping[str, str]) -> dict[str, Any]:
    """Return the volume and all positions, with what is wrong with some by their names, as plain
    data in metres. Positions that are `unclear` have no place.
    """
    names = {place.name for place in experiment.positions}
    return {
        "dimension": experiment.dimension,
        **picked(experiment.machine.volume, "lower", "upper"),
        "probes": {name: probe.offset for name, probe in experiment.probes.items()},
        "artefacts": {name: layout.names for name, layout in experiment.layouts.items()},
        "positions": [
            place_data(experiment, place) | {"problem": problems.get(place.name)}
            for place in experiment.positions
        ],
        "unclear": {name: text for name, text in problems.items() if name not in names},
    }


def place_data(experiment: Experiment, place: Position) -> Data:
    """Return the pose of a position, as plain data in metres."""
    layout = experiment.layouts[place.artefact]
    plane = plane_of(place.pose.rotation)
    return {
        **picked(place, "name", "artefact", "enabled", "probes"),
        **picked(place.pose, "origin", "rotation"),
        "groups": len(place.readings),
        "readings": place.count,
        "plane": plane and plane[0],
        "balls": ball_coordinates(place.pose, layout),
        "read": np.isin(np.arange(len(layout.names)), place.balls),
    }


def motions(linearisation: Linearisation, target: Target | None, index: int) -> Data | None:
    """Return the motion of a lattice through the volume (x running slowest) and of the balls read
    along an undetermined or a weak direction, per unit of the largest displacement; None if there
    is no direction of that index.

    Their common rigid motion, which no distance shows, is removed.
    """
    design = linearisation.design
    found = (*null_motions(linearisation), *weak_motions(linearisation, target))
    if not 0 <= index < len(found):
        return None
    volume, readings = design.machine.volume, design.readings
    nodes = even_grid(volume.lower, volume.upper, [NODES] * len(volume.lower))
    of_nodes = np.full(len(nodes), design.evaluation.probe)
    of_plates = readings.select(design.plate_readings)
    balls = locations(design, linearisation.state, of_plates)
    places = np.concatenate([nodes + design.probes.offsets[of_nodes], balls])
    by = [
        moved_points(linearisation, found[index], nodes, of_nodes),
        moved_balls(linearisation, found[index], of_plates),
    ]
    moved = without_rigid_motion(places, np.concatenate(by)[:, :, None])[:, :, 0]
    largest = float(np.linalg.norm(moved, axis=1).max())
    rounded = np.round(moved / (largest or 1.0), 4)
    first = np.array([design.balls.of(int(artefact)).min() for artefact in design.balls.artefact])
    numbers = np.arange(len(first)) - first
    return {
        "nodes": NODES,
        "names": design.positions.names,
        "position": of_plates.position,
        "ball": numbers[of_plates.ball],
        "direction": {"nodes": rounded[: len(nodes)], "readings": rounded[len(nodes) :]},
    }


def _length_map(experiment: Experiment, linearisation: Linearisation) -> Data:
    """Return the share of the lengths from each point of a grid that miss the target, or their
    largest uncertainty in metres without one; None if one of them is undetermined.
    """
    counts = (LENGTH_NODES, LENGTH_NODES, len(LEVELS))[: experiment.dimension]
    lengths = length_map(experiment, counts, at=linearisation)
    has_target = experiment.target_uncertainty is not None
    values = lengths.missed if has_target else lengths.maximum
    values = np.where(lengths.undetermined > 0, np.nan, values)
    of_levels = values.reshape(LENGTH_NODES, LENGTH_NODES, -1).T
    scale = {
        "unit": "missed" if has_target else "m",
        "bounds": MISSED,
        "largest": float(np.nanmax(lengths.maximum_ratio, initial=0.0)),
    }
    return {**in_slices(linearisation.design, of_levels), "scale": scale}


def _point_map(experiment: Experiment, linearisation: Linearisation) -> Data:
    """Return standard uncertainties of corrected points through the volume, None if
    undetermined.
    """
    return point_map(linearisation, MAP_NODES)


MAPS: Mapping[Any, Callable[[Experiment, Linearisation], Data]] = {
    "lengths": _length_map,
    "points": _point_map,
}
"""Maps through the volume, by the names that the page has for them."""
