"""Plates whose stated size is not the one that was read: the factor is named, not the balls."""

from pathlib import Path
from typing import Any

import ballplate as bp
import pytest
import yaml
from ballplate.simulator.inputs import ExperimentError
from ballplate.simulator.readings import read_readings

POSITIONS = [
    {"name": "a", "plane": "z", "level": "250 mm", "corner": {"x": "100 mm", "y": "100 mm"}},
    {"name": "b", "plane": "z", "level": "450 mm", "corner": {"x": "60 mm", "y": "80 mm"}},
    {"name": "c", "plane": "x", "level": "300 mm", "corner": {"y": "90 mm", "z": "70 mm"}},
]
TURNS = {"a": 0, "b": 1, "c": 0}


def tree(balls: tuple[int, int], size: tuple[float, float], probes: list[str]) -> dict[str, Any]:
    return {
        "title": "sizes",
        "machine": {"volume": ["1 m", "1 m", "1 m"], "repeatability": "1 um"},
        "error_model": {"kind": "metric"},
        "probes": {"p": ["0 mm", "0 mm", "-50 mm"], "q": ["30 mm", "10 mm", "-60 mm"]},
        "artefacts": {
            "plate": {"kind": "grid", "balls": [*balls], "size": [f"{one} mm" for one in size]}
        },
        "positions": [
            {**one, "quarter_turns": TURNS[str(one["name"])], "probes": probes} for one in POSITIONS
        ],
        "calibration": [{"kind": "coordinates", "standard_uncertainty": "1 um"}],
        "expected_rank_deficiency": 3,
        "evaluation": {"points": {"random": 20, "seed": 1}},
    }


def refusal(folder: Path, stated: dict[str, Any], table: Any) -> str:
    path = folder / "stated.yaml"
    path.write_text(yaml.safe_dump(stated), encoding="utf-8")
    table.to_csv(folder / "r.csv", index=False)
    experiment = bp.load(path)
    with pytest.raises(ExperimentError) as caught:
        read_readings(folder / "r.csv", bp.lay_out(experiment), True, experiment.readings)
    return str(caught.value).removeprefix(f"{folder / 'r.csv'}:")


def read(folder: Path, true: dict[str, Any]) -> Any:
    """Readings with noise of a plate that truly is as stated here."""
    path = folder / "true.yaml"
    path.write_text(yaml.safe_dump(true), encoding="utf-8")
    return bp.simulate(path, seed=1)


PITCH, OTHER = "is `size` the pitch? Correct artefacts.plate", "is its size right?"
SIZES: dict[str, Any] = {
    "pitch": ((3, 3), (200, 200), (100, 100), "2.00 times as large", PITCH),
    "pitch of four by three": (
        (4, 3),
        (300, 200),
        (100, 100),
        "3.00 times as large in x, 2.00 times as large in y",
        PITCH,
    ),
    "smaller": ((4, 4), (150, 150), (300, 300), "0.500 times as large", OTHER),
    "one side": (
        (3, 3),
        (300, 300),
        (300, 150),
        "1.00 times as large in x, 2.00 times as large in y",
        OTHER,
    ),
}


@pytest.mark.parametrize("name", SIZES)
@pytest.mark.parametrize("probes", [["p"], ["p", "q"]])
def test_the_factor_is_told_first_and_alone(tmp_path: Path, name: str, probes: list[str]) -> None:
    balls, true, stated, factor, question = SIZES[name]
    table = read(tmp_path, tree(balls, true, probes))
    text = refusal(tmp_path, tree(balls, stated, probes), table)
    assert text.startswith(f"2:1: all positions fit a plate {factor}: {question}")
    assert "name" not in text and "\n" not in text


@pytest.mark.parametrize("count", [1, 2])
def test_positions_alone(tmp_path: Path, count: int) -> None:
    true, stated = tree((3, 3), (200, 200), ["p"]), tree((3, 3), (100, 100), ["p"])
    for one in (true, stated):
        del one["positions"][count:]
    assert "plate 2.00 times as large" in refusal(tmp_path, stated, read(tmp_path, true))


def test_a_size_that_scales_would_explain_is_doubted(tmp_path: Path) -> None:
    """Nothing is far from its place, and the scales of the machine would be off by 5 %."""
    table = read(tmp_path, tree((3, 3), (200, 200), ["p"]))
    path = tmp_path / "stated.yaml"
    for size, doubted in ((190, True), (201, False)):
        path.write_text(yaml.safe_dump(tree((3, 3), (size, size), ["p"])), encoding="utf-8")
        told = " ".join(bp.fit(path, table).warnings)
        assert (
            "all positions fit a plate 1.05 times as large: is its size right?" in told
        ) == doubted
        assert ("times as large" in told) == doubted


def test_another_plate_is_as_stated(tmp_path: Path) -> None:
    true = tree((3, 3), (200, 200), ["p"])
    true["artefacts"]["large"] = {"kind": "grid", "balls": [3, 3], "size": ["500 mm", "500 mm"]}
    for k, one in enumerate(true["positions"]):
        one["artefact"] = "large" if k == 2 else "plate"
    true["calibration"] = [
        {"kind": "coordinates", "artefact": name, "standard_uncertainty": "1 um"}
        for name in ("plate", "large")
    ]
    table = read(tmp_path, true)
    true["artefacts"]["large"]["size"] = ["250 mm", "250 mm"]
    assert "all positions fit a large 2.00 times as large" in refusal(tmp_path, true, table)


def test_no_common_size_is_claimed_of_one_position(tmp_path: Path) -> None:
    true = tree((3, 3), (200, 200), ["p", "q"])
    table = read(tmp_path, true)
    rows, columns = table["position"] == "a", ["x_mm", "y_mm"]
    middle = table.loc[rows, columns].mean()
    table.loc[rows, columns] = middle + 1.6 * (table.loc[rows, columns] - middle)
    assert "as large" not in refusal(tmp_path, true, table)
