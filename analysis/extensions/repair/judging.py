"""Fast assessment of changed experiments: the verdict without its words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from ballplate.rank import effects, weak_limit
from ballplate.simulator.computing import above, comparable, lstsq
from ballplate.simulator.estimation import Linearisation, linearise
from ballplate.simulator.experiment import Experiment, lay_out, placed_only
from ballplate.simulator.inputs import ExperimentError
from ballplate.simulator.machines import Array

from .changes import Change, apply_all

# Part of a null direction that counts as its being there, and not rounding.
COMPONENT_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Judged:
    """Rank of a design and its least determined direction.

    `weak` counts weakly determined directions, `worst` is the effect of one standard deviation
    along the weakest on corrected points, and `spread` that of all directions together, in metres.
    `open_errors` (model parameters, deficiency) are the machine errors of null directions, in
    micrometres.
    """

    deficiency: int
    weak: int
    worst: float
    spread: float
    smallest: float
    open_errors: Array

    @property
    def is_cured(self) -> bool:
        """True if every direction is determined, none of them weakly."""
        return not self.deficiency and not self.weak

    @property
    def order(self) -> tuple[int, int, float]:
        """The better, the smaller."""
        return self.deficiency, self.weak, float(comparable(self.spread))


@dataclass(frozen=True, eq=False)
class Examined:
    """An experiment and its design, linearised."""

    experiment: Experiment
    at: Linearisation

    @cached_property
    def judged(self) -> Judged:
        """The summary."""
        known_spectrum, model = self.at.spectrum, self.at.layout.model
        effect = effects(self.at)
        limit = weak_limit(self.at.design, self.experiment.target_uncertainty)
        return Judged(
            known_spectrum.deficiency,
            int(above(effect, limit).sum()),
            float(effect.max(initial=0.0)),
            float(np.sqrt((effect**2).sum())),
            float(known_spectrum.values[known_spectrum.rank - 1]) if known_spectrum.rank else 0.0,
            known_spectrum.null[model] / known_spectrum.scale[model, None],
        )


def examine(experiment: Experiment) -> Examined:
    """Return the rank of an experiment's full design, without artefacts that only its pool uses.

    :raises ExperimentError: the design cannot be laid out.
    """
    return Examined(experiment, linearise(lay_out(placed_only(experiment))))


def judge(experiment: Experiment, changes: Sequence[Change] = ()) -> Judged | None:
    """Return the rank of an experiment after changes, unless these contradict other statements in
    it.
    """
    try:
        return examine(apply_all(changes, experiment)).judged
    except ExperimentError:
        return None


def work(base: Examined) -> float:
    """Size of one judgement: observations times shared parameters."""
    return float(base.at.design.observation_count * len(base.at.layout))


def removed(before: Array, after: Array) -> tuple[int, ...]:
    """Return the null directions, described by their machine errors (parameters, k), that are
    outside the space of those afterwards.

    Directions without machine errors, or with those of others, are never reported as removed.
    """
    if not after.shape[1]:
        return tuple(range(before.shape[1]))
    parts, _, rank, _ = lstsq(before, after, rcond=1e-9)
    if rank < before.shape[1]:
        return ()
    return tuple(
        int(k)
        for k in np.flatnonzero(
            np.abs(parts).max(axis=1) < COMPONENT_TOLERANCE * max(np.abs(parts).max(), 1e-300)
        )
    )
