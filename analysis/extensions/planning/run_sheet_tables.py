"""The run sheet of a plan as lines of text and as plain data."""

from __future__ import annotations

from ballplate.presentation import Data, picked, table_lines
from ballplate.simulator.inputs import format_duration, in_one_line, number_of

from .schedule import RunSheet, Step


def sheet_lines(sheet: RunSheet) -> list[str]:
    """The run sheet as lines of text: the order, and how each position is set up."""
    columns = {
        "": range(1, len(sheet.steps) + 1),
        "start": (range(len(sheet.steps)), lambda k: times(sheet.steps[k])[0]),
        "min": (range(len(sheet.steps)), lambda k: times(sheet.steps[k])[1]),
        "position": "name",
        "probes": lambda step: ", ".join(step.probes),
        "balls": "balls",
        "readings": "readings",
    }
    if not sheet.timed:
        del columns["start"], columns["min"]
    lines = table_lines(columns, sheet.steps) if sheet.steps else []
    lines += [
        f"{number} {step.title}: {_words(step, sheet.timed)}"
        for number, step in enumerate(sheet.steps, 1)
        if not step.done
    ]
    lines += [
        f"calibration {calibration.name}: {price(calibration.seconds)}"
        for calibration in sheet.calibration
    ]
    return [in_one_line(line) for line in (*lines, summary(sheet))]


def sheet_data(sheet: RunSheet) -> Data:
    """The run sheet as plain data, times in seconds."""
    return {
        "steps": [
            {
                "name": step.name,
                "description": step.description or None,
                **picked(step, "done", "artefact"),
                "plane": step.plane or None,
                "set_up": step.place,
                "probes": list(step.probes),
                **picked(step, "balls", "readings"),
                "change": step.change or None,
                "change_seconds": step.change_seconds if sheet.timed else None,
                "seconds": step.seconds if sheet.timed else None,
                "start": step.start if sheet.timed else None,
            }
            for step in sheet.steps
        ],
        "calibration": [
            {"name": calibration.name, "seconds": calibration.seconds}
            for calibration in sheet.calibration
        ],
        "seconds": sheet.seconds if sheet.timed else None,
    }


def summary(sheet: RunSheet) -> str:
    """Return the remaining work as a sentence."""
    todo = [step for step in sheet.steps if not step.done]
    done_count = len(sheet.steps) - len(todo)
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
    return f"{text}; {number_of(done_count, 'position')} done before" if done_count else text


def times(step: Step) -> tuple[str, str]:
    """When a step begins, in hours and minutes, and how many minutes it takes."""
    if step.done:
        return "done", ""
    hours, minutes = divmod(round(step.start / 60.0), 60)
    return f"{hours}:{minutes:02d}", f"{(step.seconds + step.change_seconds) / 60.0:.0f}"


def price(seconds: float) -> str:
    """A time as a file says it."""
    return format_duration(round(seconds, 3))


def _words(step: Step, timed: bool) -> str:
    cost = f" ({price(step.change_seconds)})" if timed else ""
    change = f"change {step.change}{cost}; " if step.change else ""
    return f"{change}{step.place}"
