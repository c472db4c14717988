"""Groups of observations: readings by axis, probe, position or artefact, and all others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from ballplate.extensions.diagnosis.hat import row_places
from ballplate.simulator.design import Design, Observations, measured
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.machines import Integers

Grouping = Literal["axis", "probe", "position", "artefact", "calibration"]

GROUPINGS: tuple[Grouping, ...] = get_args(Grouping)


@dataclass(frozen=True)
class ObservationGroup:
    """Observations of one source; `rows` (k,) are those among the whitened rows of the design."""

    name: str
    rows: Integers


def groups_of(
    design: Design,
    by: Grouping,
    names_of: Callable[[Design, Observations], list[str]],
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
