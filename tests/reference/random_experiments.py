"""Experiments drawn at random, most of them deficient, as they might be written without knowing
what is needed.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import yaml
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment

PROBES = {
    "down": ["0 mm", "0 mm", "-50 mm"],
    "right": ["50 mm", "0 mm", "0 mm"],
    "left": ["-50 mm", "0 mm", "0 mm"],
    "back": ["0 mm", "50 mm", "0 mm"],
    "front": ["0 mm", "-50 mm", "0 mm"],
}
OF_PLANE = {"x": ["right", "left"], "y": ["back", "front"], "z": ["down"]}
OTHERS = {"x": "yz", "y": "zx", "z": "xy"}
ARRANGEMENTS = ["MB1", "MB2", "FB1", "FB2", "FH1", "FH2", "MH1", "MH2", "CX1", "CY1"]


def random_text(seed: int) -> str:
    """An experiment file: one or two plates, a bar or none, one to four positions, some certificate
    or none.
    """
    draw = np.random.default_rng(seed)
    rows, columns = draw.integers(2, 5, 2).tolist()
    artefacts: dict[str, Any] = {
        "plate": {"kind": "grid", "balls": [rows, columns], "size": ["400 mm", "500 mm"]}
    }
    if draw.random() < 0.3:
        artefacts["second"] = {"kind": "grid", "balls": [2, 3], "size": ["300 mm", "400 mm"]}
    positions = [_position(draw, k, "plate") for k in range(int(draw.integers(1, 5)))]
    if "second" in artefacts:
        positions += [_position(draw, k + 10, "second") for k in range(int(draw.integers(1, 3)))]
    if draw.random() < 0.3:
        artefacts["bar"] = {"kind": "two_spheres", "length": "400 mm", "role": "length_standard"}
        positions += [_bar(draw, k) for k in range(int(draw.integers(1, 4)))]
    calibration: list[dict[str, Any]] = []
    kind = draw.choice(["none", "sides", "all", "some"])
    uncertainty = str(draw.choice(["1 nm", "0.2 um", "1 um", "20 um"]))
    if kind == "sides":
        calibration.append(
            _item("plate", "distances", pairs="corner sides", standard_uncertainty=uncertainty)
        )
    elif kind in ("all", "some"):
        balls = "all" if kind == "all" else ["r1c1", "r1c2", "r2c1"]
        calibration.append(
            _item("plate", "coordinates", balls=balls, standard_uncertainty=uncertainty)
        )
    if "bar" in artefacts and draw.random() < 0.7:
        calibration.append(_item("bar", "distances", pairs="all", standard_uncertainty="0.3 um"))
    if draw.random() < 0.15:
        model: dict[str, Any] = {
            "kind": "empirical",
            "terms": str(draw.choice(["sums", "quadratic"])),
        }
    else:
        counts = draw.integers(2, 5, 2).tolist()
        model = {"kind": "kinematic", "arrangement": str(draw.choice(ARRANGEMENTS))}
        model |= dict(zip(("position_coefficients", "rotation_coefficients"), counts, strict=True))
        model["rotations"] = str(draw.choice(["linearised", "full"]))
    whole = {
        "title": f"drawn from {seed}",
        "machine": {
            "volume": ["1 m", "1 m", "1 m"],
            "repeatability": str(draw.choice(["3 nm", "0.2 um", "2 um"])),
        },
        "error_model": model,
        "true_machine": {
            "kind": "random",
            "position": "2 um",
            "rotation": "4 urad",
            "seed": int(seed),
        },
        "probes": PROBES,
        "artefacts": artefacts,
        "positions": positions,
        "calibration": calibration,
        "evaluation": {"points": {"random": 20, "seed": 1}, "probe": "down"},
        "seed": int(seed),
    }
    if not calibration:
        del whole["calibration"]
    return yaml.safe_dump(whole, sort_keys=False)


def _item(artefact: str, kind: str, **rest: Any) -> dict[str, Any]:
    return {"artefact": artefact, "kind": kind, **rest}


def _position(draw: np.random.Generator, number: int, artefact: str) -> dict[str, Any]:
    plane = str(draw.choice(list("xyz")))
    probes = OF_PLANE[plane][: int(draw.integers(1, 3))]
    return {
        "name": f"p{number}",
        "artefact": artefact,
        "plane": plane,
        "level": f"{draw.choice([250, 500, 750])} mm",
        "corner": {axis: f"{draw.choice([100, 200, 400])} mm" for axis in OTHERS[plane]},
        "quarter_turns": int(draw.integers(0, 4)),
        "probes": probes,
    }


def _bar(draw: np.random.Generator, number: int) -> dict[str, Any]:
    angles = [f"{angle} deg" for angle in draw.choice([-30, 0, 30, 45, 90], 3)]
    origin = [f"{value} mm" for value in draw.integers(4, 7, 3) * 100]
    return {
        "name": f"bar {number}",
        "artefact": "bar",
        "pose": {"origin": origin, "rotation": angles},
        "probes": ["down"],
    }


def random_experiment(seed: int, folder: Path) -> Experiment:
    """The experiment of a seed, written to a file in `folder` and read from there."""
    path = folder / f"{seed}.yaml"
    path.write_text(random_text(seed))
    return load(path)[0]
