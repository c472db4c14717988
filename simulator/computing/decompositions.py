"""Decompositions for which LAPACK has a second routine where the first one does not converge.

NumPy's routines divide and conquer (gesdd, gelsd, syevd), and fail at one matrix in some thousands;
those that iterate by QR (gesvd, gelss, syev) are slower and reach the same. QR, Cholesky and LU do
not iterate. Arguments and results are NumPy's.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array

from .threads import scipy_linalg


def _with_second(name: str, **second: str) -> Callable[..., Any]:
    """Return a function of NumPy that chooses SciPy's routine `second` where its own fails."""

    def decomposed(matrix: Array, *more: Any, **named: Any) -> Any:
        try:
            return getattr(np.linalg, name)(matrix, *more, **named)
        except np.linalg.LinAlgError:
            if not np.isfinite(matrix).all():
                raise
        if matrix.ndim == 2:
            return getattr(scipy_linalg(), name)(matrix, *more, **named, **second)
        parts = [decomposed(one, *more, **named) for one in matrix]
        if isinstance(parts[0], tuple):
            return tuple(map(np.stack, zip(*parts, strict=True)))
        return np.stack(parts)

    return decomposed


svd = _with_second("svd", lapack_driver="gesvd")
eigh = _with_second("eigh", driver="ev")
eigvalsh = _with_second("eigvalsh", driver="ev")
_lstsq = _with_second("lstsq", lapack_driver="gelss")


def lstsq(matrix: Array, sides: Array, rcond: float | None = None) -> Any:
    """Return the shortest least-squares solution of equations (m, n), residuals, rank and singular
    values.
    """
    rounding = np.finfo(float).eps * max(matrix.shape)
    return _lstsq(matrix, sides, rounding if rcond is None else rcond)


def pinv(matrix: Array, rcond: float = 1e-15) -> Any:
    """Return the pseudo-inverse (n, m) of a matrix (m, n)."""
    try:
        return np.linalg.pinv(matrix, rcond)
    except np.linalg.LinAlgError:
        return lstsq(matrix, np.eye(len(matrix)), rcond)[0]
