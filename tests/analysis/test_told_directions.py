"""Which parts of an undetermined direction are told, of what size and in what order: against what
each parameter moves.
"""

from __future__ import annotations

import itertools
import re
from dataclasses import replace
from functools import cache

import ballplate as bp
import numpy as np
import pytest
import yaml
from ballplate.rank.directions import Direction, FunctionPart, PositionPart, in_words
from ballplate.rank.verdicts import null_changes, null_directions
from ballplate.simulator.estimation.linearisation import Linearisation, linearise
from ballplate.simulator.experiment.layout import lay_out
from numpy.typing import NDArray

from tests.analysis import wording

Real = NDArray[np.float64]

# A small plate in a large volume, a bar of unknown length, and a probe of which little is known.
DESIGN = """\
title: parts of directions
machine: {volume: [2 m, 1.5 m, 1 m], repeatability: 0.2 um}
error_model: {kind: metric}
probes:
  down: [0 mm, 0 mm, -50 mm]
  side: {offset: [80 mm, 0 mm, 0 mm], standard_uncertainty: 50 um}
artefacts:
  plate: {kind: grid, balls: [3, 3], size: [60 mm, 40 mm]}
  bar: {kind: two_spheres, length: 500 mm, role: length_standard}
positions:
  - {name: a, artefact: plate, plane: z, level: 500 mm, corner: {x: 0 mm, y: 0 mm}, probes: [down]}
  - {name: b, artefact: plate, plane: z, level: 500 mm, corner: {x: 1 m, y: 1 m}, quarter_turns: 1, probes: [down]}
  - {name: c, artefact: plate, plane: x, level: 500 mm, corner: {y: 0 mm, z: 300 mm}, probes: [side]}
  - {name: d, artefact: plate, plane: y, level: 500 mm, corner: {x: 300 mm, z: 0 mm}, probes: [down]}
  - {name: along, artefact: bar, pose: {origin: [200 mm, 200 mm, 100 mm]}, probes: [down]}
evaluation: {points: {random: 20}}
"""


@cache
def drawn() -> Linearisation:
    return linearise(lay_out(bp.experiment(yaml.safe_load(DESIGN))))


def effects(at: Linearisation) -> Real:
    """By how much (s,) a unit of each shared parameter moves some point at the most, along an axis:
    the far ball of a plate, the far corner of the volume, the tip of a probe, the end of a bar.
    """
    design, layout = at.design, at.layout
    found = np.ones(len(layout))
    for position, columns in enumerate(layout.pose_columns):
        own = design.balls.places[design.balls.artefact == design.positions.artefact[position]]
        turns = columns[design.dimension :]
        found[turns[turns >= 0]] = np.ptp(own, axis=0).max()
    corners = np.array(list(itertools.product(*zip(*design.machine.volume.corners, strict=True))))
    step, still = 1e-6, np.zeros_like(corners)
    for k, one in enumerate(np.eye(len(design.model.parameters)) * step):
        ends = [design.model.error(corners, sign * one, still) for sign in (1.0, -1.0)]
        found[layout.model.start + k] = np.abs(ends[0] - ends[1]).max() / (2.0 * step)
    return found


def with_null(at: Linearisation, shared: Real, balls: Real) -> Linearisation:
    """The same, where the one undetermined direction is another."""
    spectrum = at.spectrum
    assert spectrum.deficiency == 1
    directions = np.concatenate([spectrum.directions[:, :-1], shared[:, None]], axis=1)
    other = replace(at, spectrum=replace(spectrum, known=directions, triangle=None))
    vars(other)["balls"] = replace(at.balls, null=balls[:, :, None])
    return other


def at_random(seed: int) -> tuple[Linearisation, Real, Real]:
    """A direction whose parts move points by amounts of very different size, and what of it each
    shared parameter and each ball moves, the largest by one.
    """
    at, draw = drawn(), np.random.default_rng(seed)
    moved = [
        draw.choice([-1.0, 1.0], shape) * 10.0 ** draw.uniform(-4.0, 0.0, shape)
        for shape in (len(at.layout), at.design.balls.places.shape)
    ]
    # Only balls of plates have places to be found.
    moved[1] *= (
        draw.choice([1.0, 1e-2, 1e-4])
        * at.design.artefacts.is_plate[at.design.balls.artefact][:, None]
    )
    # What is mere rounding beside the largest.
    moved[0][draw.random(len(moved[0])) < 0.1] *= 1e-10
    moved[1][draw.random(len(moved[1])) < 0.1] *= 1e-10
    largest = max(float(np.abs(one).max()) for one in moved)
    shared, balls = moved[0] / largest, moved[1] / largest
    return with_null(at, 3e-4 * shared / effects(at), 3e-4 * balls), shared, balls


@pytest.mark.parametrize("seed", range(12))
def test_a_direction_moves_points_by_a_micrometre_at_the_most(seed: int) -> None:
    """And what is a billionth of that is nothing."""
    other, shared, balls = at_random(seed)
    ((found, moved),) = null_changes(other)
    first = np.abs(shared).argmax()
    sign = np.sign(found[first] * shared[first])
    for part, expected in ((found * effects(other), shared), (moved, balls)):
        without_rounding = np.where(np.abs(expected) > 1e-9, expected, 0.0)
        np.testing.assert_allclose(part, sign * 1e-6 * without_rounding, rtol=1e-8)


@pytest.mark.parametrize("seed", range(12))
def test_what_moves_points_by_a_hundredth_of_the_largest_is_told(seed: int) -> None:
    other, shared, balls = at_random(seed)
    design, layout = other.design, other.layout
    ((change, _),), (told,) = null_changes(other), null_directions(other)
    columns = np.where(layout.pose_columns >= 0, layout.pose_columns, len(layout))
    of_poses = np.append(np.abs(shared), 0.0)[columns].max(axis=1)
    amounts = np.append(change, 0.0)[columns]
    assert [(part.name, part.shift, part.turn) for part in told.positions] == [
        (name, pytest.approx(np.linalg.norm(own[:3])), pytest.approx(np.linalg.norm(own[3:])))
        for name, size, own in zip(design.positions.names, of_poses, amounts, strict=True)
        if size > 0.01
    ]
    # Errors among what is shared, the largest first, and with a sign that makes it positive.
    size, own = np.abs(shared[layout.model]), change[layout.model]
    order = [k for k in np.argsort(-size) if size[k] > 0.01 * np.abs(shared).max()]
    assert [(part.name, part.peak, part.unit) for part in told.functions] == [
        (one.function, pytest.approx(own[k]), one.unit)
        for k, one in zip(order, [design.model.parameters[k] for k in order], strict=True)
    ]
    assert not order or told.functions[0].peak > 0.0
    peak = float(np.linalg.norm(balls, axis=1).max())
    assert [part.name for part in told.artefacts] == (["plate"] if peak > 0.01 else [])
    assert [part.peak for part in told.artefacts] == pytest.approx([1e-6 * peak] * (peak > 0.01))
    tip = shared[layout.offset_columns[1]]
    assert [part.name for part in told.probes] == ["side"] * bool(np.abs(tip).max() > 0.01)
    assert [part.shift for part in told.probes] == pytest.approx(
        [1e-6 * np.linalg.norm(tip)] * bool(np.abs(tip).max() > 0.01)
    )
    (length,) = shared[layout.lengths]
    assert [abs(part.change) for part in told.lengths] == pytest.approx(
        [1e-6 * abs(length)] * bool(abs(length) > 0.01)
    )


@pytest.mark.parametrize("count", [1, 6, 7, 8, 9, 14])
def test_of_many_parts_the_first_are_told_and_the_others_counted(count: int) -> None:
    functions = tuple(FunctionPart(f"F{k}", "meaning", 1e-6, "m", "") for k in range(count))
    positions = tuple(PositionPart(f"P{k}", 1e-6 * (k + 1), 0.0) for k in range(count))
    words = in_words(Direction(functions, (), positions))
    errors, moved = words.split("; moved positions: ")
    assert re.findall(r"F(\d+) ", errors) == [str(k) for k in range(min(count, 8))]
    assert re.findall(r"(\d+) further errors?", errors) == [str(count - 8)] * (count > 8)
    assert re.findall(r"P(\d+) \((\d+) µm\)", moved) == [
        (str(k), str(k + 1)) for k in range(min(count, 6))
    ]
    assert re.findall(r"and (\d+) more", moved) == [str(count - 6)] * (count > 6)
    assert words.endswith(wording.CHANGE_TOGETHER_WITHOUT_CHANGING_ANY_OBSERVATION)
