"""Positions that were interrupted: completed where they stand, set up again, or left, and never to
the plan's harm.
"""

from __future__ import annotations

import json
from itertools import chain, combinations
from pathlib import Path

import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.campaign.positions_read import done_candidates
from ballplate.extensions.planning.campaign_choice import Request, campaign
from ballplate.extensions.planning.constraints import Budget, with_chosen
from ballplate.extensions.planning.remaining_candidates import offer
from ballplate.extensions.planning.schedule import run_sheet
from ballplate.extensions.planning.selection import Campaign
from ballplate.results.prediction import predict
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment, Position

from tests.extensions.planning import wording

from .random_pools import write_some

TEXT = """
title: a day on a small machine
machine: {volume: [600 mm, 500 mm, 450 mm], repeatability: 1 um}
error_model: {kind: metric}
probes: {down: [0 mm, 0 mm, -40 mm], right: [40 mm, 0 mm, 0 mm]}
artefacts: {plate: {kind: grid, balls: [3, 3], size: [300 mm, 200 mm]}}
calibration: [{kind: distances, pairs: corner sides, standard_uncertainty: 1 um}]
evaluation: {points: {random: 12, seed: 1}, probe: down}
pool:
  times: {set_up: 10 min, reading: 1 min, probe_change: 3 min, plane_change: 20 min}
  candidates:
    - {name: low, plane: z, level: 50 mm, corner: {x: 10 mm, y: 20 mm}, probes: [down]}
    - {name: side, plane: x, level: 300 mm, corner: {y: 20 mm, z: 30 mm}, probes: [right, down]}
    - {name: front, plane: y, level: 250 mm, corner: {x: 250 mm, z: 40 mm}, quarter_turns: 1, probes: [down]}
    - {name: high, plane: z, level: 350 mm, corner: {x: 250 mm, y: 220 mm}, probes: [down], repeats: 2}
    - {name: left, plane: x, level: 100 mm, corner: {y: 150 mm, z: 100 mm}, probes: [right]}
"""


@pytest.fixture
def pool(tmp_path: Path) -> Path:
    path = tmp_path / "pool.yaml"
    path.write_text(TEXT)
    return path


def readings_of(path: Path, names: list[str], count: int) -> Path:
    """Readings of positions in this order, of the last one only so many."""
    (experiment,) = load(path, planning=True)
    assert experiment.pool is not None
    by_name = {one.name: one for one in experiment.pool.candidates}
    chosen = [by_name[name] for name in names]
    places = [one.item for one in chosen if isinstance(one.item, Position)]
    return write_some(
        experiment, places, path.with_name("readings.csv"), (count + 0.5) / chosen[-1].readings
    )


def gone_on(path: Path, readings: Path, budget: Budget, standing: bool = True) -> Campaign:
    (experiment,) = load(path, planning=True)
    assert experiment.pool is not None
    offered = offer(experiment.pool, done_candidates(readings, experiment), standing)
    return campaign(experiment, Request("U6", budget), offered)


def names_of(found: Campaign) -> list[str]:
    return [one.name for one in found.chosen]


def test_a_position_is_completed_where_it_stands_without_another_set_up(pool: Path) -> None:
    path = readings_of(pool, ["side", "low"], 4)
    found = gone_on(pool, path, Budget(seconds=5 * 60.0))
    # Five readings of a minute each are what five minutes are good for.
    assert sorted(names_of(found)) == ["low", "side"]
    assert (found.spent.seconds, found.spent.readings, found.spent.positions) == (300.0, 5, 0)
    sheet = run_sheet(
        found.chosen, found.pool.changes, found.done, found.completed, found.interrupted
    )
    step = sheet.steps[-1]
    assert (step.name, step.done, step.readings, step.seconds) == ("low", False, 5, 300.0)
    assert step.balls == "the rest, 5 of 9 readings: r2c2, r2c3, r3c1, r3c2, r3c3"
    assert step.place.startswith(wording.AS_IT_STANDS)
    # It is worth what both positions are worth that are read in one go.
    (experiment,) = load(pool, planning=True)
    assert experiment.pool is not None
    whole = with_chosen(
        experiment, [one for one in experiment.pool.candidates if one.name in ("side", "low")]
    )
    assert found.value == pytest.approx(predict(whole).quantities["U6"].average, rel=1e-9)


def test_only_the_position_that_was_read_last_still_stands(pool: Path) -> None:
    readings = readings_of(pool, ["low", "side"], 18)
    lines = readings.read_text().splitlines()
    readings.write_text(
        "\n".join([line for line in lines if ",r3c" not in line or not line.startswith("low")])
        + "\n"
    )
    (experiment,) = load(pool, planning=True)
    assert experiment.pool is not None
    offered = offer(experiment.pool, done_candidates(readings, experiment))
    (interrupted,) = offered.interrupted
    assert offered.standing is None and offered.candidates[interrupted.part].readings == 6
    assert offered.candidates[interrupted.again].name == "low again"


@pytest.mark.parametrize("standing", [True, False])
@pytest.mark.parametrize("count", [2, 5])
def test_no_selection_is_better_and_more_readings_do_no_harm(
    pool: Path, count: int, standing: bool
) -> None:
    """Against full computations of all selections, with positions, parts and rests composed by
    hand.
    """
    readings = readings_of(pool, ["side", "low"], count)
    budget = Budget(seconds=45 * 60.0)
    found = gone_on(pool, readings, budget, standing)
    (experiment,) = load(pool, planning=True)
    assert experiment.pool is not None
    side, low = done_candidates(readings, experiment)
    rest, candidates = low.rest, experiment.pool.candidates
    assert rest is not None
    others = [one for one in candidates if one.name in ("front", "high", "left")]
    again = {one.name: one for one in offer(experiment.pool, (side, low)).candidates}["low again"]
    best = np.inf
    ways = [(low.read, None), (low.whole, rest)] if standing else [(low.read, None)]
    for chosen in chain.from_iterable(combinations([*others, again], k) for k in range(5)):
        for first, more in ways:
            todo = [*([] if more is None else [more]), *chosen]
            seconds = sum(one.seconds for one in todo)
            # The plane changes as seldom as there are planes, and left, which has another probe,
            # may come last.
            seconds += 1200.0 * max(len({one.plane for one in todo}) - 1, 0)
            seconds += 180.0 if len({one.name == "left" for one in todo}) == 2 else 0.0
            if seconds > 45 * 60.0:
                continue
            worth = predict(with_chosen(experiment, [side.read, first, *chosen])).quantities["U6"]
            if not worth.undetermined:
                best = min(best, worth.average)
    assert np.isfinite(best) and found.value == pytest.approx(best, rel=1e-9)
    without = campaign(experiment, Request("U6", budget), offer(experiment.pool, (side,)))
    assert found.value <= without.value * (1 + 1e-9)


def command(*arguments: object) -> int:
    return main([str(one) for one in arguments])


def test_the_file_written_takes_the_complete_readings(
    pool: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    readings = readings_of(pool, ["side", "low"], 5)
    rest, sheet, data = (pool.with_name(name) for name in ("rest.yaml", "rest.html", "rest.csv"))
    options = ["--done", readings, "--hours", "1.2", "--workers", "1", "-o", rest, "--sheet", sheet]
    assert command("plan", pool, *options) == 0
    told = capsys.readouterr().out
    assert wording.LOW_WAS_INTERRUPTED_AFTER_READINGS in told
    assert (
        wording.LOW_AS_IT_STANDS in sheet.read_text()
        and "the rest, 4 of 9 readings: r2c3, r3c1" in sheet.read_text()
    )
    assert command("simulate", rest, "-o", data) == 0
    assert readings.read_text().splitlines()[1].split(",")[:3] == ["side", "r1c1", "right"]
    assert command("fit", rest, data) == 0
    capsys.readouterr()
    assert command("run", rest, "--json") == 0
    worth = json.loads(capsys.readouterr().out)["quantities"]["U6"]["average"]
    assert command("plan", pool, *options[:6], "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert worth == pytest.approx(found["value"], rel=1e-9)
    assert found["completed"] == "low" and found["interrupted"] == [{"name": "low", "readings": 5}]


def test_a_position_that_has_to_be_chosen_is_refused_where_there_is_no_room_for_it(
    pool: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    readings = readings_of(pool, ["side", "low"], 2)
    pool.write_text(TEXT.replace("  candidates:", "  limits: {keep: [low]}\n  candidates:"))
    assert command("plan", pool, "--done", readings, "--readings", 3, "--workers", "1") == 3
    assert wording.HAS_TO_BE_CHOSEN in capsys.readouterr().err


def test_readings_with_uncertainties_of_their_own_are_written_with_them(
    pool: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    readings = readings_of(pool, ["side", "low"], 5)
    head, *lines = readings.read_text().splitlines()
    uncertain = [f"{line},{0.7 + 0.1 * (k % 3):.1f}" for k, line in enumerate(lines)]
    readings.write_text("\n".join([f"{head},u_um", *uncertain]) + "\n")
    rest = pool.with_name("rest.yaml")
    assert (
        command(
            "plan", pool, "--done", readings, "--hours", "1", "--workers", "1", "--json", "-o", rest
        )
        == 0
    )
    found = json.loads(capsys.readouterr().out)
    assert command("run", rest, "--json") == 0
    worth = json.loads(capsys.readouterr().out)["quantities"]["U6"]["average"]
    assert worth == pytest.approx(found["value"], rel=1e-9)
    stated = [
        group.standard_uncertainty
        for position in load(rest)[0].positions
        if position.name == "side"
        for group in position.readings
    ]
    assert {round(1e6 * float(one[0]), 3) for one in stated if one is not None} == {0.7, 0.8, 0.9}


def test_three_balls_in_a_line_may_stand_in_any_turn_about_it(pool: Path) -> None:
    """Nothing is told of a turn that the readings leave open; exact ones were taken for a plate
    turned over.
    """
    turned = """
    - planes: [x, y, z]
      levels: [200 mm, 111 mm]
      corners: {x: 101 mm, y: 33 mm, z: 25 mm}
      quarter_turns: [0, 1, 2, 3]
      probes: [down]
"""
    pool.write_text(TEXT.rstrip("\n") + turned)
    (experiment,) = load(pool, planning=True)
    assert experiment.pool is not None
    names = [
        one.name for one in experiment.pool.candidates if one.name.startswith(("x ", "y ", "z "))
    ]
    assert len(names) == 24
    for name in names[::5]:
        for count in (1, 2, 3):
            (taken,) = done_candidates(readings_of(pool, [name], count), experiment)
            assert taken.read.readings == count


def test_without_any_further_position_balls_may_be_unread(
    pool: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    readings = readings_of(pool, ["low"], 4)
    assert command("plan", pool, "--done", readings, "--hours", "2", "--workers", "1") == 0
    capsys.readouterr()
    assert command("plan", pool, "--done", readings, "--hours", "0.01", "--workers", "1") == 3
    assert wording.WAS_BEGUN_BUT_NO_POSITION in capsys.readouterr().err


def test_a_first_position_is_not_paid_for_twice_in_the_default_budget(pool: Path) -> None:
    drawn = """
positions:
  - {name: first, plane: z, level: 50 mm, corner: {x: 10 mm, y: 20 mm}, probes: [down]}
  - {name: second, plane: x, level: 300 mm, corner: {y: 20 mm, z: 30 mm}, probes: [right, down]}
  - {name: third, plane: y, level: 250 mm, corner: {x: 250 mm, z: 40 mm}, quarter_turns: 1, probes: [down]}
"""
    pool.write_text(TEXT + drawn)
    readings = readings_of(pool, ["first"], 4)
    (experiment,) = load(pool, planning=True)
    assert experiment.pool is not None
    offered = offer(experiment.pool, done_candidates(readings, experiment))
    found = campaign(experiment, Request("U6"), offered)
    # Five readings are left of the first; then two changes of plane, two set-ups of ten minutes, 27
    # readings and one change of probe.
    assert found.drawn_spent is not None
    assert found.drawn_spent.seconds == 5 * 60.0 + 2 * 1200.0 + 2 * 600.0 + 27 * 60.0 + 180.0
    assert (found.drawn_spent.readings, found.drawn_spent.positions) == (32, 2)
    whole: Experiment = load(pool)[0]
    assert found.drawn == pytest.approx(predict(whole).quantities["U6"].average, rel=1e-9)
    assert found.value <= found.drawn  # type: ignore[operator]


SECOND = """
    - {name: small low, artefact: small, plane: z, level: 20 mm, corner: {x: 400 mm, y: 20 mm}, probes: [down]}
    - {name: small high, artefact: small, plane: z, level: 380 mm, corner: {x: 20 mm, y: 300 mm}, probes: [down]}
"""


def test_a_second_plate_that_was_only_begun_is_gone_on_with_or_left_out(
    pool: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """No experiment may hold a plate with unread balls; its readings are left out if they are not
    worth the rest.
    """
    small = "size: [300 mm, 200 mm]}, small: {kind: square, balls: 2, size: 100 mm}}"
    text = TEXT.replace("size: [300 mm, 200 mm]}}", small).replace(
        "probes: [down]}", "probes: [down], artefact: plate}"
    )
    text = text.replace("repeats: 2}", "repeats: 2, artefact: plate}").replace(
        "down]}\n    - {name: f", "down], artefact: plate}\n    - {name: f"
    )
    text = text.replace("probes: [right]}", "probes: [right], artefact: plate}").replace(
        "{kind: distances", "{artefact: plate, kind: distances"
    )
    pool.write_text(text.rstrip("\n") + SECOND)
    readings = readings_of(pool, ["side", "low", "small low"], 2)
    (experiment,) = load(pool, planning=True)
    # Two readings of a minute complete it where it stands, which is all that a few minutes are good
    # for; ten minutes more are needed if it does not.
    minutes = 5
    for standing in (True, False):
        found = gone_on(pool, readings, Budget(seconds=60.0 * minutes), standing)
        full = predict(with_chosen(experiment, found.chosen))
        assert found.value == pytest.approx(full.quantities["U6"].average, rel=1e-9)
        assert [left.name for left in found.ignored] == ["small low"] * (not standing)
    capsys.readouterr()
    hours = ["--hours", minutes / 60, "--moved", "--workers", "1"]
    assert command("plan", pool, "--done", readings, *hours) == 0
    assert wording.SMALL_LOW_IS_LEFT_OUT in capsys.readouterr().out
