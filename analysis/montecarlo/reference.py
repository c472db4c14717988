"""Common parts of all replicates: the readings without noise, the estimate from them and its
factorisation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from ballplate.simulator.computing.threads import single_threaded
from ballplate.simulator.design.arrays import Design, Rows, State, reading_noise
from ballplate.simulator.design.observations.lengths import Lengths
from ballplate.simulator.design.observations.readings import reading_blocks, reading_weights
from ballplate.simulator.estimation.covariance import Spectrum
from ballplate.simulator.estimation.elimination import Factor
from ballplate.simulator.estimation.gauss_newton import gauss_newton
from ballplate.simulator.estimation.initial import initial_state
from ballplate.simulator.estimation.linearisation import Linearisation, linearise
from ballplate.simulator.machines.protocol import Array, ErrorModel, Integers
from ballplate.simulator.readings.generate import true_readings

from .expansion import Direct, LocalModel, expand

# Readings handled at once: enough for the matrix products to be efficient, few enough to stay in
# cache.
READINGS_AT_ONCE = 512

# How well, in standard uncertainties of a reading, the expansion of a model must agree with the
# model itself.
FAITHFUL = 1e-8
# What is more certain than this share of the repeatability is taken to be as certain: replicates
# are solved by their gradients, which rounding spoils where weights differ more.
EXACT_ENOUGH = 1e-4


class DivergedError(ValueError):
    """The true machine's errors are so large that not even readings without noise can be fitted."""


@dataclass(frozen=True)
class Truth:
    """The true artefacts and poses, and the true machine, whose error model need not be the fitted
    one.
    """

    state: State
    model: ErrorModel


@dataclass(frozen=True)
class PositionReadings:
    """Readings `rows` of one position in which no ball occurs twice, at the reference.

    `ball` are their m balls, a slice where they follow one another, `arm` (d, m) the balls turned
    into the machine's axes, `residual` (d, m) in metres and `weight` (d, m). `probe` (m,) is None
    where no probe's offset is a parameter, and `by_influence` (p, d, m), the derivative of the
    residuals by influence quantities, where there are none.
    """

    rows: slice
    position: int
    ball: Integers | slice
    arm: Array
    residual: Array
    weight: Array
    model: LocalModel
    probe: Integers | None
    by_influence: Array | None = None


@dataclass(frozen=True)
class Reference:
    """What all replicates share.

    The plates' readings, `order` (m,) among the design's, stand in the order of `groups`; `noise`
    (d, m) is the standard uncertainty of each. `ends` are the model at the first and the second
    ends of the length standards' lengths, so far as they are read, with `end_noise` (d, ends) and
    `end_difference` (m, d), their difference at the reference; `is_expanded` tells that models are
    expanded about readings, because that is faithful. `rows` are those of each kind of observations
    about the truth. `start` is the estimate from readings without noise. Directions that the design
    as `drawn` leaves open are held; None where there are none.
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
    end_noise: tuple[Array, Array]
    end_difference: Array
    is_expanded: bool
    rows: tuple[Rows, ...]
    exact: Array
    drawn: Linearisation | None = None

    @property
    def sum_of_squares(self) -> float:
        """S^2 of readings without noise: zero unless the true machine is none of the fitted
        model's.
        """
        return self.factor.sum_of_squares

    @property
    def position(self) -> Integers:
        """Positions (m,) of the plates' readings, in the order of the groups."""
        return self.design.readings.position[self.order]

    @property
    def linearisation(self) -> Linearisation:
        """The linearisation at the reference."""
        return Linearisation(
            self.design, self.factor.layout, self.start, self.factor, self.spectrum, self.drawn
        )

    def local_model(self, points: Array, probes: Integers) -> LocalModel:
        """The model about readings (m, d) with probes of indices (m,)."""
        p = self.start.probes[probes]
        return _local_model(self.design, self.start.a, points, p, self.is_expanded)

    @property
    def degrees_of_freedom(self) -> int:
        return self.linearisation.degrees_of_freedom


# In one piece: everything that replicates share is made at one reference, each part from those
# before.
@single_threaded
def reference(design: Design, truth: Truth) -> Reference:
    """Prepare the replicates of a design whose true artefacts, poses and machine are `truth`.

    :raises DivergedError: readings without noise that cannot be fitted.
    :raises NoReadingError: errors of the true machine so large that no reading belongs to some
        location.
    """
    observed = _observed(design)
    least = EXACT_ENOUGH * float(observed.machine.repeatability.min())
    observed = observed.observed(*(one.loosened(least) for one in observed.observations))
    # As drawn, because a small machine error makes a direction that is open merely all but open.
    drawn = linearise(observed)
    readings = observed.readings
    exact = true_readings(observed, truth.state, readings, truth.model)
    true = [one.true_values(observed, truth.state, truth.model) for one in observed.observations]
    observed = observed.observed(
        *(one.given(value=value) for one, value in zip(observed.observations, true, strict=True))
    )
    held = drawn.spectrum if drawn.deficiency else None
    solution = gauss_newton(observed, exact, initial_state(observed, exact), held=held)
    if solution.status != "converged":
        raise DivergedError(f"the estimate from its readings without noise has {solution.status}")
    start, plates = solution.state, observed.plate_readings
    p = start.probes[readings.probe]
    is_expanded = _is_faithful(
        observed, solution.spectrum, solution.factor.layout.model, start, exact
    )

    def local(x: Array, p: Array) -> LocalModel:
        return _local_model(observed, start.a, x, p, is_expanded)

    blocks = reading_blocks(observed, start, readings.select(plates), exact[plates])
    weight = reading_weights(observed, readings.select(plates))
    noise = reading_noise(observed, readings.select(plates))
    groups, at = [], 0
    for chosen in _groups(observed):
        rows = readings.select(plates[chosen])
        position = int(rows.position[0])
        groups.append(
            PositionReadings(
                slice(at, at + len(chosen)),
                position,
                _as_slice(rows.ball),
                np.ascontiguousarray(start.rotations[position] @ start.balls[rows.ball].T),
                np.ascontiguousarray((blocks.residual * noise)[chosen].T),
                np.ascontiguousarray(weight[chosen].T),
                local(exact[plates[chosen]], p[plates[chosen]]),
                rows.probe if observed.probes.free.any() else None,
                None
                if blocks.by_influence is None
                else np.ascontiguousarray(
                    (blocks.by_influence * noise[:, :, None])[chosen].transpose(2, 1, 0)
                ),
            )
        )
        at += len(chosen)
    order = np.concatenate([np.arange(0), *_groups(observed)])
    given = observed.of(Lengths)
    read = ~given.to_pivot
    both = given.first, given.second[read]
    ends = (
        (local(exact[both[0]], p[both[0]]), local(exact[both[1]], p[both[1]]))
        if len(given)
        else None
    )
    difference, end_noise = np.zeros((len(given), observed.dimension)), []
    for sign, end, of_end in (
        (1.0, both[0], np.arange(len(given))),
        (-1.0, both[1], np.flatnonzero(read)),
    ):
        if len(end):
            difference[of_end] += sign * (
                exact[end] + observed.model.error(exact[end], start.a, p[end])
            )
        end_noise.append(reading_noise(observed, readings.select(end)).T)
    difference[~read] -= start.origins[readings.position[given.first[~read]]]
    return Reference(
        observed,
        truth,
        start,
        solution.factor,
        solution.spectrum,
        np.ascontiguousarray(noise[order].T),
        plates[order],
        tuple(groups),
        ends,
        (end_noise[0], end_noise[1]),
        difference,
        is_expanded,
        tuple(one.rows(observed, start, exact) for one in observed.observations),
        exact,
        drawn if drawn.deficiency else None,
    )


def _observed(design: Design) -> Design:
    """The design with a row for each repeat, but for length standards, whose lengths point to their
    readings.
    """
    readings = design.readings
    times = readings.repeats.copy()
    times[np.setdiff1d(np.arange(len(readings)), design.plate_readings)] = 1
    chosen = np.repeat(np.arange(len(readings)), times)
    first = np.cumsum(times) - times
    repeats = np.where(times == readings.repeats, 1, readings.repeats)[chosen]
    single = replace(readings.select(chosen), repeats=repeats)
    moved = (one.reread(design, first) for one in design.observations)
    return replace(design, readings=single).observed(*moved)


def _groups(design: Design) -> list[Integers]:
    """Indices into the plates' readings: of one position each, no ball twice, of bounded number."""
    readings = design.readings.select(design.plate_readings)
    key = readings.position * len(design.balls.names) + readings.ball
    order = np.argsort(key, kind="stable")
    first = np.searchsorted(key[order], key[order])
    turn = np.empty(len(key), np.int64)
    turn[order] = np.arange(len(key)) - first
    order = np.lexsort((readings.ball, turn, readings.position))
    changes = np.diff(readings.position[order]) | np.diff(turn[order])
    found: list[Integers] = []
    for part in np.split(order, np.flatnonzero(changes) + 1):
        pieces = -(-len(part) // READINGS_AT_ONCE)
        found += (
            [piece for piece in np.array_split(part, pieces) if len(piece)] if len(part) else []
        )
    return found


def _as_slice(ascending: Integers) -> Integers | slice:
    """Indices as a slice if they follow one another: a view of an array instead of a copy."""
    first, last = int(ascending[0]), int(ascending[-1])
    return slice(first, last + 1) if last - first + 1 == len(ascending) else ascending


def _local_model(design: Design, a: Array, x: Array, p: Array, is_expanded: bool) -> LocalModel:
    """The model about readings x (m, d), with parameters a (n,) and probe offsets p (m, d)."""
    if is_expanded:
        return expand(design.model, x, a, p, bool(design.probes.free.any()))
    return Direct(design.model, x, a, p, design.model.error(x, a, p))


def _is_faithful(
    design: Design, spectrum: Spectrum, columns: slice, start: State, exact: Array
) -> bool:
    """Whether an expansion of the model tells the same as the model itself."""
    p = start.probes[design.readings.probe]
    generator = np.random.default_rng(np.random.SeedSequence(0))
    noise = reading_noise(design, design.readings).T
    moved = noise * generator.standard_normal((2, design.dimension, len(exact)))
    step = generator.standard_normal((2, spectrum.root.shape[1])) @ spectrum.root[columns].T
    offsets = 1e-6 * generator.standard_normal(moved.shape) if design.probes.free.any() else None
    expanded, direct = (
        _local_model(design, start.a, exact, p, is_expanded).change(moved, step, offsets)
        for is_expanded in (True, False)
    )
    return bool((np.abs(expanded - direct) <= FAITHFUL * noise).all())
