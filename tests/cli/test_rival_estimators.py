"""`fit --estimator` and `compare` as a user meets them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from ballplate.cli import main

QUICKSTART = "designs/quickstart.yaml"
COMPARED = ["compare", "designs/npl/6.2.7.yaml", "--variant", "5 x 5", "--trials", "4"]


@pytest.mark.parametrize("estimator", ["distances", "cresto", "kruth"])
def test_fit(estimator: str, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    readings = str(tmp_path / "r.csv")
    assert main(["simulate", QUICKSTART, "-o", readings]) == 0
    capsys.readouterr()
    assert main(["fit", QUICKSTART, readings, "--json"]) == 0
    full = json.loads(capsys.readouterr().out)["estimates"]
    assert main(["fit", QUICKSTART, readings, "--json", "--estimator", estimator]) == 0
    rival = json.loads(capsys.readouterr().out)
    assert rival["estimator"] == estimator and rival["status"] == "converged" and rival["rank_deficiency"] == 0
    differences = [value["value"] - full[name]["value"] for name, value in rival["estimates"].items()]
    assert len(differences) == 69
    sizes = [full[name]["standard_uncertainty"] for name in rival["estimates"]]
    # Distances hardly show the roll of X and what goes with it: there a rival is some ten times less certain.
    assert 0.1 < np.sqrt(np.mean(np.square(np.array(differences) / sizes))) < 20
    assert main(["fit", QUICKSTART, readings, "--estimator", estimator, "--monomials", "--pairs", "all"]) == 0
    out = capsys.readouterr().out
    assert "300 pairs of balls" in out and "EXX t^4" in out and max(map(len, out.splitlines())) <= 180


def test_compare(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*COMPARED, "--published-rms", "0.34713 um"]) == 0
    out, err = capsys.readouterr()
    assert "62 pairs of balls" in out and "root mean square" in out and "published" in out and "0.3471" in out
    assert err == "" or "data sets of 6.2.7[5 x 5]" in err
    assert main([*COMPARED, "--json", "--published-maximum", "1.3355 um"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["trials"] == 4 and found["not_converged"] == [] and len(found["rms"]["values"]) == 4
    assert 0 <= found["maximum"]["share_below_published"] <= 1 and "published" not in found["rms"]
    # More data sets add to those before.
    assert main([*COMPARED[:-1], "2", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["rms"]["values"] == found["rms"]["values"][:2]


def test_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in (["--trials", "0"], ["--estimator", "best"], ["--published-rms", "3"]):
        with pytest.raises(SystemExit) as caught:
            main([*COMPARED, *arguments])
        assert caught.value.code == 2
    capsys.readouterr()
    square = ["compare", "designs/npl/6.2.2.yaml", "--variant", "n=5 NDEL=5", "--trials", "1", "--pairs", "braced"]
    assert main(square) == 3
    assert '"braced" is not defined for this artefact' in capsys.readouterr().err


def test_repeats_of_a_length_standard_are_not_mistaken_for_other_readings(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    text = Path(QUICKSTART).read_text(encoding="utf-8").replace("  - {name: ", "  - {artefact: plate, name: ")
    bar = "  bar: {kind: two_spheres, length: 400 mm, role: length_standard}\n"
    place = "  - {name: bar, artefact: bar, pose: {origin: [300 mm, 200 mm, 300 mm]}, probes: [down], repeats: 3}\n"
    known = "  - {kind: distances, artefact: bar, pairs: all, standard_uncertainty: 0.1 um}\n"
    text = text.replace("artefacts:\n", f"artefacts:\n{bar}").replace("positions:\n", f"positions:\n{place}")
    file = tmp_path / "bar.yaml"
    text = text.replace("  - kind: distances\n", "  - kind: distances\n    artefact: plate\n")
    file.write_text(text.replace("calibration:\n", f"calibration:\n{known}"), encoding="utf-8")
    assert main(["compare", str(file), "--trials", "3", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["not_converged"] == [] and max(found["maximum"]["values"]) < 5e-6
