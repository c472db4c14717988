"""Set-up of a position in words, for a run sheet."""

from __future__ import annotations

import numpy as np
from ballplate.planning import Step
from ballplate.simulator.experiment import Experiment, Position
from ballplate.simulator.geometry import ball_coordinates
from ballplate.simulator.inputs import number_of


def set_up_rows(step: Step, experiment: Experiment) -> list[tuple[str, str]]:
    """Return the set-up of a position: the artefact if there are several, its location, machine
    co-ordinates of its first and last ball, and the balls to read.
    """
    item = step.candidate.item
    assert isinstance(item, Position)
    layout = experiment.layouts[item.artefact]
    centres = 1e3 * ball_coordinates(item.pose, layout)
    ends = dict.fromkeys((0, len(layout.names) - 1))
    places = []
    for k in ends:
        numbers = ", ".join(f"{value + 0.0:.6g}" for value in np.round(centres[k], 3))
        places.append(f"ball {layout.names[k]} is at ({numbers}) mm")
    rows = [
        ("artefact", step.artefact),
        ("set up", step.place),
        ("so that", " and ".join(places)),
        ("read", f"{step.balls}; {number_of(step.readings, 'reading')}"),
    ]
    return rows if len(experiment.artefacts) > 1 else rows[1:]
