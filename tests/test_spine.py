"""The spine: files in reading order, which are held to what `check`, `run` and `fit` enter."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from pathlib import Path

TOP = Path(__file__).parents[1]
MOST_FILES = 45
# Of the nodes of the kernel's functions that the three commands enter.
LEAST_SHARE = 0.6

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
json.dump(sorted(entered), sys.stdout)
"""


def listed(path: str, bullet: str) -> list[str]:
    text = (TOP / path).read_text(encoding="utf-8")
    return re.findall(rf"(?m)^{bullet} `((?:simulator|analysis)/\S+\.py)`", text)


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
    assert listed("CONTRIBUTING.md", "  -") == spine
    command = [sys.executable, "-c", ENTERED, str(tmp_path / "readings.csv")]
    done = subprocess.run(command, cwd=TOP, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    lines: dict[str, set[int]] = {}
    for file, line in json.loads(done.stdout):
        path = Path(file)
        if path.is_relative_to(TOP) and "site-packages" not in path.parts:
            lines.setdefault(path.relative_to(TOP).as_posix(), set()).add(line)
    kernel = {name for name in lines if re.match("simulator/|analysis/(?!extensions/.*/)", name)}
    entered = {name: nodes(TOP / name, lines[name]) for name in kernel}
    assert not [name for name in spine if not entered.get(name)]
    assert sum(entered[name] for name in spine) >= LEAST_SHARE * sum(entered.values())
