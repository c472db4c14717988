"""A campaign as it is measured: what is read next, and when the target is met."""

from __future__ import annotations

import json
from pathlib import Path

import ballplate as bp
import numpy as np
import pandas
import pytest
from ballplate.cli import main
from ballplate.extensions.campaign.next_position import (
    next_step,
    possible_positions,
    with_positions,
)
from ballplate.extensions.campaign.next_result import NextStep
from ballplate.extensions.requirements.goals import GoalError, parse_goal
from ballplate.results import given_words
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.yamltree import GivenText
from scipy.stats import chi2

from tests.extensions.campaign import wording
from tests.extensions.planning.small_pool import TEXT

QUICKSTART = "designs/quickstart.yaml"
NAMES = ("z low", "z high", "x low", "x high", "y low", "y high")


def judged(
    readings: pandas.DataFrame, goal: str = "lengths", experiment: Experiment | None = None
) -> NextStep:
    text = GivenText("readings.csv", readings.to_csv(index=False))
    return next_step(experiment or bp.quickstart(), [text], parse_goal(goal))


@pytest.fixture(scope="module")
def readings() -> pandas.DataFrame:
    return bp.simulate(QUICKSTART, 5)


def of(readings: pandas.DataFrame, *names: str) -> pandas.DataFrame:
    return readings[readings.position.isin(names)]


def scattered(readings: pandas.DataFrame, micrometres: float, seed: int = 0) -> pandas.DataFrame:
    """Readings with more noise."""
    noise = np.random.default_rng(seed).standard_normal((len(readings), 3))
    found = readings.copy()
    found[["x_mm", "y_mm", "z_mm"]] += 1e-3 * micrometres * noise
    return found


def test_the_next_position_is_the_best_of_all(readings: pandas.DataFrame) -> None:
    found = judged(of(readings, *NAMES[:4]))
    whole = bp.quickstart()
    every = {}
    for name in NAMES[4:]:
        left_out = next(one for one in NAMES[4:] if one != name)
        less = whole.with_({f"positions[{left_out}]": None})
        every[name] = bp.run(less).quantities["U6"].average
    assert found.next is not None
    assert found.next.name == min(every, key=lambda name: every[name])
    # sigma is below one here, and does not make anything better than stated.
    assert found.fit is not None and found.fit.sigma < 1.0 and found.sigma == 1.0
    for one in found.offered:
        assert one.average == pytest.approx(every[one.name], rel=1e-9)


def test_of_many_only_the_first_by_fewer_points_are_judged(
    readings: pandas.DataFrame, monkeypatch: pytest.MonkeyPatch
) -> None:
    every = judged(of(readings, *NAMES[:3]))
    few = {"MOST_OFFERED": 1, "RANKED_BY": 150, "KEPT": 2}
    for name, value in few.items():
        monkeypatch.setattr(f"ballplate.extensions.campaign.next_position.{name}", value)
    kept = judged(of(readings, *NAMES[:3])).offered
    assert [one.name for one in kept] == [one.name for one in every.offered[:2]]
    assert [one.average for one in kept] == [one.average for one in every.offered[:2]]


def test_what_was_promised_is_reached(readings: pandas.DataFrame) -> None:
    before = judged(of(readings, *NAMES[:5]))
    assert not before.is_met and before.next is not None and before.next.name == "y high"
    after = judged(readings)
    assert after.is_met and after.next is None
    assert after.fit is not None
    reached = after.fit.quantities["U6"].average / after.fit.sigma
    assert before.next.average == pytest.approx(reached, rel=0.01)
    # The qualifications are those of the six positions as a design.
    verdict = f"target met{given_words(bp.check(bp.quickstart()).qualifications)}: stop"
    assert after.lines()[0].endswith(verdict)


def test_scatter_above_what_is_stated_counts(readings: pandas.DataFrame) -> None:
    goal = "U6 average 0.2 um"
    assert judged(readings, goal).is_met
    found = judged(scattered(readings, 0.35), goal)
    fit = found.fit
    assert fit is not None and fit.sigma > 1.5 and found.sigma == fit.sigma
    assert not found.is_met and "target not met" in found.lines()[0]
    # Whatever the file says of sigma.
    given = bp.quickstart().with_({"sigma": "given"})
    told = judged(scattered(readings, 0.35), goal, given)
    assert told.sigma == pytest.approx(fit.sigma, rel=1e-9) and not told.is_met
    assert told.now is not None and found.now is not None
    assert told.now.distance == pytest.approx(found.now.distance, rel=1e-9)
    # Of the residuals, or of the stated uncertainties times what the residuals say.
    lengths = fit.quantities["U6"]
    for one in (found.to_dict(), told.to_dict()):
        assert one["U6_average"] == pytest.approx(lengths.average, rel=1e-9)
        assert one["U6_maximum"] == pytest.approx(lengths.maximum, rel=1e-9)
        assert one["why_no_estimate"] is None and one["goal_met"] is False


def test_a_gross_error_is_named_and_stops_nothing(readings: pandas.DataFrame) -> None:
    wrong = readings.copy()
    wrong.loc[30, "z_mm"] += 0.003
    found = judged(wrong, "U6 average 1 um")
    assert found.now is not None and found.now.is_met and not found.is_met
    line = found.lines()[0]
    assert any("suspected: " in one and "line 32" in one for one in found.lines())
    assert wording.TARGET_MET_BUT_FOR_WHAT in line


def small(positions: int) -> Experiment:
    """A plate in a plane, read so that few degrees of freedom are left."""
    corners = [("100 mm", 0), ("150 mm", 1), ("120 mm", 2)][:positions]
    return bp.experiment(
        {
            "title": "few readings",
            "machine": {"volume": ["600 mm", "600 mm"], "repeatability": "0.5 um"},
            "error_model": {"kind": "metric"},
            "artefacts": {"plate": {"kind": "square", "balls": 2, "size": "300 mm"}},
            "positions": [
                {"name": f"P{k}", "corner": {"x": x, "y": "100 mm"}, "quarter_turns": turns}
                for k, (x, turns) in enumerate(corners)
            ],
            "calibration": [
                {"kind": "distances", "pairs": "corner sides", "standard_uncertainty": "0.5 um"}
            ],
            "evaluation": {"points": {"random": 20, "seed": 1}},
        }
    )


def test_few_degrees_of_freedom_are_a_reason_to_go_on() -> None:
    experiment = small(2)
    table = bp.simulate(experiment, 3)
    found = judged(table, "U6 average 100 um", experiment)
    fit = found.fit
    assert fit is not None and 0 < fit.degrees_of_freedom < 10
    squares = fit.solution.factor.sum_of_squares
    bound = max(found.sigma, np.sqrt(squares / chi2.ppf(0.05, fit.degrees_of_freedom)))
    assert found.bound == pytest.approx(bound, rel=1e-9) and found.is_met
    # A target between what is met as stated and what is at the bound.
    average = 1e6 * found.sigma * fit.quantities["U6"].average / fit.sigma
    ratio = bound / found.sigma
    assert ratio > 1.1
    between = f"U6 average {average * np.sqrt(ratio):.9f} um"
    narrow = judged(table, between, experiment)
    assert narrow.now is not None and narrow.now.is_met and not narrow.is_met
    assert wording.WITH_SO_FEW_DEGREES_OF_FREEDOM in narrow.lines()[0]


def test_without_redundancy_nothing_is_known_of_the_scatter() -> None:
    experiment = small(2).with_({"positions[P1]": None, "calibration": []})
    found = judged(bp.simulate(experiment, 3), "U6 average 100 um", experiment)
    assert not found.is_met
    assert "target not met" in found.lines()[0] and found.to_dict()["target_met"] is False


def test_a_position_read_again_under_its_name_is_refused(readings: pandas.DataFrame) -> None:
    with pytest.raises(bp.ExperimentError, match="x low"):
        judged(pandas.concat([readings, of(bp.simulate(QUICKSTART, 6), "x low")]))


def test_the_order_of_readings_within_a_position_does_not_matter(
    readings: pandas.DataFrame,
) -> None:
    found = judged(readings.sort_values("ball", kind="stable"))
    assert found.is_met and not found.missing


def test_an_interrupted_position_is_completed_first(readings: pandas.DataFrame) -> None:
    found = judged(readings.iloc[:13])
    line = found.lines()[0]
    data = found.to_dict()
    assert {data[f"U6_{name}"] for name in ("average", "maximum")} == {data["sigma"]} == {None}
    assert data["goal_met"] is False and data["degrees_of_freedom"] is None
    assert data["why_no_estimate"] == found.why != "" and data["next"] == "z low"
    assert found.fit is None and wording.NOTHING_CAN_BE_ESTIMATED_YET in found.lines()[2]
    assert "next: rest of z low (12 readings)" in line and not found.is_met
    later = judged(pandas.concat([readings.iloc[:100], readings.iloc[100:115]]))
    assert later.missing == {"x high": 35} and later.fit is not None
    some = pandas.concat([readings.iloc[2:25], readings.iloc[25:48], readings.iloc[50:115]])
    assert judged(some).missing == {"z low": 2, "z high": 2, "x high": 35}
    missing = "readings missing in positions read (39): z low 2, z high 2, x high 35"
    assert judged(some).lines()[1] == missing
    rest = next(one for one in later.offered if one.name == "x high")
    whole = judged(readings.iloc[:100])
    same = next(one for one in whole.offered if one.name == "x high")
    assert (rest.readings, same.readings) == (35, 50)
    assert rest.average == pytest.approx(same.average, rel=1e-6, nan_ok=True)


@pytest.mark.long
def test_positions_come_from_the_pool(tmp_path: Path) -> None:
    path = tmp_path / "pool.yaml"
    sides = "  - {kind: distances, artefact: plate, pairs: all, standard_uncertainty: 0.5 um}\n"
    path.write_text(TEXT.replace("target_uncertainty", f"{sides}target_uncertainty", 1), "utf-8")
    (experiment,) = load(path, planning=True)
    assert experiment.pool is not None
    possible = possible_positions(experiment)
    names = list(possible)[:1]
    read = with_positions(experiment, [possible[name] for name in names])
    found = judged(bp.simulate(read, 1), "U6 average 1 um", experiment)
    assert found.read == tuple(names) and found.next is not None
    assert {one.name for one in found.offered} == set(possible) - set(names)
    values = {
        name: bp.run(
            with_positions(experiment, [possible[one] for one in (*names, name)])
        ).quantities["U6"]
        for name in list(possible)[1:]
    }
    for one in found.offered:
        assert one.then.undetermined == values[one.name].undetermined


def test_unknown_positions_and_targets_are_refused(readings: pandas.DataFrame) -> None:
    # Told by their places, names are found; nothing stands in these.
    named = readings.replace("z low", "quite elsewhere").iloc[:25]
    assert judged(named).read == ("z low",)
    named["x_mm"] = np.random.default_rng(1).uniform(0.0, 1000.0, 25)
    with pytest.raises(bp.ExperimentError, match="quite elsewhere"):
        judged(named)
    with pytest.raises(GoalError, match="target_uncertainty"):
        judged(readings, "lengths", bp.quickstart().with_({"target_uncertainty": None}))


def test_the_command_begins_with_the_verdict(
    tmp_path: Path, readings: pandas.DataFrame, capsys: pytest.CaptureFixture[str]
) -> None:
    table = tmp_path / "readings.csv"
    readings.to_csv(table, index=False)
    assert main(["next", QUICKSTART, str(table)]) == 0
    out = capsys.readouterr().out
    given = given_words(bp.check(bp.quickstart()).qualifications)
    assert out.partition("\n")[0] == f"6 positions read, last y high; target met{given}: stop"
    assert max(map(len, out.splitlines())) < 120
    assert main(["next", QUICKSTART, str(table), "--target", "0.01 um", "--json"]) == 1
    told = json.loads(capsys.readouterr().out)
    assert told["target_met"] is False and told["next"] is None
