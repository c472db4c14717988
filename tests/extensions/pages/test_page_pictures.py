"""Pictures of pages: where marks stand is what they mean."""

from __future__ import annotations

import re
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.pages.charts import Chart, Trace, chart_svg
from ballplate.extensions.pages.design_views import volume_layers, volume_view
from ballplate.extensions.pages.spatial import Layer, SpatialPicture, still_figure
from ballplate.presentation.scenes import hull, projection

from tests.extensions.pages.pages_read import chart_marks


def numbers(text: str) -> list[float]:
    return [float(one) for one in re.findall(r"-?\d+(?:\.\d+)?", text)]


def figure(layers: list[Layer]) -> str:
    return still_figure(SpatialPicture(layers, "words", "caption"))


def path_of(picture: str, kind: str) -> str:
    return re.findall(rf'<path class="{kind}[^"]*" d="([^"]*)"', picture)[0]


@pytest.mark.parametrize(
    ("x", "y", "ends", "low"),
    [
        ([0.0, 2.5, 4.0, 10.0], [-2.0, np.nan, 3.0, 1.0], [0.0, 10.0], -2.3),
        ([300.0, 450.0], [500.0, 900.0], [300.0, 450.0], 0.0),
        ([7.0], [-3.0], [7.0, 8.0], -3.18),
    ],
)
def test_marks_of_a_chart_stand_where_its_numbers_say(x: Any, y: Any, ends: Any, low: Any) -> None:
    """And fill the frame, but for some room above and below, which begins at zero if asked for."""
    points = np.array([x, y]).T
    chart = Chart([Trace("dots", "s0", *points.T)], "x, mm", "µm", "words", (), low == 0.0, 170.0)
    found = chart_marks(chart_svg(chart))
    (left, high), (right, lowest) = found["frame"]
    known, size = points[np.isfinite(points[:, 1])], [right - left, high - lowest]
    np.testing.assert_allclose(found["dots"] / size, known / size, atol=1e-3)
    np.testing.assert_allclose([left, right, lowest], [*ends, low], atol=1e-3 * max(size))
    assert '<text x="195.0" y="164.0" text-anchor="middle">x, mm<' in chart_svg(chart)


@pytest.mark.parametrize(("count", "shown"), [(2, "low"), (3, "many letters or …"), (60, "")])
def test_names_along_a_chart_stand_below_their_places_apart(count: int, shown: str) -> None:
    """In full or by their first letters, otherwise some of their numbers."""
    places = tuple((k, "low" if count == 2 else "many letters or more") for k in range(count))
    dots = Trace("dots", "s0", np.arange(count), np.arange(count))
    text = chart_svg(Chart([dots], "", "", "", places))
    marks = np.array(numbers(path_of(text, "dots").replace("h0", " "))).reshape(-1, 2)
    labels = re.findall(r'<text x="([\d.]+)" y="179.0" text-anchor="middle">([^<]+)<', text)
    told = range(count) if shown else range(0, 60, 6)
    assert [label for _, label in labels] == [shown or str(k + 1) for k in told]
    np.testing.assert_allclose([float(x) for x, _ in labels], marks[list(told), 0], atol=0.11)


def test_lines_and_bands_of_a_chart_are_broken_where_nothing_is_known() -> None:
    x, y = np.arange(6.0), np.array([1.0, 2.0, np.nan, 4.0, 5.0, 6.0])
    traces = [Trace("line", "s0", x, y), Trace("band", "s1", x, y - 1.0, y + 1.0)]
    text = chart_svg(Chart(traces, "", "", ""))
    assert path_of(text, "line").count("M") == 2 and path_of(text, "line").count("L") == 3
    assert path_of(text, "band").count("Z") == 2 and "nan" not in text
    nothing = Chart([Trace("line", "s0", x, np.full(6, np.nan))], "", "", "")
    assert path_of(chart_svg(nothing), "line") == ""


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_view_shows_points_as_the_projection_of_still_pictures(dimension: int) -> None:
    draws = np.random.default_rng(3)
    points = draws.normal(size=(7, dimension))
    text = figure([Layer("lines", "s0", points, (3, 4))])
    shown = np.array(numbers(path_of(text, "lines"))).reshape(-1, 2)
    flat = points @ projection(dimension)[0].T * [1.0, -1.0]
    # But for one scale and one shift for all.
    scale = np.ptp(shown, axis=0) / np.ptp(flat, axis=0)
    np.testing.assert_allclose(scale, scale[0], rtol=2e-3)
    np.testing.assert_allclose(
        shown - shown.mean(axis=0), scale[0] * (flat - flat.mean(axis=0)), atol=0.2
    )
    room = np.concatenate([shown.min(axis=0) - 30.0, [450.0, 330.0] - shown.max(axis=0)])
    assert room.min() == pytest.approx(0.0, abs=0.11)


BOXES = ([0.0, 0.0, 0.0], [0.9, 1.2, 0.7]), ([-0.5, 0.1, -0.2], [0.4, 0.6, 0.3])


@pytest.mark.parametrize(("lower", "upper"), [*BOXES, ([0.1, -0.2], [0.5, 0.3])])
def test_axes_of_the_volume_are_told_outside_of_it(lower: Any, upper: Any) -> None:
    """Ticks leave the edge at their number at right angles on paper, names are beyond the ends."""
    d, size = len(lower), np.subtract(upper, lower).max()
    lower, upper = np.array(lower), np.array(upper)
    *edges, strokes, origin, labels = volume_layers(lower, upper)
    view, _ = projection(d)
    corners = hull(np.concatenate([layer.points for layer in edges]) @ view.T)
    sides = np.roll(corners, -1, axis=0) - corners
    assert len(origin.points) == bool((lower <= 0.0).all() and (upper >= 0.0).all())
    pairs = strokes.points.reshape(-1, 2, d)
    is_short = np.ptp(pairs, axis=1).max(axis=1) < 0.1 * size
    pairs = pairs[is_short & ((pairs[:, 0] >= lower) & (pairs[:, 0] <= upper)).all(axis=1)]
    for name, place in zip(labels.names, labels.points, strict=True):
        away = place @ view.T - corners
        assert (sides[:, 0] * away[:, 1] - sides[:, 1] * away[:, 0]).min() < 0.0, name
        if name[0] in "xyz":
            k = "xyz".index(name[0])
            assert upper[k] + 0.1 * size < place[k] < upper[k] + 0.4 * size
        elif name != "0":
            start, end = pairs[np.linalg.norm((pairs[:, 1] - place) @ view.T, axis=1).argmin()]
            out, k_told = view @ (end - start), np.isclose(1e3 * start, float(name))
            across = np.abs(out @ view) / np.linalg.norm(out) / np.linalg.norm(view, axis=0)
            assert across[k_told].min() < 0.1 and 0.015 < np.linalg.norm(out) / size < 0.04
    assert {f"{1e3 * end:g}" for end in (*lower, *upper)} - {"0"} < set(labels.names)


def test_positions_of_a_view_are_named_above_their_balls() -> None:
    layers = volume_view(bp.check(bp.quickstart()).design).layers
    (labels,) = (one.points for one in layers if one.style == "names")
    dots = [one.points for one in layers if (one.kind, one.style) == ("dots", "plate")]
    for place, balls in zip(labels, dots, strict=True):
        above = (place - balls) @ projection(3)[0][1]
        assert 0.0 < above.min() < 0.2 * np.ptp(above)
