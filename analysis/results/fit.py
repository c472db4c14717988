"""The estimate from readings."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any, Literal

from ballplate.simulator.design import Design
from ballplate.simulator.estimation.gauss_newton import Solution
from ballplate.simulator.experiment.yamltree import Mark
from ballplate.simulator.machines.protocol import Unit

from ..adjustments import Adjustment, few_degrees_of_freedom, freedom_words
from ..gross_errors.suspects import Diagnosis
from ..gross_errors.wording import diagnosis_data, diagnosis_lines
from ..plates import PlateCoordinates
from ..rank import Verdict
from ..tasks import TaskUncertainty
from ..uncertainty import Quantity
from .formatting import SHOWN, aligned, finite, number, to_uncertainty
from .parts import (
    adjustment_data,
    adjustment_lines,
    plate_data,
    plate_table,
    quantities_data,
    task_data,
    task_table,
    uncertainty_table,
    verdict_data,
    verdict_lines,
)
from .prediction import length_headline, rank_words
from .result import Result

# Steps of an iteration below this, in metres and radians, are told as rounding.
LEAST_STEP = 1e-10

# The largest residuals that the text names.
SHOWN_RESIDUALS = 3

ParameterKind = Literal["machine", "origin", "rotation", "offset", "length", "ball"]


@dataclass(frozen=True)
class ParameterEstimate:
    """One estimated parameter; the standard uncertainty is NaN, and so the value, where it is undetermined.

    `kind` says what it is of: the machine, origin or rotation of a pose, a probe's offset, a standard's length, a ball.
    """

    name: str
    value: float
    standard_uncertainty: float
    unit: Unit
    kind: ParameterKind = "machine"


@dataclass(frozen=True)
class Residual:
    """What a reading of a plate differs by from the estimate along one axis, in metres and in its uncertainties.

    Of a length standard the length, as `axis`, is too long by so much; its uncertainty includes the certificate's.
    """

    position: str
    ball: str
    probe: str
    axis: str
    value: float
    standardised: float


@dataclass(frozen=True, repr=False)
class Fit(Result):
    """An estimate from readings; without quantities and estimates, and the design judged as drawn, if it has failed.

    `sigma` multiplies all stated uncertainties: estimated from the residuals as the root of S^2 over the degrees of
    freedom, or 1 where the file says that they are given. `adjustments` are those of a three-dimensional metric.
    `diagnosis` is what the residuals make suspect, which nothing else here heeds; `marks` tell where readings stand.
    """

    label: str
    title: str
    design: Design
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
    tasks: tuple[TaskUncertainty, ...] = ()
    diagnosis: Diagnosis = Diagnosis()
    marks: tuple[Mark, ...] = ()

    def headline(self) -> str:
        if not self.converged:
            return f"the estimate has {self.solution.status}"
        return ", ".join([rank_words(self.verdict), f"sigma {self.sigma:.3g}", *length_headline(self.quantities)])

    def lines(self) -> list[str]:
        record = self.solution.iterations
        verdict = verdict_lines(self.verdict, with_values=True, lengths=self.quantities.get("U6"))
        lines = [f"{self.label}: {self.title}", *verdict]
        how = "estimated from the residuals" if self.sigma_is_estimated else "as given"
        summary = f"{self.solution.status} after {len(record) - 1} iterations; S^2 = {record[-1].sum_of_squares:.6g}"
        if self.converged:
            summary += f" with {freedom_words(self.degrees_of_freedom)}; sigma = {self.sigma:.4g} times the stated "
            summary += f"uncertainties ({how})"
        rows = [["iteration", "step", "S^2"]]
        rows += [[str(k), _step(it.step) if k else "", f"{it.sum_of_squares:.5e}"] for k, it in enumerate(record)]
        lines += [summary, "", *aligned(rows, [True, True, True])]
        if not self.converged:
            return lines
        lines += ["", *self._residual_table()]
        if self.diagnosis:
            lines += diagnosis_lines(self.diagnosis, self.marks)
        lines += ["", *uncertainty_table(self.quantities), ""]
        lines += [*task_table(self.tasks), ""] if self.tasks else []
        rows = [["parameter", "value", "standard uncertainty", "unit"]]
        for estimate in (one for one in self.estimates if one.kind not in ("origin", "ball")):
            rows.append(
                [
                    estimate.name,
                    to_uncertainty(1e6 * estimate.value, 1e6 * estimate.standard_uncertainty),
                    number(1e6 * estimate.standard_uncertainty, 3),
                    SHOWN[estimate.unit],
                ]
            )
        lines += aligned(rows, [False, True, True, False])
        lines.append("(origins of positions and co-ordinates of balls are among the estimates of --json)")
        if self.adjustments:
            lines += ["", *adjustment_lines(self.adjustments)]
        for plate in self.plates:
            lines += ["", *plate_table(plate, named=len(self.plates) > 1)]
        return lines

    def to_dict(self) -> dict[str, Any]:
        suspected: dict[str, Any] = {}
        if self.diagnosis:
            suspected = {"suspected": diagnosis_data(self.diagnosis, self.marks)}
        return {
            "experiment": self.label,
            "title": self.title,
            **verdict_data(self.verdict),
            "status": self.solution.status,
            "sigma": self.sigma,
            "sigma_is_estimated": self.sigma_is_estimated,
            "degrees_of_freedom": self.degrees_of_freedom,
            "too_large": self.too_large,
            "sum_of_squares": finite(self.solution.factor.sum_of_squares),
            "iterations": [
                {"step": finite(it.step), "sum_of_squares": finite(it.sum_of_squares)}
                for it in self.solution.iterations
            ],
            "quantities": quantities_data(self.quantities),
            **({"tasks": task_data(self.tasks)} if self.tasks else {}),
            "largest_residuals": [
                {
                    "position": one.position,
                    "ball": one.ball,
                    "probe": one.probe,
                    "axis": one.axis,
                    "value": one.value,
                    "unit": "m",
                    "standard_uncertainties": one.standardised / self.sigma,
                }
                for one in self.largest
            ],
            **suspected,
            "estimates": self._estimates_data(),
            **({"plates": {plate.artefact: plate_data(plate) for plate in self.plates}} if self.plates else {}),
            **({"adjustments": adjustment_data(self.adjustments)} if self.adjustments else {}),
        }

    def rows(self) -> list[dict[str, Any]]:
        """One row for each parameter."""
        return [
            {
                "parameter": one.name,
                "kind": one.kind,
                "value": one.value,
                "standard uncertainty": one.standard_uncertainty,
                "unit": one.unit,
            }
            for one in self.estimates
        ]

    @property
    def converged(self) -> bool:
        return self.solution.status == "converged"

    @property
    def doubt(self) -> str:
        """What is to be said of sigma where it comes from few degrees of freedom; otherwise empty."""
        if not self.sigma_is_estimated:
            return ""
        return few_degrees_of_freedom(
            self.degrees_of_freedom, "sigma", "--sigma given takes the uncertainties as stated"
        )

    @property
    def too_large(self) -> bool:
        """Whether S^2 is larger than the stated uncertainties explain, by a test that errs once in a thousand."""
        from scipy.special import chdtri

        if not self.converged or self.degrees_of_freedom <= 0:
            return False
        return self.solution.factor.sum_of_squares > float(chdtri(self.degrees_of_freedom, 1e-3))

    def _residual_table(self) -> list[str]:
        """The largest residuals as lines of text."""
        rows = [["largest residuals", "", "", "", "um", "standard uncertainties"]]
        for one in self.largest[:SHOWN_RESIDUALS]:
            rows.append(
                [
                    one.position,
                    one.ball,
                    one.probe,
                    one.axis,
                    number(1e6 * one.value),
                    number(one.standardised / self.sigma),
                ]
            )
        return aligned(rows, [False, False, False, False, True, True])

    def _estimates_data(self) -> dict[str, Any]:
        """Estimates by name; by kind and name where a model gives a parameter the name that another kind has."""
        times = Counter(one.name for one in self.estimates)
        return {
            one.name if times[one.name] == 1 else f"{one.kind}: {one.name}": {
                "value": finite(one.value),
                "standard_uncertainty": finite(one.standard_uncertainty),
                "unit": one.unit,
            }
            for one in self.estimates
        }


def _step(step: float) -> str:
    """The length of an iteration's step, in metres and radians; a last one may be mere rounding."""
    return f"{step:.1e}" if not step < LEAST_STEP else f"below {LEAST_STEP:.0e}"
