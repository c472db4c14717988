"""A certificate as a page that needs no other file, to print on A4."""

from __future__ import annotations

from collections.abc import Sequence

from ballplate.presentation import escaped

from .certified_balls import NO_ACCREDITATION, CertifiedBalls

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
.small { color: #555; font-size: 0.9em; }
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
}
"""


def certificate_page(certificate: CertifiedBalls) -> str:
    """The certificate as a page of HTML: statement, facts, remarks, co-ordinates, distances."""
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
        f"<h2>Co-ordinates, U = {k} u</h2>{_table(certificate.coordinate_table(), 1)}",
        f"<h2>Distances, U = {k} u</h2>{_table(certificate.distance_table(), 2)}",
        f'<p class="small">{_of_distances(certificate)}</p>',
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
    note = (
        "Any distance and its uncertainty follow from co-ordinates and their covariance, which the"
        " forms .csv and .xml of this certificate have."
    )
    if len(certificate.distances) == count * (count - 1) // 2:
        return note
    return f"Some of the {count * (count - 1) // 2} distances. {note}"
