"""Pictures of pages: where marks stand is what they mean."""

from __future__ import annotations

import re

import numpy as np
import pytest
from ballplate.extensions.pages.charts import Chart, Trace, chart_svg
from ballplate.extensions.pages.spatial import Layer, SpatialPicture, still_figure
from ballplate.presentation.scenes import projection


def numbers(text: str) -> list[float]:
    return [float(one) for one in re.findall(r"-?\d+(?:\.\d+)?", text)]


def figure(layers: list[Layer]) -> str:
    return still_figure(SpatialPicture(layers, "words", "caption"))


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
