"""Pools of candidates: what is generated, what is dropped, how long it takes, and what is said
about mistakes.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from ballplate.results.prediction import check
from ballplate.simulator.experiment.construction import placed_only
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import AtMost, Candidate, Experiment, Pool, Position
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.inputs.quantities import parse_length
from ballplate.simulator.inputs.units import length_text
from hypothesis import given, strategies as st

from tests.experiment import wording

FOLDER = Path("designs/planning")

GOOD = """\
title: good
machine: {volume: [1 m, 1 m, 1 m], repeatability: 1 um}
error_model: {kind: kinematic}
probes: {down: [0 mm, 0 mm, -50 mm], right: [-50 mm, 0 mm, 0 mm]}
artefacts:
  plate: {kind: grid, balls: [3, 3], size: [500 mm, 400 mm]}
  bar: {kind: two_spheres, length: 300 mm, role: length_standard}
  gauge: {kind: bryan_gauge, radius: 200 mm, directions: [[0 deg, 0 deg], [90 deg, 0 deg]]}
positions:
  - {name: low, artefact: plate, plane: z, level: 0 mm, corner: {x: 0 mm, y: 0 mm}, probes: [down]}
calibration:
  - {kind: distances, artefact: plate, pairs: corner sides, standard_uncertainty: 1 um}
pool:
  times: {set_up: 10 min}
  candidates:
    - name: some
      artefact: plate
      planes: [z]
      levels: [0 mm, 600 mm]
      corners: {x: 0 mm, y: [0 mm, 400 mm]}
      probes: [[down]]
    - {name: more, artefact: plate, planes: [x], levels: [0 m, 60 cm], corners: {y: [0 mm, 400 mm], z: 100 mm}, probes: [right]}
    - {name: bar, artefact: bar, pose: {origin: [100 mm, 100 mm, 100 mm]}, probes: [down]}
    - {name: gauge, artefact: gauge, pose: {origin: [500 mm, 500 mm, 500 mm]}, probes: [down]}
  calibration:
    - {name: dear, price: 3 h, kind: distances, artefact: plate, pairs: corners, standard_uncertainty: 0.1 um}
  limits:
    keep: [low]
    at_most: [{of: {name: [low, bar]}, count: 1}, {of: {plane: x}, count: 1}]
    reach: {right: {x: [0 mm, 1 m]}}
seed: 1
"""
PLANE = """\
title: plane
machine: {volume: [1 m, 1 m], repeatability: 1 um}
error_model: {kind: metric}
artefacts: {plate: {kind: grid, balls: [3, 2], size: [500 mm, 200 mm]}}
pool:
  candidates:
    - {centres: {x: [250 mm, 400 mm], y: 500 mm}, quarter_turns: [0, 1]}
"""
SOME_CORNERS = "corners: {x: 0 mm, y: [0 mm, 400 mm]}"
SOME_PROBES = "probes: [[down]]"
LIMITS = GOOD[GOOD.index("  limits:\n") : GOOD.index("seed:")]


def experiment_of(folder: Path, text: str, planning: bool = True) -> Experiment:
    path = folder / "e.yaml"
    path.write_text(text, encoding="utf-8")
    (found,) = load(path, planning=planning)
    return found


def pool_of(folder: Path, text: str) -> Pool:
    pool = experiment_of(folder, text).pool
    assert pool is not None
    return pool


def messages(folder: Path, text: str, planning: bool = False) -> list[str]:
    path = folder / "e.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ExperimentError) as caught:
        load(path, planning=planning)
    return [line.removeprefix(f"{path}:") for line in str(caught.value).split("\n")]


def replaced(old: str, new: str, text: str = GOOD) -> str:
    assert text.count(old) == 1
    return text.replace(old, new)


def named(pool: Pool) -> dict[str, Candidate]:
    return {one.name: one for one in pool.candidates}


def test_every_combination_is_there_but_what_is_drawn(tmp_path: Path) -> None:
    pool = pool_of(tmp_path, GOOD)
    assert list(named(pool)) == [
        "low",
        "some z 0 mm at 0, 400 mm",
        "some z 600 mm at 0, 0 mm",
        "some z 600 mm at 0, 400 mm",
        "more x 0 mm at 0, 100 mm",
        "more x 0 mm at 400, 100 mm",
        "more x 600 mm at 0, 100 mm",
        "more x 600 mm at 400, 100 mm",
        "bar",
        "gauge",
        "dear",
    ]
    assert pool.dropped == {"same place as another": 1}
    assert [one.drawn for one in pool.candidates] == [True] + 10 * [False]
    assert [one.group for one in pool.candidates] == [
        "",
        *3 * ["some"],
        *4 * ["more"],
        "bar",
        "gauge",
        "dear",
    ]
    assert [one.plane for one in pool.candidates] == [*4 * "z", *4 * "x", "", "", ""]


def test_limits_are_of_indices(tmp_path: Path) -> None:
    pool = pool_of(tmp_path, GOOD)
    assert pool.must == (0,)
    assert pool.at_most == (AtMost((0, 8), 1), AtMost((4, 5, 6, 7), 1))
    text = replaced(
        LIMITS, "  limits: {keep: all, at_most: [{of: {name: some z*, probe: down}, count: 0}]}\n"
    )
    pool = pool_of(tmp_path, text)
    assert pool.must == (0,) and pool.at_most == (AtMost((1, 2, 3), 0),)
    text = replaced("{of: {plane: x}, count: 1}]", "{of: {group: bar, artefact: bar}, count: 1}]")
    assert pool_of(tmp_path, text).at_most[-1] == AtMost((8,), 1)


def test_times(tmp_path: Path) -> None:
    text = replaced(
        "probes: [down]}\n    - {name: gauge",
        "probes: [down], repeats: 2, times: {reading: 1 min}}\n    - {name: gauge",
    )
    pool = named(
        pool_of(
            tmp_path,
            replaced(SOME_PROBES, "probes: [down, right]\n      times: {set_up: 0 s}", text),
        )
    )
    assert pool["low"].seconds == 600 + 9 * 15
    assert pool["some z 600 mm at 0, 0 mm"].seconds == 18 * 15 + 120
    assert pool["bar"].seconds == 600 + 4 * 60
    assert pool["dear"].seconds == 3 * 3600 and pool["dear"].readings == 0
    whole = "times: {set_up: 1 min, reading: 1 s, probe_change: 5 s, plane_change: 7 s}"
    changes = pool_of(tmp_path, replaced("times: {set_up: 10 min}", whole)).changes
    assert (changes.probe, changes.plane) == (5.0, 7.0)
    assert (
        pool_of(tmp_path, replaced("  times: {set_up: 10 min}\n", "")).candidates[0].seconds
        == 1200 + 9 * 15
    )


def test_two_dimensions(tmp_path: Path) -> None:
    experiment = experiment_of(tmp_path, PLANE)
    assert experiment.positions == () and experiment.pool is not None
    names = [one.name for one in experiment.pool.candidates]
    assert names == [f"about {x}, 500 mm turn {turn}" for x in (250, 400) for turn in (0, 1)]
    assert (
        "probes" not in experiment.pool.candidates[0].settings
        and experiment.pool.candidates[0].plane == ""
    )
    (line,) = messages(tmp_path, PLANE)
    assert line == wording.MISSING_ADD_POSITIONS


def test_candidates_of_a_large_pool_are_counted() -> None:
    (experiment,) = load(FOLDER / "plate-pool.yaml", planning=True)
    assert experiment.pool is not None and len(experiment.pool.candidates) == 1260
    assert experiment.pool.dropped == {"same place as another": 6}


def test_out_of_volume_and_reach_and_edge_are_counted(tmp_path: Path) -> None:
    text = replaced(SOME_CORNERS, "corners: {x: [0 mm, 600 mm], y: [300 mm, 600 mm]}")
    across = "corners: {y: [300 mm, 600 mm], z: [50 mm, 500 mm, 600 mm]}"
    text = replaced("corners: {y: [0 mm, 400 mm], z: 100 mm}", across, text)
    text = replaced("reach: {right: {x: [0 mm, 1 m]}}", "reach: {right: {x: [100 mm, 1 m]}}", text)
    pool = pool_of(tmp_path, text)
    # z: of 2 x 2 places only x = 0 mm fits 500 mm, and y from 300 and 600 mm fits 400 mm. x: the
    # turned rectangle is 500 mm along y, which fits from 300 mm only, and 400 mm along z; the lower
    # level is out of reach.
    left = [one for one in pool.candidates if one.group in ("some", "more")]
    assert len([one for one in left if one.plane == "z"]) == 4
    assert len([one for one in left if one.plane == "x"]) == 3
    assert pool.dropped == {"outside the volume": 4 + 6, "out of reach of probe right": 3}
    text = replaced("reach: {right", "edge: 45 mm\n    reach: {right", text)
    text = replaced("corner: {x: 0 mm, y: 0 mm}", "corner: {x: 45 mm, y: 45 mm}", text)
    # Only above z = 45 mm, and no nearer than that to the other end.
    pool = pool_of(
        tmp_path, replaced("x: [0 mm, 600 mm], y: [300", "x: [0 mm, 50 mm], y: [300", text)
    )
    assert pool.dropped["edge outside the volume"] == 4 + 2 * 2


@pytest.mark.parametrize("edge", ["", "edge: 30 mm, "])
def test_candidates_in_forbidden_boxes_are_dropped(edge: str, tmp_path: Path) -> None:
    """Of groups and by themselves; a plate may touch a box, which its edge then enters."""
    text = replaced("corner: {x: 0 mm, y: 0 mm}", "corner: {x: 30 mm, y: 30 mm}")
    text = replaced("level: 0 mm", "level: 30 mm", text)
    text = replaced(
        "corners: {x: 0 mm, y: [0 mm, 400 mm]", "corners: {x: 30 mm, y: [30 mm, 400 mm]", text
    )
    copy = "\n    - {name: bar 2, artefact: bar, pose: {origin: [100 mm, 100 mm, 400 mm]}, probes: [down]}\n"
    text = replaced("    - {name: gauge,", f"{copy[1:]}    - {{name: gauge,", text)
    # Plates across z end at 430 and at 800 mm along y, and the box is 200 mm wide in their midst.
    boxes = "[{x: [200 mm, 400 mm], y: [430 mm, 2 m], z: [550 mm, 650 mm]}, {z: [90 mm, 110 mm]}]"
    pool = pool_of(tmp_path, replaced(LIMITS, f"  limits: {{{edge}forbidden: {boxes}}}\n", text))
    names = [one.name for one in pool.candidates if isinstance(one.item, Position)]
    assert "bar" not in names and "bar 2" in names and "gauge" in names
    high = [name for name in names if "some z 600 mm" in name]
    assert high == ([] if edge else ["some z 600 mm at 30, 30 mm"])
    # Besides the bar these: across x all are at 100 mm along z, which is in the second box.
    dropped = {"in a forbidden box": 1 + (2 if edge else 1) + 4}
    assert {key: n for key, n in pool.dropped.items() if "box" in key} == dropped


def test_what_lies_on_a_wall_is_in_a_forbidden_box_that_reaches_it(tmp_path: Path) -> None:
    """Two plates lie on the floor of the volume."""
    for ends, count in (("0 mm, 200 mm", 2), ("1 mm, 200 mm", 0), ("-9 mm, 0 mm", 0)):
        box = f"  limits: {{forbidden: [{{y: [350 mm, 450 mm], z: [{ends}]}}]}}\n"
        text = replaced(LIMITS, box, replaced("level: 0 mm", "level: 300 mm"))
        text = "\n".join(line for line in text.split("\n") if "{name: more" not in line)
        pool = pool_of(tmp_path, text)
        names = [name for name in (one.name for one in pool.candidates) if "some z 0 mm" in name]
        assert (len(names), pool.dropped.get("in a forbidden box", 0)) == (2 - count, count)


@given(st.floats(-1e4, 1e4, allow_subnormal=False).filter(lambda one: one == 0 or abs(one) > 1e-17))
def test_lengths_are_written_exactly(length: float) -> None:
    assert parse_length(length_text(length)) == length


def test_a_range_has_its_ends_and_numbers_one_would_write(tmp_path: Path) -> None:
    pool = pool_of(
        tmp_path, replaced("levels: [0 mm, 600 mm]", "levels: {from: 1 in, to: 0.7 m, count: 4}")
    )
    levels = sorted({one.settings["level"] for one in pool.candidates if one.group == "some"})
    assert levels == ["25.4 mm", "250.266666667 mm", "475.133333333 mm", "700 mm"]


def test_without_planning_what_only_the_pool_places_is_left_out(tmp_path: Path) -> None:
    experiment = experiment_of(tmp_path, GOOD, planning=False)
    assert experiment.pool is None and list(experiment.artefacts) == ["plate"]
    assert (
        check(experiment).verdict.deficiency
        == check(placed_only(experiment_of(tmp_path, GOOD))).verdict.deficiency
    )
    alone = GOOD[: GOOD.index("pool:")] + "seed: 1\n"
    lines = messages(tmp_path, alone)
    assert lines == [
        f"{k}:3: artefacts.{name}: is never placed; add a position of it, or remove it"
        for k, name in ((7, "bar"), (8, "gauge"))
    ]


def test_candidates_may_read_what_no_position_reads(tmp_path: Path) -> None:
    text = replaced("y: 0 mm}, probes: [down]}", "y: 0 mm}, probes: [down], balls: [r1c1]}")
    assert experiment_of(tmp_path, text).pool is not None
    assert messages(tmp_path, text)[0].startswith(wording.NO_POSITION_READS_BALLS)
    text = replaced(SOME_PROBES, f"{SOME_PROBES}\n      balls: [r1c1, r2c2]", text)
    text = replaced("probes: [right]}", "probes: [right], balls: [r1c1, r2c2]}", text)
    assert messages(tmp_path, text, planning=True)[0].startswith(wording.NO_POSITION_READS_BALLS)


def test_priors_may_be_about_candidates(tmp_path: Path) -> None:
    text = replaced(
        "seed: 1",
        "priors: [{parameter: 'some z 600 mm at 0, 0 mm: origin x', standard_uncertainty: 1 mm}]",
    )
    assert [one.position for one in experiment_of(tmp_path, text).priors] == [
        "some z 600 mm at 0, 0 mm"
    ]
    assert experiment_of(tmp_path, text, planning=False).priors == ()


def test_two_certificates_of_one_gauge_exclude_each_other(tmp_path: Path) -> None:
    more = "    - {name: NAME, kind: radius, artefact: gauge, standard_uncertainty: 1 um}\n"
    text = GOOD.replace(
        "  limits:\n", more.replace("NAME", "a") + more.replace("NAME", "b") + "  limits:\n"
    )
    pool = pool_of(tmp_path, text)
    assert pool.at_most[0] == AtMost((11, 12), 1)
    text = text.replace(
        "pool:\n", "  - {kind: radius, artefact: gauge, standard_uncertainty: 1 um}\npool:\n"
    )
    assert [line.split(": ", 1)[1] for line in messages(tmp_path, text, planning=True)] == [
        f'pool.calibration[{k}]: the radius of "gauge" is already in calibration[1]; remove one'
        " of the two"
        for k in (1, 2)
    ]


def test_variants_reach_into_the_pool(tmp_path: Path) -> None:
    path = tmp_path / "e.yaml"
    path.write_text(
        GOOD + "variants:\n  a: {'pool.candidates[some].levels': [0 mm]}\n  b: {'pool.limits.keep':"
        " all}\n"
    )
    first, second = load(path, planning=True)
    assert first.pool is not None and second.pool is not None
    assert len(second.pool.candidates) - len(first.pool.candidates) == 2
    path.write_text(
        GOOD + "variants:\n  a: {'pool.limits.keep': [bar]}\n  b: {'pool.limits.keep[0]': nobody}\n"
    )
    with pytest.raises(ExperimentError, match=r'unknown candidate "nobody"; .* \(in variant b\)'):
        load(path)


MISTAKES = [
    ("set_up: 10 min", "set_up: 20 mm, reading: 5, probe_change: -1 s, plane: 3 h", [
        '14:19: pool.times.set_up: "20 mm" is a length; a duration is expected, for example "20 min"',
        '14:35: pool.times.reading: "5" has no unit; write for example "5 min" or "5 s"',
        '14:52: pool.times.probe_change: "-1 s" is below zero; write for example "20 min"',
        "14:58: pool.times.plane: unknown key; known: plane_change, positions"]),
    ("planes: [z]", "planes: [x]", [
        '20:16: pool.candidates[0].corners.z: missing; add "z"',
        "20:17: pool.candidates[0].corners.x: is not an axis of the planes; remove it, or add to planes"]),
    ("levels: [0 mm, 600 mm]",
     "levels: {from: 0 mm, to: 1 m, count: 1000}\n      quarter_turns: [0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3]", [
        "16:7: pool.candidates[0]: there are 24001 candidates up to here; at most 20000 are possible"]),
    (SOME_CORNERS, "corners: {x: 0 mm}\n      centres: {x: 0 mm}", [
        '16:7: pool.candidates[0]: needs either "corners" or "centres"; give exactly one of them']),
    (SOME_PROBES, "probes: [[dwn], [right, right]]", [
        '21:17: pool.candidates[0].probes[0][0]: unknown probe "dwn"; did you mean "down"?',
        '21:31: pool.candidates[0].probes[1][1]: probe "right" is listed twice; remove one of the two']),
    (f"      {SOME_PROBES}\n", "", ["16:7: pool.candidates[0].probes: missing; add \"probes\", some of: down, right"]),
    ("name: bar, art", "name: low, art", [
        '23:14: pool.candidates[2].name: "low" is the name of positions[0] already; names must differ']),
    ("price: 3 h", "price: 3 mm", [
        '26:27: pool.calibration[0].price: "3 mm" is a length; a duration is expected, for example "20 min"']),
    ("keep: [low]", "keep: [lo]", ['28:12: pool.limits.keep[0]: unknown candidate "lo"; did you mean "low"?']),
    ("keep: [low]", "keep: [low, bar]", [
        "29:15: pool.limits.at_most[0]: at most 1 of these are allowed, but low, bar are to be kept; correct "
        "pool.limits"]),
    ("{plane: x}", "{}", [
        "29:56: pool.limits.at_most[1].of: has no criterion; give at least one of name, group,"
        " plane, artefact, probe"]),
    ("{plane: x}", "{group: sum}", [
        '29:64: pool.limits.at_most[1].of.group: unknown group "sum"; known: bar, dear, gauge, more, some']),
    ("{plane: x}", "{name: z *}", [
        '29:63: pool.limits.at_most[1].of.name: no candidate has a name such as "z *"; correct it']),
    ("reach: {right: {x: [0 mm, 1 m]}}", "reach: {rigth: {}, right: {x: [1 m, 0 m]}}", [
        '30:13: pool.limits.reach.rigth: unknown probe "rigth"; did you mean "right"?',
        "30:35: pool.limits.reach.right.x: the lower end must be below the upper; correct them"]),
    ("reach: {right: {x: [0 mm, 1 m]}}", "reach: {down: {x: [50 mm, 1 m]}}", [
        "10:5: positions[0]: a ball is 50 mm out of reach of probe down along x; move it, or "
        "correct pool.limits.reach"]),
    ("reach: {right: {x: [0 mm, 1 m]}}", "edge: 10 mm", [
        "10:5: positions[0]: with its edge of 10 mm the plate is 10 mm outside the volume; move it, or correct "
        "pool.limits.edge"]),
    ("reach: {right: {x: [0 mm, 1 m]}}", "forbidden: [{x: [9 mm, 0 mm]}, {}, {x: [0 mm, 9 mm], z: [-1 mm, 1 mm]}]", [
        "10:5: positions[0]: is in pool.limits.forbidden[2]; move it, or correct the box",
        "30:21: pool.limits.forbidden[0].x: the lower end must be below the upper; correct them",
        "30:36: pool.limits.forbidden[1]: has no limits; give the ends of the box along at least one axis"]),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "lines"), MISTAKES)
def test_mistakes(old: str, new: str, lines: list[str], tmp_path: Path) -> None:
    text = replaced(old, new)
    assert messages(tmp_path, text) == lines
    assert messages(tmp_path, text, planning=True) == lines


def test_a_pool_that_is_empty(tmp_path: Path) -> None:
    text = replaced("x: [250 mm, 400 mm], y: 500 mm", "x: [250 mm, 0 mm], y: 0 mm", PLANE)
    (line,) = messages(tmp_path, text, planning=True)
    assert line == wording.NO_CANDIDATE_IS_LEFT
    text = PLANE[: PLANE.index("  candidates:")] + "  times: {set_up: 1 min}\n"
    (line,) = messages(tmp_path, text, planning=True)
    assert line == wording.THERE_IS_NO_CANDIDATE


def test_readings_of_a_pool_are_bounded(tmp_path: Path) -> None:
    text = replaced("balls: [3, 3]", "balls: [200, 200]")
    text = replaced("levels: [0 mm, 600 mm]", "levels: {from: 0 mm, to: 0.9 m, count: 80}", text)
    (line,) = messages(tmp_path, text)
    assert line.startswith(wording.THERE_ARE_READINGS_UP_TO_HERE)
