"""Result of a fit to readings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from ballplate.presentation.files import write_file
from ballplate.presentation.formatting import Data, given, picked
from ballplate.presentation.result import FitResult
from ballplate.presentation.scenes import Vectors, box_edges, draw_vectors, projection
from ballplate.presentation.table_columns import MainTable, table_lines
from ballplate.rank.verdicts import Verdict
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.estimation.gauss_newton import Solution
from ballplate.simulator.experiment.earlier_campaigns import LEAST_SIGMA
from ballplate.simulator.inputs.arguments import ensure_positive, ensure_type
from ballplate.simulator.inputs.extensions import function, service
from ballplate.simulator.inputs.settings import listing
from ballplate.simulator.machines.protocol import Array
from ballplate.simulator.readings.given_points import ensure_points, probe_places
from ballplate.simulator.readings.observed_readings import ObservedReadings
from ballplate.uncertainty.pairs import TaskUncertainty
from ballplate.uncertainty.summaries import Quantity, tasks_of

from .adjustments import (
    Adjustment,
    adjustment_data,
    adjustment_lines,
    few_degrees_of_freedom,
    freedom_words,
)
from .estimates import (
    ESTIMATE_COLUMNS,
    CorrectedPoints,
    EstimatedFunctions,
    ParameterEstimate,
    correct,
    labels,
)
from .extension_results import (
    IssuedCertificate,
    SeparateSigmas,
    Suspicion,
    has_exact_values,
    lack_of_fit,
)
from .plates import PlateCoordinates, plate_data, plate_table
from .prediction import by_label, length_headline, rank_words
from .residuals import (
    EstimatedCurve,
    LackOfFit,
    Residual,
    estimated_curves,
    reading_residuals,
    residual_groups,
)
from .text_blocks import (
    iteration_lines,
    map_lines,
    not_read,
    quantities_data,
    task_data,
    task_table,
    uncertainty_table,
    verdict_data,
    verdict_lines,
)

if TYPE_CHECKING:
    import pandas
    from ballplate.simulator.experiment.model import Experiment
    from matplotlib.figure import Figure


# Steps of an iteration below this, in metres and radians, are reported as rounding.
LEAST_STEP = 1e-10

# Largest residuals in the text.
SHOWN_RESIDUALS = 3


@dataclass(frozen=True, repr=False)
class Fit(FitResult):
    """An estimate from readings; a failed one has no quantities and estimates, and the verdict of
    the nominal design.

    `observed` has the design and its readings. `sigma` multiplies all stated uncertainties: the
    root of S^2 over the degrees of freedom, or 1 if the file takes uncertainties as given.
    `adjustments` are those of a three-dimensional metric. `diagnosis` has the causes that
    the readings show, which stay in the fit, or `untested` states why there is none. `estimated`
    has all estimates as functions of the parameters, without `sigma`. `experiment` was fitted.
    `campaigns` are the sigmas of prior maps; if these are separate, `degrees_of_freedom` are the
    fewest of them.
    """

    label: str
    title: str
    observed: ObservedReadings
    solution: Solution
    verdict: Verdict
    sigma: float
    sigma_is_estimated: bool
    degrees_of_freedom: int
    quantities: dict[str, Quantity]
    estimates: tuple[ParameterEstimate, ...]
    largest: tuple[Residual, ...]
    plates: tuple[PlateCoordinates, ...] = ()
    adjustments: tuple[Adjustment, ...] = ()
    diagnosis: Suspicion | None = None
    untested: str = ""
    estimated: EstimatedFunctions | None = None
    experiment: Experiment | None = None
    campaigns: SeparateSigmas | None = None

    @property
    def design(self) -> Design:
        """The design of the readings."""
        return self.observed.design

    @property
    def tasks(self) -> tuple[TaskUncertainty, ...]:
        """The measuring tasks."""
        return tasks_of(self.quantities)

    def headline(self) -> str:
        if not self.converged:
            return f"the estimate has {self.solution.status}"
        return ", ".join(
            [
                rank_words(self.verdict),
                f"sigma {self.sigma:.3g}",
                *length_headline(self.quantities.get("U6")),
            ]
        )

    def lines(self) -> list[str]:
        record = self.solution.iterations
        lengths = self.quantities.get("U6")
        verdict = verdict_lines(self.verdict, lengths, self.unread)
        lines = [self.heading, *verdict]
        origin = "estimated from the residuals" if self.sigma_is_estimated else "as given"
        summary = (
            f"{self.solution.status} after {len(record) - 1} iterations; S^2 ="
            f" {self.sum_of_squares:.6g}"
        )
        if self.converged:
            summary += (
                f" with {freedom_words(self.sum_freedom)}; sigma = {self.sigma:.4g} times"
                " the stated "
            )
            summary += f"uncertainties ({origin})"
        maps = map_lines(self.experiment)
        lines += [summary, *(maps if self.campaigns is None else self.campaigns.lines())]
        lines += ["", *iteration_lines(record, _step)]
        if not self.converged:
            return lines
        lines += ["", *self._residual_table()]
        if self.diagnosis is not None:
            lines += ["", *self.diagnosis.lines()]
        lines += ["", *uncertainty_table(self.quantities, self.lack_of_fit.caveat), ""]
        lines += [*task_table(self.tasks, self.lack_of_fit.caveat), ""] if self.tasks else []
        printed = [
            estimate for estimate in self.estimates if estimate.kind not in ("origin", "ball")
        ]
        lines += table_lines(ESTIMATE_COLUMNS, printed, "kind")
        quoted = self.design.model.reported().names
        if any(e.kind == "machine" and e.name not in quoted for e in printed):
            lines.append(
                "([1], [2], … are coefficients of the basis in which errors are estimated;"
                f" U3 is of others, such as {quoted[-1]}, which --monomials lists)"
            )
        lines.append(
            "(origins of positions and co-ordinates of balls are among the estimates of --json)"
        )
        if self.adjustments:
            lines += ["", *adjustment_lines(self.adjustments)]
        for plate in self.plates:
            lines += ["", *plate_table(plate, named=len(self.plates) > 1)]
        return lines

    def data(self) -> Data:
        estimates = zip(labels(self.estimates), self.estimates, strict=True)
        curves = self.error_functions if self.converged else ()
        return {
            **self.named,
            **verdict_data(self.verdict),
            "status": self.solution.status,
            **picked(self, "sigma", "sigma_is_estimated", "degrees_of_freedom", "too_large"),
            "sum_of_squares": self.sum_of_squares,
            **given(campaigns=self.campaigns and self.campaigns.to_dict()),
            "iterations": [
                picked(iteration, "step", "sum_of_squares")
                for iteration in self.solution.iterations
            ],
            "quantities": quantities_data(self.quantities),
            **given(tasks=task_data(self.tasks)),
            "largest_residuals": [
                {
                    **picked(item, "position", "ball", "probe", "axis", "value"),
                    "unit": "m",
                    "standard_uncertainties": self._standardised(item),
                }
                for item in self.largest
            ],
            **given(
                error_functions=[curve.to_dict() for curve in curves],
                residuals=self._residual_groups(),
                diagnosis=None if self.diagnosis is None else self.diagnosis.to_dict(),
            ),
            "estimates": {
                name: picked(item, "value", "standard_uncertainty", "unit")
                for name, item in estimates
            },
            **given(
                plates={plate.artefact: plate_data(plate) for plate in self.plates},
                adjustments=adjustment_data(self.adjustments),
            ),
            **self.notes_data(),
        }

    def columns(self) -> MainTable:
        """One row per parameter."""
        return ESTIMATE_COLUMNS, self.estimates

    def __getitem__(self, name: str) -> ParameterEstimate:
        """The estimate of a parameter: value, standard uncertainty and unit.

        :raises KeyError: the fit has no parameter of that name.

        >>> import ballplate as bp
        >>> fit = bp.fit(bp.quickstart(), bp.simulate(bp.quickstart()))
        >>> fit["EXX[1]"].unit
        'm'
        """
        return by_label(dict(zip(labels(self.estimates), self.estimates, strict=True)), name)

    @property
    def sum_of_squares(self) -> float:
        """S^2 that sigma is computed from, with those of maps of the same sigma."""
        if self.campaigns is None or not self.converged:
            return self.solution.factor.sum_of_squares
        return self.campaigns.sum_of_squares

    @property
    def sum_freedom(self) -> int:
        """Degrees of freedom of `sum_of_squares`."""
        return self.degrees_of_freedom if self.campaigns is None else self.campaigns.freedom

    @property
    def converged(self) -> bool:
        return self.solution.status == "converged"

    @property
    def functions(self) -> EstimatedFunctions:
        """All estimates and the measuring tasks, as functions of the parameters; without sigma.

        :raises ValueError: the estimate has not converged.
        """
        if self.estimated is None or not self.converged:
            raise ValueError(f"the estimate has {self.solution.status}; its uncertainty is unknown")
        return self.estimated

    @property
    def error_functions(self) -> tuple[EstimatedCurve, ...]:
        """Curves of the error functions with their standard uncertainties; none of a model without
        lines.

        :raises ValueError: the estimate has not converged.

        >>> import ballplate as bp
        >>> fit = bp.fit(bp.quickstart(), bp.simulate(bp.quickstart()))
        >>> fit.error_functions[0].name, fit.error_functions[0].values.shape
        ('EXX', (41,))
        """
        return estimated_curves(self.functions.at, self.sigma)

    def report(self, path: str | Path) -> None:
        """Write the page of the fit, a self-contained file of HTML.

        :raises OSError: the file cannot be written.
        """
        write_file(path, self.page().encode("utf-8", "replace"))

    def page(self) -> str:
        """The page of the fit as text: verdict, curves, residuals, diagnosis, reliability,
        plate.

        :raises ValueError: the fit has no experiment.
        """
        return str(function("page")(self))

    def covariance(self, *chosen: str) -> pandas.DataFrame:
        """Covariance of estimates and measuring tasks, in products of their units; NaN if
        undetermined.

        Each of `chosen` is a name or a kind: machine, pose (or origin, rotation), offset, length,
        ball, task; without any, all are chosen. `sigma` multiplies the uncertainties.

        :raises ValueError: an unknown name, or the estimate has not converged.

        >>> import ballplate as bp
        >>> fit = bp.fit(bp.quickstart(), bp.simulate(bp.quickstart()))
        >>> fit.covariance("machine", "r1c2: x").shape
        (70, 70)
        """
        import pandas

        functions = self.functions.choose(chosen)
        return pandas.DataFrame(
            self.sigma**2 * functions.covariance(), functions.labels, functions.labels
        )

    def correlation(self, *chosen: str) -> pandas.DataFrame:
        """Correlation coefficients of the functions of `covariance`; NaN without uncertainty.

        :raises ValueError: an unknown name, or the estimate has not converged.
        """
        covariance = self.covariance(*chosen)
        spread = np.sqrt(np.diagonal(covariance))
        with np.errstate(invalid="ignore", divide="ignore"):
            return covariance / np.outer(spread, spread)

    def correct(self, points: Array, probe: str | Sequence[str] | None = None) -> CorrectedPoints:
        """Scale readings (n, d) in metres, corrected for the estimated errors, with their joint
        covariance.

        `probe` is one name, or one for each point; by default the probe of the evaluation points.
        Corrections outside the volume are extrapolated; points farther outside than the volume's
        size are refused, since their unit is wrong.

        :raises ValueError: points of another shape or far outside the volume, an unknown probe, or
            an estimate that has not converged.

        >>> import ballplate as bp
        >>> fit = bp.fit(bp.quickstart(), bp.simulate(bp.quickstart()))
        >>> fit.correct([[0.1, 0.2, 0.3], [0.4, 0.2, 0.3]], "down").covariance.shape
        (6, 6)
        """
        design, names = self.design, self.design.probes.names
        checked = ensure_points(points, design.machine.volume)
        probe = names[design.evaluation.probe] if probe is None else probe
        probes = probe_places(probe, names, len(checked))
        return correct(self.functions.at, checked, probes, self.sigma)

    def to_map(self, date: str | None = None) -> Any:
        """The error map of the fit with its covariance, to be saved and applied; `date` is the day
        of the campaign, such as "2026-11-22".

        :raises ValueError: the estimate has not converged, or the date is no day.

        >>> import ballplate as bp
        >>> bp.fit(bp.quickstart(), bp.simulate(bp.quickstart())).to_map()
        <FittedMap 5 x 5 ball plate in six positions: 69 parameters>
        """
        return service("map_of")(self, date)

    def certificate(
        self,
        plate: str | None = None,
        datum: str | Sequence[str] = (),
        coverage_factor: float | None = None,
        about: Mapping[str, str] | None = None,
    ) -> IssuedCertificate:
        """The co-ordinates of a plate's balls in its own axes with their full covariance, to be
        written as a page, tables or a digital calibration certificate.

        `datum` names the ball at the origin, one on an axis and, in space, one in the xy plane, or
        is "all"; by default corners of the plate. The coverage factor is by default that of the
        experiment, or 2. `about` has texts about date, country, laboratory and so on.

        :raises ExperimentError: no calibrated value determines the plate's lengths.
        :raises ValueError: the fit has not converged; unknown balls, plate, factor or keys.

        >>> import ballplate as bp
        >>> fit = bp.fit(bp.quickstart(), bp.simulate(bp.quickstart()))
        >>> fit.certificate(datum=("r1c1", "r5c1", "r1c5")).datum
        'origin: ball r1c1, y axis through ball r5c1, xy plane through ball r1c5'
        """
        names = (datum,) if isinstance(datum, str) else datum
        ensure_type(Iterable, 'names of balls, or "all"', datum=names)
        if coverage_factor is not None:
            ensure_positive("a coverage factor above 0", coverage_factor=coverage_factor)
        certificate: IssuedCertificate = service("plate_certificate")(
            self, plate, tuple(names), coverage_factor, about
        )
        return certificate

    def residual_vectors(self) -> tuple[Vectors, ...]:
        """Residuals of a converged fit, by position; in three dimensions projected, seen from the
        front and above.
        """
        design = self.design
        view, _ = projection(design.dimension)
        readings, residuals, _ = reading_residuals(design, self.solution, self.observed.x)
        places = self.observed.x[design.plate_readings]
        return tuple(
            Vectors(
                design.positions.names[k],
                places[of_position] @ view.T,
                residuals[of_position] @ view.T,
                tuple(design.balls.names[ball] for ball in readings.ball[of_position]),
            )
            for k in np.unique(readings.position)
            for of_position in [readings.position == k]
        )

    def plot(self, path: str | Path | None = None) -> Figure:
        design, vectors = self.design, self.residual_vectors() if self.converged else ()
        if not vectors:
            reason = (
                "no ball of a plate was read"
                if self.converged
                else f"the estimate has {self.solution.status}"
            )
            raise ValueError(f"there are no residuals to draw: {reason}")
        if design.dimension == 2:
            return draw_vectors(vectors, self.title, path)
        view, towards = projection(3)
        volume = design.machine.volume
        edges, _ = box_edges(volume.lower, volume.upper, towards)
        return draw_vectors(vectors, self.title, path, edges @ view.T)

    @property
    def cautions(self) -> tuple[str, ...]:
        """Warnings about too large residuals, a sigma of few degrees of freedom, and missing
        tests.
        """
        warnings = []
        priors = () if self.experiment is None else self.experiment.priors
        twice: tuple[str, ...] = ()
        if any(prior.data is not None for prior in priors):
            twice = service("counted_twice")(self.experiment, self.observed)
        if twice:
            warnings.append(
                "the map that is prior knowledge comes from readings that are fitted here too"
                f" ({listing(twice)}): they count twice, and uncertainties are too small; leave the"
                " prior out, or these readings"
            )
        if self.too_large:
            advice = (
                "no single cause that was tested explains that: try a larger error model or larger"
                " uncertainties"
            )
            if has_exact_values(self.design):
                advice += "; several values stated as exact may be in error, too"
            if self.diagnosis and self.diagnosis.names_causes:
                advice = "see what the readings contradict"
            times = self.lack_of_fit.times
            warnings.append(
                f"S^2 is {times:.3g} times what the stated uncertainties explain; {advice}"
            )
        elif self.diagnosis:
            verdict = "; ".join(self.diagnosis.verdict)
            warnings.append(f"the readings contradict the experiment: {verdict}")
        if self.without_scatter:
            warnings.append(
                "sigma is zero within rounding, since the readings agree exactly with the model,"
                " as computed ones do, or a few rounded ones may: the uncertainties are zero, too,"
                " and unreliable, as are shares within a target; --sigma"
                " given takes the uncertainties as stated"
            )
        if self.sigma_is_estimated:
            remedy = "--sigma given takes the uncertainties as stated"
            warnings.append(few_degrees_of_freedom(self.degrees_of_freedom, "sigma", remedy))
        if self.untested and self.diagnosis is None:
            warnings.append(self.untested)
        elif self.untested:
            warnings.append(
                f"{self.untested}: fit the means of repeated readings, with u as a column, to have"
                " them tested"
            )
        return tuple(filter(None, warnings))

    @property
    def unread(self) -> tuple[str, ...]:
        """Names of positions without readings."""
        read_positions = set(self.design.readings.position.tolist())
        return tuple(
            name for k, name in enumerate(self.design.positions.names) if k not in read_positions
        )

    @property
    def complaint(self) -> str:
        if self.converged:
            rank = self.verdict.complaint
            if rank and self.unread:
                # The deficiency comes of missing readings: the plan need not expect it.
                rank = f"{rank_words(self.verdict)}; {not_read(self.unread)}"
            return "; ".join(filter(None, [rank, self.lack_of_fit.complaint]))
        exact = ", and values stated as exact"
        return (
            f"the estimate has {self.solution.status}; no results are reported: see the record of"
            " iterations, and check the units, balls and probes of the readings"
            f"{exact if has_exact_values(self.design) else ''}"
        )

    @property
    def too_large(self) -> bool:
        """Whether S^2 is significantly larger than the stated uncertainties explain."""
        return self.converged and self.lack_of_fit.is_significant

    @property
    def lack_of_fit(self) -> LackOfFit:
        """S^2 against its degrees of freedom."""
        return lack_of_fit(self.sum_of_squares, self.sum_freedom, self.diagnosis, self.untested)

    @property
    def without_scatter(self) -> bool:
        """Whether sigma is estimated from residuals that are rounding errors."""
        return self.sigma_is_estimated and self.sigma < LEAST_SIGMA

    def _residual_groups(self) -> dict[str, list[dict[str, Any]]]:
        """Residuals by group as plain data; empty without results."""
        if not self.converged or not len(self.design.plate_readings):
            return {}
        sigma = float("nan") if self.without_scatter else self.sigma
        return residual_groups(self.design, self.solution, self.observed.x, sigma)

    def _standardised(self, residual: Residual) -> float:
        """A residual in its standard uncertainties; NaN without noise."""
        return float("nan") if self.without_scatter else residual.standardised / self.sigma

    def _residual_table(self) -> list[str]:
        columns = {
            "largest residuals": "position",
            "ball": "ball",
            "probe": "probe",
            "axis": "axis",
            "µm": "value",
            "standard uncertainties": self._standardised,
        }
        return table_lines(columns, self.largest[:SHOWN_RESIDUALS])


def _step(step: float) -> str:
    return f"{step:.1e}" if not step < LEAST_STEP else f"below {LEAST_STEP:.0e}"
