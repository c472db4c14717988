"""Whitening of lengths between balls that are read together and share readings or certificates.

Lengths of one position and probe are v = B n - E u e to first order, measured less certified: n is
the noise of the readings, B the directions of the lengths at their two ends, e the error of each
certificate in its uncertainty u, and E assigns certificates to lengths. B has a smaller rank than
rows if there are more lengths than the balls have independent distances. The part outside its
range is free of noise and of motions of balls: it shows contradictions between certificates, once
for all positions that read the same lengths.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing.numerics import svd
from ballplate.simulator.inputs.number_arrays import Array, Flags, Integers

from ..objects import LengthArrays
from .whitening import Whitening, whitening

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
class JointWhitening:
    """Whitening of the lengths of one standard that share readings.

    `together` has the lengths (m,) of each position and probe, in the order of their certificates,
    a root (m, r) that makes of them r lengths with uncorrelated noise of unit variance, and the
    derivative (r, m) of these by the errors of the certificates, in their uncertainties, without
    the part that the m lengths determine. `consistencies` are the noise-free information of lengths
    on their own certificates: the same m lengths in k positions (k, m), and the noise-free
    combinations (e, m) of their mean.

    Of the errors of certificates, in their uncertainties, lengths read together determine q
    combinations without noise: `known` (q, equations) forms these from the equations in
    `consistencies`. They come last, and `by_known` (r, q) is their share in the r rows before.
    `shared` (r, k) with `gain` (k,) is the root of the correlation left by the other errors, (1 -
    shared diag(gain) shared').
    """

    together: tuple[tuple[Integers, Array, Array], ...]
    consistencies: tuple[tuple[Integers, Array], ...]
    known: Array
    by_known: Array
    shared: Array
    gain: Array

    def __len__(self) -> int:
        return len(self.by_known) + len(self.known)

    def whitened(self, rows: Array) -> Array:
        """Of all lengths' `rows` (lengths, k) uncorrelated ones (len, k) of unit variance."""
        means = [equations @ rows[same].mean(axis=0) for same, equations in self.consistencies]
        known_rows = self.known @ np.concatenate([np.zeros((0, rows.shape[1])), *means])
        first = np.concatenate([root.T @ rows[lengths] for lengths, root, _ in self.together])
        first -= self.by_known @ known_rows
        first = first - self.shared @ (self.gain[:, None] * (self.shared.T @ first))
        return np.concatenate([first, known_rows])

    def pull(self, rows: Array, into: Array) -> None:
        """Add the transpose of `whitened`, of `rows` (len, k), to `into` (lengths, k)."""
        first, known_part = np.split(rows, [len(self.by_known)])
        first = first - self.shared @ (self.gain[:, None] * (self.shared.T @ first))
        # The steps of `whitened` in reverse order, each transposed.
        by_mean = self.known.T @ (known_part - self.by_known.T @ first)
        start = 0
        for lengths, root, _ in self.together:
            stop = start + root.shape[1]
            into[lengths] += root @ first[start:stop]
            start = stop
        start = 0
        for same, equations in self.consistencies:
            stop = start + len(equations)
            into[same] += equations.T @ by_mean[start:stop] / len(same)
            start = stop


@dataclass(frozen=True)
class LengthWhitening:
    """Whitening of all lengths (m,) of a design: those `alone` (k,), each separately, then each
    standard's `joint` ones.

    `scatter` (m,) is the contribution of the readings to the standard uncertainty of each length.
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
            *(joint_whitening.whitened(flat) for joint_whitening in self.joint),
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
        for joint_whitening in self.joint:
            joint_whitening.pull(flat[start : start + len(joint_whitening)], result)
            start += len(joint_whitening)
        return result.reshape(-1, *rows.shape[1:])

    def by_position(self, lengths: LengthArrays, rows: Array) -> tuple[Integers, Array, Array]:
        """Return a length (r,) of each position's rows, these rows (r, k), of lengths' `rows` (m,
        k), without other positions, and their derivative (r, certificates) by the errors of
        certificates, in their uncertainties.

        Rows are in units of the readings' noise alone, uncorrelated and of unit variance except the
        errors of certificates.
        A position uses no contradictions of certificates found by others; if all read the same
        lengths of a standard, these add no information.
        """
        alone = self.alone
        weight = (
            1.0 / np.where(lengths.with_repeatability, self.scatter, lengths.uncertainty)[alone]
        )
        of_errors = np.zeros((len(alone), int(lengths.certificate.max(initial=-1)) + 1))
        scatters = np.flatnonzero(lengths.with_repeatability[alone])
        common = alone[scatters]
        of_errors[scatters, lengths.certificate[common]] = (
            -weight[scatters] * lengths.uncertainty[common]
        )
        length, parts, by_error = [alone], [weight[:, None] * rows[alone]], [of_errors]
        for chosen, root, errors in (group for joint in self.joint for group in joint.together):
            count = root.shape[1]
            length.append(np.repeat(chosen[:1], count))
            parts.append(root.T @ rows[chosen])
            by_error.append(np.zeros((count, of_errors.shape[1])))
            by_error[-1][:, lengths.certificate[chosen]] = errors
        return np.concatenate(length), np.concatenate(parts), np.concatenate(by_error)


def length_whitening_of(
    lengths: LengthArrays, noise: Array, standard: Integers, place: Integers
) -> LengthWhitening:
    """Return the whitening of lengths (m,) whose readings have the standard uncertainties `noise`
    (readings, d), in metres.

    `standard` and `place` (m,) number the artefact, and the pair of position and probe, of each
    length. Directions are the nominal ones, so that weights are constant while parameters change.
    """
    variance = noise[lengths.first] ** 2 + np.where(
        lengths.to_pivot[:, None], 0.0, noise[lengths.second] ** 2
    )
    scatter = np.sqrt((lengths.direction**2 * variance).sum(axis=1)) * lengths.with_repeatability
    # Lengths without common readings are independent but for their certificates, and need no joint
    # matrices. If one length of a standard shares a reading, all of the standard are taken
    # together, since the certificates connect them.
    is_joint = lengths.with_repeatability & _shares_readings(lengths, standard)
    alone = np.flatnonzero(~is_joint)
    _, group = np.unique(lengths.certificate[alone], return_inverse=True)
    single = whitening(scatter[alone], lengths.uncertainty[alone], group.ravel())
    joint = [
        joint_whitening(lengths, noise, place, np.flatnonzero(is_joint & (standard == k)))
        for k in np.unique(standard[is_joint])
    ]
    return LengthWhitening(scatter, alone, single, tuple(joint))


def _shares_readings(lengths: LengthArrays, standard: Integers) -> Flags:
    """Return a mask (m,) of lengths of standards with a reading at the end of several lengths."""
    chosen = np.flatnonzero(lengths.with_repeatability & ~lengths.to_pivot)
    ends = np.concatenate([lengths.first[chosen], lengths.second[chosen]])
    _, inverse, count = np.unique(ends, return_inverse=True, return_counts=True)
    shared = np.tile(chosen, 2)[count[inverse.ravel()] > 1]
    return np.isin(standard, standard[shared]) & ~lengths.to_pivot


def joint_whitening(
    lengths: LengthArrays, noise: Array, place: Integers, chosen: Integers
) -> JointWhitening:
    """Whitening of the lengths `chosen` (m,), all of one standard."""
    numbers, inverse = np.unique(lengths.certificate[chosen], return_inverse=True)
    certificate, count = inverse.ravel(), len(numbers)
    # First the rows of each position and probe by themselves. With an orthonormal basis W of the
    # range of B and the triangle T of W' B N B' W = T' T, the rows T^-T W' v have unit noise.
    # Displacements of balls change lengths within this range only, so that nothing about them is
    # left outside. No matrix of the size of all lengths is factored.
    groups: list[tuple[Integers, Array, Array]] = []
    alike: dict[bytes, list[int]] = {}
    size = 0.0
    for k in np.unique(place[chosen]):
        certificate_rows = np.flatnonzero(place[chosen] == k)
        certificate_rows = certificate_rows[
            np.argsort(certificate[certificate_rows], kind="stable")
        ]
        rows = chosen[certificate_rows]
        within, triangle = _range_and_noise(lengths, noise, rows)
        size = max(size, float(np.abs(triangle).max()))
        root = np.asarray(np.linalg.solve(triangle.T, within.T).T, float)
        alike.setdefault(certificate[certificate_rows].tobytes(), []).append(len(groups))
        groups.append((rows, within, root))
    # Positions that read the same lengths tell the same about certificates: the part of v outside
    # the range contains neither noise nor displacements, only errors of certificates. Their mean is
    # taken, so that the knowledge counts once.
    together = []
    consistencies, equations_found, errors = [], [np.zeros((0, count))], []
    for members in alike.values():
        same = np.stack([groups[k][0] for k in members])
        uncertainty = lengths.uncertainty[same[0]]
        certificate_rows = certificate[np.searchsorted(chosen, same[0])]
        outside = _outside(groups[members[0]][1], uncertainty, size)
        if len(outside):
            consistencies.append((same, outside / np.maximum(uncertainty, SMALLEST * size)))
            equations_found.append(np.zeros((len(outside), count)))
            equations_found[-1][:, certificate_rows] = outside
        for k in members:
            rows, _, root = groups[k]
            by_error = -root.T * uncertainty
            # The derivative of the rows by the errors of certificates. What the lengths themselves
            # determine of these, outside the range, is taken out of the copy that `by_position`
            # uses; for all positions together it is taken out below.
            errors.append(np.zeros((root.shape[1], count)))
            errors[-1][:, certificate_rows] = by_error
            together.append((rows, root, by_error - (by_error @ outside.T) @ outside))
    # Errors of certificates split in two. The combinations Q' e of the equations are known, and
    # their effect is removed from the rows. The others have unit variance and are common to the
    # rows of all positions, which correlates these by F F'. The symmetric root of (1 + F F')^-1,
    # from the singular values of F, makes them independent.
    known_directions, directions = _independent(
        np.concatenate(equations_found), len(consistencies) == 1
    )
    by_error = -np.concatenate(errors)
    by_known = by_error @ directions
    left_vectors, values, _ = svd(by_error - by_known @ directions.T, full_matrices=False)
    gain = 1.0 - 1.0 / np.sqrt(1.0 + values**2)
    return JointWhitening(
        tuple(together), tuple(consistencies), known_directions, by_known, left_vectors, gain
    )


def equation_root(lengths: LengthArrays, rows: Integers) -> Array:
    """Return the root (m, r) that makes uncorrelated equations of the squares of lengths `rows`
    (m,) read together.

    Noise is the same in all readings. An equation without a shared reading would keep the weight 1
    if its length were the root mean square of all.
    """
    # The square of a length changes by twice the length times the change of the length, so that
    # noise in squares grows with the length.
    size = lengths.value[rows] / np.sqrt(2.0 * (lengths.value[rows] ** 2).mean())
    readings = int(max(lengths.first.max(), lengths.second.max())) + 1
    within, triangle = _range_and_noise(lengths, np.ones((readings, 1)), rows, size)
    return np.asarray(np.linalg.solve(triangle.T, within.T).T)


def _range_and_noise(
    lengths: LengthArrays, noise: Array, rows: Integers, size: Array | float = 1.0
) -> tuple[Array, Array]:
    """Return a basis (m, r) of the changes of lengths `rows` (m,) by readings, each times its
    `size`, with a triangle (r, r).

    The noise of the basis' lengths has the covariance triangle' triangle.
    """
    along, of_noise = _directions(lengths, noise, rows)
    scale = np.broadcast_to(size, (len(rows),))[:, None]
    within, of_noise = _range(scale * along), scale * of_noise
    return within, np.asarray(np.linalg.qr(of_noise.T @ within, mode="r"))


def _directions(lengths: LengthArrays, noise: Array, rows: Integers) -> tuple[Array, Array]:
    """Return the changes of lengths `rows` (m,) by displacements of the readings, (m, readings d):
    by a metre, and by noise.
    """
    ends = np.stack([lengths.first[rows], lengths.second[rows]])
    balls_read, place = np.unique(ends, return_inverse=True)
    place = place.reshape(ends.shape)
    m, d = len(rows), lengths.direction.shape[1]
    along = np.zeros((m, len(balls_read), d))
    along[np.arange(m), place[0]] = lengths.direction[rows]
    along[np.arange(m), place[1]] -= lengths.direction[rows]
    return along.reshape(m, -1), (along * noise[balls_read]).reshape(m, -1)


def _range(along: Array) -> Array:
    """Orthonormal basis (m, r) of the changes of lengths that displacements (m, k) make."""
    vectors, values, _ = svd(along, full_matrices=False)
    return vectors[:, values > FLAT * values[0]]


def _outside(within: Array, uncertainty: Array, size: float) -> Array:
    """Return orthonormal combinations (m - r, m) of m errors, in their `uncertainty` (m,), that no
    reading affects, unless all certificates are exact.

    `within` (m, r) is the range of the readings' changes.
    """
    if uncertainty.max() < EXACT_CERTIFICATE * size:
        return np.zeros((0, len(within)))
    scaled = within / np.maximum(uncertainty, SMALLEST * size)[:, None]
    return np.linalg.qr(scaled, mode="complete")[0][:, within.shape[1] :].T


def _independent(equations: Array, told_once: bool) -> tuple[Array, Array]:
    """Return a matrix (q, e) that makes `equations` (e, c), some of them repeated, orthonormal,
    and the result (c, q).

    Those `told_once`, of a single set of lengths, are orthonormal already.
    """
    if not len(equations):
        return np.zeros((0, 0)), np.zeros((equations.shape[1], 0))
    if told_once:
        return np.eye(len(equations)), equations.T
    # Different sets of lengths may imply the same combination of certificates. It counts once.
    left_vectors, values, right = svd(equations, full_matrices=False)
    is_independent = values > TOLD_TWICE * values[0]
    return left_vectors[:, is_independent].T / values[is_independent, None], (
        right[is_independent].T
    )
