"""What the readings of a fit contradict, as one table, sentences and data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.presentation import SHOWN, Data, aligned, chance_words, number, picked, table_lines
from ballplate.results import ParameterEstimate
from ballplate.simulator.inputs import listed, listing
from ballplate.simulator.machines import Unit

from .cause_search import FAMILY

# Standard uncertainties from which on one of several sizes is printed.
CLEAR = 3.0


@dataclass(frozen=True)
class Finding:
    """A `cause` of the residuals, with its `p_value` times the number of tests if it is absent.

    `others` are causes that the readings do not distinguish from it; `is_model` if it states only
    terms of the error model, `may_be_model` if these are among the others. Without it residuals are
    `sigma` times as large as stated. `is_gross`: an error of observations, those of `lines` of the
    file of readings.
    """

    kind: str
    cause: str
    cure: str
    p_value: float
    sigma: float
    sizes: tuple[ParameterEstimate, ...] = ()
    others: tuple[str, ...] = ()
    lines: tuple[int, ...] = ()
    is_gross: bool = False
    is_model: bool = False
    may_be_model: bool = False

    @property
    def verdict(self) -> str:
        """The cause, with those that cannot be told apart from it."""
        return ", or ".join([self.cause, *self.others])

    @property
    def size(self) -> str:
        """The significant sizes with their standard uncertainties, at least the most significant
        one.
        """
        ratios = [abs(size.value) / size.standard_uncertainty for size in self.sizes]
        parts = [
            f"{size.name} {number(1e6 * size.value, 3)} ±"
            f" {number(1e6 * size.standard_uncertainty, 2)} {SHOWN[size.unit]}".strip()
            for size, ratio in zip(self.sizes, ratios, strict=True)
            if ratio >= min(CLEAR, max(ratios))
        ]
        return listed(parts) if parts else ""

    @property
    def words(self) -> str:
        """The verdict with its size, p-value, effect on sigma, and cure."""
        facts = [self.size] if self.sizes else []
        facts.append(f"p-value {chance_words(self.p_value)}")
        if not np.isnan(self.sigma):
            facts.append(f"then sigma {number(self.sigma, 3)}")
        return f"{self.verdict} ({', '.join(facts)}); {self.cure}"


@dataclass(frozen=True)
class AssumptionAnswer:
    """The smallest p-value of so many `tests` of an assumption, times their number, without the
    causes found; NaN without a test.

    Every tested cause of the size `noticed_from`, in `unit`, is noticed with 80 % probability, NaN
    if it has no size. Readings show nothing of the causes `not_seen`.
    """

    assumed: str
    p_value: float
    tests: int
    noticed_from: float
    unit: Unit
    not_seen: tuple[str, ...]


@dataclass(frozen=True)
class Diagnosis:
    """Causes of the residuals in the order in which they were found, and what was tested."""

    findings: tuple[Finding, ...] = ()
    tested: tuple[AssumptionAnswer, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.findings)

    @property
    def gross_errors(self) -> int:
        return sum(finding.is_gross for finding in self.findings)

    @property
    def names_causes(self) -> bool:
        """Whether a cause is named, not only terms of the error model."""
        return any(not finding.is_model for finding in self.findings)

    @property
    def verdict(self) -> tuple[str, ...]:
        """Causes that the readings show."""
        return tuple(finding.verdict for finding in self.findings)

    def lines(self) -> list[str]:
        rows = [["contradicted", "size ± u", "p-value", "sigma then", "what to do"]]
        for finding in self.findings:
            numbers = [chance_words(finding.p_value), number(finding.sigma, 3)]
            rows.append([finding.cause, finding.size, *numbers, finding.cure])
            rows += [[f"  or {other}", "", "", "", ""] for other in finding.others]
        table = {
            "assumption tested": "assumed",
            "p-value": ("p_value", chance_words),
            "smallest effect that would show": [
                _amount(each.noticed_from, each.unit) for each in self.tested
            ],
            "cannot be tested": [listing(each.not_seen, 2) for each in self.tested],
        }
        found = ["the readings contradict nothing"]
        if self.findings:
            found = [*aligned(rows, [False, False, True, True, False]), ""]
        return [*found, *table_lines(table, self.tested)] if self.tested or self.findings else []

    def to_dict(self) -> Data:
        return {
            "level": FAMILY,
            "contradicted": [
                {
                    **picked(finding, "kind", "cause", "others", "p_value", "sigma", "cure"),
                    **picked(finding, "words", "lines", "is_gross", "is_model", "may_be_model"),
                    "sizes": [
                        picked(size, "name", "value", "standard_uncertainty", "unit")
                        for size in finding.sizes
                    ],
                }
                for finding in self.findings
            ],
            "tested": [vars(each) | {"not_seen": list(each.not_seen)} for each in self.tested],
        }


def _amount(value: float, unit: Unit) -> str:
    return "-" if np.isnan(value) else f"{number(1e6 * value, 2)} {SHOWN[unit]}"
