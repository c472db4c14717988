"""Positions that have been read already, found in a file of readings."""

from __future__ import annotations

import io
from pathlib import Path

from ballplate.extensions.campaign.positions_read import done_candidates
from ballplate.extensions.planning.experiment_file import experiment_text
from ballplate.extensions.planning.schedule import run_sheet
from ballplate.extensions.planning.set_ups import SetUp
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment, Position
from ballplate.simulator.readings.reading_files import write_readings
from ballplate.simulator.readings.simulated import exact_readings

CAMPAIGN = Path("designs/planning/campaign.yaml")


def read_of(folder: Path, kept: dict[str, int]) -> tuple[Experiment, tuple[SetUp, ...]]:
    """The campaign, and what is done when of its drawn positions only so many readings have been
    taken.
    """
    design = lay_out(load(CAMPAIGN)[0])
    stream = io.StringIO()
    write_readings(stream, design, *exact_readings(design, nominal_state(design)))
    head, *lines = stream.getvalue().splitlines()
    chosen = [
        line
        for name, count in kept.items()
        for line in [o for o in lines if o.startswith(name)][:count]
    ]
    path = folder / "readings.csv"
    path.write_text("\n".join([head, *chosen]) + "\n", encoding="utf-8")
    (experiment,) = load(CAMPAIGN, planning=True)
    assert experiment.pool is not None
    return experiment, done_candidates(path, experiment)


def test_what_was_read_as_planned_is_told_as_planned(tmp_path: Path) -> None:
    experiment, done = read_of(tmp_path, {"flat low": 25, "upright": 50})
    assert experiment.pool is not None and [one.base for one in done] == [0, 1]
    for one in done:
        assert (
            one.read.settings is experiment.pool.candidates[one.base].settings and one.rest is None
        )
    read = [one.read for one in done]
    sheet = run_sheet(read, experiment.pool.changes, done=read)
    assert [step.balls for step in sheet.steps] == ["all 25", "all 25"]


def test_a_position_read_in_part_is_told_and_written_with_its_balls(tmp_path: Path) -> None:
    experiment, done = read_of(tmp_path, {"flat low": 3, "upright": 50})
    assert experiment.pool is not None
    read = [one.read for one in done]
    sheet = run_sheet(read, experiment.pool.changes, done=read)
    assert sheet.steps[0].balls == "r1c1, r1c2, r1c3"
    path = tmp_path / "chosen.yaml"
    path.write_text(experiment_text(experiment, sheet.chosen, "", tmp_path), encoding="utf-8")
    (written,) = load(path)
    flat, upright = written.positions
    assert isinstance(flat, Position) and flat.name == "flat low"
    assert [(group.probes, group.balls) for group in flat.readings] == [
        (("down",), ("r1c1", "r1c2", "r1c3"))
    ]
    assert sum(len(group.balls) * len(group.probes) for group in upright.readings) == 50
