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

# Code objects are kept by their first line, which is that of the first decorator.
ENTERED = """
import contextlib, io, json, sys
entered = set()

def follow(frame, event, argument):
    if event == "call":
        entered.add((frame.f_code.co_filename, frame.f_code.co_firstlineno))

import ballplate as bp
from ballplate.cli import main

quickstart, readings = "designs/quickstart.yaml", sys.argv[1]
bp.simulate(bp.quickstart()).to_csv(readings, index=False)
with contextlib.redirect_stdout(io.StringIO()):
    sys.setprofile(follow)
    assert main(["check", quickstart]) == main(["run", quickstart]) == 0
    assert main(["fit", quickstart, readings]) == 0
    sys.setprofile(None)
loaded = [getattr(module, "__file__", None) for module in list(sys.modules.values())]
json.dump([sorted(entered), [file for file in loaded if file]], sys.stdout)
"""


def listed(path: str, bullet: str) -> list[str]:
    text = (TOP / path).read_text(encoding="utf-8")
    return re.findall(rf"(?m)^{bullet} `((?:simulator|analysis)/\S+\.py)`", text)


def name_of(file: str) -> str:
    """Path of a module of the checkout from its top; empty of others."""
    path = Path(file)
    is_own = path.is_relative_to(TOP) and "site-packages" not in path.parts
    return path.relative_to(TOP).as_posix() if is_own else ""


def nodes(path: Path, lines: set[int]) -> int:
    """Nodes of the functions of a file that begin at one of the lines, inner ones once."""

    def below(node: ast.AST) -> int:
        count = 0
        for child in ast.iter_child_nodes(node):
            first = getattr(child, "lineno", 0)
            first = min([first, *(d.lineno for d in getattr(child, "decorator_list", ()))])
            is_entered = isinstance(child, ast.FunctionDef) and first in lines
            count += sum(1 for _ in ast.walk(child)) if is_entered else below(child)
        return count

    return below(ast.parse(path.read_text(encoding="utf-8")))


def test_the_spine_is_what_commands_enter(tmp_path: Path) -> None:
    spine = listed("docs/explanation/core.md", r"\d+\.")
    assert 0 < len(spine) == len(set(spine)) <= MOST_FILES
    lines_of = [len((TOP / name).read_text(encoding="utf-8").splitlines()) for name in spine]
    assert sum(lines_of) <= MOST_LINES
    assert listed("CONTRIBUTING.md", "  -") == spine
    command = [sys.executable, "-c", ENTERED, str(tmp_path / "readings.csv")]
    done = subprocess.run(command, cwd=TOP, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    functions, loaded = json.loads(done.stdout)
    lines: dict[str, set[int]] = {name_of(file): set() for file in loaded}
    for file, line in functions:
        lines.setdefault(name_of(file), set()).add(line)
    kernel = {name for name in lines if re.match("simulator/|analysis/(?!extensions/.*/)", name)}
    entered = {name: nodes(TOP / name, lines[name]) for name in kernel}
    assert set(spine) <= set(lines)
    assert sum(entered.get(name, 0) for name in spine) >= LEAST_SHARE * sum(entered.values())


LOADED = """
import contextlib, io, json, sys
from ballplate.cli import main

with contextlib.redirect_stdout(io.StringIO()):
    assert main(["check", "designs/quickstart.yaml"]) == 0
modules = [m for name, m in sys.modules.items() if name.split(".")[0] == "ballplate"]
json.dump([m.__file__ for m in modules if getattr(m, "__file__", None)], sys.stdout)
"""

MOVES = """
import sys
from pathlib import Path
import ballplate as bp

top, rooms, moves = Path.cwd(), {}, []

def room_of(name):
    path = Path(name)
    if not path.is_relative_to(top) or "site-packages" in path.parts:
        return None
    return path.relative_to(top).parts[:2]

def follow(frame, event, argument):
    name = frame.f_code.co_filename
    room = rooms.setdefault(name, room_of(name))
    if event == "call" and room and frame.f_code.co_name != "<module>":
        if moves[-1:] != [room]:
            moves.append(room)

bp.quickstart()
sys.setprofile(follow)
bp.load("designs/quickstart.yaml")
sys.setprofile(None)
print(len(moves))
"""


def printed(code: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], cwd=TOP, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_check_loads_few_modules() -> None:
    files = [Path(name) for name in json.loads(printed(LOADED))]
    trees = [ast.parse(path.read_text(encoding="utf-8")) for path in files]
    assert 0 < len(files) <= MOST_MODULES
    assert sum(1 for tree in trees for _ in ast.walk(tree)) <= MOST_NODES


def test_loading_goes_down_and_not_up_and_down() -> None:
    assert 0 < int(printed(MOVES)) <= MOST_MOVES
