"""Headings of tables of readings: columns that are not used, and headings that occur twice."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas
import pytest
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.inputs.yamltree import GivenText
from ballplate.simulator.readings.reading_files import read_readings

from tests.extensions.laboratory import wording
from tests.extensions.laboratory.tables import QUICKSTART, observed


def refusal(table: pandas.DataFrame, heads: list[str], path: Path) -> str:
    """That of a table written under other headings."""
    path.write_text(",".join(heads) + "\n" + table.to_csv(index=False, header=False))
    with pytest.raises(ExperimentError) as refused:
        observed(path)
    return str(refused.value)


def test_columns_that_are_not_used_are_told_where_the_name_of_the_file_is_no_position(
    readings: pandas.DataFrame, tmp_path: Path
) -> None:
    letters = dict(zip(readings["position"].unique(), "ABCDEFGH", strict=False))
    table = readings.assign(position=["ort " + letters[name] for name in readings["position"]])
    heads = ["Ort", "Kugel", "Taster", "X [mm]", "Y [mm]", "Z [mm]"]
    for rows in (table, readings):
        text = refusal(rows, heads, tmp_path / "t.csv")
        assert wording.THE_NAME_OF_THE_FILE in text and 'not used: "Ort"' in text


def test_a_file_named_as_a_position_has_that_position(
    readings: pandas.DataFrame, tmp_path: Path
) -> None:
    """Whatever else a column that is not used says."""
    paths = []
    for name, own in readings.groupby("position"):
        paths.append(tmp_path / f"{name}.csv")
        heads = "Ort,Kugel,Taster,X [mm],Y [mm],Z [mm]\n"
        other = own.assign(position="z low")
        paths[-1].write_text(heads + other.to_csv(index=False, header=False))
    found = observed(paths)
    assert len(found.x) == len(readings) and not found.missing
    assert all('not used: "Ort"' in told for told in found.table_notes)


@pytest.mark.parametrize("heads", ["X-Istwert,X-Istwert,Z-Istwert", "Z,Y,Z"])
def test_a_heading_that_occurs_twice_is_named_with_its_line(
    readings: pandas.DataFrame, tmp_path: Path, heads: str
) -> None:
    columns = heads.split(",")
    (doubled,) = {head for head in columns if columns.count(head) == 2}
    heads = ["# Protokoll\nPosition", "Kugel", "Taster", *columns]
    text = refusal(readings, heads, tmp_path / "t.csv")
    assert f't.csv:2:1: the heading "{doubled}" occurs more than once' in text


def test_columns_that_influences_ask_for_are_read_in_any_table(readings: pandas.DataFrame) -> None:
    """Temperatures of a table with semicolons are those of the plain file."""
    influence = {
        "kind": "temperature",
        "artefact_expansion": {"value": "11.5 um/m/K", "standard_uncertainty": "1 um/m/K"},
        "artefact_temperature": {"value": "20 degC", "standard_uncertainty": "0.1 K"},
    }
    design = lay_out(QUICKSTART.with_(influences=[influence]))
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
