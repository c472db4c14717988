"""Redundancy, minimal detectable biases and effects for all observations and events of a design."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from ballplate.simulator.computing import (
    ProgressStep,
    Report,
    comparable,
    single_threaded,
    unreported,
)
from ballplate.simulator.design import Design, measured
from ballplate.simulator.estimation import Coordinates, Distances, linearise
from ballplate.simulator.experiment import Experiment, lay_out
from ballplate.simulator.machines import Integers
from ballplate.uncertainty import QUANTITIES, functions_of

from .bias_patterns import patterns
from .cause_search import FAMILY
from .effects import SYMBOLS, Changes, Largest, across_probes, changes_of
from .events import event_groups
from .hat import row_count, row_places
from .power import noncentrality
from .reliability_result import Effects, Reliability
from .remainders import Columns, leftover, too_many_entries
from .response import responses

FALSE_ALARM, POWER = 0.001, 0.8

# Redundancy numbers that rounding leaves of none.
ROUNDING = 1e-10

# Instead of a symbol: distances between points measured with any of the tasks' probes.
ACROSS = "across probes"


def reliability(
    experiment: Experiment,
    false_alarm: float = FALSE_ALARM,
    power: float = POWER,
    sigma: Literal["estimated", "given"] | None = None,
    report: Report = unreported,
) -> Reliability:
    """Return the reliability of an experiment's design at zero machine error.

    `sigma` overrides the file. `report` receives the number of finished observations.

    :raises ExperimentError: there is not enough memory for all observations.
    """
    design = lay_out(experiment)
    reason = too_many_entries(design)
    if reason:
        raise experiment.refused(
            ("positions",), f"{reason}: read fewer balls, or in fewer positions"
        )
    return reliability_of(
        design, false_alarm, power, (sigma or experiment.sigma) == "estimated", experiment, report
    )


# In one piece: one pass over the responses fills all sums of the result.
@single_threaded
def reliability_of(
    design: Design,
    false_alarm: float = FALSE_ALARM,
    power: float = POWER,
    sigma_is_estimated: bool = False,
    experiment: Experiment | None = None,
    report: Report = unreported,
) -> Reliability:
    """Return the reliability of a design at zero machine error."""
    report(ProgressStep("observations", 0, row_count(design)))
    linearisation = linearise(design)
    biases = patterns(design, linearisation.state, None)
    functions = {
        symbol: groups
        for symbol in SYMBOLS
        for groups in [functions_of(symbol, design, linearisation.layout)]
        # Functions of other experiments are not reported.
        if groups or QUANTITIES[symbol].is_recorded
    }
    mixed = across_probes(design)
    if mixed is not None:
        functions[ACROSS] = (mixed,)
    changes = {
        symbol: [
            changes_of(linearisation, group, biases)
            for group in groups
            if isinstance(group, Coordinates | Distances)
        ]
        for symbol, groups in functions.items()
    }
    places = row_places(design)
    redundancy, remaining_share, information = (
        np.zeros(row_count(design)),
        np.zeros(len(biases)),
        np.zeros(len(biases)),
    )
    none = np.full(len(biases), -1)
    effects = {
        symbol: Effects(groups, np.zeros(len(biases)), none.copy(), none.copy(), none * np.nan)
        for symbol, groups in functions.items()
    }
    finished = 0
    for response in responses(linearisation, biases):
        report(ProgressStep("observations", finished, row_count(design)))
        finished += len(response.rows)
        left = 1.0 - response.hat
        redundancy[response.rows] = np.where(left > ROUNDING, left, 0.0)
        information[response.index] = response.information
        remaining_share[response.index] = response.information / np.where(
            response.square > 0.0, response.square, 1.0
        )
        balls = (
            np.unique(response.own.indices // design.dimension)
            if len(response.rows)
            else np.zeros(0, np.int64)
        )
        for symbol, groups in changes.items():
            for changes_among in groups:
                _enter_larger(
                    effects[symbol],
                    response.index,
                    changes_among(balls),
                    changes_among(balls).largest(response),
                )
    readings = design.readings.select(design.plate_readings)
    is_read = measured(design, readings)
    # Missing co-ordinates are no observations.
    redundancy[places["reading"]][~is_read.ravel()] = 0.0
    joint = [response.word for response in design.observations if response.is_joint]
    # Standards' lengths that share no reading come first, and have a pattern each.
    for kind, rows in places.items():
        columns, of_kind = np.flatnonzero(biases.kind == kind), redundancy[rows]
        if kind == "reading":
            remaining_share[columns] = of_kind[is_read.ravel()][: len(columns)]
        elif kind == "length":
            remaining_share[columns] = of_kind[: len(columns)]
        elif kind not in joint:
            remaining_share[columns] = of_kind[biases.subject[columns]]
    every = patterns(design, linearisation.state, None, every_start=True)
    tests = Columns(every.matrix, event_groups(every), leftover(linearisation, None, 1)).tests()
    across = effects.pop(ACROSS).change if mixed is not None else np.zeros(len(biases))
    limit = 0.5 * FAMILY / max(tests, 1)
    freedom = linearisation.degrees_of_freedom
    return Reliability(
        experiment.label if experiment else "",
        experiment.title if experiment else "",
        design,
        biases,
        redundancy,
        remaining_share,
        int(((readings.repeats - 1)[:, None] * is_read).sum()),
        information,
        effects,
        across,
        freedom,
        linearisation.deficiency,
        sigma_is_estimated,
        false_alarm,
        power,
        noncentrality(false_alarm, power, freedom - 1 if sigma_is_estimated else math.inf),
        noncentrality(limit, power, freedom - 1 if sigma_is_estimated else math.inf),
    )


def _enter_larger(effects: Effects, index: Integers, changes: Changes, largest: Largest) -> None:
    """Enter changes by patterns `index` that exceed those entered of other artefacts."""
    more = comparable(largest.change) > comparable(effects.change[index])
    use = (largest.function >= 0) & (more | (effects.first[index] < 0))
    index, function = index[use], largest.function[use]
    effects.change[index], effects.uncertainty[index] = (
        largest.change[use],
        largest.uncertainty[use],
    )
    effects.first[index], effects.second[index] = changes.first[function], changes.second[function]
