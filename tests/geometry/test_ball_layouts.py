"""Artefacts: ball names, co-ordinates, pair sets, corners."""

import numpy as np
import pytest
from ballplate.simulator.geometry.artefacts import AnyArtefactSettings
from ballplate.simulator.geometry.ball_layouts import BallLayout, corner_balls, pairs
from hypothesis import given, strategies as st
from pydantic import TypeAdapter

from tests.geometry import wording

adapter: TypeAdapter[AnyArtefactSettings] = TypeAdapter(AnyArtefactSettings)


def layout(**settings: object) -> BallLayout:
    return adapter.validate_python(settings).layout()


def named(balls: BallLayout, set_name: str) -> set[tuple[str, str]]:
    return {(balls.names[i], balls.names[j]) for i, j in pairs(balls, set_name)}


GRID = layout(kind="grid", balls=(3, 2), size=("750 mm", "100 mm"))


def test_grid_row_by_row_from_the_lower_corner() -> None:
    assert GRID.names == ("r1c1", "r1c2", "r1c3", "r2c1", "r2c2", "r2c3")
    np.testing.assert_array_equal(GRID.coordinates[4], [0.375, 0.1, 0.0])
    np.testing.assert_array_equal(GRID.coordinates[-1], [0.75, 0.1, 0.0])
    assert not GRID.coordinates.flags.writeable


def test_pair_sets_of_a_grid() -> None:
    sides = {("r1c1", "r1c3"), ("r2c1", "r2c3"), ("r1c1", "r2c1"), ("r1c3", "r2c3")}
    diagonals = {("r1c1", "r2c3"), ("r1c3", "r2c1")}
    assert named(GRID, "corner sides") == sides
    assert named(GRID, "corner diagonals") == diagonals
    assert named(GRID, "corners") == sides | diagonals
    assert len(pairs(GRID, "neighbours")) == 7
    assert ("r1c2", "r2c2") in named(GRID, "neighbours")
    assert len(pairs(GRID, "all")) == 15
    assert [GRID.names[i] for i in corner_balls(GRID)] == ["r1c1", "r1c3", "r2c1", "r2c3"]


@given(st.integers(2, 30))
def test_square_has_only_its_outline(per_side: int) -> None:
    square = layout(kind="square", balls=per_side, size="500 mm")
    assert len(square.names) == 4 * (per_side - 1) == len(set(square.names))
    on_edge = np.isin(square.coordinates[:, :2], [0.0, 0.5]).any(axis=1)
    assert on_edge.all()
    steps = square.coordinates[pairs(square, "neighbours")]
    assert len(steps) == 4 * (per_side - 1)
    np.testing.assert_allclose(
        np.linalg.norm(steps[:, 1] - steps[:, 0], axis=1), 0.5 / (per_side - 1)
    )
    assert len(corner_balls(square)) == 4


def test_sets_that_are_not_defined() -> None:
    balls = layout(kind="balls", coordinates=(("0 mm", "0 mm"), ("1 mm", "0 mm")))
    with pytest.raises(ValueError, match=wording.IS_NOT_DEFINED_CHOOSE):
        pairs(balls, "neighbours")
    with pytest.raises(ValueError, match=wording.IS_NOT_DEFINED_LIST_THE_BALLS):
        corner_balls(balls)
