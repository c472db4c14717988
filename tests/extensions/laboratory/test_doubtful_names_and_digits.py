"""Numbers that a symmetrical plate does not tell, names of positions that are exchanged, and digits
that are too few.
"""

from __future__ import annotations

import ballplate as bp
import numpy as np
import pandas as pd
import pytest
from ballplate.extensions.laboratory.digits import doubts_about_digits
from ballplate.simulator.experiment.layout import lay_out
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


def exchanged(readings: pd.DataFrame, first: str, second: str) -> pd.DataFrame:
    names = readings["position"].replace({first: second, second: first})
    return readings.assign(position=names)


@pytest.mark.parametrize(("first", "second"), [("z low", "z high"), ("x low", "x high")])
def test_exchanged_names_of_positions_are_told_as_such(
    first: str, second: str, experiment: bp.Experiment, readings: pd.DataFrame
) -> None:
    with pytest.raises(ExperimentError) as refused:
        bp.fit(experiment, exchanged(readings, first, second))
    text = str(refused.value)
    pairs = f"{first} at that of {second}, {second} at that of {first}"
    assert f"at the planned location of another position, {pairs}" in text
    assert wording.EXCHANGE_THE_NAMES_OF_POSITIONS in text and "turned" not in text


def test_exchanged_names_of_positions_that_are_not_turned(
    experiment: bp.Experiment, readings: pd.DataFrame
) -> None:
    """The plate is as fits say; a warning tells that the names are exchanged."""
    straight = experiment.with_({"positions.1.quarter_turns": 0})
    both = bp.simulate(straight)
    found = bp.fit(straight, exchanged(both, "z low", "z high"))
    assert any(wording.EXCHANGE_THE_NAMES_OF_POSITIONS in one for one in found.warnings)
    assert not any("exchange" in one for one in bp.fit(straight, both).warnings)


def test_a_plate_that_was_turned_is_told_as_that(
    experiment: bp.Experiment, readings: pd.DataFrame
) -> None:
    """And not as names of positions."""
    turned = experiment.with_({"positions.0.quarter_turns": 2})
    with pytest.raises(ExperimentError, match=wording.LOW_THE_READINGS_FIT_THE_PLATE):
        bp.fit(turned, readings)


@pytest.mark.parametrize("digits", [2, 3, 4, 6])
@pytest.mark.parametrize("unit", [1.0, 25.4])
def test_digits_that_are_coarser_than_the_repeatability_are_warned_of(
    digits: int, unit: float, experiment: bp.Experiment, readings: pd.DataFrame
) -> None:
    x = (readings[AXES] / unit).round(digits).to_numpy() * unit / 1e3
    doubts = doubts_about_digits(lay_out(experiment), x, None)
    # Half of the repeatability, 0.2 um, against the standard deviation of rounding.
    assert bool(doubts) == (1e-3 * unit * 10.0**-digits / np.sqrt(12.0) > 0.1e-6)
    if doubts:
        step = 1e3 * unit * 10.0**-digits
        ways = (f"{step:.3g} µm", f"{step / 1e3:.3g} mm")
        assert any(f"no digit below {shown}; such" in doubts[0] for shown in ways)


def test_a_stated_uncertainty_is_what_digits_are_compared_with(
    experiment: bp.Experiment, readings: pd.DataFrame
) -> None:
    table = readings.assign(**{axis: readings[axis].round(3) for axis in AXES})
    assert any(wording.NO_DIGIT_BELOW in one for one in bp.fit(experiment, table).warnings)
    fitted = bp.fit(experiment, table.assign(u_um=1.0))
    assert not any("no digit below" in one for one in fitted.warnings)
