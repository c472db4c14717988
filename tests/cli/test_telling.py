"""What commands tell on standard error beside errors and warnings: -q less, -v more, and the
results stay the same.
"""

from __future__ import annotations

import re
import shlex
import sys
from importlib.metadata import version
from pathlib import Path
from time import monotonic, process_time

import pytest
from ballplate.cli import main

from tests.cli.walk import small_file
from tests.reference.small_quickstart import small_sections

QUICKSTART = "designs/quickstart.yaml"


def told(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, list[str]]:
    """Status, what is printed, and the lines on standard error."""
    status = main([str(one) for one in arguments])
    out, err = capsys.readouterr()
    return status, out, err.splitlines()


@pytest.mark.parametrize("command", ["check", "run --reliability"])
def test_results_are_the_same(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = small_file(tmp_path / "small.yaml")
    plain, quiet, verbose = (told(capsys, command, file, *more) for more in ([], ["-q"], ["-v"]))
    assert plain[:2] == quiet[:2] == verbose[:2] and plain[2] == quiet[2] == []
    lines = verbose[2]
    assert lines[0] == f"ballplate {version('ballplate')}" and f"numpy {version('numpy')}" in lines
    assert f"reads {file}" in lines
    taken = re.fullmatch(
        rf"{command}: ([0-9.e-]+) s, ([0-9.e-]+) s of the processor in this process", lines[-1]
    )
    assert taken is not None
    # All of the process, and of these tests.
    assert 0.0 < float(taken[2]) < process_time() and 0.0 < float(taken[1]) < monotonic()


def test_files_that_an_experiment_names_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    machine = Path("designs/park/machines/measured-errors.yaml")
    lines = told(capsys, "map", machine, "--grid", "2,2,2", "-v")[2]
    read = {
        Path(line.removeprefix("reads ")).resolve() for line in lines if line.startswith("reads ")
    }
    named = set(re.findall(r"[\w/-]+\.csv", machine.read_text(encoding="utf-8")))
    assert named and {(machine.parent / name).resolve() for name in named} <= read


def test_notes_go_and_errors_stay(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "new.yaml"
    assert told(capsys, "init", file) == (0, "", [f"{file} written; next: ballplate check {file}"])
    assert told(capsys, "init", file, "--force", "-q") == (0, "", [])
    status, out, lines = told(capsys, "init", file, "-q")
    assert (status, out) == (3, "") and "exists already" in lines[0]


def test_a_deficient_check_names_the_next_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """And that command does what is said of it; a deficiency that is expected needs none."""
    file = tmp_path / "two planes.yaml"
    read = [one for one in small_sections()["positions"] if one["plane"] != "y"]
    small_file(file, positions=read)
    status, _, lines = told(capsys, "check", file)
    assert status == 1 and lines == [f"next: ballplate check {shlex.quote(str(file))} --suggest"]
    status, out, lines = told(capsys, *shlex.split(lines[0])[2:])
    assert status == 1 and lines == [] and "full rank" in out
    assert told(capsys, "check", file, "-q")[2] == []
    assert told(capsys, "check", file, "--format", "github")[2] == []
    expected = file.read_text(encoding="utf-8").replace("deficiency: 0", "deficiency: 3")
    file.write_text(expected, encoding="utf-8")
    assert told(capsys, "check", file)[0::2] == (0, [])


def test_doubts_about_the_verdict_stay(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "doubtful.yaml"
    file.write_text(
        Path(QUICKSTART).read_text().replace("repeatability: ", "repeatability: 1000 "),
        encoding="utf-8",
    )
    plain, quiet = told(capsys, "check", file), told(capsys, "check", file, "-q")
    assert plain == quiet and plain[2]


def test_check_shows_how_far_it_has_come(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Files, designs of a single one, or the search for repairs of a single design."""
    gauge = "designs/hurt_foss/bryan-gauge.yaml"
    plain = told(capsys, "check", gauge, "designs/quickstart.yaml")
    monkeypatch.setattr(type(sys.stderr), "isatty", lambda self: True)
    shown = told(capsys, "check", gauge, "designs/quickstart.yaml")
    # A terminal's lines are wrapped.
    assert (shown[0], shown[1].split()) == (plain[0], plain[1].split())
    assert re.search("files: .* 2/2", "".join(shown[2]))
    assert re.search("designs: .* 5/5", "".join(told(capsys, "check", gauge)[2]))
    search = told(capsys, "check", gauge, "--variant", "radius unknown", "--suggest")
    assert re.search("kinds of changes: .* [0-9]/[0-9]", "".join(search[2]))
    assert told(capsys, "check", gauge, "-q")[2] == []
    assert told(capsys, "check", "designs/quickstart.yaml")[2] == []


def test_singular_values_are_printed_on_request(capsys: pytest.CaptureFixture[str]) -> None:
    _, plain, quiet = told(capsys, "check", QUICKSTART)
    _, out, verbose = told(capsys, "check", QUICKSTART, "-v")
    assert plain == out and not any("singular" in line for line in [plain, *quiet])
    assert sum(line.startswith("singular values 117 to 0.118,") for line in verbose) == 1


def test_a_basis_that_is_not_that_of_u3_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    told(capsys, "simulate", QUICKSTART, "-o", tmp_path / "r.csv")
    _, other, _ = told(capsys, "fit", QUICKSTART, tmp_path / "r.csv")
    _, same, _ = told(capsys, "fit", QUICKSTART, tmp_path / "r.csv", "--monomials")
    assert "EBZ[3]" in other and "coefficients of the basis" in other
    assert "EBZ t^3" in same and "coefficients of the basis" not in same
