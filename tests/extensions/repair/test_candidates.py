"""Changes that are offered: each is what its words say, and all that there is room for are there."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ballplate.extensions.repair.candidates import (
    candidates,
    further_readings,
    moves,
    new_positions,
)
from ballplate.extensions.repair.changes import ChangeKind
from ballplate.extensions.repair.search import change_pool
from ballplate.extensions.repair.written import position_settings
from ballplate.simulator.experiment.model import AtMost, Experiment
from ballplate.simulator.machines import Array

from tests.extensions.repair.test_repair import design, flat_metric, loaded, plain, pool_of, small

QUARTERS = {"one quarter-turn": 1, "half a turn": 2, "three quarter-turns": 3}
AXES = {"x": [1, 2], "y": [2, 0], "z": [0, 1]}


def oblong() -> dict[str, Any]:
    """A plate with room on all sides, and a certificate of its own."""
    said = small()
    said["calibration"][0]["standard_uncertainty"] = "0.3 um + L/500000"
    said["probes"] = {name: said["probes"][name] for name in ("down", "right")}
    said["artefacts"]["plate"] |= {"balls": [4, 3], "size": ["390 mm", "220 mm"]}
    said["positions"] = [one for one in said["positions"] if one["name"] in ("z low", "x high")]
    for one in said["positions"]:
        one |= {"level": "320 mm", "corner": dict.fromkeys(one["corner"], "301.03 mm")}
    return said


@pytest.fixture
def experiment(request: pytest.FixtureRequest, tmp_path: Path) -> Experiment:
    return loaded(request.param(), tmp_path)


def of(*made: Any) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("experiment", made, indirect=True)


def balls_of(experiment: Experiment, place: Any) -> Array:
    coordinates = experiment.layouts[place.artefact].coordinates[:, : experiment.dimension]
    return coordinates @ place.pose.rotation.T + place.pose.origin


@of(oblong, flat_metric)
def test_moves_are_those_of_their_words(experiment: Experiment) -> None:
    """Half a pitch either way, or to the walls: each place once."""
    volume = experiment.machine.volume
    pitch = 1e3 * float(np.diff(experiment.layouts["plate"].coordinates[:2, 0])[0])
    for place in experiment.positions:
        found = [one for one in moves(experiment) if one.subject == f"position {place.name}"]
        # To sides, corners and levels; with turns in place or to corners.
        count = 4 + 8 + 15 if experiment.dimension == 2 else 6 + 8 + 2 + 15
        assert len(found) == len({one.words for one in found}) == count
        for one in found:
            balls, (u, v) = balls_of(experiment, place), place.pose.rotation.T[:2]
            for _ in range(next((n for words, n in QUARTERS.items() if words in one.words), 0)):
                away = balls - 0.5 * (balls.min(axis=0) + balls.max(axis=0))
                balls = balls - away + np.outer(away @ u, v) - np.outer(away @ v, u)
            after = balls_of(experiment, one.item)
            rows = after - np.array([[experiment.probes[name].offset] for name in place.probes])
            room = np.minimum(rows - volume.lower, volume.upper - rows).min(axis=(0, 1))
            for by, sign, axis in re.findall(r"([\d.]+) mm along (-?)([xyz])", one.words):
                balls[:, "xyz".index(axis)] += float(f"{sign}{by}") / 1e3
                is_half = float(by) == pytest.approx(pitch / 2)
                assert is_half or 0 <= room["xyz".index(axis)] + 1e-12 < 1e-4
            for axis, level in re.findall(r"level ([xyz]) = (-?[\d.]+) mm", one.words):
                balls[:, "xyz".index(axis)] = float(level) / 1e3
            np.testing.assert_allclose(after, balls, atol=1e-8)


@of(oblong, partial(plain, Path("designs/hurt_foss/bar-bell.yaml"), "length unknown"))
def test_new_positions_are_those_of_their_words(experiment: Experiment) -> None:
    """Of a bar 13 directions; of a plate 3 levels of 3 planes, turned or not, shifted or not."""
    volume, found = experiment.machine.volume, list(new_positions(experiment))
    assert len(found) == len({one.words for one in found})
    assert len(found) == (13 if "bar" in experiment.artefacts else 3 * 3 * 2 * 2 * 2)
    for one in found:
        place: Any = one.item
        balls = balls_of(experiment, place)
        middle = 0.5 * (balls.min(axis=0) + balls.max(axis=0) - volume.lower - volume.upper)
        if along := re.search(r"along \((.*?)\)", one.words):
            signs, ends = np.array(along[1].split(","), float), balls[1] - balls[0]
            np.testing.assert_allclose(middle, 0.0, atol=1e-5)
            np.testing.assert_allclose(ends / np.linalg.norm(ends), signs / np.linalg.norm(signs))
            sizes = [*np.linalg.svd(place.pose.rotation)[1], np.linalg.det(place.pose.rotation)]
            np.testing.assert_allclose(sizes, 1.0, rtol=1e-12)
            continue
        assert one.words.endswith(f" {' and '.join(place.probes)}")
        told = re.search(r"in plane ([xyz]) at ([\d.]+) mm", one.words)
        shift = re.search(r"shifted by ([\d.]+) mm along both", one.words)
        assert told and float(told[2]) in (250, 500, 750) and (not shift or shift[1] == "65")
        np.testing.assert_allclose(balls[:, "xyz".index(told[1])], float(told[2]) / 1e3)
        np.testing.assert_allclose(middle[AXES[told[1]]], 0.065 * bool(shift), atol=1e-9)
        axis = AXES[told[1]]["turned by 90 deg" in one.words]
        assert place.pose.rotation[axis, 0] == pytest.approx(1.0)
        of_plane = ("right",) if told[1] == "x" else ("down",)
        assert place.probes in (of_plane, ("down", "right"))


@pytest.mark.parametrize("aside, is_offered", [(5.0, False), (9.0, True)])
def test_a_new_probe_is_off_the_others_by_a_tenth_of_its_length(
    aside: float, is_offered: bool, tmp_path: Path
) -> None:
    said = oblong() | {"probes": {"down": [f"{aside} mm", "0 mm", "-60 mm"]}}
    for one in said["positions"]:
        one["probes"] = ["down"]
    found = further_readings(loaded(said, tmp_path))
    assert ("minus z" in {one.probe.name for one in found if one.probe}) == is_offered


def test_poses_are_written_as_in_the_file() -> None:
    """None with an angle of minus zero."""
    stated = plain(Path("designs/hurt_foss/bar-bell.yaml"), "length known")["positions"]
    experiment = design("hurt_foss/bar-bell", "length known")
    for one, place in zip(stated, experiment.positions, strict=True):
        assert position_settings(experiment, place).get("pose", one["pose"]) == one["pose"]


def test_no_position_is_moved_into_a_forbidden_box() -> None:
    experiment = design("npl/6.1.1", "B")
    free = candidates(replace(experiment, pool=pool_of(experiment, [1.0] * 3)))
    box = np.array([[[0.0, 0.0, 0.15], [1.0, 1.0, 1.0]]])
    pool = pool_of(experiment, [1.0] * 3, (), box)
    bounded = candidates(replace(experiment, pool=pool))
    moves = [one.item for one in bounded if one.kind is ChangeKind.MOVE]
    assert moves and len(moves) < sum(one.kind is ChangeKind.MOVE for one in free)
    assert all(balls_of(experiment, one)[:, 2].max() <= 0.15 + 1e-9 for one in moves)


@pytest.mark.parametrize("count, sets", [(1, "4"), (2, "4 5 6 45 46"), (3, "4 5 6 45 46 56")])
def test_limits_of_a_pool_count_what_is_drawn(count: int, sets: str) -> None:
    """Position 2 is drawn, and 4, 5 and 6 are offered; so many of 2, 5 and 6 are permitted."""
    experiment = design("npl/6.1.1", "B")
    pool = pool_of(experiment, [1.0] * 3, (AtMost((2, 5, 6), count),))
    experiment = replace(experiment, pool=pool)
    every = candidates(experiment)
    searched = change_pool(experiment, every)
    assert searched is not None
    found = set()
    for k, one in enumerate(every):
        if one.candidate >= 0:
            others = [every[i].candidate for i in searched.problem.constraints.additions((k,))]
            found |= {f"{one.candidate}{i}" for i in others if i > one.candidate}
            found.add(str(one.candidate))
    assert found == {*sets.split()}
