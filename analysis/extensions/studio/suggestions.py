"""Suggestions: repairs of undetermined directions, and further positions that lower the
uncertainty most.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np
from ballplate.extensions.repair.changes import ChangeKind, apply_all
from ballplate.extensions.repair.offers import offers
from ballplate.extensions.repair.repair_search import Repair, repairs
from ballplate.extensions.repair.repair_tables import caveat, changes_in_words
from ballplate.extensions.repair.written import Edit, position_settings
from ballplate.presentation import Data, picked
from ballplate.results import given_words, planned_uncertainty, predict
from ballplate.simulator.computing import Report, counted, unreported
from ballplate.simulator.experiment import Experiment, Position
from ballplate.simulator.inputs import ExperimentError

from .answers import place_data
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
    found = repairs(experiment, report=report)
    return [_repair_data(experiment, repair) for repair in (found.complete if found else ())]


def _repair_data(experiment: Experiment, repair: Repair) -> Data:
    after = apply_all(repair.changes, experiment)
    before = {position.name: position for position in experiment.positions}
    places = [position for position in after.positions if before.get(position.name) is not position]
    lengths = None if repair.prediction is None else repair.prediction.lengths
    # The repaired file is one of full rank, whatever it expected.
    expectation = [Edit(("expected_rank_deficiency",), 0)] * bool(
        experiment.expected_rank_deficiency
    )
    return {
        "words": changes_in_words(repair) + caveat(repair),
        "faint": repair.is_faint,
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
    offered = offers(experiment)
    changes = [
        change
        for kind in (ChangeKind.POOL, ChangeKind.ADD_POSITION)
        for change in offered.get(kind, ())
        if isinstance(change.adds, Position)
    ]
    candidates = []
    for change in counted(changes, "positions", len(changes), report):
        with suppress(ExperimentError):
            planned = planned_uncertainty(change.apply(experiment))
            if lengths := planned.quantities.get("U6"):
                order = planned.deficiency, np.nan_to_num(lengths.average, nan=np.inf)
                candidates.append((order, change, lengths))
    candidates.sort(key=lambda candidate: candidate[0])
    return [
        {
            "words": change.words + given_words(predict(change.apply(experiment)).qualifications),
            "deficiency": order[0],
            **picked(lengths, "average", "maximum"),
            "place": place_data(experiment, change.adds),
            "settings": position_settings(experiment, change.adds),
        }
        for order, change, lengths in candidates[:MOST_SHOWN]
        if isinstance(change.adds, Position)
    ]
