"""Experiments with a plate of unknown shape and a length standard whose balls several lengths
share.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment

PLATE: dict[str, Any] = {
    "title": "a plate and a length standard",
    "machine": {
        "volume": ["600 mm", "500 mm", "500 mm"],
        "repeatability": ["1 um", "0.7 um", "1.3 um"],
    },
    "error_model": {
        "kind": "kinematic",
        "arrangement": "MB2",
        "position_coefficients": 3,
        "rotation_coefficients": 2,
    },
    "probes": {
        "down": ["0 mm", "0 mm", "-80 mm"],
        "right": ["60 mm", "0 mm", "0 mm"],
        "back": ["0 mm", "60 mm", "0 mm"],
    },
    "evaluation": {"points": {"random": 8, "seed": 1}, "probe": "down"},
}
PLATE_POSITIONS: list[dict[str, Any]] = [
    {
        "name": "low",
        "plane": "z",
        "level": "50 mm",
        "corner": {"x": "0 mm", "y": "0 mm"},
        "probes": ["down"],
    },
    {
        "name": "high",
        "plane": "z",
        "level": "350 mm",
        "corner": {"x": "300 mm", "y": "200 mm"},
        "quarter_turns": 1,
        "probes": ["down", "right"],
    },
    {
        "name": "left",
        "plane": "x",
        "level": "100 mm",
        "corner": {"y": "0 mm", "z": "50 mm"},
        "quarter_turns": 1,
        "probes": ["right"],
    },
    {
        "name": "right",
        "plane": "x",
        "level": "500 mm",
        "corner": {"y": "200 mm", "z": "20 mm"},
        "probes": ["right"],
    },
    {
        "name": "back",
        "plane": "y",
        "level": "400 mm",
        "corner": {"x": "100 mm", "z": "80 mm"},
        "probes": ["down", "back"],
    },
]


def bar(balls: int, unequal: bool = True) -> dict[str, Any]:
    """Balls on one line, at distances that differ unless they are two."""
    places = [
        round(300.0 * (k / (balls - 1)) ** (1.3 if unequal else 1.0), 3) for k in range(balls)
    ]
    return {
        "kind": "balls",
        "coordinates": {f"b{k}": [f"{x} mm", "0 mm", "0 mm"] for k, x in enumerate(places)},
    }


def flat(balls: int) -> dict[str, Any]:
    """A square plate of balls x balls."""
    return {"kind": "grid", "balls": [balls, balls], "size": ["200 mm", "240 mm"]}


def spatial() -> dict[str, Any]:
    """Six balls of which no four lie in a plane."""
    places = [(0, 0, 0), (200, 10, 20), (30, 180, 40), (60, 90, 150), (170, 120, 60), (90, 20, 110)]
    return {
        "kind": "balls",
        "coordinates": {f"b{k}": [f"{x} mm" for x in place] for k, place in enumerate(places)},
    }


POSES: list[dict[str, Any]] = [
    {"origin": ["100 mm", "150 mm", "60 mm"]},
    {"origin": ["300 mm", "60 mm", "100 mm"], "rotation": ["0 deg", "0 deg", "90 deg"]},
    {"origin": ["250 mm", "120 mm", "350 mm"], "rotation": ["0 deg", "90 deg", "0 deg"]},
    {"origin": ["200 mm", "100 mm", "110 mm"], "rotation": ["10 deg", "-15 deg", "35 deg"]},
    {"origin": ["400 mm", "200 mm", "300 mm"], "rotation": ["-20 deg", "40 deg", "130 deg"]},
]


def experiment(
    folder: Path,
    standard: dict[str, Any],
    calibration: dict[str, Any] | list[dict[str, Any]],
    places: list[dict[str, Any]] | None = None,
    **sections: Any,
) -> Experiment:
    """The plate beside a standard in several poses; `places` (at most as many as `POSES`) add to
    its positions.
    """
    given = [calibration] if isinstance(calibration, dict) else calibration
    every = places if places is not None else [{"probes": ["down"]}] * len(POSES)
    content = PLATE | {
        "artefacts": {
            "plate": {"kind": "grid", "balls": [3, 3], "size": ["260 mm", "250 mm"]},
            "standard": standard | {"role": "length_standard"},
        },
        "positions": [
            *({"artefact": "plate"} | place for place in PLATE_POSITIONS),
            *(
                {"artefact": "standard", "name": f"standard {k}", "pose": POSES[k]} | place
                for k, place in enumerate(every)
            ),
        ],
        "calibration": [{"kind": "distances", "artefact": "standard"} | one for one in given],
    }
    path = folder / "experiment.yaml"
    path.write_text(yaml.safe_dump(content | sections), encoding="utf-8")
    (found,) = load(path)
    return found
