"""Pools that are made, limited and planned from in the studio."""

from __future__ import annotations

import math
import re
import time

import ballplate as bp
import pytest
import yaml

pytest.importorskip("starlette", reason="the studio is an extra")

from ballplate.extensions.studio import judging
from ballplate.extensions.studio.actions import ActionError, done
from ballplate.extensions.studio.document import DesignDocument, experiment_of, opened, undone
from ballplate.extensions.studio.jobs import JOBS
from ballplate.extensions.studio.session import Session
from ballplate.presentation import as_data
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import ExperimentError

PROBES = {"x": ["right", "left"], "y": ["back", "front"], "z": ["down"]}
FILL = {"do": "fill", "probes": PROBES, "quarter_turns": [0, 1], "count": 3}
FEW = {"probes": {"z": ["down"]}, "quarter_turns": [0], "count": 2}
FORBIDDEN = ["pool", "limits", "forbidden"]


def pooled(document: DesignDocument) -> dict:
    data: dict = as_data(judging.pooled(document))
    return data


def planned(document: DesignDocument) -> Experiment:
    return experiment_of(document, planning=True)


def test_a_pool_that_fills_the_volume_is_a_group_for_each_plane(document):
    """All candidates that its ranges state can be read, and they reach from end to end."""
    filled = done(document, FILL)
    assert filled.text.startswith(document.text.rstrip("\n"))
    lines = filled.text.removeprefix(document.text.rstrip("\n")).strip().splitlines()
    assert len(lines) == 2 + 3, lines
    pool = planned(filled).pool
    assert pool is not None and "outside the volume" not in pool.dropped
    # Of 3 levels, 3 x 3 places and 2 turns in each plane, some are positions of the file.
    offered = [one for one in pool.candidates if not one.drawn]
    assert len(offered) + pool.dropped.get("same place as another", 0) == 3 * 3 * 9 * 2
    # Again with other planes: the groups are replaced.
    again = done(filled, FILL | {"probes": {"z": ["down"]}, "quarter_turns": [0], "count": 2})
    assert again.text.count("planes:") == 1 and "count: 2" in again.text
    again = done(again, FILL)
    assert planned(again).pool is not None and again.text.count("planes:") == 3


@pytest.mark.parametrize("edge", [0.0, 20.0])
def test_groups_reach_from_end_to_end(document, edge: float) -> None:
    """Balls and readings, in whole tenths of a millimetre, `edge` from the walls beside them."""
    sides, text = (
        [512.34, 300.06],
        document.text.replace("[750 mm, 750 mm]", "[512.34 mm, 300.06 mm]"),
    )
    text += f"pool: {{limits: {{edge: {edge} mm}}}}\n" if edge else ""
    said = yaml.safe_load(done(done(document, {"do": "text", "text": text}), FILL).text)
    groups = said["pool"]["candidates"]
    assert len(groups) == 6
    for group in groups:
        (plane,), offsets = group["planes"], [said["probes"][name] for name in group["probes"]]
        in_plane = sides[:: -1 if group["quarter_turns"] else 1]
        places = {plane: group["levels"]} | group["corners"]
        for k, axis in enumerate("xyz"):
            ends = [0.0, *(float(one[k].split()[0]) for one in offsets)]
            low, high = max(ends), 1000.0 + min(ends)
            if axis != plane:
                u = {"x": "yz", "y": "zx", "z": "xy"}[plane].index(axis)
                low, high = low + edge, high - edge - in_plane[u]
            expected = f"{math.ceil(10 * low) / 10:g} mm", f"{math.floor(10 * high) / 10:g} mm"
            assert (places[axis]["from"], places[axis]["to"]) == expected


def test_a_corner_is_forbidden_and_allowed_again(document):
    filled = done(document, FILL | {"probes": {"z": ["down"]}})
    before = pooled(filled)
    assert before["boxes"] == [] and before["words"].startswith(f"{before['count']} candidates")
    # The file's own positions are in the low corner; there is none in the upper one.
    forbidden = done(filled, {"do": "forbid", "corner": ["high"] * 3})
    after = pooled(forbidden)
    assert after["boxes"] == [[[0.75] * 3, [1.0] * 3]]
    low = done(filled, {"do": "forbid", "corner": ["low", "high", "low"]})
    assert pooled(low)["boxes"] == [[[0.0, 0.75, 0.0], [0.25, 1.0, 0.25]]]
    (number,) = re.findall("([0-9]+) in a forbidden box", after["words"])
    dropped = int(number)
    assert dropped > 0 and after["count"] + dropped >= before["count"] > after["count"]
    left = done(forbidden, {"do": "set", "path": [*FORBIDDEN, 0], "value": ""})
    assert left.text == filled.text


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"probes": {}}, "no plane to fill"),
        ({"probes": {"z": ["up"]}}, 'no probe "up"'),
        ({"count": 0}, "places along an axis 1 to 20"),
        ({"quarter_turns": [4]}, "quarter turns are 0 to 3"),
        ({"probes": 1}, "give probes by plane"),
    ],
)
def test_what_cannot_be_filled_is_refused(document, change, words):
    with pytest.raises((ActionError, ExperimentError), match=words):
        done(document, FILL | change)


def test_outlines_are_drawn_once_and_not_without_end(document):
    found = pooled(done(document, FILL | {"count": 8}))
    assert found["count"] > 2000 and len(found["outlines"]) == 1000
    assert found["probes"] == PROBES


def finished(session: Session, number: int) -> dict:
    end = time.monotonic() + 120
    while (job := session.jobs()[number - 1])["state"] == "running":
        assert time.monotonic() < end, job
        time.sleep(0.05)
    return job


def test_an_applied_plan_has_the_figures_of_the_command_and_keeps_what_is_off(document):
    """Positions that are not chosen stay with what is written about them, and can be read again."""
    text = document.text.replace("probes: [down]}\n", "probes: [down]}  # ours\n", 1)
    filled = done(done(document, {"do": "text", "text": text}), FILL | FEW)
    filled.path.write_text(filled.text, encoding="utf-8")
    found = JOBS["plan"](filled, {"hours": 4}, lambda step: None)
    command = bp.plan(filled.path, hours=4)
    applied = done(filled, {"do": "plan", "positions": found["plan"]})
    assert "  # ours\n" in applied.text and "enabled: false" in applied.text
    after = experiment_of(applied)
    assert [place.name for place in after.positions if place.enabled] == [
        place.name for place in command.chosen_experiment.positions
    ]
    # In the plan's order, those have its figures too that depend on the first position.
    for symbol, quantity in bp.run(after).quantities.items():
        planned_quantity = command.prediction.quantities[symbol]
        assert quantity.average == pytest.approx(planned_quantity.average, rel=1e-9), symbol
    assert found["average"] == command.prediction.quantities["U6"].average
    assert undone(applied).text == filled.text
    # The names of what is off are not used again.
    again = done(applied, {"do": "plan", "positions": [{**found["plan"][0], "name": "z low"}]})
    assert len({place.name for place in experiment_of(again).positions}) == len(
        experiment_of(again).positions
    )


@pytest.mark.parametrize("stated", [True, False])
def test_an_applied_plan_has_its_certificates(document, stated: bool) -> None:
    """What a plan chose to have certified is written, once, and the figures are the plan's."""
    pool = """
pool:
  times: {set_up: 10 min}
  calibration:
    - {name: lab, kind: distances, pairs: corner diagonals, standard_uncertainty: 0.05 um}
    - {name: ours, kind: distances, pairs: corner sides, standard_uncertainty: 0.1 um}
"""
    text = document.text.rstrip() + "\n" + pool
    if not stated:
        start = text.index("calibration:\n")
        text = text[:start] + text[text.index("\n\n", start) :]
    document.path.write_text(text, encoding="utf-8")
    document = opened(document.path)
    found = JOBS["plan"](document, {}, lambda step: None)
    assert found["calibration"] == ["lab", "ours"]
    action = {"do": "plan", "positions": found["plan"], "calibration": found["calibration"]}
    applied = done(document, action)
    assert len(experiment_of(applied).calibration) == 2 + stated
    average = bp.run(experiment_of(applied)).quantities["U6"].average
    assert average == pytest.approx(found["average"], rel=1e-9)
    # A certificate is had once: what is planned next has it.
    assert JOBS["plan"](applied, {}, lambda step: None)["calibration"] == []
    assert undone(applied).text == document.text


def test_a_plan_that_is_stopped_has_the_best_choice_so_far(document):
    filled = done(document, FILL | FEW | {"count": 4})
    document.path.write_text(filled.text, encoding="utf-8")
    session = Session(document.path)
    try:
        number = session.start("plan", {"hours": 8})
        end = time.monotonic() + 120
        while "best U6" not in (job := session.jobs()[0])["step"]:
            assert job["state"] == "running" and time.monotonic() < end, job
            time.sleep(0.05)
        assert "positions" in job["step"]
        session.stop(number)
        assert session.jobs()[0]["ending"]
        job = finished(session, number)
        assert job["state"] == "done" and job["result"]["plan"], job
        assert job["result"]["deficiency"] == 0 and "8 h" in "".join(job["result"]["lines"])
        session.stop(number)
        assert session.jobs() == []
        # Who does not want to wait stops it twice.
        number = session.start("plan", {})
        session.stop(number)
        session.stop(number)
        assert session.jobs() == []
    finally:
        session.close()
