"""A run sheet as text, CSV, Markdown, JSON data, and a page to print and tick off."""

from __future__ import annotations

import io
from typing import Any

from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.messages import in_one_line
from ballplate.simulator.inputs.quantities import format_duration
from ballplate.simulator.inputs.spreadsheets import CsvWriter

from ..presentation.formatting import aligned
from .drawings import escaped, place_drawing
from .schedule import RunSheet, Step

COLUMNS = (
    "step",
    "done",
    "name",
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

STYLE = """
body { font: 15px/1.4 system-ui, sans-serif; color: #222; max-width: 60em;
  margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.4em; margin-bottom: 0.2em; }
.step { display: flex; gap: 1em; border-top: 1px solid #999; padding: 0.7em 0;
  break-inside: avoid; }
.step.done { color: #777; }
.tick { flex: none; width: 1.3em; height: 1.3em; border: 1.5px solid #222;
  margin-top: 0.15em; appearance: none; }
.tick:checked { background: #222; }
.words { flex: 1; min-width: 0; overflow-wrap: anywhere; }
.words h2 { font-size: 1.05em; margin: 0; }
.words dl { display: grid; grid-template-columns: 7em 1fr; gap: 0.1em 1em; margin: 0.4em 0 0; }
.words dt { color: #555; }
.words dd { margin: 0; }
.words ul { list-style: none; margin: 0; padding: 0; display: flex; flex-wrap: wrap; gap: 0 1.2em; }
.time { flex: none; width: 6em; text-align: right; }
.change { background: #eee; padding: 0.1em 0.5em; }
svg { flex: none; width: 170px; height: 170px; }
table { border-collapse: collapse; } td, th { text-align: left; padding: 0.1em 1.5em 0.1em 0; }
@media print {
  body { margin: 0; max-width: none; font-size: 11pt; }
  .change { background: none; border: 1px solid #999; }
  @page { margin: 15mm; }
}
"""


def summary(sheet: RunSheet) -> str:
    """What there is to do, in a sentence."""
    todo = [step for step in sheet.steps if not step.done]
    done = len(sheet.steps) - len(todo)
    words = [_count(len(todo), "position"), _count(sum(step.readings for step in todo), "reading")]
    words += (
        [_count(len(sheet.calibration), "item") + " of calibration"] if sheet.calibration else []
    )
    text = f"{', '.join(words)}: {sheet.hours:.2f} h"
    change = sum(step.change_seconds for step in todo)
    text += f", including change-over {change / 3600.0:.2f} h" if change else ""
    return f"{text}; {_count(done, 'position')} done before" if done else text


def sheet_lines(sheet: RunSheet) -> list[str]:
    """The run sheet as lines of text."""
    rows = [["", "start", "min", "position", "probes", "balls", "readings"]]
    for number, step in enumerate(sheet.steps, 1):
        cells = [step.name, ", ".join(step.probes), step.balls, str(step.readings)]
        rows.append([str(number), *_times(step), *cells])
    lines = aligned(rows, [True, True, True, False, False, False, True]) if sheet.steps else []
    lines += [
        f"{number} {step.name}: {_words(step)}"
        for number, step in enumerate(sheet.steps, 1)
        if not step.done
    ]
    lines += [f"calibration {one.name}: {_price(one.seconds)}" for one in sheet.calibration]
    return [in_one_line(line) for line in (*lines, summary(sheet))]


def sheet_csv(sheet: RunSheet) -> str:
    """The run sheet as CSV with a header; minutes are decimal numbers, of items of calibration
    their price.
    """
    out = io.StringIO()
    writer = CsvWriter(out)
    writer.writerow(COLUMNS)
    for number, step in enumerate(sheet.steps, 1):
        writer.writerow(
            (
                number,
                "yes" if step.done else "no",
                step.name,
                step.artefact,
                step.plane,
                step.place,
                " ".join(step.probes),
                step.balls,
                step.readings,
                step.change,
                f"{step.change_seconds / 60.0:.10g}",
                f"{step.seconds / 60.0:.10g}",
                "" if step.done else f"{step.start / 60.0:.10g}",
            )
        )
    for one in sheet.calibration:
        minutes = f"{one.seconds / 60.0:.10g}"
        writer.writerow(
            ["", "", one.name, one.item.artefact, "", "calibration", "", "", 0, "", 0, minutes, ""]
        )
    return out.getvalue()


def sheet_markdown(sheet: RunSheet, title: str) -> str:
    """The run sheet as Markdown, a table under a heading."""
    lines = [f"# {_cell(title)}", "", _cell(summary(sheet)), ""]
    lines += [
        "| | start | min | position | set up | probes | balls | readings | before |",
        "|" + "---|" * 9,
    ]
    for number, step in enumerate(sheet.steps, 1):
        cells = [
            str(number),
            *_times(step),
            step.name,
            step.place,
            ", ".join(step.probes),
            step.balls,
            str(step.readings),
            step.change,
        ]
        lines.append(f"| {' | '.join(map(_cell, cells))} |")
    if sheet.calibration:
        lines += ["", "| calibration | price |", "|---|---|"]
        lines += [f"| {_cell(one.name)} | {_price(one.seconds)} |" for one in sheet.calibration]
    return "\n".join(lines) + "\n"


def sheet_data(sheet: RunSheet) -> dict[str, Any]:
    """The run sheet as plain data, times in seconds."""
    return {
        "steps": [
            {
                "name": step.name,
                "done": step.done,
                "artefact": step.artefact,
                "plane": step.plane or None,
                "set_up": step.place,
                "probes": list(step.probes),
                "balls": step.balls,
                "readings": step.readings,
                "change": step.change or None,
                "change_seconds": step.change_seconds,
                "seconds": step.seconds,
                "start": step.start,
            }
            for step in sheet.steps
        ],
        "calibration": [{"name": one.name, "seconds": one.seconds} for one in sheet.calibration],
        "seconds": sheet.seconds,
    }


def sheet_page(sheet: RunSheet, experiment: Experiment, title: str) -> str:
    """The run sheet as a page of HTML that needs no other file: to print and to tick off, with a
    drawing of each place.

    `experiment` has the artefacts and the volume.
    """
    parts = [f"<h1>{escaped(title)}</h1>", f"<p>{escaped(summary(sheet))}</p>"]
    for number, step in enumerate(sheet.steps, 1):
        parts.append(_step(number, step, experiment))
    if sheet.calibration:
        items = [
            f"<td>{escaped(one.name)}</td><td>{_price(one.seconds)}</td>"
            for one in sheet.calibration
        ]
        rows = "".join(f"<tr>{item}</tr>" for item in items)
        parts.append(
            f"<h2>Calibration</h2><table><tr><th>item</th><th>price</th></tr>{rows}</table>"
        )
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta'
        f' charset="utf-8"><title>{escaped(title)}</title><style>{STYLE}</style></head>\n<body>\n'
        + "\n".join(parts)
        + "\n</body></html>\n"
    )


def _step(number: int, step: Step, experiment: Experiment) -> str:
    probes = "".join(
        f'<li><input type="checkbox" class="tick" aria-label="{escaped(probe)} read">'
        f" {escaped(probe)}</li>"
        for probe in step.probes
    )
    change = (
        f'<p class="change">First change {escaped(step.change)} ({_price(step.change_seconds)})</p>'
    )
    times = "done" if step.done else "{}<br>{} min".format(*_times(step))
    rows = [
        ("artefact", escaped(step.artefact)),
        ("set up", escaped(step.place)),
        ("probes", f"<ul>{probes}</ul>" if len(step.probes) > 1 else escaped(step.probes[0])),
        ("balls", f"{escaped(step.balls)}; {_count(step.readings, 'reading')}"),
    ]
    if len(experiment.artefacts) < 2:
        rows = rows[1:]
    checked = " checked" if step.done else ""
    return (
        f'<section class="step{" done" if step.done else ""}">'
        f'<input type="checkbox" class="tick" aria-label="position {number} done"{checked}><div'
        ' class="words">'
        f"<h2>{number}. {escaped(step.name)}</h2>{change if step.change else ''}"
        f"<dl>{''.join(f'<dt>{key}</dt><dd>{value}</dd>' for key, value in rows)}</dl></div>"
        f"{place_drawing(step.candidate, experiment)}"
        f'<div class="time">{times}</div></section>'
    )


def _words(step: Step) -> str:
    change = f"change {step.change} ({_price(step.change_seconds)}); " if step.change else ""
    return f"{change}{step.place}"


def _times(step: Step) -> tuple[str, str]:
    """When a step begins, in hours and minutes, and how many minutes it takes."""
    if step.done:
        return "done", ""
    hours, minutes = divmod(round(step.start / 60.0), 60)
    return f"{hours}:{minutes:02d}", f"{(step.seconds + step.change_seconds) / 60.0:.0f}"


def _price(seconds: float) -> str:
    return format_duration(round(seconds, 3))


def _count(number: int, word: str) -> str:
    return f"{number} {word}{'' if number == 1 else 's'}"


def _cell(text: str) -> str:
    return (
        in_one_line(text)
        .replace("\\", "\\\\")
        .replace("|", "\\|")
        .replace("<", "&lt;")
        .replace("*", "\\*")
    )
