"""Length equations of US 4,437,151: a fit of readings of bars and gauges, without weights."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from ballplate.presentation import Data, FitResult, MainTable, picked, table_lines
from ballplate.rank import rank_complaint
from ballplate.results import (
    Adjustment,
    adjusted,
    adjustment_data,
    adjustment_lines,
    few_degrees_of_freedom,
    freedom_words,
)
from ballplate.simulator.computing import svd
from ballplate.simulator.design import Design, Lengths, Priors
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.geometry import FLAT, TwoSpheresSettings, fit_sphere
from ballplate.simulator.inputs import refused
from ballplate.simulator.machines import Array, SpatialMetricModel
from ballplate.simulator.readings import ObservedReadings

from .length_equations import LengthEstimator, LengthSolution, NotAMetricError, length_estimate

FACTORS = ("e1", "e2", "e3", "e4", "e5", "e6")


@dataclass(frozen=True, repr=False)
class LengthFit(FitResult):
    """Length equations solved for an experiment's readings; `pivots` have the names of the gauges'
    positions.

    `factors`, `pivots` and `lengths` are NaN if undetermined. `spheres` are the radii, in scale
    readings, of spheres through each position's readings of a gauge, also without any known length.
    `reservations` are warnings, and `expected` is the file's expected rank deficiency.
    """

    label: str
    title: str
    observed: ObservedReadings
    expected: int | None
    solution: LengthSolution
    adjustments: tuple[Adjustment, ...]
    factors: tuple[float, ...]
    pivots: tuple[tuple[str, tuple[float, float, float]], ...]
    lengths: tuple[tuple[str, float], ...]
    reservations: tuple[str, ...]
    spheres: tuple[tuple[str, float], ...] = ()

    @property
    def converged(self) -> bool:
        return self.solution.converged

    @property
    def cautions(self) -> tuple[str, ...]:
        return self.reservations

    @property
    def complaint(self) -> str:
        deficiency = self.solution.deficiency
        if not self.converged:
            return (
                "the estimate has not converged; check the units, balls and positions of the"
                " readings"
            )
        if has_all_errors(self.observed.design) and deficiency != (self.expected or 0):
            return rank_complaint(deficiency, self.expected)
        return ""

    def headline(self) -> str:
        count = self.solution.deficiency
        rank = f"rank deficiency {count}" if count else "full rank"
        return f"{self.solution.estimator}, {_status(self)}, {rank}"

    def lines(self) -> list[str]:
        """Solved length equations as lines of text."""
        solution = self.solution
        rank = f"rank deficiency {solution.deficiency}" if solution.deficiency else "full rank"
        lines = [
            self.heading,
            (
                f"estimator {solution.estimator}: {solution.equations} equations, all of the same"
                f" weight; {rank}; {freedom_words(solution.degrees_of_freedom)}"
            ),
            f"{_status(self)} after {solution.iterations} iterations",
            "",
        ]
        columns = {
            "factor of the metric": ["1e-6"],
            **{name: [1e6 * value] for name, value in zip(FACTORS, self.factors, strict=True)},
        }
        lines += [*table_lines(columns), "", *adjustment_lines(self.adjustments)]
        centres = [
            f"{name} ({', '.join(_millimetres(c, 4) for c in centre)}) mm"
            for name, centre in self.pivots
        ]
        lines += [f"pivots: {'; '.join(centres)}, in scale readings"] if centres else []
        radii = [f"{name} {_millimetres(radius, 5)} mm" for name, radius in self.spheres]
        lines += (
            [f"radii of the spheres through the readings: {'; '.join(radii)}, in scale readings"]
            if radii
            else []
        )
        return lines + [f"{name}: {_millimetres(value, 5)} mm" for name, value in self.lengths]

    def data(self) -> Data:
        """Solved length equations as plain data in metres and radians; None if undetermined."""
        solution = self.solution
        return {
            **self.named,
            **picked(solution, "estimator", "equations", "degrees_of_freedom"),
            "status": _status(self),
            "rank_deficiency": solution.deficiency,
            "factors": dict(zip(FACTORS, self.factors, strict=True)),
            "adjustments": adjustment_data(self.adjustments),
            "pivots": dict(self.pivots),
            "spheres": dict(self.spheres),
            "lengths": dict(self.lengths),
            **self.notes_data(),
        }

    def columns(self) -> MainTable:
        """One row per adjustment of the machine."""
        columns = {
            "adjustment": "what",
            "value": "value",
            "standard uncertainty": "standard_uncertainty",
            "expanded uncertainty": "expanded_uncertainty",
            "unit": "unit",
            "to do": "words",
        }
        return columns, self.adjustments


def has_all_errors(design: Design) -> bool:
    """Return whether the error model is that of length equations."""
    return isinstance(design.model, SpatialMetricModel) and design.model.with_scales


def fit_lengths(
    experiment: Experiment,
    observed: ObservedReadings,
    estimator: LengthEstimator,
    sigma: Literal["estimated", "given"] | None = None,
) -> LengthFit:
    """Solve the length equations of an experiment's readings; a warning states that `sigma` has no
    effect.

    :raises ExperimentError: no bars and gauges, two dimensions, or readings that give no metric.
    """
    design = observed.design
    _refuse_other_artefacts(experiment, design, estimator)
    try:
        solution = length_estimate(design, observed.x, estimator)
    except NotAMetricError as error:
        text = (
            f"{error}; check the units, balls and positions of the readings, or read more"
            " directions"
        )
        raise refused(experiment.source, text) from None
    remarks = _remarks(design, estimator, solution)
    if sigma is not None:
        remarks.append(
            "--sigma has no effect: uncertainties come from the residuals of the equations"
        )
    factors = np.where(solution.open_factors, np.nan, solution.factors)
    centres = np.where(solution.open_centres, np.nan, solution.centres)
    lengths = np.where(solution.open_lengths, np.nan, solution.lengths)
    return LengthFit(
        experiment.label,
        experiment.title,
        observed,
        experiment.expected_rank_deficiency,
        solution,
        adjusted(solution.parameters, solution.spread, solution.null, solution.degrees_of_freedom),
        tuple(factors.tolist()),
        tuple(
            (design.positions.names[k], tuple(centres[k].tolist())) for k in design.gauge_positions
        ),
        tuple(zip(design.unknown_lengths.names, lengths.tolist(), strict=True)),
        tuple(remarks),
        tuple(_spheres(design, observed.x)),
    )


def _refuse_other_artefacts(
    experiment: Experiment, design: Design, estimator: LengthEstimator
) -> None:
    """Refuse an experiment without lengths in three dimensions."""
    if design.dimension == 3 and len(design.of(Lengths)):
        return
    bars = [
        name
        for name, settings in experiment.artefacts.items()
        if isinstance(settings, TwoSpheresSettings)
    ]
    if bars and design.dimension == 3:
        text = f"is a plate, but {estimator} needs length standards; state role: length_standard"
        mark = experiment.place(("artefacts", bars[0]))
        raise mark.refused(text, f"artefacts.{bars[0]}")
    key, fact = "artefacts", "has no ball bar or Bryan gauge whose lengths are read"
    if design.dimension != 3:
        key, fact = "machine.volume", "has two dimensions"
    text = f"{fact}, but {estimator} needs lengths read in three dimensions; use another estimator"
    raise refused(experiment.source, text, key)


def _remarks(design: Design, estimator: LengthEstimator, solution: LengthSolution) -> list[str]:
    """Return warnings about the solution."""
    remarks = []
    if len(design.plate_readings):
        remarks.append(f"{estimator} ignores plates and calibrated co-ordinates")
    if len(design.of(Priors)):
        remarks.append(f"{estimator} ignores priors")
    if design.probes.free.any():
        remarks.append(
            f"{estimator} takes the probes' offsets as the file states them, though they are"
            " unknown"
        )
    if not has_all_errors(design):
        remarks.append(
            f"{estimator} has three scale errors and three squareness errors, regardless of the"
            " file's error model"
        )
    if not design.of(Lengths).is_known.any():
        remarks.append(
            "no length is known: ratios of scales are determined, but the overall scale is not"
        )
    if estimator == "sphere-then-metric" and len(design.gauge_positions):
        remarks.append(
            "the pivot is the centre of a sphere, as if the machine had no errors: those that"
            " it absorbs are missing; see length-equations, or the full estimator"
        )
    if not np.isfinite(solution.scatter):
        remarks.append(
            "there are no more equations than unknowns, so that no uncertainties can be estimated"
        )
    remedy = "the full estimator with --sigma given takes the uncertainties as stated"
    doubt = few_degrees_of_freedom(solution.degrees_of_freedom, "the scatter", remedy)
    remarks += [doubt] if doubt else []
    return remarks


def _spheres(design: Design, x: Array) -> Iterator[tuple[str, float]]:
    """Yield positions of gauges with the radius (m) of the sphere that their readings x (m, d)
    determine.
    """
    for k in design.gauge_positions:
        rows = design.readings.position == k
        points = x[rows] + design.probes.offsets[design.readings.probe[rows]]
        extent = svd(points - points.mean(axis=0), compute_uv=False)
        if len(points) > design.dimension and extent[-1] > FLAT * extent[0]:
            yield design.positions.names[k], fit_sphere(points, design.positions.origins[k])[1]


def _status(fit: LengthFit) -> str:
    return "converged" if fit.solution.converged else "not converged"


def _millimetres(value: float, decimals: int) -> str:
    return "-" if np.isnan(value) else f"{1e3 * value:.{decimals}f}"
