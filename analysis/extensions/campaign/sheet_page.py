"""A run sheet as a page that needs no other file, to print on A4 and to tick off."""

from __future__ import annotations

from dataclasses import replace

from ballplate.planning import RunSheet, Step, price, summary, times
from ballplate.presentation import escaped
from ballplate.simulator.experiment import Experiment, Position, lay_out, with_chosen
from ballplate.simulator.geometry import BallLayout
from ballplate.simulator.inputs import number_of

from .reading_lists import sequence
from .sheet_drawings import LONGEST_NAME, artefact_drawing, volume_drawing
from .sheet_head import BLANKS, NOTES, known_fields, stylus_rows
from .sheet_words import set_up_rows

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
td.number, th.number { text-align: right; white-space: nowrap; }
td.name { font-weight: bold; }
th { white-space: nowrap; }
tr { break-inside: avoid; }
.wide { overflow-x: auto; }
.pictures { display: flex; flex-wrap: wrap; gap: 1em; }
figure { margin: 0; max-width: 100%; break-inside: avoid; }
figcaption { color: #555; }
svg { display: block; max-width: 100%; height: auto; }
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
  svg.volume { max-height: 112mm; }
}
"""


def sheet_page(sheet: RunSheet, experiment: Experiment, title: str) -> str:
    """The run sheet as a page of HTML: the head, styli, artefacts, the volume, the order, and each
    position.

    `experiment` has the artefacts and the volume.
    """
    parts = [
        f"<h1>{escaped(title)}</h1>",
        f"<p>{escaped(summary(sheet))}</p>",
        _fields(dict.fromkeys(BLANKS, "") | known_fields(experiment)),
        _order(sheet),
        _styli(sheet, experiment),
        _pictures(sheet, experiment),
    ]
    parts += [_step(number, step, sheet, experiment) for number, step in enumerate(sheet.steps, 1)]
    if sheet.calibration:
        items = [
            f"<td>{escaped(calibration.name)}</td><td>{price(calibration.seconds)}</td>"
            for calibration in sheet.calibration
        ]
        rows = "".join(f"<tr>{item}</tr>" for item in items)
        parts.append(
            f"<h2>Calibration</h2><table><tr><th>item</th><th>price</th></tr>{rows}</table>"
        )
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escaped(title)}</title><style>{STYLE}{_page_margins(title)}</style></head>\n"
        "<body>\n" + "\n".join(part for part in parts if part) + "\n</body></html>\n"
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


def _order(sheet: RunSheet) -> str:
    heads = ["", "position", "probes", "readings", *(["start", "min"] if sheet.timed else [])]
    rows = []
    for number, step in enumerate(sheet.steps, 1):
        description = f"<br>{escaped(step.description)}" if step.description else ""
        cells = [
            f'<td class="number">{number}</td>',
            f"<td><b>{escaped(step.name)}</b>{description}</td>",
            f"<td>{escaped(', '.join(step.probes))}</td>",
            f'<td class="number">{step.readings}</td>',
        ]
        if sheet.timed:
            cells += [f'<td class="number">{text}</td>' for text in times(step)]
        rows.append(f"<tr>{''.join(cells)}</tr>")
    return f"<h2>Order of positions</h2>{_table(heads, rows, {0, 3, 4, 5})}"


def _table(heads: list[str], rows: list[str], numbers: set[int]) -> str:
    cells = [
        f'<th scope="col" class="number">{head}</th>'
        if k in numbers
        else f'<th scope="col">{head}</th>'
        for k, head in enumerate(heads)
    ]
    return f'<div class="wide"><table><tr>{"".join(cells)}</tr>{"".join(rows)}</table></div>'


def _styli(sheet: RunSheet, experiment: Experiment) -> str:
    heads, *styli = stylus_rows(sheet, experiment)
    blanks = ["diameter of the tip"]
    mounting = ""
    if "A" not in heads:
        blanks = ["A, B of the head", *blanks]
        mounting = " The head's own angles depend on how it is mounted."
    numbers = set(range(1, len(heads)))
    rows = [
        f'<tr><td class="name">{escaped(row[0])}</td>'
        + "".join(f'<td class="number">{text}</td>' for text in row[1:])
        + "<td></td>" * len(blanks)
        + "</tr>"
        for row in styli
    ]
    table = f"<h2>Styli</h2>{_table([*heads, *blanks], rows, numbers)}"
    of_axes = "the offset of the tip from the reference point, the angle of its direction from"
    if experiment.dimension == 2:
        return table
    return (
        f"{table}<p><small>For each probe {of_axes} straight down, and from +x towards +y seen from"
        f" above.{mounting}</small></p>"
    )


def _pictures(sheet: RunSheet, experiment: Experiment) -> str:
    """The artefacts that are read, and the volume."""
    figures = []
    todo = [step for step in sheet.steps if not step.done]
    for name in dict.fromkeys(step.artefact for step in todo):
        first_step = next(step for step in todo if step.artefact == name)
        order = [k for _, balls in list(sequence(first_step))[:1] for _, k, _ in balls]
        figures.append(
            f"<figure>{artefact_drawing(name, experiment.layouts[name], order)}"
            f"<figcaption>{escaped(name)}, seen from the side that its z points to; the line is the"
            f" order of reading, from the dark ball on{_numbered(experiment.layouts[name])}"
            "</figcaption></figure>"
        )
    pictures = (
        f'<h2>Artefacts</h2><div class="pictures">{"".join(figures)}</div>' if figures else ""
    )
    positions = [picture for picture in sheet.written if isinstance(picture.item, Position)]
    if not positions:
        return pictures
    # Where things stand does not depend on what disturbs their readings.
    design = lay_out(with_chosen(replace(experiment, influences=()), positions))
    numbers = {step.name: str(number) for number, step in enumerate(sheet.steps, 1)}
    names = {
        name: name if len(name) <= LONGEST_NAME else number for name, number in numbers.items()
    }
    more = "; a number replaces a long name" if set(names.values()) != set(names) else ""
    return (
        f"{pictures}<h2>Positions in the volume</h2><figure>{volume_drawing(design, names)}"
        f"<figcaption>the dot is the first ball of each position{more}</figcaption></figure>"
    )


def _numbered(layout: BallLayout) -> str:
    """Return the remark on numbers in place of long ball names."""
    is_long = max(map(len, layout.names)) > LONGEST_NAME
    return "; numbers follow the artefact's list of balls" if is_long else ""


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
    rows = set_up_rows(step, experiment)
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
