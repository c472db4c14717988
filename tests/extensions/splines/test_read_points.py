"""Files of measured points: what is read, and what is said of those with mistakes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.splines.read_points import Column, choose_points, read_points
from ballplate.simulator.inputs.messages import ExperimentError

from tests.extensions.splines import wording


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return Path("data.csv")


def told(path: Path, text: str, x: str | None = None, y: str | None = None) -> list[str]:
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ExperimentError) as error:
        read_points(path, x, y)
    return [str(message) for message in error.value.messages]


def test_an_abscissa_and_an_error(write: Path) -> None:
    write.write_text("# laser\nposition_mm,EXX_um,note\n0,0,start\n 250,0.8,\n", encoding="utf-8")
    points = read_points(write)
    assert (
        points.x is not None
        and points.x.tolist() == [0.0, 0.25]
        and points.y.tolist() == [0.0, 8e-7]
    )
    assert points.names == ("1", "2") and points.places is None and points.uncertainties is None
    assert (
        points.x_column == Column("position", "mm", 1e-3, "length")
        and points.y_column.words == "EXX"
    )


def test_a_profile_an_uncertainty_and_a_choice_of_errors(write: Path) -> None:
    write.write_text(
        "point,x_mm,z_in,first_um,second_um,u_nm\na,1,1,2,3,50\nb,2,1,2,4,60\n", encoding="utf-8"
    )
    points = read_points(write, y="second_um")
    assert points.x is None and points.x_column == Column("arc_length", "mm", 1e-3, "length")
    assert points.places is not None and points.places.tolist() == [
        [0.001, 0.0254],
        [0.002, 0.0254],
    ]
    np.testing.assert_allclose(points.uncertainties, [5e-8, 6e-8])
    assert points.names == ("a", "b") and points.y.tolist() == [3e-6, 4e-6]
    along_z = read_points(write, x="z", y="first")
    assert along_z.x is not None and along_z.x.tolist() == [0.0254, 0.0254]
    assert told(write, write.read_text(encoding="utf-8")) == [
        wording.SEVERAL_COLUMNS_MAY_BE_THE_ERROR
    ]


def test_rows_with_mistakes_are_told_all_at_once(write: Path) -> None:
    text = "point,position_mm,error_um,u_um\n1,0,1,0.1\n1,1,x,0.1\n3,2,,0.1\n4,3\n5,4,1,0\n6,5,2,1e30\n"
    assert told(write, text) == [
        wording.IS_NOT_A_NUMBER,
        wording.A_SECOND_POINT_AS_IN_LINE,
        wording.NO_ERROR_WRITE,
        (wording.COLUMNS_INSTEAD_OF_WRITE_ONE_LINE),
        wording.IS_NOT_A_STANDARD,
        (wording.IS_BEYOND_WHAT_CAN_BE_COMPUTED),
    ]


@pytest.mark.parametrize(
    ("text", "x", "y", "message"),
    [
        (
            "",
            None,
            None,
            "data.csv: the file is empty; its first line should be position_mm,error_um",
        ),
        ("position_mm|error_um\n", None, None, "there is an error but no abscissa"),
        (
            "position,error_um\n1,2\n",
            None,
            None,
            "there is an error but no abscissa; position has no unit",
        ),
        (
            "position_mm,error\n1,2\n",
            None,
            None,
            "there is an error but no abscissa; error has no unit",
        ),
        ("position_mm\n1\n", None, None, "there is an error but no abscissa"),
        (
            "position,error\n1,2\n",
            None,
            None,
            "no column is left for the error; its name needs a unit",
        ),
        ("a_mm,b_um,c_um\n1,2,3\n", None, "d", 'no column "d" for --y; known: a, b, c'),
        (
            "a_mm,error,c_um\n1,2,3\n",
            None,
            "error",
            'the column "error" has no unit of length or angle',
        ),
        ("a_mm,b_um\n1,2\n", "b", "b", "b is chosen for x and for y"),
        ("a_mm,b_um\n1,2\n", "arc_length", "b", "the arc length needs a profile"),
        ("a_mm,a_um\n1,2\n", None, None, 'a second column "a_um"; remove one'),
        ("a_mm,b_um,u_urad\n1,2,3\n", None, None, "the uncertainty is an angle and b a length"),
        ("a_mm,b_um\n", None, None, "no rows below the names of the columns"),
    ],
)
def test_files_that_cannot_be_used(
    write: Path, text: str, x: str | None, y: str | None, message: str
) -> None:
    found = told(write, text, x, y)
    assert len(found) == 1 and message in found[0]


def test_decimals_and_separators_of_two_kinds_are_told(write: Path) -> None:
    assert told(write, 'position_mm,error_um\n10,2.0\n30,4,11\n40,"5,3"\n50;6\n60,7;8\n') == [
        (wording.COLUMNS_INSTEAD_OF_IF_A_COMMA),
        'data.csv:4:4: "5,3" has a decimal comma; write 5.3',
        wording.COLUMNS_INSTEAD_OF_SEPARATE_THEM,
        wording.IS_NOT_A,
    ]


def test_an_experiment_is_no_table(tmp_path: Path) -> None:
    path = tmp_path / "mine.yml"
    path.write_text("title: t\n", encoding="utf-8")
    with pytest.raises(ExperimentError, match=wording.THIS_IS_YAML):
        read_points(path)


def test_points_by_name(write: Path) -> None:
    write.write_text(
        "point,a_mm,b_um\n" + "".join(f"{k},1,0\n" for k in (1, 2, 3, 7, "end")), encoding="utf-8"
    )
    points = read_points(write)
    assert choose_points(points, "2-7", "data.csv") == [1, 2, 3]
    assert choose_points(points, "end, 1,2-3", "data.csv") == [0, 1, 2, 4]
    with pytest.raises(ExperimentError) as error:
        choose_points(points, "4-6, enf, 1", "data.csv")
    assert [message.text for message in error.value.messages] == [
        'no points "4-6"; known: 1, 2, 3, 7, end',
        wording.NO_POINT_DID_YOU_MEAN,
    ]
