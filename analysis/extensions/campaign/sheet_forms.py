"""A run sheet as text, CSV, Markdown and JSON data."""

from __future__ import annotations

import io

from ballplate.planning import RunSheet, Step, price, sheet_lines, summary, times
from ballplate.presentation import aligned
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import CsvWriter, in_one_line

from .reading_lists import sequence
from .sheet_head import BLANKS, NOTES, known_fields, stylus_rows
from .sheet_words import set_up_rows

COLUMNS = (
    "step",
    "done",
    "name",
    "description",
    "artefact",
    "plane",
    "set_up",
    "probes",
    "balls",
    "readings",
    "change",
    "change_min",
    "minutes",
    "start_min",
)

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


def sheet_csv(sheet: RunSheet) -> str:
    """The run sheet as CSV with a header; minutes are decimal numbers, of items of calibration
    their price.
    """
    out = io.StringIO()
    writer = CsvWriter(out)
    writer.writerow(COLUMNS)
    for number, step in enumerate(sheet.steps, 1):
        minutes = (
            f"{step.change_seconds / 60.0:.10g}",
            f"{step.seconds / 60.0:.10g}",
            "" if step.done else f"{step.start / 60.0:.10g}",
        )
        writer.writerow(
            (
                number,
                "yes" if step.done else "no",
                step.name,
                step.description,
                step.artefact,
                step.plane,
                step.place,
                " ".join(step.probes),
                step.balls,
                step.readings,
                step.change,
                *(minutes if sheet.timed else ("", "", "")),
            )
        )
    for calibration in sheet.calibration:
        cells = [
            "",
            "",
            calibration.name,
            "",
            calibration.item.artefact,
            "",
            "calibration",
            "",
            "",
            0,
            "",
            0,
        ]
        writer.writerow([*cells, f"{calibration.seconds / 60.0:.10g}", ""])
    return out.getvalue()


def sheet_markdown(sheet: RunSheet, experiment: Experiment, title: str) -> str:
    """The run sheet as Markdown: tables of the head, the styli and the order, then each position
    with a box for every reading.
    """
    fields = known_fields(experiment) | dict.fromkeys((*BLANKS, "page"), "")
    lines = [f"# {_cell(title)}", "", _cell(summary(sheet)), ""]
    lines += _table([["", ""], *([name, value] for name, value in fields.items())])
    lines += ["", *_table(stylus_rows(sheet, experiment)), ""]
    heads = ["position", "description", "set up", "probes", "balls", "readings", "before"]
    rows = [["", *(["start", "min"] if sheet.timed else []), *heads]]
    for number, step in enumerate(sheet.steps, 1):
        cells = [step.name, step.description, step.place, ", ".join(step.probes), step.balls]
        cells += [str(step.readings), step.change]
        rows.append([str(number), *(times(step) if sheet.timed else ()), *cells])
    lines += _table(rows)
    if sheet.calibration:
        items = [
            [calibration.name, price(calibration.seconds)] for calibration in sheet.calibration
        ]
        lines += ["", *_table([["calibration", "price"], *items])]
    for number, step in enumerate(sheet.steps, 1):
        if step.done:
            continue
        lines += ["", f"## ☐ {number}. {_cell(step.title)}", ""]
        lines += [f"- {key}: {_cell(text)}" for key, text in set_up_rows(step, experiment)]
        for probe, boxes in _boxes(step):
            marks = ", ".join(_cell(box.replace("[ ]", "☐")) for box in boxes)
            lines += ["", f"With {_cell(probe)}: {marks}"]
        lines += ["", *_table([list(NOTES), [""] * len(NOTES)])]
    return "\n".join(lines) + "\n"


def _table(rows: list[list[str]]) -> list[str]:
    """A table in Markdown, its first row the headings."""
    lines = [f"| {' | '.join(map(_cell, row))} |" for row in rows]
    return [lines[0], "|" + "---|" * len(rows[0]), *lines[1:]]


def _cell(text: str) -> str:
    return (
        in_one_line(text)
        .replace("\\", "\\\\")
        .replace("|", "\\|")
        .replace("<", "&lt;")
        .replace("*", "\\*")
    )
