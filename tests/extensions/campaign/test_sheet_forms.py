"""Run sheets as text and as a page."""

from __future__ import annotations

import pytest
from ballplate.extensions.campaign.sheet_page import sheet_page
from ballplate.extensions.planning.run_sheet_tables import sheet_data, sheet_lines, summary
from ballplate.extensions.planning.schedule import RunSheet, run_sheet
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment

from tests.extensions.campaign import wording


@pytest.fixture(scope="module")
def experiment() -> Experiment:
    return load("designs/planning/campaign.yaml", planning=True)[0]


@pytest.fixture(scope="module")
def sheet(experiment: Experiment) -> RunSheet:
    assert experiment.pool is not None
    wanted = (
        "upright",
        "flat low",
        "bar along y",
        "flat z 300 mm at 300, 400 mm turn 1",
        "better sides",
    )
    by_name = {one.name: one for one in experiment.pool.candidates}
    return run_sheet(
        [by_name[name] for name in wanted], experiment.pool.changes, done=[by_name["flat low"]]
    )


def test_lines(sheet: RunSheet) -> None:
    lines = sheet_lines(sheet)
    assert lines[0].split() == ["start", "min", "position", "probes", "balls", "readings"]
    assert lines[1].split() == ["1", "done", "flat", "low", "down", "all", "25", "25"]
    assert wording.TURNED_DEG_COUNTER_CLOCKWISE_SEEN in "\n".join(lines)
    assert "3 times each" in "\n".join(lines)
    assert lines[-2] == wording.CALIBRATION_BETTER_SIDES
    assert lines[-1] == summary(sheet)
    assert wording.POSITION_DONE_BEFORE in lines[-1]


def test_data(sheet: RunSheet) -> None:
    data = sheet_data(sheet)
    assert data["seconds"] == sheet.seconds
    assert data["calibration"] == [{"name": "better sides", "seconds": 3600.0}]
    assert [step["done"] for step in data["steps"]] == [True, False, False, False]


def test_the_page_has_a_box_for_each_position_and_probe(
    sheet: RunSheet, experiment: Experiment
) -> None:
    page = sheet_page(sheet, experiment, "a day")
    assert page.count("<section") == 4
    # None for the probes of what has been read already.
    boxes = 4 + sum(len(step.probes) for step in sheet.steps if not step.done)
    assert page.count("<input") == boxes
