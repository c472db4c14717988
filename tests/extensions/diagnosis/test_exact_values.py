"""Values that are stated as exact and are wrong, as a slip of the pen makes them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
import yaml

QUICKSTART = Path("designs/quickstart.yaml")
SIDE, DIAGONAL = 750.0, float(np.hypot(750.0, 750.0))
FIVE = {
    ("r1c1", "r1c5"): SIDE,
    ("r5c1", "r5c5"): SIDE,
    ("r1c1", "r5c1"): SIDE,
    ("r1c5", "r5c5"): SIDE,
    ("r1c1", "r5c5"): DIAGONAL,
}
SIX = {**FIVE, ("r1c5", "r5c1"): DIAGONAL}


def stated(distances: dict[tuple[str, str], float], uncertainty: str = "0 um") -> dict[str, Any]:
    """An item with distances in millimetres."""
    return {
        "kind": "distances",
        "pairs": [list(pair) for pair in distances],
        "values": [
            {"balls": list(pair), "distance": f"{value!r} mm"} for pair, value in distances.items()
        ],
        "standard_uncertainty": uncertainty,
    }


def experiment(folder: Path, *items: dict[str, Any]) -> bp.Experiment:
    sections = yaml.safe_load(QUICKSTART.read_text(encoding="utf-8"))
    sections["calibration"] = list(items)
    (folder / "plate.yaml").write_text(yaml.safe_dump(sections), encoding="utf-8")
    found = bp.load(folder / "plate.yaml")
    assert isinstance(found, bp.Experiment)
    return found


def suspected(fit: bp.Fit) -> list[dict[str, Any]]:
    return list(fit.to_dict()["diagnosis"]["contradicted"])


@pytest.mark.parametrize(
    ("right", "pair", "wrong"),
    [
        ({("r1c1", "r1c5"): SIDE, ("r1c1", "r5c5"): DIAGONAL}, ("r1c1", "r5c5"), 1062.0),
        (FIVE, ("r1c1", "r5c5"), 1062.0),
        (FIVE, ("r1c5", "r5c5"), SIDE - 0.005),
        # The plate would have to be bent by more than a millimetre.
        (SIX, ("r1c1", "r1c5"), SIDE + 0.001),
    ],
)
def test_an_exact_value_that_is_wrong_is_named_as_one_that_is_let_go_shows_it(
    tmp_path: Path, right: dict[tuple[str, str], float], pair: tuple[str, str], wrong: float
) -> None:
    readings = bp.simulate(experiment(tmp_path, stated(right)))
    fit = bp.fit(experiment(tmp_path, stated({**right, pair: wrong})), readings)
    assert fit.too_large
    (one,) = suspected(fit)
    assert one["kind"] == "distance" and " to ".join(pair) in one["cause"]
    assert "stated as exact" in one["words"] and "check the certificate" in one["words"]
    # Without the value, the readings tell the distance.
    others = {key: value for key, value in right.items() if key != pair}
    free = bp.fit(experiment(tmp_path, stated(others)), readings)
    balls = dict(zip(free.design.balls.names, free.solution.state.balls, strict=True))
    told = float(np.linalg.norm(balls[pair[0]] - balls[pair[1]]))
    # To first order: what the plate is turned and bent by has a square that is left out.
    error = wrong / 1e3 - told
    (size,) = one["sizes"]
    assert abs(size["value"] - error) < size["standard_uncertainty"] + error**2 / (SIDE / 1e3)


def test_a_reading_that_is_wrong_beside_exact_values_is_named_and_they_are_not(
    tmp_path: Path,
) -> None:
    given = experiment(tmp_path, stated(FIVE))
    readings = bp.simulate(given)
    readings.loc[40, "x_mm"] += 0.02
    (one,) = suspected(bp.fit(given, readings))
    assert one["kind"] == "reading" and "exact" not in one["words"]


def test_exact_values_that_are_right_are_not_suspected(tmp_path: Path) -> None:
    given = experiment(tmp_path, stated(SIX))
    assert not suspected(bp.fit(given, bp.simulate(given)))


@pytest.mark.parametrize(("uncertainty", "is_exact"), [("0 um", True), ("0.2 um", False)])
def test_what_nothing_explains_may_be_exact_values_where_there_are_any(
    tmp_path: Path, uncertainty: str, is_exact: bool
) -> None:
    given = experiment(tmp_path, stated(FIVE, uncertainty))
    readings = bp.simulate(given)
    noise = 1e-3 * np.random.default_rng(5).standard_normal((len(readings), 3))
    readings[["x_mm", "y_mm", "z_mm"]] += noise
    fit = bp.fit(given, readings)
    assert fit.too_large and not fit.diagnosis.names_causes
    told = "stated as exact"
    assert any(told in one for one in fit.cautions) == is_exact
    failed = replace(fit, solution=replace(fit.solution, status="diverged"))
    assert (told in failed.complaint) == is_exact
