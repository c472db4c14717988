"""What is compared between replicates and the truth: the quantities behind U1 to U6, one vector each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from ballplate.simulator.design import probe_offsets
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.estimation.observations import offset_sensitivity
from ballplate.simulator.geometry.motions import vector_from_rotation
from ballplate.simulator.machines.protocol import Array, Integers
from ballplate.simulator.montecarlo.reference import Reference
from ballplate.simulator.montecarlo.replicates import Deviations
from ballplate.simulator.threads import single_threaded

# Distances that are followed through all replicates; a sample of the pairs where there are more.
MOST_PAIRS = 1000


@dataclass(frozen=True)
class Target:
    """A vector of q quantities.

    `base` (q,) is its error in the estimate from readings without noise, `uncertainty` (q,) the linearised standard
    uncertainties, `change` its change (b, q) in replicates, `units` (q,) metres, radians or 1. `sampled` tells that q
    is a sample of all pairs.
    """

    symbol: str
    base: Array
    uncertainty: Array
    units: tuple[str, ...]
    change: Callable[[Deviations], Array]
    sampled: bool = False


@single_threaded
def targets(shared: Reference) -> tuple[Target, ...]:
    """The quantities of U1 to U6 that a design has; U3 only where the true machine is one of the fitted model's."""
    design, start, truth = shared.design, shared.start, shared.truth
    found = shared.linearisation
    result = [_balls(shared, found), _poses(shared, found)]
    if truth.model == design.model:
        result.append(_parameters(shared, found))
    for artefact in np.flatnonzero(design.is_plate):
        own = np.flatnonzero(design.ball_artefact == artefact)
        if len(own) > 1:
            result.append(_ball_distances(shared, found, own))
    if len(design.points):
        probe, layout = design.point_probe, shared.factor.layout
        offsets = np.broadcast_to(probe_offsets(design, start)[probe], design.points.shape)
        true_offsets = np.broadcast_to(probe_offsets(design, truth.state)[probe], design.points.shape)
        corrected = design.points + design.model.error(design.points, start.a, offsets)
        true = design.points + truth.model.error(design.points, truth.state.a, true_offsets)
        jacobian = design.model.jacobian(design.points, start.a, offsets)
        by_offset = offset_sensitivity(design.model, design.points, start.a, offsets)
        free = layout.offset_columns[probe] >= 0
        spread = jacobian @ found.shared[layout.model]
        spread += by_offset[:, :, free] @ found.shared[layout.offset_columns[probe][free]]

        def moved(replicates: Deviations) -> Array:
            none = np.zeros((len(replicates.a), design.dimension, len(design.points)))
            if not free.any():
                return shared.points.change(none, replicates.a)
            moved_probe = np.broadcast_to(replicates.offsets[:, probe, :, None], none.shape)
            return shared.points.change(none, replicates.a, moved_probe)

        def errors(replicates: Deviations) -> Array:
            return moved(replicates).swapaxes(1, 2).reshape(-1, design.points.size)

        base = (corrected - true).ravel()
        values = np.sqrt((spread**2).sum(axis=2)).ravel()
        result.append(Target("U4", base, values, ("m",) * len(base), errors))
        own_none = np.zeros((*corrected.shape, design.dimension))
        result.append(_distances("U6", corrected, true, spread, own_none, moved))
    order = ["U1", "U2", "U3", "U4", "U5", "U6"]
    found_uncertain = [uncertain for target in result if (uncertain := _uncertain(target)) is not None]
    return tuple(sorted(found_uncertain, key=lambda target: order.index(target.symbol)))


def _uncertain(target: Target) -> Target | None:
    """A target without the members that no observation could change; None where nothing is left."""
    kept = target.uncertainty > 0.0
    if not kept.any():
        return None
    if kept.all():
        return target
    units = tuple(unit for unit, keep in zip(target.units, kept, strict=True) if keep)

    def change(replicates: Deviations) -> Array:
        return target.change(replicates)[:, kept]

    return Target(target.symbol, target.base[kept], target.uncertainty[kept], units, change, target.sampled)


def _balls(shared: Reference, found: Linearisation) -> Target:
    balls = shared.design.plate_balls
    base = (shared.start.balls - shared.truth.state.balls)[balls].ravel()
    values = found.of_balls()[balls].ravel()

    def change(replicates: Deviations) -> Array:
        return replicates.balls[:, :, balls].swapaxes(1, 2).reshape(-1, len(base))

    return Target("U1", base, values, ("m",) * len(base), change)


def _poses(shared: Reference, found: Linearisation) -> Target:
    layout, start, real, d = shared.factor.layout, shared.start, shared.truth.state, shared.design.dimension
    position, place = np.nonzero(layout.pose_columns >= 0)
    turn = vector_from_rotation(start.rotations @ real.rotations.transpose(0, 2, 1))
    base = np.concatenate([start.origins - real.origins, turn], axis=1)[position, place]
    rows = np.eye(len(layout))[layout.pose_columns[position, place]]

    def change(replicates: Deviations) -> Array:
        return np.asarray(np.concatenate([replicates.origins, replicates.rotations], axis=2)[:, position, place])

    units = tuple("m" if j < d else "rad" for j in place)
    return Target("U2", base, found.of_shared(rows), units, change)


def _parameters(shared: Reference, found: Linearisation) -> Target:
    layout, reported = shared.factor.layout, shared.design.model.reported()
    quoted = np.flatnonzero(reported.matrix.any(axis=1))
    matrix = reported.matrix[quoted]
    rows = np.zeros((len(quoted), len(layout)))
    rows[:, layout.model] = matrix
    base = matrix @ (shared.start.a - shared.truth.state.a)
    units = tuple(reported.units[i] for i in quoted)
    return Target("U3", base, found.of_shared(rows), units, lambda replicates: replicates.a @ matrix.T)


def _ball_distances(shared: Reference, found: Linearisation, own: Integers) -> Target:
    start, real = shared.start.balls[own], shared.truth.state.balls[own]
    return _distances(
        "U5", start, real, found.balls.common[own], found.balls.own[own], lambda replicates: replicates.balls[:, :, own]
    )


def _distances(
    symbol: str, places: Array, true: Array, common: Array, own: Array, moved: Callable[[Deviations], Array]
) -> Target:
    """Distances between pairs of places (n, d), whose errors are `common` (n, d, r) and `own` (n, d, d)."""
    first, second, sampled = sample_of_pairs(len(places), MOST_PAIRS)
    between = places[first] - places[second]
    length = np.sqrt((between**2).sum(axis=1))
    true_length = np.sqrt(((true[first] - true[second]) ** 2).sum(axis=1))
    unit = between / length[:, None]
    variance = np.zeros(len(first))
    # A slice of the pairs at a time: the products of all would take far more memory than the pairs.
    for start in range(0, len(first), 512):
        part = slice(start, start + 512)
        i, j, along = first[part], second[part], unit[part]
        variance[part] = (np.einsum("md,mdr->mr", along, common[i] - common[j]) ** 2).sum(axis=1)
        for end in (i, j):
            variance[part] += (np.einsum("md,mdr->mr", along, own[end]) ** 2).sum(axis=1)

    def change(replicates: Deviations) -> Array:
        displaced = moved(replicates)
        # The square of the new length less that of the old, without the loss of digits that subtracting would bring.
        gained = np.zeros((len(displaced), len(first)))
        for axis in range(displaced.shape[1]):
            difference = displaced[:, axis, first]
            difference -= displaced[:, axis, second]
            part = difference + 2.0 * between[:, axis]
            part *= difference
            gained += part
        return np.asarray(gained / (np.sqrt(length**2 + gained) + length))

    return Target(symbol, length - true_length, np.sqrt(variance), ("m",) * len(first), change, sampled)


def sample_of_pairs(n: int, most: int) -> tuple[Integers, Integers, bool]:
    """All pairs of n places, or `most` of them, always the same; and whether it is a sample.

    >>> sample_of_pairs(3, 10)
    (array([0, 0, 1]), array([1, 2, 2]), False)
    """
    count = n * (n - 1) // 2
    if count <= most:
        first, second = np.triu_indices(n, 1)
        return first, second, False
    generator = np.random.default_rng(np.random.SeedSequence(0))
    chosen = np.sort(generator.choice(count, most, replace=False))
    # Pair number of (i, j) with i < j counts the rows above: i (2 n - i - 1) / 2.
    rows = np.arange(n)
    starts = rows * (2 * n - rows - 1) // 2
    first = np.searchsorted(starts, chosen, side="right") - 1
    return first, first + 1 + chosen - starts[first], True
