"""Views of a document: what the page asks for during changes, computed in processes beside the
studio's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from ballplate.extensions.repair.yamltext import TextChange
from ballplate.presentation import Data
from ballplate.results import check, predict, scale_lines
from ballplate.simulator.computing import Report, single_threaded, unreported
from ballplate.simulator.estimation import Linearisation, linearise
from ballplate.simulator.experiment import Experiment, lay_out
from ballplate.simulator.inputs import (
    ExperimentError,
    Message,
    optional_service,
    to_list,
    to_python,
)
from ballplate.uncertainty import uncertainties

from .actions import draft_after
from .answers import MAPS, hours_of, motions, rows, scene, summary
from .document import DesignDocument, data_of, variants_of
from .drafts import draft_of, draft_with, evaluable, evaluable_of, problems
from .filling import pool_of
from .processes import Work

Arguments = Mapping[str, Any]


@dataclass(frozen=True)
class DesignJudgement:
    """View of a document's text: its `scene`, None for a text that cannot be understood, and the
    `answer` to what of it can be evaluated, if anything.
    """

    scene: dict[str, Any] | None
    answer: dict[str, Any] | None
    messages: tuple[Message, ...]
    data: Any
    variants: tuple[str, ...]


def judgement(
    document: DesignDocument, arguments: Arguments | None = None, report: Report = unreported
) -> DesignJudgement:
    """Return the view of a document, and faults of its text."""
    variants = variants_of(document) if document.variant else ()
    try:
        draft = draft_of(document)
    except ExperimentError as error:
        return DesignJudgement(None, None, error.messages, data_of(document), variants)
    messages, data = draft.faults or (), to_python(draft.tree)
    answer = None
    try:
        answer = summary(evaluable(draft))
    except ExperimentError as error:
        messages = tuple(dict.fromkeys((*messages, *error.messages)))
    return DesignJudgement(scene(draft, problems(draft)), answer, messages, data, variants)


def previewed(
    document: DesignDocument, action: Arguments, report: Report = unreported
) -> dict[str, Any]:
    """Return the answer to what of a document can be evaluated after an action, as while it moves,
    and what is then wrong with its positions; the action is not written.

    :raises ActionError: the action is unknown or incomplete.
    :raises ExperimentError: nothing can be evaluated.
    """
    draft = draft_after(document, action)
    wrong = problems(draft)
    places = [{"name": place.name, "problem": wrong.get(place.name)} for place in draft.positions]
    return {**summary(evaluable(draft), moving=True), "scene": {"positions": places}}


@single_threaded
def _pictures(document: DesignDocument, arguments: Arguments, report: Report) -> dict[str, Any]:
    """Return all quantities, the `map` of a kind, if there is one of it, the `motion` of a
    direction by its index, and the hours.
    """
    experiment, linearisation, hours = _evaluated(document, arguments["revision"])
    kind, motion, target = (
        arguments.get("map"),
        arguments.get("motion"),
        experiment.target_uncertainty,
    )
    return {
        "quantities": rows(uncertainties(linearisation, target=target)),
        "map": MAPS[kind](experiment, linearisation) if kind in MAPS else None,
        "motions": None if motion is None else motions(linearisation, target, motion),
        **hours,
    }


@lru_cache(maxsize=1)
@single_threaded
def _evaluated(document: DesignDocument, revision: int) -> tuple[Experiment, Linearisation, Data]:
    """Return what can be evaluated, linearised, and its hours: other maps and motions of the same
    revision share them.
    """
    experiment, planned = evaluable_of(document), evaluable_of(document, planning=True)
    return experiment, linearise(lay_out(experiment)), hours_of(planned)


def _support(document: DesignDocument, arguments: Arguments, report: Report) -> dict[str, Any]:
    """Return the source of scale as `lines` of text, and `assumptions`, None without U6; the design
    is evaluated again for each row.
    """
    prediction = predict(evaluable_of(document))
    assumptions, qualified = prediction.assumptions, prediction.qualifications
    texts = [each.text for each in qualified if each.kind != "assumption"]
    assumed = "; ".join(each.text for each in qualified if each.kind == "assumption")
    return {
        "lines": [*scale_lines(prediction.scale), *texts],
        "assumptions": assumptions and {**assumptions.to_dict(), "warning": assumed},
    }


def _matrix(document: DesignDocument, arguments: Arguments, report: Report) -> dict[str, Any]:
    """Return how much of each error's information goes with each position, and with one of given
    `settings` that is added; empty without the extension that computes it.
    """
    information = optional_service("position_information")
    if information is None:
        return {}
    draft, candidates = draft_of(document), []
    experiment = evaluable(draft)
    if settings := arguments.get("settings"):
        change = TextChange(("positions",), to_list(settings), "append")
        candidates.append(evaluable(draft_with(draft, [change])))
    # A candidate that cannot be read is none.
    added = [each for each in candidates if len(each.positions) > len(experiment.positions)]
    data: dict[str, Any] = information(check(experiment), added).to_dict()
    return data


def pooled(
    document: DesignDocument, arguments: Arguments | None = None, report: Report = unreported
) -> dict[str, Any]:
    """Return the candidates of a document's pool, as plain data; see `pool_of`.

    :raises ExperimentError: nothing of it can be evaluated.
    """
    return pool_of(evaluable_of(document, planning=True))


VIEWS: Mapping[str, Work] = {
    "preview": previewed,
    "drawn": _pictures,
    "later": _support,
    "matrix": _matrix,
    "pool": pooled,
}
"""Views that the page asks for by these names besides the judgement."""
