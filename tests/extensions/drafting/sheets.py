"""Data sheets of three machines, and designs of their files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from ballplate.extensions.planning.constraints import with_chosen
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment, Position
from ballplate.simulator.geometry.poses import ball_coordinates
from ballplate.simulator.machines.protocol import Array

BRIDGE = {
    "machine_type": "moving bridge",
    "volume": "900 1200 700 mm",
    "mpe": "0.9 um + L/400",
    "plate": "6 x 6, 420 mm",
    "certificate": "0.4 um + 0.5 um/m, k=2",
}
GANTRY = {
    "machine_type": "gantry",
    "volume": "2000 x 3000 x 1000 mm",
    "mpe": "3 + L/250 µm",
    "plate": "8 x 8, pitch 110 mm",
    "certificate": "U = 0.6 um + 0.8 L, k = 2",
}
ARM = {
    "machine_type": "horizontal arm",
    "volume": "1000, 2500, 1500 mm",
    "mpe": "10 um + 10 um/m",
    "plate": "7 x 7, 720 mm",
    "certificate": "1 um + 1 um/m, k=2",
}
FLAT = BRIDGE | {"volume": "500 x 300 mm", "plate": "4 x 4, 120 mm"}
SHEETS = {"bridge": BRIDGE, "gantry": GANTRY, "arm": ARM}


def options(sheet: dict[str, str]) -> list[str]:
    """The options of `init` that state a data sheet."""
    pairs = ((f"--{name.replace('_', '-')}", text) for name, text in sheet.items())
    return [word for pair in pairs for word in pair]


def whole(text: str) -> Experiment:
    """The experiment of a file's text with all candidates of its pool as positions."""
    (experiment,) = load(Path("drafted.yaml"), planning=True, text=text)
    assert experiment.pool is not None
    return with_chosen(experiment, experiment.pool.candidates)


def furthest(experiment: Experiment) -> float:
    """How far balls and scale readings of all positions are outside the volume, in metres."""
    volume, outside = experiment.machine.volume, [-np.inf]
    for position in experiment.positions:
        assert isinstance(position, Position)
        balls = ball_coordinates(position.pose, experiment.layouts[position.artefact])
        for probe in position.probes:
            for points in (balls, balls - experiment.probes[probe].offset):
                outside += [(volume.lower - points).max(), (points - volume.upper).max()]
    return float(max(outside))


def spans(experiment: Experiment) -> Array:
    """The share of each axis of the volume that the balls of all positions span."""
    places = [
        ball_coordinates(position.pose, experiment.layouts[position.artefact])
        for position in experiment.positions
    ]
    volume = experiment.machine.volume
    return np.asarray(np.ptp(np.concatenate(places), axis=0) / (volume.upper - volume.lower))
