"""Reverse planning against closed forms, an independent root finder and plans of files written by
hand.
"""

from __future__ import annotations

import math
from decimal import Decimal
from itertools import product
from pathlib import Path

import pytest
from ballplate.cli import main
from ballplate.extensions.requirements.answers import Answer
from ballplate.extensions.requirements.goals import Goal, GoalError, parse_goal
from ballplate.extensions.requirements.root_search import reach
from ballplate.extensions.requirements.steps import at_step, round_down, round_up, step_of
from ballplate.extensions.requirements.unknowns import NotVariableError
from ballplate.results.prediction import Prediction, predict
from ballplate.simulator.experiment.loading import load
from scipy.optimize import brentq

from tests.extensions.requirements import wording

TEXT = (
    Path("designs/quickstart.yaml")
    .read_text(encoding="utf-8")
    .replace("coefficients: 5", "coefficients: 4")
    .replace("balls: [5, 5]", "balls: [4, 4]")
    .replace("random: 200", "random: 12")
)
SIDES = (
    "pairs: corner sides            # or corner diagonals, corners, neighbours, all, or a list of"
    " pairs of balls"
)
CERTIFICATE = "standard_uncertainty: 0.2 um   # or one that grows with length: 0.1 um + L/1000000"
TEXT = TEXT.replace(TEXT[TEXT.index("true_machine:") : TEXT.index("# Offsets")], "")
UNCALIBRATED = TEXT.replace(TEXT[TEXT.index("calibration:") : TEXT.index("# Where U4")], "")


def written(folder: Path, text: str, *changes: tuple[str, str]) -> Path:
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    file = folder / "design.yaml"
    file.write_text(text, encoding="utf-8")
    return file


def planned(folder: Path, *changes: tuple[str, str], text: str = TEXT) -> Prediction:
    return predict(load(written(folder, text, *changes))[0])


def average(folder: Path, *changes: tuple[str, str], text: str = TEXT) -> float:
    return planned(folder, *changes, text=text).quantities["U6"].average


def answer(folder: Path, goal: str | Goal, name: str, text: str = TEXT) -> Answer:
    asked = parse_goal(goal) if isinstance(goal, str) else goal
    return reach(load(written(folder, text))[0], asked, (name,)).answers[0]  # type: ignore[arg-type]


def test_steps_are_all_numbers_of_three_digits() -> None:
    values = [at_step(step) for step in range(-950, 950)]
    assert values == sorted(set(values)) and all(
        len(value.as_tuple().digits) == 3 for value in values
    )
    assert all(step_of(at_step(step)) == step for step in range(-2000, 2000, 7))
    assert round_down(Decimal("0.21499")) == Decimal("0.214") and round_up(
        Decimal("0.2141")
    ) == Decimal("0.215")


def test_without_certificate_uncertainties_are_proportional_to_the_repeatability(
    tmp_path: Path,
) -> None:
    """The tips of the star probe alone give the length: U is 0.2 um times what the design makes of
    it.
    """
    now = average(tmp_path, text=UNCALIBRATED)
    found = answer(tmp_path, "U6 average 0.123 um", "repeatability", UNCALIBRATED)
    assert found.status == "found" and found.value is not None
    exact = 0.2e-6 * 0.123e-6 / now
    assert found.value <= exact < found.value + 1.001e-2 * found.value
    assert found.value == pytest.approx(float(round_down(Decimal(exact))), rel=1e-12)
    assert found.words == f"{1e6 * found.value:.9g} um"


def test_without_certificate_uncertainties_fall_with_the_root_of_the_repeats(
    tmp_path: Path,
) -> None:
    now, limit = average(tmp_path, text=UNCALIBRATED), 0.05e-6
    found = answer(tmp_path, Goal("quantity", limit=limit), "repeats", UNCALIBRATED)
    assert found.value == math.ceil((now / limit) ** 2)
    assert found.beside.startswith(f"{found.value - 1:g} is not enough: average U6 ")


@pytest.mark.long
def test_more_repeats_than_a_file_may_have_are_told(tmp_path: Path) -> None:
    """Two million readings are the most; 64 balls are read with each probe of a position."""
    (experiment,) = load(written(tmp_path, TEXT, ("balls: [4, 4]", "balls: [8, 8]")))
    (found,) = reach(experiment, parse_goal("U6 average 0.0001 um"), ("repeats",)).answers
    most = 2_000_000 // (64 * sum(len(one.probes) for one in experiment.positions))
    assert (found.status, found.value) == ("limited", most)
    (told,) = found.remarks
    assert told.startswith(f"more than {most} are not possible: positions[5]")
    assert "at most 2000000 are possible" in told


def test_the_certificate_is_where_an_independent_root_finder_has_it(tmp_path: Path) -> None:
    loose, tight = (
        average(tmp_path, (CERTIFICATE, f"standard_uncertainty: {u} um")) for u in ("50", "0.0001")
    )
    limit = 0.5 * (loose + tight)

    def excess(log_of_um: float) -> float:
        return (
            average(tmp_path, (CERTIFICATE, f"standard_uncertainty: {math.exp(log_of_um):.15g} um"))
            - limit
        )

    root = 1e-6 * math.exp(brentq(excess, math.log(1e-4), math.log(50.0), rtol=1e-8))
    found = answer(tmp_path, Goal("quantity", limit=limit), "certificate")
    assert found.status == "found" and found.value == float(round_down(Decimal(root)))
    again = average(tmp_path, (CERTIFICATE, f"standard_uncertainty: {found.words}"))
    assert again <= limit and f"average U6 {1e6 * again:.4g}" in found.outcome


def test_where_no_certificate_does_the_limit_is_that_of_an_exact_one(tmp_path: Path) -> None:
    limit = average(tmp_path, (CERTIFICATE, "standard_uncertainty: 0.00001 um"))
    found = answer(tmp_path, Goal("quantity", limit=0.99 * limit), "certificate")
    assert found.status == "none" and f"average U6 {1e6 * limit:.4g}" in found.outcome
    assert found.remarks == ()
    found = answer(tmp_path, Goal("quantity", limit=1.0), "certificate")
    assert found.status == "any"


def test_the_size_is_the_smallest_that_does(tmp_path: Path) -> None:
    present = average(tmp_path)
    found = answer(tmp_path, Goal("quantity", limit=1.2 * present), "size")
    assert found.status == "found" and found.value is not None
    edge = round(1e3 * found.value)
    for size, does in ((edge, True), (edge - 1, False)):
        value = average(tmp_path, ("[750 mm, 750 mm]", f"[{size} mm, {size} mm]"))
        assert (value <= 1.2 * present) is does
    assert found.remarks[0].startswith(wording.FROM_MM_MM)


@pytest.mark.parametrize(
    "drawn", [(4, 3), *(pytest.param(one, marks=pytest.mark.long) for one in ((4, 4), (3, 5)))]
)
def test_balls_are_the_fewest_of_all_grids_nearly_in_proportion(
    tmp_path: Path, drawn: tuple[int, int]
) -> None:
    """Against plans of every grid with no more balls that is in proportion to within a ball on one
    of its sides.
    """
    text = TEXT.replace("[4, 4]", f"[{drawn[0]}, {drawn[1]}]")
    ratio = drawn[0] / drawn[1]
    values = {
        (n, m): average(tmp_path, (str(list(drawn)), f"[{n}, {m}]"), text=text)
        for n, m in product(range(2, 9), repeat=2)
        if abs(n - m * ratio) <= 1.0 or abs(m - n / ratio) <= 1.0
    }
    wanted = {(4, 4): (6, 5), (4, 3): (7, 6), (3, 5): (4, 5)}[drawn]
    limit = 1.0001 * values[wanted]
    found = answer(tmp_path, Goal("quantity", limit=limit), "balls", text)
    columns, rows = map(int, found.words.split(" x "))
    fewest = min(n * m for (n, m), value in values.items() if value <= limit)
    assert values[columns, rows] <= limit and columns * rows == fewest and found.value == columns
    failed = tuple(map(int, found.beside.partition(" is not enough")[0].split(" x ")))
    assert values[failed] > limit and failed[0] * failed[1] <= fewest


def test_sides_and_axes_keep_their_ratio_and_are_rounded_to_the_safe_side(tmp_path: Path) -> None:
    text = TEXT.replace("repeatability: 0.2 um", "repeatability: [0.2 um, 0.2 um, 0.3 um]")
    text = text.replace("[750 mm, 750 mm]", "[750 mm, 600 mm]").replace("[4, 4]", "[6, 4]")
    text = text.replace(CERTIFICATE, "standard_uncertainty: 0.1 um + L/1000000")
    file = written(tmp_path, text)
    goal = Goal("quantity", limit=0.8 * planned(tmp_path, text=text).quantities["U6"].average)
    names = ("repeatability", "certificate", "balls")
    found = {one.name: one for one in reach(load(file)[0], goal, names).answers}
    words = found["repeatability"].words.split(", ")
    first, third = (float(word.removesuffix(" um")) for word in (words[0], words[2]))
    assert words[0] == words[1] and third == float(
        round_down(Decimal("1.5") * Decimal(repr(first)))
    )
    changes = ("[0.2 um, 0.2 um, 0.3 um]", f"[{found['repeatability'].words}]")
    assert average(tmp_path, changes, text=text) <= goal.limit
    columns, rows = map(int, found["balls"].words.split(" x "))
    assert abs(rows - columns * 4 / 6) <= 1.0
    assert average(tmp_path, ("[6, 4]", f"[{columns}, {rows}]"), text=text) <= goal.limit
    assert "+ L/" in found["certificate"].words


def test_a_deficient_design_is_to_be_repaired_first(tmp_path: Path) -> None:
    text = TEXT.replace("coefficients: 4", "coefficients: 6")
    result = reach(
        load(written(tmp_path, text))[0],
        Goal(),
        ("repeatability", "certificate", "repeats", "balls"),
    )
    assert result.deficiency > 0 and result.present.undetermined > 0
    by_name = {one.name: one for one in result.answers}
    for name in ("repeatability", "certificate", "repeats"):
        assert by_name[name].status == "undetermined"  # type: ignore[index]
    # More balls repair it.
    assert by_name["balls"].status == "found" and by_name["balls"].value > 4  # type: ignore[operator]


def test_balls_that_are_named_set_limits_to_their_number(tmp_path: Path) -> None:
    text = TEXT.replace(SIDES, "pairs: [[r1c1, r4c4], [r1c4, r4c1]]")
    found = answer(tmp_path, "U6 average 0.08 um", "balls", text)
    assert found.is_met and found.value > 4  # type: ignore[operator]
    assert 'unknown ball "r' in found.remarks[0] and found.remarks[0].startswith(
        wording.THE_FILE_IS_INVALID
    )


def test_shares_and_tasks(tmp_path: Path) -> None:
    target = ("0.5 um + L/1000000", "0.15 um")
    most = answer(tmp_path, parse_goal("lengths", 0.8), "repeatability", TEXT.replace(*target))
    every = answer(tmp_path, "lengths", "repeatability", TEXT.replace(*target))
    assert every.value < most.value  # type: ignore[operator]
    change = ("repeatability: 0.2 um", f"repeatability: {most.words}")
    share = planned(tmp_path, change, target).quantities["U6"].within_target
    assert share is not None and share >= 0.8
    tasks = "  tasks: [{name: edge, from: [0 mm, 0 mm, 0 mm], to: [1 m, 0 mm, 0 mm]}]\n\ntarget"
    with_task = TEXT.replace(*target).replace("\ntarget", tasks)
    found = answer(tmp_path, "tasks", "repeatability", with_task)
    told = predict(
        load(
            written(tmp_path, with_task, ("repeatability: 0.2 um", f"repeatability: {found.words}"))
        )[0]
    )
    assert told.tasks[0].is_within and told.tasks[0].standard_uncertainty > 0.985 * 0.15e-6


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("U7 average 1 um", '"U7" is not a quantity with a limit; known: U1'),
        ("U2 average 1 um", '"U2" is not a quantity with a limit; give U2 lengths or U2 angles'),
        ("U2 angles maximum 1 um", '"1 um" is a length; an angle is expected'),
    ],
)
def test_goals_that_are_none(text: str, message: str) -> None:
    with pytest.raises(GoalError, match="^" + message.replace("(", r"\(")):
        parse_goal(text)


def test_what_the_file_does_not_have(tmp_path: Path) -> None:
    file = written(tmp_path, UNCALIBRATED.replace("target_uncertainty: 0.5 um + L/1000000\n", ""))
    experiment = load(file)[0]
    with pytest.raises(GoalError, match="states no target_uncertainty"):
        reach(experiment, Goal())
    with pytest.raises(GoalError, match=wording.THE_FILE_HAS_NO_TASKS):
        reach(experiment, Goal("tasks"))
    goal = parse_goal("U6 average 1 um")
    with pytest.raises(NotVariableError, match="states no calibration"):
        reach(experiment, goal, ("certificate",))
    with pytest.raises(NotVariableError, match=wording.UNKNOWN_ARTEFACT_DID_YOU_MEAN):
        reach(experiment, goal, ("size",), artefact="plat")
    found = reach(experiment, goal, ("certificate", "repeats")).answers
    assert [one.status for one in found] == ["varied", "any"] and found[1].remarks == ()


def test_options_that_do_not_fit_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = str(written(tmp_path, TEXT))
    for wrong in (["--goal", "U9"], ["--share", "95%", "--goal", "tasks"], ["--calibration", "1"]):
        assert main(["reach", file, "--by", "certificate", *wrong]) == 2
        assert capsys.readouterr().err.startswith("ballplate reach: ")


def test_more_points_than_are_gone_through_for_each_value(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (
        Path("designs/quickstart.yaml")
        .read_text(encoding="utf-8")
        .replace("random: 200", "random: 10001")
    )
    path = tmp_path / "many.yaml"
    path.write_text(text, encoding="utf-8")
    assert main(["reach", str(path)]) == 3
    assert (
        capsys.readouterr().err
        == f"{path}: evaluation.points: 10001 points make 50005000 distances, which reach computes"
        " for every value that it tries, some dozens, which takes too long; give at most 10000,"
        " better some hundred\n"
    )
