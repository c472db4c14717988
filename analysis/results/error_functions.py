"""Error functions of a fit as curves through the volume, with their standard uncertainties."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.presentation.formatting import Data, as_data
from ballplate.simulator.computing.processes import single_threaded
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.machines.error_names import AXIS_ERRORS
from ballplate.simulator.machines.protocol import Array, HasLines, Unit

# Points of a curve.
POINTS = 41
# Lines reported of a function; of more, the last, which are inside the volume.
MOST_LINES = 3


@dataclass(frozen=True, eq=False)
class EstimatedCurve:
    """An error function along a line: `values` (m,) and `standard_uncertainties` (m,) in `unit`,
    NaN if undetermined.

    The value is the correction to be added to a reading: actual less indicated position.
    `positions` (m,) are co-ordinates along `axis` in metres or, if `position_unit` is 1, shares of
    the line that `along` names. A constant has one value.
    """

    name: str
    meaning: str
    along: str
    unit: Unit
    axis: str
    position_unit: Unit
    positions: Array
    values: Array
    standard_uncertainties: Array

    def to_dict(self) -> Data:
        """Return the curve as plain data in metres, radians and ratios; None if undetermined."""
        data: Data = as_data(self)
        return data


@single_threaded
def estimated_curves(at: Linearisation, sigma: float = 1.0) -> tuple[EstimatedCurve, ...]:
    """Return the curves of all error functions, none of a model without lines; `sigma` multiplies
    all stated uncertainties.
    """
    model = at.design.model
    if not isinstance(model, HasLines):
        return ()
    parameters = model.parameters
    t = np.linspace(0.0, 1.0, POINTS)
    curves = []
    for name in dict.fromkeys(parameter.function for parameter in parameters):
        members = [k for k, parameter in enumerate(parameters) if parameter.function == name]
        rows = np.zeros((len(t), len(at.layout)))
        lines = model.lines(name, t)
        # Those along the edges come first.
        for line in lines if len(lines) <= MOST_LINES else lines[-MOST_LINES:]:
            rows[:, at.layout.model.start + np.array(members)] = line.basis
            values, u = line.basis @ at.state.a[members], sigma * at.of_shared(rows)
            chosen = slice(None) if np.ptp(line.basis, axis=0).any() else slice(1)
            axis, unit, positions = _positions(at, name, t)
            first = parameters[members[0]]
            curves.append(
                EstimatedCurve(
                    name,
                    first.meaning,
                    line.words,
                    first.unit,
                    axis,
                    unit,
                    positions[chosen],
                    np.where(np.isnan(u), np.nan, values)[chosen],
                    u[chosen],
                )
            )
    return tuple(curves)


def _positions(at: Linearisation, name: str, t: Array) -> tuple[str, Unit, Array]:
    """Return axis, unit and co-ordinates (m,) of a function's points; shares of the line unless it
    depends on one axis.
    """
    error = AXIS_ERRORS.get(name)
    volume = at.design.machine.volume
    if error is None or error.axis >= len(volume.lower):
        return "", "1", t
    return "xyz"[error.axis], "m", volume.lower[error.axis] + t * volume.size[error.axis]
