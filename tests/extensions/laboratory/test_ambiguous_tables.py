"""Tables that could mean two things are refused with the question; whatever is read has one
meaning.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from ballplate.extensions.laboratory.any_table import TableRows
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.inputs.yamltree import GivenText
from hypothesis import example, given, settings, strategies as st

from tests.extensions.laboratory import wording
from tests.extensions.laboratory.tables import rows_of

HEAD = "position;ball;probe;x_mm;y_mm;z_mm\n"


def read(text: str | bytes, path: Path | None = None, **said: object) -> TableRows:
    if path is None:
        return rows_of(GivenText("t.csv", str(text)), **said)
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return rows_of(path, **said)


def numbers(found: TableRows) -> list[float]:
    return [round(1e3 * x, 9) for row in found.rows for x in row.lengths[:3]]


def asked(text: str | bytes, path: Path | None = None, **said: object) -> str:
    with pytest.raises(ExperimentError) as refused:
        read(text, path, **said)
    return str(refused.value)


@pytest.mark.parametrize("cell", ["1,012.5", "1'012.5", "1.0125,5", "1.012.5"])
def test_signs_between_thousands_of_two_kinds_are_refused_in_words(cell: str) -> None:
    text = HEAD + f"z low;r1c1;down;{cell};100,2;250\nz low;r1c2;down;5,25;100,2;250\n"
    assert f'2:1: "{cell}"' in asked(text)


@pytest.mark.parametrize(
    "cell",
    ["1.012,5", "1 012,5", "1\u00a0012,5", "1\u202f012,5", "1'012,5", "1\u2019012,5"]
    + ["1,012.5", "1'012.5"],
)
def test_signs_between_thousands_are_read(cell: str) -> None:
    sign = cell[-2]
    text = HEAD + f"z low;r1c1;down;{cell};100{sign}2;250\nz low;r1c2;down;5{sign}25;-{cell};250\n"
    found = read(text)
    assert numbers(found) == [1012.5, 100.2, 250.0, 5.25, -1012.5, 250.0]
    assert "between thousands" in found.told[0]
    # All of a column have them, or none.
    mixed = asked(text.replace(f"5{sign}25", f"1125{sign}5"))
    assert f'"{" ".join(cell.split())}" {wording.HAS_SIGNS_BETWEEN_THOUSANDS}' in mixed


def test_two_kinds_of_decimals() -> None:
    text = HEAD + "z low;r1c1;down;1,5;2,5;3,5\nz low;r1c2;down;4,5;2.25;3,5\n"
    assert wording.HAS_A_DECIMAL in asked(text)


def test_commas_that_separate_columns_and_decimals() -> None:
    """With as many further columns as there are decimals, every row has the right width."""
    text = (
        "position,ball,probe,x [mm],y [mm],z [mm],dx,dy,dz\n"
        + "z low,r1c1,down,612,345,100,234,250,1\n" * 2
    )
    assert numbers(read(text, decimal="point"))[:3] == [612, 345, 100]
    short = text.replace(",dx,dy,dz", "")
    assert wording.COLUMNS_INSTEAD_OF in asked(short)


def test_commas_with_blanks_behind_them() -> None:
    """They separate columns, also of whole numbers."""
    text = "unit: mm\nposition, ball, probe, x, y, z\nhigh, 17, down, 612, 345, 100\n"
    (row,) = read(text).rows
    assert row.texts == ("high", "17", "down") and row.lengths[:3] == (0.612, 0.345, 0.1)


def test_two_columns_of_one_name() -> None:
    text = "position;ball;probe;x_mm;x actual [mm];y_mm;z_mm\nz low;r1c1;down;1,5;1,6;2;3\n"
    assert wording.COULD_ALL_BE in asked(text)
    found = read(text, columns={"x": "x actual"})
    assert numbers(found) == [1.6, 2.0, 3.0]


def test_lengths_without_a_unit() -> None:
    text = HEAD.replace("_mm", "") + "z low;r1c1;down;1,5;2,5;3\n"
    assert wording.NO_UNIT_IS_STATED in asked(text)
    assert numbers(read(text, unit="in"))[0] == pytest.approx(38.1)
    both = "unit: inch\n" + text
    assert numbers(read(both))[0] == pytest.approx(38.1)
    assert wording.LENGTHS_ARE_IN in asked(both, unit="mm")


def test_columns_that_are_missing_are_named_beside_those_there() -> None:
    text = "Lage;Taster;X [mm];Y [mm];Z [mm]\nz low;down;1,5;2,5;3\n"
    assert (wording.COLUMNS_FOUND_MISSING) in asked(text)
    assert wording.MISSING_BALL_AND_AXES in asked("A;B;C\n1;2;3\n")


def test_columns_by_name_number_and_constant() -> None:
    text = "A;B;C;D;E\n17;1,5;2,5;3,5;x\n"
    columns = {"position": "=z low", "ball": "A", "probe": "=down", "x": "B", "y": "C", "z": "4"}
    (row,) = read(text, columns=columns, unit="mm").rows
    assert row.texts == ("z low", "17", "down") and row.lengths[:3] == (0.0015, 0.0025, 0.0035)
    bare = "17 1.5 2.5 3.5\n18 4.5 5.5 6.5\n"
    columns |= {"ball": "1", "x": "2", "y": "3", "z": "4"}
    assert numbers(read(bare, columns=columns, unit="mm", header=0))[3] == 4.5
    assert wording.THERE_IS_NO_COLUMN in asked(text, columns=columns | {"x": "F"})


def test_lines_among_the_rows_that_say_something() -> None:
    """A title in between would make the rows below those of another position."""
    rows = "r1c1;down;1,5;2,5;3,5\n"
    text = "Position: z low\nball;probe;x_mm;y_mm;z_mm\n" + rows
    assert read(text).rows[0].texts[0] == "z low"
    assert wording.A_LINE_WITHOUT_CO_ORDINATES_AMONG in asked(text + "Position: z high\n" + rows)
    full = HEAD + "z low;r1c1;down;1,5;2,5;3,5\nz high;;;;;\nz low;r1c2;down;1,5;2,5;3,5\n"
    assert wording.A_LINE_WITHOUT_CO_ORDINATES_AMONG in asked(full)


def test_rows_that_were_cut_off() -> None:
    assert "instead of 6" in asked(HEAD + "z low;r1c1;down;1,5;2,5;3,5\nz low;r1c2;down;1,5;2")


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"PK\x03\x04\x14\x00", "is a workbook"),
        (b"\x00a\x01", "control character U+0000"),
        ((HEAD + "z low;r1c1;down;\x07;1;2\n").encode(), "the control character"),
        (HEAD.encode(), "no rows below"),
        (b"\xff\xfe", "the file is empty"),
        (b"", "the file is empty"),
        (b"nothing of the kind\n", "missing: ball, x, y, z"),
    ],
)
def test_files_that_are_no_tables(tmp_path: Path, content: bytes, told: str) -> None:
    assert told in asked(content, tmp_path / "t.csv")


def test_an_encoding_that_is_stated(tmp_path: Path) -> None:
    text = HEAD.replace("ball", "kulička") + "z low;r1c1;down;1,5;2,5;3,5\n"
    columns = {"ball": "kulička"}
    path = tmp_path / "t.csv"
    found = read(text.encode("cp1250"), path, encoding="cp1250", columns=columns)
    assert found.rows[0].texts[1] == "r1c1"
    assert wording.IS_NOT_IN_THE_ENCODING in asked(text.encode("cp1250"), path, encoding="utf-8")
    marked = read(text.encode("utf-8-sig"), path, encoding="utf-8", columns=columns)
    assert marked.rows[0].texts[1] == "r1c1"


FORMS = st.sampled_from([(";", ","), (";", "."), ("\t", ","), ("\t", "."), ("|", ","), (",", ".")])
VALUES = st.integers(-99_999_999, 999_999_999)
NAMES = st.text("abcXYZ 0123456789-_äµ.,;'\"", min_size=1, max_size=8).filter(
    lambda name: name.strip() == name and name[0] not in "#'=-"
)


@settings(max_examples=100, deadline=None)
@given(
    FORMS,
    st.lists(st.tuples(NAMES, NAMES, VALUES, VALUES, VALUES), min_size=1, max_size=5),
    st.integers(0, 6),
    st.sampled_from(["x_mm", "X [mm]", "x/mm", "x in mm"]),
    st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "cp1252"]),
)
@example(
    form=(";", ","),
    rows=[("a", "b", 612345, 100234, 250001)],
    digits=3,
    head="x_mm",
    encoding="utf-8",
)
def test_whatever_is_read_is_what_was_written(
    tmp_path_factory: pytest.TempPathFactory,
    form: tuple[str, str],
    rows: list[tuple[str, str, int, int, int]],
    digits: int,
    head: str,
    encoding: str,
) -> None:
    """A table that the reader takes has the numbers and names that were written, whatever its
    form.
    """
    separator, sign = form

    def quoted(name: str) -> str:
        return '"' + name.replace('"', '""') + '"' if any(c in name for c in '",;|\t') else name

    def written(value: int) -> str:
        text = f"{abs(value):0{digits + 1}}"
        whole, part = (text, "") if not digits else (text[:-digits], text[-digits:])
        return ("-" if value < 0 else "") + whole + (sign + part if part else "")

    heads = ["position", "ball", "probe", *(head.replace("x", a).replace("X", a) for a in "xyz")]
    lines = [separator.join(heads)]
    lines += [
        separator.join([quoted(one), quoted(two), "down", *map(written, xyz)])
        for one, two, *xyz in rows
    ]
    path = tmp_path_factory.getbasetemp() / "t.csv"
    try:
        found = read(("\n".join(lines) + "\n").encode(encoding), path)
    except ExperimentError:
        return
    assert [row.texts[:2] for row in found.rows] == [(one, two) for one, two, *_ in rows]
    expected = [value / 10**digits for _, _, *xyz in rows for value in xyz]
    assert numbers(found) == pytest.approx(expected, rel=1e-12, abs=1e-9)


@settings(max_examples=200, deadline=None)
@given(
    st.one_of(
        st.binary(max_size=200),
        st.text('positionbalprexyz_m;,|\t\n "0123456789.-#[]', max_size=200).map(str.encode),
        st.tuples(st.binary(max_size=6), st.integers(0, 120)).map(
            lambda both: (
                (HEAD + "z low;r1c1;down;1,5;2,5;3,5\n" * 2).encode()[: both[1]]
                + both[0]
                + (HEAD + "z low;r1c1;down;1,5;2,5;3,5\n" * 2).encode()[both[1] :]
            )
        ),
    )
)
def test_no_table_makes_it_fail(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    try:
        found = read(content, tmp_path_factory.getbasetemp() / "t.csv")
    except ExperimentError as error:
        assert error.messages
        return
    assert found.rows
