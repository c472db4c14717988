"""Section on errors and positions: how much of each error's information goes with each position."""

from __future__ import annotations

from .elements import Html, element, joined, note, table
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
    rows = [
        ["readings", "", *(position.number("readings") for position in positions)],
        ["minutes", "", *(position.number("minutes", digits=2) for position in positions)],
        ["U6 without it, µm", *(part.micro("average") for part in (information, *positions))],
    ]
    if all(position.data["minutes"] is None for position in positions):
        del rows[1]
    for k, error in enumerate(information.at("errors").each()):
        u, unit = error.amount("standard_uncertainty", "unit")
        cells = (_cell(information, k, j) for j in range(len(positions)))
        rows.append([f"{error.data['name']}, {unit}", u, *cells])
    caption = "Information of each error that goes with each position, %"
    parts = [table("errors", caption, ["", "u", *(p.data["name"] for p in positions)], rows)]
    for group in information.at("hidden").each():
        names = joined((name.text() for name in group.at("errors").each()), ", ")
        directions = joined((one.text() for one in group.at("directions").each()), "; ")
        parts.append(element("p", names, ": ", directions, "."))
    return joined([*parts, note(WORDS)])


def _cell(information: QuotedData, k: int, j: int) -> Html:
    """Return the cell of an error and a position, shaded by its part."""
    part = information.at("information", k, j)
    if part.data is None:
        return element("span", "–", class_="part")
    if information.data["undetermined_without"][k][j]:
        return element("span", "all", class_="part deficient")
    shade = min(int(SHADES * part.data), SHADES - 1)
    return element("span", part.number(factor=100.0, digits=2), class_=f"part heat-{shade}")
