"""`ballplate reproduce` as a user meets it."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from ballplate.cli import main
from ballplate.extensions.reproduction.published import npl
from ballplate.presentation import number

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


def told(capsys: pytest.CaptureFixture[str], status: int, *options: str) -> str:
    """The text for one section, after a look whether its table has what the data have: in µm and
    µrad, of five digits, and of ratios four.
    """
    assert main([*NPL, *options]) == main([*NPL, *options, "--json"]) == status
    out, err = capsys.readouterr()
    text, _, data = out.partition("\n{")
    rows = json.loads("{" + data)["comparisons"]
    start = next(k for k, line in enumerate(text.splitlines()) if line.startswith("Section"))
    for line, row in zip(text.splitlines()[start + 2 :], rows, strict=False):
        low, high = row["least"], row["largest"]
        limits = f"at least {low:g}" if high is None else f"{low:g} to {high:g}"
        cells = [row[name] for name in ("table", "quantity", "case")]
        for value in filter(lambda value: value is not None, (row["published"], row["computed"])):
            cells.append(number(1e6 * value, 5) if row["unit"] else f"{value:.4g}")
        cells += [] if row["ratio"] is None else [number(row["ratio"], 4)]
        cells += [f"{low:g}" if low == high else limits, "yes" if row["agrees"] else "NO"]
        assert line.split() == " ".join([*cells, row["note"]]).split()
    assert "within 10 %, and the factor within 15 %, unless" in text
    tables = [table for table in npl().illegible if table in {row["table"] for row in rows}]
    assert re.findall(r"^Not legible .*: Table (\w+)", text, re.MULTILINE) == tables
    agree = sum(row["agrees"] for row in rows)
    assert err == "" and (agree == len(rows)) == (status == 0)
    assert text.rstrip().endswith(f": {agree} of {len(rows)}.")
    return text


def test_text_of_one_experiment(capsys: pytest.CaptureFixture[str]) -> None:
    out = told(capsys, 0, "--experiment", "6.2.5")
    assert "Section 6.2.5" in out and "Section 6.2.1" not in out
    assert "k: the two further" not in out and "l: the standard lies" in out
    assert out.count("Exceptions\nnone\n") == 1
    assert "Not legible" in told(capsys, 0, "--experiment", "6.2.6")


def test_what_differs_is_seen(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    for name in ("6.1.1", "6.1.2"):
        text = Path(f"designs/npl/{name}.yaml").read_text(encoding="utf-8")
        changed = text.replace("repeatability: 0.2 um", "repeatability: 0.3 um")
        (tmp_path / f"{name}.yaml").write_text(changed, encoding="utf-8")
    out = told(capsys, 1, "--experiment", "6.1.2", "--designs", str(tmp_path))
    assert wording.NOT_EVERYTHING_COMPARED_AGREES in out


def test_wrong_usage(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main([*NPL, "--experiment", "6.2.9"]) == 2
    assert wording.NO_EXPERIMENT_DID_YOU_MEAN in capsys.readouterr().err
    assert main([*NPL, "--designs", str(tmp_path / "none")]) == 3
    assert wording.NO_SUCH_FOLDER in capsys.readouterr().err
    assert main([*NPL, "--designs", str(tmp_path)]) == 3
    out, err = capsys.readouterr()
    assert out == "" and "5.2.yaml" in err
