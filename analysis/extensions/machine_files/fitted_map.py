"""Error map of a fit: the estimated errors of a machine with their joint covariance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from ballplate.results import LackOfFit
from ballplate.simulator.computing import TOUCHED, blank, eigh, svd
from ballplate.simulator.design import Probes, Volume
from ballplate.simulator.experiment import LEAST_SIGMA, MapData
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.machines import Array, ErrorModel, Integers, Parameter, Unit

# Eigenvalues of correlations below this, in parts of the largest, are rounding.
ROUNDING = 1e-13

# What two campaigns have of each other's readings.
InCommon = Literal["none", "some", "same"]


@dataclass(frozen=True)
class LeftOut:
    """A parameter that a fit estimated and its map does not apply, such as one of an influence
    quantity.

    `kind` is as in the estimates of a fit; `value` and `standard_uncertainty` are in `unit`, None
    if undetermined.
    """

    name: str
    kind: str
    unit: Unit
    value: float | None
    standard_uncertainty: float | None


@dataclass(frozen=True, eq=False, repr=False)
class FittedMap:
    """The estimated errors of a machine, b = (a, estimated probe offsets) with its covariance.

    `settings` are those of the error `model` in the form of a file, with absolute paths. `values`
    (n,) are a, and `probes` have their offsets, estimated if they are `free`, and earlier stated
    as `drawn_offsets` (l, d); `probe` is the default one. `covariance` (m, m) of b includes
    `sigma`, and omits the `undetermined` directions (m, k), orthonormal with each parameter scaled
    by its effect: changes along them are unknown. Parameters are in metres, radians and ratios;
    `repeatability` (d,) is the stated one of a reading, in metres. `coverage_factor` is that of
    expanded uncertainties. `frame` describes the rigid motion that the model holds, `temperatures`
    are in degrees Celsius, and `left_out` are estimates of the fit that the map does not apply.
    `date` is that of the campaign, as 2026-11-22, if known. `sum_of_squares` is S^2 at the stated
    uncertainties and `lack_of_fit` that of the fit.
    """

    title: str
    model: ErrorModel
    settings: Mapping[str, Any]
    volume: Volume
    values: Array
    probes: Probes
    drawn_offsets: Array
    probe: str
    covariance: Array
    undetermined: Array
    sigma: float
    sigma_is_estimated: bool
    degrees_of_freedom: int
    sum_of_squares: float
    lack_of_fit: LackOfFit
    repeatability: Array
    coverage_factor: float = 2.0
    frame: str = ""
    temperatures: Mapping[str, float] | None = None
    left_out: tuple[LeftOut, ...] = ()
    data: MapData | None = None
    experiment: str = ""
    program: str = ""
    date: str | None = None

    def __repr__(self) -> str:
        open_ = self.undetermined.shape[1]
        suffix = f", {open_} undetermined directions" if open_ else ""
        return f"<FittedMap {self.title}: {len(self.parameters)} parameters{suffix}>"

    @property
    def dimension(self) -> int:
        """2 or 3, the number of machine axes."""
        return self.model.dimension

    @property
    def without_scatter(self) -> bool:
        """True if sigma, and with it the covariance, is zero except rounding."""
        return self.sigma_is_estimated and self.sigma < LEAST_SIGMA

    @cached_property
    def offset_columns(self) -> Integers:
        """Indices (l, d) of estimated offsets in b, -1 for stated ones."""
        free = self.probes.free
        columns = np.full(free.shape, -1, np.int64)
        columns[free] = len(self.values) + np.arange(int(free.sum()))
        return columns

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters b (m,): the model's, then estimated offsets."""
        offsets = (
            f"probe {self.probes.names[probe]}: offset {AXIS_NAMES[axis]}"
            for probe, axis in np.argwhere(self.probes.free).tolist()
        )
        return (
            *self.model.parameters,
            *(Parameter(name, "m", "offset", name) for name in offsets),
        )

    @property
    def estimates(self) -> Array:
        """All of b (m,), in the order of `parameters`."""
        return np.concatenate([self.values, self.probes.offsets[self.probes.free]])

    @cached_property
    def scale(self) -> Array:
        """Change of each parameter (m,) that moves some point by a metre."""
        return np.array([1.0 / parameter.effect for parameter in self.parameters])

    @cached_property
    def root(self) -> Array:
        """A square root (m, r) of the covariance."""
        spread = np.sqrt(np.diagonal(self.covariance))
        size = np.where(spread > 0.0, spread, 1.0)
        values, vectors = eigh(self.covariance / np.outer(size, size))
        is_positive = (
            values > ROUNDING * max(float(values[-1]), 0.0) if len(values) else values > 0.0
        )
        return size[:, None] * vectors[:, is_positive] * np.sqrt(values[is_positive])

    def standard_uncertainties(
        self, rows: Array | None = None, drawn: Array | None = None
    ) -> Array:
        """Return those of linear functions of b with derivatives `rows` (..., m), by default of b
        itself; NaN if undetermined, judged by the derivatives `drawn` (..., m) on a machine
        without errors if these differ.
        """
        rows = np.eye(len(self.scale)) if rows is None else rows
        return self._blanked(
            rows if drawn is None else drawn, np.linalg.norm(rows @ self.root, axis=-1)
        )

    def function_root(self, rows: Array, drawn: Array | None = None) -> Array:
        """Return a square root (..., r) of the joint covariance of linear functions of b with
        derivatives `rows` (..., m); NaN if undetermined by `drawn` (..., m).
        """
        points = rows if drawn is None else drawn
        return self._blanked(points[..., None, :], rows @ self.root)

    def _blanked(self, rows: Array, values: Array) -> Array:
        return blank(values, rows @ self.undetermined, np.linalg.norm(rows * self.scale, axis=-1))


def readings_in_common(first: MapData | None, second: MapData | None) -> InCommon:
    """True if two maps rest on the same readings: what either knows from others counts as well, so
    that an update of a map has only some in common with it.
    """
    if first is None or second is None:
        return "none"
    is_equal = first.sha256 == second.sha256
    if not first.positions or not second.positions:
        return "same" if is_equal else "none"
    if set(first.positions) == set(second.positions):
        return "same"
    return "some" if is_equal or first.common(second) else "none"


def determined_only(null: Array, scale: Array) -> Array:
    """Directions (m, k) that span how undetermined ones of all parameters change those of a map.

    `null` (m, j) are the latter's rows, `scale` (m,) as that of the map; directions are orthonormal
    in its units.

    >>> determined_only(np.array([[2.0, 0.0], [0.0, 0.0]]), np.array([2.0, 1.0])).tolist()
    [[2.0], [0.0]]
    """
    left_vectors, sizes, _ = svd(null / scale[:, None], full_matrices=False)
    directions = scale[:, None] * left_vectors[:, sizes > TOUCHED]
    signs = np.sign(
        directions[
            np.abs(directions / scale[:, None]).argmax(axis=0), np.arange(directions.shape[1])
        ]
    )
    return directions * signs
