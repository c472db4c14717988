"""Cases: a command line in a folder with a file of every kind, and a change or two of the line, a
file or a store.

A number gives the same case wherever it is drawn. Alone, and with all that it prints, a case is
tried by

    python -m tests.robustness NUMBER
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from random import Random
from unicodedata import category

from ballplate.cli.outputs import OutputAction
from ballplate.extensions.machine_files.machine_sections import schema as machine_schema
from ballplate.extensions.parts.part_sections import schema as part_schema

from tests.robustness.command_lines import changed_line, drawn, grammar, parsed, quick
from tests.robustness.experiments import SEED, SWEEP_WORDS, WORDS
from tests.robustness.mutations import (
    Vocabulary,
    changed_table,
    changed_text,
    changed_yaml,
    tree_of,
    vocabulary,
)
from tests.robustness.recipes import RECIPES
from tests.robustness.worker import CONTROL, FORM, outcome

# Files that others name, and that are read with them.
NAMED = {
    "tables.yaml": ("balls.csv", "curves.csv", "points.csv", "distances.csv"),
    "sweep.yaml": ("small.yaml", "sweep.sqlite"),
    "trials.yaml": ("small.yaml", "trials.sqlite"),
    "ranges.yaml": ("quickstart.yaml",),
    "subsets.yaml": ("quickstart.yaml",),
    "variants.yaml": ("splines.yaml",),
    "machine.yaml": ("exx.csv",),
    "part.yaml": ("top.csv",),
    "measured.yaml": ("part.yaml", "top.csv"),
    "npl": ("npl/5.2.yaml",),
    "certified": ("certified/weak.yaml", "certified/weak.json", "certified/weak.csv"),
}
# As many points as are accepted take long in what computes them again and again, and rightly so.
PART_WILD = {"points": ([1000, 1000], [30, 30], 1000, 1, [[0, 0, 0]], "top.csv", "part.yaml")}
WILD = dict(WORDS.wild) | {"random": (10**9, 1_000_001, 500, 0)}
EXPERIMENT_WORDS = Vocabulary(WORDS.keys, WORDS.words, tuple(WILD.items()))
MACHINE_WORDS = vocabulary(machine_schema(), WILD)
PART_WORDS = vocabulary(part_schema(), WILD | PART_WILD)
MACHINES = ("machine.yaml", "gec-like.yaml")
SWEEPS = ("sweep.yaml", "trials.yaml", "ranges.yaml", "subsets.yaml", "variants.yaml")

BESIDE_STORES = ("-wal", "-shm", "-journal", ".lock")
STATUSES = (0, 1, 2, 3)
STATUS = "status"
ERROR = re.compile(FORM)
# Of processor time; some commands compute a design again and again.
SECONDS, LONG = 10.0, 60.0
REPEATING = ("reach", "plan", "compare", "sweep", "reproduce")


@dataclass(frozen=True)
class Case:
    """A command line, what has been changed, and the changed files by name; all others are as in
    the kit.
    """

    number: int
    arguments: tuple[str, ...]
    changes: tuple[str, ...]
    contents: tuple[tuple[str, bytes], ...] = ()

    @property
    def seconds(self) -> float:
        return LONG if set(REPEATING) & set(self.arguments) else SECONDS

    def __str__(self) -> str:
        line = shlex.join(("ballplate", *self.arguments))
        return (
            f"case {self.number} ({', '.join(self.changes)}):"
            f" {line if len(line) < 1000 else line[:1000] + '…'}"
        )


def case(kit: Path, number: int) -> Case:
    """The case of a number."""
    random = Random(f"{SEED}-{number}")
    # In turn, so that few cases have all commands among them.
    line = shlex.split(RECIPES[number % len(RECIPES)])
    files = _files(kit, line)
    stores = [name for name in files if name.endswith(".sqlite")]
    draw = random.random()
    if stores and draw < 0.75:
        return _of_file(random, kit, number, line, random.choice(stores))
    if files and draw < 0.6:
        return _of_file(random, kit, number, line, random.choice(files))
    changes = []
    if random.random() < 0.15:
        line, changes = drawn(random), ["drawn"]
    for _ in range(random.choice((1, 1, 2)) if not changes else 0):
        name, line = changed_line(random, line)
        changes.append(name)
        if not line:
            break
    return Case(number, tuple(quick(line)), tuple(changes))


def _files(kit: Path, line: list[str]) -> list[str]:
    """Files that a line reads, those included that they name."""
    found = []
    for text in line:
        found += [text] if (kit / text).is_file() and not text.startswith("old") else []
        found += NAMED.get(text, ())
    return found


@cache
def _read(path: Path) -> bytes:
    return path.read_bytes()


@cache
def _tree(path: Path) -> str:
    return tree_of(_read(path))


def _words(name: str) -> Vocabulary:
    if name == "part.yaml":
        return PART_WORDS
    return (
        MACHINE_WORDS if name in MACHINES else SWEEP_WORDS if name in SWEEPS else EXPERIMENT_WORDS
    )


def _of_file(random: Random, kit: Path, number: int, line: list[str], name: str) -> Case:
    content = _read(kit / name)
    if name.endswith(".yaml"):
        changes, content = changed_yaml(random, content, _tree(kit / name), _words(name))
    elif name.endswith(".csv"):
        changes, content = changed_table(random, content)
    else:
        told, content = changed_text(random, content)
        changes = [told]
    return Case(
        number, tuple(quick(line)), tuple(f"{name}: {one}" for one in changes), ((name, content),)
    )


def lay_out(kit: Path, case: Case, folder: Path) -> None:
    """Fill a new folder with the case's files: in `in` what the command is given, in `tmp` room for
    temporary files.
    """
    special = ("pipe.csv",)
    inside = folder / "in"
    shutil.copytree(
        kit, inside, symlinks=True, ignore=lambda _, names: [one for one in names if one in special]
    )
    os.mkfifo(inside / "pipe.csv")
    (folder / "tmp").mkdir()
    for name, content in case.contents:
        (inside / name).write_bytes(content)


# Between them they load what commands share, which is not to count as a case's memory and time.
WARM_UP = (
    "check --suggest --format junit deficient.yaml",
    "run small.yaml --trials 4 --seed 3 --workers 1",
    "plan pool.yaml --positions 2 --workers 1",
    "map gec-like.yaml --grid 2,2,2 --plot out.svg",
    "'sweep --export' trials.sqlite -o out.parquet",
)


def warm_up(kit: Path, folder: Path) -> list[tuple[tuple[str, ...], str]]:
    """Requests that are good, each in a new folder below one."""
    requests = []
    for number, recipe in enumerate(WARM_UP):
        one = Case(number, tuple(shlex.split(recipe)), ())
        lay_out(kit, one, folder / f"warm-up-{number}")
        requests.append((one.arguments, str(folder / f"warm-up-{number}")))
    return requests


def trial(request: tuple[tuple[str, ...], str]) -> str | None:
    """What is wrong with what a command makes of its folder, None where nothing is.

    Its status is left in the folder, for those who count.
    """
    arguments, name = request
    folder = Path(name)
    inside = folder / "in"
    before, beside = _contents(inside), _names(folder)
    tempfile.tempdir = str(folder / "tmp")
    status, out, err = outcome(arguments, inside)
    faults = [
        *_of_status(status, out, err),
        *_of_files(arguments, inside, before),
        *(
            []
            if (out + err).strip() or _contents(inside) != before
            else [f"status {status}, and nothing is said or done"]
        ),
        *[f"made outside of its folder: {one}" for one in _names(folder) - beside],
    ]
    (folder / STATUS).write_text(str(status))
    return "\n".join(faults) or None


def _of_status(status: int, out: str, err: str) -> Iterator[str]:
    if status not in STATUSES:
        yield f"status {status}: {err[-2000:]}"
    if "Traceback (most recent call last)" in out + err:
        yield f"a traceback: {err[-2000:]}"
    if status == 2 and not re.search(r"^ballplate\b.*: .", err, re.MULTILINE):
        yield f"status 2, but not what is wrong: {err[-500:]!r}"
    # On standard output where that is asked for, as marks of a pull request or as a report.
    if status == 3 and not out.strip() and not any(map(ERROR.fullmatch, err.splitlines())):
        yield f"not in the stated form: {err[-600:]!r}"
    for line in err.splitlines():
        if any(category(letter) in CONTROL for letter in line):
            yield f"control characters on standard error: {line[:500]!r}"
            break


def _of_files(arguments: tuple[str, ...], folder: Path, before: dict[str, bytes]) -> Iterator[str]:
    """Nothing is changed but what the line says is to be written, and nothing else is left
    behind.
    """
    allowed = _outputs(arguments, folder, before)
    after = _contents(folder)
    for name in before.keys() - after.keys():
        if not name.endswith(BESIDE_STORES):
            yield f"{name} has been deleted"
    for name, content in after.items():
        if name in allowed:
            continue
        if name not in before:
            yield f"{name} has been left behind"
        elif content != before[name]:
            yield f"{name} has been changed"


def _outputs(arguments: tuple[str, ...], folder: Path, before: dict[str, bytes]) -> set[str]:
    """Names in the folder that the line may write: what options for outputs name that is no input,
    and the store of a sweep.
    """
    options = parsed(arguments)
    if options is None:
        return set()
    command = next(name for name in arguments if name in grammar())
    read, written = set[Path](), set[Path]()
    for action in grammar()[command]:
        found = getattr(options, action.dest, None)
        paths = [
            one for one in (found if isinstance(found, list) else [found]) if isinstance(one, Path)
        ]
        (written if isinstance(action, OutputAction) else read).update(paths)
    stores = set[Path]()
    if command == "sweep":
        file = options.file if options.file.name else options.file / "nothing"
        stores = {options.store or file.with_suffix(".sqlite")}
    elif command in ("sweep --export", "sweep --report"):
        stores = {options.store}
    if command == "certificate":
        written |= {
            one.with_name(f"{one.stem}-covariance.csv") for one in written if one.suffix == ".csv"
        }
    allowed = {_name(path, folder) for path in written} - {_name(path, folder) for path in read}
    if not getattr(options, "force", True):
        allowed -= before.keys()
    for path in stores:
        name = _name(path, folder)
        allowed |= {name + end for end in BESIDE_STORES}
        if command == "sweep" and (
            not before.get(name) or b"ballplate sweep store" in before[name]
        ):
            allowed.add(name)
    return allowed


def _name(path: Path, folder: Path) -> str:
    return os.path.relpath(os.path.join(folder, path), folder)


def _contents(folder: Path) -> dict[str, bytes]:
    """Regular files by their path from the folder."""
    found = {}
    for path, _, names in os.walk(folder):
        for name in names:
            full = os.path.join(path, name)
            if os.path.isfile(full) and not os.path.islink(full):
                found[os.path.relpath(full, folder)] = Path(full).read_bytes()
    return found


def _names(folder: Path) -> set[str]:
    return set(os.listdir(folder))
