"""Poses that are held: enough of them, and no more, whatever balls and certificates there are."""

from __future__ import annotations

from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
import yaml
from ballplate.results.prediction import predict
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.observations.coordinates import CalibratedCoordinates
from ballplate.simulator.design.observations.readings import reading_blocks
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.geometry.motions import vector_from_rotation

TOP = Path(__file__).parents[2]

LAYOUTS = {
    "one ball": "[[0 mm, 0 mm, 0 mm]]",
    "two balls": "[[0 mm, 0 mm, 0 mm], [300 mm, 0 mm, 0 mm]]",
    "line": "[[0 mm, 0 mm, 0 mm], [100 mm, 0 mm, 0 mm], [300 mm, 0 mm, 0 mm]]",
    "slanting line": "[[0 mm, 0 mm, 0 mm], [100 mm, 50 mm, 20 mm], [200 mm, 100 mm, 40 mm]]",
    "triangle": "[[0 mm, 0 mm, 0 mm], [300 mm, 0 mm, 0 mm], [100 mm, 200 mm, 0 mm]]",
}
CERTIFICATES = {
    "none": "[]",
    "all": "[{kind: coordinates, balls: all, standard_uncertainty: 0.1 um}]",
    "x": "[{kind: coordinates, balls: all, standard_uncertainty: {x: 0.1 um}}]",
    "first": "[{kind: coordinates, balls: [b1], standard_uncertainty: 0.1 um}]",
}
POSES = (
    "[0 deg, 0 deg, 20 deg]",
    "[40 deg, -20 deg, 70 deg]",
    "[-10 deg, 50 deg, 10 deg]",
    "[0 deg, -50 deg, 10 deg]",
)


def experiment_file(folder: Path, layout: str, certificate: str, first: int = 0) -> Path:
    poses = [*POSES[first:], *POSES[:first]]
    places = "".join(
        f"  - {{name: p{POSES.index(pose)}, pose: {{origin: [300 mm, 400 mm, 400 mm], rotation:"
        f" {pose}}}}}\n"
        for pose in poses
    )
    path = folder / "e.yaml"
    path.write_text(
        "title: t\nmachine: {volume: [1 m, 1 m, 1 m], repeatability: 0.2 um}\nerror_model:"
        " {kind: kinematic, position_coefficients: 2, rotation_coefficients: 1}\nprobes: {down:"
        " [0 mm, 0 mm, -50 mm]}\nartefacts: {plate: {kind: balls, coordinates:"
        f" {layout}}}}}\npositions:\n{places}calibration: {certificate}\n",
        encoding="utf-8",
    )
    return path


def named(coordinates: str) -> str:
    balls = coordinates[1:-1].split("], ")
    return "{" + ", ".join(f"b{i + 1}: {ball.rstrip(']')}]" for i, ball in enumerate(balls)) + "}"


def dense(design: Design) -> np.ndarray:
    """Derivatives of readings and certificates by balls, by all six parameters of every pose, and
    by the machine.
    """
    n, k, readings = len(design.balls.places), len(design.positions.names), design.readings
    blocks = reading_blocks(design, nominal_state(design), readings, None)
    rows = np.zeros((len(readings), 3, 3 * n + 6 * k + len(design.model.parameters)))
    for i, (ball, position) in enumerate(zip(readings.ball, readings.position, strict=True)):
        rows[i, :, 3 * ball : 3 * ball + 3] = blocks.by_ball[i]
        rows[i, :, 3 * n + 6 * position : 3 * n + 6 * position + 6] = blocks.by_pose[i]
    rows[:, :, 3 * n + 6 * k :] = blocks.by_model
    known = np.zeros((len(design.of(CalibratedCoordinates)), rows.shape[2]))
    known[
        np.arange(len(known)),
        3 * design.of(CalibratedCoordinates).ball + design.of(CalibratedCoordinates).axis,
    ] = 1e7
    return np.concatenate([rows.reshape(-1, rows.shape[2]), known])


@pytest.mark.parametrize("certificate", CERTIFICATES)
@pytest.mark.parametrize("layout", LAYOUTS)
def test_what_is_held_takes_no_observation_away(
    layout: str, certificate: str, tmp_path: Path
) -> None:
    """The rank of all parameters, poses whole, is that of the free ones: nothing too much or too
    little is held.
    """
    (experiment,) = load(
        experiment_file(tmp_path, named(LAYOUTS[layout]), CERTIFICATES[certificate])
    )
    design = lay_out(experiment)
    whole = dense(design)
    poses = 3 * len(design.balls.places) + np.flatnonzero(design.positions.held)
    held = np.delete(whole, poses, axis=1)

    def rank(matrix: np.ndarray) -> int:
        values = np.linalg.svd(matrix / np.sqrt((matrix**2).sum(axis=0) + 1e-300), compute_uv=False)
        return int((values > 1e-9 * values[0]).sum())

    assert rank(held) == rank(whole)
    # The machine's own errors apart, no motion is left: what is open of the whole is a frame, or a
    # turn unseen.
    model = len(design.model.parameters)
    of_artefact = held[:, : held.shape[1] - model]
    assert rank(of_artefact) == of_artefact.shape[1]


@pytest.mark.parametrize("layout", ["two balls", "slanting line", "triangle"])
def test_the_order_of_positions_does_not_matter(layout: str, tmp_path: Path) -> None:
    found = []
    for first in (0, 2):
        path = experiment_file(tmp_path, named(LAYOUTS[layout]), CERTIFICATES["all"], first)
        found.append(predict(load(path)[0]).quantities)
    for symbol in ("U4", "U5", "U6"):
        assert found[0][symbol].average == pytest.approx(
            found[1][symbol].average, rel=1e-9, nan_ok=True
        )


@pytest.mark.parametrize("known", ["one ball", "two balls", "z of all balls"])
def test_what_is_held_stays_as_drawn(known: str) -> None:
    """Readings of a plate that lies 14 mm and half a degree beside its drawn pose: what the
    certificate leaves open of the frame is that of the first pose as drawn, and nothing else fits
    any worse.
    """
    balls: dict[str, object] = {
        "one ball": {"balls": ["r1c1"], "standard_uncertainty": "0.1 um"},
        "two balls": {"balls": ["r1c1", "r2c3"], "standard_uncertainty": "0.1 um"},
        "z of all balls": {"balls": "all", "standard_uncertainty": {"z": "0.1 um"}},
    }[known]
    sides = {"kind": "distances", "pairs": "corner sides", "standard_uncertainty": "0.1 um"}
    plate = {"kind": "grid", "balls": [3, 3], "size": ["600 mm", "600 mm"]}
    drawn = bp.quickstart().with_(
        {
            "artefacts": {"plate": plate},
            "calibration": [sides, {"kind": "coordinates", **balls}],
            "error_model.position_coefficients": 3,
            "error_model.rotation_coefficients": 3,
        }
    )
    origin, turn = ["14 mm", "13 mm", "252 mm"], ["0.3 deg", "-0.2 deg", "0.4 deg"]
    first = {
        "name": "z low",
        "artefact": "plate",
        "pose": {"origin": origin, "rotation": turn},
        "probes": ["down"],
    }
    others = yaml.safe_load((TOP / "designs" / "quickstart.yaml").read_text(encoding="utf-8"))
    lies = drawn.with_({"positions": [first, *others["positions"][1:]]})
    fit = bp.fit(drawn, bp.simulate(lies, exact=True))
    assert fit.converged
    # Of exact readings nothing is left; distances that are turned out of a plane are as long.
    assert fit.sum_of_squares < 1e-6
    design = lay_out(drawn)
    held = design.positions.held[0]
    assert held.any() and not held.all()
    state = fit.solution.state
    moved = vector_from_rotation((state.rotations[0] @ design.positions.rotations[0].T)[None])[0]
    off = np.concatenate([state.origins[0] - design.positions.origins[0], moved])
    # A step of 20 µrad after a turn of 10 mrad changes the components of both together by half their
    # product.
    assert np.abs(off[held]).max() < 1e-7
    assert np.abs(off[~held]).max() > 1e-3
