"""Places stated as parts of the free room: against hand-made lengths, and against the lengths that
the loader accepts.
"""

from __future__ import annotations

import contextlib
import json
import re
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.simulator.design import objects
from ballplate.simulator.experiment import bounds
from ballplate.simulator.experiment.json_schema import schema
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment, Position
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.inputs.quantities import QuantityError
from ballplate.simulator.inputs.quantity_types import parse_place
from ballplate.simulator.inputs.yamltree import to_list

from tests.experiment import wording

HEAD = """\
title: places
machine: {volume: {x: [-200 mm, 1 m], y: [0 mm, 900 mm], z: [100 mm, 800 mm]}, repeatability: 1 um}
error_model: {kind: kinematic}
probes: {down: [0 mm, 0 mm, -80 mm], left: [-70 mm, 10 mm, 5 mm], right: [60 mm, 0 mm, -5 mm]}
artefacts:
  plate: {kind: grid, balls: [4, 3], size: [430 mm, 310 mm]}
  bar: {kind: two_spheres, length: 240 mm, role: length_standard}
  odd: {kind: balls, coordinates: {a: [5 mm, 7 mm, 1 mm], b: [99 mm, 20 mm, 40 mm], c: [30 mm, 120 mm, 3 mm]}}
"""
PLATE = "{name: q, artefact: plate, plane: x, level: 100 mm, corner: {y: 20 mm, z: 120 mm}, probes: [down]}"
REST = """\
  - {name: o, artefact: odd, plane: z, level: 400 mm, corner: {x: 99 mm, y: 99 mm}, probes: [down]}
  - {name: b, artefact: bar, pose: {origin: [300 mm, 300 mm, 300 mm]}, probes: [down]}
"""
POOL = "pool: {limits: {edge: 13 mm, reach: {left: {x: [-150 mm, 850 mm], z: [150 mm, 790 mm]}}}}\n"

# A position in which X, Y and Z stand for the places along the axes, and the end of the file.
TURNED = "plane: {}, level: {}, {}: {{{}}}, quarter_turns: {}"
PLACED = [
    (TURNED.format("x", "X", "corner", "y: Y, z: Z", 0) + ", probes: [down]", ""),
    (TURNED.format("x", "X", "corner", "y: Y, z: Z", 1) + ", probes: [left, right]", POOL),
    (TURNED.format("y", "Y", "centre", "x: X, z: Z", 3) + ", probes: [right, down]", ""),
    (TURNED.format("z", "Z", "corner", "x: X, y: Y", 2) + ", probes: [left, down, right]", POOL),
    (
        TURNED.format("z", "Z", "corner", "x: X, y: Y", 1)
        + ", readings: [{probes: [down], balls: [r1c1]}, {probes: [left], balls: [r2c3, r3c4]}]",
        "",
    ),
    ("pose: {origin: [X, Y, Z], rotation: [20 deg, -35 deg, 50 deg]}, probes: [left, right]", POOL),
    ("pose: {origin: [X, Y, Z], rotation: [0 deg, 90 deg, 0 deg]}, probes: [down]", POOL),
]
CASES = [
    *((f"{{name: p, artefact: plate, {text}}}", end) for text, end in PLACED),
    (
        "{name: b, artefact: bar, pose: {origin: [X, Y, Z], rotation: [0 deg, 30 deg, 45 deg]}, probes: [left]}",
        POOL,
    ),
    (
        "{name: o, artefact: odd, plane: y, level: Y, centre: {x: X, z: Z}, quarter_turns: 1, probes: [left, down]}",
        "",
    ),
]


def loaded(folder: Path, position: str, end: str, planning: bool = False) -> Experiment:
    """Load an experiment with a position, and others so that every artefact has one."""
    others = [*REST.splitlines(), f"  - {PLATE}"]
    artefact = position.split("artefact")[1].lstrip('": ').split(",")[0].rstrip('"')
    is_single = artefact == "plate" and "balls" not in position
    kept = [f"  - {position}", *(line for line in others if f"artefact: {artefact}," not in line)]
    kept += [] if is_single else [f"  - {PLATE}"] * (artefact == "plate")
    path = folder / "e.yaml"
    path.write_text(HEAD + "positions:\n" + "\n".join(kept) + f"\n{end}", encoding="utf-8")
    (experiment,) = load(path, planning=planning)
    return experiment


def at(position: str, places: dict[str, str]) -> str:
    for axis, place in places.items():
        position = position.replace(axis.upper(), place)
    return position


def placed(experiment: Experiment) -> Position:
    return experiment.positions[0]


def accepts(folder: Path, position: str, end: str) -> bool:
    try:
        loaded(folder, position, end)
    except ExperimentError:
        return False
    return True


@pytest.fixture
def without_play(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the loader accept no scale readings outside the volume but for rounding."""
    for module in (objects, bounds):
        monkeypatch.setattr(module, "SLIGHTLY", 1e-9)


@pytest.mark.usefixtures("without_play")
@pytest.mark.parametrize(("position", "end"), CASES)
def test_ends_of_the_room_are_the_last_lengths_that_are_accepted(
    position: str, end: str, tmp_path: Path
) -> None:
    middle = placed(loaded(tmp_path, at(position, dict.fromkeys("xyz", "middle")), end))
    for axis in "xyz":
        others = {name: f"{value!r} m" for name, value in middle.parts.items() if name != axis}
        for word, outwards in (("low", -5e-8), ("high", 5e-8)):
            found = placed(loaded(tmp_path, at(position, {**others, axis: word}), end)).parts[axis]
            for beyond in (-outwards, outwards):
                beside = at(position, {**others, axis: f"{found + beyond!r} m"})
                assert accepts(tmp_path, beside, end) == (beyond != outwards), (axis, word)


@pytest.mark.parametrize(("position", "end"), CASES)
def test_parts_are_the_lengths_between_the_ends(position: str, end: str, tmp_path: Path) -> None:
    def origin(words: str) -> np.ndarray:
        places = dict(zip("xyz", words.split(", "), strict=True))
        return placed(loaded(tmp_path, at(position, places), end)).pose.origin

    low, high = origin("low, low, low"), origin("high, high, high")
    assert (high > low).all()
    np.testing.assert_allclose(origin("middle, 50 %, 1/2"), (low + high) / 2, atol=2e-12)
    mixed = low + [0.3, 2 / 9, 1.0] * (high - low)
    np.testing.assert_allclose(origin("30 %, 2/9, high"), mixed, atol=2e-12)
    # As lengths, the same place.
    by_part = placed(loaded(tmp_path, at(position, dict(x="30 %", y="2/9", z="high")), end))
    lengths = {axis: f"{1e3 * value:.12g} mm" for axis, value in by_part.parts.items()}
    by_length = placed(loaded(tmp_path, at(position, lengths), end))
    np.testing.assert_allclose(by_length.pose.origin, by_part.pose.origin, atol=2e-12)
    assert not by_length.parts
    one_length = placed(loaded(tmp_path, at(position, {**lengths, "y": "2/9"}), end))
    assert one_length.parts.keys() == {"y"}
    np.testing.assert_allclose(one_length.pose.origin, by_part.pose.origin, atol=2e-12)


def test_a_place_in_two_dimensions(tmp_path: Path) -> None:
    path = tmp_path / "e.yaml"
    text = """\
title: plane
machine: {volume: [800 mm, 600 mm], repeatability: 1 um}
error_model: {kind: metric}
artefacts: {plate: {kind: grid, balls: [3, 2], size: [500 mm, 200 mm]}}
positions:
  - {name: a, corner: {x: high, y: 25 %}, quarter_turns: 1}
  - {name: b, pose: {origin: [low, high], rotation: 180 deg}}
"""
    path.write_text(text, encoding="utf-8")
    (experiment,) = load(path)
    first, second = experiment.positions
    # Turned, the plate's origin is its lower right corner.
    np.testing.assert_allclose(first.pose.origin, [0.8, 0.025], atol=1e-12)
    np.testing.assert_allclose(second.pose.origin, [0.5, 0.6], atol=1e-12)


def test_places_follow_what_a_variant_changes(tmp_path: Path) -> None:
    position = at(CASES[0][0], dict(x="low", y="high", z="middle"))
    variants = """\
variants:
  smaller: {"artefacts.plate.size": [330 mm, 300 mm]}
  longer: {machine.volume.y: [0 mm, 1200 mm]}
  other tip: {"probes.down": [0 mm, 0 mm, -50 mm]}
  edged: {pool: {limits: {edge: 10 mm}}}
  placed: {"positions[p].corner.y": low, "positions[p].level": 25 %}
"""
    path = tmp_path / "e.yaml"
    text = HEAD + f"positions:\n  - {position}\n{REST}" + variants
    path.write_text(text, encoding="utf-8")
    at_variant = {
        str(variant.name): placed(variant).parts for variant in load(path) if not variant.notes
    }
    # The plate across x has its first side along y; the tip points 80 mm down.
    expected = {
        "smaller": (-0.2, 0.57, 0.22),
        "longer": (-0.2, 0.77, 0.215),
        "other tip": (-0.2, 0.47, 0.245),
        "edged": (-0.2, 0.46, 0.26),
        "placed": (0.1, 0.0, 0.215),
    }
    assert at_variant.keys() == expected.keys()
    for name, lengths in expected.items():
        assert [at_variant[name][axis] for axis in "xyz"] == pytest.approx(lengths, abs=1e-12)


GROUPS = """\
pool:
  candidates:
    - name: whole
      artefact: plate
      planes: [z]
      levels: [low, 30 %, 500 mm]
      corners: {x: [low, high], y: middle}
      quarter_turns: [0, 1]
      probes: [[left, right], [right]]
    - name: across
      artefact: plate
      planes: [x]
      levels: {from: low, to: high, count: 3}
      corners: {y: middle, z: [high, 200 mm]}
      quarter_turns: [0, 1]
      probes: [[left, right], [right]]
      balls: [r1c1, r2c2]
    - {name: single, artefact: plate, plane: y, level: high, centre: {x: low, z: 10 %}, probes: [down]}
"""


@pytest.mark.parametrize(
    "limits", ["", "  limits: {edge: 11 mm, reach: {right: {x: [0 mm, 900 mm]}}}\n"]
)
def test_candidates_of_a_pool_are_at_the_places_of_positions(limits: str, tmp_path: Path) -> None:
    position = at(CASES[0][0], dict(x="low", y="low", z="low"))
    pool = loaded(tmp_path, position, GROUPS + limits, planning=True).pool
    assert pool is not None
    items = [candidate for candidate in pool.candidates if not candidate.drawn]
    names = {candidate.name for candidate in items}
    assert "whole z 30 % at low, middle turn 1 left+right" in names
    assert "across x 50 % at middle, 200 mm turn 0 right" in names
    # 3 levels x 2 places and 3 levels x 2 places, 2 turns, 2 sets of probes, 2 of balls, and one.
    assert len(items) + sum(pool.dropped.values()) == 2 * 6 * 4 + 1
    for candidate in items:
        item = candidate.item
        assert isinstance(item, Position)
        # What a plan writes are lengths.
        settings = to_list(candidate.settings)
        written = loaded(tmp_path, json.dumps(settings), limits and f"pool:\n{limits}")
        assert not placed(written).parts
        (kept,), (stated_ones,) = placed(written).readings, item.readings
        assert (kept.probes, kept.balls) == (stated_ones.probes, stated_ones.balls)
        np.testing.assert_allclose(placed(written).pose.origin, item.pose.origin, atol=1e-12)
        # The same place as a position states it, with the words of the candidate's name.
        if candidate.group != "whole":
            continue
        plane, *words = candidate.name.split(" turn")[0].removeprefix("whole ").split(" ", 1)
        level, where = words[0].split(" at ")
        first, second = where.split(", ")
        axes = sorted({"x", "y", "z"} - {plane})
        stated = settings | {
            "level": level,
            "corner": dict(zip(axes, (first, second), strict=True)),
        }
        by_part = placed(loaded(tmp_path, json.dumps(stated), limits and f"pool:\n{limits}"))
        np.testing.assert_allclose(by_part.pose.origin, item.pose.origin, atol=1e-12)


WRONG = [
    ("level: hihg", wording.NOT_A_PLACE.format("level", "hihg", 'did you mean "high"?')),
    ("level: top", wording.NOT_A_PLACE.format("level", "top", "known: low, middle, high")),
    ("level: 130 %", wording.BEYOND_THE_FREE_ROOM.format("130 %")),
    ("level: 5 ppm", wording.RATIO_FOR_A_LENGTH),
    ("level: 0.3", wording.PLACE_WITHOUT_UNIT),
]


@pytest.mark.parametrize(("stated", "message"), WRONG)
def test_wrong_words(stated: str, message: str, tmp_path: Path) -> None:
    position = PLATE.replace("level: 100 mm", stated)
    with pytest.raises(ExperimentError) as caught:
        loaded(tmp_path, position, "")
    assert str(caught.value).removeprefix(f"{tmp_path}/") == message


def test_ends_of_a_range_are_of_one_kind(tmp_path: Path) -> None:
    wrong = GROUPS.replace("{from: low, to: high", "{from: low, to: 500 mm")
    with pytest.raises(ExperimentError) as caught:
        loaded(tmp_path, PLATE, wrong, planning=True)
    assert wording.TWO_LENGTHS_OR_TWO_PARTS in str(caught.value)


@pytest.mark.parametrize("place", ["low", "10 %"])
@pytest.mark.parametrize(
    ("size", "end", "message"),
    [
        ("[930 mm, 310 mm]", "", wording.NO_ROOM),
        ("[890 mm, 310 mm]", POOL, wording.NO_ROOM_FOR_THE_EDGE),
    ],
)
def test_a_plate_without_room_is_outside_the_volume(
    place: str, size: str, end: str, message: str, tmp_path: Path
) -> None:
    path = tmp_path / "e.yaml"
    position = at(CASES[0][0], dict(x="low", y=place, z="low"))
    text = HEAD.replace("[430 mm, 310 mm]", size) + f"positions:\n  - {position}\n{REST}{end}"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ExperimentError) as caught:
        load(path)
    assert str(caught.value).removeprefix(f"{tmp_path}/").startswith(message)


def test_faulty_probes_and_machines_are_the_only_faults(tmp_path: Path) -> None:
    path = tmp_path / "e.yaml"
    good = HEAD + f"positions:\n  - {at(CASES[0][0], dict.fromkeys('xyz', 'low'))}\n{REST}"
    for old, new in (
        ("[0 mm, 0 mm, -80 mm]", "[0 mm, 0 mm, down]"),
        ("y: [0 mm, 900 mm]", "y: wide"),
    ):
        path.write_text(good.replace(old, new), encoding="utf-8")
        with pytest.raises(ExperimentError) as caught:
            load(path)
        assert len(caught.value.messages) == 1


def test_the_schema_knows_the_places_that_are_read() -> None:
    definitions = schema()["$defs"]
    of_level = definitions["PositionSettings"]["properties"]["level"]["anyOf"]
    forms = [form for choice in of_level for form in choice.get("anyOf", [choice])]
    allowed = [form.get("enum", ()) for form in forms]
    patterns = [form["pattern"] for form in forms if "pattern" in form]
    for place in ("low", "30 %", " 2/9", "-12.5 mm", "hihg", "2/0", "30"):
        is_valid = place not in ("hihg", "2/0", "30")
        is_allowed = any(place in words for words in allowed)
        is_allowed |= any(re.search(pattern, place) is not None for pattern in patterns)
        assert is_allowed is is_valid
        with contextlib.nullcontext() if is_valid else pytest.raises(QuantityError):
            parse_place(place)


def test_few_positions_are_placed_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """All balls of all positions together would take a gigabyte for a thousand of the largest."""
    counts, placed, experiment = [], bounds.balls_in_machine, bp.quickstart()
    monkeypatch.setattr(
        bounds, "balls_in_machine", lambda p, at: counts.append(len(p)) or placed(p, at)
    )
    poses = [place.pose for place in experiment.positions] * 30
    balls = bounds.balls_of(poses, [experiment.layouts["plate"]] * len(poses))
    first = next(balls)
    assert counts == [bounds.AT_ONCE] and first.shape == (25, 3) and len([first, *balls]) == 180
