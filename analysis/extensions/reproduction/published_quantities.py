"""U2, U3 and U5 in the form in which NPL Report CISE 15/98 tabulates them.

Three of its six quantities depend on choices that it does not state; these give its figures to the
last digits printed.
"""

from __future__ import annotations

import numpy as np
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.design import Design, SharedLayout, rotation_sensitivity
from ballplate.simulator.estimation import BallPlaces, Linearisation, displacements, linearise
from ballplate.simulator.geometry import pose_size
from ballplate.simulator.machines import Array, KinematicModel
from ballplate.uncertainty import Quantity, pairs_of, summarise
from numpy.typing import NDArray


@single_threaded
def tabulated_quantities(design: Design) -> dict[str, Quantity]:
    """U2, U3 and U5 of a design at zero machine error, in the report's form.

    U2 is that of transformations about the machine's origin, U3 that of the coefficients of t, t -
    t^2, t^2 - t^3, ... for positional errors, and U5 that of the distances from an artefact's first
    ball to all others.
    """
    at = linearise(design)
    layout = at.layout
    names = [parameter.name for parameter in layout.parameters[layout.poses]]
    found = {
        "U2": summarise("U2", at.of_shared(pose_rows(design, layout)), "m, rad", names.__getitem__)
    }
    coefficients, rows = coefficient_rows(design, layout)
    found["U3"] = summarise("U3", at.of_shared(rows), "m, rad", coefficients.__getitem__)
    lengths, balls = first_ball_lengths(at)
    if balls:
        found["U5"] = summarise("U5", lengths, "m", balls.__getitem__)
    return found


def pose_rows(design: Design, layout: SharedLayout) -> Array:
    """Derivatives (m, s) of the free pose parameters, with origins taken at the machine's origin.

    A transformation R (y - o) moves the machine's origin by its translation alone; R y + o does so
    to the origin of the artefact, from which the one is obtained by the rotation's effect between
    both places. Held parameters have none.
    """
    d = design.dimension
    rows = np.eye(len(layout))[layout.poses]
    for k in design.posed_positions:
        columns = layout.pose_columns[k]
        by_rotation = rotation_sensitivity(-design.positions.origins[k][None])[0]
        for axis in np.flatnonzero(columns[:d] >= 0):
            for turn in range(pose_size(d) - d):
                if columns[d + turn] >= 0:
                    rows[columns[axis], columns[d + turn]] = by_rotation[axis, turn]
    return rows


def coefficient_rows(design: Design, layout: SharedLayout) -> tuple[list[str], Array]:
    """Names and derivatives (m, s) of the model's coefficients as the report has them.

    A positional function is a multiple of t and of t - t^2, t^2 - t^3, ..., of which those that
    vanish at the far end lack the first; rotational functions, and those of other models, are
    quoted as they are reported.
    """
    reported = design.model.reported()
    names, matrix = list(reported.names), reported.matrix.copy()
    dropped: NDArray[np.bool_] = ~np.asarray(matrix.any(axis=1))
    if isinstance(design.model, KinematicModel):
        functions = [name.partition(" ")[0] for name in names]
        for function in design.model.functions:
            if function.error.unit == "m" and function.basis.size:
                own = np.array([i for i, other in enumerate(functions) if other == function.name])
                # Coefficients of t^k - t^(k + 1) are sums of those of all higher monomials, up to
                # sign.
                matrix[own] = np.cumsum(matrix[own][::-1], axis=0)[::-1]
                dropped[own[0]] |= function.basis.zero_at_one
    kept = np.flatnonzero(~dropped)
    rows = np.zeros((len(kept), len(layout)))
    rows[:, layout.model] = matrix[kept]
    return [names[i] for i in kept], rows


def first_ball_lengths(at: Linearisation) -> tuple[Array, list[str]]:
    """Standard uncertainties (m,) of the distances from the first ball of each artefact to all
    others, and their names.

    They are NaN where they are undetermined.
    """
    design = at.design
    values, names = [], []
    for artefact in design.artefacts.plates:
        own = design.balls.of(artefact)
        pairs = np.stack([np.zeros(len(own) - 1, np.int64), np.arange(1, len(own))], axis=1)
        tile = pairs_of(displacements(at, BallPlaces(own)), pairs)
        values.append(np.where(tile.is_open, np.nan, tile.uncertainties))
        for second in own[1:]:
            names.append(f"ball {design.ball_label(own[0])} to ball {design.ball_label(second)}")
    return np.concatenate(values) if values else np.zeros(0), names
