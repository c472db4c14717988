"""Time and memory of commands at the largest inputs that they accept: the table in
docs/reference/limits.md.

Run with

    python -m pytest benchmarks/bench_limits.py

or with -k and the name of a case. Each case is a command in a process of its own, whose processor
time and largest memory the system tells when it has ended; processes that it starts are counted in
the time, and the largest of them in the memory. All cases together take an hour or two.
"""

from __future__ import annotations

import math
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.sweeps.task import CellResult

from tests.extensions.sweeps.stores import axis, done, made_up

ROOT = Path(__file__).parents[1]
QUICKSTART = ROOT / "designs" / "quickstart.yaml"
CAMPAIGN = ROOT / "designs" / "planning" / "campaign.yaml"
MACHINE = ROOT / "designs" / "park" / "machines" / "gec-like.yaml"
AXES = (("z", "down"), ("x", "right"), ("x", "left"), ("y", "back"), ("y", "front"))
BALLPLATE = [sys.executable, "-m", "ballplate"]
LINES: list[str] = []


@dataclass(frozen=True)
class Case:
    """A command at a limit: its arguments, made together with its files in a folder, and the status
    to be seen.
    """

    name: str
    arguments: Callable[[Path], list[str | Path]]
    status: int = 0


def _written(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def _changed(folder: Path, *changes: tuple[str, str], source: Path = QUICKSTART) -> Path:
    text = source.read_text(encoding="utf-8")
    for pattern, replacement in changes:
        text, count = re.subn(pattern, replacement, text)
        assert count, pattern
    return _written(folder / "experiment.yaml", text)


def many_points(folder: Path, count: int = 40_000) -> Path:
    return _changed(folder, ("random: 200", f"random: {count}"))


def many_balls(folder: Path) -> Path:
    return _changed(folder, (r"balls: \[5, 5\]", "balls: [200, 200]"))


def many_poses(folder: Path) -> Path:
    places = (
        f"  - {{name: p{k}, plane: z, level: {k} mm, corner: {{x: {k % 20 * 10} mm, y:"
        f" {k // 20 % 20 * 10} mm}}, probes: [down]}}\n"
        for k in range(560)
    )
    return _changed(
        folder,
        (r"positions:\n(  - .*\n)+", f"positions:\n{''.join(places)}"),
        ("expected_rank.*", ""),
    )


def many_readings(folder: Path, repeats: int = 4000) -> Path:
    """An experiment with 250 times as many readings as repeats."""
    return _changed(folder, (r"probes: \[", f"repeats: {repeats}, probes: ["))


def all_pairs(folder: Path) -> Path:
    """A plate of 196 balls with 19,110 distances, read with ten probes and positions."""
    return _changed(folder, (r"balls: \[5, 5\]", "balls: [14, 14]"))


def _variants(count: int) -> str:
    return "variants:\n" + "".join(f"  v{k}: {{seed: {k}}}\n" for k in range(count))


def many_variants(folder: Path) -> Path:
    return _changed(folder, (r"\Z", _variants(1000)))


def large_variants(folder: Path) -> Path:
    """Variants with 320,004 balls, balls read, distances and points each, of which six are
    possible.
    """
    return _changed(
        folder,
        (r"balls: \[5, 5\]", "balls: [200, 200]"),
        ("random: 200", "random: 40000"),
        (r"\Z", _variants(6)),
    )


def many_cells(folder: Path) -> Path:
    """A store with made-up figures of a million cells."""
    count = 1000

    def rows() -> Iterator[CellResult]:
        for k in range(count**2):
            figures = {
                "parameters": 100.0,
                "observations": 500.0,
                "rank_deficiency": 0.0,
                "as_expected": 1.0,
            }
            for symbol in ("U2", "U4", "U6"):
                size = 1e-6 * (1.0 + k * 7919 % count**2 / count**2)
                figures |= {f"{symbol}_maximum_m": size, f"{symbol}_average_m": 0.5 * size}
                figures |= {f"{symbol}_undetermined": 0.0, f"{symbol}_count": 25.0}
            yield done(k, figures, undetermined=[], weak=[], largest_at={"U4": "point 3"})

    numbers = [float(k) for k in range(count)]
    axes = [
        axis("a", [str(k) for k in range(count)], numbers),
        axis("b", [f"{k} m" for k in range(count)], numbers, "m"),
    ]
    made_up(folder / "cells.sqlite", "many cells", axes, rows()).close()
    return folder / "cells.sqlite"


def joint_lengths(folder: Path) -> Path:
    bar = (
        "artefacts:\n  bar: {kind: grid, balls: [11, 7], size: [500 mm, 500 mm], role:"
        " length_standard}\n"
    )
    place = (
        r"\g<0>  - {name: bar, artefact: bar, plane: z, level: 100 mm, corner: {x: 0 mm, y: 0 mm},"
        r" probes: [down]}\n"
    )
    return _changed(
        folder,
        ("artefacts:\n", bar),
        ("  - {name: ", "  - {artefact: plate, name: "),
        (r"positions:\n(  - .*\n)+", place),
        (
            "calibration:\n  - kind: distances\n",
            (
                "calibration:\n  - {kind: distances, artefact: bar, pairs: all,"
                " standard_uncertainty: 1 um}\n  - kind: distances\n    artefact: plate\n"
            ),
        ),
    )


def pool(folder: Path) -> Path:
    return _changed(folder, ("random: 100", "random: 1000"), source=CAMPAIGN)


def many_candidates(folder: Path) -> Path:
    """19,800 plates flat on the table beside the other candidates, and few enough parameters for
    their matrices.
    """
    levels = ", ".join(f"{50 + 500 * k / 495:.3f} mm" for k in range(495))
    return _changed(
        folder,
        (
            r"planes: \[z\]\n      levels: .*\n      corners: .*\n",
            (
                f"planes: [z]\n      levels: [{levels}]\n      corners: "
                "{x: [0 mm, 150 mm, 300 mm, 450 mm, 600 mm], y: [0 mm, 100 mm, 250 mm, 400 mm]}\n"
            ),
        ),
        ("position_coefficients: 4", "position_coefficients: 2"),
        ("rotation_coefficients: 4", "rotation_coefficients: 2"),
        ("expected_rank.*", ""),
        source=CAMPAIGN,
    )


def cells(folder: Path) -> Path:
    return _written(
        folder / "sweep.yaml",
        f"title: many cells\nbase: {QUICKSTART}\nseed: 1\naxes:\n"
        '  a: {paths: ["machine.repeatability"], from: 0.1 um, to: 1 um, count: 1000}\n'
        '  b: {paths: ["artefacts.plate.size[0]"], from: 450 mm, to: 750 mm, count: 1000}\n',
    )


def curve(folder: Path) -> Path:
    noise = np.random.default_rng(1).normal(scale=0.1, size=20_000)
    rows = (f"{0.05 * k:.3f},{math.sin(k / 900) + noise[k]:.4f}\n" for k in range(20_000))
    return _written(folder / "curve.csv", f"position_mm,error_um\n{''.join(rows)}")


def readings_of(path: Path) -> Path:
    """A file of readings, as many as the experiment in the same folder plans."""
    found = path.parent / "readings.csv"
    subprocess.run(
        [*BALLPLATE, "simulate", path, "-o", found], check=True, cwd=ROOT, capture_output=True
    )
    return found


def unknown_names(folder: Path) -> Path:
    rows = (f"nowhere{k % 7},r1c1,down,{k % 900}.5,10.25,30\n" for k in range(450_000))
    return _written(folder / "readings.csv", f"position,ball,probe,x_mm,y_mm,z_mm\n{''.join(rows)}")


def repeated_rows(folder: Path) -> Path:
    """Known names, each row of which stands there two thousand times, at places where no ball
    is.
    """
    sides = [(f"{axis} {level}", probe) for axis, probe in AXES for level in ("low", "high")]
    rows = []
    for k in range(450_000):
        position, probe = sides[k // 25 % len(sides)]
        ball = f"r{k % 25 // 5 + 1}c{k % 5 + 1}"
        rows.append(
            f"{position},{ball},{probe},{500 + k % 97 * 0.0013:.6f},{400 + k % 89 * 0.0017:.6f},250\n"
        )
    return _written(folder / "readings.csv", f"position,ball,probe,x_mm,y_mm,z_mm\n{''.join(rows)}")


CASES = (
    Case("check, 3429 parameters", lambda folder: ["check", many_poses(folder)], 1),
    Case("run, 3429 parameters", lambda folder: ["run", many_poses(folder)], 1),
    Case("check, 1000 variants", lambda folder: ["check", many_variants(folder)]),
    Case("check, 6 variants of 40,000 balls", lambda folder: ["check", large_variants(folder)]),
    Case(
        "check, 2926 lengths with balls in common", lambda folder: ["check", joint_lengths(folder)]
    ),
    Case("run, 40,000 evaluation points", lambda folder: ["run", many_points(folder)]),
    Case("run, 40,000 balls", lambda folder: ["run", many_balls(folder)]),
    Case(
        "reliability, 40,000 evaluation points",
        lambda folder: ["run", "--reliability", many_points(folder)],
    ),
    Case("run --trials 1000000", lambda folder: ["run", QUICKSTART, "--trials", "1000000"]),
    Case(
        "reliability, 1,000,000 readings",
        lambda folder: ["run", "--reliability", many_readings(folder)],
    ),
    Case(
        "reach, 10,000 evaluation points",
        lambda folder: ["reach", many_points(folder, 10_000), "--by", "repeatability"],
    ),
    Case(
        "plan, 1000 evaluation points",
        lambda folder: ["plan", pool(folder), "--positions", "4", "--workers", "1"],
    ),
    Case(
        "plan, 20,000 candidates",
        lambda folder: ["plan", many_candidates(folder), "--positions", "4", "--workers", "1"],
    ),
    Case(
        "compare, 191,100 terms",
        lambda folder: ["compare", all_pairs(folder), "--pairs", "all", "--trials", "1"],
    ),
    Case(
        "compare, 100,000 pairs of points",
        lambda folder: ["compare", QUICKSTART, "--trials", "100", "--points", "100000"],
    ),
    Case(
        "simulate, 2,000,000 readings",
        lambda folder: ["simulate", many_readings(folder, 8000), "-o", folder / "r.csv"],
    ),
    Case(
        "fit, 56,750 readings",
        lambda folder: ["fit", many_readings(folder, 227), readings_of(folder / "experiment.yaml")],
    ),
    Case(
        "fit, 1,000,000 readings, refused",
        lambda folder: ["fit", many_readings(folder), readings_of(folder / "experiment.yaml")],
        3,
    ),
    Case(
        "fit, 450,000 readings of unknown positions",
        lambda folder: ["fit", QUICKSTART, unknown_names(folder)],
        3,
    ),
    Case(
        "fit, 450,000 readings at wrong places",
        lambda folder: ["fit", QUICKSTART, repeated_rows(folder)],
        3,
    ),
    Case("map, 195,112 points", lambda folder: ["map", MACHINE, "--grid", "58,58,58"]),
    Case("spline, 20,000 points", lambda folder: ["spline", curve(folder), "--every", "50"]),
    Case("sweep --dry-run, 1,000,000 cells", lambda folder: ["sweep", cells(folder), "--dry-run"]),
    Case(
        "export, 1,000,000 cells",
        lambda folder: ["sweep", "--export", many_cells(folder), "-o", folder / "cells.csv"],
    ),
    Case(
        "report, 1,000,000 cells",
        lambda folder: ["sweep", "--report", many_cells(folder), "-o", folder / "cells.html"],
    ),
)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_command_at_its_limit(case: Case, tmp_path: Path) -> None:
    arguments = case.arguments(tmp_path)
    with (tmp_path / "out").open("wb") as out, (tmp_path / "err").open("wb") as err:
        process = subprocess.Popen(
            [*BALLPLATE, *arguments],
            cwd=ROOT,
            stdout=out,
            stderr=err,
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        )
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    told = (tmp_path / "err").read_text(encoding="utf-8")
    assert process.returncode == case.status, told
    assert "Traceback" not in told
    LINES.append(
        f"| {case.name} | {used.ru_utime + used.ru_stime:.0f} | {used.ru_maxrss / 1024:.0f} |"
    )


def test_lines(capsys: pytest.CaptureFixture[str]) -> None:
    with capsys.disabled():
        print("\n| command at its limit | seconds of processor time | MB |\n|---|---:|---:|")
        print("\n".join(LINES))
