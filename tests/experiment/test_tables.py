"""CSV tables: columns with units, and messages with line and column."""

from pathlib import Path

import pytest
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.inputs.tables import read_table


@pytest.fixture
def table(tmp_path: Path) -> Path:
    return tmp_path / "t.csv"


def test_units_quotes_and_comments(table: Path) -> None:
    table.write_text(
        '# certificate\nx_mm,"ball",y_µm\n\n0.3, a ,1\n-1e3,"b, ""c""",2\n', encoding="utf-8"
    )
    rows = read_table(table, ["ball"], ["x", "y"], ["z"])
    assert [row.texts for row in rows] == [("a",), ('b, "c"',)]
    assert [row.lengths for row in rows] == [(0.0003, 1e-6, 0.0), (-1.0, 2e-6, 0.0)]
    assert [row.mark.line for row in rows] == [4, 5]


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("", [":1:1: the file is empty; its first line should be ball,x_mm"]),
        ("ball,x_mm\n", [":1:1: no rows below the names of the columns; add at least one"]),
        ("ball|x_mm\na|1\n", [
            ':1:1: unknown column "ball|x_mm"; did you mean "x_mm"?',
            ":1:1: no column for ball, x; the first line should be ball,x_mm",
        ]),
        ("ball,x\na,1\n", [':1:6: the column "x" has no unit; write for example x_mm']),
        ("ball,x_MM\na,1\n", [':1:6: unknown unit in the column "x_MM"; did you mean "mm"?']),
        ("bal,x_mm\na,1\n", [
            ':1:1: unknown column "bal"; did you mean "ball"?',
            ":1:1: no column for ball; the first line should be ball,x_mm",
        ]),
        ("ball,x_mm,x_um\na,1,1\n", [':1:11: a second column "x_um"; remove one of them']),
        ("ball,x_mm\na\nb, one\n,3\n", [
            ":2:1: 1 columns instead of 2; write one line per row, its columns separated by commas",
            ':3:4: "one" is not a number; write for example "500.0003"',
            ":4:1: no ball; write its name",
        ]),
        ('ball,x_mm\n"a,1\n', [
            ":2:1: a quotation mark too many; write one line per row, its columns separated by commas",
        ]),
    ],
)  # fmt: skip
def test_messages(table: Path, text: str, lines: list[str]) -> None:
    table.write_text(text)
    with pytest.raises(ExperimentError) as caught:
        read_table(table, ["ball"], ["x"])
    assert str(caught.value).split("\n") == [f"{table}{line}" for line in lines]
