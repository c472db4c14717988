"""Redundancy, minimal detectable biases and their effects for all observations and events of a design."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from ballplate.simulator.design import Design, Integers, nominal_state
from ballplate.simulator.estimation.covariance import covariance, spectrum
from ballplate.simulator.estimation.elimination import eliminate
from ballplate.simulator.estimation.hat import row_places
from ballplate.simulator.estimation.parameters import shared_layout
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.layout import lay_out
from ballplate.simulator.machines.protocol import Array
from ballplate.simulator.threads import single_threaded

from ..result import Result
from .effects import SYMBOLS, Functions, Largest, ball_distances, error_functions, point_distances
from .events import event_groups
from .leftover import Columns, leftover
from .patterns import Patterns, patterns
from .power import noncentrality
from .response import responses
from .search import FAMILY

FALSE_ALARM, POWER = 0.001, 0.8

# An effect below this share of the bias, in metres per unit, counts as none.
NO_EFFECT = 1e-6


@dataclass(frozen=True)
class Effects:
    """Largest changes `change` (k,) of one kind of function by a unit of each pattern's bias, and where.

    `first` and `second` (k,) are the places of the function that changes most, -1 where none is determined;
    `uncertainty` (k,) is its standard uncertainty.
    """

    change: Array
    first: Integers
    second: Integers
    uncertainty: Array


@dataclass(frozen=True, repr=False)
class Reliability(Result):
    """What a design notices of biases, for each of its patterns.

    `redundancy` (rows,) are the redundancy numbers of the observations; a reading of a plate stands for the mean of its
    repeats, which have `among_repeats` degrees of freedom more among themselves. `left` (k,) is that of each pattern:
    of a single observation its redundancy number, otherwise the share of its square that is left in the residuals.
    `information` (k,) is what is left of a pattern in the residuals, per unit of the bias squared, and 0 where that is
    nil. `effects` are by symbol, U4 to U6. `noncentrality` belongs to the test with `false_alarm` and `power`, sigma
    being known or estimated from the observations, less the one suspected, and `fit_noncentrality` to each of all those
    tests that a fit makes.
    """

    label: str
    title: str
    design: Design
    patterns: Patterns
    redundancy: Array
    left: Array
    among_repeats: int
    information: Array
    effects: dict[str, Effects]
    degrees_of_freedom: int
    deficiency: int
    sigma_is_estimated: bool
    false_alarm: float
    power: float
    noncentrality: float
    fit_noncentrality: float

    def headline(self) -> str:
        observations = self.design.observations
        mean = (float(self.redundancy.sum()) + self.among_repeats) / observations
        return f"redundancy {mean:.3g} of an observation on average; {len(self.patterns)} biases judged"

    def lines(self) -> list[str]:
        from .tables import reliability_lines

        return reliability_lines(self)

    def to_dict(self) -> dict[str, Any]:
        from .tables import reliability_data

        return reliability_data(self)

    def rows(self) -> list[dict[str, Any]]:
        """One row for each bias: of an observation, a probe, a position, a certificate."""
        data = self.to_dict()
        rows = []
        for one in (*data["observations_by_name"], *data["events"]):
            changes = {symbol: effect.get("change") for symbol, effect in one["effects"].items()}
            names = ("name", "kind", "redundancy", "minimal_detectable", "found_by_fit", "unit")
            rows.append({name.replace("_", " "): one.get(name) for name in names} | changes)
        return rows

    @property
    def found_by_fit(self) -> Array:
        """The same of the tests that `fit` makes, which are many together."""
        return self._biases(self.fit_noncentrality)

    @property
    def detectable(self) -> Array:
        """Minimal detectable biases (k,) in metres, radians or ratios; infinite where nothing can be detected."""
        return self._biases(self.noncentrality)

    def _biases(self, noncentrality: float) -> Array:
        with np.errstate(divide="ignore"):
            return np.asarray(np.where(self.information > 0.0, noncentrality / np.sqrt(self.information), np.inf))

    def is_harmless(self, k: int) -> bool:
        """Whether a bias changes no distance, between balls or between corrected points."""
        return all(self.effects[symbol].change[k] <= NO_EFFECT * self.size(k) for symbol in ("U5", "U6"))

    def size(self, k: int) -> float:
        """About how far, in metres, a unit of a bias moves what it is about."""
        extent = float(np.ptp(self.design.balls, axis=0).max(initial=0.0))
        return 1.0 if self.patterns.unit(k) == "m" else max(extent, 1e-3)


def reliability(
    experiment: Experiment,
    false_alarm: float = FALSE_ALARM,
    power: float = POWER,
    sigma: Literal["estimated", "given"] | None = None,
) -> Reliability:
    """Reliability of an experiment's design at zero machine error; `sigma` overrides what the file says."""
    return reliability_of(
        lay_out(experiment), false_alarm, power, (sigma or experiment.sigma) == "estimated", experiment
    )


@single_threaded
def reliability_of(
    design: Design,
    false_alarm: float = FALSE_ALARM,
    power: float = POWER,
    sigma_is_estimated: bool = False,
    experiment: Experiment | None = None,
) -> Reliability:
    """Reliability of a design at zero machine error, where sigma is known or estimated."""
    layout, state = shared_layout(design), nominal_state(design)
    factor = eliminate(design, layout, state)
    found_rank = spectrum(factor)
    spread = covariance(design, factor, found_rank)
    given = patterns(design, state, None)
    functions = {
        "U4": error_functions(design, layout, state, spread),
        "U6": point_distances(design, layout, state, spread),
    }
    balls_of = ball_distances(design, state, spread)
    places = row_places(design)
    redundancy, left, information = np.zeros(len(places)), np.zeros(len(given)), np.zeros(len(given))
    effects = {symbol: _nothing(len(given)) for symbol in SYMBOLS}
    for one in responses(design, layout, state, None, spread, given):
        redundancy[one.rows] = 1.0 - one.hat
        information[one.index] = one.information
        left[one.index] = one.information / np.where(one.square > 0.0, one.square, 1.0)
        asked = np.unique(one.own.indices // design.dimension) if len(one.rows) else np.zeros(0, np.int64)
        for symbol in SYMBOLS:
            of_symbol = balls_of(asked) if symbol == "U5" else functions[symbol]
            _put(effects[symbol], one.index, of_symbol, of_symbol.largest(one))
    for kind, rows in (
        ("reading", places.readings),
        ("length", places.lengths),
        ("prior", places.priors),
        ("coordinate", places.coordinates),
        ("distance", places.distances),
    ):
        own = np.flatnonzero(given.kind == kind)
        left[own] = redundancy[rows][: len(own)]
    repeats = design.readings.repeats[design.plate_readings]
    every = patterns(design, state, None, every_start=True)
    tests = Columns(every.matrix, event_groups(every), leftover(design, state, None, 1, spread)).tests()
    limit = 0.5 * FAMILY / max(tests, 1)
    freedom = design.observations - design.parameter_count + found_rank.deficiency
    return Reliability(
        experiment.label if experiment else "",
        experiment.title if experiment else "",
        design,
        given,
        redundancy,
        left,
        design.dimension * int((repeats - 1).sum()),
        information,
        effects,
        freedom,
        found_rank.deficiency,
        sigma_is_estimated,
        false_alarm,
        power,
        noncentrality(false_alarm, power, freedom - 1 if sigma_is_estimated else math.inf),
        noncentrality(limit, power, freedom - 1 if sigma_is_estimated else math.inf),
    )


def _nothing(count: int) -> Effects:
    return Effects(np.zeros(count), np.full(count, -1), np.full(count, -1), np.full(count, np.nan))


def _put(effects: Effects, index: Integers, functions: Functions, found: Largest) -> None:
    """Enter what patterns `index` change."""
    effects.change[index] = found.change
    effects.uncertainty[index] = found.uncertainty
    known = found.function >= 0
    effects.first[index[known]] = functions.first[found.function[known]]
    effects.second[index[known]] = functions.second[found.function[known]]
