"""Small experiments with everything that can be wrong, for tests of reliability."""

from __future__ import annotations

from pathlib import Path

from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment

PLATE = """
title: small
machine: {volume: [1 m, 1 m, 1 m], repeatability: [0.2 um, 0.3 um, 0.2 um]}
error_model: {kind: kinematic, arrangement: MB2, position_coefficients: 3, rotation_coefficients: 3}
true_machine: {kind: random, position: 2 um, rotation: 4 urad, seed: 7}
probes:
  down: [0 mm, 0 mm, -50 mm]
  right: [50 mm, 0 mm, 0 mm]
  left: [-50 mm, 0 mm, 0 mm]
  back: [0 mm, 50 mm, 0 mm]
artefacts:
  plate: {kind: grid, balls: [3, 3], size: [700 mm, 700 mm]}
positions:
  - {name: low, plane: z, level: 250 mm, corner: {x: 0 mm, y: 0 mm}, probes: [down]}
  - {name: high, plane: z, level: 750 mm, corner: {x: 250 mm, y: 250 mm}, quarter_turns: 1, probes: [down]}
  - {name: near, plane: x, level: 250 mm, corner: {y: 0 mm, z: 0 mm}, quarter_turns: 1, probes: [right, left]}
  - {name: far, plane: x, level: 750 mm, corner: {y: 250 mm, z: 250 mm}, probes: [right, left]}
  - {name: side, plane: y, level: 500 mm, corner: {z: 50 mm, x: 200 mm}, quarter_turns: 1, probes: [back], repeats: 2}
  - {name: top, plane: y, level: 800 mm, corner: {z: 250 mm, x: 50 mm}, probes: [back]}
calibration:
  - {kind: distances, artefact: plate, pairs: corner sides, standard_uncertainty: 0.2 um}
evaluation: {points: {random: 12, seed: 1}, probe: down}
"""

# The same with a bar that is read three times, of which the certificate is one, and a probe that is
# estimated.
MIXED = (
    PLATE.replace(
        "left: [-50 mm, 0 mm, 0 mm]",
        "left: {offset: [-50 mm, 0 mm, 0 mm], standard_uncertainty: 0.5 um}",
    )
    .replace(
        "positions:",
        "  bar: {kind: two_spheres, length: 500 mm, role: length_standard}\npositions:",
    )
    .replace("plane: ", "artefact: plate, plane: ")
    .replace(
        "calibration:",
        """  - {name: along x, artefact: bar, pose: {origin: [250 mm, 500 mm, 400 mm]}, probes: [down]}
  - {name: along y, artefact: bar, pose: {origin: [500 mm, 300 mm, 400 mm], rotation: [0 deg, 0 deg, 90 deg]},
     probes: [down, right]}
calibration:
  - {kind: distances, artefact: bar, pairs: all, standard_uncertainty: 0.3 um}
  - {kind: coordinates, artefact: plate, balls: [r2c2], standard_uncertainty: 0.5 um}""",
    )
)

PLANE = """
title: plane
machine: {volume: [1 m, 1 m], repeatability: 0.2 um}
error_model: {kind: metric}
true_machine: {kind: coefficients, values: {alpha: 20 urad}}
artefacts:
  plate: {kind: grid, balls: [3, 4], size: [600 mm, 700 mm]}
positions:
  - {name: first, pose: {origin: [100 mm, 100 mm]}}
  - {name: turned, pose: {origin: [900 mm, 100 mm], rotation: 90 deg}, repeats: 2}
  - {name: shifted, pose: {origin: [200 mm, 150 mm], rotation: 5 deg}}
calibration:
  - {kind: distances, artefact: plate, pairs: [[r1c1, r1c3], [r1c1, r4c1]], standard_uncertainty: 0.1 um}
evaluation: {points: {random: 12, seed: 1}}
"""


def experiment(folder: Path, text: str) -> Experiment:
    """The experiment of a text."""
    path = folder / "small.yaml"
    path.write_text(text, encoding="utf-8")
    return load(path)[0]
