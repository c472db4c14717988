"""`ballplate reproduce` as a user meets it."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from ballplate.cli import main
from ballplate.extensions.reproduction.published import npl

from tests.extensions.reproduction import wording

NPL = ["reproduce", "npl"]


def test_section_6_quick(capsys: pytest.CaptureFixture[str]) -> None:
    wanted = [name for name in npl().statements.sections if name.startswith("6")]
    assert (
        main(
            [
                *NPL,
                "--quick",
                "--json",
                *(word for name in wanted for word in ("--experiment", name)),
            ]
        )
        == 0
    )
    out, err = capsys.readouterr()
    found = json.loads(out)
    assert err == "" and found["agrees"] and found["document"] == "NPL Report CISE 15/98"
    sections = {one["section"]: one for one in found["sections"]}
    assert list(sections) == wanted and all(one["agrees"] for one in sections.values())
    figures = [figure for one in sections.values() for figure in one["figures"]]
    assert len(figures) == sum(len(column.figures) for column in npl().columns)
    for figure in figures:
        assert figure["ratio"] == pytest.approx(figure["published"] / figure["ours"])
        assert (
            figure["agrees"]
            and figure["within"][0] <= figure["ratio_after_factor"] <= figure["within"][1]
        )
        assert set(figure["rests_on"]) <= set(found["assumptions"]) and {"a", "b", "c"} <= set(
            figure["rests_on"]
        )
        assert figure["exception"] is None or found["exceptions"][figure["exception"]]["reason"]
    ranks = {
        rank["design"]: (rank["published"], rank["ours"])
        for one in sections.values()
        for rank in one["ranks"]
    }
    assert ranks["6.1.1[B]"] == (2, 2) and ranks["6.2.1[n=4 NDEL=7]"] == ("some", 6)
    erratum = sections["6.2.2"]["errata"][0]
    assert erratum["confirmed"] and len(erratum["columns"]) == 6
    for one in erratum["columns"]:
        assert (
            one["deviation_as_meant"] < 0.02
            and one["deviation_as_headed"] > 4 * one["deviation_as_meant"]
        )
    # What nobody has explained is told as that.
    assert [key for key, one in found["exceptions"].items() if one["open"]] == ["2", "3"]
    (side,) = found["one_sided"]
    ratios = [
        one["ratio_after_factor"]
        for one in figures
        if (one["quantity"], one["statistic"]) == ("U4", "average")
    ]
    assert side["columns"] == side["above"] == len(ratios) == sum(ratio > 1 for ratio in ratios)
    assert (side["least_ratio"], side["largest_ratio"]) == (min(ratios), max(ratios))
    assert sections["6.2.7"]["left_out"]


def test_text_of_one_experiment(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*NPL, "--experiment", "6.2.5"]) == 0
    out, err = capsys.readouterr()
    assert err == "" and "Section 6.2.5" in out and "Section 6.2.1" not in out
    assert "Erratum in Table 11" in out and "Open differences" in out
    assert re.search(
        r"printed average U4 is above the computed one in all 2 columns: after the common factor by"
        r" 1\.0\d\d to 1\.0\d\d\. The report's points of section 6\.2 were few or not uniform",
        out,
    )
    tables = [line for line in out.splitlines() if "  " in line]
    assert max(map(len, tables)) <= 80
    assert any(
        line.split()[:6] == ["11", "U3", "average", "n=7", "NDEL=7", "30.557"] for line in tables
    )


def test_markdown(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*NPL, "--experiment", "5.2", "--experiment", "6.1.2", "--markdown"]) == 0
    out, _ = capsys.readouterr()
    assert out.startswith("# NPL Report CISE 15/98") and "\n## Section 6.1.2" in out
    heads = [line for line in out.splitlines() if line.startswith("| table |  | statistic")]
    assert len(heads) == 1 and heads[0].endswith("| rests on |")


def test_estimators_of_distances(capsys: pytest.CaptureFixture[str]) -> None:
    main([*NPL, "--experiment", "6.2.7", "--trials", "3"])
    out, _ = capsys.readouterr()
    assert wording.THE_QUANTILES_OF_DATA_SETS in out
    rows = [line for line in out.splitlines() if line.startswith(("5 x 5 ", "7 x 7 "))]
    assert len(rows) == 4 and max(map(len, rows)) <= 80


def test_what_differs_is_seen(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    for name in ("6.1.1", "6.1.2"):
        text = Path(f"designs/npl/{name}.yaml").read_text(encoding="utf-8")
        changed = text.replace("repeatability: 0.2 um", "repeatability: 0.3 um")
        (tmp_path / f"{name}.yaml").write_text(changed, encoding="utf-8")
    assert main([*NPL, "--experiment", "6.1.2", "--designs", str(tmp_path)]) == 1
    assert wording.NOT_EVERYTHING_COMPARED_AGREES in capsys.readouterr().out


def test_wrong_usage(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main([*NPL, "--experiment", "6.2.9"]) == 2
    assert wording.NO_EXPERIMENT_DID_YOU_MEAN in capsys.readouterr().err
    assert main([*NPL, "--designs", str(tmp_path / "none")]) == 3
    assert wording.NO_SUCH_FOLDER in capsys.readouterr().err
    assert main([*NPL, "--designs", str(tmp_path)]) == 3
    out, err = capsys.readouterr()
    assert out == "" and "5.2.yaml" in err
