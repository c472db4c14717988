"""Differences with their uncertainties: normalised errors E_n, and joint tests."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from ballplate.simulator.computing import blank, comparable, single_threaded
from ballplate.simulator.design import Flags
from ballplate.simulator.machines import Array

from .campaign_tests import (
    HELD,
    JointDifference,
    Roots,
    SigmaPair,
    joint_difference,
    orthonormal,
    single_chances,
    with_common,
)
from .compared_maps import MappedValues


@dataclass(frozen=True, eq=False)
class FigureGroup:
    """Differences (m,) of one kind, second map less first, with `names`.

    `standard_uncertainties` (m,) are NaN where undetermined; `chances` (m,) are probabilities of
    |E_n| > 1 without a change. `unit` is m or rad. Error functions have a `meaning`, these and
    plates a joint `test`.
    """

    kind: str
    unit: str
    names: tuple[str, ...]
    differences: Array
    standard_uncertainties: Array
    chances: Array
    coverage_factor: float = 2.0
    meaning: str = ""
    test: JointDifference | None = None

    @property
    def count(self) -> int:
        """Number of compared differences: determined, and not fixed by the frame."""
        return int(self.is_compared.sum())

    @property
    def undetermined(self) -> int:
        return int(self.is_undetermined.sum())

    @property
    def is_undetermined(self) -> Flags:
        return np.isnan(self.standard_uncertainties)

    @cached_property
    def is_compared(self) -> Flags:
        u = self.standard_uncertainties
        return np.asarray(u > HELD * np.nanmax(u, initial=0.0))

    @cached_property
    def normalised(self) -> Array:
        """E_n (m,): difference over expanded uncertainty; NaN if excluded from the comparison."""
        u = np.where(self.is_compared, self.standard_uncertainties, np.nan)
        return self.differences / (self.coverage_factor * u)

    @property
    def exceeding(self) -> int:
        """Number of |E_n| > 1."""
        return int((np.abs(self.normalised) > 1.0).sum())

    @property
    def by_chance(self) -> float:
        """Expected share of |E_n| > 1 without a change."""
        return float(self.chances[self.is_compared].mean()) if self.count else 0.0

    @property
    def largest(self) -> int | None:
        """Index of the largest |E_n|; None without a comparison."""
        if not self.count:
            return None
        return int(comparable(np.nan_to_num(np.abs(self.normalised))).argmax())

    @property
    def largest_size(self) -> float:
        """The largest |E_n|; NaN without a comparison."""
        return math.nan if self.largest is None else abs(float(self.normalised[self.largest]))

    @property
    def largest_name(self) -> str:
        """Name of the difference with the largest |E_n|; empty without a comparison."""
        return "" if self.largest is None else self.names[self.largest]


@dataclass(frozen=True, eq=False)
class ValueDifference:
    """The same functions (m,) by two maps."""

    first: MappedValues
    second: MappedValues
    scatters: SigmaPair

    @property
    def values(self) -> Array:
        """Second map less first (m,)."""
        return self.second.values - self.first.values

    def by(self, matrix: Array) -> ValueDifference:
        """Return linear functions by a matrix (k, m)."""
        return ValueDifference(self.first.by(matrix), self.second.by(matrix), self.scatters)

    def without(self, basis: Array) -> ValueDifference:
        """These less their parts in a space of changes of orthonormal columns (m, k)."""
        return ValueDifference(self.first.without(basis), self.second.without(basis), self.scatters)

    @property
    def is_open(self) -> Flags:
        """Flags (m,) of undetermined functions of either map."""
        values = np.zeros(len(self.values))
        for mapped in (self.first, self.second):
            values = values + blank(np.zeros(len(values)), mapped.null, mapped.size)
        return np.isnan(values)

    @property
    def roots(self) -> Roots:
        """Square roots (m, r) of both campaigns' parts of the covariance."""
        first_map, second_map = self.first, self.second
        first, second = (scatter.sigma for scatter in self.scatters)
        common = first_map.shared / first - second_map.shared / second
        return with_common((first_map.root, second_map.root), common, self.scatters)

    def variances(self) -> Roots:
        """Both campaigns' parts of the variances (m,)."""
        first, second = ((root**2).sum(axis=1) for root in self.roots)
        return first, second

    def standard_uncertainties(self) -> Array:
        """Return those of the differences (m,); NaN where undetermined."""
        return np.where(self.is_open, np.nan, np.sqrt(sum(self.variances())))

    def group(
        self,
        kind: str,
        unit: str,
        names: tuple[str, ...],
        coverage_factor: float,
        stated: tuple[Array | float, Array | float] = (0.0, 0.0),
    ) -> FigureGroup:
        """Return the differences as one group, plus `stated` variances (m,) of either side."""
        first, second = (
            variance + more for variance, more in zip(self.variances(), stated, strict=True)
        )
        with np.errstate(invalid="ignore"):
            shares = np.nan_to_num(first / (first + second))
        u = np.where(self.is_open, np.nan, np.sqrt(first + second))
        chances = single_chances(coverage_factor, shares, self.scatters)
        return FigureGroup(kind, unit, names, self.values, u, chances, coverage_factor)

    @single_threaded
    def joint_test(self, what: str) -> JointDifference | None:
        """Return the joint test in the uncertain space less the undetermined one; None if empty."""
        sides = self.first, self.second
        difference = self.by(
            orthonormal(np.hstack([m for side in sides for m in (side.root, side.shared)])).T
        )
        null = np.concatenate([side.null for side in (difference.first, difference.second)], axis=1)
        if null.shape[1]:
            size = max(
                float(np.abs(side.size).max(initial=0.0))
                for side in (difference.first, difference.second)
            )
            open_ = orthonormal(null, 1e-7, size)
            determined = orthonormal(np.eye(len(null)) - open_ @ open_.T, 1e-6, 1.0)
            difference = difference.by(determined.T)
        alone = [
            m for side in (difference.first, difference.second) for m in (side.root, side.shared)
        ]
        test = joint_difference(
            difference.values, difference.roots, self.scatters, np.hstack(alone)
        )
        return None if test is None else replace(test, what=what)
