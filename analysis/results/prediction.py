"""Predicted uncertainties of a design."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from ballplate.presentation.formatting import Data, given
from ballplate.presentation.result import Result
from ballplate.rank.verdicts import Verdict, verdict
from ballplate.simulator.computing.processes import single_threaded
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.estimation.linearisation import Linearisation, linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.extensions import optional_service, service
from ballplate.simulator.inputs.settings import hint, number_of
from ballplate.simulator.machines.protocol import Unit
from ballplate.uncertainty.scale import Scale, scale_of
from ballplate.uncertainty.summaries import Quantity, tasks_of, uncertainties

from .extension_results import PredictedAssumptions
from .qualifications import Qualification, given_words, qualification_data, qualifications_of
from .text_blocks import (
    QUANTITY_COLUMNS,
    map_lines,
    quantities_data,
    quantity_data,
    scale_data,
    scale_lines,
    target_lines,
    uncertainty_table,
    verdict_data,
    verdict_lines,
)

if TYPE_CHECKING:
    import pandas
    from ballplate.montecarlo.experiments import Trials
    from ballplate.presentation.table_columns import MainTable
    from ballplate.uncertainty.named_values import NamedUncertainty

# Rows of a table; displacements of single readings may be thousands.
MOST_LINES = 30


@dataclass(frozen=True)
class InfluenceUncertainty:
    """The standard uncertainty of a parameter of an influence quantity, in its `unit`: `stated`,
    infinite if unknown, and `predicted` with the readings, NaN if undetermined.
    """

    name: str
    unit: Unit
    stated: float
    predicted: float


def influence_uncertainties(at: Linearisation) -> tuple[InfluenceUncertainty, ...]:
    """Return the uncertainties of all estimated parameters of influence quantities."""
    parameters = at.design.influence_parameters
    rows = np.eye(len(at.layout))[at.layout.influences]
    predicted = at.of_shared(rows, rows).tolist() if parameters else []
    return tuple(
        InfluenceUncertainty(parameter.name, parameter.unit, parameter.uncertainty, u)
        for parameter, u in zip(parameters, predicted, strict=True)
    )


COLUMNS: dict[str, Any] = {
    "influence quantity": "name",
    "stated uncertainty": (
        lambda row: row.stated if np.isfinite(row.stated) else "unknown",
        3,
    ),
    "with the readings": ("predicted", 3),
    "unit": "unit",
}


def influence_table(influences: Sequence[InfluenceUncertainty]) -> list[str]:
    """Return up to `MOST_LINES` rows as lines of text."""
    from ballplate.presentation.table_columns import table_lines

    omitted = len(influences) - MOST_LINES
    more = [f"({omitted} more are in --json)"] if omitted > 0 else []
    return [*table_lines(COLUMNS, influences[:MOST_LINES]), *more]


def influence_data(influences: Sequence[InfluenceUncertainty]) -> Data:
    """Return uncertainties of influence quantities as plain data, by name."""
    return {
        influence.name: {
            "stated_standard_uncertainty": influence.stated,
            "standard_uncertainty": influence.predicted,
            "unit": influence.unit,
        }
        for influence in influences
    }


@dataclass(frozen=True)
class Advice:
    """Further results of a check: goals that are `missed`, and goals and suggested changes as
    `lines` of text and as plain `data`.
    """

    missed: tuple[str, ...]
    lines: tuple[str, ...]
    data: Mapping[str, Any]


@dataclass(frozen=True, repr=False)
class Prediction(Result):
    """Predicted uncertainties of a design: the verdict on its rank and, optionally, U1 to U6 and
    tasks.

    `lengths` is U6 in any case, None without evaluation points. `monte_carlo` has replicates,
    `advice` further results of a check. `influences` belong to the quantities. `experiment` was
    judged.
    """

    label: str
    title: str
    design: Design
    verdict: Verdict
    quantities: dict[str, Quantity]
    lengths: Quantity | None = None
    monte_carlo: Trials | None = None
    advice: Advice | None = None
    influences: tuple[InfluenceUncertainty, ...] = ()
    experiment: Experiment | None = None

    @cached_property
    def scale(self) -> Scale | None:
        """The sources of scale; None if it is undetermined or has no evaluation points."""
        return None if self.experiment is None else _scale(self.experiment, self.design)

    @cached_property
    def qualifications(self) -> tuple[Qualification, ...]:
        """What the figures and verdicts take for granted, as every output states it."""
        deficiency = self.verdict.deficiency
        return tuple(qualifications_of(deficiency, self.scale, self.assumptions, self.experiment))

    @property
    def qualified(self) -> list[str]:
        """Its qualifications as lines of text; those on the rank have lines of their own."""
        return [each.text for each in self.qualifications if each.kind != "undetermined"]

    @cached_property
    def assumptions(self) -> PredictedAssumptions | None:
        """What the prediction takes for granted, with U6 without it; None if U6 is undetermined,
        zero or has no evaluation points, or without the extension.
        """
        if self.lengths is None or self.experiment is None or not self.lengths.average > 0.0:
            return None
        effects = optional_service("assumption_effects")
        return None if effects is None else effects(self.experiment, self.lengths)

    @cached_property
    def information(self) -> pandas.DataFrame:
        """Part of each error's information that goes with each position: a row for each error, a
        column for each position; `ballplate.information` has more.

        :raises MissingExtensionError: the extension that computes it is not installed.
        """
        found: Result = service("position_information")(self)
        return found.to_frame().set_index("error")

    @property
    def tasks(self) -> tuple[NamedUncertainty, ...]:
        """The measuring tasks."""
        return tasks_of(self.quantities)

    def headline(self) -> str:
        count = 0 if self.advice is None else len(self.advice.missed)
        missed = [f"{number_of(count, 'goal')} missed"] if count else []
        # The rank has words of its own, and of assumptions the largest is stated with its effect.
        others = [q for q in self.qualifications if q.kind not in ("undetermined", "assumption")]
        assumed = [q.text for q in self.qualifications if q.kind == "assumption"][:1]
        conditions = given_words(others).removeprefix(", ")
        words = [rank_words(self.verdict), *length_headline(self.lengths), conditions]
        return ", ".join(filter(None, [*words, *assumed, *missed]))

    def lines(self) -> list[str]:
        lines = [*self.table_lines(), *(() if self.advice is None else self.advice.lines)]
        if self.monte_carlo is None:
            return lines
        from ballplate.montecarlo.comparison_tables import trials_lines

        return [*lines, "", *trials_lines(self.monte_carlo)]

    def table_lines(self) -> list[str]:
        """Title, verdict and table, without replicates."""
        rank, *further = verdict_lines(self.verdict, lengths=self.lengths)
        qualified = self.qualified
        lines = [self.heading, rank, *further]
        lines += [] if self.quantities else [*target_lines(self.lengths), *qualified]
        lines += [*map_lines(self.experiment), *scale_lines(self.scale)]
        if not self.quantities:
            return lines
        lines += ["", *uncertainty_table(self.quantities), *qualified]
        lines += ["", *influence_table(self.influences)] if self.influences else []
        from ._named_tables import named_lines

        lines += named_lines(self.design, self.quantities)
        return lines if self.assumptions is None else [*lines, "", *self.assumptions.summary()]

    def data(self) -> Data:
        named = {}
        if self.quantities:
            from ._named_tables import named_data

            named = named_data(self.design, self.quantities)
        data = {
            **self.named,
            **verdict_data(self.verdict),
            "sigma": 1.0,
            "quantities": quantities_data(self.quantities),
            **named,
            **given(
                lengths=None if self.quantities else self.lengths and quantity_data(self.lengths),
                influences=influence_data(self.influences),
            ),
            "scale": scale_data(self.scale),
            "qualifications": qualification_data(self.qualifications),
            **given(
                assumptions=self.quantities and self.assumptions and self.assumptions.to_dict()
            ),
            **({} if self.advice is None else self.advice.data),
        }
        if self.monte_carlo is None:
            return data
        from ballplate.montecarlo.comparison_tables import trials_data

        return data | {"monte_carlo": trials_data(self.monte_carlo)}

    def __getitem__(self, symbol: str) -> Quantity:
        """A quantity by its symbol: its average and maximum, and their unit.

        :raises KeyError: the prediction has no quantity of that symbol.

        >>> import ballplate as bp
        >>> bp.run(bp.quickstart())["U6"].unit
        'm'
        """
        return by_label(self.quantities, symbol)

    def columns(self) -> MainTable:
        """One row for each of U1 to U6; without these, one with the rank and U6."""
        if self.quantities:
            symbols = {"symbol": list(self.quantities)}
            return {**symbols, **QUANTITY_COLUMNS}, list(self.quantities.values())
        columns = {
            "rank": lambda prediction: rank_words(prediction.verdict),
            "parameters": "verdict.parameters",
            "observations": "verdict.observations",
            "rank deficiency": "verdict.deficiency",
            "as expected": "verdict.as_expected",
            "weakly determined": [len(self.verdict.weak)],
            "U6 average, µm": [self.lengths.average if self.lengths else math.nan],
            "U6 maximum, µm": [self.lengths.maximum if self.lengths else math.nan],
            "U6 undetermined": [self.lengths.undetermined if self.lengths else 0],
            "unit": ["m"],
        }
        return columns, [self]


@single_threaded
def _scale(experiment: Experiment, design: Design) -> Scale | None:
    return scale_of(experiment, linearise(design))


Named = TypeVar("Named")


def by_label(items: Mapping[str, Named], name: str) -> Named:
    """Return the item of a name.

    :raises KeyError: an unknown name.
    """
    if name not in items:
        raise KeyError(f"no {name!r}; {hint(str(name), items)}")
    return items[name]


def rank_words(judged: Verdict) -> str:
    """Return the rank as text."""
    return f"rank deficiency {judged.deficiency}" if judged.deficiency else "full rank"


def length_headline(lengths: Quantity | None) -> list[str]:
    """Return U6 as text; empty if it was not computed."""
    if lengths is None:
        return []
    if lengths.undetermined:
        return [f"U6 undetermined ({lengths.undetermined} of {lengths.count})"]
    return [f"U6 {1e6 * lengths.average:.3g} µm on average, {1e6 * lengths.maximum:.3g} µm at most"]


@dataclass(frozen=True)
class PlannedUncertainty:
    """Rank deficiency and quantities, with measuring tasks, for searches that judge many
    designs.
    """

    deficiency: int
    quantities: dict[str, Quantity]

    @property
    def tasks(self) -> tuple[NamedUncertainty, ...]:
        return tasks_of(self.quantities)


def check(experiment: Experiment, design: Design | None = None) -> Prediction:
    """Judge the rank of an experiment's design, or of another, at zero machine error."""
    return _predict(experiment, design or lay_out(experiment), False)


def predict(experiment: Experiment) -> Prediction:
    """Return rank verdict and U1 to U6 of an experiment's design at zero machine error."""
    return _predict(experiment, lay_out(experiment), True)


@single_threaded
def planned_uncertainty(experiment: Experiment) -> PlannedUncertainty:
    """Return the uncertainties of `predict` without explaining the rank, which takes longest."""
    at = linearise(lay_out(experiment))
    quantities = uncertainties(at, target=experiment.target_uncertainty)
    return PlannedUncertainty(at.deficiency, quantities)


@single_threaded
def _predict(experiment: Experiment, design: Design, with_quantities: bool) -> Prediction:
    at, target = linearise(design), experiment.target_uncertainty
    judged = verdict(at, experiment.expected_rank_deficiency, target)
    quantities = {}
    if with_quantities:
        quantities = uncertainties(at, target=target)
        lengths = quantities.get("U6")
    else:
        # A check states U6 alone, and computes no other quantity.
        lengths = uncertainties(at, target=target, symbols=("U6",)).get("U6")
    return Prediction(
        experiment.label,
        experiment.title,
        design,
        judged,
        quantities,
        lengths,
        influences=influence_uncertainties(at) if with_quantities else (),
        experiment=experiment,
    )
