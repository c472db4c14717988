"""Short names of planned positions: which have one, that it means one place, and that what follows
a plan understands it.
"""

from __future__ import annotations

import json
import re
from itertools import pairwise
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.cli import main
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Position

POOL = """
title: a day on a small machine
machine: {volume: [600 mm, 500 mm, 450 mm], repeatability: 1 um}
error_model: {kind: metric}
probes: {down: [0 mm, 0 mm, -40 mm], right: [40 mm, 0 mm, 0 mm]}
artefacts: {plate: {kind: grid, balls: [3, 3], size: [300 mm, 200 mm]}}
positions:
  - {name: p2, plane: z, level: 50 mm, corner: {x: 10 mm, y: 20 mm}, probes: [down]}
calibration: [{kind: distances, pairs: corner sides, standard_uncertainty: 1 um}]
evaluation: {points: {random: 12, seed: 1}, probe: down}
expected_rank_deficiency: 5
pool:
  times: {set_up: 10 min, reading: 1 min, probe_change: 3 min, plane_change: 20 min}
  candidates:
    - {name: my own, plane: x, level: 300 mm, corner: {y: 20 mm, z: 30 mm}, probes: [right, down]}
    - {name: flat, planes: [z], levels: [200 mm, 350 mm], corners: {x: [10 mm, 250 mm], y: [20 mm, 220 mm]}, probes: [down]}
    - {planes: [x, y], levels: [150 mm, 350 mm], corners: {x: [20 mm], y: [20 mm], z: [40 mm]}, probes: [[right, down]]}
  limits: {keep: [p2, my own]}
"""


@pytest.fixture
def pool(tmp_path: Path) -> Path:
    path = tmp_path / "pool.yaml"
    path.write_text(POOL)
    return path


def planned(pool: Path, name: str, *more: str, status: int = 0) -> dict[str, object]:
    """A plan, written beside its pool, as --json prints it."""
    import contextlib
    import io

    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        found = main(
            ["plan", str(pool), "-o", str(pool.with_name(name)), "--workers", "1", "--json", *more]
        )
    assert found == status
    said: dict[str, object] = json.loads(out.getvalue())
    return said


def poses(path: Path) -> dict[str, Position]:
    (experiment,) = load(path)
    return {one.name: one for one in experiment.positions}


@pytest.mark.parametrize("stated", [0, 5])
def test_a_stated_rank_deficiency_is_kept_where_the_choice_has_it(pool: Path, stated: int) -> None:
    """As a check of what was written finds it, which a full one then agrees with."""
    pool.write_text(
        POOL.replace("expected_rank_deficiency: 5", f"expected_rank_deficiency: {stated}")
    )
    planned(pool, "day.yaml", "--positions", "6")
    path = pool.with_name("day.yaml")
    deficiency = bp.check(path).to_dict()["rank_deficiency"]
    (experiment,) = load(path)
    assert experiment.expected_rank_deficiency == (stated if stated == deficiency else None)
    assert deficiency == 0


def test_composed_names_alone_become_short_and_none_is_there_twice(pool: Path) -> None:
    said = planned(pool, "day.yaml", "--positions", "6")
    written = poses(pool.with_name("day.yaml"))
    assert {"p2", "my own"} < set(written)
    short = [name for name in written if name not in ("p2", "my own")]
    assert len(short) == 4 and all(re.fullmatch("P[1-9]", name) for name in short)
    # A machine may not tell capitals apart: P2 would be p2.
    assert len({name.casefold() for name in written}) == 6
    numbers = [int(name[1:]) for name in short]
    assert all(one < other for one, other in pairwise(numbers)), "not in the order of measuring"
    # The mapping is told, and leads to the places of the pool.
    (experiment,) = load(pool, planning=True)
    assert experiment.pool is not None
    places = {one.name: one.item for one in experiment.pool.candidates}
    assert isinstance(said["names"], dict)
    assert set(said["names"].values()) == set(short)
    for name, position in written.items():
        meant = places[position.description or name]
        assert isinstance(meant, Position)
        assert np.abs(meant.pose.origin - position.pose.origin).max() < 1e-12
        assert np.abs(meant.pose.rotation - position.pose.rotation).max() < 1e-12
        if position.description:
            assert said["names"][position.description] == name


def test_a_campaign_goes_on_under_the_names_that_it_began_with(
    pool: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    planned(pool, "day.yaml", "--positions", "6")
    day, readings = pool.with_name("day.yaml"), pool.with_name("day.csv")
    assert main(["simulate", str(day), "-o", str(readings), "-q"]) == 0
    before = poses(day)
    lines = readings.read_text().splitlines()
    # Three positions are read in full, and of the fourth three balls.
    kept, names = [lines[0]], list(before)
    for name in names[:3]:
        kept += [line for line in lines[1:] if line.startswith(f"{name},")]
    kept += [line for line in lines[1:] if line.startswith(f"{names[3]},")][:3]
    morning = pool.with_name("morning.csv")
    morning.write_text("\n".join([*kept, ""]))
    again = ["--done", str(morning), "--from", str(day), "--moved", "--hours", "3"]
    said = planned(pool, "rest.yaml", *again)
    rest = poses(pool.with_name("rest.yaml"))
    assert set(names[:4]) <= set(rest)
    for name in set(rest) & set(before):
        assert np.abs(rest[name].pose.origin - before[name].pose.origin).max() < 1e-12, name
        assert rest[name].artefact == before[name].artefact
    # A new place has a number that no place of the morning's sheet had, chosen again or not.
    new = [name for name in rest if name not in before]
    highest = max(int(name[1:]) for name in before if re.fullmatch("P[0-9]+", name))
    assert all(int(name[1:]) > highest for name in new if re.fullmatch("P[0-9]+", name))
    assert any(one.get("name") for one in said["interrupted"])  # type: ignore[attr-defined]
    # The readings of the morning are still those of the same places.
    capsys.readouterr()
    evening = pool.with_name("evening.csv")
    assert main(["simulate", str(pool.with_name("rest.yaml")), "-o", str(evening), "-q"]) == 0
    told = {line.split(",")[0] for line in evening.read_text().splitlines()[1:]}
    assert set(names[:4]) <= told


def test_readings_under_short_names_need_the_plan_that_gave_them(
    pool: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    readings = pool.with_name("r.csv")
    readings.write_text("position,ball,probe,x_mm,y_mm,z_mm\nP1,r1c1,down,1,2,3\n")
    assert main(["plan", str(pool), "--done", str(readings), "--positions", "3"]) == 3
    assert "--from" in capsys.readouterr().err


def test_a_composed_position_that_an_influence_names_keeps_its_name(pool: Path) -> None:
    """Temperatures stated for a place of the pool hold for it in the file and in what is computed
    of the choice.
    """
    pool.write_text(
        POOL.replace("keep: [p2, my own]", "keep: [p2, my own, 'flat z 200 mm at 10, 20 mm']")
    )
    (experiment,) = load(pool, planning=True)
    assert experiment.pool is not None
    warm = "flat z 200 mm at 10, 20 mm"
    assert warm in [one.name for one in experiment.pool.candidates]
    disturbed = f"""
influences:
  - kind: temperature
    artefact_expansion: {{value: 11.5 um/m/K, standard_uncertainty: 5 um/m/K}}
    artefact_temperature: {{value: 20 degC, standard_uncertainty: 1 mK}}
    positions:
      p2: {{artefact: 21 degC}}
      {warm!r}: {{artefact: 29 degC}}
"""
    pool.write_text(pool.read_text() + disturbed)
    said = planned(pool, "day.yaml", "--positions", "6")
    assert isinstance(said["names"], dict) and warm not in said["names"]
    day = pool.with_name("day.yaml")
    stated = load(day)[0].influences[0].positions  # type: ignore[attr-defined]
    assert set(stated) == {"p2", warm}
    assert f"{stated[warm].artefact}" != f"{stated['p2'].artefact}"
    # What the plan told of the choice is what the file gives, and depends on that temperature.
    worth = _quantities(day)
    assert said["plan"]["quantities"]["U5"]["average"] == pytest.approx(  # type: ignore[index]
        worth["U5"]["average"], rel=1e-9
    )
    cold = day.read_text().replace("29 degC", "20 degC")
    assert cold != day.read_text()
    pool.with_name("cold.yaml").write_text(cold)
    other = _quantities(pool.with_name("cold.yaml"))
    assert other["U5"]["average"] != pytest.approx(worth["U5"]["average"], rel=1e-3)


def _quantities(path: Path) -> dict[str, dict[str, float]]:
    import ballplate as bp

    found: dict[str, dict[str, float]] = bp.run(path).to_dict()["quantities"]
    return found


def test_the_position_of_all_rows_of_a_table_keeps_its_name(pool: Path) -> None:
    long = "flat z 200 mm at 10, 20 mm"
    text = pool.read_text().replace("keep: [p2", f'keep: ["{long}", p2')
    pool.write_text(f'{text}readings: {{columns: {{position: "={long}", ball: "1"}}}}\n')
    planned(pool, "plan.yaml")
    (plan,) = load(pool.with_name("plan.yaml"))
    assert long in [one.name for one in plan.positions]
    assert plan.readings.columns is not None
    assert (plan.readings.columns.position, plan.readings.columns.ball) == (f"={long}", "1")


def test_a_drift_is_left_out_of_the_choice_but_not_of_what_is_computed_of_it(pool: Path) -> None:
    steady = planned(pool, "steady.yaml", "--positions", "6")
    drift = "influences: [{kind: drift, scale: {standard_uncertainty: 5 ppm/h}}]\n"
    pool.write_text(f"{POOL}{drift}")
    drifting = planned(pool, "day.yaml", "--positions", "6")
    assert (drifting["chosen"], drifting["value"]) == (steady["chosen"], steady["value"])
    worth = _quantities(pool.with_name("day.yaml"))["U6"]["average"]
    told = drifting["plan"]["quantities"]["U6"]["average"]  # type: ignore[index]
    assert told == pytest.approx(worth, rel=1e-9)
    assert told > 1.001 * steady["value"]  # type: ignore[operator]
    lines = bp.plan(pool, positions=6).lines()
    assert "positions were chosen without drift; U1 to U6 are those with the drift" in lines
