"""What limits a design, and the unknowns tips, temperatures and hours."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.requirements import root_search
from ballplate.extensions.requirements.answers import Answer
from ballplate.extensions.requirements.goals import Judgement, judge, parse_goal
from ballplate.extensions.requirements.root_search import Tried, _scanned, _Searched, _Trials, reach
from ballplate.extensions.requirements.unknowns import NotVariableError, unknown
from ballplate.results.prediction import predict
from ballplate.simulator.experiment.loading import load

from tests.extensions.planning.small_pool import TEXT
from tests.extensions.requirements import wording
from tests.reference.small_quickstart import small_quickstart

ONLY = {"name": "only", "plane": "z", "level": "100 mm", "corner": {"x": "0 mm", "y": "0 mm"}}
STEEL = {"value": "11.5 um/m/K", "standard_uncertainty": "0 um/m/K"}


def warm(u: str = "0.1 K") -> bp.Experiment:
    measured = {"value": "20 degC", "standard_uncertainty": u, "sensor_uncertainty": u}
    influence = {"kind": "temperature", "artefact_expansion": STEEL, "scale_expansion": STEEL}
    influence |= {"artefact_temperature": measured, "scale_temperature": measured}
    return small_quickstart(influences=[influence], **FEW)


FEW: dict[str, Any] = {"evaluation": {"points": {"random": 12, "seed": 1}, "probe": "down"}}


def average(experiment: bp.Experiment) -> float:
    return predict(experiment).quantities["U6"].average


def answered(experiment: bp.Experiment, limit: float, name: str) -> tuple[Answer, str]:
    found = reach(experiment, parse_goal(f"U6 average {1e6 * limit:.12g} um"), (name,))  # type: ignore[arg-type]
    return found.answers[0], found.limit


def test_temperatures_are_named_where_they_limit() -> None:
    """The goal is met with thermometers of a third of the uncertainty, and by nothing else."""
    limit = 1.0005 * average(warm("0.03 K"))
    for name in ("repeatability", "tips"):
        found, limited = answered(warm(), limit, name)
        assert found.status in ("none", "limited"), name
        assert wording.LIMITED_BY_TEMPERATURES in limited and "would meet the goal" in limited
    found, limited = answered(warm(), limit, "thermometers")
    assert found.status == "found" and limited == ""
    assert found.value == pytest.approx(0.03, rel=0.01)
    assert average(warm(found.words)) <= limit
    assert average(warm(f"{found.value + 1e-4:.4f} K")) > limit


def test_tips_are_as_uncertain_as_the_goal_permits() -> None:
    def with_tips(u: float) -> bp.Experiment:
        experiment = small_quickstart(**FEW)
        stated = np.full(3, u)
        probes = {
            name: probe if name == "down" else replace(probe, standard_uncertainty=stated)
            for name, probe in experiment.probes.items()
        }
        return replace(experiment, probes=probes)

    limit = 1.0002 * average(with_tips(0.4e-6))
    found, _ = answered(small_quickstart(**FEW), limit, "tips")
    assert found.status == "found" and found.present == "exact" and found.value is not None
    assert found.value >= 0.4e-6
    assert average(with_tips(found.value)) <= limit < average(with_tips(found.value + 1e-9))


def test_what_is_not_stated_cannot_be_varied() -> None:
    with pytest.raises(NotVariableError, match="temperatures"):
        answered(small_quickstart(**FEW), 1e-7, "thermometers")
    with pytest.raises(NotVariableError, match="pool"):
        bp.reach(small_quickstart(**FEW), "U6 average 0.1 um", "hours")


def test_the_largest_size_that_fits_is_no_limit_of_the_design() -> None:
    experiment = small_quickstart(**FEW)
    # Plates follow up to the walls; balls stop a thousandth of the volume beyond them.
    found, _ = answered(experiment, 0.4 * average(experiment), "size")
    assert found.status == "limited" and found.value == pytest.approx(1.0, rel=0.01)
    assert "volume" in found.remarks[0]
    result = bp.reach(experiment, f"U6 average {0.4e6 * average(experiment):.9g} um", "size")
    assert any(f"more than {found.words}" in line for line in result.lines())


def test_one_more_coefficient_with_the_fewest_balls() -> None:
    experiment = small_quickstart(**FEW)
    found, _ = answered(experiment, 1.3 * average(experiment), "balls")
    fewest = experiment.with_({"artefacts.plate.balls": [int(n) for n in found.words.split(" x ")]})
    more = fewest.with_(
        {f"error_model.{key}_coefficients": n + 1 for key, n in (("position", 3), ("rotation", 2))}
    )
    lengths = predict(more).quantities["U6"]
    (told,) = [one for one in found.remarks if "error model" in one]
    ratio = lengths.average / average(fewest)
    assert told.endswith("undetermined") if math.isnan(ratio) else f"{ratio:.2g} times" in told


@pytest.mark.parametrize("place", range(60, 700, 160))
def test_a_narrow_range_of_sizes_is_found(place: int) -> None:
    """Of two better sizes the one that does is narrow, the other wide: steps of a stub."""
    experiment = small_quickstart(**FEW)
    sought = unknown("size", experiment, experiment.tree, None, None)
    searched = _Searched(experiment.tree, experiment.builder, parse_goal("U6 average 1 um"))
    steps = range(sought.first, sought.drawn + 1)
    width = 0.06 * len(steps)
    peak = sought.first + len(steps) * place // 800

    class Stub(_Trials):
        def _tried(self, step: int) -> Tried:
            wide = 0.3 * abs(step - sought.drawn) / len(steps) + 0.5
            narrow = abs(step - peak) / width
            distance = min(wide, 0.2 + narrow)
            return Tried(str(step), Judgement(distance <= 0.4, distance, "", 0), 0, "")

    trials = Stub(sought, searched)
    steps_met = [step for step in steps if trials._tried(step).is_met]
    assert steps_met
    with pytest.MonkeyPatch.context() as patch:
        answers: list[int] = []
        patch.setattr(
            "ballplate.extensions.requirements.root_search._told",
            lambda trials, status, step, remarks: (
                answers.append(step) or Answer("size", "size", status, remarks=tuple(remarks))
            ),
        )
        found = _scanned(trials)
    assert found.status == "found" and answers == [steps_met[0]]


def test_the_hours_are_those_of_the_shortest_plan(tmp_path: Path) -> None:
    """Of a pool with a rod, which the file's position does not have."""
    path = tmp_path / "pool.yaml"
    drawn = "{name: p, plane: z, level: 50 mm, corner: {x: 0 mm, y: 0 mm}, probes: [down]}"
    drawn = drawn.replace("name: p", "name: p, artefact: plate")
    few = TEXT.replace("[0 mm, 300 mm]", "0 mm").replace("[0 mm, 200 mm]", "0 mm")
    few = few.replace("artefacts:", "artefacts:\n  rod: {kind: two_spheres, length: 90 mm}")
    rod = drawn.replace("name: p, artefact: plate", "name: rod, artefact: rod")
    few = few.replace("candidates:", f"candidates:\n    - {rod}")
    path.write_text(f"{few}\npositions:\n  - {drawn}\n", encoding="utf-8")
    (experiment,) = load(path, planning=True)
    best = bp.plan(experiment, hours=3.0).prediction.quantities["U6"].average
    goal = parse_goal(f"U6 average {1.0000001e6 * best:.12g} um")
    (found,) = reach(experiment, goal, ("hours",)).answers
    assert found.status == "found" and found.value is not None
    hours = found.value / 3600.0
    assert hours <= 3.0 and found.words == f"{hours:g} h"
    assert judge(goal, bp.plan(experiment, hours=hours).prediction).is_met
    less = bp.plan(experiment, hours=hours - 0.25)
    assert not judge(goal, less.prediction).is_met


def test_a_certificate_is_varied_with_what_its_values_have_in_common() -> None:
    """One certificate states both parts; its limit is that of a plate of which all is known."""
    item = {"kind": "distances", "pairs": "corner sides", "standard_uncertainty": "0.2 um"}
    stated = bp.quickstart().with_(
        {
            "calibration": [{**item, "common": "0.3 um/m"}],
            "evaluation.points": {"random": 20, "seed": 1},
        }
    )
    exact = {**item, "standard_uncertainty": "0.00002 um", "common": "0.00003 um/m"}
    least = bp.run(stated.with_({"calibration": [exact]})).quantities["U6"].average
    present = bp.run(stated).quantities["U6"].average
    assert least < 0.99 * present
    goal = f"U6 average {1e6 * (0.4 * present + 0.6 * least):.6f} um"
    (answer,) = bp.reach(stated, goal, "certificate").answers
    assert answer.status == "found"
    own, common = answer.words.split(", ")
    half = {**item, "standard_uncertainty": own, "common": common}
    found = bp.run(stated.with_({"calibration": [half]})).quantities["U6"].average
    assert 0.995 < found / (0.4 * present + 0.6 * least) <= 1.0


@pytest.mark.parametrize("columns, rows", [(6, 4), (3, 5), (2, 40)])
def test_grids_are_all_nearly_in_proportion_by_their_number(columns: int, rows: int) -> None:
    experiment = small_quickstart(**FEW).with_({"artefacts.plate.balls": [columns, rows]})
    sought = unknown("balls", experiment, experiment.tree, None, None)
    words = [sought.words(step).split(" x ") for step in range(sought.first, sought.last + 1)]
    found = [(int(n), int(m)) for n, m in words]
    assert sorted(found) == [
        (n, m)
        for n, m in product(range(2, max(30, rows) + 1), repeat=2)
        if min(abs(n - m * columns / rows), abs(m - n * rows / columns)) <= 1.0 + 1e-12
    ]
    apart = [(n * m, abs(n * rows - m * columns)) for n, m in found]
    assert apart == sorted(apart) and found[sought.drawn] == (columns, rows)


def test_what_no_size_determines() -> None:
    """From a twentieth of the plate to the largest in a volume of a metre."""
    few = small_quickstart(**FEW)
    (found,) = bp.reach(
        few.with_({"positions": [ONLY | {"probes": ["down"]}]}), "U6 average 1 um", "size"
    ).answers
    assert found.status == "undetermined" and wording.NO_SIZE_DETERMINES in found.remarks[0]


def test_goals_are_judged_by_what_is_predicted() -> None:
    """Two tasks, of which one may exceed its target; lengths at their share, below and above."""
    ends = {"near": "100 mm", "far": "1 m"}.items()
    tasks = [{"name": k, "from": ["0 mm"] * 3, "to": [end, "0 mm", "0 mm"]} for k, end in ends]
    experiment = small_quickstart(evaluation=FEW["evaluation"] | {"tasks": tasks})
    prediction = predict(experiment)
    lengths = replace(prediction.quantities["U6"], undetermined=2)
    found = judge(parse_goal("U6 average 1 um"), replace(prediction, quantities={"U6": lengths}))
    assert not found.is_met and found.distance == pytest.approx(1e6 * lengths.average + 2.0)
    near, far = (task.standard_uncertainty for task in prediction.tasks)
    for target, count in ((0.5 * (near + far), 1), (1.1 * far, 2)):
        planned = predict(experiment.with_({"target_uncertainty": f"{1e6 * target:.9f} um"}))
        u6 = planned.quantities["U6"]
        share, one = float(u6.within_target or 0.0), 1.0 / u6.count
        told = "all" if share == 1.0 else f"{100 * share:.4g} % of"
        largest, ratio = f" {1e6 * u6.maximum:.4g} µm", far / target
        for goal, asked, is_met, distance, words, more in (
            ("tasks", None, count == 2, ratio, f"{count} of 2 tasks", f" far, {100 * ratio:.4g} %"),
            ("lengths", share, True, 1 - share, f"{told} lengths", f" {1e6 * u6.average:.4g} µm"),
            ("lengths", share + one, False, 1 - share, f"{told} lengths", " µm"),
            (f"U6 maximum {1.01 * u6.maximum} m", None, True, 1 / 1.01, "maximum U6", largest),
            (f"U6 maximum {0.99 * u6.maximum} m", None, False, 1 / 0.99, "maximum U6", largest),
        ):
            found = judge(parse_goal(goal, asked), planned)
            assert found.is_met is is_met and found.distance == pytest.approx(distance)
            assert found.words.startswith(words) and found.words.endswith(more)


def test_numbers_of_balls_beyond_a_dozen_are_tried_a_quarter_apart() -> None:
    square = {"kind": "square", "balls": 5, "size": "750 mm"}
    experiment = small_quickstart(**FEW).with_({"artefacts.plate": square})
    sought = unknown("balls", experiment, experiment.tree, None, None)
    searched = _Searched(experiment.tree, experiment.builder, parse_goal("U6 average 1 um"))
    tried = [sought.value(step) for step in root_search._probes(_Trials(sought, searched))]
    assert tried == [*range(2, 13), 15, 19, 24, 30]
