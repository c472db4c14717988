"""Section on errors and positions: how much of each error's information goes with each position."""

from __future__ import annotations

from collections.abc import Sequence

from .elements import Html, element, joined, note, scrolling
from .quoted import QuotedData

SHADES = 8
WORDS = (
    "Percent of an error's information: 1 - u²/u²(without the position); u is the root mean square"
    " along the error's axis. Darker is more. Without the position, an error marked all is"
    " undetermined; one marked – is undetermined with all positions."
)


def information_section(information: QuotedData) -> Html:
    """Section with the table of errors by positions, and the motions that hide errors."""
    positions = list(information.at("positions").each())
    heads = [element("th", "error", scope="col", class_="words"), element("th", "u", scope="col")]
    heads += [element("th", position.text("name"), scope="col") for position in positions]
    rows = [element("tr", *heads)]
    rows.append(_head_row("readings", "", [position.number("readings") for position in positions]))
    if any(position.data["minutes"] is not None for position in positions):
        minutes = (
            "" if position.data["minutes"] is None else position.number("minutes", digits=2)
            for position in positions
        )
        rows.append(_head_row("minutes", "", list(minutes)))
    u6 = [position.micro("average", digits=3) for position in positions]
    rows.append(_head_row("U6 without it, µm", information.micro("average", digits=3), u6))
    body = [_error_row(error, positions) for error in information.at("errors").each()]
    parts = element("thead", *rows, class_="tall"), element("tbody", *body)
    caption = "Information of each error that goes with each position, %"
    table = scrolling("table-errors", caption, *parts, class_="tight")
    return joined([table, note(WORDS), _hidden(information)])


def _head_row(words: str, whole: str, cells: Sequence[str]) -> Html:
    first = element("th", words, scope="row", class_="words")
    return element("tr", first, *(element("td", cell) for cell in (whole, *cells)))


def _error_row(error: QuotedData, positions: list[QuotedData]) -> Html:
    u, unit = error.amount("standard_uncertainty", "unit")
    shown = u if error.data["standard_uncertainty"] is None else joined([u, f" {unit}"])
    first = element("th", error.text("name"), scope="row", title=error.data["meaning"])
    cells = [element("td", shown)]
    for position in positions:
        name = position.data["name"]
        share = error.data["information"][name]
        if share is None:
            cells.append(element("td", "–", class_="open"))
        elif name in error.data["undetermined_without"]:
            cells.append(element("td", "all", class_="heat deficient"))
        else:
            number = error.at("information").number(name, factor=100.0, digits=2)
            shade = min(int(SHADES * share), SHADES - 1)
            cells.append(element("td", number, class_=f"heat heat-{shade}"))
    return element("tr", first, *cells)


def _hidden(information: QuotedData) -> Html:
    """Return the errors that directions hide, alike ones together."""
    groups: dict[tuple[bool, tuple[int, ...]], list[Html]] = {}
    for error in information.at("errors").each():
        kind = error.data["standard_uncertainty"] is None, tuple(error.data["hidden_by"])
        groups.setdefault(kind, []).append(error.text("name"))
    items = []
    for (is_undetermined, hidden_by), names in groups.items():
        if hidden_by:
            word = "undetermined" if is_undetermined else "weak"
            motions = joined((information.at("directions").text(k) for k in hidden_by), "; or of ")
            words = joined(names, ", "), f": {word}, hidden by motions of ", motions
            items.append(element("li", *words))
    return element("ul", *items) if items else Html()
