"""Observations of balls on their artefact alone: all that a kind needs is its values and slopes."""

from __future__ import annotations

from abc import abstractmethod
from typing import Protocol, Self

import numpy as np
from ballplate.simulator.computing.numerics import svd
from ballplate.simulator.inputs.number_arrays import Array, Flags
from ballplate.simulator.machines.protocol import ErrorModel, Unit

from ..arrays import Design, Observations, Rows
from ..state import Replicates, State
from .whitening import EXACT

# Extent of an artefact in parts of its largest one below which it has none in a direction.
THIN = 0.01

# Slopes out of the plane, in parts of those in it, from which on an observation is of heights.
HEIGHT = 0.5


def slopes_apart(design: Design, kind: Observations, slope: Array) -> Array:
    """Return the slopes (m, k, d) of observations by their balls, those of distances without what
    they tell of motions out of the plane, or off the line, of an artefact's balls.

    Distances in a plane do not change by such motions but to second order, and their slopes there
    are those of the plate's flatness.
    """
    result = slope.copy()
    # Slopes by all balls that add up to zero belong to functions that shifts of the artefact do not
    # change, such as distances and heights.
    is_relative = np.abs(slope.sum(axis=1)).max(axis=1) < 1e-9 * np.abs(slope).max(axis=(1, 2))
    artefact = design.balls.artefact[kind.balls[:, 0]]
    for one in np.unique(artefact[is_relative]):
        rows = np.flatnonzero(is_relative & (artefact == one))
        places = design.balls.places[design.balls.artefact == one]
        _, sizes, directions = svd(places - places.mean(axis=0), full_matrices=False)
        along = directions[sizes > THIN * sizes[0]]
        within = slope[rows] @ along.T @ along
        # Heights above a plane tell of little else.
        out = np.linalg.norm(slope[rows] - within, axis=(1, 2))
        is_distance = out < HEIGHT * np.linalg.norm(within, axis=(1, 2))
        result[rows[is_distance]] = within[is_distance]
    return result


class BallObservations(Observations):
    """Observations that are functions of the `balls` (m, k) of each, independent of poses and
    machine.
    """

    @abstractmethod
    def values(self, balls: Array) -> tuple[Array, Array]:
        """Values (..., m) where the balls of a design are at `balls` (..., n, d), and their
        derivatives (..., m, k, d) by the balls of each.
        """

    @property
    def is_exact(self) -> Flags:
        return self.uncertainty <= EXACT

    def errors(self, generator: np.random.Generator, count: int) -> Array:
        uncertainty = np.where(self.is_exact, 0.0, self.uncertainty)
        return uncertainty * generator.standard_normal((count, len(self)))

    def loosened(self, least: float) -> Self:
        return self.given(uncertainty=np.maximum(self.uncertainty, least))

    def rows(self, design: Design, state: State, x: Array | None) -> Rows:
        value, slope = self.values(state.balls)
        return Rows(
            (value - self.value) / self.uncertainty, None, slope / self.uncertainty[:, None, None]
        )

    def true_values(self, design: Design, truth: State, model: ErrorModel) -> Array:
        return self.values(truth.balls)[0]

    def add_misfit(self, rows: Rows, errors: Array, at: Replicates) -> None:
        if not len(self):
            return
        value, slope = self.values(at.start.balls + at.balls.swapaxes(1, 2))
        residual = (value - self.values(at.truth.balls)[0] - errors) / self.uncertainty
        at.squares[:] += (residual**2).sum(axis=1)
        at.pull(self.balls, (residual / self.uncertainty)[:, :, None, None] * slope)


class BallFunctions(Protocol):
    """Functions of the balls of an artefact whose values a certificate states.

    `names` are two names for each of the m values, by which files find it. Values are in `unit`: m,
    rad or 1. They must not depend on where the artefact's frame is.
    """

    @property
    def names(self) -> tuple[tuple[str, str], ...]: ...

    @property
    def unit(self) -> Unit: ...

    def values(self, balls: Array) -> Array:
        """Values (m,) where balls are at `balls` (n, d), in metres."""

    def derivatives(self, balls: Array) -> Array:
        """Derivatives (m, n, d) of the values by the co-ordinates of the balls."""
