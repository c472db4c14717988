"""Positions that drafts begin with: near a plan, readable by name, in two dimensions as well."""

from __future__ import annotations

from pathlib import Path

import ballplate as bp
import pytest
from ballplate.cli import main
from ballplate.simulator.machines import ARRANGEMENTS

from tests.extensions.drafting.sheets import BRIDGE, FLAT, options

SHAPES = {
    "cube": {"volume": "500 500 500 mm", "plate": "5 x 5, 250 mm"},
    "small": {"volume": "500 400 300 mm", "plate": "5 x 5, 200 mm"},
    "bridge": {},
    "arm": {
        "machine_type": "horizontal arm",
        "volume": "1 x 2.5 x 1.5 m",
        "mpe": "10 um + L/100",
    },
    "gantry": {"machine_type": "gantry", "volume": "2 x 3 x 1 m", "mpe": "3 um + L/250"},
}
# Quarters of the free room, and turns: what the start is compared with.
QUARTERS = ["low", "25 %", "middle", "75 %", "high"]
PROBES = {"x": ["right", "left"], "y": ["back", "front"], "z": ["down"]}
IN_PLANE = {"x": "yz", "y": "zx", "z": "xy"}


@pytest.mark.long
@pytest.mark.parametrize("name", SHAPES)
def test_the_start_is_near_a_plan_of_its_size(name: str) -> None:
    drafted = bp.design(**BRIDGE | SHAPES[name])
    candidates = [
        {
            "name": f"grid {plane} {turn}",
            "planes": [plane],
            "levels": QUARTERS,
            "corners": dict.fromkeys(IN_PLANE[plane], QUARTERS),
            "quarter_turns": turn,
            "probes": [probe for probe in PROBES[plane] if probe in drafted.probes],
        }
        for plane in "xyz"
        for turn in (0, 1)
    ]
    pool = {"candidates": candidates, "limits": {"edge": "0 mm"}}
    planned = bp.plan(drafted.with_(pool=pool), positions=6)
    assert len(drafted.positions) == 6
    assert bp.run(drafted).quantities["U6"].average < 1.15 * planned.value


@pytest.mark.parametrize(
    ("sheet", "tips"),
    [(BRIDGE, ""), (BRIDGE, "one"), (BRIDGE, "head"), (FLAT, "")],
    ids=["usual", "one", "head", "plane"],
)
def test_features_of_every_draft_differ(
    sheet: dict[str, str], tips: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So that tables and points are written, and simulated readings fit."""
    monkeypatch.chdir(tmp_path)
    stated = sheet | ({"tips": tips} if tips else {})
    assert main(["init", "m.yaml", *options(stated), "-q"]) == 0
    assert main(["sheet", "m.yaml", "--readings", "table.csv", "-q"]) == 0
    assert main(["sheet", "m.yaml", "--points", "points.csv", "-q"]) == 0
    assert main(["simulate", "m.yaml", "-o", "readings.csv", "-q"]) == 0
    assert main(["fit", "m.yaml", "readings.csv", "-q"]) == 0


@pytest.mark.parametrize("arrangement", ARRANGEMENTS)
def test_two_dimensions_have_full_rank(arrangement: str) -> None:
    experiment = bp.design(**FLAT | {"machine_type": arrangement})
    assert experiment.dimension == 2
    assert bp.check(experiment).verdict.deficiency == 0
    whole = experiment.with_({"error_model.functions": None})
    assert bp.check(whole).verdict.deficiency > 0
