"""Plans as a user asks for them: what is drawn, what is done, what is chosen earlier, and what goes
wrong.
"""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.campaign.earlier import earlier_choice
from ballplate.extensions.campaign.positions_read import done_candidates
from ballplate.extensions.planning.bound import Bound
from ballplate.extensions.planning.campaign_choice import Request, campaign
from ballplate.extensions.planning.remaining_candidates import offer
from ballplate.extensions.planning.search import SelectionProblem
from ballplate.presentation import percent
from ballplate.results.prediction import predict
from ballplate.simulator.computing.steps import InternalError
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.messages import ExperimentError

from tests.extensions.planning import wording

from .small_pool import TEXT

# Six positions of the pool as somebody drew them.
DRAWN = """
positions:
  - {name: low, artefact: plate, plane: z, level: 50 mm, corner: {x: 0 mm, y: 100 mm}, probes: [down]}
  - {name: high, artefact: plate, plane: z, level: 350 mm, corner: {x: 300 mm, y: 100 mm}, probes: [down]}
  - name: left
    artefact: plate
    plane: x
    level: 100 mm
    corner: {y: 0 mm, z: 50 mm}
    quarter_turns: 1
    probes: [right, down]
  - name: right
    artefact: plate
    plane: x
    level: 500 mm
    corner: {y: 0 mm, z: 50 mm}
    quarter_turns: 1
    probes: [right, down]
  - {name: near, artefact: plate, plane: y, level: 100 mm, corner: {x: 0 mm, z: 50 mm}, probes: [back, down]}
  - {name: far, artefact: plate, plane: y, level: 400 mm, corner: {x: 300 mm, z: 50 mm}, probes: [back, down]}
"""


@pytest.fixture
def drawn(tmp_path: Path) -> Path:
    path = tmp_path / "drawn.yaml"
    path.write_text(TEXT + DRAWN)
    return path


def readings_of(path: Path, positions: int) -> Path:
    """Simulated readings of the first positions."""
    every = path.with_suffix(".csv")
    assert main(["simulate", str(path), "-o", str(every), "--force"]) == 0
    lines = every.read_text().splitlines()
    names = [position.name for position in load(path)[0].positions[:positions]]
    kept = [line for line in lines[1:] if next(csv.reader([line]))[0] in names]
    some = path.with_name(f"first-{positions}.csv")
    some.write_text("\n".join([lines[0], *kept, ""]))
    return some


def first(path: Path) -> Experiment:
    return load(path, planning=True)[0]


def test_never_worse_than_drawn_at_the_same_cost(drawn: Path) -> None:
    found = campaign(first(drawn), Request("U6"))
    reference = predict(load(drawn)[0])
    assert found.drawn == pytest.approx(reference.quantities["U6"].average, rel=1e-9)
    assert found.value <= found.drawn
    assert found.drawn_spent is not None
    assert found.spent.readings <= found.drawn_spent.readings
    assert found.spent.positions <= 6 and found.spent.seconds <= found.drawn_spent.seconds + 1e-3
    assert found.bound <= found.value
    assert found.target == pytest.approx(2e-6 + 0.33e-6 / 0.1 * 0.3, rel=0.5)
    # A choice whose average is below that of the target can miss it with many distances.
    tables = "\n".join(found.lines()).partition("chosen: ")[0]
    mean, share = tables.partition("mean of target / k")[2].split("\n", 1)
    assert float(mean.split()[0]) == pytest.approx(1e6 * found.target, rel=1e-3)
    assert f": {percent(found.prediction.lengths.within_target)} of 190 lengths" in share


def test_readings_of_a_position_that_is_no_candidate_are_refused(
    drawn: Path, tmp_path: Path
) -> None:
    experiment = first(drawn)
    assert experiment.pool is not None
    path = tmp_path / "other.csv"
    path.write_text("position,ball,probe,x_mm,y_mm,z_mm\nlo,r1c1,down,1,2,3\nlo,r1c2,down,1,2,3\n")
    with pytest.raises(ExperimentError, match=wording.NO_POSITION_DID_YOU_MEAN):
        done_candidates(path, experiment)


def test_an_earlier_choice_is_found_again_and_gone_on_from(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, chosen = tmp_path / "pool.yaml", tmp_path / "chosen.yaml"
    path.write_text(TEXT)
    assert (
        main(["plan", str(path), "--hours", "5", "-o", str(chosen), "--workers", "1", "--json"])
        == 0
    )
    before = json.loads(capsys.readouterr().out)
    experiment = first(path)
    assert experiment.pool is not None
    names = [
        experiment.pool.candidates[k].name
        for k in earlier_choice(load(chosen)[0], offer(experiment.pool))
    ]
    assert names == before["chosen"]
    # Three positions are read as planned; the rest is planned anew, at the cost of what was left.
    some = readings_of(chosen, 3)
    again = [
        "plan",
        str(path),
        "--done",
        str(some),
        "--from",
        str(chosen),
        "--workers",
        "1",
        "--json",
    ]
    assert main(again) == 0
    after = json.loads(capsys.readouterr().out)
    assert len(after["done"]) == 3 and set(after["done"]) <= set(after["chosen"])
    assert after["value"] <= before["value"] * (1 + 1e-9)
    assert after["drawn"] == pytest.approx(before["value"], rel=1e-9)


def test_what_is_written_is_worth_what_was_told(
    drawn: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    chosen = drawn.with_name("chosen.yaml")
    assert (
        main(
            [
                "plan",
                str(drawn),
                "--criterion",
                "tasks-maximum",
                "-o",
                str(chosen),
                "--workers",
                "1",
                "--json",
            ]
        )
        == 0
    )
    found = json.loads(capsys.readouterr().out)
    assert main(["run", str(chosen), "--json"]) == 0
    worth = json.loads(capsys.readouterr().out)
    assert max(task["standard_uncertainty"] for task in worth["tasks"].values()) == pytest.approx(
        found["value"], rel=1e-9
    )
    # All of it, also where positions are read in another order than that of the pool.
    assert list(found["plan"]["quantities"]) == list(worth["quantities"])
    for symbol, quantity in worth["quantities"].items():
        for key in ("maximum", "average", "count", "undetermined"):
            assert found["plan"]["quantities"][symbol][key] == pytest.approx(
                quantity[key], rel=1e-9
            ), symbol
    # No other file is overwritten.
    assert main(["plan", str(drawn), "-o", str(chosen), "--workers", "1"]) == 3
    assert "--force" in capsys.readouterr().err


def test_too_little_is_told_with_what_stays_open(
    drawn: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", str(drawn), "--positions", "1", "--workers", "1"]) == 1
    told = capsys.readouterr().out
    assert wording.NO_CHOICE_WAS_FOUND_THAT_DETERMINES in told
    assert "undetermined 1:" in told


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--criterion", "U7"], "choose from U6"),
        (["--hours", "0"], "hours above zero"),
        (["--sheet", "sheet.pdf"], "ends in .html"),
    ],
)
def test_wrong_usage(
    drawn: Path, options: list[str], text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as left:
        main(["plan", str(drawn), *options])
    assert left.value.code == 2
    assert text in capsys.readouterr().err


def test_the_pool_is_not_overwritten_by_the_choice(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "pool.yaml"
    path.write_text(TEXT)
    assert main(["plan", str(path), "--positions", "4", "-o", str(path), "--force"]) == 2
    assert wording.WHICH_IS_READ in capsys.readouterr().err
    assert path.read_text() == TEXT


@pytest.mark.parametrize("positions", [5, 4])
def test_a_choice_better_than_its_bound_is_an_internal_error(
    positions: int, drawn: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A bound that is wrong on purpose, of the choice itself and of a point of the curve."""
    from ballplate.extensions.planning import campaign_choice as planning

    right = planning.bound

    def wrong(problem: SelectionProblem) -> Bound | None:
        found = right(problem)
        is_wrong = problem.constraints.budget.positions == positions
        return replace(found, value=10 * found.value) if found is not None and is_wrong else found

    monkeypatch.setattr(planning, "bound", wrong)
    monkeypatch.setattr(
        planning, "in_processes", lambda task, tasks, workers: (task(*one) for one in tasks)
    )
    command = ["plan", str(drawn), "--positions", "5", "--curve", "--workers", "1", "--quiet"]
    assert main(command) == 70
    out, err = capsys.readouterr()
    assert (
        out == ""
        and err.startswith("internal error: U6")
        and wording.THE_BOUND_OF_ANY_CHOICE in err
    )
    assert len(err.splitlines()) == 1


def test_what_is_better_than_its_bound_by_rounding_alone_passes() -> None:
    one = Bound(1e-6, np.zeros(3))
    one.check("U6", 1e-6 * (1 - 5e-10))
    with pytest.raises(InternalError, match=wording.OF_THE_CHOICE):
        one.check("U6", 1e-6 * (1 - 5e-9))
