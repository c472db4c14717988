"""Rank of every design in several files; a file that cannot be used does not prevent the check
of the others.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ballplate.simulator.computing.steps import Report, counted, unreported
from ballplate.simulator.experiment.changes import unknown_variants
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.extensions import service
from ballplate.simulator.inputs.messages import ExperimentError, Message
from ballplate.simulator.inputs.settings import number_of
from ballplate.simulator.inputs.trust import OPENED, Trust
from ballplate.simulator.inputs.yamltree import Mark

from .extension_results import AskedResult
from .prediction import Advice, Prediction, check
from .qualifications import given_words

WITH_MODULES = "leave --no-modules out if you trust the file"


@dataclass(frozen=True)
class CheckedDesign:
    """Verdict on one design; `place` locates the line of the file to change.

    `suggestions` are changes that would determine all parameters, if requested. `goals` state how
    each goal is met, and `missed` the goals not met and, with --fail-weak, weak directions.
    """

    prediction: Prediction
    place: Mark | None
    suggestions: AskedResult | None = None
    goals: tuple[str, ...] = ()
    missed: tuple[str, ...] = ()

    @property
    def complaints(self) -> tuple[str, ...]:
        """Failures: the rank, then goals and weak directions."""
        complaint = self.prediction.verdict.complaint
        return (*([complaint] if complaint else []), *self.missed)


@dataclass(frozen=True)
class Wanted:
    """Checks requested beyond the rank: `goals`, and failure on a weak direction.

    `repairs` requests a search for changes that determine the rest. Without `with_modules` no code
    named by a file runs, and files outside the current folder and the file's own folder are not
    read.
    """

    goals: tuple[Any, ...] = ()
    nothing_weak: bool = False
    repairs: bool = False
    with_modules: bool = True

    def trust(self, path: Path) -> Trust:
        """The trust in a file."""
        if self.with_modules:
            return OPENED
        # A file below the current folder may name any file there, another one those in its own
        # folder.
        here, folder = Path.cwd(), path.resolve().parent
        within = here if folder.is_relative_to(here) else folder
        return Trust(within=within, remedy=WITH_MODULES)


@dataclass(frozen=True)
class CheckedFile:
    """Result of a file: its designs, one per variant, or the reasons why it is unusable.

    `doubts` are possible but improbable statements, `notes` are detected settings.
    """

    file: str
    designs: tuple[CheckedDesign, ...]
    messages: tuple[Message, ...]
    doubts: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def as_expected(self) -> bool:
        """True if all designs have the expected rank and meet the requested goals."""
        return not any(design.complaints for design in self.designs)


def check_files(
    files: Sequence[Path],
    variants: Sequence[str] = (),
    wanted: Wanted = Wanted(),
    report: Report = unreported,
) -> Iterator[CheckedFile]:
    """Check files in sequence; with `variants`, only designs of these names.

    An unknown variant is reported last, as an error of all files together. Progress counts files,
    the designs of a single file, or the search for repairs of a single design.
    """
    names_seen = set()
    complete = True
    within = report if len(files) == 1 else unreported
    for path in counted(files, "files", len(files), report) if len(files) > 1 else files:
        try:
            trust = wanted.trust(path)
            experiments = load(path, trust=trust)
            names_seen |= {experiment.name for experiment in experiments}
            chosen = [
                variant for variant in experiments if not variants or variant.name in variants
            ]
            # What a plan may choose from is loaded where it is asked for only.
            pools = {}
            if wanted.repairs:
                pools = {variant.name: variant for variant in load(path, True, trust)}
            doubts = tuple(dict.fromkeys(doubt for variant in chosen for doubt in variant.doubts))
            notes = tuple(dict.fromkeys(note for variant in chosen for note in variant.notes))
            is_single = len(chosen) == 1
            to_check = chosen if is_single else counted(chosen, "designs", len(chosen), within)
            of_search = within if is_single else unreported
            judged = tuple(
                checked_design(experiment, pools.get(experiment.name), wanted, of_search)
                for experiment in to_check
            )
            yield CheckedFile(str(path), judged, (), doubts, notes)
        except ExperimentError as error:
            complete = False
            yield CheckedFile(str(path), (), error.messages)
    # A file that cannot be used may be the one that has the variant.
    messages = unknown_variants(files, variants, names_seen) if complete else ()
    if messages:
        yield CheckedFile(messages[0].file, (), messages)


def checked_design(
    experiment: Experiment,
    with_pool: Experiment | None,
    wanted: Wanted,
    report: Report = unreported,
) -> CheckedDesign:
    """An experiment judged, with changes looked for in its pool if there is one."""
    prediction = check(experiment)
    suggestions = None
    if with_pool is not None:
        suggestions = service("suggested")(with_pool, prediction, report)
    goals, missed = _judged(experiment, wanted.goals, prediction)
    if wanted.nothing_weak and prediction.verdict.weak:
        count = len(prediction.verdict.weak)
        missed += (number_of(count, "weakly determined direction"),)
    checked = _advised(CheckedDesign(prediction, None, suggestions, goals, missed))
    if not checked.complaints:
        return checked
    steps: tuple[str, ...] = (
        ("expected_rank_deficiency",) if prediction.verdict.complaint else ("target_uncertainty",)
    )
    # The line of the file that a complaint is about, as far as there is one.
    kinds = {goal.kind for goal in wanted.goals}
    if not prediction.verdict.complaint and len(kinds) == 1:
        own = {"tasks": ("evaluation", "tasks"), "dimensions": ("part",)}
        steps = own.get(kinds.pop(), steps)
    return replace(checked, place=experiment.place(steps))


def _advised(design: CheckedDesign) -> CheckedDesign:
    """Return a design with the goals its prediction meets, and suggestions."""
    prediction = design.prediction
    lines = [*design.goals]
    data = {"goals": list(design.goals), "missed": list(design.missed)}
    if design.suggestions is not None:
        lines += design.suggestions.lines()
        data |= design.suggestions.to_dict()
    advice = Advice(design.missed, tuple(lines), data)
    return replace(design, prediction=replace(prediction, advice=advice))


def _judged(
    experiment: Experiment, goals: Sequence[Any], prediction: Prediction
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    if not goals:
        return (), ()
    given = given_words(prediction.qualifications)
    goals_met, missed = service("judged_goals")(experiment, goals, given)
    return goals_met, missed
