"""The answers of this program to certified problems, in the form in which they are certified."""

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
    """The design's rank and uncertainties and, of a problem with readings, the estimate, in SI
    units.

    :raises ExperimentError: the experiment file or the readings beside the problem's file cannot be
        used.
    """
    experiment = load(problem.experiment_file)[0]
    drawn = predict(experiment)
    found: dict[str, Any] = {
        "as_drawn": {
            "rank_deficiency": drawn.verdict.deficiency,
            "uncertainties": _uncertainties(drawn.quantities),
        }
    }
    if problem.readings_file is None:
        return found
    observed = read_readings(problem.readings_file, lay_out(experiment))
    fitted = fit(experiment, observed, monomials=True)
    if not fitted.converged:
        return found
    reported = observed.design.model.reported()
    values = (reported.matrix @ fitted.solution.state.a).tolist()
    # A coefficient that is zero in any machine of the model is none.
    quoted = np.flatnonzero(reported.matrix.any(axis=1)).tolist()
    found["estimate"] = {
        "sum_of_squares": fitted.solution.factor.sum_of_squares,
        "machine": {reported.names[k]: values[k] for k in quoted},
        **_geometry(observed.design, fitted.solution.state),
        "uncertainties": _uncertainties(fitted.quantities),
    }
    return found


def _geometry(design: Design, state: State) -> dict[str, Any]:
    """Balls by plate, origins of the positions that are estimated, and probe offsets that are."""
    plates = [design.balls.of(k) for k in design.artefacts.plates]
    free = design.probes.free.any(axis=1)
    estimated = [k for k in design.posed_positions if not design.positions.held[k].all()]
    return {
        "balls": [state.balls[balls].tolist() for balls in plates],
        "origins": state.origins[estimated].tolist(),
        "offsets": state.probes[free].tolist(),
    }


def _uncertainties(quantities: dict[str, Quantity]) -> dict[str, Any]:
    """U1 to U6 as certified problems have them."""
    return {
        symbol: as_data(picked(quantity, "maximum", "average", "count", "undetermined"))
        for symbol, quantity in quantities.items()
        if symbol in SYMBOLS
    }
