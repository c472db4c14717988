"""The joint table has the values of each design's own tables, and all that qualifies them."""

from __future__ import annotations

import csv
import math
import re
from pathlib import Path

import ballplate as bp
import pandas
import pytest
from ballplate.cli import main
from ballplate.cli.run import MORE, TABLES

NPL, QUICKSTART = "designs/npl/6.1.1.yaml", "designs/quickstart.yaml"
FILES = (
    (NPL,),
    (QUICKSTART, "designs/hurt_foss/bar-bell.yaml", "tests/cli/files/flat.yaml"),
    (NPL, NPL),
)
NUMBER = r"(?<![\w.])\d+(\.\d+)?(?!\w)"


@pytest.mark.parametrize("files", FILES, ids=" ".join)
def test_values_and_what_qualifies_them_are_those_of_each_design(
    files: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    predictions = [bp.run(design) for file in files for design in bp.load_all(file)]
    status = main(["run", *files, "--table", str(tmp_path / "t.csv")])
    assert status == int(any(not p.verdict.as_expected for p in predictions))
    printed = capsys.readouterr().out.splitlines()
    with (tmp_path / "t.csv").open(encoding="utf-8", newline="") as stream:
        header, *rows = csv.reader(stream)
    for column, p in enumerate(predictions, start=3):
        cells = {tuple(row[:3]): row[column] for row in rows}
        assert cells["", "rank deficiency", ""] == str(p.verdict.deficiency)
        assert cells["", "rank as expected", ""] == str(p.verdict.as_expected)
        for symbol, q in p.quantities.items():
            if ", " not in q.unit:
                for kind, value in (("maximum", q.maximum), ("average", q.average)):
                    text = cells.pop((symbol, kind, q.unit))
                    assert text == ("" if math.isnan(value) else repr(value))
            if q.undetermined and ", " not in q.unit:
                assert cells.pop((symbol, "undetermined", "")) == f"{q.undetermined} of {q.count}"
            if q.within_target is not None:
                share = cells.pop((symbol, f"within target (k = {q.coverage_factor:g})", ""))
                assert float(share[:-2]) == pytest.approx(100 * q.within_target, abs=0.01)
        # What other designs have is blank.
        assert not any(text for (symbol, *_), text in cells.items() if symbol[:1] == "U")
        for line in p.qualified:
            words = re.sub(NUMBER, "#", line)
            (found,) = (
                text
                for text in printed
                if re.sub(rf"{NUMBER}( / {NUMBER})*", "#", text).endswith(words)
                and (text == line or header[column] in text.partition(": ")[0].split(", "))
            )
            assert {each[0] for each in re.finditer(NUMBER, line)} <= set(found.split())


def test_an_unexpected_deficiency_is_explained_and_an_expected_one_counted() -> None:
    expected = bp.load(NPL, "B")
    surprise = bp.run(expected.with_({"expected_rank_deficiency": 0}))
    table = bp.joint_table(surprise, bp.run(bp.quickstart()))
    assert [note for note in table.notes if note.startswith("B: undetermined 2: EXX")]
    assert any("B: rank deficiency 2, expected full rank" in note for note in table.notes)
    assert not [note for note in bp.joint_table(bp.run(expected)).notes if "undetermined 2" in note]


@pytest.mark.parametrize("name", ["unit", "=1+1", "sizes, mm", "a" * 61, "bell \\a"])
def test_names_that_are_no_headings_become_numbers(name: str, tmp_path: Path) -> None:
    text = Path(QUICKSTART).read_text(encoding="utf-8")
    (tmp_path / "odd.yaml").write_text(
        f'{text}\nvariants: {{"{name}": {{}}, plain: {{}}}}\n', "utf-8"
    )
    odd, plain = map(bp.run, bp.load_all(tmp_path / "odd.yaml"))
    for two in ((odd, plain), (plain, plain)):
        table = bp.joint_table(*two)
        assert table.names == ["1", "2"] and f"1: {two[0].label}" in table.notes
        table.write_to(tmp_path / "t.xlsx")
        assert list(pandas.read_excel(tmp_path / "t.xlsx"))[3:] == ["1", "2"]


def test_every_form_has_the_values(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for suffix in TABLES:
        path = tmp_path / f"t{suffix}"
        assert main(["run", QUICKSTART, "--table", str(path)]) == 0
        assert main(["run", QUICKSTART, "--table", str(path)]) == 3
        if suffix == ".xlsx":
            text = pandas.read_excel(path).to_csv()
        else:
            text = path.read_text(encoding="utf-8")
        assert re.search(r"0\.1426|1\.426\d+e-07", text) and "chain of axes MB2" in text
        assert ("\\toprule" in text) == (suffix == ".tex")
    assert main(["run", QUICKSTART, "--table", str(tmp_path / "t.ods")]) == 2
    assert "t.ods should end in .csv, .xlsx" in capsys.readouterr().err


def test_replicates_follow_by_design_and_blocks_without_the_extension(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    two = ["run", QUICKSTART, QUICKSTART]
    assert main([*two, "--trials=2", "--workers=1", "--assumptions"]) == 0
    joint = capsys.readouterr().out
    heading = "\n\nquickstart: 5 x 5 ball plate in six positions\n"
    assert joint.count(MORE) == 1 and joint.count(f"{heading}Monte Carlo: 2 data sets") == 2
    monkeypatch.setattr("ballplate.cli.run.optional_service", lambda name: None)
    assert main(two) == 0
    blocks = capsys.readouterr().out
    assert MORE not in blocks and blocks.count("U6  distances between corrected points") == 2
