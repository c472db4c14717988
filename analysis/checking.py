"""The rank of every design in some files; one that cannot be used does not keep the others from being checked."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from simulator.experiment.load import load, place_in
from simulator.experiment.messages import ExperimentError, Message
from simulator.experiment.model import Experiment
from simulator.experiment.variants import unknown_variants
from simulator.experiment.yamltree import Mark

from .study import Plan, check

if TYPE_CHECKING:
    from .planning.repair.search import Repairs


@dataclass(frozen=True)
class CheckedDesign:
    """The verdict on one design; `place` is where its file should change, None where the rank is as expected.

    `repairs` are changes that would determine what is open, None where nothing is or none were asked for.
    """

    plan: Plan
    place: Mark | None
    repairs: Repairs | None = None


@dataclass(frozen=True)
class CheckedFile:
    """What came of a file: its designs, each variant one of its own, or the reasons why it cannot be used.

    `doubts` are about what is possible, and unlikely to be meant.
    """

    file: str
    designs: tuple[CheckedDesign, ...]
    messages: tuple[Message, ...]
    doubts: tuple[str, ...] = ()

    @property
    def as_expected(self) -> bool:
        """Whether all designs have the rank that the file expects."""
        return all(design.plan.verdict.as_expected for design in self.designs)


def check_files(
    files: Sequence[Path], variants: Sequence[str] = (), with_repairs: bool = False
) -> Iterator[CheckedFile]:
    """Check all files, one after the other; with `variants` only designs of these names.

    With `with_repairs` what would determine the rest is looked for.

    A variant that no file has is told last, as the error of all files together.
    """
    found: set[str | None] = set()
    complete = True
    for path in files:
        try:
            experiments = load(path)
            found |= {experiment.name for experiment in experiments}
            chosen = [one for one in experiments if not variants or one.name in variants]
            # What a plan may choose from is loaded where it is asked for only.
            pools = {one.name: one for one in load(path, planning=True)} if with_repairs else {}
            doubts = tuple(dict.fromkeys(doubt for one in chosen for doubt in one.doubts))
            yield CheckedFile(str(path), tuple(_checked(one, pools.get(one.name)) for one in chosen), (), doubts)
        except ExperimentError as error:
            complete = False
            yield CheckedFile(str(path), (), error.messages)
    # A file that cannot be used may be the one that has the variant.
    messages = unknown_variants(files, variants, found) if complete else ()
    if messages:
        yield CheckedFile(messages[0].file, (), messages)


def _checked(experiment: Experiment, with_pool: Experiment | None) -> CheckedDesign:
    plan = check(experiment)
    found = None
    if with_pool is not None:
        from .planning.repair.search import repairs

        found = repairs(with_pool)
    if plan.verdict.as_expected:
        return CheckedDesign(plan, None, found)
    return CheckedDesign(plan, place_in(experiment.source, experiment.name, ("expected_rank_deficiency",)), found)
