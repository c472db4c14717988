"""Suggestions: repairs of undetermined directions, and further positions that lower the
uncertainty most.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ballplate.extensions.repair.changes import ChangeKind, apply_all
from ballplate.extensions.repair.offers import offers
from ballplate.extensions.repair.repair_search import Repair, repairs
from ballplate.extensions.repair.repair_tables import caveat, changes_in_words
from ballplate.extensions.repair.written import Edit, position_settings
from ballplate.presentation import Data
from ballplate.results import planned_uncertainty
from ballplate.simulator.computing import Report, counted, unreported
from ballplate.simulator.experiment import Experiment, Position
from ballplate.simulator.inputs import ExperimentError

from .answers import place_data
from .document import DesignDocument
from .drafts import evaluable_of

# Positions more that are told.
MOST_TOLD = 5


def suggested_repairs(
    document: DesignDocument, settings: Mapping[str, Any], report: Report = unreported
) -> list[dict[str, Any]]:
    """Return full repairs, as text, with the positions that they add or move, as plain data.

    :raises ExperimentError: the text is invalid.
    """
    experiment = evaluable_of(document, planning=True)
    repairs_found = repairs(experiment, report=report)
    complete = () if repairs_found is None else repairs_found.complete
    return [_repair_data(experiment, repair) for repair in complete]


def _repair_data(experiment: Experiment, repair: Repair) -> Data:
    after = apply_all(repair.changes, experiment)
    before = {position.name: position for position in experiment.positions}
    places = [position for position in after.positions if before.get(position.name) is not position]
    lengths = None if repair.prediction is None else repair.prediction.lengths
    return {
        "words": changes_in_words(repair) + caveat(repair),
        "faint": repair.is_faint,
        "weak": repair.weak,
        "average": None if lengths is None else lengths.average,
        "maximum": None if lengths is None else lengths.maximum,
        "places": [place_data(after, place) for place in places],
        "edits": [_edit_data(edit) for edit in (*repair.edits, *_expectation(experiment))],
    }


def _expectation(experiment: Experiment) -> tuple[Edit, ...]:
    """Return the edit of an expected rank deficiency to full rank, if the file expects one."""
    expected_deficiency = experiment.expected_rank_deficiency
    return (Edit(("expected_rank_deficiency",), 0),) if expected_deficiency else ()


def _edit_data(edit: Edit) -> Data:
    return {"path": list(edit.steps), "value": edit.value, "is_new": edit.is_new}


def next_positions(
    document: DesignDocument, settings: Mapping[str, Any], report: Report = unreported
) -> list[dict[str, Any]]:
    """Return further positions, of the pool if there is one, with U6 after adding each; the best
    first.

    A position that leaves U6 undetermined comes after those that determine it.

    :raises ExperimentError: the text is invalid.
    """
    experiment = evaluable_of(document, planning=True)
    changes = [
        candidate
        for kind in (ChangeKind.POOL, ChangeKind.ADD_POSITION)
        for candidate in _offered(experiment, kind)
    ]
    candidates = []
    for change in counted(changes, "positions", len(changes), report):
        assert isinstance(change.adds, Position)
        try:
            planned = planned_uncertainty(change.apply(experiment))
        except ExperimentError:
            continue
        lengths = planned.quantities.get("U6")
        if lengths is None:
            continue
        undetermined = lengths.average != lengths.average
        order = (planned.deficiency, undetermined, lengths.average if not undetermined else 0.0)
        candidates.append((order, change, lengths))
    candidates.sort(key=lambda candidate: candidate[0])
    return [
        {
            "words": change.words,
            "deficiency": order[0],
            "average": None if order[1] else lengths.average,
            "maximum": None if order[1] else lengths.maximum,
            "place": place_data(experiment, change.adds),
            "settings": position_settings(experiment, change.adds),
        }
        for order, change, lengths in candidates[:MOST_TOLD]
        if isinstance(change.adds, Position)
    ]


def _offered(experiment: Experiment, kind: ChangeKind) -> Iterator[Any]:
    for change in offers(experiment, False).get(kind, ()):
        if isinstance(change.adds, Position):
            yield change
