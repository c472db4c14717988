"""Effects of patterns on the estimate and on the residuals."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from ballplate.simulator.estimation import Linearisation
from ballplate.simulator.machines import Array, Integers

from .bias_patterns import Patterns
from .hat import hat_rows
from .remainders import columns_of_balls

if TYPE_CHECKING:
    from scipy.sparse import csr_array

# Shares of a pattern's square in the residuals that are neglected: rounding leaves about 1e-15.
NIL = 1e-10


@dataclass(frozen=True)
class Response:
    """Q' h of the patterns `index` (k,): `common` (k, r), and `own` (k, n d) in the columns of the
    balls.

    `square` (k,) is h'h and `information` (k,) is h'(I - H) h, per unit of the bias squared; 0 if
    negligible. `hat` (b,) is the diagonal of H at the processed `rows` (b,).
    """

    rows: Integers
    hat: Array
    index: Integers
    common: Array
    own: csr_array
    square: Array

    @property
    def information(self) -> Array:
        absorbed = (self.common**2).sum(axis=1) + np.asarray(self.own.power(2).sum(axis=1)).ravel()
        remaining = self.square - absorbed
        return np.where(remaining > NIL * self.square, remaining, 0.0)


def responses(linearisation: Linearisation, biases: Patterns) -> Iterator[Response]:
    """Return responses of all patterns, in batches."""
    from scipy.sparse import csr_array

    matrix = biases.matrix.tocsr()
    n, d = linearisation.design.balls.places.shape
    square = np.asarray(biases.matrix.power(2).sum(axis=0)).ravel()
    wide = np.flatnonzero(~biases.is_local)
    first_row = biases.matrix.indices[np.minimum(biases.matrix.indptr[:-1], biases.matrix.nnz - 1)]
    common, own = (
        np.zeros((len(wide), linearisation.balls.common.shape[2])),
        csr_array((len(wide), n * d)),
    )
    for some in hat_rows(linearisation, None):
        hat = (some.common**2).sum(axis=1) + (some.own**2).sum(axis=1)
        private = columns_of_balls(some.own, some.ball, n)
        here = np.zeros(matrix.shape[0], bool)
        here[some.rows] = True
        local = np.flatnonzero(biases.is_local & here[first_row])
        block = matrix[some.rows]
        local_rows = block[:, local].T.tocsr()
        yield Response(
            some.rows,
            hat,
            local,
            local_rows @ some.common,
            (local_rows @ private).tocsr(),
            square[local],
        )
        through = block[:, wide].T.tocsr()
        common += through @ some.common
        own = own + through @ private
    yield Response(wide[:0], square[:0], wide, common, own.tocsr(), square[wide])
