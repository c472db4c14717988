"""Motions that the observations do not show: what they move, by other ways."""

from __future__ import annotations

from dataclasses import replace

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.studio.answers import motions
from ballplate.extensions.studio.motions import (
    Motion,
    moved_balls,
    moved_points,
    null_motions,
    weak_motions,
)
from ballplate.simulator.design.measurement import locations
from ballplate.simulator.design.state import State
from ballplate.simulator.estimation.linearisation import Linearisation, linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.geometry.motions import rotation_from_vector
from numpy.typing import NDArray


def laid_out(path: str, variant: str | None = None) -> tuple[bp.Experiment, Linearisation]:
    experiment = bp.load(path, variant)
    return experiment, linearise(lay_out(experiment))


DESIGNS = [
    ("designs/npl/6.1.1.yaml", "B"),
    ("designs/certified/deficient.yaml", None),
    ("designs/hocken_borchardt/real.yaml", "with scale"),
]


def shifted(at: Linearisation, motion: Motion, share: float) -> State:
    """The state after a share of a motion."""
    state, d = at.state, at.design.dimension
    columns = at.layout.pose_columns
    poses = share * np.where(columns >= 0, motion.shared[np.maximum(columns, 0)], 0.0)
    turned = rotation_from_vector(poses[:, d:]) @ state.rotations
    balls = state.balls + share * motion.balls
    return replace(state, balls=balls, rotations=turned, origins=state.origins + poses[:, :d])


def at_readings(at: Linearisation, motion: Motion) -> NDArray[np.float64]:
    """What the motion adds to corrected points for the readings of plates."""
    design = at.design
    readings = design.readings.select(design.plate_readings)
    scales = locations(design, at.state, readings) - design.probes.offsets[readings.probe]
    return moved_points(at, motion, scales, readings.probe)


@pytest.mark.parametrize(("path", "variant"), DESIGNS)
def test_balls_move_as_differences_of_places_say(path: str, variant: str | None) -> None:
    _, at = laid_out(path, variant)
    readings = at.design.readings.select(at.design.plate_readings)
    for motion in null_motions(at):
        ends = [locations(at.design, shifted(at, motion, 1e3 * way), readings) for way in (1, -1)]
        expected = (ends[0] - ends[1]) / 2e3
        np.testing.assert_allclose(moved_balls(at, motion, readings), expected, atol=1e-11)


def test_a_motion_has_the_size_and_the_sign_of_the_words() -> None:
    experiment, at = laid_out("designs/npl/6.1.1.yaml", "B")
    for motion, told in zip(null_motions(at), bp.check(experiment).verdict.null, strict=True):
        largest = max(np.linalg.norm(motion.balls, axis=1))
        assert told.artefacts[0].peak == pytest.approx(largest, rel=1e-9)
        part, size = told.functions[0], at.design.machine.volume.size
        assert part.name == "EXX"
        # Along X alone, at the lower corner of the other axes.
        line = np.linspace(0.0, 1.0, 401)[:, None] * [size[0], 0.0, 0.0]
        moved = moved_points(at, motion, line, np.zeros(len(line), int))[:, 0]
        assert part.peak == pytest.approx(moved[np.abs(moved).argmax()], rel=1e-3)


def test_in_a_weak_direction_balls_go_where_least_squares_take_them() -> None:
    experiment, at = laid_out("designs/certified/weak.yaml")
    motions = weak_motions(at, experiment.target_uncertainty)
    judged = bp.check(experiment).verdict.weak
    assert len(motions) == len(judged) > 0
    design = at.design
    readings = design.readings.select(design.plate_readings)
    for motion in motions:
        poses = moved_balls(at, replace(motion, balls=0.0 * motion.balls), readings)
        wanted = np.einsum(
            "mji,mj->mi", at.state.rotations[readings.position], at_readings(at, motion) - poses
        )
        free = np.setdiff1d(design.plate_balls, design.tied_balls)
        assert len(free)
        for ball in free:
            mean = wanted[readings.ball == ball].mean(axis=0)
            np.testing.assert_allclose(motion.balls[ball], mean, rtol=1e-5, atol=1e-12)


@pytest.mark.parametrize(("path", "variant"), DESIGNS)
def test_what_is_drawn_changes_distances_as_the_motion_does(path: str, variant: str | None) -> None:
    """Without the rigid motion that they have in common, and with a largest displacement of one."""
    _, at = laid_out(path, variant)
    readings = at.design.readings.select(at.design.plate_readings)
    places = locations(at.design, at.state, readings)
    for index, motion in enumerate(null_motions(at)):
        drawn = motions(at, None, index)
        assert drawn is not None
        directions = np.concatenate([*drawn["direction"].values()])
        assert np.linalg.norm(directions, axis=1).max() == pytest.approx(1.0, abs=1e-3)
        moved = moved_balls(at, motion, readings), drawn["direction"]["readings"]
        apart = np.diff(places[::7], axis=0)
        expected, rates = ((np.diff(one[::7], axis=0) * apart).sum(axis=1) for one in moved)
        scale = rates @ expected / (expected @ expected)
        np.testing.assert_allclose(rates, scale * expected, atol=3e-4)
        assert scale > 0.0 and drawn["position"].tolist() == readings.position.tolist()
