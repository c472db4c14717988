"""What commands write with and without a change of the code.

A change that the tests do not notice is equivalent only if nothing differs in what the lines whose
outcomes are kept, and those below of the shipped designs, print and write, though they reach it.
"""

from __future__ import annotations

import shlex
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.cli.outcomes import are_alike
from tests.cli.shown import filled, lines_of, written
from tests.cli.test_options import KEPT
from tests.mutation.forks import change, in_fork, probed
from tests.mutation.mutants import Mutant
from tests.reference.copies import copy_tree
from tests.reference.installed_extension import TOP

OF_DESIGNS = ("check --suggest {}", "run {} --json")
SECONDS = 120.0


@dataclass(frozen=True)
class Shown:
    """How many commands reach a change, and those that write something else with it."""

    reached: int
    differing: tuple[str, ...]


def lines() -> list[str]:
    """The commands, in the folder of the shown ones."""
    names = [path.relative_to(TOP).as_posix() for path in sorted((TOP / "designs").rglob("*.yaml"))]
    of_designs = [form.format(shlex.quote(name)) for form in OF_DESIGNS for name in names]
    return [*KEPT, *of_designs]


def shown(every: Sequence[Mutant], progress: Callable[[str], None]) -> dict[str, Shown]:
    """Of each change what the commands do with it."""
    with tempfile.TemporaryDirectory() as top:
        kit = filled(Path(top, "kit"))
        copy_tree(TOP / "designs", kit / "designs")
        before = {}
        for line in lines():
            before[line] = in_fork(lambda line=line: _reaching(line, kit, every), SECONDS)
        found = {}
        for k, mutant in enumerate(every):
            reached = [line for line, one in before.items() if one and k in one["reaches"]]
            differing = [
                line for line in reached if not _is_alike(mutant, line, kit, before[line]["lines"])
            ]
            found[mutant.name] = Shown(len(reached), tuple(differing))
            words = f"reached by {len(reached)}, {len(differing)} differ"
            progress(f"{mutant.name}: {words}: {'; '.join(differing[:2])}")
    return found


def _reaching(line: str, kit: Path, every: Sequence[Mutant]) -> dict[str, list[object]]:
    places = probed(every)
    return {"lines": _lines(line, kit), "reaches": sorted(places)}


def _is_alike(mutant: Mutant, line: str, kit: Path, before: Sequence[str]) -> bool:
    def work() -> list[str]:
        change(mutant)
        return _lines(line, kit)

    after = in_fork(work, SECONDS)
    return after is not None and len(after) == len(before) and all(map(are_alike, after, before))


def _lines(line: str, kit: Path) -> list[str]:
    written.cache_clear()
    return lines_of(line, kit)
