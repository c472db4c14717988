"""The spine: files in reading order, held to what `check`, `run` and `fit` enter; what `check` loads;
and how often loading moves between rooms.
"""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from pathlib import Path

TOP = Path(__file__).parents[1]
MOST_FILES, MOST_LINES = 45, 9000
# Of the nodes of the kernel's functions that the three commands enter.
LEAST_SHARE = 0.4
# Of ballplate's own, which `check` of the quickstart loads.
MOST_MODULES, MOST_NODES = 130, 140_000
# Calls from one folder into another while the quickstart is loaded.
MOST_MOVES = 90

# Calls are kept by file and first line, which is that of the first decorator.
FOLLOWED = """
import contextlib, io, json, sys, ballplate as bp
from ballplate.cli import main
calls, quickstart = [], "designs/quickstart.yaml"

def follow(frame, event, argument):
    code = frame.f_code
    if event == "call" and code.co_name != "<module>":
        calls.append((code.co_filename, code.co_firstlineno))

def end(found):
    sys.setprofile(None)
    files = [getattr(module, "__file__", None) for module in list(sys.modules.values())]
    json.dump([found, [file for file in files if file]], sys.__stdout__)

with contextlib.redirect_stdout(io.StringIO()):
"""
CHECK = "    assert main(['check', quickstart]) == 0\nend([])"
LOAD = "    bp.quickstart()\n    sys.setprofile(follow)\n    bp.load(quickstart)\nend(calls)"
ALL = """    bp.simulate(bp.quickstart()).to_csv(sys.argv[1], index=False)
    sys.setprofile(follow)
    assert main(["check", quickstart]) == main(["run", quickstart]) == 0
    assert main(["fit", quickstart, sys.argv[1]]) == 0
end(sorted(set(calls)))"""


def followed(code: str, *arguments: str) -> tuple[list[tuple[str, int]], list[str]]:
    """Calls, and files of modules that are loaded, by path from the top; empty of others."""

    def name_of(file: str) -> str:
        path = Path(file)
        is_own = path.is_relative_to(TOP) and "site-packages" not in path.parts
        return path.relative_to(TOP).as_posix() if is_own else ""

    command = [sys.executable, "-c", FOLLOWED + code, *arguments]
    done = subprocess.run(command, cwd=TOP, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    calls, files = json.loads(done.stdout)
    return [(name_of(file), line) for file, line in calls], [*filter(None, map(name_of, files))]


def listed(path: str, bullet: str) -> list[str]:
    text = (TOP / path).read_text(encoding="utf-8")
    return re.findall(rf"(?m)^{bullet} `((?:simulator|analysis)/\S+\.py)`", text)


def nodes(name: str, lines: set[int]) -> int:
    """Nodes of the functions of a file that begin at one of the lines, inner ones once."""

    def below(node: ast.AST) -> int:
        count = 0
        for child in ast.iter_child_nodes(node):
            starts = [getattr(child, "lineno", 0)]
            starts += [decorator.lineno for decorator in getattr(child, "decorator_list", ())]
            is_entered = isinstance(child, ast.FunctionDef) and min(starts) in lines
            count += sum(1 for _ in ast.walk(child)) if is_entered else below(child)
        return count

    return below(ast.parse((TOP / name).read_text(encoding="utf-8")))


def test_the_spine_is_what_commands_enter(tmp_path: Path) -> None:
    spine = listed("docs/explanation/core.md", r"\d+\.")
    assert 0 < len(spine) == len(set(spine)) <= MOST_FILES
    assert sum(len((TOP / name).read_bytes().splitlines()) for name in spine) <= MOST_LINES
    assert listed("CONTRIBUTING.md", "  -") == spine
    calls, files = followed(ALL, str(tmp_path / "readings.csv"))
    assert set(spine) <= set(files)
    kernel = {name for name, _ in calls if re.match("simulator/|analysis/(?!extensions/.*/)", name)}
    entered = {name: nodes(name, {line for n, line in calls if n == name}) for name in kernel}
    assert sum(entered.get(name, 0) for name in spine) >= LEAST_SHARE * sum(entered.values())


def test_check_loads_few_modules() -> None:
    _, files = followed(CHECK)
    trees = [ast.parse((TOP / name).read_text(encoding="utf-8")) for name in files]
    assert 0 < len(files) <= MOST_MODULES
    assert sum(1 for tree in trees for _ in ast.walk(tree)) <= MOST_NODES


def test_loading_goes_down_and_not_up_and_down() -> None:
    rooms = [Path(name).parts[:2] for name, _ in followed(LOAD)[0] if name]
    moves = sum(1 for before, after in zip(rooms, rooms[1:], strict=False) if before != after)
    assert 0 < moves < MOST_MOVES
