"""What a line shows and writes in a folder of small files: a command, an action of the studio, or an
expression of Python.
"""

from __future__ import annotations

import contextlib
import csv
import json
import shlex
import shutil
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import ballplate as bp
import openpyxl
from ballplate.extensions.studio.actions import ActionError, done
from ballplate.extensions.studio.document import opened
from ballplate.extensions.studio.jobs import JOBS
from ballplate.extensions.studio.judging import VIEWS, judgement
from ballplate.presentation import as_data
from ballplate.simulator.computing import unreported
from ballplate.simulator.inputs import ExperimentError, service
from matplotlib.figure import Figure

from tests.cli.outcomes import drawn, shortened
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
    plan = "plan limited.yaml --workers 1 --positions 5 -o limited-plan.yaml"
    outcome(shlex.split(plan), folder)
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
    table = (folder / "part-readings.csv").read_text(encoding="utf-8")
    heads, *touched = csv.reader(table.splitlines())
    probes = ["right" if feature == "side" else "down" for _, feature, *_ in touched]
    tips = [
        [round(float(x) + y, 4) for x, y in zip(row[3:], OFFSETS[probe], strict=True)]
        for row, probe in zip(touched, probes, strict=True)
    ]
    write("part-tips.csv", heads, [[row[:3] for row in touched], tips])
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


def commanded(line: str, folder: Path) -> tuple[int, str, str]:
    """Status and outputs of a command."""
    return outcome(shlex.split(line), folder)


def evaluated(line: str, folder: Path) -> tuple[int, str, str]:
    """The value of an expression with the names of the package."""
    names = {"Path": Path, "service": service, **{name: getattr(bp, name) for name in dir(bp)}}
    with contextlib.chdir(folder):
        try:
            shown = eval(line, names)
        except (ValueError, TypeError, ExperimentError) as error:
            shown = f"{type(error).__name__}: {error}"
    texts = ["--file lines", repr(shown)]
    texts += shown.lines() if hasattr(shown, "lines") else ()
    texts += ["--file frame", shown.to_frame().to_csv()] if hasattr(shown, "to_frame") else []
    data = shown.to_dict() if isinstance(shown, bp.Result) else as_data(shown)
    return 0, json.dumps(data, indent=1, default=str), "\n".join(texts)


def acted(line: str, folder: Path) -> tuple[int, str, str]:
    """The text of a design after an action of the studio, its judgement, and a view of it."""
    name, rest = line.split(" ", 1)
    view, _, data = rest.partition(" {")
    action, document = json.loads(f"{{{data}"), opened(folder / name)
    try:
        document = done(document, action)
        shown = {**VIEWS, **JOBS}[view](document, {**action, "revision": 0}, unreported)
    except (ActionError, ExperimentError) as error:
        shown = str(error)
    told = json.dumps(as_data(judgement(document)), indent=1, default=str)
    return 0, "\n".join([document.text, json.dumps(as_data(shown), indent=1)]), told


# What a line is, by how it begins; any other is a command.
FORMS = {"python: ": evaluated, "studio: ": acted}


@cache
def written(line: str, kit: Path) -> str:
    """Status, outputs and files of a line in a copy of the kit, which is put right again."""
    folder = kit.with_name("copy")
    if not folder.exists():
        shutil.copytree(kit, folder)
    before = stamps(folder)
    with patch.object(Figure, "savefig", lambda self, to, **_: to.write(drawn(self).encode())):
        form = next((form for form in FORMS if line.startswith(form)), "")
        status, out, err = FORMS.get(form, commanded)(line.removeprefix(form), folder)
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


def lines_of(line: str, kit: Path) -> list[str]:
    """What is kept of a line."""
    return shortened(written(line, kit), kit.with_name("copy"))
