"""Groups of observations that have a variance component each, and designs with other ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from ballplate.extensions.reliability.hat import row_places
from ballplate.results import Grouping
from ballplate.simulator.design import (
    Design,
    Lengths,
    Observations,
    Priors,
    measured,
)
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.machines import Integers


@dataclass(frozen=True)
class ObservationGroup:
    """Observations that have their actual uncertainties in one ratio to the stated ones; `rows`
    (k,) are those among the whitened rows of the design.
    """

    name: str
    rows: Integers


def kinds_of_rows(design: Design, observations: Observations) -> list[str]:
    """Return the group of each row of observations, by class and artefact.

    Values of influence quantities from one statement are a group, whose variance the statement
    gives.
    """
    if isinstance(observations, Priors):
        parameters = design.influence_parameters
        return [
            "priors" if k < 0 else parameters[k].component or "influence quantities"
            for k in observations.of_influence.tolist()
        ]
    count = observations.count(design)
    if isinstance(observations, Lengths) or not observations.balls.shape[1]:
        return [f"{observations.word}s"] * count
    artefacts = design.balls.artefact[observations.balls[:, 0]].tolist()
    return [f"{observations.word}s of {design.artefacts.names[k]}" for k in artefacts]


def groups_of(
    design: Design,
    by: Grouping,
    names_of: Callable[[Design, Observations], list[str]] = kinds_of_rows,
) -> tuple[ObservationGroup, ...]:
    """All whitened rows of a design in groups: readings of plates by axis, probe, position or
    artefact, or as one, and all other observations by the names of their rows.
    """
    d, readings = design.dimension, design.readings.select(design.plate_readings)
    words, member = {
        "axis": (
            [f"readings along {axis}" for axis in AXIS_NAMES[:d]],
            np.tile(np.arange(d), len(readings)),
        ),
        "probe": (
            [f"readings with {name}" for name in design.probes.names],
            np.repeat(readings.probe, d),
        ),
        "position": (
            [f"readings in {name}" for name in design.positions.names],
            np.repeat(readings.position, d),
        ),
        "artefact": (
            [f"readings of {name}" for name in design.artefacts.names],
            np.repeat(design.balls.artefact[readings.ball], d),
        ),
        "calibration": (["readings"], np.zeros(d * len(readings), np.int64)),
    }[by]
    # Holes are read in two co-ordinates.
    member = np.where(measured(design, readings).ravel(), member, -1)
    groups = [ObservationGroup(word, np.flatnonzero(member == k)) for k, word in enumerate(words)]
    places = row_places(design)
    for observation in design.observations:
        start = places[observation.word].start
        names = names_of(design, observation)
        for name in dict.fromkeys(names):
            rows = np.flatnonzero([row_name == name for row_name in names])
            groups.append(ObservationGroup(name, start + rows))
    return tuple(group for group in groups if len(group.rows))
