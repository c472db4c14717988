"""Whitening of observations that share errors, such as that of a certificate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..machines.protocol import Array, Integers


@dataclass(frozen=True)
class Whitening:
    """The symmetric root of an inverse covariance, diagonal but for errors that the rows of a group
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
        return np.asarray(self._projected(rows) / _along(self.own, rows))

    def _projected(self, rows: Array) -> Array:
        if not self.direction.any():
            return rows
        direction = _along(self.direction, rows)
        total = np.zeros((int(self.group.max()) + 1, *rows.shape[1:]))
        np.add.at(total, self.group, direction * rows)
        return np.asarray(rows - direction * total[self.group])


def _along(values: Array, rows: Array) -> Array:
    """Values (m,) in the shape of rows (m, ...)."""
    return values.reshape(-1, *[1] * (rows.ndim - 1))


def whitening(own: Array, shared: Array, group: Integers) -> Whitening:
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
    alone = (np.bincount(group, minlength=1)[group] == 1) | (own == 0.0)
    total = np.where(alone, np.hypot(own, shared), own)
    ratio = np.where(alone, 0.0, shared / np.where(alone, 1.0, own))
    square = np.bincount(group, ratio**2)[group] if len(group) else ratio
    # (1 - 1 / sqrt(1 + q)) / q without the difference.
    root = np.sqrt(1.0 + square)
    return Whitening(total, ratio / np.sqrt(root * (1.0 + root)), group)
