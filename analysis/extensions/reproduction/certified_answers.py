"""Answers of ballplate to certified problems, in the form of the certified ones."""

from __future__ import annotations

from typing import Any

import numpy as np
from ballplate.presentation import as_data, picked
from ballplate.results import fit, predict
from ballplate.simulator.design import Design, State
from ballplate.simulator.experiment import lay_out, load
from ballplate.simulator.readings import read_readings
from ballplate.uncertainty import Quantity

from .certified_problems import CertifiedProblem

SYMBOLS = ("U1", "U2", "U3", "U4", "U5", "U6")


def answers(problem: CertifiedProblem) -> dict[str, Any]:
    """Return the design's rank and uncertainties and, of a problem with readings, the estimate, in
    SI units.

    :raises ExperimentError: the experiment file or the readings are missing or have errors.
    """
    experiment = load(problem.experiment_file)[0]
    drawn = predict(experiment)
    parts = {
        "as_drawn": {
            "rank_deficiency": drawn.verdict.deficiency,
            "uncertainties": _uncertainties(drawn.quantities),
        }
    }
    if problem.readings_file is None:
        return parts
    observed = read_readings(problem.readings_file, lay_out(experiment))
    fitted = fit(experiment, observed, monomials=True)
    if not fitted.converged:
        return parts
    reported = observed.design.model.reported()
    values = (reported.matrix @ fitted.solution.state.a).tolist()
    # Some coefficients are zero in any machine of the model.
    quoted = np.flatnonzero(reported.matrix.any(axis=1)).tolist()
    parts["estimate"] = {
        "sum_of_squares": fitted.solution.factor.sum_of_squares,
        "machine": {reported.names[k]: values[k] for k in quoted},
        **_geometry(observed.design, fitted.solution.state),
        "uncertainties": _uncertainties(fitted.quantities),
    }
    return parts


def _geometry(design: Design, state: State) -> dict[str, Any]:
    """Return balls by plate, origins of the estimated positions, and estimated probe offsets."""
    plates = [design.balls.of(k) for k in design.artefacts.plates]
    free = design.probes.free.any(axis=1)
    estimated = [k for k in design.posed_positions if not design.positions.held[k].all()]
    return {
        "balls": [state.balls[balls].tolist() for balls in plates],
        "origins": state.origins[estimated].tolist(),
        "offsets": state.probes[free].tolist(),
    }


def _uncertainties(quantities: dict[str, Quantity]) -> dict[str, Any]:
    """Return U1 to U6 in the form of certified problems."""
    return {
        symbol: as_data(picked(quantity, "maximum", "average", "count", "undetermined"))
        for symbol, quantity in quantities.items()
        if symbol in SYMBOLS
    }
