"""A certificate as a page that needs no other file, to print on A4."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np
from ballplate.presentation import escaped, number, on_paper, pitch
from ballplate.simulator.geometry import fit_motion
from ballplate.simulator.machines import Array

from .certificate_csv import coordinate_names
from .certified_balls import NO_ACCREDITATION, CertifiedBalls

# Of more co-ordinates the page refers to the other forms for their covariance.
MOST_IN_TABLE = 75

SIZE, MARGIN = 560.0, 46.0
# Of so many balls each is named, and so long are the longest deviations drawn beside their spacing.
MOST_NAMED = 49
LONGEST = 0.3

STYLE = """
:root { color-scheme: light; }
* { box-sizing: border-box; }
body { font: 15px/1.45 system-ui, "DejaVu Sans", sans-serif; color: #222; background: white;
  max-width: 62em; margin: 1.5em auto; padding: 0 1em; overflow-wrap: anywhere; }
h1 { font-size: 1.5em; margin: 0 0 0.4em; }
h2 { font-size: 1.15em; margin: 1.4em 0 0.4em; break-after: avoid; }
p { margin: 0.4em 0; }
.statement { border: 1px solid #999; padding: 0.5em 0.8em; }
.remarks { border-left: 3px solid #d55e01; padding: 0.1em 0.8em; margin: 0.8em 0; }
dl { display: grid; grid-template-columns: minmax(7em, auto) 1fr; gap: 0.2em 1em; margin: 1em 0; }
dt { color: #555; }
dd { margin: 0; }
table { border-collapse: collapse; }
th { text-align: right; font-weight: normal; color: #555; }
td, th { padding: 0.15em 0 0.15em 1.2em; border-bottom: 1px solid #ddd; white-space: nowrap;
  text-align: right; font-variant-numeric: tabular-nums; }
td.name, th.name { text-align: left; padding-left: 0; padding-right: 0.6em; }
tr { break-inside: avoid; }
thead { display: table-header-group; }
.wide { overflow-x: auto; }
figure { margin: 0; break-inside: avoid; }
figcaption, .small { color: #555; font-size: 0.9em; }
svg { display: block; max-width: 100%; max-height: 38em; }
pre { font-size: 11px; overflow-x: auto; border: 1px solid #ddd; padding: 0.5em; margin: 0.4em 0; }
@media (max-width: 40em) {
  dl { display: block; }
  dd { margin: 0 0 0.5em; }
  td, th { padding-left: 0.8em; }
}
@media print {
  @page { size: A4; margin: 14mm; }
  body { margin: 0; padding: 0; max-width: none; font-size: 10pt; }
  .wide { overflow: visible; }
  td, th { padding-left: 0.8em; }
  svg { max-height: 130mm; }
  pre { font-size: 4.2pt; white-space: pre-wrap; overflow: visible; }
}
"""


def certificate_page(certificate: CertifiedBalls) -> str:
    """The certificate as a page of HTML: statement, facts, remarks, a drawing, co-ordinates,
    distances, covariance.
    """
    title = f"Ball co-ordinates of {certificate.artefact}"
    remarks = "".join(f"<p>{escaped(text)}</p>" for text in certificate.remarks)
    facts = "".join(
        f"<dt>{escaped(key)}</dt><dd>{escaped(text)}</dd>"
        for key, text in certificate.facts.items()
    )
    k = f"{certificate.coverage_factor:g}"
    parts = [
        f"<h1>{escaped(title)}</h1>",
        f'<p class="statement">{escaped(NO_ACCREDITATION)}</p>',
        f"<dl>{facts}</dl>",
        f'<div class="remarks"><h2>Remarks</h2>{remarks}</div>' if remarks else "",
        _drawing(certificate),
        f"<h2>Co-ordinates, U = {k} u</h2>{_table(certificate.coordinate_table(), 1)}",
        f"<h2>Distances, U = {k} u</h2>{_table(certificate.distance_table(), 2)}",
        f'<p class="small">{_of_distances(certificate)}</p>',
        "<h2>Covariance of the co-ordinates, µm²</h2>",
        _covariance(certificate),
    ]
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escaped(title)}</title><style>{STYLE}</style></head>\n"
        "<body>\n" + "\n".join(part for part in parts if part) + "\n</body></html>\n"
    )


def _table(rows: Sequence[Sequence[str]], names: int) -> str:
    """Rows below a line of headings, of which the first cells are names."""

    def cells(row: Sequence[str], kind: str) -> str:
        start = f'{kind} scope="col"' if kind == "th" else kind
        kinds = [f'{start} class="name"' if k < names else start for k in range(len(row))]
        return "".join(
            f"<{column_kind}>{escaped(cell)}</{kind}>"
            for column_kind, cell in zip(kinds, row, strict=True)
        )

    head, *body = rows
    lines = "".join(f"<tr>{cells(row, 'td')}</tr>\n" for row in body)
    return (
        f'<div class="wide"><table><thead><tr>{cells(head, "th")}</tr></thead>'
        f"<tbody>\n{lines}</tbody></table></div>"
    )


def _of_distances(certificate: CertifiedBalls) -> str:
    count = len(certificate.names)
    note = "Any distance and its uncertainty follow from co-ordinates and covariance."
    if len(certificate.distances) == count * (count - 1) // 2:
        return note
    return f"Some of the {count * (count - 1) // 2} distances, between balls far apart. {note}"


def _covariance(certificate: CertifiedBalls) -> str:
    names = coordinate_names(certificate)
    if len(names) > MOST_IN_TABLE:
        return (
            f"<p>The covariance of {len(names)} co-ordinates is part of the forms .csv, .xml and"
            " .json of this certificate.</p>"
        )
    rows = [
        f"{name},{','.join(f'{value:.4g}' for value in row)}"
        for name, row in zip(names, (1e12 * certificate.covariance).tolist(), strict=True)
    ]
    text = "\n".join([f"covariance_um2,{','.join(names)}", *rows])
    note = "To four digits; the forms .csv, .xml and .json of this certificate have all."
    return f'<pre>{escape(text)}</pre><p class="small">{note}</p>'


def _drawing(certificate: CertifiedBalls) -> str:
    """The balls, how far they are from where they are drawn, magnified, and U of both
    co-ordinates.
    """
    drawn = certificate.drawn[:, :2]
    apart = _aligned(certificate.coordinates[:, :2], drawn)
    u = certificate.coverage_factor * certificate.standard_uncertainties[:, :2]
    lower, size = drawn.min(axis=0), np.ptp(drawn, axis=0)
    scale = (SIZE - 2 * MARGIN) / (float(size.max()) or 1.0)
    largest = float((np.linalg.norm(apart, axis=1) + u.max(axis=1)).max())
    times = _rounded_down(LONGEST * pitch(drawn) / largest) if largest > 0.0 else 1.0
    height = scale * float(size[1]) + 2 * MARGIN
    places = on_paper(drawn, lower, scale, MARGIN, height)
    shifts = scale * times * apart * [1.0, -1.0]
    radii = scale * times * u
    parts = [
        f'<svg viewBox="0 0 {SIZE:g} {height:.0f}" role="img" font-family="sans-serif"'
        ' aria-label="Deviations of the balls from the drawing, with their uncertainties">'
    ]
    for name, (x, y), (dx, dy), (a, b) in zip(
        certificate.names, places.tolist(), shifts.tolist(), radii.tolist(), strict=True
    ):
        parts.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5" fill="none" stroke="#777"/>'
            f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{x + dx:.2f}" y2="{y + dy:.2f}"'
            ' stroke="#0a72b1" stroke-width="1.5"/>'
            f'<ellipse cx="{x + dx:.2f}" cy="{y + dy:.2f}" rx="{a:.2f}" ry="{b:.2f}"'
            ' fill="#d55e01" fill-opacity="0.15" stroke="#d55e01" stroke-width="1"/>'
        )
        if len(places) <= MOST_NAMED:
            parts.append(
                f'<text x="{x:.1f}" y="{y + 16:.1f}" font-size="9" text-anchor="middle"'
                f' fill="#555">{escaped(name)}</text>'
            )
    longest = number(1e6 * np.linalg.norm(apart, axis=1).max(), 3)
    return (
        f"<figure>{''.join(parts)}</svg><figcaption>From the drawing to where each ball is, the"
        " plate shifted and turned so that these are smallest, and U of x and y in the axes of the"
        f" certificate, both {times:,.0f} times as large; the longest line is {longest} µm."
        "</figcaption></figure>"
    )


def _aligned(places: Array, drawn: Array) -> Array:
    """Deviations (n, 2) from the drawing, less what a shift and a turn explain."""
    rotation, shift = fit_motion(places, drawn)
    return places @ rotation.T + shift - drawn


def _rounded_down(value: float) -> float:
    """The largest number of one digit that is not above a value.

    >>> _rounded_down(199.0), _rounded_down(0.37)
    (100.0, 0.3)
    """
    power = 10.0 ** np.floor(np.log10(value))
    return float(f"{np.floor(value / power) * power:.1g}")
