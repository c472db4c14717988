"""Fits of small experiments with error models of every kind."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path
from typing import Any

import ballplate as bp

from tests.extensions.own_models.test_custom_model import GOOD

PROBES = {"down": ["0 mm", "0 mm", "-50 mm"], "right": ["50 mm", "0 mm", "0 mm"]}
POSITIONS: list[dict[str, Any]] = [
    {
        "name": f"P{k}",
        "plane": plane,
        "level": f"{level} mm",
        "corner": {axis: "50 mm" for axis in "xyz" if axis != plane},
        "quarter_turns": turns,
        "probes": probes,
    }
    for k, (plane, level, turns, probes) in enumerate(
        [
            ("z", 100, 0, ["down"]),
            ("z", 400, 0, ["down"]),
            ("z", 250, 1, ["down", "right"]),
            *((axis, 150 + 200 * turn, turn, ["right"]) for axis in "xy" for turn in (0, 1)),
        ]
    )
]
IN_SPACE: dict[str, Any] = {
    "title": "a plate in space",
    "machine": {"volume": ["500 mm", "500 mm", "500 mm"], "repeatability": "0.3 um"},
    "probes": PROBES,
    "artefacts": {"plate": {"kind": "square", "balls": 3, "size": "400 mm"}},
    "positions": POSITIONS,
    "calibration": [{"kind": "distances", "pairs": "corners", "standard_uncertainty": "0.3 um"}],
}
CORNER = {"x": "50 mm", "y": "60 mm"}
IN_PLANE: dict[str, Any] = {
    "title": "a plate in a plane",
    "machine": {"volume": ["500 mm", "600 mm"], "repeatability": "0.5 um"},
    "artefacts": {"plate": {"kind": "square", "balls": 3, "size": "400 mm"}},
    "positions": [{"name": f"Q{k}", "corner": CORNER, "quarter_turns": k} for k in range(3)],
    "calibration": [{"kind": "distances", "pairs": "corners", "standard_uncertainty": "0.3 um"}],
}
SMALL = {"position_coefficients": 3, "rotation_coefficients": 2}
FREE = {
    "down": PROBES["down"],
    "right": {"offset": PROBES["right"], "standard_uncertainty": "50 um"},
}
MODELS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "metric": (IN_PLANE, {"kind": "metric", "scale": "split"}),
    "spatial metric": (IN_SPACE, {"kind": "metric"}),
    "kinematic": (IN_SPACE, {"kind": "kinematic", **SMALL}),
    "table": (IN_SPACE, {"kind": "kinematic", "arrangement": "FB1", "rotations": "full", **SMALL}),
    "deficient": (
        IN_SPACE | {"positions": [{**one, "probes": one["probes"][:1]} for one in POSITIONS]},
        {"kind": "kinematic", "arrangement": "FB1", "rotations": "full", **SMALL},
    ),
    "listed axes": (
        IN_SPACE,
        {
            "kind": "kinematic",
            "arrangement": {"probe_side": ["x", "z"], "workpiece_side": ["y"]},
            "basis": {"order": 3, "knots": [0.5]},
            "squareness": "parameters",
        },
    ),
    "plane": (IN_PLANE, {"kind": "kinematic", **SMALL}),
    "empirical": (IN_SPACE, {"kind": "empirical", "terms": "quadratic"}),
    "functions by axis": (
        IN_SPACE,
        {"kind": "empirical", "basis": {"y": {"order": 3}}, "coefficients": {"x": 3, "z": 2}},
    ),
    "estimated probe": (IN_SPACE | {"probes": FREE}, {"kind": "metric"}),
    "machine file": (IN_SPACE, {"kind": "machine", "file": "machine.yaml"}),
    "python": (IN_SPACE, {"kind": "python", "object": "MODULE:build"}),
}
MACHINE = """\
title: a machine with one table and one polynomial
arrangement: MB2
volume: [500 mm, 500 mm, 500 mm]
errors:
  EXX: {file: exx.csv}
  EAY: {polynomial: [0 urad, 3 urad]}
"""
TABLE = "position_mm,EXX_um\n0,0\n100,0.4\n200,0.9\n300,1.1\n400,1.0\n500,1.6\n"


def write_files(folder: Path) -> None:
    """The files that some of the models rest on."""
    (folder / "machine.yaml").write_text(MACHINE)
    (folder / "exx.csv").write_text(TABLE)
    (folder / f"{module_of(folder)}.py").write_text(GOOD)


def module_of(folder: Path) -> str:
    """A name that no module in another folder has."""
    return f"own_model_{hashlib.sha256(str(folder).encode()).hexdigest()[:12]}"


def model_of(kind: str, folder: Path) -> dict[str, Any]:
    """Settings of a kind of model."""
    settings = dict(MODELS[kind][1])
    if kind == "python":
        settings["object"] = f"{module_of(folder)}:build"
    return settings


def experiment_of(kind: str, folder: Path, **more: Any) -> bp.Experiment:
    """The experiment for a kind of model; `folder` is where its files are."""
    sections = {**MODELS[kind][0], "error_model": model_of(kind, folder)}
    return bp.experiment({**sections, **more}, folder)


@cache
def fit_of(kind: str, folder: Path, seed: int = 1) -> Any:
    """A fit of simulated readings."""
    experiment = experiment_of(kind, folder)
    return bp.fit(experiment, bp.simulate(experiment, seed))
