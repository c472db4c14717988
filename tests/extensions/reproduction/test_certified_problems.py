"""Certified problems: their answers come out again in many digits, and ours agree with them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from ballplate.cli import main
from ballplate.extensions.reproduction.certified_answers import answers
from ballplate.extensions.reproduction.certified_problems import certified_problems
from ballplate.extensions.reproduction.score import Score, scores

from tests.certified.experiment_text import files
from tests.certified.make import dumped, made
from tests.certified.problems import PROBLEMS
from tests.extensions.reproduction import wording

FOLDER = Path(__file__).parents[3] / "designs" / "certified"
# Those that take a second or less, and the rest, a minute or more each.
QUICK = (
    "two-dimensions",
    "bryan-gauge",
    "ball-bar",
    "bars-in-a-plane",
    "bryan-gauge-unknown-radius",
    "one-position",
)
NAMES = [make()["name"] for make in PROBLEMS]


def remade(name: str) -> str:
    number = NAMES.index(name)
    return dumped(made(PROBLEMS[number](), 1000 + number))


@pytest.mark.parametrize("name", QUICK)
def test_answers_come_out_again(name: str) -> None:
    assert remade(name) == Path(FOLDER, f"{name}.json").read_text(encoding="utf-8")


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in NAMES if name not in QUICK])
def test_other_answers_come_out_again(name: str) -> None:
    assert remade(name) == Path(FOLDER, f"{name}.json").read_text(encoding="utf-8")


def test_every_problem_is_there_and_its_files_agree() -> None:
    assert sorted(path.stem for path in FOLDER.glob("*.json")) == sorted(NAMES)
    for name in NAMES:
        text = Path(FOLDER, f"{name}.json").read_text(encoding="utf-8")
        for other, content in files(json.loads(text, parse_float=str, parse_int=str)).items():
            assert Path(FOLDER, other).read_text(encoding="utf-8") == content


def test_built_and_computed_answers_agree() -> None:
    """The state that readings were built from, and the estimate in many digits, differ by rounding
    to femtometres.
    """
    for name in NAMES:
        problem = json.loads(Path(FOLDER, f"{name}.json").read_text(encoding="utf-8"))
        if "estimate" in problem["certified"]:
            estimate = problem["certified"]["estimate"]
            largest = max(u["maximum"] for u in estimate["uncertainties"].values())
            smallest = min(min(r["standard_uncertainty"]) for r in problem["readings"])
            assert estimate["built_within"] < 1e-14 * max(largest / smallest, 1.0)


@pytest.fixture(scope="module")
def ours() -> list[Score]:
    found = []
    for problem in certified_problems(FOLDER, []):
        found += scores(problem.name, problem.answers, answers(problem))
    return found


def test_ranks_and_counts_are_right(ours: list[Score]) -> None:
    assert [score for score in ours if not score.digits > 0.0] == []


def test_uncertainties_have_nine_digits(ours: list[Score]) -> None:
    assert [s for s in ours if s.quantity.startswith("U") and s.digits < 9.0] == []


def test_estimates_have_four_digits_of_their_uncertainty(ours: list[Score]) -> None:
    estimates = [
        score for score in ours if score.part == "estimate" and not score.quantity.startswith("U")
    ]
    assert len(estimates) > 20
    assert [score for score in estimates if score.digits < 4.0] == []


def test_scores_of_another_program(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    chosen = ["reproduce", "certified", "--designs", str(FOLDER), "--experiment", "two-dimensions"]
    assert main([*chosen, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    results = tmp_path / "results.json"
    results.write_text(json.dumps(told))
    assert main([*chosen, "--results", str(results), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["scores"] == told["scores"]

    answer = told["problems"]["two-dimensions"]
    answer["as_drawn"]["rank_deficiency"] = 1
    answer["estimate"]["uncertainties"]["U5"]["undetermined"] = 3
    answer["estimate"]["machine"]["alpha"] += 1e-9
    del answer["estimate"]["balls"]
    results.write_text(json.dumps(told))
    assert main([*chosen, "--results", str(results), "--json"]) == 1
    amiss = {
        (s["part"], s["quantity"]): s["digits"]
        for s in json.loads(capsys.readouterr().out)["scores"]
        if s["digits"] is None or s["digits"] < 5.0
    }
    assert amiss[("as drawn", "rank deficiency")] == 0.0
    assert amiss[("estimate", "U5")] == 0.0
    assert amiss[("estimate", "balls")] is None
    # A nanoradian is 1/278 of U3's average of 278 nanoradians.
    assert amiss[("estimate", "machine")] == pytest.approx(2.444, abs=0.001)
    assert len(amiss) == 4


@pytest.mark.parametrize(
    ("text", "told"),
    [("{", "is not JSON"), ("[]", "expected"), ('{"problems": 3}', "expected")],
)
def test_results_that_are_none(
    text: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results = tmp_path / "results.json"
    results.write_text(text)
    assert (
        main(["reproduce", "certified", "--designs", str(FOLDER), "--results", str(results)]) == 3
    )
    assert told in capsys.readouterr().err


def test_unknown_problem_and_empty_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert (
        main(["reproduce", "certified", "--designs", str(FOLDER), "--experiment", "two-dimension"])
        == 3
    )
    assert '"two-dimensions"' in capsys.readouterr().err
    assert main(["reproduce", "certified", "--designs", str(tmp_path)]) == 3
    assert wording.NO_CERTIFIED_PROBLEMS_HERE in capsys.readouterr().err
    assert main(["reproduce", "npl", "--results", "x.json"]) == 2


@pytest.mark.parametrize(
    ("change", "note"),
    [
        ({"as_drawn": {"uncertainties": {"U5": {"count": 3}}}}, "3 values instead of 28"),
        (
            {"as_drawn": {"uncertainties": {"U5": {"undetermined": None}}}},
            "None undetermined instead of 0",
        ),
        ({"as_drawn": {"rank_deficiency": "0"}}, "'0' instead of 0"),
        ({"estimate": {"machine": {"beta": 1.0}}}, "unknown beta"),
        ({"estimate": {"sum_of_squares": 1e9}}, "no digit agrees"),
    ],
)
def test_what_is_amiss_is_told(
    change: dict[str, Any], note: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def merged(one: dict[str, Any], other: dict[str, Any]) -> dict[str, Any]:
        return {
            key: (
                merged(value, other[key])
                if isinstance(other.get(key), dict)
                else other.get(key, value)
            )
            for key, value in one.items()
        } | {key: value for key, value in other.items() if key not in one}

    (problem,) = certified_problems(FOLDER, ["two-dimensions"])
    results = tmp_path / "results.json"
    results.write_text(
        json.dumps({"problems": {"two-dimensions": merged(problem.answers, change)}})
    )
    chosen = ["reproduce", "certified", "--designs", str(FOLDER), "--experiment", "two-dimensions"]
    assert main([*chosen, "--results", str(results)]) == 1
    assert note in capsys.readouterr().out


def test_a_problem_that_is_none_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results = tmp_path / "results.json"
    results.write_text('{"problems": {"three planes": {}}}')
    assert (
        main(["reproduce", "certified", "--designs", str(FOLDER), "--results", str(results)]) == 3
    )
    assert wording.NO_PROBLEM_DID_YOU_MEAN in capsys.readouterr().err


@pytest.mark.parametrize(
    ("path", "value", "told"),
    [
        (["as_drawn"], 5, 'certified.as_drawn: has no mapping "uncertainties"'),
        (["estimate", "uncertainties", "U5", "count"], None, 'U5 has no whole number "count"'),
        (
            ["estimate", "uncertainties", "U3", "average"],
            "a",
            'U3 has no number "average" above zero',
        ),
        (
            ["estimate", "uncertainties", "U3", "maximum"],
            0.0,
            'U3 has no number "maximum" above zero',
        ),
        (["estimate", "sum_of_squares"], [], '"sum_of_squares" is no number'),
        (["estimate", "machine"], {"alpha": "1"}, '"machine" is not of numbers alone'),
        (["estimate", "balls"], [[[1.0, 10**400]]], '"balls" is not of numbers alone'),
    ],
)
def test_a_damaged_problem_is_told(
    path: list[str], value: Any, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = json.loads((FOLDER / "two-dimensions.json").read_text())
    place = data["certified"]
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    (tmp_path / "two-dimensions.json").write_text(json.dumps(data))
    assert main(["reproduce", "certified", "--designs", str(tmp_path)]) == 3
    out, err = capsys.readouterr()
    assert not out and err.count("\n") == 1 and told in err


def test_every_shipped_problem_is_one() -> None:
    assert {one.name for one in certified_problems(FOLDER, [])} == {
        path.stem for path in FOLDER.glob("*.json")
    }


def test_a_result_beyond_all_numbers_has_no_digit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (problem,) = certified_problems(FOLDER, ["two-dimensions"])
    found = json.loads(json.dumps(problem.answers))
    found["estimate"]["sum_of_squares"] = 10**400
    (score,) = [
        one
        for one in scores("two-dimensions", problem.answers, found)
        if one.quantity == "sum of squares"
    ]
    assert score.digits == 0.0 and score.note == "no digit agrees"
