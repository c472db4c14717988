"""Readings that do not fit are refused with their cause in common, or one by one."""

from __future__ import annotations

import ballplate as bp
import numpy as np
import pandas as pd
import pytest
from ballplate.simulator.inputs.messages import ExperimentError

from tests.extensions.laboratory import wording
from tests.extensions.laboratory.test_ball_centres import AXES, OFFSETS, centres, in_parts


def refusals(experiment: bp.Experiment, readings: pd.DataFrame, **settings: str) -> list[str]:
    with pytest.raises(bp.ExperimentError) as refused:
        bp.fit(experiment, readings, **settings)
    return [message.text for message in refused.value.messages]


def of_kind(readings: pd.DataFrame, kind: str) -> pd.DataFrame:
    """Scale readings, or the centres that a measuring program makes of them."""
    if kind == "scale readings":
        return readings
    return in_parts(centres(readings), 4) if kind == "part" else centres(readings)


KINDS = ["scale readings", "ball centres", "part"]


@pytest.mark.parametrize("kind", KINDS)
def test_a_wrong_unit_is_told_once(
    kind: str, experiment: bp.Experiment, readings: pd.DataFrame
) -> None:
    table = of_kind(readings.copy(), kind)
    unit, factor = ("inches", 1 / 25.4) if kind == "part" else ("centimetres", 0.1)
    table[AXES] *= factor
    (text,) = refusals(experiment, table, coordinates=kind)
    assert f"{unit} that are read as millimetres: correct the unit" in text


@pytest.mark.parametrize("kind", KINDS)
def test_wrong_names_are_told_position_by_position(
    kind: str, experiment: bp.Experiment, readings: pd.DataFrame
) -> None:
    wrong, generator = of_kind(readings.copy(), kind), np.random.default_rng(8)
    for name in wrong["position"].unique():
        own = wrong["position"] == name
        wrong.loc[own, "ball"] = generator.permutation(wrong.loc[own, "ball"].to_numpy())
    texts = refusals(experiment, wrong, coordinates=kind)
    assert len(texts) == 6
    assert all(wording.CORRECT_THE_NAMES_OF_THE_BALLS in text for text in texts)


def test_axes_may_be_what_turns_a_plate_over(
    experiment: bp.Experiment, readings: pd.DataFrame
) -> None:
    text = refusals(experiment, readings.assign(x_mm=1000.0 - readings["x_mm"]))[0]
    assert "turned over; correct" in text and "the columns of the axes" in text


@pytest.mark.parametrize(
    ("left", "told"),
    [
        ("[50 mm, 0 mm, 0 mm]", "position x low: only 25 of 50 readings fit the plate"),
        ("[-60 mm, 0 mm, 0 mm]", "of 250 readings do not fit the others"),
    ],
)
def test_offsets_of_probes_are_among_the_causes(
    left: str, told: str, experiment: bp.Experiment, readings: pd.DataFrame
) -> None:
    offsets = {name: [f"{x} mm" for x in offset] for name, offset in OFFSETS.items()}
    offsets["left"] = left.strip("[]").split(", ")
    text = refusals(experiment.with_(probes=offsets), readings)[0]
    assert told in text and "the offsets of probes" in text
    assert "coordinates" in text


def test_exchanged_names_of_positions_are_told_as_turns(
    experiment: bp.Experiment, readings: pd.DataFrame
) -> None:
    names = readings["position"].replace({"z low": "z high", "z high": "z low"})
    texts = refusals(experiment, readings.assign(position=names))
    assert [text.partition(":")[0] for text in texts] == ["position z high", "position z low"]
    assert all("turned by" in text for text in texts)


def test_a_plate_that_was_turned_is_told_as_that(
    experiment: bp.Experiment, readings: pd.DataFrame
) -> None:
    turned = experiment.with_({"positions.0.quarter_turns": 2})
    with pytest.raises(ExperimentError, match=wording.LOW_THE_READINGS_FIT_THE_PLATE):
        bp.fit(turned, readings)
