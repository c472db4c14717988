"""Values of certificates in a file beside the readings count with whatever options."""

from __future__ import annotations

import json
from pathlib import Path

import ballplate as bp
import pandas as pd
import pytest
from ballplate.cli import main

QUICKSTART = "designs/quickstart.yaml"


@pytest.fixture(scope="module")
def experiment() -> bp.Experiment:
    return bp.quickstart()


@pytest.fixture(scope="module")
def readings(experiment: bp.Experiment) -> pd.DataFrame:
    return bp.simulate(experiment)


def test_options_of_tables_do_not_undo_a_certificate(
    readings: pd.DataFrame, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A side that is longer by 10 um is so by the estimates of both balls."""
    table = bp.certificate(QUICKSTART)
    table.loc[0, "value"] = f"{float(table['value'][0].split()[0]) + 0.01!r} mm"
    table.to_csv(tmp_path / "certificate.csv", index=False)
    readings.to_csv(tmp_path / "readings.csv", index=False)
    found = []
    for options in ([], ["--unit", "mm"]):
        files = [QUICKSTART, str(tmp_path / "readings.csv")]
        main(
            ["fit", *files, "--certificate", str(tmp_path / "certificate.csv"), "--json", *options]
        )
        found.append(json.loads(capsys.readouterr().out)["estimates"])
    assert found[0] == found[1]
    plain = bp.fit(QUICKSTART, readings).to_dict()["estimates"]
    assert abs(found[0]["r1c5: x"]["value"] - plain["r1c5: x"]["value"]) > 1e-6


SIDES = ["r1c1", "r1c5", "r5c5", "r5c1"]


def test_a_fit_names_exact_values_of_a_file_that_no_plate_has(
    experiment: bp.Experiment, readings: pd.DataFrame
) -> None:
    """Four sides and two diagonals of a plane square: five of them make the sixth."""
    pairs = [[a, b] for i, a in enumerate(SIDES) for b in SIDES[:i]]
    item = {"kind": "distances", "pairs": pairs, "standard_uncertainty": "0 um"}
    exact = experiment.with_(calibration=[item])
    right = pd.DataFrame(
        {
            "item": "calibration[0]",
            "first": [pair[0] for pair in pairs],
            "second": [pair[1] for pair in pairs],
            "value": [
                "1060.6601717798212 mm" if {a[1] == b[1], a[3] == b[3]} == {False} else "750 mm"
                for a, b in pairs
            ],
        }
    )
    assert bp.fit(exact, readings, certificate=right).converged
    # Both diagonals longer than those of a square: bending makes one of them shorter.
    wrong = right.copy()
    wrong.loc[wrong["value"].str.startswith("1060"), "value"] = "1060.67 mm"
    contradicted = bp.fit(exact, readings, certificate=wrong)
    assert not contradicted.converged and "values stated as exact" in str(contradicted)
