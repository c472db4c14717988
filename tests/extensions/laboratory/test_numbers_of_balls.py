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

AXES = ["x_mm", "y_mm", "z_mm"]
OFFSETS = {"down": (0, 0, -50), "right": (50, 0, 0), "left": (-50, 0, 0), "back": (0, 50, 0)}
OFFSETS |= {"front": (0, -50, 0)}
PITCH = 187.5
Turn = NDArray[np.float64]


@pytest.fixture(scope="module")
def experiment() -> bp.Experiment:
    return bp.quickstart()


@pytest.fixture(scope="module")
def readings(experiment: bp.Experiment) -> pd.DataFrame:
    return bp.simulate(experiment)


def by_rows(ball: str) -> int:
    return 5 * (int(ball[1]) - 1) + int(ball[3])


def by_columns(ball: str) -> int:
    return 5 * (int(ball[3]) - 1) + int(ball[1])


def in_part(readings: pd.DataFrame, turn: Turn) -> pd.DataFrame:
    """Centres in axes along the plate's rows and columns, as alignments make them, then turned."""
    found = readings.copy()
    offset = np.array([OFFSETS[probe] for probe in found["probe"]])
    centres = found[AXES].to_numpy() + offset
    for position in found["position"].unique():
        own = np.flatnonzero(found["position"] == position)
        drawn = np.array(
            [
                [PITCH * (int(b[3]) - 1), PITCH * (int(b[1]) - 1), 0.0]
                for b in found["ball"].iloc[own]
            ]
        )
        seen = centres[own]
        rotation, _ = Rotation.align_vectors(drawn - drawn.mean(0), seen - seen.mean(0))
        centres[own] = rotation.apply(seen - seen.mean(0)) @ turn.T
    return found.assign(**dict(zip(AXES, centres.T, strict=True)))


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


def test_numbers_that_contradict_places_in_the_part_are_refused(
    experiment: bp.Experiment, readings: pd.DataFrame
) -> None:
    numbered = in_part(readings, np.eye(3))
    numbered["ball"] = numbered["ball"].map(by_columns)
    with pytest.raises(ExperimentError, match=wording.NOR_NUMBERS_THAT_FIT):
        bp.fit(experiment, numbered, coordinates="part")


@pytest.mark.parametrize("number", [by_rows, by_columns])
def test_numbers_that_nothing_tells_are_refused(
    number: object, experiment: bp.Experiment, readings: pd.DataFrame
) -> None:
    numbered = in_part(readings, ASKEW)
    numbered["ball"] = numbered["ball"].map(number)
    with pytest.raises(ExperimentError, match=wording.NOR_NUMBERS_THAT_FIT):
        bp.fit(experiment, numbered, coordinates="part")
