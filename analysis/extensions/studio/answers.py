"""The studio's view of a design: its objects, its uncertainties, and motions of undetermined
directions.
"""

from __future__ import annotations

from collections.abc import Mapping
from time import perf_counter
from typing import Any

import numpy as np
from ballplate.extensions.pages.motions import (
    moved_balls,
    moved_points,
    null_motions,
    weak_motions,
)
from ballplate.extensions.repair.written import plane_of
from ballplate.extensions.sweeps.error_map_uncertainty import point_map
from ballplate.presentation import Data, finite, picked
from ballplate.rank import Verdict, verdict
from ballplate.results import (
    length_headline,
    predict,
    rank_words,
    scale_lines,
    scale_warnings,
    target_lines,
)
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.design import locations
from ballplate.simulator.estimation import Linearisation, linearise
from ballplate.simulator.experiment import Experiment, Position, lay_out
from ballplate.simulator.geometry import ball_coordinates, even_grid, without_rigid_motion
from ballplate.simulator.inputs import Target
from ballplate.uncertainty import Quantity, uncertainties

# Nodes of the lattice along each axis: edges of it that bend are drawn as curves.
NODES = 9

# Nodes of the map along each axis: few enough to answer while a plate is dragged.
MAP_NODES = 11


@single_threaded
def answer(experiment: Experiment) -> dict[str, Any]:
    """Return the immediate view of a design, as plain data in metres, with the seconds of
    computation.
    """
    start = perf_counter()
    design, target = lay_out(experiment), experiment.target_uncertainty
    linearisation = linearise(design)
    judged = verdict(linearisation, experiment.expected_rank_deficiency, target)
    quantities = uncertainties(linearisation, target=target)
    found_map = _map(linearisation)
    engine = perf_counter() - start
    lengths = quantities.get("U6")
    return {
        **picked(experiment, "title", "label"),
        "rank": {
            "words": rank_words(judged),
            **picked(judged, "deficiency", "expected", "parameters", "observations"),
            "reasons": list(judged.reasons),
        },
        "quantities": [_row(quantity) for quantity in quantities.values()],
        "headline": length_headline(quantities),
        "target": [] if target is None else target_lines(lengths),
        "within": None if lengths is None else lengths.within_target,
        "motions": _motions(linearisation, judged, target),
        "map": found_map,
        "doubts": list(experiment.doubts),
        "engine": engine,
        "seconds": perf_counter() - start,
    }


@single_threaded
def later_answer(experiment: Experiment) -> dict[str, Any]:
    """Return what comes later than the rest, since the design is evaluated again for each row: the
    source of scale as `lines` of text, and `assumptions`, None without U6.
    """
    prediction = predict(experiment, with_scale=True)
    scale, assumptions = prediction.scale, prediction.assumptions
    return {
        "lines": [*scale_lines(scale), *scale_warnings(scale)],
        "assumptions": assumptions and {**assumptions.to_dict(), "warning": assumptions.warning},
    }


def _row(quantity: Quantity) -> Data:
    return {
        **picked(quantity, "symbol", "description"),
        "maximum": finite(quantity.maximum),
        "average": finite(quantity.average),
        **picked(quantity, "unit", "count", "undetermined", "largest"),
    }


def scene(experiment: Experiment, problems: Mapping[str, str]) -> dict[str, Any]:
    """Return the volume and all positions, with what is wrong with some by their names, as plain
    data in metres.
    """
    volume = experiment.machine.volume
    return {
        "dimension": experiment.dimension,
        "lower": volume.lower.tolist(),
        "upper": volume.upper.tolist(),
        "probes": {name: entry.offset.tolist() for name, entry in experiment.probes.items()},
        "artefacts": {name: list(entry.names) for name, entry in experiment.layouts.items()},
        "positions": [
            place_data(experiment, place) | {"problem": problems.get(place.name)}
            for place in experiment.positions
        ],
    }


def place_data(experiment: Experiment, place: Position) -> Data:
    """Return the pose of a position, as plain data in metres."""
    layout = experiment.layouts[place.artefact]
    plane = plane_of(place.pose.rotation)
    is_read = np.zeros(len(layout.names), bool)
    is_read[place.balls] = True
    return {
        **picked(place, "name", "artefact", "enabled"),
        "probes": list(place.probes),
        "groups": len(place.readings),
        "readings": place.count,
        "plane": None if plane is None else plane[0],
        "quarter_turns": None if plane is None else plane[1],
        "origin": place.pose.origin.tolist(),
        "rotation": place.pose.rotation.tolist(),
        "balls": ball_coordinates(place.pose, layout).tolist(),
        "read": is_read.tolist(),
    }


def _motions(
    linearisation: Linearisation, judged: Verdict, target: Target | None
) -> dict[str, Any]:
    """Return the motion of a lattice through the volume (x running slowest) and of the balls read
    along each undetermined and each weak direction, per unit of the largest displacement.

    Their common rigid motion, which no distance shows, is removed.
    """
    design = linearisation.design
    volume, readings, offsets = (
        design.machine.volume,
        design.readings,
        design.probes.offsets,
    )
    nodes = even_grid(volume.lower, volume.upper, [NODES] * len(volume.lower))
    of_nodes = np.full(len(nodes), design.evaluation.probe)
    of_plates = readings.select(design.plate_readings)
    places = np.concatenate(
        [nodes + offsets[of_nodes], locations(design, linearisation.state, of_plates)]
    )
    directions = (*judged.null, *judged.weak)
    motions = []
    for k, motion in enumerate(
        (*null_motions(linearisation), *weak_motions(linearisation, target))
    ):
        by = [
            moved_points(linearisation, motion, nodes, of_nodes),
            moved_balls(linearisation, motion, of_plates),
        ]
        moved = without_rigid_motion(places, np.concatenate(by)[:, :, None])[:, :, 0]
        largest = float(np.linalg.norm(moved, axis=1).max())
        rounded = np.round(moved / (largest or 1.0), 4).tolist()
        motions.append(
            {
                "words": str(directions[k]),
                "weak": k >= len(judged.null),
                "nodes": rounded[: len(nodes)],
                "readings": rounded[len(nodes) :],
            }
        )
    first = np.array([design.balls.of(int(artefact)).min() for artefact in design.balls.artefact])
    numbers = np.arange(len(first)) - first
    return {
        "nodes": NODES,
        "names": list(design.positions.names),
        "position": of_plates.position.tolist(),
        "ball": numbers[of_plates.ball].tolist(),
        "directions": motions,
    }


def _map(linearisation: Linearisation) -> dict[str, Any]:
    """Return standard uncertainties of corrected points through the volume, None if
    undetermined.
    """
    mapped = point_map(linearisation, MAP_NODES)
    return {
        "x": mapped.x.tolist(),
        "y": mapped.y.tolist(),
        "slices": [
            {
                **picked(map_slice, "name", "level"),
                "values": [[finite(v) for v in row] for row in map_slice.values.tolist()],
            }
            for map_slice in mapped.slices
        ],
    }
