"""Monte Carlo from the command line."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import ballplate as bp
import pytest
from ballplate.cli import main
from ballplate.simulator.computing.steps import ProgressStep

from tests.cli import wording
from tests.cli.walk import small_file
from tests.extensions.sweeps.support import hearing_interruptions

QUICKSTART = "designs/quickstart.yaml"


def run(*arguments: str | Path) -> int:
    return main([str(argument) for argument in arguments])


def test_trials_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("run", QUICKSTART, "--trials", "100", "--seed", "4", "--workers", "1", "--json") == 0
    first = capsys.readouterr().out
    assert run("run", QUICKSTART, "--trials", "100", "--seed", "4", "--workers", "2", "--json") == 0
    assert capsys.readouterr().out == first
    found = json.loads(first)["monte_carlo"]
    assert (found["trials"], found["seed"], found["not_converged"], found["interrupted"]) == (
        100,
        4,
        [],
        False,
    )
    for one in found["quantities"].values():
        assert (
            0.8 < one["spread_ratio"]["value"] < 1.2 and one["spread_ratio"]["standard_error"] > 0
        )
        assert 0.85 < one["coverage_sigma_estimated"]["value"] < 1.0


def with_wild_machine(path: Path, errors: str) -> int:
    """Write the first example with a true machine of large errors; their line."""
    head, tail = Path(QUICKSTART).read_text(encoding="utf-8").split("true_machine:")
    tail = tail.partition("\n\n")[2]
    path.write_text(f"{head}true_machine: {{kind: random, {errors}}}\n\n{tail}", encoding="utf-8")
    return 1 + head.count("\n")


def test_a_true_machine_too_wild_is_told(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    wild = tmp_path / "wild.yaml"
    line = with_wild_machine(wild, "position: 30 m, rotation: 3 rad")
    for command in (["run", wild, "--trials", "10"], ["simulate", wild, "-o", tmp_path / "r.csv"]):
        assert run(*command) == 3
        err = capsys.readouterr().err
        assert err.startswith(
            f"{wild}:{line}:15: true_machine: the errors of the true machine are too large"
        )
    # Readings of this one there are, and no estimate.
    with_wild_machine(wild, "rotation: 200 mrad")
    assert run("run", wild, "--trials", "10") == 3
    assert "true_machine: the e" in capsys.readouterr().err


@pytest.mark.parametrize(
    "options", [["--trials", "1"], ["--trials", "many"], ["--until", "0%"], ["--workers", "-1"]]
)
def test_wrong_options(options: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        run("run", QUICKSTART, *options)
    assert caught.value.code == 2
    err = capsys.readouterr().err
    assert f'"{options[1]}"' in err and "invalid _" not in err


def test_options_that_would_be_ignored(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("run", QUICKSTART, "--seed", "3") == 2
    out, err = capsys.readouterr()
    assert out == "" and "--trials or --until" in err


# Lines of progress come at once.
IMPATIENT = """
import sys
from ballplate.cli import main
from ballplate.cli.notes import ProgressDisplay
ProgressDisplay.show = lambda self, step: print(step, file=sys.stderr, flush=True)
sys.exit(main())
"""


def test_an_interruption_reports_what_is_done(tmp_path: Path) -> None:
    file = str(small_file(tmp_path / "small.yaml"))
    arguments = ["run", file, "--trials", "1000000", "--workers", "2", "--json"]
    process = subprocess.Popen(
        [sys.executable, "-c", IMPATIENT, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env={**os.environ, "PYTHONPATH": os.getcwd()},
        preexec_fn=hearing_interruptions,
    )
    assert process.stderr is not None
    # The first line of progress says that something is done.
    line = process.stderr.readline()
    assert " of 1000000 data sets" in line
    os.killpg(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    found = json.loads(out)["monte_carlo"]
    assert found["interrupted"] and found["trials"] >= 512
    assert wording.THE_RESULTS_ARE_THOSE in err and "Traceback" not in err


def test_every_step_of_a_plan_tells_how_much_there_is(tmp_path: Path) -> None:
    places = {"planes": ["z"], "levels": ["100 mm", "400 mm"], "probes": ["down"]}
    pool = {"candidates": [places | {"corners": {"x": ["50 mm"], "y": ["50 mm"]}}]}
    file = small_file(tmp_path / "pool.yaml", pool=pool)
    told: list[ProgressStep] = []
    bp.plan(file, positions=7, curve=True, report=told.append)
    steps = {
        what: [one for one in told if one.what == what]
        for what in dict.fromkeys(one.what for one in told)
    }
    assert {"candidates", "gains", "budgets of the curve"} < set(steps)
    for what, reports in steps.items():
        wanted = reports[-1].wanted
        assert reports == [ProgressStep(what, done, wanted) for done in range(wanted + 1)]
