"""The rank of every design in some files; one that cannot be used does not keep the others from being checked."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from simulator.experiment.load import load, place_in
from simulator.experiment.messages import ExperimentError, Message
from simulator.experiment.model import Experiment
from simulator.experiment.yamltree import Mark
from simulator.settings import hint

from .study import Plan, check


@dataclass(frozen=True)
class CheckedDesign:
    """The verdict on one design; `place` is where its file should change, None where the rank is as expected."""

    plan: Plan
    place: Mark | None


@dataclass(frozen=True)
class CheckedFile:
    """What came of a file: its designs, each variant one of its own, or the reasons why it cannot be used."""

    file: str
    designs: tuple[CheckedDesign, ...]
    messages: tuple[Message, ...]

    @property
    def as_expected(self) -> bool:
        """Whether all designs have the rank that the file expects."""
        return all(design.plan.verdict.as_expected for design in self.designs)


def check_files(files: Sequence[Path], variants: Sequence[str] = ()) -> Iterator[CheckedFile]:
    """Check all files, one after the other; with `variants` only designs of these names.

    A variant that no file has is told last, as the error of all files together.
    """
    found: set[str | None] = set()
    complete = True
    for path in files:
        try:
            experiments = load(path)
            found |= {experiment.name for experiment in experiments}
            chosen = [one for one in experiments if not variants or one.name in variants]
            yield CheckedFile(str(path), tuple(map(_checked, chosen)), ())
        except ExperimentError as error:
            complete = False
            yield CheckedFile(str(path), (), error.messages)
    # A file that cannot be used may be the one that has the variant.
    unknown = [name for name in variants if name not in found] if complete else []
    if unknown:
        every = ", ".join(map(str, files))
        known = sorted(name for name in found if name is not None)
        texts = [f'no variant "{name}"; {hint(name, known)}' for name in unknown]
        yield CheckedFile(every, (), tuple(Message(every, 0, 0, "", text) for text in texts))


def _checked(experiment: Experiment) -> CheckedDesign:
    plan = check(experiment)
    if plan.verdict.as_expected:
        return CheckedDesign(plan, None)
    return CheckedDesign(plan, place_in(experiment.source, experiment.name, ("expected_rank_deficiency",)))
