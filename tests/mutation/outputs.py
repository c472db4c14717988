"""What commands write with and without a change of the code, byte by byte.

A change that the tests do not notice is equivalent only if nothing differs in what the commands of
`tests.robustness` and `tests.cli`, and those below, print and write, though they reach it.
"""

from __future__ import annotations

import hashlib
import re
import shlex
import shutil
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.cli.option_table import LINES
from tests.cli.test_options import filled
from tests.mutation.forks import change, in_fork, probed
from tests.mutation.mutants import Mutant
from tests.reference.copies import copy_file, copy_tree
from tests.reference.installed_extension import TOP
from tests.robustness.recipes import RECIPES
from tests.robustness.worker import outcome

OF_DESIGNS = ("check --suggest {}", "run {} --json")
OTHERS = (
    "plan planning/plate-pool.yaml --positions 5 --workers 1 -o out.yaml --sheet out.html",
    "plan planning/plate-pool.yaml --hours 3 --curve --workers 1 --plot out.svg",
    "sheet planning/campaign.yaml -o out.html",
)
SECONDS = 120.0
# Times of day and of the processor, which are other ones in each run, and lines of how far a long
# command has got, which come when it takes more than a second.
TIMES = re.compile(
    r"[^\r\n]*, [\d:]+ so far, [^\r\n]*[\r\n]*|\d+(?:\.\d+)? s\b|\d\d:\d\d(?::\d\d)?"
)


@dataclass(frozen=True)
class Shown:
    """How many commands reach a change, and those that write something else with it."""

    reached: int
    differing: tuple[str, ...]


def lines() -> list[str]:
    """The commands, in the folder that `copied` makes."""
    designs = [path for path in sorted((TOP / "designs").rglob("*.yaml"))]
    names = [path.relative_to(TOP / "designs").as_posix() for path in designs]
    of_designs = [form.format(shlex.quote(name)) for form in OF_DESIGNS for name in names]
    return [*RECIPES, *LINES, *of_designs, *OTHERS]


def shown(every: Sequence[Mutant], progress: Callable[[str], None]) -> dict[str, Shown]:
    """Of each change what the commands do with it."""
    with tempfile.TemporaryDirectory() as top:
        kit = Path(top, "kit")
        filled(kit)
        before = [
            in_fork(lambda line=line: _reaching(line, kit, every), SECONDS) for line in lines()
        ]
        found = {}
        for k, mutant in enumerate(every):
            reached = [one for one in before if one is not None and k in one["reaches"]]
            differing = [
                one["line"] for one in reached if _with(mutant, one["line"], kit) != one["written"]
            ]
            found[mutant.name] = Shown(len(reached), tuple(differing))
            progress(
                f"{mutant.name}: reached by {len(reached)}, {len(differing)} differ: {'; '.join(differing[:2])}"
            )
    return found


def _reaching(line: str, kit: Path, every: Sequence[Mutant]) -> dict[str, Any]:
    places = probed(every)
    written = _written(line, kit)
    return {"line": line, "written": written, "reaches": sorted(places)}


def _with(mutant: Mutant, line: str, kit: Path) -> Any:
    def work() -> list[Any]:
        change(mutant)
        return _written(line, kit)

    return in_fork(work, SECONDS)


def _written(line: str, kit: Path) -> list[Any]:
    """Status, output and errors of a command, and a digest of each file that it leaves."""
    with tempfile.TemporaryDirectory() as top:
        folder = Path(top, "kit")
        copied(kit, folder)
        try:
            status, *texts = outcome(shlex.split(line), folder)
        except Exception as error:
            return [repr(error)]
        files = {
            path.relative_to(folder).as_posix(): _digest(path, top)
            for path in sorted(folder.rglob("*"))
            if path.is_file() and path.suffix != ".sqlite"
        }
        return [status, *(lasting(text, top) for text in texts), files]


def lasting(text: str, top: str) -> str:
    """A text without what differs from one run to the next."""
    return TIMES.sub("", text.replace(top, ""))


def _digest(path: Path, top: str) -> str:
    # Reports state the time of day.
    text = lasting(path.read_text(encoding="latin-1"), top)
    return hashlib.sha256(text.encode("latin-1")).hexdigest()


def copied(kit: Path, folder: Path) -> None:
    """The kit, and the shipped designs below their names, in a new folder."""

    shutil.copytree(kit, folder, symlinks=True, ignore=shutil.ignore_patterns("pipe.csv"))
    for path in (TOP / "designs").iterdir():
        if path.is_dir() and path.name != "__pycache__":
            copy_tree(path, folder / path.name, dirs_exist_ok=True)
        elif path.suffix == ".yaml":
            copy_file(path, folder)
