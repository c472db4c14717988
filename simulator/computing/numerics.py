"""Decompositions, comparisons and choices that rounding cannot change.

NumPy's routines divide and conquer (gesdd, gelsd, syevd), and fail at one matrix in some thousands;
those that iterate by QR (gesvd, gelss, syev) are slower and reach the same. QR, Cholesky and LU do
not iterate. Arguments and results are NumPy's.

Linear algebra kernels differ in the order of their sums, and so in the last digits of a result.
Numbers that are equal except rounding, as those of a symmetrical design, are made equal to the bit
before they are compared, sorted or chosen from; of equal ones the first is taken then.
"""

from __future__ import annotations

import importlib.metadata
import platform
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from ballplate.simulator.inputs.number_arrays import Array, Flags, Integers
from numpy.typing import ArrayLike, NDArray

from .processes import scipy_linalg


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


def symmetric_root(covariance: Array) -> Array:
    """Return the symmetric root (m, m) of a covariance (m, m). It is the only one, so that the same
    numbers lead to the same draws everywhere.

    >>> root = symmetric_root(np.array([[4.0, 2.0], [2.0, 3.0]]))
    >>> (root @ root.T).round(12).tolist()
    [[4.0, 2.0], [2.0, 3.0]]
    """
    sizes, vectors = eigh(covariance)
    return np.asarray((vectors * np.sqrt(np.maximum(sizes, 0.0))) @ vectors.T)


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


# Binary digits in which numbers have to agree, about six decimal ones.
DIGITS = 20

# Numbers below this fraction of the largest beside them are zero but for rounding.
NOTHING = 1e-12

# A function counts as undetermined when a null direction changes it by this fraction of what any
# direction could.
TOUCHED = 1e-7


def comparable(values: ArrayLike, digits: int = DIGITS, axis: int | None = None) -> Array:
    """Return numbers (...) to `digits` binary digits, and 0 for those negligible next to the
    largest, of all or along an axis.

    Binary digits, since a decimal fraction or one with a small divisor then never lies half-way
    between two numbers.

    >>> int(np.argmax([0.3, 0.1 + 0.2])), int(np.argmax(comparable([0.3, 0.1 + 0.2])))
    (1, 0)
    >>> comparable([1.0, -1e-17, np.nan, np.inf]).tolist()
    [1.0, 0.0, nan, inf]
    """
    values = np.asarray(values, float)
    is_finite = np.isfinite(values)
    size = np.abs(values, where=is_finite, out=np.zeros(values.shape))
    is_something = size > NOTHING * size.max(axis=axis, initial=0.0, keepdims=True)
    mantissa, exponent = np.frexp(np.where(is_finite & is_something, values, 0.0))
    rounded = np.ldexp(np.round(np.ldexp(mantissa, digits)), exponent - digits) + 0.0
    return np.where(is_finite, rounded, values)


def first_largest(values: Array) -> int:
    """Return the index of the largest of values (m,), not all NaN: the first of those that are
    equal except rounding.

    >>> first_largest(np.array([np.nan, 0.3, 0.1 + 0.2, 0.2]))
    1
    """
    largest = np.nanmax(values)
    # Those that are near enough to be equal, and no others, are compared.
    margin = 4.0 * 2.0**-DIGITS * abs(largest) if np.isfinite(largest) else 0.0
    near = np.flatnonzero(values >= largest - margin)
    return int(near[comparable(values[near]).argmax()])


def first_largest_of_columns(values: Array) -> Integers:
    """Return the row (k,) of the largest of each column of values (m, k) without NaN, by the rule
    of `first_largest`.

    >>> first_largest_of_columns(np.array([[0.1, 3e-9], [0.3, 0.0], [0.1 + 0.2, 2e-9]])).tolist()
    [1, 0]
    """
    largest = values.max(axis=0)
    is_near = values >= largest - 4.0 * 2.0**-DIGITS * np.abs(largest)
    # Several times as fast as `nonzero` of two dimensions.
    row, column = np.divmod(np.flatnonzero(is_near), len(largest))
    # By powers of two, so that no column is nothing beside another.
    near = comparable(np.ldexp(values[row, column], -np.frexp(largest)[1][column]))
    order = np.lexsort((row, -near, column))
    return row[order[np.searchsorted(column[order], np.arange(len(largest)))]]


def above(values: ArrayLike, limit: float) -> Flags:
    """Return a mask of `values` that exceed a limit by more than rounding.

    >>> above([0.1 + 0.2, 0.31, np.nan], 0.3).tolist()
    [False, True, False]
    """
    return np.asarray(np.asarray(values, float) > limit + 2.0**-DIGITS * abs(limit))


def printable(value: float, digits: int = 9) -> float:
    """A number to `digits` significant ones, so that a half is rounded to fewer digits in one way.

    >>> f"{0.1875 - 1e-16:.3g}", f"{printable(0.1875 - 1e-16):.3g}"
    ('0.187', '0.188')
    """
    return float(f"{value:.{digits}g}")


def blank(values: Array, change: Array, size: Array) -> Array:
    """`values` with NaN where a null direction's `change` (..., deficiency) is no mere rounding of
    `size`.
    """
    if change.shape[-1] == 0:
        return values
    open_ = np.sqrt((change**2).sum(axis=-1)) > TOUCHED * np.maximum(size, np.finfo(float).tiny)
    return np.where(open_, np.nan, values)


def evenly_spread(count: int, most: int) -> NDArray[np.int64]:
    """Return indices of all of `count`, or of `most` spread evenly, both ends included.

    >>> evenly_spread(3, 200).tolist(), evenly_spread(9, 3).tolist()
    ([0, 1, 2], [0, 4, 8])
    """
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))


@cache
def versions() -> tuple[tuple[str, str], ...]:
    """Return pairs of a library and its version, BLAS with its architecture."""
    import numpy
    import numpy.linalg
    import scipy
    import scipy.linalg
    from threadpoolctl import threadpool_info

    blas = sorted(
        {
            f"{lib['internal_api']} {lib.get('version')} {lib.get('architecture', '')}".strip()
            for lib in threadpool_info()
            if lib["user_api"] == "blas"
        }
    )
    return (
        ("ballplate", importlib.metadata.version("ballplate")),
        ("python", platform.python_version()),
        ("numpy", numpy.__version__),
        ("scipy", scipy.__version__),
        ("blas", "; ".join(blas)),
    )
