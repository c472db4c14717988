"""Error curves and budgets of machine files, against machines that have one error alone and draws."""

import re
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
import yaml
from ballplate.cli import main

MACHINE: dict[str, Any] = {
    "title": "moving bridge",
    "arrangement": "MB1",
    "volume": {"x": ["0 mm", "900 mm"], "y": ["0 mm", "1100 mm"], "z": ["0 mm", "400 mm"]},
    "reference_point": ["0 mm", "0 mm", "0 mm"],
    "probe": ["0 mm", "0 mm", "-100 mm"],
    "errors": {
        "EXX": {"polynomial": ["0 um", "8 um", "-2 um"], "bandwidth": "6 um", "sigmas": 3},
        "EYX": {"file": "eyx.csv"},
        "EBX": {"polynomial": ["0 urad", "10 urad"], "bandwidth": "3 urad"},
        "EZZ": {"bandwidth": "2 um"},
    },
    "squareness": {"EC0Y": {"value": "14 urad", "bandwidth": "2 urad"}, "EB0Z": "-24 urad"},
    "temperature": {
        "x": {"deviation": "0.5 K", "expansion": "10 um/m/degC", "standard_uncertainty": "0.1 K"}
    },
    "probing": "1 um",
}
TABLE = "position_mm,EYX_um\n0,0\n300,1.5\n700,-1\n850,0.5\n900,0\n"
ERRORS = [*MACHINE["errors"], *MACHINE["squareness"], "thermal x", "probing"]


def written(folder: Path, only: str = "") -> Path:
    """The machine, or one that has only one of its errors."""
    tree = dict(MACHINE)
    if only:
        for key in ("errors", "squareness"):
            tree[key] = {name: one for name, one in tree[key].items() if name == only}
        for key, name in (("temperature", "thermal x"), ("probing", "probing")):
            tree = {k: one for k, one in tree.items() if k != key or name == only}
        tree = {key: one for key, one in tree.items() if one != {}}
    (folder / "eyx.csv").write_text(TABLE, encoding="utf-8")
    path = folder / f"{only or 'all'}.yaml"
    path.write_text(yaml.safe_dump(tree), encoding="utf-8")
    return path


def rows(folder: Path, only: str = "", **more: Any) -> dict[str, dict[str, Any]]:
    data = bp.map(written(folder, only), budget=True, **more).to_dict()
    return {row["error"]: row for row in data["budget"]}


PLACES: list[dict[str, Any]] = [
    {"grid": (4, 3, 5)},
    {"line": "0 mm, 0 mm, 0 mm to 900 mm, 1100 mm, 400 mm", "points": 7},
]


@pytest.mark.parametrize("places", PLACES)
def test_each_row_is_the_machine_with_that_error_alone(
    tmp_path: Path, places: dict[str, Any]
) -> None:
    budget = rows(tmp_path, **places)
    assert list(budget)[-1] == "all" and set(budget) == {*ERRORS, "all"}
    for name in ERRORS:
        alone = bp.map(written(tmp_path, name), **places)
        resultants = np.linalg.norm(alone.errors.errors, axis=1)
        random = np.linalg.norm(alone.errors.uncertainties, axis=1)
        row = budget[name]
        assert row["rms"] == pytest.approx(np.sqrt((resultants**2).mean()), rel=1e-9, abs=1e-15)
        assert row["random_rms"] == pytest.approx(np.sqrt((random**2).mean()), rel=1e-9, abs=1e-15)
        # To first order: a length is not the sum of its parts to the last digit.
        assert row["length_error"] == pytest.approx(abs(alone.lengths.errors).max(), abs=1e-9)
        largest = alone.lengths.uncertainties.max()
        assert row["random_length_error"] == pytest.approx(largest, rel=1e-9, abs=1e-15)


def test_the_last_row_is_the_whole_machine(tmp_path: Path) -> None:
    budget, whole = rows(tmp_path), bp.map(written(tmp_path), draw=1000, seed=2)
    assert budget["all"]["rms"] == pytest.approx(
        np.sqrt((whole.errors.errors**2).sum(axis=1).mean()), rel=1e-9
    )
    assert budget["all"]["length_error"] == pytest.approx(abs(whole.lengths.errors).max(), abs=1e-9)
    drawn = whole.realisations
    spread = np.sqrt(np.array(drawn.errors).var(axis=0).sum(axis=1).mean())
    assert budget["all"]["random_rms"] == pytest.approx(spread, rel=0.03)
    lengths = np.array(drawn.lengths).std(axis=0).max()
    assert budget["all"]["random_length_error"] == pytest.approx(lengths, rel=0.05)


def test_the_command_prints_the_budget(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(written(tmp_path))
    assert main(["map", path, "--budget", "--grid", "2,2,2"]) == 0
    out = capsys.readouterr().out
    found = bp.map(path, (2, 2, 2), budget=True)
    assert out == "\n".join([*found.lines(), ""]) and "budget: rms of resultants" in out
    row = [line for line in out.splitlines() if line.startswith("EB0Z")][-1]
    alone = bp.map(written(tmp_path, "EB0Z"), (2, 2, 2)).errors.resultant
    assert float(re.split(r"\s{2,}", row)[2]) == pytest.approx(
        1e6 * np.sqrt((alone**2).mean()), rel=1e-3
    )
    assert main(["map", path]) == 0
    assert "budget" not in capsys.readouterr().out


def test_curves_are_those_of_the_file_at_the_reference_point(tmp_path: Path) -> None:
    found = bp.curves(written(tmp_path), points=8)
    curves = {one.name: one for one in found.functions.curves}
    assert list(curves) == [*MACHINE["errors"]]
    t = np.linspace(0.0, 1.0, 8)
    np.testing.assert_allclose(curves["EXX"].positions, 0.9 * t, atol=1e-15)
    np.testing.assert_allclose(curves["EXX"].values, 1e-6 * (8 * t - 2 * t**2), atol=1e-15)
    np.testing.assert_allclose(curves["EXX"].uncertainties, 2e-6)
    np.testing.assert_allclose(curves["EBX"].values, 1e-5 * t, atol=1e-15)
    np.testing.assert_array_equal(curves["EZZ"].values, 0.0)
    # Points of a table are among the positions.
    table = dict(zip(curves["EYX"].positions.tolist(), curves["EYX"].values.tolist(), strict=True))
    assert [table[x] for x in (0.3, 0.7, 0.85)] == pytest.approx([1.5e-6, -1e-6, 0.5e-6])
    square = {one.name: one for one in found.functions.squareness}
    assert (square["EC0Y"].value, square["EB0Z"].value) == pytest.approx((14e-6, -24e-6))
    assert square["EC0Y"].standard_uncertainty == pytest.approx(1e-6)
    (thermal,) = found.functions.numbers
    assert (thermal.value, thermal.standard_uncertainty) == pytest.approx((5e-6, 1e-6))
    assert [one.name for one in bp.curves(written(tmp_path), "EBX").functions.curves] == ["EBX"]
    with pytest.raises(ValueError, match='the machine has no error "EZY"'):
        bp.curves(written(tmp_path), "EZY")
