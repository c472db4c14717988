"""What a fit to readings has found: estimates, verdicts, and what is to be cautioned about."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ballplate.presentation.result import FitResult
from ballplate.rank.verdicts import Verdict
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.estimation.gauss_newton import Solution
from ballplate.simulator.experiment.earlier_campaigns import LEAST_SIGMA
from ballplate.simulator.inputs.extensions import service
from ballplate.simulator.inputs.settings import listing
from ballplate.simulator.readings.observed_readings import ObservedReadings
from ballplate.uncertainty.summaries import Quantity, tasks_of

from .adjustments import Adjustment, few_degrees_of_freedom
from .estimates import EstimatedFunctions, ParameterEstimate
from .extension_results import SeparateSigmas, Suspicion, has_exact_values, lack_of_fit
from .plates import PlateCoordinates
from .prediction import length_headline, rank_words
from .residuals import EstimatedCurve, LackOfFit, Residual, estimated_curves
from .text_blocks import not_read

if TYPE_CHECKING:
    from ballplate.simulator.experiment.model import Experiment
    from ballplate.uncertainty.named_values import NamedUncertainty


@dataclass(frozen=True, repr=False)
class FitFindings(FitResult):
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
    def tasks(self) -> tuple[NamedUncertainty, ...]:
        """The measuring tasks."""
        return tasks_of(self.quantities)

    @property
    def converged(self) -> bool:
        return self.solution.status == "converged"

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

    @property
    def unread(self) -> tuple[str, ...]:
        """Names of positions without readings."""
        read_positions = set(self.design.readings.position.tolist())
        return tuple(
            name for k, name in enumerate(self.design.positions.names) if k not in read_positions
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
