"""`ballplate reproduce` as a user meets it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from ballplate.cli import main
from ballplate.extensions.reproduction.published import npl

from tests.extensions.reproduction import wording

NPL = ["reproduce", "npl"]


def test_section_6_quick(capsys: pytest.CaptureFixture[str]) -> None:
    wanted = [name for name in npl().sections if name.startswith("6")]
    chosen = [word for name in wanted for word in ("--experiment", name)]
    assert main([*NPL, "--quick", "--json", *chosen]) == 0
    out, err = capsys.readouterr()
    found = json.loads(out)
    assert err == "" and found["agrees"] and found["document"] == "NPL Report CISE 15/98"
    rows = found["comparisons"]
    # The synthetic data sets of 6.2.7 are left out.
    assert list(dict.fromkeys(row["section"] for row in rows)) == wanted[:-1]
    figures = [row for row in rows if row["quantity"].startswith("U")]
    assert len(figures) == sum(len(column.figures) for column in npl().columns)
    factors = {
        (row["table"], row["quantity"].removeprefix("factor, "), row["case"]): row["computed"]
        for row in rows
        if row["quantity"].startswith("factor")
    }
    for row in figures:
        factor = factors[row["table"], row["quantity"].split()[1], row["case"]]
        assert row["ratio"] == pytest.approx(row["published"] / row["computed"] / factor)
    for row in rows:
        compared = row["computed"] if row["ratio"] is None else row["ratio"]
        assert row["agrees"] and row["least"] <= compared
        assert row["largest"] is None or compared <= row["largest"]
        key = row["note"].removeprefix("see ")
        assert key == row["note"] or found["exceptions"][key]["reason"]
    ranks = {
        (row["section"], row["case"]): (row["published"], row["computed"])
        for row in rows
        if row["quantity"] == "rank deficiency"
    }
    assert ranks["6.1.1", "B"] == (2, 2) and ranks["6.2.1", "n=4 NDEL=7"] == (None, 6)
    # What nobody has explained is told as that.
    assert [key for key, one in found["exceptions"].items() if one["open"]] == ["2", "3"]


def test_text_of_one_experiment(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*NPL, "--experiment", "6.2.5"]) == 0
    out, err = capsys.readouterr()
    assert err == "" and "Section 6.2.5" in out and "Section 6.2.1" not in out
    assert "k: the two further" not in out and "l: the standard lies" in out
    rows = [line.split() for line in out.splitlines()]
    assert ["11", "U3", "average", "n=7", "NDEL=7", "30.557"] in [row[:6] for row in rows]
    assert any(row[:5] == ["11", "as", "headed,", "off", "by"] and "yes" in row for row in rows)


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
