"""Changes that are offered: each is what its words say, and all that there is room for are there."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from itertools import combinations, product
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
from ballplate.extensions.repair.certificates import certificates
from ballplate.extensions.repair.changes import Change, ChangeKind, changed
from ballplate.extensions.repair.search import change_pool
from ballplate.extensions.repair.written import edits
from ballplate.simulator.experiment.model import AtMost, Experiment, Position
from ballplate.simulator.machines import Array

from tests.extensions.repair.test_repair import (
    design,
    flat_metric,
    loaded,
    plain,
    pool_of,
    small,
    written_out,
)

QUARTERS = {"one quarter-turn": 1, "half a turn": 2, "three quarter-turns": 3}
TIPS = {name: 0.05 * tip for name, tip in zip("xyz", np.eye(3), strict=True)}
TIPS |= {f"minus {name}": -tip for name, tip in TIPS.items()}
AXES = {"x": [1, 2], "y": [2, 0], "z": [0, 1]}


def bars() -> dict[str, Any]:
    return plain(Path("designs/hurt_foss/bar-bell.yaml"), "length unknown")


def oblong() -> dict[str, Any]:
    """A plate with room on all sides in two planes, and a certificate of its sides."""
    said = small()
    said["calibration"][0]["standard_uncertainty"] = "0.3 um + L/500000"
    said["probes"] = {name: said["probes"][name] for name in ("down", "right")}
    said["artefacts"]["plate"] |= {"balls": [4, 3], "size": ["390 mm", "220 mm"]}
    said["positions"] = [one for one in said["positions"] if one["name"] in ("z low", "x high")]
    for one in said["positions"]:
        one |= {"level": "320 mm", "corner": dict.fromkeys(one["corner"], "301.03 mm")}
    probes = said["positions"][0].pop("probes")
    said["positions"][0]["readings"] = [
        {"balls": ["r1c1", "r3c4"], "probes": probes, "repeats": 2},
        {"balls": ["r2c2"], "probes": probes, "repeats": 3, "standard_uncertainty": "0.5 um"},
    ]
    return said


def one_tip() -> dict[str, Any]:
    said = oblong() | {"probes": {"down": ["0 mm", "0 mm", "-50 mm"]}, "calibration": []}
    said["positions"][1]["probes"] = ["down"]
    return said


@pytest.fixture
def experiment(request: pytest.FixtureRequest, tmp_path: Path) -> Experiment:
    return loaded(request.param(), tmp_path)


def of(*made: Any) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("experiment", made, indirect=True)


def balls_of(experiment: Experiment, place: Any) -> Array:
    coordinates = experiment.layouts[place.artefact].coordinates[:, : experiment.dimension]
    return coordinates @ place.pose.rotation.T + place.pose.origin


def rows_of(place: Any) -> Counter[tuple[int, str]]:
    """How often each ball of a position is read with each probe."""
    rows: Counter[tuple[int, str]] = Counter()
    for group in place.readings:
        for ball, probe in product(group.ball_indices.tolist(), group.probes):
            rows[ball, probe] += group.repeats
    return rows


def readings_of(experiment: Experiment, place: Any) -> Array:
    balls = balls_of(experiment, place)
    return np.array([balls[k] - experiment.probes[name].offset for k, name in rows_of(place)])


@of(oblong, one_tip, flat_metric)
def test_moves_are_those_of_their_words(experiment: Experiment) -> None:
    """Half a pitch either way, or to the walls: each place once."""
    volume = experiment.machine.volume
    pitch = 1e3 * float(np.diff(experiment.layouts["plate"].coordinates[:2, 0])[0])
    for place in experiment.positions:
        found = [one for one in moves(experiment) if one.subject == f"position {place.name}"]
        assert len(found) == len({one.words for one in found})
        # To sides, corners and levels; with turns in place or to corners.
        assert len(found) == {2: 4 + 8 + 15, 3: 6 + 8 + 2 + 15}[experiment.dimension]
        for one in found:
            balls, (u, v) = balls_of(experiment, place), place.pose.rotation.T[:2]
            turn = re.search(f"by ({'|'.join(QUARTERS)})", one.words)
            for _ in range(QUARTERS[turn[1]] if turn else 0):
                middle = 0.5 * (balls.min(axis=0) + balls.max(axis=0))
                away = balls - middle
                balls = middle + np.outer(away @ u, v) - np.outer(away @ v, u)
            rows = readings_of(experiment, one.item)
            room = np.minimum(rows.min(axis=0) - volume.lower, volume.upper - rows.max(axis=0))
            for by, sign, axis in re.findall(r"([\d.]+) mm along (-?)([xyz])", one.words):
                balls[:, "xyz".index(axis)] += float(f"{sign}{by}") / 1e3
                is_half = float(by) == pytest.approx(pitch / 2)
                assert is_half or 0 <= room["xyz".index(axis)] + 1e-12 < 1e-4
            for axis, level in re.findall(r"level ([xyz]) = (-?[\d.]+) mm", one.words):
                balls[:, "xyz".index(axis)] = float(level) / 1e3
            np.testing.assert_allclose(balls_of(experiment, one.item), balls, atol=1e-8)


@of(oblong, one_tip, bars)
def test_new_positions_are_those_of_their_words(experiment: Experiment) -> None:
    """Bars along half the directions to the 26 neighbours of a cube; plates at three levels of
    three planes, turned or not, shifted or not, with probes that suit the plane, or with all.
    """
    volume, found = experiment.machine.volume, list(new_positions(experiment))
    of_plane = {one.item.name: one.item.readings[0].probes for one in reversed(found)}  # type: ignore[union-attr]
    shared = [tuple(experiment.probes) == probes for probes in of_plane.values()]
    is_plate = "plate" in experiment.artefacts
    assert len(found) == (12 * sum(2 - one for one in shared) if is_plate else 13)
    assert len({one.words for one in found}) == len(found)
    for one in found:
        place: Any = one.item
        balls = balls_of(experiment, place)
        if len(experiment.probes) > 1:
            assert one.words.endswith(f" {' and '.join(place.readings[0].probes)}")
        middle = 0.5 * (balls.min(axis=0) + balls.max(axis=0) - volume.lower - volume.upper)
        if along := re.search(r"along \((.*?)\)", one.words):
            signs, ends = np.array(along[1].split(","), float), balls[1] - balls[0]
            np.testing.assert_allclose(middle, 0.0, atol=1e-5)
            np.testing.assert_allclose(ends / np.linalg.norm(ends), signs / np.linalg.norm(signs))
            continue
        told = re.search(r"in plane ([xyz]) at ([\d.]+) mm", one.words)
        shift = re.search(r"shifted by ([\d.]+) mm along both", one.words)
        assert told and 4e-3 * float(told[2]) in (1.0, 2.0, 3.0)
        np.testing.assert_allclose(balls[:, "xyz".index(told[1])], float(told[2]) / 1e3)
        axes, by = AXES[told[1]], float(shift[1]) / 1e3 if shift else 0.0
        np.testing.assert_allclose(middle[axes], by, atol=1e-9)
        assert by in (0.0, 0.065)
        is_turned = "turned by 90 deg" in one.words
        assert place.pose.rotation[axes[is_turned], 0] == pytest.approx(1.0)
        if experiment.probes.keys() == {"down", "right"}:
            assert of_plane[place.name] == {"z": ("down",), "x": ("right",)}.get(told[1], ("down",))


@of(one_tip, oblong, bars)
def test_further_readings_are_those_of_their_words(experiment: Experiment) -> None:
    """Of a plate with every other probe, and with tips opposite and across where all are in line."""
    for place in experiment.positions:
        before, names = rows_of(place), []
        first, *others = (
            one for one in further_readings(experiment) if one.subject.endswith(place.name)
        )
        assert rows_of(first.item) == before + before
        for one in others:
            (name,) = map(
                "".join, re.findall(r"with (?:probe (.*) too|.* too, (.*?), )", one.words)
            )
            more = rows_of(one.item) - before
            assert more == {(ball, name): min(before.values()) for ball, _ in before}
            names.append(name)
            if one.probe is not None:
                told = re.search(r"offset \((.*)\) mm", one.words)
                assert told and told[1].split(", ") == [f"{1e3 * v:g}" for v in one.probe.offset]
                np.testing.assert_array_equal(one.probe.offset, TIPS[name])
        tips = np.array([probe.offset for probe in experiment.probes.values()])
        new = [name for name in TIPS if np.abs(tips - TIPS[name]).max(axis=1).min() > 0.01]
        has_plate = "plate" in experiment.artefacts
        assert names == [*({*experiment.probes} - {*place.probes}), *new] * has_plate


@of(oblong, one_tip, flat_metric, bars)
def test_changes_are_written_as_they_are_and_take_what_they_say(
    experiment: Experiment, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    """Twenty minutes of set-up, 15 s for a reading, two minutes for a change of probes."""

    def seconds(one: Experiment) -> float:
        rows = [rows_of(place) for place in one.positions]
        probes = [len({name for _, name in each}) - 1 for each in rows]
        return 1200 * len(rows) + 15 * sum(sum(each.values()) for each in rows) + 120 * sum(probes)

    by_subject: dict[str, list[Change]] = {}
    for change in candidates(experiment):
        by_subject.setdefault(change.subject, []).append(change)
    for k in (0, 8, -1):
        chosen = [some[k] for some in by_subject.values() if k < len(some)]
        after = changed(experiment, chosen)
        more = sum(change.seconds for change in chosen)
        assert more == pytest.approx(seconds(after) - seconds(experiment))
        said = request.node.callspec.params["experiment"]()
        read = written_out(said, edits(experiment, after), tmp_path)
        assert read.probes.keys() == after.probes.keys()
        for one, other in zip(read.positions, after.positions, strict=True):
            assert (one.name, rows_of(one)) == (other.name, rows_of(other))
            # Angles are written to twelve digits.
            balls = balls_of(after, other)
            np.testing.assert_allclose(balls_of(read, one), balls, rtol=0, atol=1e-12)
            for group, same in zip(one.readings, other.readings, strict=True):
                assert np.array_equal(group.standard_uncertainty, same.standard_uncertainty)
        added: Any = after.calibration[len(experiment.calibration) :]
        new = sum(np.size(item.values) for item in added)
        # A tip that is to be made counts as one.
        new += sum(change.probe is not None for change in chosen)
        assert sum(change.values for change in chosen) == new
        for was, item in zip(read.calibration, after.calibration, strict=True):
            pairs = zip(
                vars(was.observed(0)).values(), vars(item.observed(0)).values(), strict=True
            )
            for found, expected in pairs:
                np.testing.assert_allclose(found, expected, rtol=1e-12)


@of(oblong, one_tip, flat_metric)
def test_certificates_are_of_what_is_not_calibrated(experiment: Experiment) -> None:
    """Singly the distances of corners and the ten longest; as uncertain as what is calibrated
    already, or else as the best readings.
    """
    names, balls = experiment.layouts["plate"].names, experiment.layouts["plate"].coordinates
    columns, last = int(names[-1][-1]), len(names) - 1
    lengths = {
        pair: float(np.linalg.norm(balls[pair[0]] - balls[pair[1]]))
        for pair in combinations(range(len(balls)), 2)
    }
    corners = {*combinations((0, columns - 1, last - columns + 1, last), 2)}
    sets = {"two diagonals": {pair for pair in corners if sum(pair) == last}}
    sets["four sides"] = corners - sets["two diagonals"]
    sets["distances between neighbours"] = {
        (i, j)
        for i, j in lengths
        if j == i + columns or j == i + 1 and i // columns == j // columns
    }
    longest = sorted(lengths, key=lambda pair: (-round(lengths[pair], 9), pair))[:10]
    singles, found, u, text = {*longest, *corners}, set(), np.array([0.2e-6, 0.0]), "0.2 µm"
    if experiment.calibration:
        singles -= sets.pop("four sides")
        u, text = np.array([0.3e-6, 2e-6]), "0.3 µm + L/500000"
    for one in certificates(experiment):
        item: Any = one.item
        if item.kind == "coordinates":
            which = "corner " * (len(item.balls) == 4)
            assert one.words.endswith(f" {len(item.balls)} {which}balls of plate to {text[:6]}")
            np.testing.assert_allclose(item.standard_uncertainties, u[0])
            continue
        pairs = {(min(pair), max(pair)) for pair in item.pairs.tolist()}
        values = np.array([lengths[min(pair), max(pair)] for pair in item.pairs.tolist()])
        np.testing.assert_allclose(item.values, values)
        np.testing.assert_allclose(item.standard_uncertainties, u[0] + u[1] * values)
        told = re.fullmatch(f"calibrate the (.*) of plate( [(]{len(pairs)}[)])? to (.*)", one.words)
        assert told and told[3] == text
        if told[2] is None:
            assert told[1] in {f"distance {names[i]}-{names[j]}" for i, j in [*pairs]}
            found |= pairs
        else:
            assert pairs == sets.pop(told[1], pairs)
    assert found == singles and not sets


def test_no_position_is_moved_into_a_forbidden_box() -> None:
    experiment = design("npl/6.1.1", "B")
    free = candidates(replace(experiment, pool=pool_of(experiment, [1.0] * 3)))
    box = np.array([[[0.0, 0.0, 0.15], [1.0, 1.0, 1.0]]])
    pool = pool_of(experiment, [1.0] * 3, (), box)
    bounded = candidates(replace(experiment, pool=pool))
    moves = [one.item for one in bounded if one.kind is ChangeKind.MOVE]
    assert moves and len(moves) < sum(one.kind is ChangeKind.MOVE for one in free)
    for one in moves:
        assert isinstance(one, Position)
        balls = experiment.layouts["plate"].coordinates @ one.pose.rotation.T + one.pose.origin
        assert balls[:, 2].max() <= 0.15 + 1e-9


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
