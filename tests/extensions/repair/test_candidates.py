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


@of(oblong, flat_metric)
def test_moves_are_those_of_their_words(experiment: Experiment) -> None:
    """Half a pitch either way, or to the walls: each place once."""
    volume = experiment.machine.volume
    pitch = 1e3 * float(np.diff(experiment.layouts["plate"].coordinates[:2, 0])[0])
    for place in experiment.positions:
        found = [one for one in moves(experiment) if one.subject == f"position {place.name}"]
        # To sides, corners and levels; with turns in place or to corners.
        count = {2: 4 + 8 + 15, 3: 6 + 8 + 2 + 15}[experiment.dimension]
        assert len(found) == len({one.words for one in found}) == count
        for one in found:
            balls, (u, v) = balls_of(experiment, place), place.pose.rotation.T[:2]
            for _ in range(next((n for words, n in QUARTERS.items() if words in one.words), 0)):
                away = balls - 0.5 * (balls.min(axis=0) + balls.max(axis=0))
                balls = balls - away + np.outer(away @ u, v) - np.outer(away @ v, u)
            after = balls_of(experiment, one.item)
            rows = [after[k] - experiment.probes[name].offset for k, name in rows_of(one.item)]
            room = np.minimum(
                np.min(rows, axis=0) - volume.lower, volume.upper - np.max(rows, axis=0)
            )
            for by, sign, axis in re.findall(r"([\d.]+) mm along (-?)([xyz])", one.words):
                balls[:, "xyz".index(axis)] += float(f"{sign}{by}") / 1e3
                is_half = float(by) == pytest.approx(pitch / 2)
                assert is_half or 0 <= room["xyz".index(axis)] + 1e-12 < 1e-4
            for axis, level in re.findall(r"level ([xyz]) = (-?[\d.]+) mm", one.words):
                balls[:, "xyz".index(axis)] = float(level) / 1e3
            np.testing.assert_allclose(after, balls, atol=1e-8)


@of(oblong, bars)
def test_new_positions_are_those_of_their_words(experiment: Experiment) -> None:
    """Bars along half the directions to the 26 neighbours of a cube; plates at three levels of
    three planes, turned or not, shifted or not, with probes that suit the plane, and with all.
    """
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


@of(oblong, bars)
def test_further_readings_are_those_of_their_words(experiment: Experiment) -> None:
    """Of a plate with every other probe, and with tips opposite and across where all are in line."""
    for place in experiment.positions:
        before = rows_of(place)
        first, *others = (
            one for one in further_readings(experiment) if one.subject.endswith(place.name)
        )
        assert rows_of(first.item) == before + before
        names = ["minus z" if place.probes == ("right",) else "x", "y", "z", "minus x", "minus y"]
        assert len(others) == len(names) * ("plate" in experiment.artefacts)
        for one, name in zip(others, names, strict=False):
            offset = TIPS[name]
            if one.probe is None:
                name = "down" if name == "minus z" else "right"
            else:
                words = ", ".join(f"{v:g}" for v in 1e3 * offset + 0.0)
                assert f"a new probe too, {name}, its offset ({words}) mm" in one.words
                np.testing.assert_array_equal(one.probe.offset, offset)
            assert f"probe {name} too" in one.words or one.probe
            more = rows_of(one.item) - before
            assert more == {(ball, name): min(before.values()) for ball, _ in before}


@of(oblong, flat_metric, bars)
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
        # A tip that is to be made counts as one.
        new = sum(change.probe is not None for change in chosen)
        assert sum(one.values for one in chosen) == new + sum(np.size(one.values) for one in added)
        for was, item in zip(read.calibration, after.calibration, strict=True):
            for key, value in vars(item.observed(0)).items():
                np.testing.assert_allclose(vars(was.observed(0))[key], value, rtol=1e-12)


@of(oblong, flat_metric)
def test_certificates_are_of_what_is_not_calibrated(experiment: Experiment) -> None:
    """Singly the distances of corners and the ten longest; as uncertain as what is calibrated
    already, or else as the best readings.
    """
    layout = experiment.layouts["plate"]
    lengths = {
        (i, j): float(np.linalg.norm(layout.coordinates[i] - layout.coordinates[j]))
        for i, j in combinations(range(len(layout.names)), 2)
    }
    singles = {*sorted(lengths, key=lambda pair: (-round(lengths[pair], 9), pair))[:10]}
    singles |= {*combinations(sorted(layout.corner_set), 2)}
    u, slope, text = 0.2e-6, 0.0, "0.2 µm"
    for item in experiment.calibration:
        singles -= {(min(pair), max(pair)) for pair in item.pairs.tolist()}  # type: ignore[attr-defined]
        u, slope, text = 0.3e-6, 2e-6, "0.3 µm + L/500000"
    for one in certificates(experiment):
        new: Any = one.item
        if new.kind == "coordinates":
            assert {*new.standard_uncertainties} == {u}
            continue
        values = np.array([lengths[min(pair), max(pair)] for pair in new.pairs.tolist()])
        np.testing.assert_allclose(new.values, values)
        np.testing.assert_allclose(new.standard_uncertainties, u + slope * values)
        told = f"({len(values)}) to {text}"
        if len(values) == 1:
            i, j = new.pairs[0]
            told = f"distance {layout.names[i]}-{layout.names[j]} of plate to {text}"
            singles.remove((min(i, j), max(i, j)))
        assert one.words.endswith(told)
    assert not singles


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
