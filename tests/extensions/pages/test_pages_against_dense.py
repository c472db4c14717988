"""Ellipsoids and undetermined motions of a design's page, against the dense covariance and null
space.
"""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np
import pytest
from ballplate.extensions.pages.design_views import ball_views, motion_view, point_view
from ballplate.extensions.pages.elements import Html
from ballplate.extensions.pages.motions import null_motions
from ballplate.extensions.pages.spatial import figure_of
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from numpy.typing import NDArray

from tests.extensions.pages.test_result_pages import CHANGED, FOUR, small
from tests.reference import dense

Real = NDArray[np.float64]

TWO = [{**FOUR[0], "probes": ["down"]}, {**FOUR[1], "probes": ["front"]}]


def picture(figure: str) -> tuple[list[dict[str, Any]], float, str]:
    """Layers of a picture, how many times it is enlarged, and its caption."""
    stored = re.search(r'application/json">(.*?)</script>', figure)
    caption = re.search(r"<figcaption>(.*)</figcaption>", figure)
    assert stored is not None and caption is not None
    times = re.search(r"nlarged ([\d,]+) times", caption[1])
    assert times is not None
    return json.loads(stored[1])["layers"], float(times[1].replace(",", "")), caption[1]


def rows(values: list[float]) -> Real:
    """Places of a picture in metres."""
    return np.reshape(values, (-1, 3)) / 1e3


def test_ellipsoids_are_those_of_the_dense_covariance() -> None:
    experiment = small()
    at = linearise(lay_out(experiment))
    problem = dense.planned(at.design, 3, 2)
    covariance = dense.linearised(problem).covariance
    symbols = dense.quantities(problem)
    for view, symbol in ((point_view(at, 2.0), "U4"), (*ball_views(at, 2.0), "U1")):
        layers, times, caption = picture(figure_of(view))
        assert "k = 2," in caption
        linear = dense.jacobian(symbols[symbol], problem.parameters)
        (drawn,) = (one for one in layers if one["kind"] == "ellipsoids")
        shapes = np.reshape(drawn["shapes"], (-1, 3, 3)) / 1e3
        assert len(shapes) == len(linear) // 3
        for k, shape in enumerate(shapes):
            mine = linear[3 * k : 3 * k + 3]
            expected = (2.0 * times) ** 2 * mine @ covariance @ mine.T
            np.testing.assert_allclose(
                shape @ shape.T, expected, rtol=0.0, atol=2e-3 * np.trace(expected)
            )
        # Large enough to be seen, and not so large as to hide one another.
        assert 0.01 < np.linalg.norm(shapes, 2, axis=(1, 2)).max() < 0.1


@pytest.mark.parametrize(
    "changes", [CHANGED["deficient"], {"positions": TWO}], ids=["no scale", "two positions"]
)
def test_what_moves_in_a_picture_is_of_the_dense_null_space(changes: dict[str, Any]) -> None:
    """Machine and plate swing as one combination of undetermined directions, and no other."""
    experiment = small(**changes)
    at = linearise(lay_out(experiment))
    problem = dense.planned(at.design, 3, 2)
    found = dense.linearised(problem)
    motions = null_motions(at)
    assert len(motions) == found.deficiency
    views = [motion_view(at, one, "motion", Html("words"), "Undetermined") for one in motions]
    drawn = [one for one in views if one is not None]
    assert drawn
    for view in drawn:
        layers, times, caption = picture(figure_of(view))
        told = re.search(r"with the probe (\w+) ", caption)
        assert told is not None
        tip = experiment.probes[told[1]].offset
        grid, _, _, balls = (one for one in layers if "moves" in one)
        points, places = rows(grid["points"]), rows(balls["points"])

        readings = problem.design.readings
        # Each ball of a position once.
        near = sorted(set(zip(readings.position.tolist(), readings.ball.tolist(), strict=True)))
        stand = [problem.rotations[k] @ problem.balls[b] + problem.origins[k] for k, b in near]
        np.testing.assert_allclose(places, stand, atol=1e-4)

        def displaced(
            step: dense.Values, points: Real = points, near: Any = near, tip: Any = tip
        ) -> Any:
            shifted, rotations, origins, a = dense.unpack(problem, step)
            of_points = dense.corrected(problem, points, a, np.tile(tip, (len(points), 1)))
            of_balls = [rotations[k] @ shifted[b] + origins[k] for k, b in near]
            return np.concatenate([of_points.ravel(), np.concatenate(of_balls)])

        linear = dense.jacobian(displaced, problem.parameters) @ found.null
        shown = np.concatenate([rows(grid["moves"]).ravel(), rows(balls["moves"]).ravel()]) / times
        weights = np.linalg.lstsq(linear, shown, rcond=None)[0]
        # Places in pictures are rounded to a tenth of a millimetre.
        np.testing.assert_allclose(times * linear @ weights, times * shown, atol=3e-4)
        assert np.abs(times * shown).max() > 0.02
        with pytest.raises(AssertionError):
            wrong = shown * np.where(np.arange(len(shown)) % 2, 1.0, 0.0)
            weights = np.linalg.lstsq(linear, wrong, rcond=None)[0]
            np.testing.assert_allclose(times * linear @ weights, times * wrong, atol=3e-4)
