"""Numbers of balls in part co-ordinates, which a symmetrical plate does not tell."""

from __future__ import annotations

import ballplate as bp
import numpy as np
import pandas as pd
import pytest
from ballplate.simulator.inputs.messages import ExperimentError
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tests.extensions.laboratory import wording
from tests.extensions.laboratory.test_ball_centres import AXES, centres

PITCH = 187.5
Turn = NDArray[np.float64]


def by_rows(ball: str) -> int:
    return 5 * (int(ball[1]) - 1) + int(ball[3])


def by_columns(ball: str) -> int:
    return 5 * (int(ball[3]) - 1) + int(ball[1])


def in_part(readings: pd.DataFrame, turn: Turn) -> pd.DataFrame:
    """Centres in axes along the plate's rows and columns, as alignments make them, then turned."""
    found = centres(readings)
    for position in found["position"].unique():
        own = found["position"] == position
        balls = found.loc[own, "ball"]
        drawn = np.array([[PITCH * (int(b[3]) - 1), PITCH * (int(b[1]) - 1), 0.0] for b in balls])
        seen = found.loc[own, AXES].to_numpy()
        rotation, _ = Rotation.align_vectors(drawn - drawn.mean(0), seen - seen.mean(0))
        found.loc[own, AXES] = rotation.apply(seen - seen.mean(0)) @ turn.T
    return found


ASKEW = Rotation.from_euler("xyz", [0.4, 0.9, -1.1]).as_matrix()


def test_numbers_that_agree_with_places_in_the_part_are_taken(
    experiment: bp.Experiment, readings: pd.DataFrame
) -> None:
    part = in_part(readings, np.eye(3))
    named = bp.fit(experiment, part, coordinates="part")
    numbered = part.assign(ball=part["ball"].map(by_rows))
    found = bp.fit(experiment, numbered, coordinates="part")
    assert any(wording.BALLS_MATCHED_BY_NUMBER_IN_READING in one for one in found.remarks)
    assert not any("matched by number" in one for one in found.warnings)
    values = (pd.DataFrame(one.rows())["value"] for one in (found, named))
    np.testing.assert_allclose(*values, atol=1e-12)


@pytest.mark.parametrize(
    ("turn", "number"), [(np.eye(3), by_columns), (ASKEW, by_rows), (ASKEW, by_columns)]
)
def test_numbers_that_places_contradict_or_nothing_tells_are_refused(
    turn: Turn, number: object, experiment: bp.Experiment, readings: pd.DataFrame
) -> None:
    numbered = in_part(readings, turn)
    numbered["ball"] = numbered["ball"].map(number)
    with pytest.raises(ExperimentError, match=wording.NOR_NUMBERS_THAT_FIT):
        bp.fit(experiment, numbered, coordinates="part")
