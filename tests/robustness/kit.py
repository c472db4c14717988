"""One folder with a valid file of every kind that a command reads, all of small designs, and things
that are no files.

Each case is tried in a copy of it of its own.
"""

from __future__ import annotations

import atexit
import os
import shutil
import sqlite3
import tempfile
from collections.abc import Callable
from contextlib import closing
from functools import cache
from pathlib import Path

from tests.reference.copies import copy_file, copy_tree
from tests.robustness.experiments import FILES
from tests.robustness.worker import outcome

DESIGNS = Path("designs")

SMALL = """\
title: a small plate
machine: {volume: [600 mm, 500 mm, 400 mm], repeatability: 0.2 um}
error_model: {kind: kinematic, arrangement: MB2, position_coefficients: 3, rotation_coefficients: 2}
true_machine: {kind: random, position: 2 um, rotation: 4 urad, seed: 7}
probes: {down: [0 mm, 0 mm, -50 mm], right: [60 mm, 0 mm, 0 mm], back: [0 mm, 60 mm, 0 mm]}
artefacts:
  plate: {kind: grid, balls: [3, 3], size: [300 mm, 300 mm]}
positions:
  - {name: low, plane: z, level: 100 mm, corner: {x: 50 mm, y: 50 mm}, probes: [down]}
  - {name: high, plane: z, level: 300 mm, corner: {x: 250 mm, y: 150 mm}, quarter_turns: 1, probes: [down]}
  - {name: x low, plane: x, level: 100 mm, corner: {y: 50 mm, z: 50 mm}, quarter_turns: 1, probes: [right, down]}
  - {name: x high, plane: x, level: 450 mm, corner: {y: 150 mm, z: 80 mm}, probes: [right]}
  - {name: y low, plane: y, level: 100 mm, corner: {z: 50 mm, x: 50 mm}, probes: [back, down]}
  - {name: y high, plane: y, level: 350 mm, corner: {z: 80 mm, x: 250 mm}, quarter_turns: 1, probes: [back]}
calibration:
  - {kind: distances, pairs: corner sides, standard_uncertainty: 0.2 um}
evaluation:
  points: {random: 20, seed: 1}
  probe: down
  tasks: [{name: along x, from: [50 mm, 200 mm, 100 mm], to: [550 mm, 200 mm, 100 mm]}]
target_uncertainty: 2 um + L/1000000
seed: 1
"""

# Two of six cells fail, as the plate reaches out of the volume.
SWEEP = """\
title: a small sweep
base: small.yaml
axes:
  size: {paths: ["artefacts.plate.size[0]", "artefacts.plate.size[1]"], from: 250 mm, to: 850 mm, count: 3}
  balls: {path: artefacts.plate.balls, values: {few: [2, 3], more: [3, 3]}}
seed: 3
record: [U1, U4, U6]
"""

POOL = """\
title: a small pool
machine: {volume: [600 mm, 500 mm, 400 mm], repeatability: 1 um}
error_model: {kind: metric}
probes: {down: [0 mm, 0 mm, -50 mm], right: [60 mm, 0 mm, 0 mm]}
artefacts:
  plate: {kind: grid, balls: [2, 2], size: [300 mm, 300 mm]}
calibration:
  - {kind: distances, artefact: plate, pairs: all, standard_uncertainty: 0.5 um}
target_uncertainty: 2 um + L/300000
evaluation:
  points: {random: 8, seed: 1}
  probe: down
  tasks: [{name: along x, from: [50 mm, 200 mm, 100 mm], to: [550 mm, 200 mm, 100 mm]}]
pool:
  times: {set_up: 10 min, reading: 20 s, probe_change: 3 min, plane_change: 20 min}
  candidates:
    - {name: flat, artefact: plate, planes: [z], levels: [50 mm, 350 mm], corners: {x: 50 mm, y: 50 mm}, probes: [down]}
    - name: upright
      artefact: plate
      planes: [x, y]
      levels: [250 mm]
      corners: {x: 50 mm, y: 50 mm, z: 50 mm}
      probes: [[down, right]]
  calibration:
    - {name: sides, artefact: plate, kind: distances, pairs: corner sides, standard_uncertainty: 0.1 um, price: 40 min}
"""

MACHINE = """\
title: a small machine
volume: {x: [0 mm, 800 mm], y: [0 mm, 600 mm], z: [0 mm, 500 mm]}
arrangement: MB2
errors:
  EXX: {file: exx.csv, fit: {order: 3}}
  EYX: {polynomial: [0 um, 8 um, -8 um], line: {y: 300 mm, z: 400 mm}}
  EAX: {polynomial: [0 urad, 4 urad], bandwidth: 3 urad}
squareness: {EC0Y: 21 urad}
"""

CURVE = "position_mm,error_um\n" + "".join(
    f"{20 * k},{error}\n"
    for k, error in enumerate((0, 0.5, 0.8, 0.4, -0.1, -0.3, 0.2, 0.9, 1.4, 1.1, 0.6, 0.1))
)


VARIANTS = {
    "splines": "plain",
    "bar-bell": "length known",
    "bryan-gauge": "radius known",
    "dummy": "with scale",
    "angles": "any angles",
}
WITHOUT_CERTIFICATE = ("angles", "dummy")
AGAIN = ("small", "tables", "bar-bell")
READINGS_OF = ("small", "tables", "splines", "bar-bell", "bryan-gauge", "dummy", "angles")


def make_kit(folder: Path) -> None:
    """Fill an empty folder."""
    copy_tree(_made(), folder, dirs_exist_ok=True)
    (folder / "loop.csv").symlink_to("loop.csv")
    os.mkfifo(folder / "pipe.csv")


@cache
def _made() -> Path:
    """The regular files, made once by each process."""
    folder = Path(tempfile.mkdtemp(prefix="ballplate-kit-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    for source in (*FILES.glob("*.csv"), *FILES.glob("*.yaml"), *(FILES / "sweeps").glob("*.yaml")):
        copy_file(source, folder)
    copied = (
        *(
            "quickstart.yaml",
            "hurt_foss/bar-bell.yaml",
            "hurt_foss/bryan-gauge.yaml",
            "gilsinn/table-1.csv",
        ),
        *(
            "hocken_borchardt/dummy.yaml",
            "hocken_borchardt/angles.yaml",
            "park/machines/gec-like.yaml",
        ),
        *("park/machines/measured/exx.csv", "certified/deficient.yaml", "reports/z-low.dmo"),
    )
    for name in copied:
        copy_file(DESIGNS / name, folder)
    copy_tree(DESIGNS / "certified", folder / "certified", ignore=_all_but("weak", "deficient"))
    copy_tree(DESIGNS / "npl", folder / "npl", ignore=_all_but("5."))
    texts = {
        "small.yaml": SMALL,
        "measured.yaml": f"{SMALL}part: {{file: part.yaml}}\n",
        "pool.yaml": POOL,
        "sweep.yaml": SWEEP,
        "machine.yaml": MACHINE,
        "curve.csv": CURVE,
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    _make_readings(folder)
    _make_stores(folder)
    (folder / "junk.bin").write_bytes(bytes(range(256)) * 8)
    (folder / "empty.txt").write_bytes(b"")
    (folder / "folder").mkdir()
    for suffix in (".csv", ".yaml", ".svg", ".html"):
        (folder / f"old{suffix}").write_text("something that was there before\n", encoding="utf-8")
    return folder


def _all_but(*beginnings: str) -> Callable[[str, list[str]], list[str]]:
    return lambda _, names: [name for name in names if not name.startswith(beginnings)]


def _ballplate(folder: Path, *arguments: str) -> None:
    """Run a command in the folder; its outcome shows in the files."""
    status, _, err = outcome(arguments, folder)
    assert status in (0, 1), (arguments, err)


def _make_readings(folder: Path) -> None:
    for name in READINGS_OF:
        variant = ["--variant", VARIANTS[name]] if name in VARIANTS else []
        certificate = (
            [] if name in WITHOUT_CERTIFICATE else ["--certificate", f"{name}-certificate.csv"]
        )
        _ballplate(
            folder, "simulate", f"{name}.yaml", "-o", f"{name}-readings.csv", *variant, *certificate
        )
    _ballplate(
        folder, "plan", "pool.yaml", "--positions", "2", "--workers", "1", "-o", "planned.yaml"
    )
    _ballplate(folder, "simulate", "planned.yaml", "-o", "planned-readings.csv")
    for name in AGAIN:
        variant = ["--variant", VARIANTS[name]] if name in VARIANTS else []
        again = ["-o", f"{name}-again.csv", "--seed", "9"]
        _ballplate(folder, "simulate", f"{name}.yaml", *again, *variant)
    for name, readings in (("map.yaml", "small-readings.csv"), ("again.yaml", "small-again.csv")):
        _ballplate(folder, "fit", "small.yaml", readings, "-o", name, "--date", "2026-11-22")
    points = "name,probe,x_mm,y_mm,z_mm\nA,down,50,200,100\nB,right,450,200,100\n"
    (folder / "to-correct.csv").write_text(points, encoding="utf-8")


def _make_stores(folder: Path) -> None:
    """A store of a sweep that is done but for one cell, one with data sets, and one that is another
    program's.
    """
    (folder / "trials.yaml").write_text(SWEEP + "trials: 4\n", encoding="utf-8")
    for name in ("sweep", "trials"):
        _ballplate(folder, "sweep", f"{name}.yaml", "--workers", "1")
        with closing(
            sqlite3.connect(folder / f"{name}.sqlite", isolation_level=None)
        ) as connection:
            # What would differ from one time to another, as the same number is to be the same case.
            connection.execute("UPDATE result SET seconds = 0.5")
            connection.execute(
                "DELETE FROM result WHERE key = (SELECT key FROM cell WHERE number = 0)"
            )
            connection.execute("PRAGMA journal_mode = DELETE")
            connection.execute("VACUUM")
            connection.execute("PRAGMA journal_mode = WAL")
    for lock in folder.glob("*.lock"):
        lock.unlink()
    with closing(sqlite3.connect(folder / "foreign.sqlite")) as connection:
        connection.execute("CREATE TABLE result (key TEXT, value REAL)")
        connection.execute("INSERT INTO result VALUES ('a', 1.5)")
        connection.commit()
