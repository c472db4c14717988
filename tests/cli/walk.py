"""Every command and every option that names a file to be written: command lines to be walked
through, with what they read.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import yaml
from ballplate.cli import main
from ballplate.cli._parsers import parser

from tests.reference.small_quickstart import small_sections

DESIGN = """\
title: a plate in two positions
machine: {volume: [500 mm, 500 mm], repeatability: 1 um}
error_model: {kind: metric}
artefacts:
  plate: {kind: balls, file: balls.csv}
positions:
  - {name: first, artefact: plate, pose: {origin: [50 mm, 50 mm]}}
  - {name: turned, artefact: plate, pose: {origin: [450 mm, 50 mm], rotation: 90 deg}}
calibration:
  - {kind: distances, artefact: plate, pairs: [[a, b]], standard_uncertainty: 0.5 um}
target_uncertainty: 2 um
evaluation: {points: {random: 10, seed: 1}}
seed: 1
"""
# On three axes, and a part that is measured there.
SPACE = """\
title: a plate in three planes
machine: {volume: [500 mm, 500 mm, 500 mm], repeatability: 1 um}
error_model: {kind: metric}
artefacts: {plate: {kind: balls, file: balls.csv}}
positions:
  - {name: low, plane: z, level: 50 mm, corner: {x: 50 mm, y: 50 mm}}
  - {name: side, plane: x, level: 50 mm, corner: {y: 50 mm, z: 50 mm}}
  - {name: front, plane: y, level: 50 mm, corner: {z: 50 mm, x: 50 mm}}
calibration:
  - {kind: distances, artefact: plate, pairs: [[a, b]], standard_uncertainty: 0.5 um}
"""
PART = """\
part: a face
probing: {point_repeatability: 1 um, tip: {diameter: 4}}
places: {there: {origin: [100, 100, 100]}}
features: {top: {points: face.csv, fit: plane, normal: z+}}
dimensions: [{flatness: top, tolerance: 0.1}]
"""
FACE = "x_mm,y_mm,z_mm\n0,0,20\n50,0,20\n0,50,20\n50,50,20\n"
BALLS = "ball,x_mm,y_mm\na,0,0\nb,300,0\nc,0,300\nd,300,310\ne,150,120\n"

# Of files and pictures that a command writes or reads: how their options are shown in its help.
METAVARS = ("FILE", "CSV", "YAML", "NAME.yaml", "STORE", "READINGS", "FOLDER")


@dataclass(frozen=True)
class Walk:
    """A command: what it reads, in the order of its arguments, the options and names of what it
    writes, other options.

    `also` are files that those read name.
    """

    reads: dict[str, str]
    writes: dict[str, str]
    options: tuple[str, ...] = ()
    also: tuple[str, ...] = ()
    prints: bool = True


EXPERIMENT = {"FILE": "design.yaml"}
FITTED = EXPERIMENT | {"READINGS": "readings.csv", "--certificate": "certificate.csv"}
BALLS_TOO = ("balls.csv",)
WALK = {
    "init": Walk({}, {"NAME.yaml": "new.yaml"}, prints=False),
    "simulate": Walk(
        EXPERIMENT, {"-o": "r.csv", "--certificate": "c.csv"}, also=BALLS_TOO, prints=False
    ),
    "import": Walk(
        {"REPORT": "report.dmo", "--for": "design.yaml"},
        {"-o": "i.csv"},
        also=BALLS_TOO,
        prints=False,
    ),
    "fit": Walk(
        FITTED, {"--plot": "fit.svg", "-o": "fitted.yaml", "--report": "fit.html"}, also=BALLS_TOO
    ),
    "certificate": Walk(FITTED, {"-o": "p.html"}, also=BALLS_TOO, prints=False),
    "correct": Walk(
        {"MAP": "map.yaml", "POINTS": "corners.csv", "--tasks": "design.yaml"},
        {"-o": "o.csv", "--covariance": "v.csv"},
        ("--probe", "probe"),
    ),
    "models": Walk(FITTED, {}, ("--coefficients", "3"), also=BALLS_TOO),
    "validate": Walk(FITTED, {}, also=BALLS_TOO),
    "run --budget": Walk(FITTED, {}, also=BALLS_TOO),
    "run --errors": Walk(EXPERIMENT, {}, also=BALLS_TOO),
    "next": Walk(EXPERIMENT | {"READINGS": "readings.csv"}, {}, also=BALLS_TOO),
    "map --curves": Walk({"FILE": "curved-map.yaml"}, {}),
    "diff": Walk(
        {"MAP": "map.yaml", "SECOND": "second-map.yaml", "--readings": "readings.csv"},
        {"-o": "d.csv"},
    ),
    "plan": Walk(
        {"FILE": "pool.yaml", "--from": "drawn.yaml", "--done": "done.csv"},
        {"-o": "plan.yaml", "--sheet": "sheet.html"},
        ("--positions", "3", "--workers", "1"),
    ),
    "sheet": Walk(
        EXPERIMENT,
        {"-o": "sheet.html", "--readings": "table.csv", "--points": "points.csv"},
        prints=False,
    ),
    "run --reliability": Walk(EXPERIMENT, {"-o": "o.csv"}, also=BALLS_TOO),
    "map": Walk(
        {"FILE": "machine.yaml"}, {"--plot": "map.png"}, ("--grid", "2,2,2"), ("measured/exx.csv",)
    ),
    "acceptance": Walk(
        {"--design": "design.yaml", "--map": "map.yaml", "--readings": "readings.csv"},
        {"--report": "test.html"},
        ("--mpe", "9 um", "--point-repeatability", "1 um", "--draws", "100"),
        also=BALLS_TOO,
    ),
    "part": Walk(
        {
            "FILE": "part.yaml",
            "--design": "space.yaml",
            "--map": "space-map.yaml",
            "--readings": "touched.csv",
        },
        {"--report": "part.html", "--points": "to-touch.csv"},
        also=("balls.csv", "face.csv"),
    ),
    "spline": Walk(
        {"FILE": "points.csv"},
        {"-o": "s.csv"},
        ("--y", "semi_finish_error", "--points", "12-32"),
    ),
    "sweep --export": Walk({"STORE": "store.sqlite"}, {"-o": "t.parquet"}, prints=False),
    "sweep --report": Walk({"STORE": "store.sqlite"}, {"-o": "t.md"}, prints=False),
    "check": Walk(EXPERIMENT, {}),
    "run": Walk(EXPERIMENT, {"--report": "design.html", "--table": "t.xlsx"}, also=BALLS_TOO),
    "reach": Walk(EXPERIMENT, {}, ("--by", "repeatability")),
    "compare": Walk(EXPERIMENT, {}, ("--trials", "2", "--points", "5")),
    # A store is no file that is replaced; what it refuses is tested with it.
    "sweep": Walk(
        {"FILE": "sweep.yaml", "--store": "new.sqlite", "--folder": "."}, {}, ("--dry-run",)
    ),
    "reproduce": Walk({"--designs": "npl"}, {}, ("npl", "--experiment", "5.2", "--quick")),
    "schema": Walk({}, {}),
}
# Those that are read only where they are asked for, and not needed to walk through.
LEFT_OUT = (
    *("--from", "--done", "--store", "--folder", "--designs", "--tasks", "--readings", "--map"),
)


def small_file(path: Path, **changes: Any) -> Path:
    """The first example with a smaller plate and fewer coefficients, written into a file."""
    path.write_text(yaml.safe_dump(small_sections(**changes), sort_keys=False), encoding="utf-8")
    return path


def line(
    command: str, files: Path, written: dict[str, Path], *more: str, reads: tuple[str, ...] = ()
) -> list[str]:
    """The command line that reads the files and writes these; `reads` are further files to be
    read, of which a map is in the place of a design.
    """
    walk = WALK[command]
    words = [command]
    for option, name in walk.reads.items():
        if option == "--design" and "--map" in reads:
            continue
        if option not in LEFT_OUT or option in reads:
            count = 2 if (command, option) == ("diff", "--readings") else 1
            words += [option] * option.startswith("-") + [str(files / name)] * count
    words += walk.options
    if command in ("simulate", "sweep --export") and "-o" not in written:
        words += ["-o", "-"]
    for option, path in written.items():
        words += [option, str(path)] if option.startswith("-") else [str(path)]
    return [*words, *more]


def content(folder: Path) -> dict[str, bytes | None]:
    """Everything below a folder, hidden files too."""
    found: dict[str, bytes | None] = {}
    for path in sorted(folder.rglob("*")):
        found[str(path.relative_to(folder))] = path.read_bytes() if path.is_file() else None
    return found


def commands() -> dict[str, argparse.ArgumentParser]:
    (found,) = (
        action for action in parser()._actions if isinstance(action, argparse._SubParsersAction)
    )
    return dict(found.choices)


def label(action: argparse.Action) -> str:
    return action.option_strings[0] if action.option_strings else str(action.metavar)


def refused(
    arguments: list[str], capsys: pytest.CaptureFixture[str], status: int, *told: str
) -> None:
    """A command ends with the status, one line, nothing printed, and no file touched."""
    capsys.readouterr()
    assert main(arguments) == status
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1, err
    for words in told:
        assert words in err
