"""Ball centres, part co-ordinates and corrected readings give the estimates of scale readings."""

from __future__ import annotations

from pathlib import Path

import ballplate as bp
import numpy as np
import pandas
import pytest
from scipy.spatial.distance import pdist
from scipy.spatial.transform import Rotation

from tests.extensions.laboratory import wording

DESIGN = "designs/quickstart.yaml"
AXES = ["x_mm", "y_mm", "z_mm"]
OFFSETS = {
    "down": (0.0, 0.0, -50.0),
    "right": (50.0, 0.0, 0.0),
    "left": (-50.0, 0.0, 0.0),
    "back": (0.0, 50.0, 0.0),
    "front": (0.0, -50.0, 0.0),
}


@pytest.fixture(scope="module")
def plain(readings: pandas.DataFrame) -> pandas.DataFrame:
    return pandas.DataFrame(bp.fit(DESIGN, readings).rows())


def centres(
    readings: pandas.DataFrame, offsets: dict[str, tuple[float, ...]] = OFFSETS
) -> pandas.DataFrame:
    found = readings.copy()
    found[AXES] = readings[AXES] + np.array([offsets[probe] for probe in readings["probe"]])
    return found


def in_parts(centred: pandas.DataFrame, seed: int) -> pandas.DataFrame:
    """Centres in another co-ordinate system in each position."""
    found, generator = centred.copy(), np.random.default_rng(seed)
    for k, name in enumerate(centred["position"].unique()):
        own = (centred["position"] == name).to_numpy()
        turn = Rotation.random(random_state=seed + k).as_matrix()
        shift = generator.uniform(-300.0, 300.0, 3)
        found.loc[own, AXES] = (centred.loc[own, AXES].to_numpy() - shift) @ turn
    return found


def worst(found: bp.Fit, plain: pandas.DataFrame) -> tuple[float, float]:
    """Largest difference of machine parameters in standard uncertainties, and of distances between
    balls in metres.
    """
    frame = pandas.DataFrame(found.rows())
    assert list(frame["parameter"]) == list(plain["parameter"])
    of_machine = (plain["kind"] == "machine").to_numpy()
    apart = (frame["value"] - plain["value"]).abs() / plain["standard uncertainty"]
    balls = [
        pdist(one[one["kind"] == "ball"]["value"].to_numpy().reshape(-1, 3))
        for one in (frame, plain)
    ]
    return float(apart[of_machine].max()), float(np.abs(balls[0] - balls[1]).max())


def test_offsets_of_the_controller(readings: pandas.DataFrame, plain: pandas.DataFrame) -> None:
    """The measuring program's offsets are not those of the plan: only they were applied."""
    others = {name: tuple(1.01 * x + 0.2 for x in offset) for name, offset in OFFSETS.items()}
    stated = {name: [f"{x!r} mm" for x in offset] for name, offset in others.items()}
    experiment = bp.load(DESIGN).with_(
        readings={"coordinates": "ball centres", "offsets_in_controller": stated}
    )
    machine, balls = worst(bp.fit(experiment, centres(readings, others)), plain)
    assert machine < 1e-5 and balls < 1e-11


# Errors that the machine's correction takes off: e(x) of x + e(x).
MAP = """\
title: correction
arrangement: MB2
volume: {x: [-100 mm, 1.1 m], y: [-100 mm, 1.1 m], z: [-100 mm, 1.1 m]}
errors:
  EXX: {polynomial: [0 um, 12 um]}
  EYX: {polynomial: [0 um, 0 um, 9 um]}
"""


@pytest.mark.parametrize("kind", ["scale readings", "ball centres"])
def test_a_correction_is_taken_off(
    kind: str, readings: pandas.DataFrame, plain: pandas.DataFrame, tmp_path: Path
) -> None:
    """Readings that a correction was added to by its closed form."""
    (tmp_path / "map.yaml").write_text(MAP, encoding="utf-8")
    along = (readings["x_mm"].to_numpy() + 100.0) / 1200.0
    corrected = readings.copy()
    corrected["x_mm"] += 0.012 * along
    # A straightness error is from the line through its ends.
    corrected["y_mm"] += 0.009 * along * (along - 1.0)
    corrected = centres(corrected) if kind == "ball centres" else corrected
    experiment = bp.load(DESIGN).with_(
        readings={"coordinates": kind, "compensation": {"file": str(tmp_path / "map.yaml")}}
    )
    found = bp.fit(experiment, corrected)
    machine, balls = worst(found, plain)
    assert machine < 1e-4 and balls < 1e-11
    assert any("was subtracted" in text for text in found.remarks)
    if kind == "scale readings":
        # With the correction on, what is left is estimated, and that is said.
        on = bp.fit(bp.load(DESIGN).with_(readings={"compensation": "on"}), corrected)
        assert worst(on, plain)[0] > 1.0
        assert any(wording.THE_ERRORS_THAT_IT_LEAVES in text for text in on.remarks)


def test_several_data_frames_are_one(readings: pandas.DataFrame, plain: pandas.DataFrame) -> None:
    found = bp.fit(DESIGN, [readings.iloc[:100], readings.iloc[100:]])
    assert pandas.DataFrame(found.rows()).equals(plain)


@pytest.mark.parametrize("count", [1, 2])
def test_too_few_balls_do_not_place_part_co_ordinates(
    readings: pandas.DataFrame, count: int
) -> None:
    own = readings["position"] == "z high"
    few = pandas.concat([readings[~own], readings[own].iloc[:count]])
    with pytest.raises(bp.ExperimentError, match=wording.TOO_FEW_BALLS_WERE_READ):
        bp.fit(DESIGN, centres(few), coordinates="part")
