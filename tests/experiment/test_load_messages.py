"""Broken files, each a good one with something replaced, and exactly what is said about them."""

import json
from pathlib import Path

import pytest
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.inputs.messages import ExperimentError
from hypothesis import HealthCheck, given, settings, strategies as st

from tests.experiment import wording

GOOD = """\
title: good
machine:
  volume: {x: [0 mm, 1 m], y: [0 mm, 1 m], z: [0 mm, 1 m]}
  repeatability: 0.2 um
error_model: {kind: kinematic}
probes: {down: [0 mm, 0 mm, -50 mm]}
artefacts:
  plate: {kind: grid, balls: [3, 3], size: [500 mm, 500 mm]}
  bar: {kind: two_spheres, length: 500 mm, role: length_standard}
positions:
  - {name: low, artefact: plate, plane: z, level: 0 mm, corner: {x: 0 mm, y: 0 mm}}
  - {name: bar, artefact: bar, plane: z, level: 0 mm, corner: {x: 0 mm, y: 0 mm}}
calibration:
  - {kind: distances, artefact: plate, pairs: corner sides, standard_uncertainty: 0.2 um}
  - {kind: distances, artefact: bar, pairs: all, standard_uncertainty: 0.2 um}
evaluation: {points: [[0 mm, 0 mm, 0 mm]]}
"""
PLANE = """\
title: plane
machine: {volume: [1 m, 1 m], repeatability: 0.2 um}
error_model: {kind: metric}
artefacts: {plate: {kind: square, balls: 3, size: 500 mm}}
positions: [{name: low, corner: {x: 0 mm, y: 0 mm}}]
"""
LOW = "plane: z, level: 0 mm, corner: {x: 0 mm, y: 0 mm}}\n  - {name: bar"
SIDES = "pairs: corner sides, standard_uncertainty: 0.2 um"

# What is replaced, by what, and the lines of the messages without the name of the file.
SECTIONS = [
    ("title: good", "title: 2024", [
        "1:8: title: expected a text, found the number 2024; quote it (one-line"
        " description of the experiment)"]),
    ("title: good", "title:", ["1:7: title: empty; give a value, or leave it out"]),
    ("title: good", 'title: ""', ["1:8: title: empty; give a text"]),
    ("title: good", "title: a\nsigma: estimate", [
        '2:8: sigma: unknown value "estimate"; did you mean "estimated"? allowed: estimated, given']),
    ("title: good", "title: a\nseed: 1.5", [
        "2:7: seed: expected a whole number, found the number 1.5 (seed of simulated readings; default 1)"]),
    ("title: good", "title: a\ntarget_uncertainty: L/5", [
        '2:21: target_uncertainty: "L/5" is not a length that grows with L; write for example "0.5 um + '
        'L/1000000", with L in metres, or "0.9 um + 2.5 um/m"']),
    ("title: good", "title: a\ntitle: b", [
        '2:1: the key "title" is already in line 1; remove one of the two']),
    ("error_model: {kind: kinematic}", "error_model: {kind: kinetic}", [
        '5:21: error_model.kind: unknown kind "kinetic"; did you mean "kinematic"?']),
    ("error_model: {kind: kinematic}", "error_model: {}", [
        '5:14: error_model.kind: missing; add "kind", one of: kinematic, empirical, metric, python, machine']),
    ("error_model: {kind: kinematic}", "error_model: {kind: metric, scale: split}", [
        "5:36: error_model.scale: has no meaning in 3 dimensions; choose from: each, none"]),
    ("error_model: {kind: kinematic}", "error_model: {kind: kinematic, arrangement: MB9}", [
        '5:45: error_model.arrangement: unknown value "MB9"; did you mean "MB2"? '
        "allowed: MB1, MB2, FB1, FB2, FH1, FH2, MH1, MH2, CX1, CY1"]),
    ("error_model: {kind: kinematic}", "error_model: {kind: kinematic, basis: {order: 4, knots: [0.5, 1]}}", [
        "5:39: error_model.basis: interior knots are out of order or range; give them between 0 and 1, in "
        "ascending order"]),
    ("error_model: {kind: kinematic}",
     "error_model: {kind: kinematic, basis: {order: 4, knots: [0.3], features: [0.4], slopes: {end: 0.5}, edge: 1}}", [
        '5:89: error_model.basis.slopes: functions of a basis are multiplied by any number, which keeps no end slope '
        "but 0; give 0",
        "5:101: error_model.basis.edge: unknown key; known: periodic"]),
    ("error_model: {kind: kinematic}", "error_model: {kind: kinematic, basis: {knots: [0.3], features: [0.3]}}", [
        "5:39: error_model.basis: 0.3 is among the knots and the features; leave it out of the knots"]),
    ("error_model: {kind: kinematic}", "error_model: {kind: kinematic, basis: {order: 2, features: [0.3]}}", [
        "5:39: error_model.basis: broken lines share no slope between features; give an order of 3 or more"]),
    ("error_model: {kind: kinematic}", "error_model: {kind: kinematic, basis: {features: [0.3, 0.3]}}", [
        "5:39: error_model.basis: boundaries of features are out of order; give each once, in ascending order"]),
    ("error_model: {kind: kinematic}", "error_model: {kind: kinematic, basis: {periodic: true, slopes: {end: 0}}}", [
        "5:39: error_model.basis: periodic ends have slopes of their own; remove slopes or periodic"]),
    ("error_model: {kind: kinematic}", "error_model: {kind: kinematic, basis: {slopes: {}}}", [
        "5:48: error_model.basis.slopes: neither start nor end is given; give 0 for one or both, or remove the "
        "key"]),
    ("error_model: {kind: kinematic}", "error_model: {kind: empirical, terms: tensor, basis: {slopes: {end: 0}}}", [
        "5:14: error_model: full tensor products have the factors x, y and z, whose slope is not 0; remove slopes"]),
    ("error_model: {kind: kinematic}", "error_model: {kind: kinematic, basis: {order: 4}, rotation_coefficients: 3}", [
        '5:14: error_model: "rotation_coefficients" has no meaning with splines, which have an order and knots; '
        "remove it"]),
    ("error_model: {kind: kinematic}", "error_model: {kind: empirical, terms: {centres: [3, 1, 3]}}", [
        "5:53: error_model.terms.centres[1]: the number 1 is out of range; give one at least 2"]),
    ("error_model: {kind: kinematic}", "error_model: {kind: empirical, coefficients: [3, 4, 3]}", [
        "5:46: error_model.coefficients: expected a mapping, key: value, found a list (Coefficients of each univariate polynomial, the constant included; by axis as {x: 5, y: 3, z: 2})"]),
    ("error_model: {kind: kinematic}", "error_model: {kind: empirical, coefficients: {x: 3, w: 3}}", [
        "5:53: error_model.coefficients.w: unknown key; known: y, z"]),
    ("error_model: {kind: kinematic}", "error_model: {kind: empirical, basis: {y: {order: 3}, order: 3}}", [
        '5:39: error_model.basis: "order" is a key of splines; move it into x, y or z']),
    ("error_model: {kind: kinematic}", "error_model: {kind: empirical, basis: {x: monomial, y: {order: 1}, z: spline}}", [
        "5:64: error_model.basis.y.order: the number 1 is out of range; give one at least 2",
        '5:71: error_model.basis.z: unknown value "spline"; allowed: chebyshev, monomial']),
    ("error_model: {kind: kinematic}", "error_model: {kind: empirical, terms: quadratic, basis: {y: {order: 3}}}", [
        '5:14: error_model: "basis" has no meaning with quadratic terms; remove it']),
    ("error_model: {kind: kinematic}", "error_model: {kind: empirical, terms: tensor, coefficients: {y: 9}}", [
        "5:14: error_model: full tensor products have at most 8 functions along an axis; give fewer, or sums"]),
    ("error_model: {kind: kinematic}", "error_model: {kind: kinematic}\ntrue_machine: {kind: random}", [
        "6:15: true_machine: without sizes it is a machine without errors; "
        "give position: 2 um, rotation: 4 urad, or both"]),
    ("error_model: {kind: kinematic}",
     "error_model: {kind: kinematic}\ntrue_machine: {kind: coefficients, values: {EX x^3: 1 um, EY x^2: 1 um}, "
     "error_model: {kind: empirical, terms: quadratic}}", [
         '6:53: true_machine.values[EX x^3]: the error model has no parameter "EX x^3"; did you mean "EX x^2"?']),
    ("error_model: {kind: kinematic}",
     "error_model: {kind: kinematic}\ntrue_machine: {kind: coefficients, values: {EY x^2: 1 um}, "
     "error_model: {kind: empirical, terms: quadratic}}", [
         "6:53: true_machine.values[EY x^2]: EY must be zero at both ends of its axis to fix the machine's "
         "frame; let its coefficients add up to zero"]),
]  # fmt: skip
MACHINE = [
    ("error_model: {kind: kinematic}", "error_model: {kind: kinematic, arrangement: moving bridge}", [
        '5:45: error_model.arrangement: unknown value "moving bridge"; allowed: MB1 (moving bridge along'
        " y), MB2 (moving bridge along x), FB1 (fixed bridge, table along y), FB2 (fixed bridge, table"
        " along x), FH1 (fixed horizontal arm, table along x), FH2 (fixed horizontal arm, table along y),"
        " MH1 (moving horizontal arm along x, on a column along y), MH2 (moving horizontal arm along y,"
        " on a column along x), CX1 (column, table along y on x), CY1 (column, table along x on y)"]),
    ("z: [0 mm, 1 m]}", "z: [1 m]}", [
        "3:47: machine.volume.z: has 1 entry; 2 are needed (lower and upper end of the z axis; "
        "omitted in 2-D)"]),
    ("z: [0 mm, 1 m]}", "z: [1 m, 0 mm]}", [
        "3:47: machine.volume.z: ends at 0 mm, not above its beginning, 1000 mm; exchange or correct them"]),
    ("repeatability: 0.2 um", "repeatability: [1 um, 1 um]", [
        "4:18: machine.repeatability: has 2 axes, but machine.volume has 3; give one length for all, or 3"]),
    ("repeatability: 0.2 um", "colour: red", [
        '2:1: machine.repeatability: missing; add "repeatability" '
        "(standard uncertainty of a reading: for every co-ordinate, or one per axis)",
        '4:3: machine.colour: unknown key; known: repeatability',
    ]),
    ("probes: {down: [0 mm, 0 mm, -50 mm]}\n", "", [
        '1:1: probes: missing; add "probes", such as {down: [0 mm, 0 mm, -50 mm]}: '
        "offsets from the reference point"]),
    ("[0 mm, 0 mm, -50 mm]", "[0 mm, 0 mm]", [
        "6:16: probes.down: has 2 co-ordinates, but the experiment has 3 dimensions; give 3"]),
    ("{points: [[0 mm, 0 mm, 0 mm]]}", "{points: [[0 mm, 0 mm]], probe: up}", [
        "16:23: evaluation.points[0]: has 2 co-ordinates, but the experiment has 3 dimensions; give 3",
        '16:45: evaluation.probe: unknown probe "up"; known: down',
    ]),
]  # fmt: skip
ARTEFACTS = [
    ("size: [500 mm, 500 mm]", "size: [500 mm, 500 mm], axes: {origin: r1c1, x: r1c3}", [
        "8:68: artefacts.plate.axes: axes are those of a plate in two dimensions; remove them, or the z axis of "
        "machine.volume"]),
    ("role: length_standard", 'role: length_standard, axes: {origin: "1", x: "2"}', [
        "9:73: artefacts.bar.axes: a length standard's balls are not estimated; remove its axes"]),
    ("kind: two_spheres", "kind: ball bar", ['9:15: artefacts.bar.kind: unknown kind "ball bar"; write "two_spheres"']),
    ("kind: grid, ", "", [
        '8:10: artefacts.plate.kind: missing; add "kind", one of: grid, square, balls, two_spheres, sphere, '
        "bryan_gauge"]),
    ("balls: [3, 3]", "balls: [300, 300]", [
        "8:10: artefacts.plate: 90000 balls are too many; at most 40000 are possible"]),
    ("kind: grid, balls: [3, 3], size: [500 mm, 500 mm]", "kind: balls", [
        '8:10: artefacts.plate: neither or both of "coordinates" and "file" are given; give exactly one']),
    ("kind: grid, balls: [3, 3], size: [500 mm, 500 mm]", "kind: balls, coordinates: [[1 mm], 5]", [
        "8:38: artefacts.plate.coordinates[0]: has 1 entry; 2 or 3 are needed",
        "8:46: artefacts.plate.coordinates[1]: expected a list in brackets, found the number 5",
    ]),
    ("kind: grid, balls: [3, 3], size: [500 mm, 500 mm]",
     "kind: balls, coordinates: {a: [1 mm, 1 mm], b: [1 mm, 1 mm]}", [
        '8:37: artefacts.plate.coordinates: balls "a" and "b" have the same location; correct'
        " one of them"]),
    ("positions:", "  frame: {kind: square, balls: 2, size: 500 mm, role: length_standard}\npositions:", [
        "10:3: artefacts.frame: is a length standard without calibrated distances; "
        "add a calibration of kind: distances",
        "10:3: artefacts.frame: is never placed; add a position of it, or remove it",
    ]),
]  # fmt: skip
POSITIONS = [
    ("name: bar", "name: low", [
        '12:12: positions[1].name: "low" is the name of positions[0] already; names of positions '
        'must differ']),
    (LOW, LOW.replace("plane: z", "plane: Z-X"), [
        '11:41: positions[0].plane: the plane "Z-X" is normal to y; write y']),
    (LOW, LOW.replace("plane: z", "plane: x"), [
        '11:65: positions[0].corner.z: missing; add "z"',
        "11:66: positions[0].corner.x: is not an axis of the plane; give y and z",
    ]),
    (LOW, LOW.replace("level: 0 mm, ", ""), [
        '11:5: positions[0].level: missing; add "level", the co-ordinate of the plane']),
    (LOW, LOW.replace("corner: {x: 0 mm, y: 0 mm}", "quarter_turns: 1"), [
        '11:5: positions[0].corner: missing; add "corner" or "centre"']),
    (LOW, LOW.replace("corner:", "centre: {x: 1 m, y: 1 m}, corner:"), [
        '11:57: positions[0].centre: cannot be combined with "corner"; give only one of the two']),
    (LOW, LOW.replace("plane: z, level: 0 mm, corner: {x: 0 mm, y: 0 mm}", "repeats: 2"), [
        "11:5: positions[0]: does not state the artefact's location; add plane, level and"
        " corner or centre, or pose"]),
    (LOW, LOW.replace("plane: z, level: 0 mm, corner:", "pose: {origin: [0 m, 0 m, 0 m]}, corner:"), [
        '11:67: positions[0].corner: cannot be combined with "pose"; give only one of the two']),
    (LOW, LOW.replace("plane: z, level: 0 mm, corner: {x: 0 mm, y: 0 mm}",
                      "pose: {origin: [0 m, 0 m], rotation: 90 deg}"), [
        "11:49: positions[0].pose.origin: has 2 co-ordinates, but the experiment has 3 dimensions; give 3",
        "11:71: positions[0].pose.rotation: a three-dimensional experiment has three angles; "
        "write for example [0 deg, 0 deg, 90 deg]",
    ]),
    (LOW, LOW.replace("y: 0 mm}}", "y: 0 mm}, probes: [up, down, down]}", 1), [
        '11:94: positions[0].probes[0]: unknown probe "up"; known: down',
        '11:104: positions[0].probes[2]: probe "down" is listed twice; remove one of the two',
    ]),
    (LOW, LOW.replace("y: 0 mm}}", "y: 0 mm}, balls: [r1c1]}", 1), [
        "8:3: artefacts.plate: no position reads balls r1c2, r1c3, r2c1, r2c2, r2c3, r3c1, r3c2, r3c3; "
        "read them, or leave them out of the artefact"]),
    (LOW, LOW.replace("y: 0 mm}}", "y: 0 mm}, repeats: 2, readings: [{balls: [r1c7]}]}", 1), [
        '11:85: positions[0].repeats: cannot be combined with "readings"; move it there, or remove "readings"',
        '11:117: positions[0].readings[0].balls[0]: unknown ball "r1c7"; did you mean "r1c3"?',
    ]),
    (LOW, LOW.replace("x: 0 mm", "x: 600 mm"), [
        '11:5: positions[0]: reading ball "r1c3" with probe "down" moves the scales to x = 1100'
        " mm, 100 mm above the measuring volume, and 2 more readings; move the artefact, or"
        " read it otherwise"]),
    (LOW, LOW.replace("level: 0 mm", "level: -52.000002 mm"), [
        '11:5: positions[0]: reading ball "r1c1" with probe "down" moves the scales to z ='
        " -2.000002 mm (the ball at -52.000002 mm less the offset of -50 mm), 2.000002 mm below"
        " the measuring volume, and 8 more readings; move the artefact, or read it otherwise"]),
    ("artefact: bar, plane: z, level: 0 mm, corner: {x: 0 mm, y: 0 mm}}",
     "artefact: bar, plane: z, level: 0 mm, corner: {x: 0 mm, y: 0 mm}, balls: [1]}", [
        "15:45: calibration[1].pairs: no position reads ball 2; read them, or leave them out"]),
]  # fmt: skip
CALIBRATION = [
    (SIDES, "pairs: corner sides, expanded_uncertainty: 0.4 um", [
        "14:61: calibration[0].expanded_uncertainty: unknown key; uncertainties are standard ones, U / k"
        " of an expanded uncertainty U; give U / k as standard_uncertainty"]),
    (SIDES, "pairs: corner, standard_uncertainty: 0.2 um", [
        '14:47: calibration[0].pairs: "corner" is not defined for this artefact; did you mean '
        '"corners"? choose from: corner sides, corner diagonals, corners, neighbours, braced, all, '
        "or list pairs of balls",
    ]),
    (SIDES, SIDES.replace("corner sides", "[[r1c1, r1c9], [r1c1, r1c1], [r1c1, r1c2], [r1c2, r1c1]]"), [
        '14:55: calibration[0].pairs[0][1]: unknown ball "r1c9"; did you mean "r1c3"?',
        '14:62: calibration[0].pairs[1]: a ball has no distance from itself; name two balls, not '
        '"r1c1" twice',
        "14:90: calibration[0].pairs[3]: is already in entry [2]; remove one of the two",
    ]),
    (SIDES, f"{SIDES}, form: projection, dimensions: 4", [
        "14:121: calibration[0].dimensions: expected one of: 2, 3; found the number 4"]),
    (SIDES, f"{SIDES}, form: projection", [
        "14:91: calibration[0].form: is only for artefacts with role: length_standard; "
        'remove it, or give "plate" that role']),
    (SIDES, f"{SIDES}, values: [{{balls: [r1c1, r1c3], distance: 500 mm}}]", [
        "14:99: calibration[0].values: no distance for r3c1–r3c3, r1c1–r3c1, r1c3–r3c3; "
        "add it, or leave it out of pairs"]),
    ("kind: distances, artefact: bar, pairs: all", "kind: coordinates, artefact: bar", [
        "15:12: calibration[1].kind: a length standard carries distances only; use kind: distances, "
        "or remove its role: length_standard"]),
    ("kind: distances, artefact: plate, " + SIDES,
     "kind: coordinates, artefact: plate, standard_uncertainty: {}", [
        "14:64: calibration[0].standard_uncertainty: calibrates no axis; give at least one, such as "
        "{x: 0.2 um}"]),
    ("kind: distances, artefact: plate, pairs: corner sides",
     "kind: coordinates, artefact: plate, balls: [r1c1, r9c9], dimensions: 3", [
        "14:63: calibration[0].dimensions: unknown key; known: covariance, result, quantity, coverage_factor, common, "
        "correlation, axes, values"]),
]  # fmt: skip
PLANE_CASES = [
    ("{kind: metric}", "{kind: empirical}", [
        '3:21: error_model.kind: kind "empirical" has 3 dimensions, but machine.volume has 2; change '
        'one of the two']),
    ("{kind: metric}", "{kind: metric, scale: each}", [
        "3:36: error_model.scale: has no meaning in 2 dimensions; choose from: none, x, y, split"]),
    ("corner: {x: 0 mm, y: 0 mm}", "plane: z, corner: {x: 0 mm, y: 0 mm}", [
        "5:25: positions[0].plane: has no meaning in two dimensions; remove it"]),
    ("corner: {x: 0 mm, y: 0 mm}", "pose: {origin: [0 m, 0 m], rotation: [0 deg, 0 deg, 0 deg]}", [
        "5:62: positions[0].pose.rotation: a two-dimensional experiment has one angle; write for "
        "example 90 deg"]),
    ("kind: square, balls: 3, size: 500 mm", "kind: balls, coordinates: [[0 m, 0 m, 1 mm]]", [
        '4:47: artefacts.plate.coordinates: ball "1" has the third co-ordinate 1 mm, but the experiment is '
        "two-dimensional; give two co-ordinates, or machine.volume a z axis"]),
    ("positions:", "calibration: [{kind: coordinates, standard_uncertainty: {z: 1 um}}]\npositions:", [
        "5:61: calibration[0].standard_uncertainty.z: has no meaning in two dimensions; remove it"]),
    ("positions:",
     "calibration: [{kind: distances, pairs: all, standard_uncertainty: 1 um, dimensions: 3}]\npositions:", [
        "5:85: calibration[0].dimensions: a two-dimensional experiment has distances in 2 "
        "dimensions; remove it"]),
    ("size: 500 mm", "size: 500 mm, axes: {origin: r1c1}", [
        '4:65: artefacts.plate.axes: neither or both of "x" and "y" are given; '
        "name one ball, on one axis"]),
    ("size: 500 mm", "size: 500 mm, axes: {origin: r1c1, y: r1c1}", [
        '4:65: artefacts.plate.axes: ball "r1c1" cannot be the origin and fix an axis too; name another one']),
]  # fmt: skip


def refusals(folder: Path, text: str) -> list[str]:
    path = folder / "e.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ExperimentError) as caught:
        load(path)
    return str(caught.value).replace(f"{folder}/", "").split("\n")


def test_the_good_files_are_good(tmp_path: Path) -> None:
    for text in (GOOD, PLANE):
        (tmp_path / "e.yaml").write_text(text)
        assert len(load(tmp_path / "e.yaml")) == 1


@pytest.mark.parametrize(
    ("old", "new", "lines"), SECTIONS + MACHINE + ARTEFACTS + POSITIONS + CALIBRATION
)
def test_broken_files(tmp_path: Path, old: str, new: str, lines: list[str]) -> None:
    assert GOOD.count(old) >= 1
    assert refusals(tmp_path, GOOD.replace(old, new, 1)) == [f"e.yaml:{line}" for line in lines]


@pytest.mark.parametrize(("old", "new", "lines"), PLANE_CASES)
def test_broken_plane_files(tmp_path: Path, old: str, new: str, lines: list[str]) -> None:
    assert refusals(tmp_path, PLANE.replace(old, new, 1)) == [f"e.yaml:{line}" for line in lines]


def test_errors_of_all_sections_at_once_by_line(tmp_path: Path) -> None:
    text = (
        GOOD.replace("0.2 um", "0.2", 1)
        .replace("kind: grid", "kind: gird")
        .replace("plane: z", "plane: w", 1)
    )
    text = text.replace("pairs: all", "pairs: al").replace(
        "artefact: bar, plane", "artefact: baz, plane"
    )
    lines = refusals(tmp_path, text)
    assert [line.split(": ")[1] for line in lines] == [
        "machine.repeatability",
        "artefacts.plate.kind",
        "positions[0].plane",
        "positions[1].artefact",
        "calibration[1].pairs",
    ]


def test_tables_are_reported_at_their_own_lines(tmp_path: Path) -> None:
    (tmp_path / "d.csv").write_text("ball_1,ball_2,distance_mm\nr1c1,r1c3,five\nr1c1,r9c9,-1\n")
    text = GOOD.replace(SIDES, f"{SIDES}, values: d.csv").replace("title: good", "title: 1")
    assert refusals(tmp_path, text) == [
        (wording.EXPECTED_A_TEXT_FOUND_THE_NUMBER),
        wording.IS_NOT_A,
    ]
    (tmp_path / "d.csv").write_text(
        "ball_1,ball_2,distance_mm\nr1c1,r1c3,500\nr1c1,r9c9,-1\nr1c3,r1c1,5\n"
    )
    assert refusals(tmp_path, text)[1:] == [
        wording.A_DISTANCE_MUST_BE_ABOVE,
        (
            'd.csv:3:1: calibration[0].values: unknown ball "r9c9"; known: r1c1, r1c2, r1c3, r2c1,'
            " r2c2, r2c3, r3c1, r3c2 and 1 more"
        ),
        (wording.MM_IS_FAR_FROM_THE_MM),
        (wording.THE_DISTANCE_OF_AND_IS_GIVEN),
    ]


def test_a_certificate_lacks_balls(tmp_path: Path) -> None:
    (tmp_path / "c.csv").write_text("ball,x_mm,y_mm,z_mm\nr1c1,0,0,0\nr1c3,500,0,0\n")
    old = "kind: distances, artefact: plate, " + SIDES
    new = (
        "kind: coordinates, artefact: plate, balls: corners, standard_uncertainty: 1 um, values:"
        " c.csv"
    )
    assert refusals(tmp_path, GOOD.replace(old, new)) == [wording.NO_CO_ORDINATES_FOR_ADD_THEM]


def test_points_of_a_table_outside_the_volume(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("x_mm,y_mm,z_mm\n1,1,1\n1,-1,1\n1,1,2000\n")
    assert refusals(tmp_path, GOOD.replace("[[0 mm, 0 mm, 0 mm]]", "{file: p.csv}")) == [
        wording.MM_IS_MM_BELOW_THE_MEASURING
    ]


@pytest.mark.parametrize("text", ["5", "- a\n- b\n", "text"])
def test_files_that_are_no_mapping(tmp_path: Path, text: str) -> None:
    (line,) = refusals(tmp_path, text)
    assert line.startswith(wording.EXPECTED_A_MAPPING_THAT_BEGINS)


FRAGMENTS = ["5", "x", "[]", "{}", "[[1 mm]]", "{x: 1 mm}", "~", "true", "-1 mm", ".nan", "[a, {b: 1}]",
             "{kind: grid}",
             "{kind: balls}", "{kind: [1]}", "0 mm"]  # fmt: skip
WORDS = sorted(
    {word for word in GOOD.replace("{", " ").replace("}", " ").split() if word.endswith(",")}
)


@settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60, deadline=None
)
@given(st.data())
def test_no_mistake_breaks_the_loader(tmp_path: Path, data: st.DataObject) -> None:
    text = GOOD
    for _ in range(data.draw(st.integers(1, 3))):
        word = data.draw(st.sampled_from(WORDS))
        text = text.replace(word, data.draw(st.sampled_from(FRAGMENTS)) + ",", 1)
    (tmp_path / "e.yaml").write_text(text)
    try:
        load(tmp_path / "e.yaml")
    except ExperimentError as error:
        assert all(message.line >= 1 and message.text for message in error.messages)
        assert "<one>" not in str(error) and "<list>" not in str(error)


SECTION_VALUES = st.recursive(
    st.one_of(
        st.none(),
        st.booleans(),
        st.integers(-3, 9),
        st.sampled_from(["all", "1 mm", "r1c1", "plate", "grid"]),
    ),
    lambda below: st.one_of(
        st.lists(below, max_size=3),
        st.dictionaries(
            st.sampled_from(["kind", "x", "balls", "name", "artefact", "pairs"]), below, max_size=3
        ),
    ),
    max_leaves=8,
)


@settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60, deadline=None
)
@given(
    st.sampled_from([line.split(":")[0] for line in GOOD.split("\n") if line[:1].isalpha()]),
    SECTION_VALUES,
)
def test_no_section_breaks_the_loader(tmp_path: Path, section: str, value: object) -> None:
    lines, kept = GOOD.split("\n"), []
    inside = False
    for line in lines:
        inside = line.startswith(f"{section}:") or (inside and line.startswith(" "))
        kept += [] if inside else [line]
    (tmp_path / "e.yaml").write_text("\n".join([*kept, f"{section}: {json.dumps(value)}", ""]))
    try:
        load(tmp_path / "e.yaml")
    except ExperimentError as error:
        assert error.messages


@pytest.mark.parametrize("line", ["sigm: given", "coverage_facto: 2"])
def test_a_misspelt_key_has_no_default_in_a_tolerant_load(tmp_path: Path, line: str) -> None:
    text = Path("designs/quickstart.yaml").read_text(encoding="utf-8")
    (tmp_path / "e.yaml").write_text(f"{text}\n{line}\n", encoding="utf-8")
    (experiment,) = load(tmp_path / "e.yaml", tolerant=True)
    name = {"sigm": "sigma", "coverage_facto": "coverage_factor"}[line.partition(":")[0]]
    assert getattr(experiment, name) is None and len(experiment.faults or ()) == 1
