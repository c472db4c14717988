"""A run sheet as a page that needs no other file, to print on A4 and to tick off."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version

import numpy as np
from ballplate.presentation import escaped
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.geometry import ball_coordinates
from ballplate.simulator.inputs import number_of

from ..planning import RunSheet, Step, position_of, price, summary, times
from .reading_lists import sequence

# To be written in by hand: at the head of a sheet, and in each position.
BLANKS = ("machine", "operator", "date", "temperature, start", "temperature, end", "readings in")
NOTES = ("begun", "ended", "temperature", "remarks")

STYLE = """
:root { color-scheme: light; }
* { box-sizing: border-box; }
body { font: 15px/1.4 system-ui, "DejaVu Sans", sans-serif; color: #222; background: white;
  max-width: 58em; margin: 1.5em auto; padding: 0 1em; overflow-wrap: anywhere; }
h1 { font-size: 1.5em; margin: 0 0 0.3em; }
h2 { font-size: 1.15em; margin: 1.2em 0 0.4em; break-after: avoid; }
p { margin: 0.3em 0; }
.fields { display: grid; grid-template-columns: repeat(auto-fill, minmax(15em, 1fr));
  gap: 0.5em 1.5em; margin: 0.8em 0; padding: 0; }
.field { display: flex; gap: 0.5em; align-items: end; min-width: 0; }
.field b { font-weight: normal; color: #555; flex: none; }
.field span { flex: 1; border-bottom: 1px solid #999; min-height: 1.9em; min-width: 3em;
  display: flex; align-items: end; }
table { border-collapse: collapse; width: 100%; }
th { text-align: left; font-weight: normal; color: #555; }
td, th { padding: 0.2em 0.8em 0.2em 0; border-bottom: 1px solid #ddd; vertical-align: top;
  overflow-wrap: break-word; }
th { white-space: nowrap; }
tr { break-inside: avoid; }
.wide { overflow-x: auto; }
.step { border-top: 2px solid #222; padding: 0.6em 0 0.8em; margin-top: 1.2em;
  break-inside: avoid; }
.step.done { color: #777; }
.head { display: flex; gap: 0.8em; align-items: baseline; break-after: avoid; }
.head h2 { margin: 0; flex: 1; min-width: 0; }
.head h2 small { font-weight: normal; font-size: 0.85em; color: #555; }
.tick { flex: none; width: 1.2em; height: 1.2em; border: 1.5px solid #222; margin: 0;
  appearance: none; align-self: center; vertical-align: -0.2em; border-radius: 0; }
.tick:checked { background: #222; }
.time { flex: none; white-space: nowrap; }
.change { border: 1px solid #999; background: #eee; padding: 0.1em 0.5em; }
.words { display: grid; grid-template-columns: 6em 1fr; gap: 0.1em 0.8em; margin: 0.5em 0;
  break-inside: avoid; }
.words dt { color: #555; }
.words dd { margin: 0; }
.probe { margin: 0.5em 0 0.1em; break-after: avoid; }
ol.balls { list-style: none; margin: 0; padding: 0; display: grid;
  grid-template-columns: repeat(auto-fill, minmax(min(100%, var(--width)), 1fr));
  gap: 0.15em 0.6em; }
ol.balls i { display: inline-block; width: 0.8em; height: 0.8em; border: 1px solid #555;
  margin-right: 0.25em; vertical-align: -0.05em; }
@media print {
  body { margin: 0; padding: 0; max-width: none; font-size: 10pt; }
  td { overflow-wrap: anywhere; }
  .fields { grid-template-columns: repeat(3, 1fr); }
  .step .fields { grid-template-columns: 1fr 1fr 1fr 2fr; }
  .wide { overflow: visible; }
  .change { background: none; }
}
"""


def sheet_page(sheet: RunSheet, experiment: Experiment, title: str) -> str:
    """The run sheet as a page of HTML: the head, the order, styli, and each position."""
    steps = list(enumerate(sheet.steps, 1))
    timed = ["start", "min"] if sheet.timed else []
    rows = [
        [
            str(number),
            step.title,
            ", ".join(step.probes),
            str(step.readings),
            *(times(step) if timed else ()),
        ]
        for number, step in steps
    ]
    parts = [
        f"<h1>{escaped(title)}</h1>",
        f"<p>{escaped(summary(sheet))}</p>",
        _fields(dict.fromkeys(BLANKS, "") | known_fields(experiment)),
        "<h2>Order of positions</h2>",
        _table(["", "position", "probes", "readings", *timed], rows),
        "<h2>Styli</h2>",
        _table(*_styli(sheet, experiment)),
        *(_step(number, step, sheet, experiment) for number, step in steps),
    ]
    if sheet.calibration:
        rows = [[item.name, price(item.seconds)] for item in sheet.calibration]
        parts += ["<h2>Calibration</h2>", _table(["item", "price"], rows)]
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escaped(title)}</title><style>{STYLE}{_page_margins(title)}</style></head>\n"
        "<body>\n" + "\n".join(parts) + "\n</body></html>\n"
    )


def _page_margins(title: str) -> str:
    """The title and the page's number in the margin of each page that is printed."""
    # Anything but plain letters might end the text or the style that it stands in.
    title_text = "".join(
        character
        if character.isascii() and character.isalnum() or character == " "
        else f"\\{ord(character):x} "
        for character in title[:80]
    )
    style = "font: 9pt sans-serif; color: #555;"
    return (
        "@page { size: A4; margin: 14mm 14mm 16mm;\n"
        f'  @bottom-left {{ content: "{title_text}"; {style} }}\n'
        f'  @bottom-right {{ content: "page " counter(page) " of " counter(pages); {style} }} }}\n'
    )


def _fields(fields: dict[str, str]) -> str:
    cells = [
        f'<div class="field"><b>{escaped(name)}</b><span>{escaped(value)}</span></div>'
        for name, value in fields.items()
    ]
    return f'<div class="fields">{"".join(cells)}</div>'


def known_fields(experiment: Experiment) -> dict[str, str]:
    """Return the fields with known values."""
    machine, volume = experiment.machine, experiment.machine.volume
    size = " x ".join(f"{1e3 * length:.6g}" for length in volume.size)
    noise = sorted({f"{1e6 * deviation:.4g}" for deviation in machine.repeatability}, key=float)
    variant = f", {experiment.name}" if experiment.name else ""
    return {
        "file": f"{experiment.source.name}{variant}",
        "written by": f"ballplate {version('ballplate')}",
        "volume": f"{size} mm",
        "repeatability": f"{' to '.join(dict.fromkeys((noise[0], noise[-1])))} µm",
    }


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = "".join(
        f"<tr>{''.join(f'<td>{escaped(cell)}</td>' for cell in row)}</tr>" for row in rows
    )
    titles = "".join(f'<th scope="col">{head}</th>' for head in heads)
    return f'<div class="wide"><table><tr>{titles}</tr>{lines}</table></div>'


def _styli(sheet: RunSheet, experiment: Experiment) -> tuple[list[str], list[list[str]]]:
    """Headings and rows of the probes that a sheet uses: offsets, the angles A and B of an
    articulating head, stated or to fill in, and the diameters to fill in.
    """
    used = {probe for step in sheet.steps for probe in step.probes}
    rows = []
    for probe in (probe for name, probe in experiment.probes.items() if name in used):
        lengths = [f"{1e3 * length:.6g}" for length in probe.offset]
        angles = [f"{np.degrees(angle):.4g}°" for angle in probe.angles or ()]
        rows.append([probe.name, *lengths, ", ".join(angles), ""])
    axes = [f"{axis}, mm" for axis in "xyz"[: experiment.dimension]]
    return ["probe", *axes, "A, B of the head", "diameter of the tip"], rows


def _step(number: int, step: Step, sheet: RunSheet, experiment: Experiment) -> str:
    description = f" <small>{escaped(step.description)}</small>" if step.description else ""
    checked = " checked" if step.done else ""
    state = "done" if step.done else "start {}, {} min".format(*times(step)) if sheet.timed else ""
    change = (
        f'<p class="change">First change {escaped(step.change)}'
        f"{f' ({price(step.change_seconds)})' if sheet.timed else ''}</p>"
        if step.change
        else ""
    )
    rows = _set_up(step, experiment)
    items = "".join(f"<dt>{key}</dt><dd>{escaped(value)}</dd>" for key, value in rows)
    kind = "step done" if step.done else "step"
    body = ""
    if not step.done:
        body = f'<dl class="words">{items}</dl>{_readings(step)}{_fields(dict.fromkeys(NOTES, ""))}'
    return (
        f'<section class="{kind}"><div class="head">'
        f'<input type="checkbox" class="tick" aria-label="position {number} done"{checked}>'
        f"<h2>{number}. {escaped(step.name)}{description}</h2>"
        f'<div class="time">{state}</div></div>{change}'
        f"{body}</section>"
    )


def _readings(step: Step) -> str:
    """A box for every reading of a step, by probe."""
    parts = []
    for probe, balls in sequence(step):
        longest = max(len(name) + 2 * repeats for name, _, repeats in balls)
        items = "".join(
            f"<li>{'<i></i>' * repeats}{escaped(name)}</li>" for name, _, repeats in balls
        )
        readings = sum(repeats for *_, repeats in balls)
        parts.append(
            '<p class="probe"><input type="checkbox" class="tick"'
            f' aria-label="{escaped(probe)} read"> with <b>{escaped(probe)}</b>,'
            f" {number_of(readings, 'reading')}</p>"
            f'<ol class="balls" style="--width: {0.6 * longest + 1.5:.1f}em">{items}</ol>'
        )
    return "".join(parts)


def _set_up(step: Step, experiment: Experiment) -> list[tuple[str, str]]:
    """Return the set-up of a position: the artefact if there are several, its location, machine
    co-ordinates of its first and last ball, and the balls to read.
    """
    item = position_of(step.candidate)
    layout = experiment.layouts[item.artefact]
    centres = 1e3 * ball_coordinates(item.pose, layout)
    places = []
    for k in dict.fromkeys((0, len(layout.names) - 1)):
        numbers = ", ".join(f"{value + 0.0:.6g}" for value in np.round(centres[k], 3))
        places.append(f"ball {layout.names[k]} is at ({numbers}) mm")
    rows = [
        ("artefact", step.artefact),
        ("set up", step.place),
        ("so that", " and ".join(places)),
        ("read", f"{step.balls}; {number_of(step.readings, 'reading')}"),
    ]
    return rows if len(experiment.artefacts) > 1 else rows[1:]
