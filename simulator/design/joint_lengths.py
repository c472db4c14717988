"""Whitening of lengths between balls that are read together and share readings or certificates.

Lengths of one position and probe are v = B n - E u e to first order, measured less certified: n is
the noise of the readings, B the directions of the lengths at their two ends, e the error of each
certificate in its uncertainty u, and E tells which certificate a length has. B has a smaller rank
than rows wherever there are more lengths than the balls have independent distances. What lies
outside its range is free of noise and of anything that moves a ball: it tells how far certificates
contradict one another, once for all positions that read the same lengths.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..machines.protocol import Array, Integers
from .whitening import Whitening, whitening

if TYPE_CHECKING:
    from .observations import Lengths

# Displacements that change lengths by less than this, compared with what changes them most, count
# as changing none: how straight or flat a standard is, is not known so well, and their effect is of
# second order.
FLAT = 1e-4

# Certificates whose errors are below this fraction of the readings' noise are exact: whether they
# contradict one another is beyond what lengths show to first order.
EXACT_CERTIFICATE = 1e-3

# Smaller uncertainties than this fraction of the noise, beside larger ones, make no difference any
# more.
SMALLEST = 1e-6

# Singular values of equations about certificates below this fraction of the largest are those of
# equations told twice.
TOLD_TWICE = 1e-9


@dataclass(frozen=True)
class Together:
    """Lengths `rows` (m,) of one position and probe, in the order of their certificates.

    `root` (m, r) makes of them r lengths whose noise is uncorrelated and has unit variance.
    `by_error` (r, m) is what the errors of the certificates, in their uncertainties, change these
    by, less what the m lengths tell of them.
    """

    rows: Integers
    root: Array
    by_error: Array


@dataclass(frozen=True)
class Consistency:
    """What lengths of the same certificates tell about the latter, wherever they are read together.

    `rows` (k, m) are the same m lengths in k positions, `equations` (e, m) what of their mean is
    free of noise.
    """

    rows: Integers
    equations: Array


@dataclass(frozen=True)
class JointWhitening:
    """Whitening of the lengths of one standard whose readings they share.

    Of the errors of certificates, in their uncertainties, lengths that are read together tell q
    combinations without noise: `known` (q, equations) makes these of the equations in
    `consistencies`. They come last, and `by_known` (r, q) is what they take from the r rows before.
    `shared` (r, k) with `gain` (k,) is the root of what the other errors leave correlated, (1 -
    shared diag(gain) shared').
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
        first = (
            np.concatenate([one.root.T @ rows[one.rows] for one in self.together])
            - self.by_known @ known
        )
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
class ByPosition:
    """Rows of lengths, position by position, in units of the readings' noise alone.

    `length` (r,) is a length of each row's position, `rows` (r, k) are uncorrelated and of unit
    variance but for the errors of certificates, in their uncertainties, and `by_error` (r,
    certificates) is the derivative by these.
    """

    length: Integers
    rows: Array
    by_error: Array


@dataclass(frozen=True)
class LengthWhitening:
    """Whitening of all lengths (m,) of a design: those `alone` (k,), by themselves, then each
    standard's `joint` ones.

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
        parts = [
            self.single.whitened(flat[self.alone]),
            *(one.whitened(flat) for one in self.joint),
        ]
        return np.concatenate(parts).reshape(-1, *rows.shape[1:])

    def pulled(self, rows: Array) -> Array:
        """The transpose of `whitened`, which leads from whitened residuals (len, ...) to gradients
        (m, ...).
        """
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

    def by_position(self, given: Lengths, rows: Array) -> ByPosition:
        """Rows (r, k) of each position by itself, of lengths' `rows` (m, k).

        No position makes use of what others tell of certificates that contradict one another; where
        all read the same lengths of a standard there is nothing more to be told.
        """
        alone = self.alone
        weight = 1.0 / np.where(given.with_repeatability, self.scatter, given.uncertainty)[alone]
        of_errors = np.zeros((len(alone), int(given.certificate.max(initial=-1)) + 1))
        scatters = np.flatnonzero(given.with_repeatability[alone])
        common = alone[scatters]
        of_errors[scatters, given.certificate[common]] = (
            -weight[scatters] * given.uncertainty[common]
        )
        length, found, by_error = [alone], [weight[:, None] * rows[alone]], [of_errors]
        for each in (one for joint in self.joint for one in joint.together):
            count = each.root.shape[1]
            length.append(np.repeat(each.rows[:1], count))
            found.append(each.root.T @ rows[each.rows])
            by_error.append(np.zeros((count, of_errors.shape[1])))
            by_error[-1][:, given.certificate[each.rows]] = each.by_error
        return ByPosition(np.concatenate(length), np.concatenate(found), np.concatenate(by_error))


def length_whitening(
    given: Lengths, noise: Array, standard: Integers, place: Integers
) -> LengthWhitening:
    """Whitening of lengths (m,) whose readings have the standard uncertainties `noise` (readings,
    d), in metres.

    `standard` and `place` (m,) number the artefact, and the position and probe, of each length.
    Directions are the nominal ones, so that weights stay what they are while parameters change.
    """
    variance = noise[given.first] ** 2 + np.where(
        given.to_pivot[:, None], 0.0, noise[given.second] ** 2
    )
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


def _shares_readings(given: Lengths, standard: Integers) -> NDArray[np.bool_]:
    """Which lengths (m,) are of standards of which some reading is an end of several lengths."""
    chosen = np.flatnonzero(given.with_repeatability & ~given.to_pivot)
    ends = np.concatenate([given.first[chosen], given.second[chosen]])
    _, inverse, count = np.unique(ends, return_inverse=True, return_counts=True)
    shared = np.tile(chosen, 2)[count[inverse.ravel()] > 1]
    return np.isin(standard, standard[shared]) & ~given.to_pivot


def joint_whitening(
    given: Lengths, noise: Array, place: Integers, chosen: Integers
) -> JointWhitening:
    """Whitening of the lengths `chosen` (m,), all of one standard."""
    numbers, inverse = np.unique(given.certificate[chosen], return_inverse=True)
    certificate, count = inverse.ravel(), len(numbers)
    groups: list[tuple[Integers, Array, Array]] = []
    alike: dict[bytes, list[int]] = {}
    size = 0.0
    for k in np.unique(place[chosen]):
        own = np.flatnonzero(place[chosen] == k)
        own = own[np.argsort(certificate[own], kind="stable")]
        rows = chosen[own]
        within, triangle = _range_and_noise(given, noise, rows)
        size = max(size, float(np.abs(triangle).max()))
        root = np.asarray(np.linalg.solve(triangle.T, within.T).T, float)
        alike.setdefault(certificate[own].tobytes(), []).append(len(groups))
        groups.append((rows, within, root))
    together: list[Together] = []
    consistencies, told, errors = [], [np.zeros((0, count))], []
    for members in alike.values():
        same = np.stack([groups[k][0] for k in members])
        uncertainty = given.uncertainty[same[0]]
        own = certificate[np.searchsorted(chosen, same[0])]
        outside = _outside(groups[members[0]][1], uncertainty, size)
        if len(outside):
            consistencies.append(
                Consistency(same, outside / np.maximum(uncertainty, SMALLEST * size))
            )
            told.append(np.zeros((len(outside), count)))
            told[-1][:, own] = outside
        for k in members:
            rows, _, root = groups[k]
            by_error = -root.T * uncertainty
            errors.append(np.zeros((root.shape[1], count)))
            errors[-1][:, own] = by_error
            together.append(Together(rows, root, by_error - (by_error @ outside.T) @ outside))
    known, directions = _independent(np.concatenate(told), len(consistencies) == 1)
    by_error = -np.concatenate(errors)
    by_known = by_error @ directions
    left, values, _ = np.linalg.svd(by_error - by_known @ directions.T, full_matrices=False)
    gain = 1.0 - 1.0 / np.sqrt(1.0 + values**2)
    return JointWhitening(tuple(together), tuple(consistencies), known, by_known, left, gain)


def equation_root(given: Lengths, rows: Integers) -> Array:
    """Root (m, r) that makes uncorrelated equations of those of the squares of lengths `rows` (m,)
    read together.

    Noise is the same in all readings. An equation that shared no reading would keep the weight 1,
    were its length the root mean square of all.
    """
    size = given.value[rows] / np.sqrt(2.0 * (given.value[rows] ** 2).mean())
    readings = int(max(given.first.max(), given.second.max())) + 1
    within, triangle = _range_and_noise(given, np.ones((readings, 1)), rows, size)
    return np.asarray(np.linalg.solve(triangle.T, within.T).T)


def _range_and_noise(
    given: Lengths, noise: Array, rows: Integers, size: Array | float = 1.0
) -> tuple[Array, Array]:
    """Basis (m, r) of what readings change of lengths `rows` (m,), each times its `size`, with a
    triangle (r, r).

    The noise of basis' lengths has the covariance triangle' triangle.
    """
    along, of_noise = _directions(given, noise, rows)
    scale = np.broadcast_to(size, (len(rows),))[:, None]
    within, of_noise = _range(scale * along), scale * of_noise
    return within, np.asarray(np.linalg.qr(of_noise.T @ within, mode="r"))


def _directions(given: Lengths, noise: Array, rows: Integers) -> tuple[Array, Array]:
    """What displacements of the readings change lengths `rows` (m,) by, (m, readings d): by a
    metre, and by noise.
    """
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


def _outside(within: Array, uncertainty: Array, size: float) -> Array:
    """Orthonormal combinations (m - r, m) of m errors, in their `uncertainty` (m,), that no reading
    bears upon.

    `within` (m, r) is the range of what readings change. None, where all certificates are exact.
    """
    if uncertainty.max() < EXACT_CERTIFICATE * size:
        return np.zeros((0, len(within)))
    scaled = within / np.maximum(uncertainty, SMALLEST * size)[:, None]
    return np.asarray(np.linalg.qr(scaled, mode="complete")[0][:, within.shape[1] :].T)


def _independent(equations: Array, told_once: bool) -> tuple[Array, Array]:
    """What makes of `equations` (e, c), some told twice, orthonormal ones: a matrix (q, e), and the
    latter (c, q).

    Those `told_once`, of a single set of lengths, are orthonormal as they are.
    """
    if not len(equations):
        return np.zeros((0, 0)), np.zeros((equations.shape[1], 0))
    if told_once:
        return np.eye(len(equations)), equations.T
    left, values, right = np.linalg.svd(equations, full_matrices=False)
    kept = values > TOLD_TWICE * values[0]
    return np.asarray(left[:, kept].T / values[kept, None]), np.asarray(right[kept].T)
