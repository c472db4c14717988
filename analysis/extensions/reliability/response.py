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

# A share of a pattern's square that is left in the residuals and counts as none: rounding leaves
# about 1e-15.
NIL = 1e-10


@dataclass(frozen=True)
class Response:
    """Q' h of the patterns `index` (k,): `common` (k, r), and `own` (k, n d) in the columns of the
    balls.

    `square` (k,) is h'h and `information` (k,) is h'(I - H) h, per unit of the bias squared; 0
    where it is nil. `hat` (b,) is the diagonal of H at the `rows` (b,) that were worked through for
    them.
    """

    rows: Integers
    hat: Array
    index: Integers
    common: Array
    own: csr_array
    square: Array

    @property
    def information(self) -> Array:
        taken = (self.common**2).sum(axis=1) + np.asarray(self.own.power(2).sum(axis=1)).ravel()
        left = self.square - taken
        return np.where(left > NIL * self.square, left, 0.0)


def responses(at: Linearisation, given: Patterns) -> Iterator[Response]:
    """Responses of all patterns, some at a time."""
    from scipy.sparse import csr_array

    matrix = given.matrix.tocsr()
    n, d = at.design.balls.places.shape
    square = np.asarray(given.matrix.power(2).sum(axis=0)).ravel()
    wide = np.flatnonzero(~given.is_local)
    first_row = given.matrix.indices[np.minimum(given.matrix.indptr[:-1], given.matrix.nnz - 1)]
    common, own = np.zeros((len(wide), at.balls.common.shape[2])), csr_array((len(wide), n * d))
    for some in hat_rows(at, None):
        hat = (some.common**2).sum(axis=1) + (some.own**2).sum(axis=1)
        private = columns_of_balls(some.own, some.ball, n)
        here = np.zeros(matrix.shape[0], bool)
        here[some.rows] = True
        local = np.flatnonzero(given.is_local & here[first_row])
        block = matrix[some.rows]
        mine = block[:, local].T.tocsr()
        yield Response(
            some.rows, hat, local, mine @ some.common, (mine @ private).tocsr(), square[local]
        )
        through = block[:, wide].T.tocsr()
        common += through @ some.common
        own = own + through @ private
    yield Response(wide[:0], square[:0], wide, common, own.tocsr(), square[wide])
