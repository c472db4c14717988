"""Common parts of all replicates: noise-free readings, their estimate and its factorisation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from ballplate.simulator.computing.processes import single_threaded
from ballplate.simulator.design.arrays import Design, Rows
from ballplate.simulator.design.measurement import reading_noise
from ballplate.simulator.design.observations.lengths import Lengths
from ballplate.simulator.design.observations.readings import reading_blocks, reading_weights
from ballplate.simulator.design.state import State
from ballplate.simulator.estimation.covariance import Spectrum
from ballplate.simulator.estimation.elimination import Factor
from ballplate.simulator.estimation.gauss_newton import Solution, iterate
from ballplate.simulator.estimation.initial import initial_state
from ballplate.simulator.estimation.linearisation import Linearisation, linearise
from ballplate.simulator.inputs.number_arrays import Array, Integers
from ballplate.simulator.machines.protocol import ErrorModel
from ballplate.simulator.readings.simulated import random_displacements, true_readings

from ._expansion import Direct, LocalModel, expand

# Largest error, in standard uncertainties of a reading, of an expanded model.
FAITHFUL = 1e-8
# Lower limit of uncertainties as a share of the repeatability: replicates are solved by their
# gradients, which rounding corrupts if weights differ more.
EXACT_ENOUGH = 1e-4


class DivergedError(ValueError):
    """The true machine's errors are too large for a fit of readings without noise."""


@dataclass(frozen=True)
class Truth:
    """The true artefacts and poses, and the true machine, whose error model may differ from the
    fitted one.
    """

    state: State
    model: ErrorModel


@dataclass(frozen=True)
class PositionReadings:
    """Readings `rows` of one position, each ball at most once, at the reference.

    `ball` are their m balls, `arm` (d, m) the balls in the machine's axes,
    `residual` (d, m) in metres and `weight` (d, m). `probe` (m,) is None unless probe offsets are
    parameters, and `by_influence` (p, d, m), the derivative of the residuals, is None without
    influence quantities.
    """

    rows: slice
    position: int
    ball: Integers
    arm: Array
    residual: Array
    weight: Array
    model: LocalModel
    probe: Integers | None
    by_influence: Array | None = None


@dataclass(frozen=True)
class Reference:
    """Common parts of all replicates.

    The readings, `order` (m,) among the design's, are the plates' in the order of `groups`, then
    those of length standards; `noise` (d, m) is the standard uncertainty of each. `ends` are the
    model at the first and second read ends of length standards, with `end_difference` (m, d), their
    difference at the reference; models are expanded about readings if `is_expanded`. `rows` are
    those of each type of observation about the truth. `start` is the estimate from readings without
    noise. Directions that the nominal design `drawn` leaves undetermined are held; None without
    any.
    """

    design: Design
    truth: Truth
    start: State
    factor: Factor
    spectrum: Spectrum
    noise: Array
    order: Integers
    groups: tuple[PositionReadings, ...]
    ends: tuple[LocalModel, LocalModel] | None
    end_difference: Array
    is_expanded: bool
    rows: tuple[Rows, ...]
    exact: Array
    drawn: Linearisation | None = None

    @property
    def sum_of_squares(self) -> float:
        """S^2 of readings without noise: zero if the fitted model contains the true machine."""
        return self.factor.sum_of_squares

    @property
    def position(self) -> Integers:
        """Positions (m,) of the readings, in their order."""
        return self.design.readings.position[self.order]

    @cached_property
    def place(self) -> Integers:
        """Places (m,) of the design's readings in the order."""
        return np.argsort(self.order)

    @property
    def linearisation(self) -> Linearisation:
        """The linearisation at the reference."""
        return Linearisation(
            self.design, self.factor.layout, self.start, self.factor, self.spectrum, self.drawn
        )

    def local_model(self, points: Array, probes: Integers) -> LocalModel:
        """Return the model about readings (m, d) with probes of indices (m,)."""
        p = self.start.probes[probes]
        return _local_model(self.design, self.start.a, points, p, self.is_expanded)

    @property
    def degrees_of_freedom(self) -> int:
        return self.linearisation.degrees_of_freedom


# In one piece: each part needs those before.
@single_threaded
def reference(design: Design, truth: Truth) -> Reference:
    """Prepare the replicates of a design whose true artefacts, poses and machine are `truth`.

    :raises DivergedError: readings without noise that cannot be fitted.
    :raises NoReadingError: errors of the true machine so large that no reading belongs to some
        location.
    """
    # Every repeat is a row: repeats scatter about their mean, and S^2 and its degrees of freedom
    # have that scatter.
    observed = _observed(design)
    least = EXACT_ENOUGH * float(observed.machine.repeatability.min())
    observed = observed.observed(*(kind.loosened(least) for kind in observed.observations))
    # At zero machine error, because a small error makes an undetermined direction weakly
    # determined.
    drawn = linearise(observed)
    readings = observed.readings
    # Readings and certified values as the true machine and the true artefacts give them, without
    # noise. Where the fitted model cannot follow the true machine, what this estimate is off by is
    # the bias that all replicates share.
    exact = true_readings(observed, truth.state, readings, truth.model)
    observed = observed.observed(
        *(
            kind.given(value=kind.true_values(observed, truth.state, truth.model))
            for kind in observed.observations
        )
    )
    held_spectrum = drawn.spectrum if drawn.deficiency else None
    solution = iterate(observed, exact, initial_state(observed, exact), held_spectrum=held_spectrum)
    if solution.status != "converged":
        raise DivergedError(f"the estimate from its readings without noise has {solution.status}")
    start, plates = solution.state, observed.plate_readings
    p = start.probes[readings.probe]
    is_expanded = _is_faithful(
        observed, solution.spectrum, solution.factor.layout.model, start, exact, truth
    )

    def local(x: Array, p: Array) -> LocalModel:
        return _local_model(observed, start.a, x, p, is_expanded)

    blocks = reading_blocks(observed, start, readings.select(plates), exact[plates])
    weight = reading_weights(observed, readings.select(plates))
    noise = reading_noise(observed, readings.select(plates))
    groups, row = [], 0
    indices = _groups(observed)
    for chosen in indices:
        rows = readings.select(plates[chosen])
        position = int(rows.position[0])
        groups.append(
            PositionReadings(
                slice(row, row + len(chosen)),
                position,
                rows.ball,
                start.rotations[position] @ start.balls[rows.ball].T,
                (blocks.residual * noise)[chosen].T,
                weight[chosen].T,
                local(exact[plates[chosen]], p[plates[chosen]]),
                rows.probe if observed.probes.free.any() else None,
                None
                if blocks.by_influence is None
                else (blocks.by_influence * noise[:, :, None])[chosen].transpose(2, 1, 0),
            )
        )
        row += len(chosen)
    others = np.setdiff1d(np.arange(len(readings)), plates)
    order = np.concatenate([plates[np.concatenate([np.arange(0), *indices])], others])
    lengths = observed.of(Lengths)
    is_read = ~lengths.to_pivot
    first, second = lengths.first, lengths.second[is_read]
    ends = None
    if len(lengths):
        ends = local(exact[first], p[first]), local(exact[second], p[second])
    difference = np.zeros((len(lengths), observed.dimension))
    for sign, end, of_end in (
        (1.0, first, np.arange(len(lengths))),
        (-1.0, second, np.flatnonzero(is_read)),
    ):
        if len(end):
            difference[of_end] += sign * (
                exact[end] + observed.model.error(exact[end], start.a, p[end])
            )
    difference[~is_read] -= start.origins[readings.position[first[~is_read]]]
    return Reference(
        observed,
        truth,
        start,
        solution.factor,
        solution.spectrum,
        reading_noise(observed, readings.select(order)).T,
        order,
        tuple(groups),
        ends,
        difference,
        is_expanded,
        tuple(kind.rows(observed, start, exact) for kind in observed.observations),
        exact,
        drawn if drawn.deficiency else None,
    )


def _observed(design: Design) -> Design:
    """Return the design with a row per repeat, except repeats of length standards."""
    readings = design.readings
    times = readings.repeats.copy()
    times[np.setdiff1d(np.arange(len(readings)), design.plate_readings)] = 1
    chosen = np.repeat(np.arange(len(readings)), times)
    first = np.cumsum(times) - times
    repeats = np.where(times == readings.repeats, 1, readings.repeats)[chosen]
    single = replace(readings.select(chosen), repeats=repeats)
    moved = (kind.reread(design, first) for kind in design.observations)
    return replace(design, readings=single).observed(*moved)


def _groups(design: Design) -> list[Integers]:
    """Return indices into the plates' readings, in groups of one position, each ball once."""
    readings = design.readings.select(design.plate_readings)
    key = readings.position * len(design.balls.names) + readings.ball
    # The first reading of each ball in a position makes the first group, the second readings the
    # next. Gradients by balls can then be subtracted by index, without two readings of one ball at
    # once.
    order = np.argsort(key, kind="stable")
    first = np.searchsorted(key[order], key[order])
    turn = np.empty(len(key), np.int64)
    turn[order] = np.arange(len(key)) - first
    order = np.lexsort((readings.ball, turn, readings.position))
    changes = np.diff(readings.position[order]) | np.diff(turn[order])
    groups = np.split(order, np.flatnonzero(changes) + 1)
    return [members for members in groups if len(members)]


def _local_model(design: Design, a: Array, x: Array, p: Array, is_expanded: bool) -> LocalModel:
    """Return the model about readings x (m, d), with parameters a (n,) and probe offsets p (m,
    d).
    """
    if is_expanded:
        return expand(design.model, x, a, p, bool(design.probes.free.any()))
    return Direct(design.model, x, a, p, design.model.error(x, a, p))


def random_of_machine(
    design: Design, truth: Truth, exact: Array, generator: np.random.Generator, count: int
) -> Array:
    """Draw displacements (count, d, m) of the design's readings by the random part of the true
    machine's errors.
    """
    readings = design.readings
    random = random_displacements(truth.model, truth.state, readings, exact, generator, count)
    return random.swapaxes(1, 2)


def _is_faithful(
    design: Design, spectrum: Spectrum, columns: slice, start: State, exact: Array, truth: Truth
) -> bool:
    """Return whether an expansion of the model agrees with the model."""
    p = start.probes[design.readings.probe]
    # Two replicates as they will occur: noise of the readings, random errors of the machine, and
    # parameters that follow the covariance.
    generator = np.random.default_rng(np.random.SeedSequence(0))
    noise = reading_noise(design, design.readings).T
    moved = noise * generator.standard_normal((2, design.dimension, len(exact)))
    step = generator.standard_normal((2, spectrum.root.shape[1])) @ spectrum.root[columns].T
    offsets = 1e-6 * generator.standard_normal(moved.shape) if design.probes.free.any() else None
    moved += random_of_machine(design, truth, exact, generator, 2)
    expanded, direct = (
        _local_model(design, start.a, exact, p, is_expanded).change(moved, step, offsets)
        for is_expanded in (True, False)
    )
    return bool((np.abs(expanded - direct) <= FAITHFUL * noise).all())


def complete_fit(shared: Reference, moved: Array, errors: tuple[Array, ...]) -> Solution:
    """Estimate one replicate as `fit` does, with a separate factor in each iteration.

    `moved` (d, m) is the noise of the readings, `errors` (m,) those of the values of each type of
    observation. `GaussNewtonSettings` limits the iterations. Directions that the nominal design
    leaves undetermined are held, as in all replicates, and no others.
    """
    design, x = replicate_data(shared, moved, errors)
    # At full rank the spectrum of the reference has no null directions, so that none can appear by
    # noise.
    held_spectrum = shared.spectrum if shared.drawn is None else shared.drawn.spectrum
    return iterate(design, x, initial_state(design, x), held_spectrum=held_spectrum)


def replicate_data(
    shared: Reference, moved: Array, errors: tuple[Array, ...]
) -> tuple[Design, Array]:
    """Return the design with the values of one replicate, and its scale readings (m, d)."""
    design, x = shared.design, shared.exact.copy()
    x[shared.order] += moved.T
    values = (
        kind.given(value=kind.value + np.asarray(error))
        for kind, error in zip(design.observations, errors, strict=True)
    )
    return design.observed(*values), x
