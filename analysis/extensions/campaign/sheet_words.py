"""Words and times of a run sheet that all its forms share."""

from __future__ import annotations

import numpy as np
from ballplate.planning.constraints import SLACK
from ballplate.planning.schedule import RunSheet, Step
from ballplate.simulator.experiment.model import Experiment, Position
from ballplate.simulator.geometry.positions import ball_coordinates
from ballplate.simulator.inputs.quantities import format_duration
from ballplate.simulator.inputs.settings import number_of


def summary(sheet: RunSheet) -> str:
    """What there is to do, in a sentence."""
    todo = [step for step in sheet.steps if not step.done]
    done = len(sheet.steps) - len(todo)
    words = [
        number_of(len(todo), "position"),
        number_of(sum(step.readings for step in todo), "reading"),
    ]
    words += (
        [number_of(len(sheet.calibration), "item") + " of calibration"] if sheet.calibration else []
    )
    text = ", ".join(words)
    if sheet.timed:
        text += f": {sheet.hours:.2f} h"
        change = sum(step.change_seconds for step in todo)
        text += f", including change-over {change / 3600.0:.2f} h" if change else ""
        more = f" (at most {sheet.gap / 60.0:.1f} min more than the least of any order)"
        text += more if sheet.gap > SLACK else ""
    return f"{text}; {number_of(done, 'position')} done before" if done else text


def set_up_rows(step: Step, experiment: Experiment) -> list[tuple[str, str]]:
    """How a position is set up: the artefact where there are several, the place, the machine
    co-ordinates of its first and its last ball, and what is read.
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


def times(step: Step) -> tuple[str, str]:
    """When a step begins, in hours and minutes, and how many minutes it takes."""
    if step.done:
        return "done", ""
    hours, minutes = divmod(round(step.start / 60.0), 60)
    return f"{hours}:{minutes:02d}", f"{(step.seconds + step.change_seconds) / 60.0:.0f}"


def price(seconds: float) -> str:
    """A time as a file says it."""
    return format_duration(round(seconds, 3))
