"""Pictures of pages: where marks stand is what they mean, whichever way they are turned."""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np
import pytest
from ballplate.extensions.pages.charts import Chart, Trace, chart_svg
from ballplate.extensions.pages.spatial import Layer, SpatialPicture, figure_of
from ballplate.presentation.scenes import projection


def numbers(text: str) -> list[float]:
    return [float(one) for one in re.findall(r"-?\d+(?:\.\d+)?", text)]


def figure(layers: list[Layer]) -> str:
    return figure_of(SpatialPicture(layers, "a", "label", "words", "caption"))


def path_of(picture: str, kind: str) -> str:
    found = re.search(rf'<path class="{kind}[^"]*" d="([^"]*)"', picture) or re.search(
        rf'<path class="{kind}[^"]*"[^>]* d="([^"]*)"', picture
    )
    assert found is not None
    return found[1]


def test_marks_of_a_chart_stand_where_its_numbers_say() -> None:
    x, y = np.array([0.0, 250.0, 400.0, 1000.0]), np.array([-2.0, np.nan, 3.5, 1.0])
    text = chart_svg(Chart([Trace("dots", "s0", x, y)], "x, mm", "µm", "words"))
    labels = re.findall(r'<text x="([\d.]+)" y="([\d.]+)" text-anchor="(\w+)">(-?[\d.]+)<', text)
    across = [(float(v), float(a)) for a, _, anchor, v in labels if anchor == "middle"]
    up = [(float(v), float(b) - 3.5) for _, b, anchor, v in labels if anchor == "end"]
    of_x, of_y = (np.polyfit(*np.array(one).T, 1) for one in (across, up))
    marks = np.array(numbers(path_of(text, "dots").replace("h0", " "))).reshape(-1, 2)
    known = np.isfinite(y)
    np.testing.assert_allclose(marks[:, 0], np.polyval(of_x, x[known]), atol=0.2)
    np.testing.assert_allclose(marks[:, 1], np.polyval(of_y, y[known]), atol=0.2)


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
    points, moves = draws.normal(size=(2, 7, dimension))
    text = figure([Layer("lines", "s0", points, (3, 4), 0.1 * moves)])
    shown = np.array(numbers(path_of(text, "lines"))).reshape(-1, 2)
    flat = (points + 0.1 * moves) @ projection(dimension)[0].T * [1.0, -1.0]
    # But for one scale and one shift for all.
    scale = np.ptp(shown, axis=0) / np.ptp(flat, axis=0)
    np.testing.assert_allclose(scale, scale[0], rtol=2e-3)
    np.testing.assert_allclose(
        shown - shown.mean(axis=0), scale[0] * (flat - flat.mean(axis=0)), atol=0.2
    )
    stored: Any = json.loads(re.findall(r'application/json">(.*?)</script>', text)[0])
    back = np.array(stored["layers"][0]["points"]).reshape(-1, dimension)
    np.testing.assert_allclose(back, 1e3 * points, atol=0.05)
    assert ("data-view" in text) == (dimension == 3)


def test_an_ellipse_is_the_outline_of_its_ellipsoid() -> None:
    draws = np.random.default_rng(5)
    centres, shapes = draws.normal(size=(4, 3)), 0.2 * draws.normal(size=(4, 3, 3))
    layers = [Layer("ellipsoids", "s0", centres, shapes=shapes), Layer("dots", "s1", centres)]
    text = figure(layers)
    dots = np.array(numbers(path_of(text, "dots").replace("h0", " "))).reshape(-1, 2)
    plane, _ = projection(3)
    scale = np.ptp(dots, axis=0) / np.ptp(centres @ plane.T, axis=0)
    directions = draws.normal(size=(40000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    ellipses = re.findall(r"M[^M]*", path_of(text, "ellipsoids"))
    for dot, shape, one in zip(dots, shapes, ellipses, strict=True):
        start_x, start_y, long, short, angle, _, _, dx, dy = numbers(one)[:9]
        np.testing.assert_allclose([start_x + dx / 2, start_y + dy / 2], dot, atol=0.15)
        on_paper = scale[0] * directions @ shape.T @ plane.T * [1.0, -1.0]
        turned = np.radians(angle)
        axes = np.array([[np.cos(turned), np.sin(turned)], [-np.sin(turned), np.cos(turned)]])
        reach = np.abs(on_paper @ axes.T).max(axis=0)
        np.testing.assert_allclose([long, short], reach, rtol=0.02, atol=0.2)
