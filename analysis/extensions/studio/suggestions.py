"""Suggestions: repairs of undetermined directions, and further positions that lower the
uncertainty most.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np
from ballplate.extensions.repair.candidates import new_positions, pool_additions
from ballplate.extensions.repair.changes import changed, scale_readings
from ballplate.extensions.repair.repair_search import repairs
from ballplate.extensions.repair.repairs import Repair
from ballplate.extensions.repair.written import Edit, position_settings
from ballplate.presentation import Data, picked
from ballplate.results import given_words, planned_uncertainty, predict
from ballplate.simulator.computing import Report, counted, unreported
from ballplate.simulator.experiment import Experiment, Position, placed_only
from ballplate.simulator.inputs import ExperimentError

from .actions import done
from .answers import hours_of, place_data
from .document import DesignDocument
from .drafts import evaluable_of

# Further positions that are shown.
MOST_SHOWN = 5


def suggested_repairs(
    document: DesignDocument, settings: Mapping[str, Any], report: Report = unreported
) -> list[Data]:
    """Return full repairs, as text, with the positions that they add or move, as plain data.

    :raises ExperimentError: the text is invalid.
    """
    experiment = evaluable_of(document, planning=True)
    found = repairs(experiment, report).repairs
    return [_repair_data(experiment, repair) for repair in found if not repair.deficiency]


def _repair_data(experiment: Experiment, repair: Repair) -> Data:
    after = changed(experiment, repair.changes)
    before = {position.name: position for position in experiment.positions}
    places = [position for position in after.positions if before.get(position.name) is not position]
    lengths = repair.prediction.lengths
    # The repaired file is one of full rank, whatever it expected.
    expectation = [Edit(("expected_rank_deficiency",), 0)] * bool(
        experiment.expected_rank_deficiency
    )
    return {
        "words": repair.words + given_words(repair.prediction.qualifications),
        "weak": repair.weak,
        "average": lengths and lengths.average,
        "maximum": lengths and lengths.maximum,
        "places": [place_data(after, place) for place in places],
        "edits": [
            {"path": edit.steps, **picked(edit, "value", "is_new")}
            for edit in (*repair.edits, *expectation)
        ],
    }


def next_positions(
    document: DesignDocument, settings: Mapping[str, Any], report: Report = unreported
) -> list[Data]:
    """Return further positions, of the pool if there is one, with U6 after adding each; the best
    first.

    A position that leaves U6 undetermined comes after those that determine it.

    :raises ExperimentError: the text is invalid.
    """
    experiment = evaluable_of(document, planning=True)
    generate = new_positions if experiment.pool is None else pool_additions
    changes = [each for each in generate(experiment) if isinstance(each.item, Position)]
    candidates = []
    for change in counted(changes, "positions", len(changes), report):
        with suppress(ExperimentError):
            planned = planned_uncertainty(placed_only(changed(experiment, [change])))
            if lengths := planned.quantities.get("U6"):
                order = planned.deficiency, np.nan_to_num(lengths.average, nan=np.inf)
                candidates.append((order, change, lengths))
    candidates.sort(key=lambda candidate: candidate[0])
    best: dict[object, tuple[Any, ...]] = {}
    for candidate in candidates:
        if isinstance(position := candidate[1].item, Position):
            best.setdefault(_kind(experiment, position), candidate)
    before = hours_of(experiment)["hours"]
    # No position may have the name of a group of candidates.
    groups = {each.group for each in experiment.pool.candidates} if experiment.pool else ()
    shown = []
    for order, change, lengths in list(best.values())[:MOST_SHOWN]:
        settings = position_settings(experiment, change.item)
        if settings["name"] in groups:
            settings["name"] += " again"
        added = done(document, {"do": "add", "settings": settings})
        after = evaluable_of(added, planning=True)
        given = given_words(predict(placed_only(changed(experiment, [change]))).qualifications)
        row = {
            "words": (change.words.partition(" again ")[2] or change.words) + given,
            "deficiency": order[0],
            **picked(lengths, "average", "maximum"),
            "minutes": 60.0 * (hours_of(after)["hours"] - before),
            "place": place_data(experiment, change.item),
            "settings": settings,
        }
        shown.append(row)
    return shown


def _kind(experiment: Experiment, position: Position) -> object:
    """Return what positions have alike that differ in little but a shift: probes, plane, and the
    third of the volume that they are in along its normal.
    """
    rows = scale_readings(position, experiment.layouts[position.artefact], experiment.probes)
    normal = np.abs(position.pose.rotation[:, -1]).round(3)
    volume = experiment.machine.volume
    along = float((rows.mean(axis=0) - volume.lower) / volume.size @ normal)
    third = min(int(3.0 * along), 2) if experiment.dimension == 3 else 0
    return position.artefact, position.probes, tuple(normal.tolist()), third
