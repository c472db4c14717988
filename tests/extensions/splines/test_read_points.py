"""Files of measured points: what is read, and what is said of those with mistakes."""

from __future__ import annotations

from pathlib import Path

import pytest
from ballplate.extensions.splines.read_points import choose_points, read_points
from ballplate.simulator.inputs.messages import ExperimentError


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
    write.write_text("# laser\nposition_mm,EXX_um\n0,0\n 250,0.8\n", encoding="utf-8")
    points = read_points(write)
    assert points.x is not None and points.places is None
    assert points.x.tolist() == [0.0, 0.25] and points.y.tolist() == [0.0, 8e-7]
    assert points.names == ("1", "2") and (points.x_name, points.y_name) == ("position", "EXX")


def test_a_profile_and_a_choice_of_errors(write: Path) -> None:
    header = "point,feature,nominal_x_mm,nominal_z_in,first_um,second_um"
    write.write_text(f"{header}\na,cone,1,1,,3\nb,face,2,1,2,4\n", encoding="utf-8")
    points = read_points(write, y="second_um")
    assert points.x is None and points.x_name == "arc_length" and points.places is not None
    assert points.places.tolist() == [[0.001, 0.0254], [0.002, 0.0254]]
    assert points.names == ("a", "b") and points.features == ("cone", "face")
    assert points.y.tolist() == [3e-6, 4e-6]
    along_z = read_points(write, x="nominal_z", y="second")
    assert along_z.x is not None and along_z.x.tolist() == [0.0254, 0.0254]
    (several,) = told(write, write.read_text(encoding="utf-8"))
    assert several.endswith("may be the error: first, second; choose one with --y")


@pytest.mark.parametrize(
    ("text", "x", "y", "message"),
    [
        ("", None, None, "data.csv: the file is empty; its first line should be position_mm,"),
        ("position,error_um\n1,2\n", None, None, "abscissa and error are two columns whose names"),
        ("position_mm\n1\n", None, None, "abscissa and error are two columns whose names"),
        ("a_mm,b_um\n1,2\n", "b", "b", "abscissa and error are two columns whose names"),
        ("a_mm,b_um,c_um\n1,2,3\n", None, "d", 'no column "d" with a unit of length for --y'),
        ("a_mm,b_um\n1,2\n", "arc_length", "b", "the arc length needs a profile"),
        ("a_mm,b_um,note\n1,2,3\n", None, None, 'data.csv:1:11: unknown column "note"'),
        ("a_mm,b_um\n1,2\n3,x\n", None, None, 'data.csv:3:3: "x" is not a number'),
        ("point,a_mm,b_um\n1,1,2\n1,2,2\n", None, None, 'data.csv:3:1: a second point "1"'),
    ],
)
def test_files_that_cannot_be_used(
    write: Path, text: str, x: str | None, y: str | None, message: str
) -> None:
    (found,) = told(write, text, x, y)
    assert message in found


def test_points_by_name(write: Path) -> None:
    write.write_text(
        "point,a_mm,b_um\n" + "".join(f"{k},1,0\n" for k in (1, 2, "b-1", 7, "end")), "utf-8"
    )
    points = read_points(write)
    assert choose_points(points, "2-7", "data.csv") == [1, 2, 3]
    assert choose_points(points, "end, 1,b-1", "data.csv") == [0, 2, 4]
    for text, name in (("1-6", "6"), ("enf, 1", "enf"), ("-7", "-7")):
        with pytest.raises(ExperimentError, match=f'data.csv: no point "{name}"'):
            choose_points(points, text, "data.csv")
