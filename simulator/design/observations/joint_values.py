"""Values of certificates that are correlated, or functions of a user's own.

Every item of calibration is a block: a function of the balls of one artefact with the covariance of
its values. Whitened, a row is a combination of all values of its block and ties their balls
together.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array, Flags, Integers
from ballplate.simulator.machines.protocol import Unit

from ..arrays import Design, Rows
from ..state import Replicates, State
from .balls import BallObservations
from .whitening import EXACT, CovarianceRoot

# The matrix of a block, and its derivatives by all balls, are held as a whole.
MOST_JOINT_VALUES = 2000

# Standard deviation of a combination, in parts of the standard uncertainties of its values, that
# counts as none where figures are wanted to a few digits.
LOOSE_COMBINATION = 1e-4


@dataclass(frozen=True)
class JointValues(BallObservations):
    """Values (m,) of `blocks`, each with the root of its covariance in `roots`; `value` and
    `uncertainty` (m,) are those of all blocks, one after the other.
    """

    word: ClassVar[str] = "certified value"
    is_joint: ClassVar[bool] = True
    scales: ClassVar[bool] = True

    blocks: tuple[BallObservations, ...]
    roots: tuple[CovarianceRoot, ...]
    value: Array
    uncertainty: Array

    @classmethod
    def of(cls, blocks: list[tuple[BallObservations, CovarianceRoot]]) -> JointValues:
        """All blocks together."""
        none = np.zeros(0)
        return cls(
            tuple(block for block, _ in blocks),
            tuple(root for _, root in blocks),
            np.concatenate([none, *(block.value for block, _ in blocks)]),
            np.concatenate([none, *(block.uncertainty for block, _ in blocks)]),
        )

    @property
    def _parts(self) -> list[slice]:
        ends = np.cumsum([0, *map(len, self.blocks)]).tolist()
        return [slice(*ends[k : k + 2]) for k in range(len(self.blocks))]

    @property
    def _current(self) -> list[BallObservations]:
        """The blocks with the values that hold now."""
        parts = zip(self._parts, self.blocks, strict=True)
        return [block.given(value=self.value[part]) for part, block in parts]

    @property
    def _balls(self) -> list[Integers]:
        """The balls of each block, each once."""
        return [np.unique(block.balls) for block in self.blocks]

    @property
    def balls(self) -> Integers:
        """All balls of the block of each row, padded with its first."""
        balls_by_part = self._balls
        result = np.zeros((len(self), max(map(len, balls_by_part), default=0)), np.int64)
        for part, balls_of_part in zip(self._parts, balls_by_part, strict=True):
            # Blocks have different numbers of balls. The columns of padding keep zero slopes, so
            # that the ball named there is not affected.
            result[part] = balls_of_part[0]
            result[part, : len(balls_of_part)] = balls_of_part
        return result

    @property
    def is_exact(self) -> Flags:
        return self.uncertainty <= EXACT

    def values(self, balls: Array) -> tuple[Array, Array]:
        """Values (..., m), and their derivatives (..., m, k, d) by `balls`, not whitened."""
        value = np.zeros((*balls.shape[:-2], len(self)))
        slope = np.zeros((*value.shape, self.balls.shape[1], balls.shape[-1]))
        for part, balls_of_part, block in zip(self._parts, self._balls, self.blocks, strict=True):
            value[..., part], by_ball = block.values(balls)
            place, row = (
                np.searchsorted(balls_of_part, block.balls),
                np.arange(part.start, part.stop),
            )
            for column in range(place.shape[1]):
                # Added, not assigned: a row may name one ball in two columns.
                slope[..., row, place[:, column], :] += by_ball[..., column, :]
        return value, slope

    def whitened(self, rows: Array) -> Array:
        parts = zip(self._parts, self.roots, strict=True)
        return np.concatenate([rows[:0], *(root.whitened(rows[part]) for part, root in parts)])

    def pulled(self, rows: Array) -> Array:
        parts = zip(self._parts, self.roots, strict=True)
        return np.concatenate([rows[:0], *(root.pulled(rows[part]) for part, root in parts)])

    def rows(self, design: Design, state: State, x: Array | None) -> Rows:
        value, slope = self.values(state.balls)
        return Rows(self.whitened(value - self.value), None, self.whitened(slope))

    def errors(self, generator: np.random.Generator, count: int) -> Array:
        normal = generator.standard_normal((count, len(self)))
        parts = zip(self._parts, self.roots, strict=True)
        drawn = (root.drawn(normal[:, part]) for part, root in parts)
        return np.concatenate([normal[:, :0], *drawn], axis=1)

    def weights(self, design: Design, state: State) -> Array:
        return np.concatenate([np.zeros(0), *(root.weights for root in self.roots)])

    def alike(self, design: Design, state: State) -> JointValues:
        """The same values, uncorrelated, with weights of about one each: a value whose slope is not
        about one has the weight that its slope makes.
        """
        # Without correlations: whitening by any regular matrix changes neither rank nor null space,
        # and that of nearly singular blocks would bring back the weights that are to be avoided.
        slope = self.values(design.balls.places)[1]
        sizes = np.abs(slope).max(axis=(1, 2), initial=0.0)
        divisors = np.where(sizes > 0.0, sizes, 1.0)
        roots = tuple(
            CovarianceRoot(
                divisors[part], np.eye(part.stop - part.start), np.ones(len(divisors[part]))
            )
            for part in self._parts
        )
        return replace(self, roots=roots, uncertainty=divisors)

    def loosened(self, least: float) -> JointValues:
        """Return the same with a small variance for combinations without any, relative to that of
        their values.
        """
        roots = tuple(
            replace(
                root,
                own=np.maximum(root.own, least),
                deviations=np.maximum(root.deviations, LOOSE_COMBINATION),
            )
            for root in self.roots
        )
        return replace(self, roots=roots, uncertainty=np.maximum(self.uncertainty, least))

    def name(self, design: Design, k: int) -> str:
        block, row = self._at(k)
        return block.name(design, row)

    def unit(self, design: Design, k: int) -> Unit:
        block, row = self._at(k)
        return block.unit(design, row)

    def fixing(self) -> tuple[Integers, Integers, Array]:
        none = np.zeros(0, np.int64)
        parts = [(none, none, np.zeros(0)), *(block.fixing() for block in self._current)]
        ball, axis, value = (
            np.concatenate(block_parts) for block_parts in zip(*parts, strict=True)
        )
        return ball, axis, value

    def scaled(self) -> Array:
        return np.concatenate([np.zeros(0), *(block.scaled() for block in self._current)])

    def add_misfit(self, rows: Rows, errors: Array, at: Replicates) -> None:
        if not len(self):
            return
        balls = at.start.balls + at.balls.swapaxes(1, 2)
        true, _ = self.values(at.truth.balls)
        for part, block, root in zip(self._parts, self.blocks, self.roots, strict=True):
            value, slope = block.values(balls)
            residual = root.whitened((value - true[part] - errors[:, part]).T)
            at.squares[:] += (residual**2).sum(axis=0)
            at.pull(block.balls, root.pulled(residual).T[:, :, None, None] * slope)

    def _at(self, k: int) -> tuple[BallObservations, int]:
        for part, block in zip(self._parts, self.blocks, strict=True):
            if k < part.stop:
                return block, k - part.start
        raise IndexError(k)
