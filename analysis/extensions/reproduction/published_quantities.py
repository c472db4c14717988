"""U2, U3 and U5 in the form in which NPL Report CISE 15/98 tabulates them.

Three of its six quantities depend on choices that it does not state; these reproduce the last
printed digits.
"""

from __future__ import annotations

import numpy as np
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.design import Design, Flags, SharedLayout, rotation_sensitivity
from ballplate.simulator.estimation import BallPlaces, Linearisation, displacements, linearise
from ballplate.simulator.machines import Array, KinematicModel
from ballplate.uncertainty import Quantity, pairs_of, summarise


@single_threaded
def tabulated_quantities(design: Design) -> dict[str, Quantity]:
    """Return U2, U3 and U5 of a design at zero machine error, in the report's form.

    U2 is that of transformations about the machine's origin, U3 that of the coefficients of t, t -
    t^2, t^2 - t^3, ... for positional errors, and U5 that of the distances from an artefact's first
    ball to all others.
    """
    linearisation = linearise(design)
    layout = linearisation.layout
    names = [parameter.name for parameter in layout.parameters[layout.poses]]
    quantities = {
        "U2": summarise(
            "U2", linearisation.of_shared(pose_rows(design, layout)), "m, rad", names.__getitem__
        )
    }
    coefficients, rows = coefficient_rows(design, layout)
    quantities["U3"] = summarise(
        "U3", linearisation.of_shared(rows), "m, rad", coefficients.__getitem__
    )
    lengths, balls = first_ball_lengths(linearisation)
    if balls:
        quantities["U5"] = summarise("U5", lengths, "m", balls.__getitem__)
    return quantities


def pose_rows(design: Design, layout: SharedLayout) -> Array:
    """Return derivatives (m, s) of the free pose parameters, with origins at the machine's
    origin.
    """
    # R (y - o) moves the machine's origin only by its translation, R y + o the artefact's origin.
    # The rotation's effect between the two points is the difference.
    d = design.dimension
    rows = np.eye(len(layout))[layout.poses]
    for k in design.posed_positions:
        columns = layout.pose_columns[k]
        by_rotation = rotation_sensitivity(-design.positions.origins[k][None])[0]
        axes, turns = np.flatnonzero(columns[:d] >= 0), np.flatnonzero(columns[d:] >= 0)
        rows[np.ix_(columns[axes], columns[d + turns])] = by_rotation[np.ix_(axes, turns)]
    return rows


def coefficient_rows(design: Design, layout: SharedLayout) -> tuple[list[str], Array]:
    """Return names and derivatives (m, s) of the model's coefficients in the report's form.

    A positional function is a multiple of t, t - t^2, t^2 - t^3, ...; functions that vanish at the
    far end lack t. Rotational functions, and those of other models, keep ballplate's form.
    """
    reported = design.model.reported()
    names, matrix = list(reported.names), reported.matrix.copy()
    dropped: Flags = ~np.asarray(matrix.any(axis=1))
    if isinstance(design.model, KinematicModel):
        functions = [name.partition(" ")[0] for name in names]
        for function in design.model.functions:
            if function.error.unit == "m" and function.basis.size:
                indices = np.array([i for i, name in enumerate(functions) if name == function.name])
                # Coefficients of t^k - t^(k + 1) are sums of those of all higher monomials, up to
                # sign.
                matrix[indices] = np.cumsum(matrix[indices][::-1], axis=0)[::-1]
                dropped[indices[0]] |= function.basis.zero_at_one
    chosen = np.flatnonzero(~dropped)
    rows = np.zeros((len(chosen), len(layout)))
    rows[:, layout.model] = matrix[chosen]
    return [names[i] for i in chosen], rows


def first_ball_lengths(linearisation: Linearisation) -> tuple[Array, list[str]]:
    """Return standard uncertainties (m,) of the distances from each artefact's first ball to all
    others, and names.

    They are NaN if undetermined.
    """
    design = linearisation.design
    values, names = [], []
    for artefact in design.artefacts.plates:
        balls = design.balls.of(artefact)
        pairs = np.stack([np.zeros(len(balls) - 1, np.int64), np.arange(1, len(balls))], axis=1)
        tile = pairs_of(displacements(linearisation, BallPlaces(balls)), pairs)
        values.append(np.where(tile.is_open, np.nan, tile.uncertainties))
        for second in balls[1:]:
            names.append(f"ball {design.ball_label(balls[0])} to ball {design.ball_label(second)}")
    return np.concatenate(values) if values else np.zeros(0), names
