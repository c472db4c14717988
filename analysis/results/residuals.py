"""How well a fit explains its readings: lack of fit, residuals, and the curves of its errors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from ballplate.presentation.formatting import Data, as_data
from ballplate.simulator.computing.numerics import comparable
from ballplate.simulator.computing.processes import single_threaded
from ballplate.simulator.design.arrays import Design, Readings, measured
from ballplate.simulator.design.measurement import reading_noise
from ballplate.simulator.design.observations.lengths import Lengths, length_deviations
from ballplate.simulator.design.observations.readings import reading_blocks
from ballplate.simulator.estimation.gauss_newton import Solution
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.geometry.motions import AXIS_NAMES
from ballplate.simulator.inputs.number_arrays import Array, Integers
from ballplate.simulator.machines.arrangement import AXIS_ERRORS
from ballplate.simulator.machines.protocol import HasLines, Unit

# Residuals that a fit reports.
LARGEST = 10


@dataclass(frozen=True)
class Residual:
    """The difference of a plate's reading from the estimate along one axis, in metres and in its
    uncertainties.

    Of a length standard, the excess of a length, named by `axis`; its uncertainty includes the
    certificate's.
    """

    position: str
    ball: str
    probe: str
    axis: str
    value: float
    standardised: float


def reading_residuals(
    design: Design, solution: Solution, x: Array
) -> tuple[Readings, Array, Array]:
    """Return readings of plates, with residuals (m, d) in metres and in standard uncertainties."""
    chosen = design.plate_readings
    readings = design.readings.select(chosen)
    standardised = reading_blocks(design, solution.state, readings, x[chosen]).residual
    return readings, standardised * reading_noise(design, readings), standardised


def largest_residuals(design: Design, solution: Solution, x: Array) -> tuple[Residual, ...]:
    """Return the largest residuals of readings and of lengths, largest first."""
    chosen = design.plate_readings
    _, apart, residual = reading_residuals(design, solution, x)
    off, uncertainty = length_deviations(design, solution.state, x)
    standardised = np.concatenate([residual.ravel(), off / uncertainty])
    value = np.concatenate([apart.ravel(), off])
    residuals = []
    for index in np.argsort(-comparable(np.abs(standardised)), kind="stable")[:LARGEST].tolist():
        i, axis = divmod(index, design.dimension)
        k = index - residual.size
        reading = int(chosen[i] if k < 0 else design.of(Lengths).first[k])
        ball, words = design.ball_label(design.readings.ball[reading]), "xyz"[axis]
        if k >= 0:
            words, second = "radius", design.of(Lengths).second[k]
            if second >= 0:
                second_ball = design.balls.names[design.readings.ball[second]]
                ball, words = f"{ball}-{second_ball}", "length"
        residuals.append(
            Residual(
                design.positions.names[design.readings.position[reading]],
                ball,
                design.probes.names[design.readings.probe[reading]],
                words,
                float(value[index]),
                float(standardised[index]),
            )
        )
    return tuple(residuals)


def residual_groups(
    design: Design, solution: Solution, x: Array, sigma: float
) -> dict[str, list[dict[str, Any]]]:
    """Return root mean squares of the readings' residuals by position, probe and axis, as plain
    data in metres and in standard uncertainties times `sigma`.
    """
    readings, values, standardised = reading_residuals(design, solution, x)
    is_read = measured(design, readings)
    axis = np.broadcast_to(np.arange(design.dimension), values.shape)
    groups: tuple[tuple[str, Integers, Sequence[str]], ...] = (
        ("position", readings.position[:, None] + 0 * axis, design.positions.names),
        ("probe", readings.probe[:, None] + 0 * axis, design.probes.names),
        ("axis", axis, AXIS_NAMES),
    )
    groups_data = {}
    for word, of_group, names in groups:
        groups_data[f"by_{word}"] = [
            {
                "name": names[k],
                "count": int(members.sum()),
                "root_mean_square": float(np.sqrt((values[members] ** 2).mean())),
                "standardised": float(np.sqrt((standardised[members] ** 2).mean())) / sigma,
            }
            for k in np.unique(of_group).tolist()
            for members in [(of_group == k) & is_read]
            if members.any()
        ]
    return groups_data


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


# Level of the chi-square test above which a fit has a warning.
SIGNIFICANCE = 1e-3

# Root mean squares of weighted residuals above which a fit has failed, far above what is
# significant with any degrees of freedom. Sigma absorbs uncertainties that are stated wrong, by ten
# and more where nobody knew them, as long as residuals look like scatter; with a pattern that
# scatter does not explain, something in the file, the readings or the model is wrong.
LIMIT, LIMIT_OF_SCATTER = 10.0, 100.0


@dataclass(frozen=True)
class LackOfFit:
    """The weighted sum of squares S^2 of a fit's residuals, at the stated uncertainties, with its
    degrees of freedom, the number of flagged readings, and a flag for a significant pattern of the
    residuals, set too if no test was made. `contradicted` are causes that the readings showed
    against assumptions of the experiment.
    """

    sum_of_squares: float
    degrees_of_freedom: int
    suspected: int = 0
    has_pattern: bool = True
    contradicted: tuple[str, ...] = ()

    @property
    def times(self) -> float:
        """S^2 over its degrees of freedom: 1 on average, NaN without any."""
        return self.sum_of_squares / (self.degrees_of_freedom or math.nan)

    @property
    def is_significant(self) -> bool:
        """True if S^2 is larger than the stated uncertainties explain, by a test that errs once in
        a thousand.
        """
        from scipy.special import chdtri

        freedom = self.degrees_of_freedom
        return freedom > 0 and self.sum_of_squares > float(chdtri(freedom, SIGNIFICANCE))

    @property
    def limit(self) -> float:
        """Of the root mean square of weighted residuals."""
        return LIMIT if self.has_pattern else LIMIT_OF_SCATTER

    @property
    def is_beyond_limit(self) -> bool:
        """True if residuals are so large that no result of the fit can be relied on."""
        return self.times > self.limit**2

    @property
    def complaint(self) -> str:
        """Reason for the failure of the fit; possibly empty."""
        if not self.is_beyond_limit:
            return ""
        return (
            f"lack of fit is beyond the limit: residuals are {math.sqrt(self.times):.3g} times as"
            f" large as the stated uncertainties make them (limit {self.limit:g}"
            f" {'with' if self.has_pattern else 'without'} a pattern); find the cause before using"
            " any result"
        )

    @property
    def caveat(self) -> str:
        """Addition to verdicts on results of a failed fit; otherwise empty."""
        if not self.is_beyond_limit:
            return ""
        return ", of which nothing can be relied on: lack of fit is beyond the limit"

    @property
    def caution(self) -> str:
        """The warning that a user of the fit's map needs; empty without one."""
        reasons = []
        if self.is_beyond_limit:
            reasons.append(self.complaint)
        elif self.is_significant:
            reasons.append(f"S^2 is {self.times:.3g} times what the stated uncertainties explain")
        if self.suspected:
            are = "errors are" if self.suspected > 1 else "error is"
            reasons.append(f"{self.suspected} gross {are} suspected among the readings")
        if self.contradicted:
            reasons.append(
                f"the readings contradict the experiment: {'; '.join(self.contradicted)}"
            )
        return f"in the fit of the map, {'; '.join(reasons)}" if reasons else ""


def verdict_of(lack: LackOfFit) -> str:
    """Return the short verdict on a map's fit."""
    if lack.is_beyond_limit:
        return "beyond the limit"
    if lack.is_significant:
        return "significant"
    return "not significant" if lack.degrees_of_freedom > 0 else "not tested"


def verdict_line(lack: LackOfFit, symbol: str = "the map") -> str:
    """The verdict on a map's fit as a line of text."""
    line = f"lack of fit of {symbol}: {verdict_of(lack)}"
    if not lack.degrees_of_freedom:
        return line
    return f"{line} (S^2 is {lack.times:.3g} times what the stated uncertainties explain)"


def verdict_data(lack: LackOfFit) -> dict[str, Any]:
    """The verdict on a map's fit as plain data."""
    return {"verdict": verdict_of(lack), **verdict_content(lack)}


def verdict_content(lack: LackOfFit) -> dict[str, Any]:
    """The entries of a lack of fit, with contradictions if there are any."""
    content = dict(vars(lack))
    causes = content.pop("contradicted")
    return {**content, "contradicted": list(causes)} if causes else content
