"""Positions: where a pose puts the balls."""

import math

import numpy as np
import pytest
from ballplate.simulator.geometry.artefacts import GridSettings
from ballplate.simulator.geometry.ball_layouts import BallLayout
from ballplate.simulator.geometry.poses import (
    AXIS_INDEX,
    IN_PLANE_AXES,
    Axis,
    FreePlacement,
    PlanePlacement,
    ball_coordinates,
    nominal_pose,
)
from hypothesis import given, strategies as st

from tests.geometry import wording

PLATE = GridSettings.model_validate(
    {"kind": "grid", "balls": (3, 2), "size": ("600 mm", "200 mm")}
).layout()
planes: st.SearchStrategy[Axis] = st.sampled_from(("x", "y", "z"))


@pytest.mark.parametrize(
    ("plane", "last_ball"), [("z", (0.7, 0.4, 0.9)), ("x", (0.9, 0.7, 0.4)), ("y", (0.4, 0.9, 0.7))]
)
def test_axes_go_round_cyclically(plane: Axis, last_ball: tuple[float, ...]) -> None:
    pose = nominal_pose(PlanePlacement(plane, 0.9, "corner", (0.1, 0.2)), PLATE, 3)
    np.testing.assert_allclose(ball_coordinates(pose, PLATE)[-1], last_ball, rtol=1e-15)


@given(planes, st.integers(-5, 9), st.sampled_from(("corner", "centre")))
def test_turned_rectangle_is_where_it_should_be(plane: Axis, turns: int, anchor: str) -> None:
    placement = PlanePlacement(plane, 0.5, anchor, (0.3, 0.4), turns)  # type: ignore[arg-type]
    pose = nominal_pose(placement, PLATE, 3)
    assert set(np.abs(pose.rotation).flat) == {0.0, 1.0}
    assert round(np.linalg.det(pose.rotation)) == 1
    balls = ball_coordinates(pose, PLATE)
    axes = [AXIS_INDEX[axis] for axis in IN_PLANE_AXES[plane]]
    lower, upper = balls[:, axes].min(axis=0), balls[:, axes].max(axis=0)
    np.testing.assert_allclose(
        lower if anchor == "corner" else (lower + upper) / 2, [0.3, 0.4], atol=1e-15
    )
    np.testing.assert_allclose(upper - lower, [0.6, 0.2] if turns % 2 == 0 else [0.2, 0.6])
    np.testing.assert_array_equal(balls[:, AXIS_INDEX[plane]], 0.5)


def test_two_dimensions() -> None:
    pose = nominal_pose(PlanePlacement("z", 0.0, "corner", (0.1, 0.2), 2), PLATE, 2)
    np.testing.assert_array_equal(pose.rotation, [[-1, 0], [0, -1]])
    np.testing.assert_allclose(ball_coordinates(pose, PLATE)[0], [0.7, 0.4])
    free = nominal_pose(FreePlacement((0.5, 0.0), (math.pi / 2,)), PLATE, 2)
    np.testing.assert_allclose(ball_coordinates(free, PLATE)[-1], [0.3, 0.6])
    with pytest.raises(ValueError, match=wording.NO_PLANE_BUT):
        nominal_pose(PlanePlacement("x", 0.0, "corner", (0.1, 0.2)), PLATE, 2)


def test_balls_listed_away_from_their_origin() -> None:
    layout = BallLayout(("a", "b"), np.array([[1.0, 1.0, 0.01], [1.5, 1.25, 0.0]]))
    pose = nominal_pose(PlanePlacement("z", 0.1, "corner", (0.0, 0.0), 1), layout, 3)
    np.testing.assert_allclose(
        ball_coordinates(pose, layout), [[0.25, 0.0, 0.11], [0.0, 0.5, 0.1]], atol=1e-15
    )
