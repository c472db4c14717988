"""A model of the user's own that fails once it is in use: every command names its file and line, ends with status
3, and prints nothing that the model printed among its results.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from itertools import count
from pathlib import Path

import ballplate as bp
import pytest
from ballplate.cli import main

from tests.extensions.own_models.test_custom_model import EXPERIMENT, GOOD

# Checks call the model with seven points; what it does afterwards stands in `wrong`.
FAILING = (
    GOOD.replace(
        '    def error(self, x, a, p):\n        return np.einsum("mdn,n->md", self.jacobian(',
        '    def right_error(self, x, a, p):\n        return np.einsum("mdn,n->md", self.right_jacobian(',
    )
    .replace("    def jacobian(", "    def right_jacobian(")
    .replace(
        "    def reported(",
        """    def error(self, x, a, p):
        return self.wrong(x, self.right_error(x, a, p))

    def jacobian(self, x, a, p):
        return self.wrong(x, self.right_jacobian(x, a, p))

    def wrong(self, x, right):
        if len(x) == 7:
            return right
        WAY

    def reported(""",
    )
)
# What a model does once it is in use, and what is said of it.
WAYS = {
    "raises": ("raise ValueError('no such place')", "ValueError: no such place"),
    "raises from elsewhere": ("np.linalg.inv(np.zeros((2, 2)))", "LinAlgError: Singular matrix"),
    "is without end": ("return self.wrong(x, right)", "RecursionError: "),
    "lacks a name": ("return missing", "NameError: name 'missing' is not defined"),
    "returns a list": ("return right.tolist()", "returns list; an array of shape ("),
    "returns nothing": ("return None", "returns NoneType; an array of shape ("),
    "returns NaN": ("return np.nan * right", "returns values that are not finite numbers"),
    "returns another shape": ("return right[:1, :1]", "returns the shape (1, 1"),
    "returns complex numbers": (
        "return right + 0j",
        "returns values of type complex128; numbers are",
    ),
    "returns texts": ("return right.astype(str)", "returns values of type <U"),
    "ends the program": ("import sys; sys.exit(0)", "SystemExit: 0"),
    "ends the process": ("import os; os._exit(0)", "SystemExit: os._exit(0)"),
}
# Commands that make the design of a file, or fit readings, or use a map.
COMMANDS = (
    "check e.yaml",
    "run e.yaml",
    "run e.yaml --json",
    "run e.yaml --trials 4 --workers 2",
    "run --budget e.yaml",
    "plan pool.yaml --positions 2",
    "next e.yaml readings.csv",
    "reach e.yaml",
    "run --reliability e.yaml",
    "simulate e.yaml -o new.csv",
    "fit e.yaml readings.csv",
    "fit e.yaml readings.csv -o out.yaml",
    "models e.yaml readings.csv",
    "validate e.yaml readings.csv",
    "certificate e.yaml readings.csv",
    "compare e.yaml --trials 2",
    "correct map.yaml points.csv",
    "map --curves map.yaml",
    "map map.yaml",
    "diff map.yaml map.yaml",
    "sweep s.yaml --workers 2",
)
number = count()


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Readings and a map of the model while it does what it is to do."""
    folder = tmp_path_factory.mktemp("good")
    (folder / "right_model.py").write_text(GOOD)
    (folder / "e.yaml").write_text(EXPERIMENT.replace("MODEL", "right_model:build"))
    assert main(["simulate", str(folder / "e.yaml"), "-o", str(folder / "readings.csv")]) == 0
    bp.write_map(bp.fit(folder / "e.yaml", folder / "readings.csv").to_map(), folder / "map.yaml")
    return folder


def prepared(way: str, good: Path, folder: Path) -> str:
    """Files of a model that fails in a way; its module."""
    module = f"failing_{next(number)}"
    source = FAILING.replace("WAY", WAYS[way][0])
    (folder / f"{module}.py").write_text(source)
    experiment = EXPERIMENT.replace("MODEL", f"{module}:build")
    pool = "pool: {candidates: [{name: c, plane: z, level: 300 mm, corner: {x: 0 mm, y: 0 mm}, probes: [down]}]}\n"
    (folder / "e.yaml").write_text(experiment)
    (folder / "pool.yaml").write_text(experiment + pool)
    (folder / "s.yaml").write_text(
        "title: s\nbase: e.yaml\naxes: {r: {path: machine.repeatability, values: [0.1 um, 0.2 um]}}\n"
    )
    (folder / "points.csv").write_text("x_mm,y_mm,z_mm\n100,100,100\n400,500,600\n")
    (folder / "readings.csv").write_bytes((good / "readings.csv").read_bytes())
    text = (good / "map.yaml").read_text().replace("right_model", module)
    (folder / "map.yaml").write_text(re.sub(r"(?m)^(checksum|check|files):.*\n(- .*\n)*", "", text))
    return module


def assert_located(way: str, told: str, module: str) -> None:
    """The place is where it fails, or where the function begins that returns what is wrong."""
    assert "internal error" not in told and "Traceback" not in told, told
    lines = FAILING.split("\n")
    starts = ("def error", "def jacobian") if "returns" in way else ("WAY",)
    numbers = [str(k + 1) for k, line in enumerate(lines) if line.strip().startswith(starts)]
    place = rf"{module}\.py:({'|'.join(numbers)}): in \w+, code of your own: "
    assert re.search(place + re.escape(WAYS[way][1]), told), told


@pytest.mark.parametrize("way", WAYS)
def test_each_way_to_fail_is_told_with_its_place(
    way: str,
    good: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    module = prepared(way, good, tmp_path)
    monkeypatch.chdir(tmp_path)
    for command in ("run e.yaml", "fit e.yaml readings.csv"):
        assert main(command.split()) == 3
        told = capsys.readouterr().err
        assert_located(way, told.splitlines()[-1], module)


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    "way", [way if way == "raises" else pytest.param(way, marks=pytest.mark.long) for way in WAYS]
)
def test_every_command_tells_the_place(
    way: str,
    command: str,
    good: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    module = prepared(way, good, tmp_path)
    monkeypatch.chdir(tmp_path)
    status = main(command.split())
    told = capsys.readouterr().err
    # A sweep counts its failed cells, and goes on.
    assert status == (1 if command.startswith("sweep") else 3), told
    assert_located(way, told, module)


# A model of which one call, counted from its making, goes wrong.
LATER = (
    GOOD
    + """
calls = builds = 0


def counted(function):
    def call(*given):
        global calls
        calls += 1
        count = calls
        right = function(*given)
        if count != AT:
            return right
        WAY

    return call


for name in ("error", "jacobian", "reported"):
    setattr(Straight, name, counted(getattr(Straight, name)))
made = build


def build(*given):
    global builds
    builds += 1
    return made(*given)
"""
)
AT_ONCE = {
    "raises": ("raise ValueError('later')", "ValueError: later"),
    "returns NaN": ("return right * np.nan", ""),
    "returns nothing": ("return None", ""),
    "returns another shape": ("return right[:0]", ""),
    "ends the program": ("import sys; sys.exit(0)", "SystemExit: 0"),
}


@pytest.mark.parametrize("way", AT_ONCE)
@pytest.mark.parametrize("at", [1, 21, 50, 100])
def test_a_call_that_goes_wrong_later_is_told(
    at: int,
    way: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    source = LATER.replace("AT:", f"{at}:").replace("WAY", AT_ONCE[way][0])
    monkeypatch.chdir(tmp_path)
    for command in ("check e.yaml", "run e.yaml"):
        module = f"later_{next(number)}"
        (tmp_path / f"{module}.py").write_text(source)
        (tmp_path / "e.yaml").write_text(EXPERIMENT.replace("MODEL", f"{module}:build"))
        status = main(command.split())
        told = capsys.readouterr().err
        loaded = sys.modules[module]
        assert loaded.builds == 1
        # It ends at the wrong call, or needs fewer.
        assert status == (3 if loaded.calls >= at else 0), told
        assert status == 0 and loaded.calls < at or re.search(rf"{module}(\.py|:build)", told)
        assert status == 0 or AT_ONCE[way][1] in told, told


def test_a_map_of_an_own_model_can_be_the_true_machine_of_a_sweep(
    good: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    folder = json.dumps(str(good))
    for model in (
        f"{{kind: python, object: 'right_model:build', folder: {folder}}}",
        "{kind: metric}",
    ):
        text = re.sub("error_model: .*", lambda _, model=model: f"error_model: {model}", EXPERIMENT)
        text = re.sub(
            "true_machine: .*",
            lambda _: f"true_machine: {{kind: map, file: {json.dumps(str(good / 'map.yaml'))}}}",
            text,
        )
        (tmp_path / "e.yaml").write_text(text)
        (tmp_path / "s.yaml").write_text(
            "title: s\nbase: e.yaml\ntrials: 2\n"
            "axes: {r: {path: machine.repeatability, values: [0.1 um, 0.2 um]}}\n"
        )
        store = ["--store", f"{len(text)}.sqlite", "--folder", str(good)]
        assert main(["sweep", "s.yaml", "--workers", "1", *store]) == 0


def test_what_a_model_prints_is_no_result(tmp_path: Path) -> None:
    source = FAILING.replace("WAY", "print('hello')\n        return right")
    (tmp_path / "chatty.py").write_text("print('loaded')\n" + source)
    (tmp_path / "e.yaml").write_text(EXPERIMENT.replace("MODEL", "chatty:build"))
    command = [sys.executable, "-m", "ballplate", "run", "--json", "e.yaml"]
    found = subprocess.run(
        command, cwd=tmp_path, capture_output=True, text=True, env=dict(os.environ)
    )
    assert found.returncode == 0, found.stderr
    json.loads(found.stdout)
    assert "hello" in found.stderr and "loaded" in found.stderr
