"""Targets for standard and for expanded uncertainties, goals of `check`, and what is told of weak
directions.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.maps.length_map import length_map
from ballplate.presentation.formatting import percent
from ballplate.rank.verdicts import Verdict, weak_limit
from ballplate.results.prediction import check, predict
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment

from tests.analysis import wording

QUICKSTART = Path("designs/quickstart.yaml").read_text(encoding="utf-8")
TASKS = """\
    - {name: short, from: [100 mm, 200 mm, 0 mm], to: [600 mm, 200 mm, 50 mm], target_uncertainty: 0.3 um}
    - {name: long, from: [0 mm, 0 mm, 0 mm], to: [1 m, 1 m, 1 m]}
"""
SMALL = QUICKSTART.replace("coefficients: 5", "coefficients: 3").replace(
    "balls: [5, 5]", "balls: [3, 3]"
)
SMALL = SMALL.replace("random: 200", "random: 30").replace(
    "  probe: down\n", f"  probe: down\n  tasks:\n{TASKS}"
)
TARGET = "target_uncertainty: 0.5 um + L/1000000"


def written(folder: Path, text: str, name: str = "design.yaml") -> Path:
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


def experiment_of(folder: Path, text: str) -> Experiment:
    return load(written(folder, text))[0]


def with_target(target: str, factor: float = 1.0, text: str = SMALL) -> str:
    return text.replace(TARGET, f"target_uncertainty: {target}\ncoverage_factor: {factor:g}")


def verdicts(experiment: Experiment) -> list[object]:
    """Everything that compares with the target."""
    found = predict(experiment)
    verdict: Verdict = check(experiment).verdict
    return [
        found.quantities["U6"].within_target,
        found.quantities["tasks"].within_target,
        *(task.is_within for task in found.tasks),
        len(verdict.weak),
        weak_limit(found.design, experiment.target_uncertainty),
        *length_map(experiment, (3, 2, 3)).missed.tolist(),
    ]


@pytest.mark.parametrize("micrometres", [0.02, 0.14])
def test_a_target_for_2_u_is_half_of_it_for_u(tmp_path: Path, micrometres: float) -> None:
    halved = SMALL.replace("0.3 um", "0.15 um")
    of_u = verdicts(
        experiment_of(tmp_path, with_target(f"{micrometres} um + L/20000000", 1.0, halved))
    )
    expanded = verdicts(
        experiment_of(tmp_path, with_target(f"{2 * micrometres} um + L/10000000", 2.0))
    )
    assert of_u == pytest.approx(expanded)
    # What the same numbers would say of u alone is another matter.
    assert expanded != verdicts(
        experiment_of(tmp_path, with_target(f"{2 * micrometres} um + L/10000000"))
    )


def test_every_comparison_says_which_uncertainty_it_is_of(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = str(written(tmp_path, with_target("0.2 um", 2.0)))
    for command, expected in (
        (["run"], 2), (["reach", "--by", "repeatability", "--goal", "tasks"], 1),
        (["check", "--goal", "lengths"], 2),
    ):  # fmt: skip
        main([command[0], file, *command[1:]])
        told = capsys.readouterr().out
        assert told.count("expanded uncertainty U = 2 u") >= expected, (command, told)
        assert "standard uncertainty u)" not in told


def test_run_and_reach_tell_the_same_share(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = str(written(tmp_path, with_target("0.11 um")))
    main(["run", file])
    ran = re.search(r"\(standard uncertainty u\): (\S+ %) of U6", capsys.readouterr().out)
    main(["reach", file, "--by", "repeatability"])
    reached = re.search(r"as drawn: not met; (\S+ %) of lengths", capsys.readouterr().out)
    main(["check", file])
    checked = re.search(
        r"\(standard uncertainty u\): (\S+ %) of 435 lengths", capsys.readouterr().out
    )
    assert ran and reached and checked and ran[1] == reached[1] == checked[1]
    share = predict(experiment_of(tmp_path, with_target("0.11 um"))).quantities["U6"].within_target
    assert share is not None and 0 < share < 1 and ran[1] == percent(share)
    assert float(ran[1].removesuffix(" %")) == np.floor(1e4 * share) / 100


def test_goals_make_check_fail(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, with_target("0.5 um"))
    average = predict(load(path)[0]).quantities["U6"].average
    just, not_quite = (f"U6 average {1e6 * average * share} um" for share in (1.001, 0.999))

    def checked(status: int, *goals: str, form: str = "text") -> str:
        given = [word for goal in goals for word in ("--goal", goal)]
        assert main(["check", str(path), *given, "--format", form]) == status
        return capsys.readouterr().out

    out = checked(0, just, "lengths", "U2 angles maximum 1 urad")
    assert len(re.findall(r"goal met[:,]", out)) == 3 and "goal not met" not in out
    out = checked(1, just, not_quite)
    assert len(re.findall(r"goal met[:,]", out)) == 1 and out.count("goal not met: ") == 1
    data = json.loads(checked(1, not_quite, form="json"))
    assert data["as_expected"] and len(data["missed"]) == 1
    assert data["lengths"]["average"] == pytest.approx(average)
    line = checked(1, not_quite, form="github")
    found = re.match(r"::error file=.*line=(\d+).*title=goals of design::.*goal not met", line)
    assert found
    marked = path.read_text(encoding="utf-8").splitlines()[int(found[1]) - 1]
    assert marked.startswith("target_uncertainty")
    failure = ElementTree.fromstring(checked(1, not_quite, form="junit")).find(".//failure")
    assert failure is not None and failure.get("type") == "goal"
    assert failure.get("message", "").startswith(wording.GOAL_NOT_MET)


def test_a_share_of_the_lengths_is_enough_where_that_is_asked_for(tmp_path: Path) -> None:
    file = str(written(tmp_path, with_target("0.11 um")))
    share = predict(load(file)[0]).quantities["U6"].within_target
    assert share is not None and 0.02 < share < 0.98
    goal = ["check", file, "--goal", "lengths"]
    assert main(goal) == 1
    assert main([*goal, "--share", f"{100 * share - 1:.3f}%"]) == 0
    assert main([*goal, "--share", f"{100 * share + 1:.3f}%"]) == 1


def test_goals_that_are_none_and_goals_that_cannot_be_judged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = str(written(tmp_path, SMALL.replace(TARGET, "")))
    assert main(["check", file, "--goal", "U7 average 1 um"]) == 2
    assert main(["check", file, "--share", "95%"]) == 2
    capsys.readouterr()
    assert main(["check", file, "--goal", "lengths"]) == 1
    assert wording.THE_FILE_STATES_NO_TARGET_UNCERTAINTY in capsys.readouterr().out


def test_weak_directions_fail_where_they_shall_not_be(tmp_path: Path) -> None:
    weak = str(written(tmp_path, with_target("0.02 um")))
    assert check(load(weak)[0]).verdict.weak
    assert main(["check", weak]) == 0
    assert main(["check", weak, "--fail-weak"]) == 1
    assert main(["check", str(written(tmp_path, with_target("5 um"))), "--fail-weak"]) == 0


def test_reach_fails_on_request(tmp_path: Path) -> None:
    """By the uncertainty that the file means: 2 u is beyond a limit that u is within."""
    largest = predict(experiment_of(tmp_path, with_target("1 um"))).quantities["U6"].maximum
    for factor, status in ((1.0, 0), (2.0, 1)):
        file = str(written(tmp_path, with_target(f"{1.5e6 * largest:.6f} um", factor)))
        assert main(["reach", file, "--by", "repeatability", "--fail"]) == status


def test_no_weak_direction_and_yet_a_target_that_is_missed(tmp_path: Path) -> None:
    """Many moderate directions add up: nothing is weak, and `check` states the share all the
    same.
    """
    found = predict(experiment_of(tmp_path, SMALL))
    directions = check(experiment_of(tmp_path, with_target("0.001 um"))).verdict.weak
    limit = 1e6 * max(one.standard_deviation for one in directions)
    text = with_target(f"{1.01 * limit:.6f} um")
    checked = check(experiment_of(tmp_path, text))
    assert not checked.verdict.weak and checked.verdict.deficiency == 0
    assert checked.lengths is not None and checked.lengths.within_target is not None
    assert checked.lengths.within_target < 1 and 1.01e-6 * limit < found.quantities["U6"].maximum
