"""What even all candidates of a pool together leave undetermined, and what would determine it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from ballplate.simulator.experiment.model import Candidate, Experiment
from ballplate.simulator.experiment.pool import with_chosen
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.inputs.settings import listing

from ..rank.verdict import Verdict
from ..results.study import check
from .repair.repair_search import Repair, repairs
from .repair.repair_tables import changed_names, changes_in_words

# Names of errors, and cures, that are told.
MOST_NAMES, MOST_CURES = 8, 2


@dataclass(frozen=True, eq=False)
class PoolGap:
    """What all `candidates` of a pool leave undetermined, by the `verdict` of a design with all of
    them; `cures` would determine all of it, or else `partial` ones some.
    """

    candidates: int
    verdict: Verdict
    cures: tuple[Repair, ...]
    partial: tuple[Repair, ...]

    @property
    def words(self) -> str:
        """What stays open, by the names of the errors."""
        null = self.verdict.null
        names = dict.fromkeys(name for direction in null for name in changed_names(direction))
        count = "one direction" if len(null) == 1 else f"{len(null)} directions"
        return (
            f"even all {self.candidates} candidates together leave {count} undetermined"
            f" ({listing(names, MOST_NAMES)})"
        )

    @property
    def remedy(self) -> str:
        """What would determine it."""
        if self.verdict.as_expected:
            return "the file expects that"
        cures = self.cures or self.partial
        if not cures:
            return "no change was found that would determine it"
        all_of_it = "it" if self.cures else "part of it"
        told = "; or ".join(changes_in_words(one) for one in cures[:MOST_CURES])
        return f"what would determine {all_of_it}, offered or done beside these: {told}"

    def to_dict(self) -> dict[str, Any]:
        return {
            "deficiency": self.verdict.deficiency,
            "undetermined": [str(one) for one in self.verdict.null],
            "cures": [changes_in_words(one) for one in self.cures],
            "partial_cures": [changes_in_words(one) for one in self.partial],
        }

    def refusing(self, error: ExperimentError) -> ExperimentError:
        """An error of the pool with what stays open, and what would determine it."""
        told = f"{self.words}; {self.remedy}"
        return ExperimentError(replace(one, text=f"{one.text}; {told}") for one in error.messages)


def pool_gap(experiment: Experiment, candidates: Sequence[Candidate]) -> PoolGap:
    """Judge the design that has all candidates of a pool that is deficient.

    :raises ExperimentError: they cannot stand in one design.
    """
    whole = with_chosen(experiment, candidates)
    judged = check(whole).verdict
    found = None if judged.as_expected else repairs(whole)
    cures, partial = ((), ()) if found is None else (found.complete, found.partial)
    return PoolGap(len(candidates), judged, cures, partial)
