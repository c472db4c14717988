"""Each option of each command does what it promises: with it, the outcome of a small command has
something that it has not without it.
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import json
import shlex
import shutil
from collections.abc import Iterator
from functools import cache
from itertools import zip_longest
from pathlib import Path
from typing import Any
from unittest.mock import patch

import ballplate as bp
import openpyxl
import pytest
from ballplate.extensions.studio.actions import ActionError, done
from ballplate.extensions.studio.document import opened
from ballplate.extensions.studio.jobs import JOBS
from ballplate.extensions.studio.judging import VIEWS, judgement
from ballplate.presentation import as_data
from ballplate.simulator.computing import unreported
from ballplate.simulator.inputs import ExperimentError, service
from matplotlib.figure import Figure

from tests.cli.option_table import KEPT, LIMITED, PYTHON, READING, STUDIO, TABLE, TABLES
from tests.cli.outcomes import are_alike, changes, drawn, kept, shortened
from tests.cli.walk import WALK, commands
from tests.reference.small_plate import PLATE
from tests.robustness.kit import POOL, make_kit
from tests.robustness.worker import outcome

VARIANTS = "variants: {plain: {}, coarse: {machine.repeatability: 1 um}}\n"
SECOND = (
    PLATE.replace(
        "300 mm]}}", "300 mm]}, second: {kind: grid, balls: [2, 2], size: [300 mm, 300 mm]}}"
    )
    .replace("{name: side,", "{name: side, artefact: second,")
    .replace("plane: z", "plane: z, artefact: plate")
    .replace("plane: x", "plane: x, artefact: plate")
    .replace("[{kind: dist", "[{artefact: plate, kind: dist")
)
FILES = Path(__file__).parent / "files"
OFFSETS = {"down": (0.0, 0.0, -50.0), "right": (60.0, 0.0, 0.0)}
# Progress bars are all that they print beside their results, and only on a terminal.
SILENT = (
    *("check", "compare", "correct", "diff", "map", "map --curves", "reach", "reproduce", "run"),
    *("run --errors", "run --reliability", "schema", "spline", "studio"),
    *("sweep", "sweep --export", "sweep --report"),
)
# Shown by other tests, as the page and what needs files of its own; or what no small command shows: a
# search ends alike from any seed.
ELSEWHERE = {
    "studio --variant",
    "studio --port",
    "studio --no-browser",
    "studio --verbose",
    "sweep --scheduler",
    "sweep --folder",
    "check --no-modules",
    *(f"import --{name}" for name in ("unit", "circles", "uncertainty")),
    "plan --seed",
    *(f"{name} --workers" for name in ("run", "plan", "sweep")),
}


@pytest.fixture(scope="module")
def kit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return filled(tmp_path_factory.mktemp("options") / "kit")


def filled(folder: Path) -> Path:
    """A folder with all files that the lines name."""
    folder.mkdir()
    make_kit(folder)
    (folder / "pipe.csv").unlink()
    (folder / "loop.csv").unlink()
    texts = {
        "plate.yaml": PLATE,
        "pair.yaml": PLATE + VARIANTS,
        "twice.yaml": POOL + VARIANTS,
        "plates.yaml": SECOND,
        "anonymous.csv": "name,x_mm,y_mm,z_mm\nA,50,200,100\n",
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    simulate = ["simulate", "plate.yaml", "-o"]
    certificate = ["--certificate", "plate-certificate.csv"]
    outcome([*simulate, "plate.csv", "--seed", "5", *certificate], folder)
    outcome([*simulate, "plate-again.csv", "--seed", "6"], folder)
    outcome(["simulate", "plates.yaml", "-o", "plates.csv"], folder)
    shutil.copytree(FILES, folder, dirs_exist_ok=True)
    for name in ("samples", "exports"):
        shutil.copytree(FILES.parents[1] / "extensions" / "laboratory" / name, folder / name)
    outcome(f"{LIMITED} --positions 5 -o limited-plan.yaml".split(), folder)
    for name in ("effects", "lost", "limited-plan", "certified/weak", "shifted"):
        outcome(["simulate", f"{name}.yaml", "-o", f"{name}.csv"], folder)
    outcome(
        ["fit", "shifted.yaml", "shifted.csv", "-o", "shifted-map.yaml", "--date", "2026-11-22"],
        folder,
    )
    outcome(["fit", "small.yaml", "wrong-small.csv", "-o", "suspect.yaml"], folder)
    for name, source, rows in (
        ("begun", "planned-readings", 7),
        ("begun-limited", "limited-plan", 20),
        ("partial", "small-readings", 64),
        ("first", "small-readings", 10),
    ):
        lines = (folder / f"{source}.csv").read_text(encoding="utf-8").splitlines(True)[:rows]
        (folder / f"{name}.csv").write_text("".join(lines), encoding="utf-8")
    _write_tables(folder)
    return folder


def _write_tables(folder: Path) -> None:
    """The same readings in other forms."""
    head, *rows = csv.reader((folder / "plate.csv").read_text(encoding="utf-8").splitlines())
    names = [row[:3] for row in rows]
    places = [[float(cell) for cell in row[3:]] for row in rows]

    def write(name: str, head: list[str], columns: list[Any], separator: str = ",") -> None:
        taken = [[*a, *b] for a, b in zip(*columns, strict=True)]
        lines = [separator.join(map(str, row)) for row in (head, *taken)]
        (folder / name).write_text("\n".join([*lines, ""]), encoding="utf-8")

    write("renamed.csv", ["wo", "was", *head[2:]], [names, places])
    write("unitless.csv", [*head[:3], "x", "y", "z"], [names, places])
    grouped = [[f"{1e3 * x:,.0f}" for x in row] for row in places]
    micrometres = [name.replace("_mm", "_um") for name in head]
    write("thousands.csv", micrometres, [names, grouped], ";")
    centres = [
        [x + y for x, y in zip(row, OFFSETS[name[2]], strict=True)]
        for name, row in zip(names, places, strict=True)
    ]
    write("centres.csv", head, [names, centres])
    write("features.csv", ["feature", *head[3:]], [[["/".join(name)] for name in names], places])
    before = ["", *(position for position, *_ in names[:-1])]
    blank = [[a * (a != b), *c] for (a, *c), b in zip(names, before, strict=True)]
    write("blank.csv", head, [blank, places])
    write("swapped.csv", head, [[names[1], names[0], *names[2:]], places])
    workbook = openpyxl.Workbook()
    workbook.active.title = "taken"
    for sheet in (workbook.active, workbook.create_sheet("again")):
        for row in (head, *([*a, *b] for a, b in zip(names, places, strict=True))):
            sheet.append(row)
    workbook.save(folder / "two.xlsx")


def stamps(folder: Path) -> dict[Path, tuple[int, int]]:
    """What changes where a file of a folder is written."""
    found = {path: path.stat() for path in folder.rglob("*") if path.is_file()}
    return {path: (one.st_mtime_ns, one.st_ino) for path, one in found.items()}


NAMES = {"Path": Path, "service": service, **{name: getattr(bp, name) for name in dir(bp)}}


def acted(line: str, folder: Path) -> tuple[int, str, str]:
    """The value of an expression; or the text of a design after an action of the studio, its
    judgement, and a view of it.
    """
    if line.startswith(PYTHON):
        with contextlib.chdir(folder):
            try:
                shown = eval(line.removeprefix(PYTHON), NAMES)
            except (ValueError, TypeError, ExperimentError) as error:
                shown = f"{type(error).__name__}: {error}"
        texts = ["--file lines", repr(shown)]
        texts += shown.lines() if hasattr(shown, "lines") else ()
        texts += ["--file frame", shown.to_frame().to_csv()] if hasattr(shown, "to_frame") else []
        data = shown.to_dict() if isinstance(shown, bp.Result) else as_data(shown)
        return 0, json.dumps(data, indent=1, default=str), "\n".join(texts)
    name, rest = line.removeprefix(STUDIO).split(" ", 1)
    view, _, data = rest.partition(" {")
    action, document = json.loads(f"{{{data}"), opened(folder / name)
    try:
        document = done(document, action)
        shown = {**VIEWS, **JOBS}[view](document, {**action, "revision": 0}, unreported)
    except (ActionError, ExperimentError) as error:
        shown = str(error)
    told = json.dumps(as_data(judgement(document)), indent=1, default=str)
    return 0, "\n".join([document.text, json.dumps(as_data(shown), indent=1)]), told


@cache
def written(line: str, kit: Path) -> str:
    """Status, outputs and files of a command in a copy of the kit, which is put right again."""
    folder = kit.with_name("copy")
    if not folder.exists():
        shutil.copytree(kit, folder)
    before = stamps(folder)
    with patch.object(Figure, "savefig", lambda self, to, **_: to.write(drawn(self).encode())):
        is_command = not line.startswith((STUDIO, PYTHON))
        status, out, err = outcome(shlex.split(line), folder) if is_command else acted(line, folder)
    parts, after = [f"status {status}", out, err], stamps(folder)
    changed = (path for path in after if after[path] != before.get(path))
    # Whether a lock is left is chance.
    for path in sorted(path for path in changed if path.suffix != ".lock"):
        parts += [f"--file {path.name}", path.read_bytes().decode("utf-8", "replace")]
        path.unlink()
    for path in before:
        if not path.exists():
            shutil.copy2(kit / path.relative_to(folder), path)
    return "\n".join(parts)


def options() -> Iterator[tuple[str, argparse.Action]]:
    """Each option of each command, other than help."""
    for name, command in commands().items():
        for action in command._actions:
            if action.option_strings and action.dest != "help":
                yield name, action


# A line of each command in the table, of a file without variants, and the commands that write data
# in JSON.
FIRST = {
    shlex.split(line)[0]: line
    for line, *_ in reversed(TABLE)
    if not {"pair.yaml", "twice.yaml"} & {*line.split()}
}
FIRST |= {
    "run --errors": "'run --errors' plate.yaml",
    "reach": "reach plate.yaml --by repeatability",
}
FIRST["compare"] = "compare plate.yaml --trials 2"
AS_DATA = [name for name, action in options() if "--json" in action.option_strings]
LATER = pytest.mark.long
ALL: list[Any] = [
    *TABLE,
    *((FIRST[name], "--json", '{\n  "') for name in AS_DATA),
    # The commands take tables of readings in the same way.
    *(
        pytest.param(f"{name} plate.yaml {file}", option, text, marks=[LATER] * (name != "fit"))
        for name, text in READING.items()
        for file, option in TABLES
    ),
    *(
        (f"{name} plate.yaml unitless.csv --unit mm", "--quiet", "without: unitless.csv: read as")
        for name in READING
    ),
    *((f"{name} pair.yaml plate.csv", "--variant coarse", text) for name, text in READING.items()),
    *(
        pytest.param(line, "--verbose", "\nnumpy ", marks=[LATER] * (name not in ("check", "map")))
        for name, line in FIRST.items()
        if name != "schema"
    ),
]


def lines_of(line: str, kit: Path) -> list[str]:
    return shortened(written(line, kit), kit.with_name("copy"))


def outcomes(line: str, option: str, kit: Path) -> dict[str, list[str]]:
    """What is kept of a line, and of the line with an option."""
    if "--verbose" in option:
        return {}
    without = lines_of(line, kit)
    added = changes(without, lines_of(f"{line} {option}", kit))
    return {line: without, f"{line}  with  {option}": added}


def every_outcome(kit: Path) -> dict[str, list[str]]:
    return {line: lines_of(line, kit) for line in KEPT} | {
        name: lines
        for line, option, _ in (getattr(row, "values", row) for row in ALL)
        for name, lines in outcomes(line, option, kit).items()
    }


@pytest.mark.parametrize(("line", "option", "text"), ALL)
def test_option(line: str, option: str, text: str, kit: Path) -> None:
    without, with_it = written(line, kit), written(f"{line} {option}", kit)
    if text.startswith("without: "):
        with_it, without = without, with_it
        text = text.removeprefix("without: ")
    assert text in with_it and text not in without
    # A change of any other line is one that someone saw.
    for name, lines in outcomes(line, option, kit).items():
        ensure_kept(name, lines)


def ensure_kept(name: str, lines: list[str]) -> None:
    for found, was in zip_longest(lines, kept()[name], fillvalue=""):
        assert are_alike(found, was), name


@pytest.mark.parametrize("line", KEPT)
def test_recipe(line: str, kit: Path) -> None:
    ensure_kept(line, lines_of(line, kit))


def test_every_option_is_in_the_table() -> None:
    rows = [getattr(row, "values", row) for row in ALL]
    stated = {(shlex.split(line)[0], shlex.split(option)[0]) for line, option, _ in rows}
    missing = [
        f"{name} {action.option_strings[-1]}"
        for name, action in options()
        if not any((name, form) in stated for form in action.option_strings)
    ]
    silent = {f"{name} --quiet" for name in SILENT}
    # Whatever is written, it is by the same function, and tested beside it.
    force = {f"{name} --force" for name, walk in WALK.items() if walk.writes}
    assert sorted(missing) == sorted(silent | force | ELSEWHERE)
