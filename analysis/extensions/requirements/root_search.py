"""Searches for the value of an unknown that just meets a goal; the value found is judged by a
prediction of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from ballplate.results import PlannedUncertainty, Prediction, planned_uncertainty, predict
from ballplate.simulator.computing import Report, comparable, counted, single_threaded, unreported
from ballplate.simulator.experiment import Experiment, override, placed_only, unspanned
from ballplate.simulator.inputs import ExperimentError, Mapping, Node, Scalar, listing, refused

from .answers import Answer, Reach, Status
from .goals import Goal, Judgement, check_goal, judge
from .plan_hours import hours_answer
from .steps import PER_DECADE
from .unknowns import NAMES, SOURCES, NotVariableError, Unknown, UnknownName, unknown

# Evaluation points, the distances between which are gone through for each value tried.
MOST_POINTS = 10_000

# Columns of balls up to which every number is tried, and the ratio beyond; values of a size that
# are tried first, and about each of the best of them if none does.
EVERY, RATIO, SIZES, REFINED, BEST = 12, 1.25, 32, 12, 4


@dataclass(frozen=True)
class Tried:
    """Result of a value: how the goal is met and the rank deficiency, or why the file is invalid
    with it.
    """

    words: str
    judgement: Judgement | None
    deficiency: int
    refusal: str

    @property
    def is_met(self) -> bool:
        return self.judgement is not None and self.judgement.is_met


@single_threaded
def reach(
    experiment: Experiment,
    goal: Goal,
    names: tuple[UnknownName, ...] = NAMES,
    artefact: str | None = None,
    calibration: int | None = None,
    target: str | None = None,
    report: Report = unreported,
) -> Reach:
    """Solve for each of some unknowns, the others unchanged.

    `artefact` and `calibration`, an index, select the varied ones among several; `target` replaces
    the target uncertainty of the file, and `report` receives the number of unknowns done.

    :raises GoalError: the experiment lacks the subject of the goal.
    :raises NotVariableError: the experiment lacks the single requested unknown.
    :raises ExperimentError: the target is invalid, or there are more than 10,000 evaluation points.
    """
    if not experiment.positions:
        raise refused(
            experiment.source, "missing; reach changes a design that has some", "positions"
        )
    count = len(experiment.evaluation.points)
    if count > MOST_POINTS:
        text = (
            f"{count} points make {count * (count - 1) // 2} distances, which reach computes for"
            " every value that "
        )
        text += (
            f"it tries, some dozens, which takes too long; give at most {MOST_POINTS}, better some"
            " hundred"
        )
        raise refused(experiment.source, text, "evaluation.points")
    root = experiment.tree
    if getattr(experiment.true_machine, "kind", None) != "random":
        # Planning is at zero machine error, and true machines of files take time to check.
        zero = Mapping(root.mark, {"kind": Scalar(root.mark, "zero")}, {"kind": root.mark})
        root = override(root, "true_machine", zero, root.mark)
    if target is not None:
        root = override(root, "target_uncertainty", Scalar(root.mark, target), root.mark)
    # A pool may have artefacts that no position of the file has.
    built, experiment = experiment.builder, placed_only(experiment)
    searched = _Searched(root, lambda tree: placed_only(built(tree)), goal)
    present = searched.uncertainty(root)
    check_goal(goal, present)
    judged = judge(goal, present)
    answers = []
    for name in counted(names, "unknowns", len(names), report):
        try:
            if name == "hours":
                answers.append(hours_answer(built(root), goal))
                continue
            sought = unknown(name, experiment, root, artefact, calibration)
        except NotVariableError as error:
            if len(names) == 1:
                raise
            answers.append(Answer(name, name, "varied", remarks=(str(error),)))
            continue
        answers.append(_answer(sought, searched, judged, present.deficiency))
    limit = ""
    if not judged.is_met and any(answer.status in ("none", "limited") for answer in answers):
        limit = _limit(experiment, root, searched, judged, present.deficiency)
    qualified = predict(searched.built(root)).qualifications
    first = experiment.label, experiment.title, goal, judged, present.deficiency
    return Reach(*first, tuple(answers), limit, qualified)


def _limit(
    experiment: Experiment, root: Node, searched: _Searched, present: Judgement, deficiency: int
) -> str:
    """Return which source of uncertainty limits a design most, as text: the one whose least value
    alone comes nearest to the goal; empty if none comes nearer than now.
    """
    nearest, words = present.distance, ""
    for name in SOURCES:
        with suppress(NotVariableError):
            source = unknown(name, experiment, root, None, None)
            trials = _Trials(source, searched)
            found = trials.at(_best(trials, deficiency)).judgement
            if found is not None and found.distance < nearest * (1.0 - 1e-6):
                nearest = found.distance
                meets = "would meet the goal" if found.is_met else "would give"
                words = (
                    f"limited most by: {source.title}, {source.present}; as good as none"
                    f" {meets}: {found.words}"
                )
    return words


@dataclass(frozen=True)
class _Searched:
    """The file whose values are varied, and the function from its tree to an experiment."""

    root: Node
    built: Callable[[Node], Experiment]
    goal: Goal

    def uncertainty(self, tree: Node) -> PlannedUncertainty:
        """Return the uncertainties of a tree's design.

        :raises ExperimentError: the file is invalid with these values.
        """
        return planned_uncertainty(self.built(tree))


class _Trials:
    """Values of an unknown that were tried, each once."""

    def __init__(self, unknown: Unknown, searched: _Searched) -> None:
        self.one, self.searched = unknown, searched
        self.known: dict[int, Tried] = {}

    def at(self, step: int) -> Tried:
        if step not in self.known:
            self.known[step] = self._tried(step)
        return self.known[step]

    def _tried(self, step: int) -> Tried:
        words = self.one.words(step)
        try:
            uncertainty = self.searched.uncertainty(self.one.tree(step))
        except ExperimentError as error:
            first = error.messages[0]
            return Tried(words, None, 0, f"{first.path}: {first.text}")
        return Tried(words, judge(self.searched.goal, uncertainty), uncertainty.deficiency, "")

    def judgement(self, step: int) -> Judgement:
        """Return the judgement with a value for which the file is valid."""
        reached = self.at(step).judgement
        assert reached is not None
        return reached

    def nearest(self, steps: list[int]) -> int:
        """Return the value nearest to the goal among those for which the file is valid."""
        return steps[int(comparable([self.judgement(step).distance for step in steps]).argmin())]

    def verified(self, step: int) -> Prediction:
        """The prediction with a value."""
        return predict(self.searched.built(self.one.tree(step)))

    def is_right(self, step: int) -> bool:
        """True if the file is valid with a value; quicker than the result."""
        if step not in self.known:
            try:
                self.searched.built(self.one.tree(step))
            except ExperimentError:
                return False
            return True
        return not self.known[step].refusal


def _answer(unknown: Unknown, searched: _Searched, present: Judgement, deficiency: int) -> Answer:
    if unknown.is_monotone and present.undetermined:
        subject = present.undetermined
        reason = f"rank deficiency {deficiency} leaves {subject} undetermined with any value"
        return _without_value(unknown, "undetermined", reason)
    trials = _Trials(unknown, searched)
    return _monotone(trials, deficiency) if unknown.is_monotone else _scanned(trials)


def _without_value(
    searched: Unknown, status: Literal["undetermined", "varied"], remark: str
) -> Answer:
    return Answer(
        searched.name, searched.title, status, searched.present, searched.grows, remarks=(remark,)
    )


def _told(trials: _Trials, status: Status, step: int, remarks: list[str]) -> Answer:
    searched, prediction = trials.one, trials.verified(step)
    verified = judge(trials.searched.goal, prediction)
    assert verified.is_met is (status in ("found", "any"))
    if searched.name == "balls" and verified.is_met and prediction.assumptions is not None:
        remarks += filter(None, [prediction.assumptions.words_of("model")])
    # Where no value does, the smallest one leaves most of the volume out.
    valid = [tried for tried in sorted(trials.known) if trials.known[tried].judgement]
    shown = step if verified.is_met else valid[0]
    if lost := unspanned(trials.searched.root, trials.searched.built(searched.tree(shown))):
        remarks = [*remarks, f"with {searched.words(shown)} {lost}"]
    needed = searched.words(step), searched.value(step), verified.words, "", tuple(remarks)
    first = searched.name, searched.title, status, searched.present, searched.grows
    return Answer(*first, *needed, prediction.qualifications)


def _found(trials: _Trials, met: int, failed: int, remarks: list[str]) -> Answer:
    """The border between a value that does and one that does not, anywhere between these two."""
    while abs(met - failed) > 1:
        middle = (met + failed) // 2
        met, failed = (middle, failed) if trials.at(middle).is_met else (met, middle)
    beside = trials.at(failed)
    words = f"{beside.words} is not enough: " + (
        beside.judgement.words if beside.judgement else beside.refusal
    )
    return replace(_told(trials, "found", met, remarks), beside=words)


def _monotone(trials: _Trials, deficiency: int) -> Answer:
    """The largest uncertainty, or the smallest number, that does."""
    searched = trials.one
    best, worst = (
        (searched.last, searched.first) if searched.grows else (searched.first, searched.last)
    )
    remarks = []
    if not searched.grows and not trials.is_right(worst):
        # An uncertainty that grows with length has an end where no file may state it.
        worst = _border(trials, searched.drawn, worst)
        remarks.append(
            f"more than {searched.words(worst)} is not possible: {trials.at(worst + 1).refusal}"
        )
    if trials.at(worst).is_met:
        return _told(trials, "any", worst, remarks)
    remarks = []
    if searched.grows and not trials.is_right(best):
        best = _border(trials, searched.first, best)
        remarks.append(
            f"more than {searched.words(best)} are not possible: {trials.at(best + 1).refusal}"
        )
    best = best if searched.grows else _best(trials, deficiency)
    if not trials.at(best).is_met:
        return _told(trials, "limited" if remarks else "none", best, remarks)
    return _found(trials, best, worst, [])


def _best(trials: _Trials, deficiency: int) -> int:
    """Return the least uncertainty that does not drown everything else in rounding."""
    best = trials.one.first
    while trials.at(best).deficiency > deficiency and best + PER_DECADE < trials.one.last:
        best += PER_DECADE
    return best


def _border(trials: _Trials, right: int, wrong: int) -> int:
    """Return the last value for which the file is valid, between a valid one, `right`, and an
    invalid one.
    """
    while wrong - right > 1:
        middle = (right + wrong) // 2
        right, wrong = (middle, wrong) if trials.is_right(middle) else (right, middle)
    return right


def _scanned(trials: _Trials) -> Answer:
    """The smallest value that does, where larger ones need not be better."""
    searched = trials.one
    probes = _probes(trials)
    if searched.name == "balls":
        # More balls than do cost time, and need not be looked at.
        probes = probes[: _first_met(trials, probes, len(probes) - 1) + 1]
    usable = [step for step in probes if not trials.at(step).refusal]
    if not usable:
        refusal = trials.at(searched.drawn).refusal or trials.at(probes[0]).refusal
        return _without_value(searched, "varied", refusal)
    remarks = []
    if searched.name == "size" and probes[-1] < searched.last:
        beyond = trials.at(probes[-1] + 1)
        remarks.append(f"from {beyond.words} on, the file is invalid: {beyond.refusal}")
    refused = [trials.at(step) for step in probes if step not in usable]
    if refused:
        remarks.append(
            f"the file is invalid with {listing([searched.words for searched in refused], 3)}:"
            f" {refused[0].refusal}"
        )
    if searched.name == "size" and not any(trials.at(step).is_met for step in usable):
        # What just does may lie beside any value that is better than both its neighbours.
        more = set(probes)
        distances = comparable([trials.judgement(step).distance for step in usable])
        around = np.pad(distances, 1, constant_values=np.inf)
        peaks = np.flatnonzero((distances <= around[:-2]) & (distances <= around[2:]))
        order = peaks[np.argsort(distances[peaks], kind="stable")]
        for best in (probes.index(usable[k]) for k in order[:BEST]):
            ends = probes[max(best - 1, 0)], probes[min(best + 1, len(probes) - 1)]
            more |= {int(step) for step in np.linspace(*ends, REFINED).round()}
        probes = sorted(more)
        usable = [step for step in probes if not trials.at(step).refusal]
    good = _first_met(trials, probes, -1)
    if good < 0:
        if searched.name == "balls":
            remarks.append(f"more than {searched.words(searched.last)} were not tried")
        best = trials.nearest(usable)
        if trials.judgement(best).undetermined:
            reason = (
                f"something stays undetermined with every value from {searched.words(usable[0])} to"
                f" {searched.words(usable[-1])}"
            )
            return _without_value(searched, "undetermined", reason)
        is_limited = searched.name == "size" and best == usable[-1] < searched.last
        return _told(trials, "limited" if is_limited else "none", best, remarks)
    if searched.name == "size":
        again = next(
            (trials.at(step) for step in probes[good:] if not trials.at(step).is_met), None
        )
        remarks += (
            [] if again is None else [f"not every larger one is enough: {again.words} is not"]
        )
    if good == 0:
        return _told(trials, "any", probes[0], remarks)
    return _found(trials, probes[good], probes[good - 1], remarks)


def _first_met(trials: _Trials, probes: list[int], otherwise: int) -> int:
    """Return the index of the first value that meets the goal."""
    return next((k for k, step in enumerate(probes) if trials.at(step).is_met), otherwise)


def _probes(trials: _Trials) -> list[int]:
    """Values that are tried first, in order, within the range in which the file is right."""
    searched = trials.one
    if searched.name == "balls":
        every = range(searched.first, searched.last + 1)
        steps = [
            step
            for step in every
            if searched.value(step) <= max(EVERY, searched.value(searched.first))
        ]
        while steps[-1] < searched.last:
            least = RATIO * searched.value(steps[-1])
            steps.append(
                next(
                    (step for step in every[steps[-1] + 1 :] if searched.value(step) >= least),
                    searched.last,
                )
            )
        return steps
    if not trials.is_right(searched.drawn):
        return []
    last = (
        searched.last
        if trials.is_right(searched.last)
        else _border(trials, searched.drawn, searched.last)
    )
    return sorted({int(step) for step in np.linspace(searched.first, last, SIZES).round()})
