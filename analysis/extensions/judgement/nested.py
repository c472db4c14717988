"""Sums of squares of all submodels of a large model, from its linearisation alone.

The readings are linear in the parameters of the machine to a millionth of the errors. With balls,
poses and all others eliminated, S^2 is b + |t + X a|^2 in the machine's parameters a; a smaller
model has some of the columns of X only. NPL Report CISE 15/98, section 5.3, compares models by the
same sums of squares.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing import single_threaded, svd
from ballplate.simulator.design import Flags
from ballplate.simulator.estimation import Linearisation, in_order
from ballplate.simulator.machines import Array, Integers

# Share of the largest singular value below which a direction of scaled columns counts as none.
NOTHING = 1e-10


@dataclass(frozen=True, eq=False)
class NestedSums:
    """Columns X (r, n) of the machine's scaled parameters and the target t (r,); S^2 of the model
    with some of the columns is `base` plus the squared remainder of the target.
    """

    columns: Array
    target: Array
    base: float

    def basis(self, is_kept: Flags) -> Array:
        """Orthonormal directions (r, q) that some columns (n,) span."""
        return span(self.columns[:, is_kept], float(np.abs(self.columns).max(initial=0.0)))

    def left(self, basis: Array) -> Array:
        """Return the remainder of the target (r,) beyond an orthonormal basis (r, q)."""
        return self.target - basis @ (basis.T @ self.target)

    def sum_of_squares(self, is_kept: Flags) -> float:
        """S^2 of the model with some of the columns (n,)."""
        remainder = self.left(self.basis(is_kept))
        return self.base + float(remainder @ remainder)

    def gain(self, basis: Array, remainder: Array, more: Integers) -> tuple[float, int]:
        """Return the decrease of S^2 by further columns beyond a basis that leaves `remainder`
        (r,), and its number of dimensions.
        """
        added = self.columns[:, more]
        added = span(added - basis @ (basis.T @ added), float(np.abs(added).max(initial=0.0)))
        return float(((added.T @ remainder) ** 2).sum()), added.shape[1]


def span(columns: Array, size: float) -> Array:
    """Orthonormal directions of columns, of a given size before anything was taken out."""
    if not columns.shape[1]:
        return np.zeros((len(columns), 0))
    u, values, _ = svd(columns, full_matrices=False)
    return u[:, values > NOTHING * max(size, float(values[0]))]


@single_threaded
def nested_sums(linearisation: Linearisation) -> NestedSums:
    """Return sums of squares of the submodels of a fit's model, with undetermined directions
    held.
    """
    layout, factor = linearisation.layout, linearisation.factor
    scale = linearisation.spectrum.scale
    root = in_order(factor) * scale
    null = np.linalg.qr(linearisation.shared_null / scale[:, None])[0]
    root -= (root @ null) @ null.T
    of_model = np.zeros(len(layout), bool)
    of_model[layout.model] = True
    others_span = span(root[:, ~of_model], float(np.abs(root).max(initial=0.0)))
    machine = root[:, of_model]
    target = factor.side - machine @ (linearisation.state.a / scale[of_model])
    machine, target = (rows - others_span @ (others_span.T @ rows) for rows in (machine, target))
    base = factor.sum_of_squares - float(factor.side @ factor.side)
    return NestedSums(machine, target, base)
