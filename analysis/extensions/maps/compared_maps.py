"""Maps that are compared: the errors of a machine with the covariance of its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from ballplate.results import Fit, LackOfFit
from ballplate.simulator.computing import svd
from ballplate.simulator.design import Volume
from ballplate.simulator.experiment import MapData
from ballplate.simulator.geometry import cross_matrices, pose_size
from ballplate.simulator.inputs import LengthFunction, number_of
from ballplate.simulator.machines import Array, ErrorModel, HasLines, PlaneModel
from ballplate.simulator.readings import position_fingerprints

from ..machine_files import MachineDescription, data_of
from .campaign_tests import EstimatedSigma
from .volumetric_errors import Volumetric

MOTIONS = {
    2: ("shift along x", "shift along y", "turn about z"),
    3: (
        *(f"shift along {axis}" for axis in "xyz"),
        *(f"turn about {axis}" for axis in "xyz"),
    ),
}


class NotComparableError(ValueError):
    """Two maps with no common ground for what is asked."""


@dataclass(frozen=True, eq=False)
class MappedValues:
    """Functions (m,) with `values`, a square `root` (m, r) of their covariance, their changes
    `null` (m, k) by undetermined directions, and bounds `size` (m,) of such changes.

    `shared` (m, q) are effects of the standard deviations of values common to both maps, excluded
    from the root.
    """

    values: Array
    root: Array
    null: Array
    size: Array
    shared: Array

    def by(self, matrix: Array) -> MappedValues:
        """Return linear functions by a matrix (k, m)."""
        return MappedValues(
            matrix @ self.values,
            matrix @ self.root,
            matrix @ self.null,
            np.abs(matrix) @ self.size,
            matrix @ self.shared,
        )

    def without(self, basis: Array) -> MappedValues:
        """These less their parts in a space of changes of orthonormal columns (m, k)."""

        def remainder(some: Array) -> Array:
            return some - basis @ (basis.T @ some)

        # Twice, because the second pass takes out what rounding left of a large part in the first.
        values, root, null, shared = (
            remainder(remainder(array))
            for array in (self.values, self.root, self.null, self.shared)
        )
        return MappedValues(values, root, null, self.size, shared)


@dataclass(frozen=True, eq=False)
class ComparedMap:
    """Errors of a machine by a `model` with parameters `values` (n,), a square `root` (n, r) of
    their covariance and `undetermined` directions (n, k).

    `shared` (n, q) is the effect of one standard deviation of each value common to both maps,
    excluded from the root; `absorbed` (q, r) are its rows of the root of the hat matrix. `sigma` is
    a factor of both with `degrees_of_freedom`, infinite if stated. `offsets` are those of probes by
    name, `probe` the default one. Derivatives are taken at `about` (n,), by default the values; two
    maps of one model share it, or their spaces of errors would differ to second order. `fit` has
    the balls of plates, `data` the readings with their `lack_of_fit`, `cautions` those of the fit.
    With `is_expected` the map is unmeasured and exact up to its stated uncertainties, with `stated`
    that of lengths.
    """

    label: str
    title: str
    model: ErrorModel
    values: Array
    root: Array
    undetermined: Array
    shared: Array
    degrees_of_freedom: float
    volume: Volume
    offsets: Mapping[str, Array]
    probe: str = ""
    date: str | None = None
    fit: Fit | None = None
    is_expected: bool = False
    stated: LengthFunction | None = None
    absorbed: Array | None = None
    sigma: float = 1.0
    about: Array | None = None
    data: MapData | None = None
    lack_of_fit: LackOfFit | None = None
    cautions: tuple[str, ...] = ()

    @property
    def dimension(self) -> int:
        """2 or 3, the number of machine axes."""
        return self.model.dimension

    @property
    def scatter(self) -> EstimatedSigma:
        """The campaign's sigma."""
        return EstimatedSigma(self.sigma, self.degrees_of_freedom)

    def displacements(self, points: Array, offset: Array) -> MappedValues:
        """Errors (n d,) at scale readings `points` (n, d) of a tip with an `offset` (d,), in
        metres: where the tip is less where the scales say.
        """
        offsets = np.broadcast_to(offset, points.shape)
        rows = self.rows(points, offset)
        drawn = self.model.jacobian(points, np.zeros(len(self.values)), offsets)
        drawn = drawn.reshape(rows.shape)
        effects = [parameter.effect for parameter in self.model.parameters]
        return MappedValues(
            (self.model.error(points, self.values, offsets) - offsets).ravel(),
            rows @ self.root,
            drawn @ self.undetermined,
            np.linalg.norm(drawn / np.array(effects), axis=1),
            rows @ self.shared,
        )

    def rows(self, points: Array, offset: Array) -> Array:
        """Derivatives (n d, parameters) of the errors at `points` (n, d) by the parameters."""
        offsets = np.broadcast_to(offset, points.shape)
        about = self.values if self.about is None else self.about
        return self.model.jacobian(points, about, offsets).reshape(points.size, -1)

    def line(self, function: str, t: Array) -> MappedValues | None:
        """Return an error function at fractions `t` (m,) of its axis; None for several lines."""
        lines = self.model.lines(function, t) if isinstance(self.model, HasLines) else ()
        if len(lines) != 1:
            return None
        columns_of_function = [
            k for k, parameter in enumerate(self.model.parameters) if parameter.function == function
        ]
        basis = lines[0].basis
        effects = np.array([self.model.parameters[k].effect for k in columns_of_function])
        return MappedValues(
            basis @ self.values[columns_of_function],
            basis @ self.root[columns_of_function],
            basis @ self.undetermined[columns_of_function],
            np.linalg.norm(basis / effects, axis=1),
            basis @ self.shared[columns_of_function],
        )


def without_shared(root: Array, absorbed: Array | None) -> tuple[Array, Array]:
    """A square root (m, k) of a covariance without the part of some errors, and the effects (m, q)
    of one standard deviation of each; `absorbed` (q, k) are their rows of the root of the hat
    matrix.
    """
    if absorbed is None:
        return root, np.zeros((len(root), 0))
    _, sizes, axes = svd(absorbed, full_matrices=False)
    remaining = np.sqrt(np.maximum(1.0 - sizes**2, 0.0))
    return root - (root @ axes.T * (1.0 - remaining)) @ axes, root @ absorbed.T


def positions_in_common(first: ComparedMap, second: ComparedMap) -> tuple[str, ...]:
    """Return names of positions with common readings or, without a fit, their number."""
    if first.data is None or second.data is None:
        return ()
    common = first.data.common(second.data)
    for fit in filter(None, (second.fit, first.fit)):
        prints = position_fingerprints(fit.observed)
        if common <= set(prints.values()):
            return tuple(name for name, fingerprint in prints.items() if fingerprint in common)
    return (number_of(len(common), "position"),) if common else ()


def motions(points: Array) -> Array:
    """Return the effects of small frame motions at `points` (n, d): (n, d, 6), or (n, d, 3) in the
    plane; shifts in metres, turns about the origin in radians.
    """
    n, d = points.shape
    columns = np.zeros((n, d, pose_size(d)))
    columns[:, range(d), range(d)] = 1.0
    if d == 3:
        columns[:, :, d:] = cross_matrices(points)
    else:
        columns[:, 0, d], columns[:, 1, d] = -points[:, 1], points[:, 0]
    return columns


def map_of_fit(fit: Fit, label: str = "", date: str | None = None) -> ComparedMap:
    """The map that a fit has estimated.

    :raises ValueError: the fit has not converged.
    """
    linearisation = fit.functions.at
    design, model_columns = linearisation.design, linearisation.layout.model
    # Such as those of maps that are prior knowledge.
    doubts = () if fit.experiment is None else fit.experiment.doubts
    return ComparedMap(
        label or fit.label,
        fit.title,
        design.model,
        linearisation.state.a,
        fit.sigma * linearisation.shared[model_columns],
        linearisation.shared_null[model_columns],
        np.zeros((len(linearisation.state.a), 0)),
        fit.degrees_of_freedom if fit.sigma_is_estimated else np.inf,
        design.machine.volume,
        dict(zip(design.probes.names, linearisation.state.probes, strict=True)),
        design.probes.names[design.evaluation.probe],
        date,
        fit,
        data=data_of(fit.observed, fit.experiment),
        lack_of_fit=fit.lack_of_fit,
        cautions=(*doubts, *fit.cautions, fit.complaint),
        sigma=fit.sigma,
    )


def expected_map(
    machine: MachineDescription,
    label: str,
    dimension: int,
    stated: LengthFunction | None = None,
    date: str | None = None,
) -> ComparedMap:
    """Return the map of a machine file; in two dimensions that at its reference point.

    It is exact up to the stated uncertainties of squareness errors, temperatures and lengths
    (`stated`). Bandwidths are noise of single approaches, absent from maps.
    """
    described = Volumetric(machine)
    model = described.truth.model
    temperature, deviations = described.random.lasting, described.random.sizes
    names = [parameter.name for parameter in model.parameters]
    root = np.zeros((len(names), len(deviations)))
    for k, (field, deviation) in enumerate(zip(temperature.fields, deviations, strict=True)):
        root[names.index(field.name), k] = deviation
    lower, upper = np.array(machine.lower), np.array(machine.upper)
    if dimension == 2:
        model, lower, upper = PlaneModel(model, machine.reference[2]), lower[:2], upper[:2]
    none = np.zeros((len(names), 0))
    return ComparedMap(
        label,
        machine.title,
        model,
        described.truth.a,
        root,
        none,
        none,
        np.inf,
        Volume(lower, upper),
        {},
        date=date,
        is_expected=True,
        stated=stated,
    )
