"""Columns of uncertainties in tables of readings: standard, expanded, or refused with the
question.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from ballplate.simulator.design.measurement import reading_uncertainties
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.inputs.yamltree import GivenText
from ballplate.simulator.readings.reading_files import read_readings

from tests.extensions.laboratory import wording
from tests.extensions.laboratory.tables import DESIGN, QUICKSTART, rows_of


def uncertainties(
    heads: str, cells: str, separator: str = ",", **said: object
) -> tuple[list[float], str]:
    """Uncertainties in metres of a table of two readings, and how it was told to be read."""
    lines = [f"position,ball,probe,x_mm,y_mm,z_mm,{heads}"]
    lines += [f"z low,r1c{k},down,{100 * k}.1,200.25,250.125,{cells}" for k in (1, 2)]
    text = "\n".join(lines).replace(",", separator) + "\n"
    found = rows_of(GivenText("t.csv", text), **said)
    return [row.lengths[3] for row in found.rows], " ".join(found.told)


@pytest.mark.parametrize(
    ("heads", "cells", "expected"),
    [
        ("expanded_uncertainty_um,k", "0.9,2", 0.45e-6),
        ("k,expanded_uncertainty_um", "3,0.9", 0.3e-6),
        ("U_um,k", "0.9,2", 0.45e-6),
        ("U (k=2) [um]", "0.9", 0.45e-6),
        ("U [um] (k = 2.5)", "0.5", 0.2e-6),
        ("Unsicherheit (k=2) [nm]", "900", 0.45e-6),
        ("expanded_uncertainty_k2_um", "0.9", 0.45e-6),
        ("standard uncertainty (k=1) [um]", "0.4", 0.4e-6),
        *(
            (head, "0.4", 0.4e-6)
            for head in ("u_um", "u [um]", "standard_uncertainty_um", "u (µm)")
        ),
    ],
)
def test_expanded_uncertainties_are_divided_by_their_coverage_factors(
    heads: str, cells: str, expected: float
) -> None:
    for separator in (",", ";", "\t"):
        found, told = uncertainties(heads, cells, separator)
        assert found == pytest.approx([expected, expected], rel=1e-12)
        # Only these are standard ones.
        assert (wording.DIVIDED_BY_ITS_COVERAGE_FACTOR in told) == (expected != 0.4e-6)


@pytest.mark.parametrize(
    "head",
    ["U_um", "U [um]", "uncertainty_um", "Unsicherheit [um]", "U95_um", "u95_um", "U (95 %) [um]"]
    + ["u (k=2) [um]", "standard uncertainty (k=2) [um]"],
)
def test_what_does_not_say_which_uncertainty_it_is_is_refused(head: str) -> None:
    with pytest.raises(ExperimentError, match=wording.DOES_NOT_SAY_WHICH_UNCERTAINTY) as refused:
        uncertainties(head, "0.9")
    assert "standard_uncertainty_um" in str(refused.value)
    if "k=" in head:
        return
    # Who names the column says that it is the standard uncertainty.
    found, _ = uncertainties(head, "0.9", columns={"u": head})
    assert found == pytest.approx([0.9e-6, 0.9e-6])


@pytest.mark.parametrize(
    ("heads", "cells", "text"),
    [
        ("expanded_uncertainty_um", "0.9", "has no coverage factor"),
        ("expanded_uncertainty_um,k", "0.9,0", 'coverage factor is "0"; it must be above 0'),
        ("expanded_uncertainty_um,k", "0.9,two", 'coverage factor is "two"'),
        ("expanded_uncertainty_um,k", "0.9,", 'coverage factor is ""'),
        ("U (k=2) [um],k", "0.9,3", "stated more than once"),
        ("u_um,standard_uncertainty_um", "0.9,0.8", "could all be u"),
    ],
)
def test_coverage_factors_that_are_missing_or_wrong(heads: str, cells: str, text: str) -> None:
    with pytest.raises(ExperimentError, match="t.csv:[12]:1: ") as refused:
        uncertainties(heads, cells)
    assert text in str(refused.value)


def test_a_standard_uncertainty_goes_before_an_expanded_one() -> None:
    found, told = uncertainties("u_um,U (k=2) [um]", "0.4,0.9")
    assert found == pytest.approx([0.4e-6, 0.4e-6])
    assert 'not used: "U (k=2) [um]"' in told


def test_an_expanded_uncertainty_named_as_a_standard_one() -> None:
    with pytest.raises(ExperimentError, match="names standard uncertainties"):
        uncertainties("U (k=2) [um]", "0.9", columns={"u": "U (k=2) [um]"})


def test_an_uncertainty_of_all_rows_is_that_of_a_column(readings: pd.DataFrame) -> None:
    stated = QUICKSTART.with_readings({"columns": {"u": "=0.35 um"}}).readings
    plain, column = (
        read_readings(GivenText("t.csv", table.to_csv(index=False)), DESIGN, settings=settings)
        for table, settings in ((readings, stated), (readings.assign(u_um=0.35), None))
    )
    found, expected = (
        reading_uncertainties(one.design, one.design.readings) for one in (plain, column)
    )
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert any(wording.IS_UM_IN_ALL_ROWS in one for one in plain.remarks)


@pytest.mark.parametrize(
    ("columns", "text"),
    [
        ({"u": "=0.2"}, 'readings.columns.u: "0.2" has no unit; .* write for example "=0.2 um"'),
        ({"u": "=0 um"}, 'readings.columns.u: "0 um" must be above zero'),
        ({"ball": "=r1c1"}, "readings.columns.ball: a ball is that of a reading"),
    ],
)
def test_what_cannot_be_of_all_rows_is_refused(columns: dict[str, str], text: str) -> None:
    with pytest.raises(ExperimentError, match=text):
        QUICKSTART.with_(readings={"columns": columns})


def test_an_uncertainty_without_a_unit_is_not_taken_for_one_in_that_of_co_ordinates() -> None:
    for heads, cells in (("u", "0.2"), ("standard uncertainty", "0.0002"), ("u,D_mm", "0.2,20")):
        with pytest.raises(ExperimentError, match="has no unit"):
            uncertainties(heads, cells)
