"""A run sheet as text to print."""

from __future__ import annotations

from ballplate.planning import RunSheet, Step, sheet_lines
from ballplate.presentation import aligned
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import in_one_line

from .reading_lists import sequence
from .sheet_head import BLANKS, NOTES, known_fields, stylus_rows
from .sheet_words import set_up_rows

# Where something is written in by hand.
BLANK = "_" * 12


def sheet_text(sheet: RunSheet, experiment: Experiment, title: str) -> str:
    """The run sheet as text to print: the head to fill in, the styli, the order, and a box for
    every reading.
    """
    lines = [in_one_line(title), ""]
    fields = known_fields(experiment) | dict.fromkeys((*BLANKS, "page"), BLANK)
    lines += [f"{in_one_line(name)}: {in_one_line(value)}" for name, value in fields.items()]
    rows = stylus_rows(sheet, experiment)
    styli = aligned(rows, [False, *[True] * (len(rows[0]) - 1)])
    lines += ["", *map(in_one_line, styli), "", *sheet_lines(sheet)]
    for number, step in enumerate(sheet.steps, 1):
        if step.done:
            continue
        lines += ["", in_one_line(f"[ ] {number} {step.title}")]
        lines += [in_one_line(f"    {key}: {text}") for key, text in set_up_rows(step, experiment)]
        for probe, boxes in _boxes(step):
            lines += [in_one_line(f"    with {probe}:"), *_wrapped(boxes)]
        lines.append("    " + "  ".join(f"{name} {BLANK}" for name in NOTES))
    return "\n".join([*lines, ""])


def _boxes(step: Step) -> list[tuple[str, list[str]]]:
    """The readings of a step by probe, each ball with a box for every time it is read."""
    return [
        (probe, [f"{'[ ]' * repeats} {in_one_line(name)}" for name, _, repeats in balls])
        for probe, balls in sequence(step)
    ]


def _wrapped(boxes: list[str], width: int = 92) -> list[str]:
    """Boxes side by side in columns, as lines."""
    size = max(map(len, boxes)) + 2
    across = max((width - 6) // size, 1)
    rows = [boxes[start : start + across] for start in range(0, len(boxes), across)]
    return ["      " + "".join(box.ljust(size) for box in row).rstrip() for row in rows]
