"""Positions that drafts begin with: near a plan, readable by name, in two dimensions as well."""

from __future__ import annotations

from itertools import permutations, product
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.drafting.machine_tables import table
from ballplate.extensions.drafting.places import places_of, tips_of
from ballplate.extensions.drafting.shapes import VIEW, machine_shapes
from ballplate.extensions.drafting.sheet_values import Plate, StatedTips
from ballplate.extensions.planning import spent_as_drawn

from tests.extensions.drafting.sheets import BRIDGE, FLAT, options

SHAPES = {
    "cube": {"volume": "500 500 500 mm", "plate": "5 x 5, 250 mm"},
    "small": {"volume": "500 400 300 mm", "plate": "5 x 5, 200 mm"},
    "bridge": {},
    "arm": {"machine_type": "horizontal arm", "volume": "1 x 2.5 x 1.5 m", "mpe": "10 um + L/100"},
    "gantry": {"machine_type": "gantry", "volume": "2 x 3 x 1 m", "mpe": "3 um + L/250"},
}
# Quarters of the free room, and turns: what the start is compared with.
QUARTERS = ["low", "25 %", "middle", "75 %", "high"]
PROBES = {"x": ["right", "left"], "y": ["back", "front"], "z": ["down"]}
IN_PLANE = {"x": "yz", "y": "zx", "z": "xy"}


@pytest.mark.parametrize(("hours", "count"), [("1", 6), ("5.7", 6), ("6", 9), ("8", 12)])
def test_the_hours_decide_how_many_positions_a_file_begins_with(
    hours: str, count: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nine take 5.75 h with 25 balls, twelve 7.33 h; a head begins as a star does."""
    sheet = BRIDGE | {"plate": "5 x 5, 420 mm", "hours": hours}
    for tips in ("star", "head"):
        path = tmp_path / f"{tips}.yaml"
        assert main(["init", str(path), *options(sheet | {"tips": tips})]) == (hours == "1") * 2
        if path.exists():
            experiment = bp.load(path)
            assert len(experiment.positions) == count
            assert spent_as_drawn(experiment).seconds <= 3600.0 * float(hours)
            assert f"# {count} positions of a simple strategy" in path.read_text(encoding="utf-8")
            assert bp.check(experiment).verdict.deficiency == 0
    assert (hours == "1") == ("is too short" in capsys.readouterr().err)


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "hours"), [*((name, "5") for name in SHAPES), ("small", "6"), ("cube", "8")]
)
def test_the_start_is_near_a_plan_of_its_size(name: str, hours: str) -> None:
    drafted = bp.design(**BRIDGE | SHAPES[name], hours=hours)
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
    planned = bp.plan(drafted.with_(pool=pool), positions=len(drafted.positions))
    assert len(drafted.positions) == {"5": 6, "6": 9, "8": 12}[hours]
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


def test_places_cover_the_reach_of_the_tips_in_steps_of_the_plate() -> None:
    """Two or three along an axis, one where the plate has hardly any play; a plane without any is
    refused, before it a plate that is larger than the volume.
    """
    draws = np.random.default_rng(4)
    for _ in range(150):
        volume, size = draws.uniform(0.2, 1.5, 3), draws.uniform(0.1, 1.2, 2)
        tips = tips_of(StatedTips("star", None, 0.0), "z", tuple(volume))
        assert tips.length == pytest.approx(min(0.06, volume.min() / 10), abs=1e-4)
        wanted: dict[object, list[int]] = {}
        for plane, turn in product("xyz", (0, 1)):
            # Two tips on either side, a length lower than the centre, or one that hangs by two.
            reach = dict(zip("xyz", volume, strict=True))
            reach[plane] -= 2 * tips.length
            reach["z"] -= 0 if plane == "z" else tips.length
            sides = dict(zip(IN_PLANE[plane], size[::-1] if turn else size, strict=True))
            if all(side <= reach[axis] for axis, side in sides.items()):
                ratios = [reach[axis] / side for axis, side in sides.items()]
                corners = [1 if one < 1.1 else 2 + (one > 2) for one in ratios]
                wanted[plane, turn] = [2 + (reach[plane] > size.min()), *corners]
        try:
            places = list(places_of(Plate(4, 4, tuple(size)), tips, tuple(volume)))
        except ValueError as error:
            fits = any((size <= two).all() for two in permutations(volume, 2))
            assert ("does not fit" in str(error)) == fits and {one[0] for one in wanted} < {*"xyz"}
            continue
        for one in places:
            parts = (one["levels"], *one["corners"].values())
            assert wanted.pop((*one["planes"], one["quarter_turns"])) == [*map(len, parts)]
        assert not wanted


@pytest.mark.parametrize("kind", table("kinds"))
def test_boxes_of_a_machine_show_the_sides_that_face_the_eye(kind: str) -> None:
    """Each three rectangles with a common corner, the near one."""
    (away,) = np.linalg.svd(VIEW.T)[2][2:]
    away *= np.sign(away[1])
    sides = [shape.points for shape in machine_shapes(kind) if len(shape.points) == 4]
    for box in np.array(sides).reshape(-1, 3, 4, 3):
        corners = np.unique(box.reshape(-1, 3), axis=0)
        nearest = corners[(corners @ away).argmin()]
        for side in box:
            np.testing.assert_allclose(side[1] - side[0], side[2] - side[3], atol=1e-12)
            assert len(np.unique(side, axis=0)) == 4 and (side == nearest).all(axis=1).any()
