"""Whitening of observations that share errors, such as that of a certificate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing.numerics import eigh
from ballplate.simulator.inputs.number_arrays import Array, Integers


@dataclass(frozen=True)
class Whitening:
    """The symmetric root of an inverse covariance, diagonal except errors that the rows of a group
    share.

    The covariance of m rows is diag(s^2) + u u' within a group, where u are standard uncertainties
    of the shared error. With v = u / s its inverse root is (1 - c v v') diag(1/s), taken group by
    group, where c = (1 - 1 / sqrt(1 + v'v)) / v'v. `own` (m,) are the s, `direction` (m,) the v
    times the square root of c, `group` (m,) counts from 0.
    """

    own: Array
    direction: Array
    group: Integers

    def __len__(self) -> int:
        return len(self.own)

    def whitened(self, rows: Array) -> Array:
        """`rows` (m, ...) in units of their standard uncertainty, uncorrelated."""
        return self._projected(rows / _along(self.own, rows))

    def pulled(self, rows: Array) -> Array:
        """The transpose of `whitened`, which leads from whitened residuals (m, ...) to
        gradients.
        """
        return self._projected(rows) / _along(self.own, rows)

    def _projected(self, rows: Array) -> Array:
        # The usual case, without shared errors.
        if not self.direction.any():
            return rows
        direction = _along(self.direction, rows)
        total = np.zeros((int(self.group.max()) + 1, *rows.shape[1:]))
        np.add.at(total, self.group, direction * rows)
        return rows - direction * total[self.group]


def _along(values: Array, rows: Array) -> Array:
    """Values (m,) in the shape of rows (m, ...)."""
    return values.reshape(-1, *[1] * (rows.ndim - 1))


def whitening(own_uncertainty: Array, shared: Array, group: Integers) -> Whitening:
    """From standard uncertainties (m,) of each row's own error and of the error that it shares with
    its group.

    A row that is alone in its group, or has no error of its own, counts its shared error as its
    own.

    >>> found = whitening(np.array([3.0, 3.0]), np.array([4.0, 4.0]), np.array([0, 0]))
    >>> rows = found.whitened(np.eye(2))
    >>> np.linalg.inv(rows.T @ rows).round(9)
    array([[25., 16.],
           [16., 25.]])
    """
    # Without an error of its own a row would have no finite ratio. Such are lengths whose
    # repeatability is ignored: the stated uncertainty is the whole of theirs, each time again.
    alone = (np.bincount(group, minlength=1)[group] == 1) | (own_uncertainty == 0.0)
    total = np.where(alone, np.hypot(own_uncertainty, shared), own_uncertainty)
    ratio = np.where(alone, 0.0, shared / np.where(alone, 1.0, own_uncertainty))
    square = np.bincount(group, ratio**2)[group] if len(group) else ratio
    # (1 - 1 / sqrt(1 + q)) / q without the difference.
    root = np.sqrt(1.0 + square)
    return Whitening(total, ratio / np.sqrt(root * (1.0 + root)), group)


# What an exact value counts as, in its unit (m, rad, 1): far below what any laboratory can state,
# and above the rounding of a residual in double precision.
EXACT = 1e-13

# Eigenvalues of a correlation matrix below this are those of combinations that are exact.
SINGULAR = 1e-12


def at_least_exact(uncertainty: Array) -> Array:
    """Standard uncertainties with those of exact values replaced by what these count as."""
    return np.maximum(uncertainty, EXACT)


class IndefiniteError(ValueError):
    """A covariance matrix with a negative eigenvalue: `share` of the largest, of correlations."""

    def __init__(self, share: float) -> None:
        self.share = share
        super().__init__(f"a negative eigenvalue, {-share:.2g} of the largest")


@dataclass(frozen=True)
class CovarianceRoot:
    """Roots of a covariance matrix D V diag(s^2) V' D of m values: `own` (m,) is D, their standard
    uncertainties, `vectors` (m, m) the V, `deviations` (m,) the s.

    Values that are exact have an eigenvector each of their own. `doubt` says what the digits of
    the stated matrix leave open, if that matters.
    """

    own: Array
    vectors: Array
    deviations: Array
    doubt: str = ""

    def whitened(self, rows: Array) -> Array:
        """`rows` (m, ...) made uncorrelated and of unit variance: diag(1/s) V' D^-1 rows."""
        scaled = np.tensordot(self.vectors.T, rows / _along(self.own, rows), axes=1)
        return scaled / _along(self.deviations, rows)

    def pulled(self, rows: Array) -> Array:
        """The transpose of `whitened`."""
        scaled = np.tensordot(self.vectors, rows / _along(self.deviations, rows), axes=1)
        return scaled / _along(self.own, rows)

    def drawn(self, normal: Array) -> Array:
        """Errors (..., m) of standard normal numbers (..., m), by the symmetric root, which does
        not depend on the choice of eigenvectors.
        """
        exact = self.own <= EXACT
        mixed = ((normal @ self.vectors) * self.deviations) @ self.vectors.T
        return np.where(exact, 0.0, self.own * mixed)

    @property
    def weights(self) -> Array:
        """The largest derivative (m,) of each whitened row by a value."""
        return np.abs(self.vectors / self.own[:, None]).max(axis=0) / self.deviations


def covariance_root(covariance: Array, rounding: Array | float = 0.0) -> CovarianceRoot:
    """Return the root of a covariance (m, m) whose entries are known to `rounding`.

    The matrix is taken as stated. Eigenvalues of the correlations below `SINGULAR` are those of
    combinations that are exact to a millionth of the standard uncertainties. If rounding of the
    entries made an eigenvalue zero or negative, eigenvalues are at least as large as that one, and
    as half a unit of the last digit: the nearest matrix without exact combinations that only the
    digits make.

    :raises IndefiniteError: an eigenvalue that is more negative than rounding of the entries can
        make it (by at most their root sum of squares, Weyl's inequality).

    >>> root = covariance_root(np.array([[25.0, 16.0], [16.0, 25.0]]))
    >>> white = root.whitened(np.eye(2))
    >>> np.linalg.inv(white.T @ white).round(9)
    array([[25., 16.],
           [16., 25.]])
    """
    size = np.sqrt(np.diag(covariance))
    # A value without uncertainty has no correlations. Divided by what it counts as, its row would
    # have some that are made of rounding.
    exact = size <= EXACT
    own = np.where(exact, EXACT, size)
    inner, doubt = ~exact, ""
    vectors, deviations = np.eye(len(own)), np.ones(len(own))
    if inner.any():
        # Eigenvalues of correlations are between 0 and m whatever the units and sizes of values.
        # One threshold then serves all of them.
        scale = np.outer(own[inner], own[inner])
        correlation = covariance[np.ix_(inner, inner)] / scale
        values, eigenvectors = eigh((correlation + correlation.T) / 2.0)
        share = np.broadcast_to(rounding, covariance.shape)[np.ix_(inner, inner)] / scale
        least, size_of_rounding = float(values[0]), float(np.sqrt((share**2).sum()))
        if least < -size_of_rounding - SINGULAR * len(values):
            raise IndefiniteError(float(values[0] / values[-1]))
        # An eigenvalue that rounding made zero stands for an unknown small one. Left at `SINGULAR`,
        # it would make of a combination of values an almost exact one.
        raised = least <= SINGULAR
        floor = max(SINGULAR, -least, float(share.max())) if raised else SINGULAR
        # The expected norm of a symmetric matrix of such independent errors (Wigner).
        change = 2.0 * size_of_rounding / np.sqrt(3.0 * len(values))
        if least < change and change > SINGULAR:
            doubt = (
                f"its digits leave open whether some combinations of values are known better than"
                f" stated: the smallest eigenvalue of the correlations is {least:.2g}, and rounding"
                f" can change it by {change:.2g}; "
                + (f"{floor:.2g} is used" if raised else "the entries are used as stated")
                + "; give more digits"
            )
        vectors[np.ix_(inner, inner)] = eigenvectors
        deviations[inner] = np.sqrt(np.maximum(values, floor))
    return CovarianceRoot(own, vectors, deviations, doubt)
