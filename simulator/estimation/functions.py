"""Functions of a design's parameters whose uncertainties are evaluated: parameters, points,
distances, and combinations of points.

They are described without numbers of a particular state, so that a plan, a fit, replicates and a
search for gross errors can each derive theirs from the same description.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from ballplate.simulator.computing.numerics import blank
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.observations.readings import offset_sensitivity
from ballplate.simulator.design.parameters import SharedLayout
from ballplate.simulator.design.state import State
from ballplate.simulator.geometry.motions import AXIS_NAMES
from ballplate.simulator.inputs.number_arrays import Array, Integers
from ballplate.simulator.inputs.quantities import Target
from ballplate.simulator.machines.protocol import Unit

from .covariance import MICROMETRE
from .linearisation import LinearFunctions, Linearisation


def corrected_points(design: Design, state: State, points: Array, probes: Integers) -> Array:
    """Corrected points x + e(x, a, p) (m, d) for scale readings `points` (m, d) with probes of
    indices (m,), metres.
    """
    return points + design.model.error(points, state.a, state.probes[probes])


def correction_rows(
    design: Design, layout: SharedLayout, state: State, points: Array, probes: Integers
) -> Array:
    """Derivative (m, d, s) of the corrected points by the shared parameters, estimated probe
    offsets included.

    `points` (m, d) are scale readings with probes of indices `probes` (m,).
    """
    offsets = state.probes[probes]
    jacobian = design.model.jacobian(points, state.a, offsets)
    rows = np.zeros((*jacobian.shape[:2], len(layout)))
    rows[:, :, layout.model] = jacobian
    if not design.probes.free.any():
        return rows
    by_offset = offset_sensitivity(design.model, points, state.a, offsets)
    for probe in np.unique(probes):
        estimated = layout.offset_columns[probe] >= 0
        members = np.flatnonzero(probes == probe)
        columns = layout.offset_columns[probe][estimated]
        rows[members[:, None, None], np.arange(rows.shape[1])[:, None], columns] = by_offset[
            members
        ][:, :, estimated]
    return rows


if TYPE_CHECKING:
    from scipy.sparse import csr_array

# Places whose derivatives by all shared parameters are formed at once.
PLACES_AT_ONCE = 1000


@dataclass(frozen=True, eq=False)
class Parameters:
    """Linear functions `rows` (m, s) of the shared parameters, each with its name and its unit.

    :raises ValueError: not each has a name and a unit.
    """

    rows: Array
    names: tuple[str, ...]
    units: tuple[Unit, ...]

    def __post_init__(self) -> None:
        counts = len(self.rows), len(self.names), len(self.units)
        if len(set(counts)) > 1:
            raise ValueError(
                "Parameters has {} rows, {} names and {} units; give as many of each".format(
                    *counts
                )
            )


@dataclass(frozen=True, eq=False)
class BallPlaces:
    """Balls of indices `index` (n,), in the frame of their artefact."""

    index: Integers

    @property
    def labels(self) -> Integers:
        """Numbers (n,) that name the balls."""
        return self.index

    def name(self, design: Design, label: int) -> str:
        return f"ball {design.ball_label(label)}"

    def at(self, design: Design, state: State) -> Array:
        """Return the locations (n, d) of the balls."""
        return state.balls[self.index]


@dataclass(frozen=True, eq=False)
class MeasuredPoints:
    """Corrected points for scale readings `points` (n, d) with probes of indices `probes` (n,).

    :raises ValueError: not each has a probe.
    """

    points: Array
    probes: Integers

    def __post_init__(self) -> None:
        if np.shape(self.probes) != (len(self.points),):
            raise ValueError(
                f"MeasuredPoints has {len(self.points)} points and probes of shape"
                f" {np.shape(self.probes)}; give a probe for each point"
            )

    @property
    def labels(self) -> Integers:
        """Numbers (n,) that name the points."""
        return np.arange(len(self.points))

    def name(self, design: Design, label: int) -> str:
        """A point by its number from 1, as in the file."""
        return f"point {label + 1}"

    def at(self, design: Design, state: State) -> Array:
        """Return the corrected locations (n, d) of the points."""
        return corrected_points(design, state, self.points, self.probes)


Places = BallPlaces | MeasuredPoints


@dataclass(frozen=True, eq=False)
class Coordinates:
    """All co-ordinates of points, those of a point together."""

    places: Places

    def along(self, where: Array, rows: Array) -> Array:
        """Derivatives of the co-ordinates, from those of the places (n, d, s)."""
        return rows.reshape(-1, rows.shape[2])


@dataclass(frozen=True, eq=False)
class Distances:
    """Distances between all `places` or, with `pairs` (m, 2) of their indices, between named
    pairs.

    `targets` are target uncertainties of the pairs, if they have any.

    :raises ValueError: a pair without a name, or without a target if others have one; or a pair not
        of two of the points.
    """

    places: Places
    pairs: Integers | None = None
    names: tuple[str, ...] = ()
    targets: tuple[Target | None, ...] = ()

    def __post_init__(self) -> None:
        count = 0 if self.pairs is None else len(self.pairs)
        if len(self.names) != count or len(self.targets) not in (0, count):
            raise ValueError(
                f"Distances has {count} pairs, {len(self.names)} names and {len(self.targets)}"
                " targets; give a name for each pair, and a target for each or none"
            )
        if self.pairs is None:
            return
        most = len(self.places.labels) - 1
        is_right = np.shape(self.pairs) == (count, 2)
        if not is_right or (count and not 0 <= self.pairs.min() <= self.pairs.max() <= most):
            raise ValueError(f"Distances has pairs that are not (m, 2) of places 0 to {most}")

    def along(self, where: Array, rows: Array) -> Array:
        """Derivatives (m, s) of the distances between places `where` (n, d), from those of the
        places (n, d, s).
        """
        first, second = np.triu_indices(len(where), 1) if self.pairs is None else self.pairs.T
        unit = where[first] - where[second]
        unit /= np.sqrt((unit**2).sum(axis=1))[:, None]
        return np.asarray(np.einsum("md,mds->ms", unit, rows[first] - rows[second]))


@dataclass(frozen=True, eq=False)
class Combinations:
    """Named values, each a linear combination of co-ordinates of `places`, or a function of a few.

    `weights` (k, n d) are derivatives of all members by the co-ordinates. Value i has the members
    from `starts[i]` to `starts[i + 1]`; its error is the only one, or `of_members[i]` of several
    (b, m) at once: (b, c), at its nominal size and perhaps at other ones, such as a limit.
    `outside` (k, q) is a root of the members' covariance by what no estimate reduces and its sigma
    does not scale. `sizes` (v,) are in `units`, targets are optional, and `allowed` (k,) are the
    standard uncertainties by the estimate alone at which members keep a limit, NaN without one.
    """

    places: MeasuredPoints
    weights: csr_array
    outside: csr_array
    starts: Integers
    of_members: tuple[Callable[[Array], Array] | None, ...]
    names: tuple[str, ...]
    units: tuple[Unit, ...]
    sizes: Array
    targets: tuple[Target | None, ...]
    allowed: Array

    def members(self, i: int) -> slice:
        """The members of a value among all."""
        return slice(*self.starts[i : i + 2])

    @property
    def outside_variances(self) -> Array:
        """Variances (k,) of the members by what no estimate reduces."""
        return np.asarray(self.outside.power(2).sum(axis=1)).ravel()

    def along(self, where: Array, rows: Array) -> Array:
        """Derivatives (k, s) of the members, from those of the places (n, d, s)."""
        return np.asarray(self.weights @ rows.reshape(-1, rows.shape[2]))


Functions = Parameters | Coordinates | Distances | Combinations


def coordinate_name(design: Design, places: Places, index: int) -> str:
    """Return the name of a co-ordinate of points by its index in all co-ordinates."""
    place, axis = divmod(index, design.dimension)
    return f"{places.name(design, int(places.labels[place]))} {AXIS_NAMES[axis]}"


@dataclass(frozen=True, eq=False)
class Displacements:
    """Displacements of `places` (n, d): `common` (n, d, r) times r standard normal variables
    shared by all, and `own` (n, d, d) times d of their own.

    `null` (n, d, k) moves the points along undetermined directions from their nominal locations
    `drawn` (n, d), by more than the rounding of `size` (n, d).
    """

    places: Array
    common: Array
    own: Array
    null: Array
    drawn: Array
    size: Array

    @property
    def uncertainties(self) -> Array:
        """Standard uncertainties (n, d) of the co-ordinates; NaN where open."""
        values = np.sqrt((self.common**2).sum(axis=2) + (self.own**2).sum(axis=2))
        return blank(values, self.null, self.size)

    def select(self, chosen: Integers | slice) -> Displacements:
        """Return the displacements of some points."""
        arrays = (self.places, self.common, self.own, self.null, self.drawn, self.size)
        return Displacements(*(array[chosen] for array in arrays))


def displacements(
    linearisation: Linearisation, places: Places, narrow: bool = True
) -> Displacements:
    """Return displacements of points, in units of the standard deviation of a unit-weight
    observation.

    With `narrow` those of measured points have their own variables, at most one per parameter that
    moves points; otherwise those of the linearisation, in common with balls and observations.
    """
    design, drawn = linearisation.design, linearisation.as_drawn.state
    if isinstance(places, BallPlaces):
        own_root, index = linearisation.balls.own[places.index], places.index
        size = np.full((len(index), design.dimension), MICROMETRE)
        where = places.at(design, linearisation.state), places.at(design, drawn)
        return Displacements(
            where[0],
            linearisation.balls.common[index],
            own_root,
            linearisation.ball_null[index],
            where[1],
            size,
        )
    n, d = places.points.shape
    columns, nulls = (
        _as_slice(moving_columns(linearisation.layout, places)),
        linearisation.shared_null.shape[1],
    )
    # Only the parameters that move points count, and so few variables suffice for all of them. The
    # covariances of all pairs are products with as many terms as there are variables.
    root = linearisation.shared[columns]
    if narrow:
        # A root of the same covariance: a triangle's has columns of zeros, or another one is found.
        root = root[:, root.any(axis=0)]
        if root.shape[0] < root.shape[1]:
            root = np.asarray(np.linalg.qr(root.T, mode="r")).T
    common = np.zeros((n, d, root.shape[1] if narrow else linearisation.balls.common.shape[2]))
    null, size = np.zeros((n, d, nulls)), np.zeros((n, d))
    for some, rows in point_rows(design, linearisation.layout, linearisation.state, places):
        moving = rows[:, :, columns].reshape(-1, len(root))
        common[some, :, : root.shape[1]] = (moving @ root).reshape(len(rows), d, root.shape[1])
        if not nulls:
            continue
        # Whether a point is determined is judged at the nominal design, where the null directions
        # are.
        if linearisation.drawn is not None:
            rows = correction_rows(
                design, linearisation.layout, drawn, places.points[some], places.probes[some]
            )
        null[some] = rows @ linearisation.shared_null
        size[some] = np.sqrt(((rows * linearisation.spectrum.scale) ** 2).sum(axis=2))
    corrected = places.at(design, linearisation.state)
    as_drawn = corrected if linearisation.drawn is None else places.at(design, drawn)
    return Displacements(corrected, common, np.zeros((n, d, d)), null, as_drawn, size)


def moving_columns(layout: SharedLayout, places: MeasuredPoints) -> Integers:
    """Columns of the shared parameters that move corrected points; poses, for instance, do not."""
    offsets = layout.offset_columns[np.unique(places.probes)].ravel()
    return np.concatenate([np.arange(len(layout))[layout.model], np.sort(offsets[offsets >= 0])])


def _as_slice(columns: Integers) -> Integers | slice:
    """Columns as a slice if they follow one another: a view of an array instead of a copy."""
    if len(columns) and (np.diff(columns) == 1).all():
        return slice(int(columns[0]), int(columns[-1]) + 1)
    return columns


def point_rows(
    design: Design, layout: SharedLayout, state: State, places: MeasuredPoints
) -> Iterator[tuple[slice, Array]]:
    """Derivatives (m, d, s) of corrected points by the shared parameters, some points at a time."""
    for start in range(0, len(places.points), PLACES_AT_ONCE):
        some = slice(start, start + PLACES_AT_ONCE)
        yield some, correction_rows(design, layout, state, places.points[some], places.probes[some])


def linear_functions(linearisation: Linearisation, functions: Functions) -> LinearFunctions:
    """Return derivatives of functions: dense, for a selection rather than for all distances of a
    large plate.

    >>> import ballplate as bp
    >>> at = bp.linearise(bp.lay_out(bp.quickstart()))
    >>> ends = MeasuredPoints(np.array([[0.1, 0.2, 0.3], [0.9, 0.2, 0.3]]), np.array([0, 0]))
    >>> length = Distances(ends, np.array([[0, 1]]), ("along x",))
    >>> linear_functions(at, length).shared.shape == (1, len(at.layout))
    True
    """
    # Distances have other derivatives at the nominal state, at which they are tested for changes
    # along null directions. Parameters are the same functions at both.
    derivatives = _derivatives(linearisation, linearisation.state, functions)
    if linearisation.drawn is None or isinstance(functions, Parameters):
        return derivatives
    return replace(
        derivatives, drawn=_derivatives(linearisation, linearisation.drawn.state, functions)
    )


def _derivatives(
    linearisation: Linearisation, state: State, functions: Functions
) -> LinearFunctions:
    if isinstance(functions, Parameters):
        return LinearFunctions(functions.rows)
    places, design = functions.places, linearisation.design
    where = places.at(design, state)
    n, d = where.shape
    if isinstance(places, MeasuredPoints):
        by_shared = np.concatenate(
            [rows for _, rows in point_rows(design, linearisation.layout, state, places)]
        )
        by_balls = np.zeros((n, d, 0))
    else:
        by_shared = np.zeros((n, d, len(linearisation.layout)))
        by_balls = np.zeros((n, d, len(design.balls.places), d))
        by_balls[np.arange(n)[:, None], np.arange(d), places.index[:, None], np.arange(d)] = 1.0
    by_all = np.concatenate([by_shared, by_balls.reshape(n, d, -1)], axis=2)
    by_parameter = functions.along(where, by_all)
    shared, balls = (
        by_parameter[:, : len(linearisation.layout)],
        by_parameter[:, len(linearisation.layout) :],
    )
    return LinearFunctions(
        shared, balls.reshape(len(by_parameter), -1, d) if balls.shape[1] else None
    )
