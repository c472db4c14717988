"""Reasons why bars and gauges leave scales or squareness undetermined: missing directions, unknown
lengths.

A bar in direction u observes u' S u of the small strains of the machine's axes, a symmetric matrix
S: a sum of the six products of its direction cosines. A Bryan gauge observes the same less the
effect of a shift of its pivot. A common property of all bars describes the undetermined part of
the six.
"""

from __future__ import annotations

from itertools import combinations_with_replacement

import numpy as np
from ballplate.rank import relative_changes
from ballplate.simulator.computing import comparable, svd
from ballplate.simulator.design import Design, Lengths, SharedLayout
from ballplate.simulator.geometry import without_rigid_motion
from ballplate.simulator.machines import Array

AXES = "xyz"

# Singular values below this fraction of the largest: what readings tell of a direction through
# their own scatter only.
MISSING = 1e-3


def bar_reasons(design: Design, layout: SharedLayout, open_: Array) -> tuple[str, ...]:
    """Return the shortcomings of bars and gauges, given undetermined changes of the shared
    parameters (s, k).
    """
    if not len(design.of(Lengths)) or not open_.shape[1] or not len(design.evaluation.points):
        return ()
    strains = _open_strains(design, layout, open_)
    if not strains.shape[1]:
        return ()
    reasons = []
    unknown = not design.of(Lengths).is_known.any()
    overall = _unit_strain(np.eye(design.dimension))
    is_free = unknown and _is_among(overall, strains)
    if is_free:
        names = " and ".join(design.unknown_lengths.names)
        reasons.append(
            f"no length is known ({names}): the overall scale of the machine is undetermined"
            " until one is calibrated"
        )
    if strains.shape[1] > is_free:
        reasons += filter(None, [_what_is_missing(design, strains)])
    return tuple(reasons)


def _open_strains(design: Design, layout: SharedLayout, open_: Array) -> Array:
    """Strains (products, k), orthonormal columns, that some open change of the machine's errors
    amounts to.
    """
    points = design.evaluation.points
    fields = relative_changes(design, layout, open_)
    basis = np.stack(
        [
            points @ _matrix(unit_strain, design.dimension)
            for unit_strain in np.eye(_size(design.dimension))
        ],
        2,
    )
    wanted = without_rigid_motion(points, basis)
    flat = fields.reshape(-1, fields.shape[2])
    flat = flat[:, (flat**2).sum(axis=0) > 0.0]
    if not flat.shape[1]:
        return np.zeros((_size(design.dimension), 0))
    u, values, _ = svd(flat / np.linalg.norm(flat, axis=0), full_matrices=False)
    spanned = u[:, values > MISSING * values[0]]
    strain = wanted.reshape(len(flat), -1)
    unspanned = strain - spanned @ (spanned.T @ strain)
    return _null_space(unspanned, float(svd(strain, compute_uv=False).max(initial=0.0)))


def _what_is_missing(design: Design, strains: Array) -> str:
    """Return the common property of all directions that leaves strains undetermined, or an empty
    text if there is another reason.
    """
    lengths, d = design.of(Lengths), design.dimension
    position = design.readings.position[lengths.first]
    directions = lengths.direction.copy()
    for k in np.unique(position[lengths.to_pivot]):
        mine = lengths.to_pivot & (position == k)
        directions[mine] -= directions[mine].mean(axis=0)
    normals = _null_space(directions)
    only_gauges = bool(lengths.to_pivot.all())
    # Any three places lie in a plane.
    few = only_gauges and np.bincount(position).max() <= d
    with_plates = bool(design.artefacts.is_plate.any())
    if with_plates:
        # What else bars would have to do, plates may do.
        normals = normals[:, [_is_among(_unit_strain(np.outer(n, n)), strains) for n in normals.T]]
    subject = "every location of the ball" if only_gauges else "every bar"
    if lengths.to_pivot.any() and not only_gauges:
        subject = "every bar, and every location of a gauge's ball,"
    if d == 3 and normals.shape[1] == 1 and not few:
        lies = "lies in a plane parallel to" if only_gauges else "lies parallel to"
        return f"{subject} {lies} {_plane(normals[:, 0])}"
    if d - normals.shape[1] == 1 and not few:
        return f"{subject} lies along {_axis(svd(directions)[2][0])}"
    if with_plates:
        return ""
    who = "locations of the ball" if only_gauges else "bars' directions"
    return f"the {who} are too few or too similar"


def _axis(vector: Array) -> str:
    k = int(comparable(np.abs(vector)).argmax())
    if abs(vector[k]) > 1.0 - MISSING**2:
        return AXES[k]
    vector_shown = np.where(np.abs(vector) > MISSING, vector, 0.0)
    vector_shown *= np.sign(vector_shown[np.flatnonzero(vector_shown)[0]])
    return f"({', '.join(f'{v + 0.0:.3g}' for v in vector_shown)})"


def _plane(normal: Array) -> str:
    axis = _axis(normal)
    return (
        f"the {AXES.replace(axis, '')} plane"
        if len(axis) == 1
        else f"the plane perpendicular to {axis}"
    )


def _size(d: int) -> int:
    return d * (d + 1) // 2


def _matrix(strain: Array, d: int) -> Array:
    """Symmetric matrix (d, d) of a strain: the coefficients of u_i u_j, i <= j, in u' S u."""
    matrix = np.zeros((d, d))
    for value, (i, j) in zip(strain, combinations_with_replacement(range(d), 2), strict=True):
        matrix[i, j] += 0.5 * value
        matrix[j, i] += 0.5 * value
    return matrix


def _unit_strain(form: Array) -> Array:
    """The strain of a symmetric matrix, of length one."""
    pairs = combinations_with_replacement(range(len(form)), 2)
    strain = np.array([form[i, j] if i == j else 2.0 * form[i, j] for i, j in pairs])
    return strain / np.linalg.norm(strain)


def _is_among(strain: Array, span: Array) -> bool:
    """True if a strain of length one is a mixture of orthonormal ones."""
    return bool(np.linalg.norm(strain - span @ (span.T @ strain)) < 10 * MISSING)


def _null_space(rows: Array, size: float | None = None) -> Array:
    """Return orthonormal columns that the rows map almost to zero."""
    triangle = np.linalg.qr(rows, mode="r") if len(rows) > rows.shape[1] else rows
    _, values, directions = svd(triangle)
    largest = values.max(initial=0.0) if size is None else size
    return directions[int((values > MISSING * largest).sum()) :].T
