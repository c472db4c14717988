"""The page of a part: the part in the volume, and its dimensions by share of tolerance."""

from __future__ import annotations

import numpy as np
from ballplate.presentation import Data
from ballplate.simulator.design import Design
from ballplate.simulator.inputs import Array
from ballplate.uncertainty import Quantity

from ..pages.charts import legend
from ..pages.design_views import volume_layers
from ..pages.document import Page, PageSection, introduction, written
from ..pages.elements import Html, element, joined, note, sentence, table
from ..pages.spatial import Layer, SpatialPicture, still_figure
from .part_result import DimensionUncertainty, PartUncertainty, share_words
from .part_uncertainty import part_uncertainty
from .part_values import LaidPart

FOOT = (
    "u are standard uncertainties, U expanded ones for 95 %. What standards require is not checked"
    " here, and nothing on this page claims conformity with them."
)
# Width of the bars, in units of the picture.
WIDTH = 240.0


def part_page(found: PartUncertainty) -> str:
    """Return the page as a file that needs no other."""
    top = introduction(sentence(f"{found.headline()}."), found.is_held, found.label)
    conditions = joined(note(line) for line in found.qualified)
    return written(Page(found.title, joined([top, conditions]), part_sections(found), FOOT))


def part_sections(found: PartUncertainty) -> list[PageSection]:
    """Return the sections of a part's dimensions."""
    return [
        PageSection("part", "The part in the volume", still_figure(part_view(found.laid))),
        PageSection("shares", "Uncertainty by share of the tolerance", _shares(found)),
        PageSection("dimensions", "Dimensions", _dimensions(found)),
        PageSection("read", "How to read it", joined(map(sentence, found.explained))),
    ]


def sections_of_part(design: Design, quantity: Quantity) -> list[PageSection]:
    """Return the sections of the part of a design for its page."""
    return part_sections(part_uncertainty(design, quantity))


def part_for_studio(design: Design, quantity: Quantity) -> Data:
    """Return boxes (k, 8, 3) around the part in its places, and its dimensions in their worst
    place with U as a share of the limit.
    """
    found = part_uncertainty(design, quantity)
    return {
        "boxes": [corners for _, corners, _ in _in_places(found.laid)],
        "dimensions": [
            {"name": one.name, "share": one.value.share_of_target, "held": one.value.is_within}
            for one in worst_first(found)
            if one.value is not None
        ],
    }


def worst_first(found: PartUncertainty) -> list[DimensionUncertainty]:
    """Return the dimensions with a tolerance in their worst place, the largest share first."""
    worst: dict[str, DimensionUncertainty] = {}
    for one in sorted(found.judged, key=lambda one: -(one.share_of_tolerance or 0.0)):
        worst.setdefault(one.dimension.name, one)
    return list(worst.values())


def _in_places(laid: LaidPart) -> list[tuple[str, Array, Array]]:
    """Return the name of each place, corners (8, 3) of a box around the touched points, which
    alternate fastest in z, and the points.
    """
    points, found = laid.points, []
    for place in laid.part.places:
        surface = points.surface[points.in_place(place.name)]
        ends = np.stack([surface.min(axis=0), surface.max(axis=0)])
        corners = ends[np.indices((2, 2, 2)).reshape(3, -1).T, np.arange(3)]
        corners, at = (those @ place.rotation.T + place.origin for those in (corners, surface))
        found.append((place.name, corners, at))
    return found


def part_view(laid: LaidPart) -> SpatialPicture:
    """Return the volume with the part's box and its touched points in all places."""
    volume = laid.machine.volume
    layers, labels = volume_layers(volume.lower, volume.upper), []
    places = _in_places(laid)
    # Two corners share an edge if they differ in one bit.
    edges = [(k, k | bit) for bit in (1, 2, 4) for k in range(8) if not k & bit]
    for k, (_, corners, at) in enumerate(places):
        layers.append(Layer("lines", f"s{k % 6} thin", corners[np.ravel(edges)], (2,) * 12))
        layers.append(Layer("dots", f"s{k % 6}", at))
        labels.append([*corners[:, :2].mean(axis=0), corners[:, 2].max() + 0.03])
    names = tuple(name for name, _, _ in places)
    layers.append(Layer("labels", "names", np.array(labels), names=names))
    return SpatialPicture(
        layers,
        f"the part in {len(names)} places of the volume",
        f"The part in the volume: {len(laid.points.readings)} touched points, and a box around"
        " those of a place.",
    )


def _shares(found: PartUncertainty) -> Html:
    """Return a bar for each dimension with a tolerance, in its worst place."""
    ordered = worst_first(found)
    if not ordered:
        return Html()
    limit = found.part.share_of_tolerance
    most = max(1.1 * limit, ordered[0].share_of_tolerance or 0.0)
    rows = [_row(one, limit, most) for one in ordered]
    heads = ["dimension (worst place)", "U/T", "U/T", "share of the map", "with a perfect map"]
    marks = legend(
        ("band", "s0", "without the map: probing, tips, part"),
        ("band", "s1", "added by the map"),
        ("line", "alert", f"limit, {share_words(limit)} of the tolerance"),
    )
    caption = "Expanded uncertainty as a share of the tolerance, the largest first"
    return joined([marks, table("shares", caption, heads, rows, (0, 1))])


def _row(one: DimensionUncertainty, limit: float, most: float) -> list[str]:
    """Return a dimension with its bar up to U/T: what remains without the map, and what it adds."""
    assert one.value is not None and one.share_of_tolerance is not None
    end, share = WIDTH * one.share_of_tolerance / most, share_words(one.share_of_tolerance)
    own = end * min(one.outside, 1.0)
    areas = [
        element("path", class_=f"band {style}", style="fill-opacity: .75", d=f"M{d}Z")
        for style, d in (
            ("s0", f"0 2H{own:.1f}V12H0"),
            ("s1", f"{own:.1f} 2H{end:.1f}V12H{own:.1f}"),
        )
    ]
    mark = element("path", class_="line alert", d=f"M{WIDTH * limit / most:.1f} 0V14")
    bar = element(
        "svg",
        *areas,
        mark,
        viewBox=f"0 0 {WIDTH:g} 14",
        style="min-width: 15rem",
        role="img",
        aria_label=f"{share} of the tolerance",
    )
    perfect = share_words(one.share_of_tolerance * one.outside)
    return [one.name, bar, share, share_words(one.value.share), perfect]


def _dimensions(found: PartUncertainty) -> Html:
    (heads, *rows), are_numbers = found.texts()
    caption = "Dimensions in all places; deviations from nominal in the unit of the last column"
    words = [k for k, is_number in enumerate(are_numbers) if not is_number]
    return table("dimensions", caption, heads, rows, words, is_long=len(rows) > 40)
