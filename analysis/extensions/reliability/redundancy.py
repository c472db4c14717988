"""Redundancy, minimal detectable biases and their effects for all observations and events of a
design.
"""

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
from ballplate.simulator.estimation import Parameters, linearise
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

# In the place of a symbol: distances between points measured with any of the tasks' probes.
ACROSS = "across probes"


def reliability(
    experiment: Experiment,
    false_alarm: float = FALSE_ALARM,
    power: float = POWER,
    sigma: Literal["estimated", "given"] | None = None,
    report: Report = unreported,
) -> Reliability:
    """Reliability of an experiment's design at zero machine error; `sigma` overrides what the file
    says.

    `report` is told the number of observations done.

    :raises ExperimentError: it has more observations than there is memory for.
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
    """Reliability of a design at zero machine error, where sigma is known or estimated."""
    report(ProgressStep("observations", 0, row_count(design)))
    at = linearise(design)
    given = patterns(design, at.state, None)
    functions = {
        symbol: groups
        for symbol in SYMBOLS
        for groups in [functions_of(symbol, design, at.layout)]
        # Of what only some experiments ask for, the others are told nothing.
        if groups or QUANTITIES[symbol].is_recorded
    }
    mixed = across_probes(design)
    if mixed is not None:
        functions[ACROSS] = (mixed,)
    changes = {
        symbol: [
            changes_of(at, group, given) for group in groups if not isinstance(group, Parameters)
        ]
        for symbol, groups in functions.items()
    }
    places = row_places(design)
    redundancy, left, information = (
        np.zeros(row_count(design)),
        np.zeros(len(given)),
        np.zeros(len(given)),
    )
    none = np.full(len(given), -1)
    effects = {
        symbol: Effects(groups, np.zeros(len(given)), none.copy(), none.copy(), none * np.nan)
        for symbol, groups in functions.items()
    }
    done = 0
    for one in responses(at, given):
        report(ProgressStep("observations", done, row_count(design)))
        done += len(one.rows)
        redundancy[one.rows] = 1.0 - one.hat
        information[one.index] = one.information
        left[one.index] = one.information / np.where(one.square > 0.0, one.square, 1.0)
        asked = (
            np.unique(one.own.indices // design.dimension)
            if len(one.rows)
            else np.zeros(0, np.int64)
        )
        for symbol, groups in changes.items():
            for among in groups:
                _put(effects[symbol], one.index, among(asked), among(asked).largest(one))
    readings = design.readings.select(design.plate_readings)
    is_read = measured(design, readings)
    # Co-ordinates that are not read are no observations.
    redundancy[places["reading"]][~is_read.ravel()] = 0.0
    joint = [one.word for one in design.observations if one.is_joint]
    # Of standards' lengths those that share no reading come first, and have a pattern each.
    for kind, rows in places.items():
        own, of_kind = np.flatnonzero(given.kind == kind), redundancy[rows]
        if kind == "reading":
            left[own] = of_kind[is_read.ravel()][: len(own)]
        elif kind == "length":
            left[own] = of_kind[: len(own)]
        elif kind not in joint:
            left[own] = of_kind[given.subject[own]]
    every = patterns(design, at.state, None, every_start=True)
    tests = Columns(every.matrix, event_groups(every), leftover(at, None, 1)).tests()
    across = effects.pop(ACROSS).change if mixed is not None else np.zeros(len(given))
    limit = 0.5 * FAMILY / max(tests, 1)
    freedom = at.degrees_of_freedom
    return Reliability(
        experiment.label if experiment else "",
        experiment.title if experiment else "",
        design,
        given,
        redundancy,
        left,
        int(((readings.repeats - 1)[:, None] * is_read).sum()),
        information,
        effects,
        across,
        freedom,
        at.deficiency,
        sigma_is_estimated,
        false_alarm,
        power,
        noncentrality(false_alarm, power, freedom - 1 if sigma_is_estimated else math.inf),
        noncentrality(limit, power, freedom - 1 if sigma_is_estimated else math.inf),
    )


def _put(effects: Effects, index: Integers, changes: Changes, largest: Largest) -> None:
    """Enter what patterns `index` change, where that is more than what has been entered of other
    artefacts.
    """
    more = comparable(largest.change) > comparable(effects.change[index])
    use = (largest.function >= 0) & (more | (effects.first[index] < 0))
    index, function = index[use], largest.function[use]
    effects.change[index], effects.uncertainty[index] = (
        largest.change[use],
        largest.uncertainty[use],
    )
    effects.first[index], effects.second[index] = changes.first[function], changes.second[function]
