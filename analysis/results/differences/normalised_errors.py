"""Differences of figures with their uncertainties: normalised errors E_n, and joint tests."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing.rounding import blank, comparable
from ballplate.simulator.computing.threads import scipy_linalg, single_threaded
from ballplate.simulator.machines.protocol import Array
from numpy.typing import NDArray

from .compared_maps import MappedValues

# Standard uncertainties below this part of the largest of a group are rounding: the frame, or the
# plate's axes, hold the figure.
HELD = 1e-9
# Parts of the largest column below which what is left of another is rounding.
NO_DIRECTION = 1e-9


@dataclass(frozen=True, eq=False)
class FigureGroup:
    """Figures (m,) of one kind, what the second map says less what the first does, with their
    `names`.

    `standard_uncertainties` (m,) are those of the differences, NaN where one is undetermined;
    `degrees_of_freedom` (m,) are those of the scatter that they come from. `unit` is m or rad.
    """

    kind: str
    unit: str
    names: tuple[str, ...]
    differences: Array
    standard_uncertainties: Array
    degrees_of_freedom: Array
    coverage_factor: float = 2.0

    @property
    def count(self) -> int:
        """How many are compared: those that are determined, and not held by the frame."""
        return int(self.is_compared.sum())

    @property
    def undetermined(self) -> int:
        return int(np.isnan(self.standard_uncertainties).sum())

    @property
    def is_compared(self) -> NDArray[np.bool_]:
        u = self.standard_uncertainties
        largest = np.nanmax(u, initial=0.0)
        return np.asarray(~np.isnan(u) & (u > HELD * largest))

    @property
    def normalised(self) -> Array:
        """E_n (m,): the difference over its expanded uncertainty; NaN where it is not compared."""
        u = np.where(self.is_compared, self.standard_uncertainties, np.nan)
        return np.asarray(self.differences / (self.coverage_factor * u))

    @property
    def exceeding(self) -> int:
        """How many have |E_n| > 1."""
        return int((np.abs(self.normalised) > 1.0).sum())

    @property
    def by_chance(self) -> float:
        """Share of |E_n| > 1 that is to be expected where nothing has changed."""
        from scipy.special import stdtr

        freedom = self.degrees_of_freedom[self.is_compared]
        if not len(freedom):
            return 0.0
        return float(np.mean(2.0 * stdtr(np.minimum(freedom, 1e9), -self.coverage_factor)))

    @property
    def largest(self) -> int | None:
        """Place of the largest |E_n|; None where nothing is compared."""
        if not self.count:
            return None
        return int(comparable(np.nan_to_num(np.abs(self.normalised))).argmax())


@dataclass(frozen=True)
class JointTest:
    """One test of many figures together: whether their differences are as large as their joint
    covariance explains.

    `statistic` is chi-squared with as many `dimensions` as there are independent differences; over
    these it follows F with the `degrees_of_freedom` of the scatter, where these are finite. `p` is
    the chance of so much where nothing has changed.
    """

    what: str
    statistic: float
    dimensions: int
    degrees_of_freedom: float
    p: float


@dataclass(frozen=True, eq=False)
class ValueDifference:
    """The same functions (m,) by two maps."""

    first: MappedValues
    second: MappedValues
    freedom: tuple[float, float]

    @property
    def values(self) -> Array:
        """What the second says less what the first does."""
        return self.second.values - self.first.values

    def by(self, matrix: Array) -> ValueDifference:
        """Linear functions of these, by a matrix (k, m)."""
        return ValueDifference(self.first.by(matrix), self.second.by(matrix), self.freedom)

    def without(self, basis: Array) -> ValueDifference:
        """These less their parts in a space of changes of orthonormal columns (m, k)."""
        return ValueDifference(self.first.without(basis), self.second.without(basis), self.freedom)

    @property
    def is_open(self) -> NDArray[np.bool_]:
        """Which (m,) either map leaves undetermined."""
        values = np.zeros(len(self.values))
        for one in (self.first, self.second):
            values = values + blank(np.zeros(len(values)), one.null, one.size)
        return np.isnan(values)

    def standard_uncertainties(self) -> Array:
        """Of the differences (m,); NaN where one is undetermined."""
        both = [(one.root**2).sum(axis=1) for one in (self.first, self.second)]
        common = 2.0 * (self.first.shared * self.second.shared).sum(axis=1)
        found = np.sqrt(np.maximum(both[0] + both[1] - common, 0.0))
        return np.where(self.is_open, np.nan, found)

    def covariance(self) -> Array:
        """Of the differences (m, m)."""
        one, other = self.first, self.second
        common = one.shared @ other.shared.T
        return one.root @ one.root.T + other.root @ other.root.T - common - common.T

    def degrees_of_freedom(self) -> Array:
        """Of each difference (m,), by Welch and Satterthwaite."""
        parts = [(one.root**2).sum(axis=1) for one in (self.first, self.second)]
        return _pooled(parts, self.freedom)

    def group(
        self, kind: str, unit: str, names: tuple[str, ...], coverage_factor: float
    ) -> FigureGroup:
        """The differences as figures of one kind."""
        return FigureGroup(
            kind,
            unit,
            names,
            self.values,
            self.standard_uncertainties(),
            self.degrees_of_freedom(),
            coverage_factor,
        )

    @single_threaded
    def joint_test(self, what: str) -> JointTest | None:
        """The test of all of them together, in the space of what has an uncertainty less what is
        undetermined; None where nothing is left of it.
        """
        basis = orthonormal(np.concatenate([self.first.root, self.second.root], axis=1))
        found = self.by(basis.T)
        null = np.concatenate([one.null for one in (found.first, found.second)], axis=1)
        if null.shape[1]:
            size = max(
                float(np.abs(one.size).max(initial=0.0)) for one in (found.first, found.second)
            )
            open_ = orthonormal(null, 1e-7 * size)
            left = orthonormal(np.eye(len(null)) - open_ @ open_.T, 1e-6)
            found = found.by(left.T)
        spread, directions = np.linalg.eigh(found.covariance())
        is_uncertain = spread > HELD**2 * max(float(spread.max(initial=0.0)), 0.0)
        whitened = found.by((directions[:, is_uncertain] / np.sqrt(spread[is_uncertain])).T)
        count = len(whitened.values)
        if not count:
            return None
        shares = [np.array([(one.root**2).sum()]) for one in (whitened.first, whitened.second)]
        freedom = float(_pooled(shares, self.freedom)[0])
        statistic = float((whitened.values**2).sum())
        return JointTest(what, statistic, count, freedom, _chance(statistic, count, freedom))


def orthonormal(columns: Array, least: float | None = None) -> Array:
    """An orthonormal basis (m, r) of the space of columns (m, n); what is left of a column, up to
    `least`, by default a small part of the largest, is rounding.
    """
    if not columns.size:
        return np.zeros((len(columns), 0))
    # With pivots: singular values would say the same, but are not always found.
    basis, triangle, _ = scipy_linalg().qr(columns, mode="economic", pivoting=True)
    sizes = np.abs(np.diagonal(triangle))
    limit = NO_DIRECTION * float(sizes.max()) if least is None else least
    return np.asarray(basis[:, sizes > limit])


def _pooled(variances: list[Array], freedom: tuple[float, float]) -> Array:
    """Degrees of freedom (m,) of sums of variances (m,) that are estimated with some each."""
    with np.errstate(divide="ignore", invalid="ignore"):
        found = (variances[0] + variances[1]) ** 2 / sum(
            part**2 / own for part, own in zip(variances, freedom, strict=True)
        )
    return np.where(np.isnan(found), np.inf, found)


def _chance(statistic: float, dimensions: int, freedom: float) -> float:
    from scipy.special import chdtrc, fdtrc

    if np.isinf(freedom):
        return float(chdtrc(dimensions, statistic))
    return float(fdtrc(dimensions, freedom, statistic / dimensions))
