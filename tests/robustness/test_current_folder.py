"""Files of the current folder that have names of modules are not run: neither by a command, nor by a process that
it or a library starts, by whatever method.
"""

from __future__ import annotations

import importlib.metadata
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.extensions.own_models.test_custom_model import EXPERIMENT, GOOD
from tests.robustness.kit import make_kit
from tests.robustness.recipes import RECIPES

# Modules that ballplate's libraries try to import, whether or not they are installed.
OPTIONAL = """IPython a2wsgi bottleneck cupy cython httptools lz4 multipart numba numexpr org psutil python_multipart
sniffio uvloop viztracer watchfiles websockets winreg wsproto _winapi msvcrt"""
NAMES = sorted(
    name
    for name in {
        *sys.stdlib_module_names,
        *importlib.metadata.packages_distributions(),
        *OPTIONAL.split(),
        "ballplate",
    }
    if name.isidentifier()
)
CANARY = "open({ran!r}, 'a').write('{name} ')\nraise ImportError('the canary {name}')\n"
# Of each command what it does first, by several processes where it can.
FIRST = {line.partition(" ")[0]: line for line in reversed(RECIPES) if "dry-run" not in line}
LINES = (
    *FIRST.values(),
    "run small.yaml --report out.html",
    "map machine.yaml --grid 2,2,2 --plot out.svg",
)
# With several processes.
COMMANDS = ("plan pool.yaml --hours 2 --curve --workers 2", "sweep own.yaml --workers 2")
# Every command, one after the other in one process: what any of them loads shows.
ALL = """
import shlex, sys
from pathlib import Path
from ballplate.cli import main

for line in LINES:
    for path in Path().glob("out.*"):
        path.unlink()
    try:
        status = main(shlex.split(line))
    except SystemExit as left:
        status = left.code
    assert status in (0, 1), line
"""
# In Python, in which a folder of its own comes first: the methods by which processes are started.
IN_PYTHON = """
import multiprocessing, sys, time
from pathlib import Path

import ballplate as bp
from ballplate.extensions.studio import processes
from ballplate.extensions.studio.document import opened
from ballplate.extensions.sweeps import local
from ballplate.extensions.sweeps.bundle import bundle_of
from ballplate.extensions.sweeps.load import load_sweep
from ballplate.extensions.sweeps.task import CellTask
from ballplate.simulator.inputs import OPENED


def work(document, settings, report):
    return document.text[:6]


def with_worker(method):
    multiprocessing.get_all_start_methods = lambda: [method]
    worker = processes.Worker()
    worker.begin(work, opened(Path("small.yaml")), {})
    while (found := worker.look()) is None and worker.is_busy:
        time.sleep(0.01)
    worker.stop()
    assert found == "title:", found


def with_alone():
    sweep = load_sweep(Path("trials.yaml").resolve(), folders=(), trust=OPENED)
    source = local._Source(sweep.source, (), OPENED)
    assert local._alone(source, bundle_of(sweep).digest, CellTask(0)) is not None


if __name__ == "__main__":
    if sys.argv[1] == "loky":
        assert list(bp.in_processes(pow, [(2, k) for k in range(4)], 2)) == [1, 2, 4, 8]
    elif sys.argv[1] == "alone":
        with_alone()
    else:
        with_worker(sys.argv[1])
"""


@pytest.fixture(scope="module")
def kit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("kit")
    make_kit(folder)
    # What its module imports later is found beside it, too.
    later = "def jacobian(self, x, a, p):\n        from own_helper import x as _\n"
    (folder / "own_model.py").write_text(GOOD.replace("def jacobian(self, x, a, p):\n", later))
    (folder / "own_helper.py").write_text("from own_second import x\n")
    (folder / "own_second.py").write_text("x = 1\n")
    (folder / "own-model.yaml").write_text(EXPERIMENT.replace("MODEL", "own_model:build"))
    (folder / "own.yaml").write_text(
        "title: s\nbase: own-model.yaml\n"
        "axes: {r: {path: machine.repeatability, values: [0.1 um, 0.2 um]}}\n"
    )
    return folder


@pytest.fixture
def folder(kit: Path, tmp_path: Path) -> Path:
    made = tmp_path / "kit"
    shutil.copytree(kit, made, symlinks=True, ignore=shutil.ignore_patterns("pipe.csv"))
    for name in NAMES:
        (made / f"{name}.py").write_text(CANARY.format(ran=str(tmp_path / "ran"), name=name))
    return made


def outcome(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONSAFEPATH"}
    return subprocess.run(
        [sys.executable, *words], cwd=folder, capture_output=True, text=True, env=environment
    )


def by_its_name(folder: Path, line: str) -> subprocess.CompletedProcess[str]:
    """What the installed program does: Python looks for modules in the program's folder first."""
    program = folder.parent / "program.py"
    program.write_text("import sys\nfrom ballplate.__main__ import main\nsys.exit(main())\n")
    return outcome(folder, str(program), *shlex.split(line))


def names_run(folder: Path) -> list[str]:
    ran = folder.parent / "ran"
    return sorted(set(ran.read_text().split())) if ran.exists() else []


def assert_nothing_ran(done: subprocess.CompletedProcess[str], folder: Path) -> None:
    assert names_run(folder) == []
    assert "canary" not in done.stdout + done.stderr and "Traceback" not in done.stderr, done.stderr
    assert done.returncode in (0, 1), done.stderr


@pytest.mark.parametrize("line", COMMANDS)
def test_no_process_of_a_command_runs_files_of_the_current_folder(line: str, folder: Path) -> None:
    assert_nothing_ran(by_its_name(folder, line), folder)


def test_no_command_runs_files_of_the_current_folder(folder: Path, tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(ALL.replace("LINES", repr(LINES)))
    assert_nothing_ran(outcome(folder, str(program)), folder)


@pytest.fixture(scope="module")
def loaded_before(tmp_path_factory: pytest.TempPathFactory) -> set[str]:
    """Modules that Python itself has loaded when it begins with a package that it is to run."""
    folder = tmp_path_factory.mktemp("before")
    (folder / "begun").mkdir()
    (folder / "begun" / "__init__.py").write_text("import sys; print(*sys.modules)\n")
    (folder / "begun" / "__main__.py").write_text("")
    return set(outcome(folder, "-m", "begun").stdout.split())


def test_the_package_run_as_a_module_takes_the_folder_off_its_path(
    folder: Path, loaded_before: set[str]
) -> None:
    assert "argparse" not in loaded_before
    for name in {"ballplate", *loaded_before} & set(NAMES):
        (folder / f"{name}.py").unlink()
    line = "run small.yaml --trials 600 --seed 3 --workers 2 --report out.html"
    assert_nothing_ran(outcome(folder, "-m", "ballplate", *line.split()), folder)


@pytest.mark.parametrize(
    "method", ["loky", "alone", "spawn", pytest.param("forkserver", marks=pytest.mark.long)]
)
def test_no_process_that_is_started_in_python_does(
    method: str, folder: Path, tmp_path: Path
) -> None:
    program = tmp_path / "program.py"
    program.write_text(IN_PYTHON)
    assert_nothing_ran(outcome(folder, str(program), method), folder)


def test_what_the_user_has_put_on_the_path_stays(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A model that is found by PYTHONPATH alone, in each process."""
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    for path in folder.glob("own_*.py"):
        path.rename(elsewhere / path.name)
    monkeypatch.setenv("PYTHONPATH", str(elsewhere))
    line = "run own-model.yaml --trials 600 --workers 2"
    assert_nothing_ran(by_its_name(folder, line), folder)


def test_the_canaries_sing(folder: Path) -> None:
    """The tests above can fail: Python does run what is in the current folder."""
    outcome(folder, "-c", "import joblib")
    assert names_run(folder) == ["joblib"]
