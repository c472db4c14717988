"""What differs on Windows and macOS, as far as it can be imitated."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from ballplate.cli import main
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.inputs.messages import ExperimentError

from tests import conftest

ROOT = Path(__file__).parents[2]
QUICKSTART = (ROOT / "designs/quickstart.yaml").read_text(encoding="utf-8")


def test_a_plan_on_another_drive(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from tests.extensions.planning.small_pool import TEXT

    def relpath(path: object, start: object) -> str:
        raise ValueError(f"path is on mount 'C:', start on mount 'D:' ({path}, {start})")

    (tmp_path / "balls.csv").write_text(
        "ball,x_mm,y_mm\n"
        + "".join(f"{c}{r},{100 * c},{100 * r}\n" for r in range(4) for c in range(4)),
        "utf-8",
    )
    text, count = re.subn(r"(?m)^  plate: .*$", "  plate: {kind: balls, file: balls.csv}", TEXT)
    assert count == 1
    text = text.replace("pairs: corner sides", "pairs: all")
    (tmp_path / "pool.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "other").mkdir()
    monkeypatch.setattr(os.path, "relpath", relpath)
    chosen = tmp_path / "other/chosen.yaml"
    plan = [
        "plan",
        str(tmp_path / "pool.yaml"),
        "--positions",
        "3",
        "--workers",
        "1",
        "-o",
        str(chosen),
    ]
    assert main(plan) in (0, 1)
    assert (tmp_path / "balls.csv").resolve().as_posix() in chosen.read_text(encoding="utf-8")
    load(chosen)


MISTAKES = [
    (QUICKSTART, "probes: [down]", "probes: [dwn]"),
    (QUICKSTART, "repeatability: 0.2 um", "repeatability: 0.2"),
    (QUICKSTART, "kind: random", "kind: random\n  positoin: 3 um"),
    (QUICKSTART, "title: ", "title: a: "),
    (QUICKSTART, "calibration:", "calibration: ["),
    (QUICKSTART, "artefacts:", "artefacts:\n\tplate: 1"),
]


@pytest.mark.parametrize(("text", "old", "new"), MISTAKES)
def test_messages_name_the_same_places_in_files_of_windows(
    text: str, old: str, new: str, tmp_path: Path
) -> None:
    assert old in text
    told = []
    for end in ("\n", "\r\n"):
        path = tmp_path / "file.yaml"
        path.write_bytes(("\ufeff" + text.replace(old, new, 1)).replace("\n", end).encode("utf-8"))
        with pytest.raises(ExperimentError) as caught:
            load(path)
        told.append([(one.line, one.column, one.path, one.text) for one in caught.value.messages])
    assert told[0] == told[1] and all(line > 0 for line, *_ in told[0])


def test_files_of_windows_say_the_same(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Line ends and byte order marks of experiments, readings, machines and error tables."""
    assert (
        main(
            [
                "simulate",
                str(ROOT / "designs/quickstart.yaml"),
                "-o",
                str(tmp_path / "unix-readings.csv"),
            ]
        )
        == 0
    )
    (tmp_path / "unix.yaml").write_text(QUICKSTART, encoding="utf-8", newline="\n")
    points = "".join(f"{10 * k},{k % 3}\n" for k in range(30))
    (tmp_path / "unix-errors.csv").write_text(
        f"# by hand\nposition_mm,error_um\n{points}", encoding="utf-8"
    )
    for name in (".yaml", "-readings.csv", "-errors.csv"):
        content = (tmp_path / f"unix{name}").read_bytes()
        assert b"\r" not in content
        (tmp_path / f"dos{name}").write_bytes(b"\xef\xbb\xbf" + content.replace(b"\n", b"\r\n"))
    capsys.readouterr()
    for command in (
        ["run", "--json", "NAME.yaml"],
        ["fit", "NAME.yaml", "NAME-readings.csv"],
        ["spline", "NAME-errors.csv", "-o", "-"],
    ):
        told = []
        for name in ("unix", "dos"):
            assert (
                main(
                    [
                        str(tmp_path / one.replace("NAME", name)) if "NAME" in one else one
                        for one in command
                    ]
                )
                == 0
            )
            told.append(capsys.readouterr().out.replace(name, ""))
        assert told[0] == told[1] != ""


def test_processes_may_be_started_anyhow(tmp_path: Path) -> None:
    """Windows knows `spawn` alone, macOS by default."""
    script = tmp_path / "command.py"
    script.write_text(
        'import multiprocessing, sys\nfrom ballplate.cli import main\nif __name__ == "__main__":\n '
        "   multiprocessing.set_start_method(sys.argv.pop(1))\n    sys.exit(main())\n",
        encoding="utf-8",
    )
    command = ["run", ROOT / "designs/quickstart.yaml", "--trials", "512", "--json", "--workers"]
    found = []
    for start, workers in ((["-m", "ballplate"], "1"), ([script, "spawn"], "2")):
        ended = subprocess.run(
            [sys.executable, *start, *command, workers],
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            encoding="utf-8",
        )
        assert ended.returncode == 0, ended.stderr
        found.append(json.loads(ended.stdout)["monte_carlo"])
    for one in found:
        for name in ("seconds", "workers"):
            one.pop(name, None)
    assert all(one == found[0] for one in found)


def test_nothing_is_loaded_that_windows_lacks() -> None:
    """Every module of the packages, in a Python without those of POSIX."""
    missing = "".join(f"sys.modules[{name!r}] = None\n" for name in conftest.MODULES)
    modules = []
    for folder, package in (
        ("analysis", ("ballplate",)),
        ("simulator", ("ballplate", "simulator")),
    ):
        for path in sorted((ROOT / folder).rglob("*.py")):
            if path.name != "__main__.py":
                modules.append(
                    ".".join((*package, *path.relative_to(ROOT / folder).with_suffix("").parts))
                )
    assert len(modules) > 200
    code = (
        f"import importlib, sys\n{missing}for name in {modules!r}:\n   "
        " importlib.import_module(name)\n"
    )
    found = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert found.returncode == 0, found.stderr


def test_tests_that_need_posix_are_known() -> None:
    assert conftest.module_needed(ROOT / "tests/robustness/test_cases.py") == "resource"
    assert conftest.module_needed(Path(__file__)) == ""
    assert conftest.word_needed("os.killpg(process.pid, signal.SIGINT)") == "killpg"
    assert conftest.word_needed('path = Path("/dev/full")') == "/dev/"
    assert conftest.word_needed("assert shell_length == 3") == ""


def tried_by_another(folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """The tests of a folder, run by somebody who may not write there."""
    for path in (folder / "tests", folder):
        path.chmod(0o555)
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "--strict-config"],
        cwd=folder,
        env={
            **{name: value for name, value in os.environ.items() if name[:6] != "PYTEST"},
            "TMPDIR": str(folder.parent / "room"),
            **environment,
        },
        user=NOBODY if os.geteuid() == 0 else None,
        capture_output=True,
        text=True,
    )


# Any number that is not root's: root may write everywhere.
NOBODY = 65534
USUAL = """\
from hypothesis import given, strategies

@given(strategies.integers())
def test_usual(number): assert number == number

def used_by_the_next(): return open("/dev/full").name

def test_failing(): assert not used_by_the_next()
"""


def test_a_checkout_that_takes_no_files_is_enough() -> None:
    """Neither compiled modules nor what pytest and Hypothesis keep; a device is pretended away."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "blank é"
        (folder / "tests").mkdir(parents=True)
        (folder.parent / "room").mkdir()
        for path, mode in ((folder.parent, 0o755), (folder.parent / "room", 0o777)):
            path.chmod(mode)
        for name in ("pyproject.toml", "tests/conftest.py"):
            shutil.copyfile(ROOT / name, folder / name)
        (folder / "tests/test_usual.py").write_text(USUAL)
        try:
            found = tried_by_another(folder, BALLPLATE_TESTS_WITHOUT=conftest.DEVICES[0])
        except PermissionError:
            pytest.skip("another user cannot run this Python")
        assert "1 passed, 1 skipped" in found.stdout, found.stdout + found.stderr
        assert f"needs {conftest.DEVICES[0]}, which is missing here" in found.stdout
        folder.chmod(0o755)
        assert sorted(path.name for path in folder.rglob("*")) == [
            "conftest.py",
            "pyproject.toml",
            "test_usual.py",
            "tests",
        ]


def test_git_gives_line_feeds_whatever_the_system() -> None:
    listed = subprocess.run(
        ["git", "-c", "safe.directory=*", "ls-files", "-z", "--eol"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        encoding="utf-8",
    )
    if listed.returncode:
        pytest.skip("no checkout of git")
    files = [line.split("\t") for line in listed.stdout.split("\0") if line]
    kinds = {name: facts.split("attr/")[1].strip() for facts, name in files}
    changed = {name for name, kind in kinds.items() if kind not in ("text=auto eol=lf", "-text")}
    assert not changed
    # Bytes that other programs have written, line ends included.
    left = {name for name, kind in kinds.items() if kind == "-text"}
    assert left == {
        name
        for facts, name in files
        if facts.startswith("i/-text") or name.startswith("tests/extensions/laboratory/samples/")
    }
