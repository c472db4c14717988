"""What a changed experiment would determine: everything but the words of a verdict, as many are compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from simulator.design import Design, nominal_state
from simulator.estimation.covariance import Covariance, Spectrum, covariance, spectrum
from simulator.estimation.elimination import Factor, eliminate
from simulator.estimation.observations import reading_blocks
from simulator.estimation.parameters import SharedLayout, shared_layout
from simulator.experiment.messages import ExperimentError
from simulator.experiment.model import DistanceCalibration, Experiment, Position
from simulator.layout import lay_out
from simulator.machines.protocol import Array

from ..rank import effects, weak_limit
from .changes import Change, apply_all

# Rows on null directions, in standard deviations per micrometre, that count for more than rounding.
SEEN = 1e-6
# Part of a null direction that counts as its being there, and not rounding.
THERE = 1e-6


@dataclass(frozen=True)
class Judged:
    """A design's rank and what it knows least.

    `weak` counts weakly determined directions, `worst` is what one standard deviation along the weakest adds to
    corrected points, and `spread` the same of all directions together, in metres. `open_errors` (model parameters,
    deficiency) is what null directions do to the machine, scaled to micrometres.
    """

    deficiency: int
    weak: int
    worst: float
    spread: float
    smallest: float
    open_errors: Array

    @property
    def is_cured(self) -> bool:
        """Whether nothing is undetermined, or weakly determined."""
        return not self.deficiency and not self.weak

    @property
    def order(self) -> tuple[int, int, float]:
        """The better, the smaller."""
        return self.deficiency, self.weak, self.spread


@dataclass(frozen=True, eq=False)
class Examined:
    """A design with its factor and spectrum."""

    experiment: Experiment
    design: Design
    layout: SharedLayout
    factor: Factor
    spectrum: Spectrum

    @cached_property
    def judged(self) -> Judged:
        """The summary."""
        found, model = self.spectrum, self.layout.model
        effect = effects(self.design, self.layout, found)
        limit = weak_limit(self.design, self.experiment.target_accuracy)
        return Judged(
            found.deficiency,
            int((effect > limit).sum()),
            float(effect.max(initial=0.0)),
            float(np.sqrt((effect**2).sum())),
            float(found.values[found.rank - 1]) if found.rank else 0.0,
            found.null[model] / found.scale[model, None],
        )

    @cached_property
    def spread(self) -> Covariance:
        """How balls follow null directions."""
        return covariance(self.design, self.factor, self.spectrum)


def examine(experiment: Experiment) -> Examined:
    """Rank of an experiment's design in full.

    :raises ExperimentError: the design cannot be laid out.
    """
    design = lay_out(experiment)
    layout = shared_layout(design)
    factor = eliminate(design, layout, nominal_state(design))
    return Examined(experiment, design, layout, factor, spectrum(factor))


def judge(experiment: Experiment, changes: Sequence[Change] = ()) -> Judged | None:
    """What an experiment determines after changes; None where they contradict something else that it says."""
    try:
        return examine(apply_all(changes, experiment)).judged
    except ExperimentError:
        return None


def work(base: Examined) -> float:
    """Size of one judgement: observations times shared parameters."""
    return float(base.design.observations * len(base.layout))


def seen_by(base: Examined, changes: Sequence[Change]) -> dict[Change, Array]:
    """What the observations that changes add say of the null directions: a triangle (deficiency, deficiency) for each.

    The pose of an added position is eliminated. Changes that do more than add positions or distances of artefacts that
    are read already are left out. A set of changes removes as many directions as the rank of its triangles together.
    """
    design, null = base.design, base.spectrum.null
    found: dict[Change, Array] = {}
    if not base.spectrum.deficiency:
        return found
    by_ball = base.spread.ball_null
    balls = {name: np.flatnonzero(design.ball_artefact == k) for k, name in enumerate(design.artefact_names)}
    placed = {place.artefact for place in base.experiment.positions}
    added: list[Position] = []
    where: dict[Change, int] = {}
    for change in changes:
        item = change.adds
        if isinstance(item, DistanceCalibration) and base.experiment.artefacts[item.artefact].role == "plate":
            ends = design.balls[balls[item.artefact][item.pairs]].copy()
            ends[:, :, item.dimensions :] = 0.0
            along = ends[:, 0] - ends[:, 1]
            along /= np.linalg.norm(along, axis=1)[:, None] * item.standard_uncertainties[:, None]
            moved = by_ball[balls[item.artefact][item.pairs]]
            found[change] = _triangle(np.einsum("md,mdk->mk", along, moved[:, 0] - moved[:, 1]))
        elif (
            isinstance(item, Position)
            and item.artefact in placed
            and base.experiment.artefacts[item.artefact].role == "plate"
        ):
            where[change] = len(base.experiment.positions) + len(added)
            added.append(replace(item, name=f"candidate {len(added)} {item.name}"))
    if where:
        extended = lay_out(replace(base.experiment, positions=(*base.experiment.positions, *added)))
        order = np.argsort(extended.readings.position, kind="stable")
        first = np.searchsorted(extended.readings.position[order], np.arange(len(extended.position_names) + 1))
        state = nominal_state(extended)
        for change, k in where.items():
            readings = extended.readings.select(order[first[k] : first[k + 1]])
            blocks = reading_blocks(extended, state, readings, None)
            rows = blocks.by_model @ null[base.layout.model] + blocks.by_ball @ by_ball[readings.ball]
            if blocks.by_offset is not None:
                columns = base.layout.offset_columns[readings.probe]
                offset_null = np.where(columns[:, :, None] >= 0, null[columns], 0.0)
                rows = rows + blocks.by_offset @ offset_null
            flat, poses = rows.reshape(-1, rows.shape[2]), blocks.by_pose.reshape(-1, blocks.by_pose.shape[2])
            u, sizes, _ = np.linalg.svd(poses, full_matrices=False)
            u = u[:, sizes > 1e-10 * sizes[0]]
            found[change] = _triangle(flat - u @ (u.T @ flat))
    return found


def _triangle(rows: Array) -> Array:
    """A square factor with the same product R' R."""
    k = rows.shape[1]
    found = np.linalg.qr(np.concatenate([rows, np.zeros((k, k))]), mode="r")
    return np.asarray(found)


def rank_of(triangles: Sequence[Array]) -> int:
    """How many directions the triangles together remove."""
    if not triangles:
        return 0
    return int((np.linalg.svd(np.concatenate(list(triangles)), compute_uv=False) > SEEN).sum())


def weakest_of(triangles: Sequence[Array]) -> float:
    """How well the triangles together show the direction that they show least, in standard deviations."""
    return float(np.linalg.svd(np.concatenate(list(triangles)), compute_uv=False)[-1])


def removed(before: Array, after: Array) -> tuple[int, ...]:
    """Which null directions, told by what they do to the machine (parameters, k), are no part of those afterwards.

    Directions that do nothing to the machine, or the same as others, are never told as removed.
    """
    if not after.shape[1]:
        return tuple(range(before.shape[1]))
    parts, _, rank, _ = np.linalg.lstsq(before, after, rcond=1e-9)
    if rank < before.shape[1]:
        return ()
    return tuple(int(k) for k in np.flatnonzero(np.abs(parts).max(axis=1) < THERE * max(np.abs(parts).max(), 1e-300)))
