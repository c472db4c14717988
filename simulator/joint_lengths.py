"""Whitening of lengths between balls that are read together, of which some share readings and some certificates.

Lengths of one position and probe are v = B n - E u e to first order, measured less certified: n is the noise of the
readings, B the directions of the lengths at their two ends, e the error of each certificate in its uncertainty u,
and E tells which certificate a length has. B has a smaller rank than rows wherever there are more lengths than the
balls have independent distances. What lies outside its range is free of noise and of anything that moves a ball: it
tells how far certificates contradict one another, once for all positions that read the same lengths.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .machines.protocol import Array
from .whitening import Integers, Whitening, whitening

if TYPE_CHECKING:
    from .design import Lengths

# Displacements that change lengths by less than this, compared with what changes them most, count as changing none:
# how straight or flat a standard is, is not known so well, and their effect is of second order.
FLAT = 1e-4

# Certificates whose errors are below this fraction of the readings' noise are exact: whether they contradict one
# another is beyond what lengths show to first order.
EXACT_CERTIFICATE = 1e-3

# Singular values of equations about certificates below this fraction of the largest are those of equations told twice.
TOLD_TWICE = 1e-9


@dataclass(frozen=True)
class Together:
    """Lengths `rows` (m,) of one position and probe: `root` (m, r) makes of them r uncorrelated ones of unit variance.

    Rows stand in the order of their certificates.
    """

    rows: Integers
    root: Array


@dataclass(frozen=True)
class Consistency:
    """What lengths of the same certificates tell about the latter, wherever they are read together.

    `rows` (k, m) are the same m lengths in k positions, `equations` (e, m) what of their mean is free of noise.
    """

    rows: Integers
    equations: Array


@dataclass(frozen=True)
class JointWhitening:
    """Whitening of the lengths of one standard whose readings they share.

    Of c certificates with errors e in their uncertainties, lengths that are read together tell q combinations without
    noise: `known` (q, equations) makes these of the equations in `consistencies`. They come last, `by_known` (r, q) is what
    they take from the r rows before, and `shared` (r, k) with `gain` (k,) the root of what the other errors leave
    correlated, (1 - shared diag(gain) shared').
    """

    together: tuple[Together, ...]
    consistencies: tuple[Consistency, ...]
    known: Array
    by_known: Array
    shared: Array
    gain: Array

    def __len__(self) -> int:
        return len(self.by_known) + len(self.known)

    def whitened(self, rows: Array) -> Array:
        """Of all lengths' `rows` (lengths, k) uncorrelated ones (len, k) of unit variance."""
        told = [one.equations @ rows[one.rows].mean(axis=0) for one in self.consistencies]
        known = self.known @ np.concatenate([np.zeros((0, rows.shape[1])), *told])
        first = np.concatenate([one.root.T @ rows[one.rows] for one in self.together]) - self.by_known @ known
        first = first - self.shared @ (self.gain[:, None] * (self.shared.T @ first))
        return np.concatenate([first, known])

    def pull(self, rows: Array, into: Array) -> None:
        """Add the transpose of `whitened`, of `rows` (len, k), to `into` (lengths, k)."""
        first, known = np.split(rows, [len(self.by_known)])
        first = first - self.shared @ (self.gain[:, None] * (self.shared.T @ first))
        told = self.known.T @ (known - self.by_known.T @ first)
        start = 0
        for each in self.together:
            stop = start + each.root.shape[1]
            into[each.rows] += each.root @ first[start:stop]
            start = stop
        start = 0
        for one in self.consistencies:
            stop = start + len(one.equations)
            into[one.rows] += one.equations.T @ told[start:stop] / len(one.rows)
            start = stop


@dataclass(frozen=True)
class LengthWhitening:
    """Whitening of all lengths (m,) of a design: those `alone` (k,), by themselves, then each standard's `joint` ones.

    `scatter` (m,) is what the readings contribute to the standard uncertainty of each length.
    """

    scatter: Array
    alone: Integers
    single: Whitening
    joint: tuple[JointWhitening, ...]

    def __len__(self) -> int:
        """Number of rows that are left: how many lengths do not follow from others."""
        return len(self.single) + sum(map(len, self.joint))

    def whitened(self, rows: Array) -> Array:
        """Uncorrelated rows (len, ...) of unit variance, of lengths' `rows` (m, ...)."""
        if not self.joint:
            return self.single.whitened(rows)
        flat = rows.reshape(len(rows), -1)
        parts = [self.single.whitened(flat[self.alone]), *(one.whitened(flat) for one in self.joint)]
        return np.concatenate(parts).reshape(-1, *rows.shape[1:])

    def pulled(self, rows: Array) -> Array:
        """The transpose of `whitened`, which leads from whitened residuals (len, ...) to gradients (m, ...)."""
        if not self.joint:
            return self.single.pulled(rows)
        flat = rows.reshape(len(rows), -1)
        result = np.zeros((len(self.scatter), flat.shape[1]))
        start = len(self.single)
        result[self.alone] = self.single.pulled(flat[:start])
        for one in self.joint:
            one.pull(flat[start : start + len(one)], result)
            start += len(one)
        return result.reshape(-1, *rows.shape[1:])


def length_whitening(given: Lengths, noise: Array, standard: Integers, place: Integers) -> LengthWhitening:
    """Whitening of lengths (m,) whose readings have the standard uncertainties `noise` (readings, d), in metres.

    `standard` and `place` (m,) number the artefact, and the position and probe, of each length. Directions are the
    nominal ones, so that weights stay what they are while parameters change.
    """
    variance = noise[given.first] ** 2 + np.where(given.to_pivot[:, None], 0.0, noise[given.second] ** 2)
    scatter = np.sqrt((given.direction**2 * variance).sum(axis=1)) * given.with_repeatability
    is_joint = given.with_repeatability & _shares_readings(given, standard)
    alone = np.flatnonzero(~is_joint)
    _, group = np.unique(given.certificate[alone], return_inverse=True)
    single = whitening(scatter[alone], given.uncertainty[alone], group.ravel())
    joint = [
        joint_whitening(given, noise, place, np.flatnonzero(is_joint & (standard == k)))
        for k in np.unique(standard[is_joint])
    ]
    return LengthWhitening(scatter, alone, single, tuple(joint))


def _shares_readings(given: Lengths, standard: Integers) -> Array:
    """Which lengths (m,) are of standards of which some reading is an end of several lengths."""
    chosen = np.flatnonzero(given.with_repeatability & ~given.to_pivot)
    ends = np.concatenate([given.first[chosen], given.second[chosen]])
    _, inverse, count = np.unique(ends, return_inverse=True, return_counts=True)
    shared = np.tile(chosen, 2)[count[inverse.ravel()] > 1]
    return np.isin(standard, standard[shared]) & ~given.to_pivot


def joint_whitening(given: Lengths, noise: Array, place: Integers, chosen: Integers) -> JointWhitening:
    """Whitening of the lengths `chosen` (m,), all of one standard."""
    _, certificate, count = np.unique(given.certificate[chosen], return_inverse=True, return_counts=True)
    certificate = certificate.ravel()
    together: list[Together] = []
    alike: dict[bytes, list[int]] = {}
    ranges: list[Array] = []
    errors: list[Array] = []
    size = 0.0
    for k in np.unique(place[chosen]):
        own = np.flatnonzero(place[chosen] == k)
        own = own[np.argsort(certificate[own], kind="stable")]
        rows = chosen[own]
        along, of_noise = _directions(given, noise, rows)
        within = _range(along)
        triangle = np.linalg.qr((within.T @ of_noise).T, mode="r")
        size = max(size, float(np.abs(triangle).max()))
        # Solved, as an inverse of a triangle of some dozens.
        root = np.linalg.solve(triangle.T, within.T).T
        alike.setdefault(certificate[own].tobytes(), []).append(len(together))
        together.append(Together(rows, root))
        ranges.append(within)
        of_errors = np.zeros((root.shape[1], len(count)))
        np.add.at(of_errors.T, certificate[own], given.uncertainty[rows][:, None] * root)
        errors.append(of_errors)
    consistencies, told = [], [np.zeros((0, len(count)))]
    for members in alike.values():
        rows = np.stack([together[k].rows for k in members])
        uncertainty = given.uncertainty[rows[0]]
        within = ranges[members[0]]
        surplus = len(within) - within.shape[1]
        if not surplus or uncertainty.max() < EXACT_CERTIFICATE * size:
            continue
        uncertainty = np.maximum(uncertainty, EXACT_CERTIFICATE**2 * size)
        outside = np.linalg.qr(within / uncertainty[:, None], mode="complete")[0][:, within.shape[1] :].T
        consistencies.append(Consistency(rows, outside / uncertainty))
        about = np.zeros((surplus, len(count)))
        about[:, certificate[np.searchsorted(chosen, rows[0])]] = outside
        told.append(about)
    known, directions = _independent(np.concatenate(told))
    by_error = np.concatenate(errors)
    by_known = by_error @ directions
    left, values, _ = np.linalg.svd(by_error - by_known @ directions.T, full_matrices=False)
    gain = 1.0 - 1.0 / np.sqrt(1.0 + values**2)
    return JointWhitening(tuple(together), tuple(consistencies), known, by_known, left, gain)


def _directions(given: Lengths, noise: Array, rows: Integers) -> tuple[Array, Array]:
    """What displacements of the readings change lengths `rows` (m,) by, (m, readings d): by a metre, and by noise."""
    ends = np.stack([given.first[rows], given.second[rows]])
    read, place = np.unique(ends, return_inverse=True)
    place = place.reshape(ends.shape)
    m, d = len(rows), given.direction.shape[1]
    along = np.zeros((m, len(read), d))
    along[np.arange(m), place[0]] = given.direction[rows]
    along[np.arange(m), place[1]] -= given.direction[rows]
    return along.reshape(m, -1), (along * noise[read]).reshape(m, -1)


def _range(along: Array) -> Array:
    """Orthonormal basis (m, r) of the changes of lengths that displacements (m, k) make."""
    vectors, values, _ = np.linalg.svd(along, full_matrices=False)
    return np.asarray(vectors[:, values > FLAT * values[0]])


def _independent(equations: Array) -> tuple[Array, Array]:
    """What makes of `equations` (e, c), some told twice, orthonormal ones: a matrix (q, e), and the latter (c, q)."""
    if not len(equations):
        return np.zeros((0, 0)), np.zeros((equations.shape[1], 0))
    left, values, right = np.linalg.svd(equations, full_matrices=False)
    kept = values > TOLD_TWICE * values[0]
    return np.asarray(left[:, kept].T / values[kept, None]), np.asarray(right[kept].T)
