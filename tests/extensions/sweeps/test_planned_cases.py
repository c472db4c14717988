"""Cases that choose their positions: each is the plan that `plan` makes, and costs what it does."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pandas
import pytest
from ballplate.cli import main
from ballplate.extensions.planning import Budget, spent_as_drawn
from ballplate.extensions.planning.constraints import constraints
from ballplate.extensions.sweeps.answer import answer
from ballplate.extensions.sweeps.load import load_sweep
from ballplate.extensions.sweeps.temporary import TEMPORARY
from ballplate.simulator.experiment import with_pool
from ballplate.simulator.inputs import ExperimentError

from tests.extensions.sweeps.support import ROOT, assert_same, planned_sweep, rows


@pytest.fixture
def planned(tmp_path: Path) -> Path:
    return planned_sweep(tmp_path)


def assert_plans(path: Path, table: pandas.DataFrame) -> None:
    base = bp.load(path.with_name("base.yaml"))
    assert list(table["hours limit"]) == [4.0, 5.0, 4.0, 5.0]
    for _, row in table.iterrows():
        size = 2 * [f"{1000 * row['size_m']:.0f} mm"]
        plan = bp.plan(base.with_({"artefacts.plate.size": size}), hours=row["hours limit"], seed=3)
        quantity = plan.prediction["U6"]
        assert (row["U6_average_m"], row["U6_maximum_m"]) == (quantity.average, quantity.maximum)
        assert (row["bound_m"], row["hours"]) == (plan.bound, plan.spent.seconds / 3600.0)
        assert (row["positions"], row["readings"]) == (plan.spent.positions, plan.spent.readings)
        assert row["chosen"] == "; ".join(candidate.name for candidate in plan.chosen)
        assert row["given"] == "; ".join(each.given for each in plan.qualifications)


def test_cases_are_plans_to_the_last_bit(planned: Path) -> None:
    once, twice = planned.with_name("once.sqlite"), planned.with_name("twice.sqlite")
    assert main(["sweep", str(planned), "--store", str(once), "--workers", "1"]) == 0
    assert_plans(planned, rows(once))
    # A shorter sweep into the same store stands for one that was interrupted.
    begun = planned.with_name("begun.yaml")
    text = planned.read_text(encoding="utf-8")
    begun.write_text(f"{text}only: [{{size: 750 mm}}]\n", encoding="utf-8")
    assert main(["sweep", str(begun), "--store", str(twice), "--workers", "1"]) == 0
    before = bp.stored(twice).to_frame()["duration_s"].tolist()
    more = ["--beside", "--workers", "2"]
    assert main(["sweep", str(planned), "--store", str(twice), *more]) == 0
    assert bp.stored(twice).to_frame()["duration_s"].tolist()[2:] == before
    assert_same(rows(once), rows(twice))


@pytest.mark.parametrize(
    ("plan", "expected"),
    [
        ("{criterion: U7, hours: 4 h}", 'plan.criterion: there is no criterion "U7"; known: U6, '),
        ("{positions: 6 to 4}", "plan.positions: expected a number, a list, or a range from low"),
        ("{positions: 4 - 6}", "plan.positions: expected a number, a list, or a range from low"),
        ("{hours: 4}", 'plan.hours: "4" has no unit; write for example "4 min"'),
        ("{hours: [4 h, 240 min]}", 'plan.hours: has the value "4 h" twice'),
    ],
)
def test_what_is_wrong_with_a_plan_is_said(planned: Path, plan: str, expected: str) -> None:
    text = planned.read_text(encoding="utf-8")
    planned.write_text(re.sub("(?m)^plan: .*", f"plan: {plan}", text), encoding="utf-8")
    with pytest.raises(ExperimentError) as caught:
        load_sweep(planned)
    assert f": {expected}" in str(caught.value.messages[0])


def test_a_limit_that_no_choice_keeps_to_is_a_failed_case(
    planned: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = planned.read_text(encoding="utf-8").replace("4 h, 300 min", "1 min")
    planned.write_text(text, encoding="utf-8")
    assert main(["sweep", str(planned), "--workers", "1"]) == 1
    assert "pool: no position can be read with 0.01667 h; allow more" in capsys.readouterr().err


def test_a_plan_without_a_pool(planned: Path) -> None:
    base = planned.with_name("base.yaml")
    base.write_text(base.read_text(encoding="utf-8").partition("pool:")[0], encoding="utf-8")
    table = bp.sweep(planned).to_frame()
    assert set(table["status"]) == {"failed"}
    assert table["reason"].str.contains("pool: missing; add candidates to choose from").all()


@pytest.mark.parametrize("file", ["quickstart", "planning/plate-pool", "planning/campaign"])
def test_positions_of_a_file_cost_what_a_plan_states(file: str) -> None:
    experiment = bp.load(ROOT / "designs" / f"{file}.yaml")
    if experiment.pool is None and "pool" not in experiment.tree.items:
        experiment = experiment.with_(pool={"candidates": []})
    pool = with_pool(experiment).pool
    assert pool is not None
    drawn = [k for k, candidate in enumerate(pool.candidates) if candidate.drawn]
    limits = constraints(pool.candidates, pool.changes, Budget())
    assert spent_as_drawn(experiment) == limits.spent(drawn)


def test_a_sweep_from_python_is_that_of_its_file(planned: Path) -> None:
    base, sizes = bp.load(planned.with_name("base.yaml")), ["600 mm", "750 mm"]
    both = ("artefacts.plate.size[0]", "artefacts.plate.size[1]")
    store = planned.with_name("python.sqlite")
    ways = {"record": ["U6"], "store": store}
    # In another order of the axes, as limits are the last of a file.
    found = bp.sweep(base, {"hours": [4, 5.0], both: sizes}, criterion="U6", **ways).to_frame()
    expected = bp.sweep(planned).to_frame()
    same = ["bound_m", "U6_average_m", "hours", "chosen"]
    # The seed is that of the file.
    text = planned.read_text(encoding="utf-8").replace(", seed: 3", "")
    planned.write_text(text, encoding="utf-8")
    expected = bp.sweep(planned, store=planned.with_name("other.sqlite")).to_frame()
    assert found[same].equals(expected[same])
    begun = os.stat(store).st_mtime_ns
    again = bp.sweep(base, {"hours": [4, 5.0], both: sizes}, criterion="U6", **ways).to_frame()
    assert again.equals(found) and os.stat(store).st_mtime_ns == begun


def test_values_of_python(tmp_path: Path) -> None:
    base = bp.quickstart()
    levels = ("positions[0].level", "positions[1].level")
    axes = {
        levels: [("10 %", "60 %"), ("30 %", "80 %")],
        "machine.repeatability": {"good": "0.2 um", "bad": "0.4 um"},
        "error_model.position_coefficients": np.arange(4, 6),
    }
    table = bp.sweep(base, axes, record=["U6"]).to_frame()
    assert table[" ".join(levels)].unique().tolist() == ["10 % / 60 %", "30 % / 80 %"]
    changed = {levels[0]: "30 %", levels[1]: "80 %", "machine.repeatability": "0.4 um"}
    run = bp.run(base.with_(changed | {"error_model.position_coefficients": 4}))
    assert table["U6_average_m"][6] == run["U6"].average
    assert len(table) == 8 and not list(tmp_path.iterdir())
    rows = {"a": ("10 %", "60 %"), "b": ("30 %", "80 %")}
    more = {
        "noise": {"path": "machine.repeatability", "from": "0.2 um", "to": "0.4 um", "count": 2}
    }
    named = bp.sweep(base, {levels: rows, **more}, record=["U6"]).to_frame()
    assert named[" ".join(levels)].unique().tolist() == ["a", "b"]
    assert named["U6_average_m"].tolist() == table["U6_average_m"][1::2].tolist()


@pytest.mark.parametrize(
    ("axes", "expected"),
    [
        ({"machine.repeatability": [object()]}, "a object cannot be written; give text"),
        ({"machine.repeatability": "0.2 um"}, "'0.2 um' is no list of values; give one"),
        ({"machine.repeatability": None}, "None is no list of values; give one"),
        ({("machine.repeatability", "seed"): [("0.2 um",)]}, "not every row has 2 values, one for"),
        ({"positions": "6 to 4"}, "plan.positions: expected a number, a list, or a range"),
    ],
)
def test_values_of_python_that_are_wrong(axes: dict[Any, Any], expected: str) -> None:
    with pytest.raises(ExperimentError, match=expected) as caught:
        bp.sweep(bp.quickstart(), axes)
    assert TEMPORARY not in str(caught.value)


def test_a_sweep_file_has_its_settings_itself(planned: Path) -> None:
    with pytest.raises(ValueError, match="a sweep file has trials, plan itself"):
        bp.sweep(planned, trials=3, criterion="U5")


def test_estimators_are_an_axis(tmp_path: Path) -> None:
    path = tmp_path / "e.yaml"
    text = (
        f"title: e\nbase: {ROOT}/designs/quickstart.yaml\nestimator: [full, distances]\nseed: 5\n"
    )
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ExperimentError, match="3:12: estimator: needs data sets; add trials: 100"):
        load_sweep(path)
    path.write_text(f"{text}trials: 3\n", encoding="utf-8")
    result = bp.sweep(path)
    table = result.to_frame().set_index("estimator")
    # U6 is that of the full estimator, and no verdict is of another.
    assert table["U6_average_m"].isna().tolist() == [False, True]
    assert answer(result).sentences[0].startswith("1 of 1 case meets")
    python = {"estimator": ["full", "distances"]}
    again = bp.sweep(bp.quickstart(), python, trials=3, seed=5).to_frame().set_index("estimator")
    figures = ["distance_error_rms_m", "distance_error_bias_m", "data_set_seed", "U6_average_m"]
    assert again[figures].equals(table[figures])
    errors = bp.compare(bp.quickstart(), trials=3, seed=5).of_truth
    for name in ("full", "distances"):
        assert table["distance_error_rms_m"][name] == errors[name].rms
        assert table["distance_error_bias_m"][name] == errors[name].bias
