"""A file that uses every key, and a plane one that uses few: what the program gets to see."""

from pathlib import Path

import numpy as np
import pytest
from ballplate.simulator.design.observations.coordinates import CoordinateCalibration
from ballplate.simulator.design.observations.distances import DistanceCalibration
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.experiment.sections import ExperimentSettings
from ballplate.simulator.inputs.quantities import LengthFunction, Target
from ballplate.simulator.inputs.yamltree import Mapping, read_tree, walk

COMPLETE = """\
# yaml-language-server: $schema=schema.json
title: Every key
description: at least once
machine:
  volume: {x: [0 mm, 1000 mm], y: [-1 m, 1000 mm], z: [0 mm, 1000 mm]}
  repeatability: {x: 0.2 um, y: 0.2 um, z: 0.3 um}
error_model: {kind: kinematic}
true_machine: {kind: zero}
probes:
  down: [0 mm, 0 mm, -50 mm]
  side: [50 mm, 0 mm, -50 mm]
  turned: {A: 90 deg, B: 180 deg}
head: {tip: [0 mm, 0 mm, -60 mm]}
stars:
  - {probes: [side, turned], standard_uncertainty: 0.5 um, place: unknown}
artefacts:
  plate: {kind: grid, balls: [7, 7], size: [750 mm, 750 mm]}
  frame: {kind: square, balls: 3, size: 500 mm, role: plate}
  listed: {kind: balls, coordinates: [[0 mm, 0 mm], [100 mm, 0 mm, 5 mm]]}
  named: {kind: balls, coordinates: {a: [0 mm, 0 mm, 0 mm], 2: [100 mm, 0 mm, 0 mm]}}
  table: {kind: balls, file: balls.csv}
  bar: {kind: two_spheres, length: 500 mm, role: length_standard}
positions:
  - name: z low
    artefact: plate
    plane: z
    level: 100 mm
    corner: {x: 125 mm, y: 125 mm}
    quarter_turns: 1
    probes: [down, side]
    balls: all
    repeats: 2
  - {name: frame, artefact: frame, plane: y, level: 0.5 m, centre: {z: 0.5 m, x: 0.5 m}, probes: [down]}
  - name: tilted
    artefact: listed
    pose: {origin: [0.1 m, 0.2 m, 0.3 m], rotation: [0 deg, 0 deg, 90 deg]}
    readings:
      - {probes: [down], balls: [1], repeats: 3}
      - {probes: [side], balls: all}
  - {name: 4, artefact: named, pose: {origin: [0.1 m, 0.2 m, 0.3 m]}, probes: [down]}
  - {name: 5, artefact: table, pose: {origin: [0.1 m, 0.2 m, 0.3 m]}, probes: [down]}
  - {name: 6, artefact: bar, plane: x, level: 0 mm, corner: {y: 0 mm, z: 0 mm}, probes: [down]}
calibration:
  - kind: distances
    artefact: plate
    pairs: corner sides
    dimensions: 2
    standard_uncertainty: 0.2 um + L/1000000
  - kind: distances
    artefact: frame
    pairs: [[r1c1, r3c3], [r1c1, r1c2]]
    standard_uncertainty: 0.2 um
    values: distances.csv
  - kind: distances
    artefact: bar
    pairs: all
    standard_uncertainty: 0.1 um
    form: projection
    repeatability: ignored
    values: [{balls: [2, 1], distance: 500.0003 mm}]
  - {kind: coordinates, artefact: plate, balls: corners, standard_uncertainty: 0.2 um}
  - kind: coordinates
    artefact: frame
    balls: [r3c3, r1c1]
    standard_uncertainty: {x: 0.2 um, z: 0.3 um}
    values: certificate.csv
priors:
  - {parameter: EAX, standard_uncertainty: 5 urad}
  - {parameter: "tilted: origin x", value: 101 mm, standard_uncertainty: 1 mm}
evaluation:
  points: {random: 200, seed: 1}
  probe: side
target_uncertainty: 0.5 um + L/1000000
coverage_factor: 2
sigma: given
expected_rank_deficiency: 0
noise: uniform
seed: 7
"""

PLANE = """\
title: plane
machine: {volume: [600 mm, 600 mm], repeatability: [0.2 um, 0.3 um]}
error_model: {kind: metric}
artefacts: {plate: {kind: square, balls: 13, size: 500 mm}}
positions:
  - {name: a, corner: {x: 0 mm, y: 0 mm}}
  - {name: b, centre: {x: 300 mm, y: 300 mm}, quarter_turns: 1, balls: [r1c1]}
  - {name: c, pose: {origin: [550 mm, 0 mm], rotation: 90 deg}}
calibration:
  - {kind: distances, pairs: corner sides, standard_uncertainty: 0.1 um}
  - {kind: coordinates, standard_uncertainty: 0.1 um}
"""


def experiment_of(folder: Path, text: str) -> Experiment:
    path = folder / "design.yaml"
    path.write_text(text, encoding="utf-8")
    (folder / "balls.csv").write_text("ball,x_mm,y_mm\n# a comment\np,0,0\nq,10.5,0\n")
    (folder / "distances.csv").write_text(
        "ball_1,ball_2,distance_mm\nr3c3,r1c1,707.107\nr1c1,r1c2,250.0001\n"
    )
    (folder / "certificate.csv").write_text(
        "ball,x_mm,y_mm,z_um\nr1c1,0.0001,0,0.3\nr3c3,500.0001,500,0.4\n"
    )
    (experiment,) = load(path)
    return experiment


@pytest.fixture
def complete(tmp_path: Path) -> Experiment:
    return experiment_of(tmp_path, COMPLETE)


@pytest.fixture
def plane(tmp_path: Path) -> Experiment:
    return experiment_of(tmp_path, PLANE)


def test_the_file_uses_every_key(complete: Experiment) -> None:
    used = {
        key
        for _, node in walk(read_tree(complete.source))
        if isinstance(node, Mapping)
        for key in node.items
    }
    # Pools, extensions and influence quantities, which a length standard does not go with, have tests of their
    # own.
    assert set(ExperimentSettings.model_fields) - used == {
        "extensions",
        "influences",
        "pool",
        "variants",
    }
    for key in (
        "corner",
        "centre",
        "pose",
        "readings",
        "form",
        "repeatability",
        "file",
        "role",
        "dimensions",
    ):
        assert key in used


def test_heading(complete: Experiment) -> None:
    assert (complete.title, complete.description) == ("Every key", "at least once")
    assert (complete.name, complete.label, complete.seed, complete.sigma) == (
        None,
        "design",
        7,
        "given",
    )
    assert complete.target_uncertainty == Target(LengthFunction(5e-7, 1e-6), 2.0)
    assert complete.expected_rank_deficiency == 0
    assert (complete.error_model.kind, complete.true_machine.kind) == ("kinematic", "zero")


def test_machine(complete: Experiment) -> None:
    assert complete.dimension == complete.machine.dimension == 3
    np.testing.assert_array_equal(complete.machine.volume.lower, [0.0, -1.0, 0.0])
    np.testing.assert_array_equal(complete.machine.volume.upper, [1.0, 1.0, 1.0])
    np.testing.assert_array_equal(complete.machine.repeatability, [2e-7, 2e-7, 3e-7])
    assert list(complete.probes) == ["down", "side", "turned"]
    np.testing.assert_array_equal(complete.probes["side"].offset, [0.05, 0.0, -0.05])
    assert not complete.probes["side"].offset.flags.writeable


def test_artefacts(complete: Experiment) -> None:
    assert list(complete.artefacts) == list(complete.layouts)
    assert complete.artefacts["bar"].role == "length_standard"
    assert complete.layouts["named"].names == ("a", "2")
    assert complete.layouts["table"].names == ("p", "q")
    np.testing.assert_array_equal(complete.layouts["table"].coordinates[1], [0.0105, 0.0, 0.0])


def test_positions(complete: Experiment) -> None:
    first, frame, tilted, fourth = complete.positions[:4]
    assert (first.name, first.artefact, len(first.readings)) == ("z low", "plate", 1)
    assert first.readings[0].probes == ("down", "side")
    assert (first.readings[0].repeats, len(first.readings[0].balls)) == (2, 49)
    np.testing.assert_array_equal(first.readings[0].ball_indices, np.arange(49))
    np.testing.assert_array_equal(first.pose.rotation, [[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    np.testing.assert_array_equal(first.pose.origin, [0.875, 0.125, 0.1])
    np.testing.assert_array_equal(frame.pose.origin, [0.25, 0.5, 0.25])
    assert [group.balls for group in tilted.readings] == [("1",), ("1", "2")]
    assert [group.repeats for group in tilted.readings] == [3, 1]
    np.testing.assert_array_equal(tilted.pose.rotation, [[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    np.testing.assert_array_equal(fourth.pose.rotation, np.eye(3))
    assert fourth.name == "4"


def test_distances(complete: Experiment) -> None:
    sides, diagonal, bar = complete.calibration[:3]
    assert isinstance(sides, DistanceCalibration) and isinstance(diagonal, DistanceCalibration)
    assert isinstance(bar, DistanceCalibration)
    np.testing.assert_array_equal(sides.values, [0.75] * 4)
    np.testing.assert_allclose(sides.standard_uncertainties, [0.95e-6] * 4, rtol=1e-15)
    assert (sides.dimensions, sides.certified, sides.form, sides.repeatability) == (
        2,
        False,
        "distance",
        "included",
    )
    np.testing.assert_array_equal(diagonal.pairs, [[0, 7], [0, 1]])
    np.testing.assert_array_equal(diagonal.values, [0.707107, 0.2500001])
    assert diagonal.certified and diagonal.dimensions == 3
    np.testing.assert_array_equal(bar.values, [0.5000003])
    assert (bar.form, bar.repeatability) == ("projection", "ignored")


def test_coordinates(complete: Experiment) -> None:
    corners, two = complete.calibration[3:]
    assert isinstance(corners, CoordinateCalibration) and isinstance(two, CoordinateCalibration)
    np.testing.assert_array_equal(corners.balls, [0, 6, 42, 48])
    assert corners.axes == (0, 1, 2) and not corners.certified
    np.testing.assert_array_equal(corners.values[3], [0.75, 0.75, 0.0])
    np.testing.assert_array_equal(two.balls, [7, 0])
    assert two.axes == (0, 2) and two.certified
    np.testing.assert_array_equal(two.values, [[0.5000001, 4e-7], [1e-7, 3e-7]])
    np.testing.assert_array_equal(two.standard_uncertainties, [2e-7, 3e-7])


def test_evaluation_points_of_a_file(tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text("z_mm,x_mm,y_mm\n3,1,2\n")
    text = COMPLETE.replace("{random: 200, seed: 1}", "{file: points.csv}")
    np.testing.assert_array_equal(
        experiment_of(tmp_path, text).evaluation.points, [[0.001, 0.002, 0.003]]
    )


def test_plane_experiment_with_defaults(plane: Experiment) -> None:
    assert plane.dimension == 2
    np.testing.assert_array_equal(plane.machine.repeatability, [2e-7, 3e-7])
    np.testing.assert_array_equal(plane.probes["probe"].offset, [0.0, 0.0])
    assert plane.evaluation.points.shape == (0, 2) and plane.evaluation.probe == "probe"
    assert (plane.description, plane.sigma, plane.seed) == ("", "estimated", 1)
    assert plane.target_uncertainty is None and plane.expected_rank_deficiency is None
    assert plane.true_machine.kind == "zero"
    first, second, third = plane.positions
    assert first.readings[0].probes == ("probe",) and first.readings[0].repeats == 1
    assert second.readings[0].balls == ("r1c1",)
    np.testing.assert_array_equal(second.pose.rotation, [[0, -1], [1, 0]])
    np.testing.assert_allclose(second.pose.origin, [0.55, 0.05])
    np.testing.assert_array_equal(third.pose.origin, [0.55, 0.0])
    distances, coordinates = plane.calibration
    assert isinstance(distances, DistanceCalibration) and isinstance(
        coordinates, CoordinateCalibration
    )
    assert distances.dimensions == 2
    assert coordinates.axes == (0, 1) and coordinates.values.shape == (48, 2)
