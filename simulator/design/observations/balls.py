"""Observations of balls on their artefact alone: all that a kind needs is its values and slopes."""

from __future__ import annotations

from abc import abstractmethod
from typing import Self

import numpy as np

from ...inputs.number_arrays import Flags
from ...machines.protocol import Array, ErrorModel
from ..arrays import Design, Observations, Replicates, Rows, State
from .whitening import EXACT


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
