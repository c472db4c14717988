"""What is wrong with all readings at once is told as one cause, and only where it explains all."""

from __future__ import annotations

from collections.abc import Callable

import ballplate as bp
import numpy as np
import pandas
import pytest
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.inputs.yamltree import GivenText
from ballplate.simulator.readings.reading_files import read_readings

from tests.extensions.laboratory import wording

DESIGN = "designs/quickstart.yaml"
AXES = ["x_mm", "y_mm", "z_mm"]
Change = Callable[[pandas.DataFrame], pandas.DataFrame]


@pytest.fixture(scope="module")
def readings() -> pandas.DataFrame:
    return bp.simulate(DESIGN)


def axes(*columns: str) -> Change:
    """Columns in another order, and with other signs about the middle of the machine."""

    def changed(readings: pandas.DataFrame) -> pandas.DataFrame:
        found = readings.copy()
        for axis, column in zip(AXES, columns, strict=True):
            values = readings[column.removeprefix("-")]
            found[axis] = 1000.0 - values if column.startswith("-") else values
        return found

    return changed


def scaled(factor: float) -> Change:
    return lambda readings: readings.assign(**{axis: readings[axis] * factor for axis in AXES})


CAUSES = {
    "x and y": (axes("y_mm", "x_mm", "z_mm"), "the table's y is x and the table's x is y"),
    "cyclic": (axes("y_mm", "z_mm", "x_mm"), "the table's z is x and the table's x is y"),
    "mirrored": (axes("-x_mm", "y_mm", "z_mm"), "if the table's x is -x"),
    "inches": (scaled(1 / 25.4), "inches that are read as millimetres"),
    "centimetres": (scaled(0.1), "centimetres that are read as millimetres"),
}


@pytest.mark.parametrize("name", CAUSES)
def test_a_cause_of_all_is_told_once(name: str, readings: pandas.DataFrame) -> None:
    change, told = CAUSES[name]
    with pytest.raises(bp.ExperimentError) as refused:
        bp.fit(DESIGN, change(readings))
    (message,) = refused.value.messages
    assert told in message.text and wording.OTHERWISE_THE_NAMES_OF_BALLS in message.text
    # No other one fits.
    assert ", or " not in message.text


def test_wrong_names_have_no_cause_in_common(readings: pandas.DataFrame) -> None:
    """Names in disorder in all positions are told position by position."""
    wrong = readings.copy()
    generator = np.random.default_rng(8)
    for name in wrong["position"].unique():
        own = wrong["position"] == name
        wrong.loc[own, "ball"] = generator.permutation(wrong.loc[own, "ball"].to_numpy())
    with pytest.raises(bp.ExperimentError) as refused:
        bp.fit(DESIGN, wrong)
    assert len(refused.value.messages) == 6
    assert all(wording.CORRECT_THE_NAMES_OF_THE_BALLS in one.text for one in refused.value.messages)


def test_readings_as_planned_have_no_doubts(readings: pandas.DataFrame) -> None:
    assert bp.fit(DESIGN, readings).warnings == ()


def test_odd_diameters_are_told(readings: pandas.DataFrame) -> None:
    generator = np.random.default_rng(9)
    diameters = 22.0 + 3e-4 * generator.standard_normal(len(readings))
    table = readings.assign(**{"diameter [mm]": diameters})
    (text,) = (t for t in bp.fit(DESIGN, table).remarks if "sphere diameters" in t)
    assert wording.MM_IN_THE_MIDDLE in text and "none is odd" in text
    diameters[37] += 0.02
    table = readings.assign(**{"diameter [mm]": diameters})
    (text,) = (t for t in bp.fit(DESIGN, table).remarks if "sphere diameters" in t)
    row = readings.iloc[37]
    assert f"odd: {row['ball']} in {row['position']} (line 39): 22.02" in text


def test_columns_that_influences_ask_for_are_read_in_any_table(
    readings: pandas.DataFrame,
) -> None:
    """Temperatures of a table with semicolons are those of the plain file."""
    (experiment,) = load(DESIGN)
    influence = {
        "kind": "temperature",
        "artefact_expansion": {"value": "11.5 um/m/K", "standard_uncertainty": "1 um/m/K"},
        "artefact_temperature": {"value": "20 degC", "standard_uncertainty": "0.1 K"},
    }
    design = lay_out(experiment.with_(influences=[influence]))
    warm = 20.0 + 0.01 * np.arange(len(readings))
    plain = readings.assign(temperature_artefact_degC=warm).to_csv(index=False)
    other = readings.rename(columns={"ball": "Kugel", "x_mm": "X [mm]", "y_mm": "Y [mm]"})
    other = other.assign(**{"Temperature artefact [°C]": warm}).iloc[:, [2, 6, 0, 1, 5, 4, 3]]
    text = other.to_csv(index=False, sep=";", decimal=",")
    one, two = (read_readings(GivenText("t.csv", given), design) for given in (plain, text))
    assert "t.csv: read as: semicolons, decimal commas" in two.table_notes[0]
    for found in (one, two):
        assert found.design.readings.beside is not None
        given = found.design.readings.beside["temperature_artefact"]
        np.testing.assert_allclose(given, warm, rtol=0, atol=1e-12)
        np.testing.assert_array_equal(
            found.design.readings.beside["order"], np.arange(len(readings))
        )
