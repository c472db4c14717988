"""Part files: the example, points in tables, and what is answered to mistakes."""

import json
import subprocess
import sys
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.parts.fitting import distances
from ballplate.extensions.parts.part_file import load_part
from ballplate.extensions.parts.part_sections import schema
from ballplate.extensions.parts.values import weights
from ballplate.simulator.inputs import ExperimentError
from numpy.testing import assert_allclose

HEAD = """\
part: part
unit: mm
probing: {point_repeatability: 0.4 um, tip: {diameter: 4}}
places: {low: {origin: [1 m, 2, 3], quarter_turns: 1}}
features:
  A: {plane: z+, at: 60, from: [10, 8], to: [190, 142], points: [4, 3]}
  bore: {bore: z, at: [50, 40], diameter: 30, depths: [8, 48], points: 8}
"""


def load(tmp_path, text):
    file = tmp_path / "part.yaml"
    file.write_text(text)
    return load_part(file)


def refusal(tmp_path, more):
    with pytest.raises(ExperimentError) as caught:
        load(tmp_path, HEAD + more)
    return [f"{one.line}: {one.text_with_path}" for one in caught.value.messages]


def test_the_example_lies_in_the_machine_of_the_quickstart():
    part = load_part("designs/parts/block.yaml")
    points = np.concatenate([one.points for one in part.features.values()])
    for place in part.places:
        placed = points @ place.rotation.T + place.origin
        assert placed.min() > 0.05 and placed.max() < 0.95
    assert not part.undetermined
    for one in part.features.values():
        assert_allclose(np.linalg.norm(one.normals, axis=1), 1, atol=1e-15)
    # Outside: away from the middle of the block for faces, towards the axis in bores.
    assert (part.features["bore 1"].normals * (part.features["bore 1"].points - [0.05, 0.04, 0]))[
        :, :2
    ].sum(axis=1).max() < -0.0149
    assert_allclose(part.features["bore 1"].ends, [[0.05, 0.04, 0.008], [0.05, 0.04, 0.048]])


def test_units_and_defaults(tmp_path):
    part = load(tmp_path, HEAD + "dimensions:\n  - {diameter: bore, tolerance: [-0.01, 21 um]}\n")
    (place,), (one,) = part.places, part.dimensions
    assert place.origin.tolist() == [1.0, 0.002, 0.003]
    assert (place.rotation @ [1, 0, 0]).tolist() == [0, 1, 0]
    assert one.tolerance == (-1e-5, 21e-6) and one.nominal == 0.03
    assert part.probing.tip("any").diameter == 0.004
    assert part.expansion.coefficient == 0 and part.share_of_tolerance == 0.2


def test_a_circle_is_at_its_depth(tmp_path):
    more = """\
  C: {plane: x-, at: 0, from: [10, 10], to: [70, 30], points: [3, 2]}
  hole: {bore: z, at: [50, 40], diameter: 12, depths: 50, points: 6}
dimensions:
  - {distance: [C, hole]}
"""
    part = load(tmp_path, HEAD + more)
    by_plane = weights(part, part.dimensions[0])["C"]
    # The plane's height at the centre, beside and above its points: of a straight fit.
    x = part.features["C"].points[:, 1:] - [0.04, 0.05]
    spread = ((x - x.mean(axis=0)) ** 2).sum(axis=0)
    expected = np.sqrt(1 / len(x) + (x.mean(axis=0) ** 2 / spread).sum())
    assert_allclose(np.linalg.norm(by_plane), expected, rtol=1e-8)


def test_a_plane_through_three_points_has_no_form(tmp_path):
    more = """\
  B: {plane: z+, at: 40, from: [0, 0], to: [1, 1], points: three.csv}
dimensions:
  - {flatness: B, tolerance: 8 um, nominal: 2 um}
"""
    (tmp_path / "three.csv").write_text("x_mm,y_mm,z_mm\n10,50,40\n90,50,40\n10,10,40\n")
    text = HEAD.replace("[1 m, 2, 3]", "[300, 300, 300]").replace("0.4 um", "0.02 um")
    (tmp_path / "part.yaml").write_text(text + more)
    (one,) = bp.part(tmp_path / "part.yaml", bp.quickstart()).dimensions
    assert one.value is None and one.reason == "B: 3 points fit any form; add some"


def test_points_in_a_table(tmp_path):
    turns = np.arange(8) * np.pi / 4
    rows = [
        f"{(10 + z) * np.cos(t):.12f},{(10 + z) * np.sin(t):.12f},{z}"
        for z in (0, 4)
        for t in turns
    ]
    (tmp_path / "scan.csv").write_text("\n".join(["x_mm,y_mm,z_mm", *rows]))
    text = "  seat: {cone: z+, apex: [0, 0, -10], angle: 90 deg, depths: [10, 14], points: scan.csv}\n  base: {points: scan.csv, fit: plane, normal: z-}\n"
    text += "dimensions:\n  - {perpendicularity: seat, datums: A}\n"
    features = load(tmp_path, HEAD + text).features
    seat, base = features["seat"], features["base"].nominal
    assert_allclose(distances(seat.nominal, seat.points), 0, atol=1e-15)
    # The plane between both circles.
    assert_allclose(base.centre, [0, 0, 2e-3], atol=1e-12)
    assert_allclose(base.direction, [0, 0, -1], atol=1e-9)


def test_what_is_open_is_said_by_dimension(tmp_path):
    more = """\
  strip: {like: A, points: [4, 1]}
  hole: {like: bore, at: [150, 40]}
  cross: {bore: x, at: [40, 30], diameter: 9, depths: [45, 55], points: 6}
dimensions:
  - {flatness: strip}
  - {position: bore, datums: A}
  - {position: cross, datums: [A, bore]}
  - {position: cross, datums: [A, bore, hole], name: own}
  - {perpendicularity: bore, datums: A}
"""
    said = load(tmp_path, HEAD + more).undetermined
    assert list(said) == ["flatness strip", "position bore", "position cross"]
    assert said["flatness strip"].startswith("strip: its points do not determine the direction of")
    assert said["position bore"].startswith("A leave motions of it open; add a datum")
    assert said["position cross"].startswith("A and bore leave motions of it open")


def test_mistakes_are_told_where_they_are(tmp_path):
    more = """\
  other: {like: boer, at: [50, 40]}
dimensions:
  - {diameter: bore}
"""
    assert refusal(tmp_path, more) == [
        '8: features.other.like: no such feature above; did you mean "bore"?'
    ]
    more = """\
  hole: {bore: z, at: [50 mm/m, 40], diameter: 30, depths: 8, points: 8}
dimensions:
  - {diameter: hole}
"""
    assert refusal(tmp_path, more) == [
        '8: features.hole.at[0]: "50 mm/m" is a ratio; a length is expected, for example "750 mm"'
    ]
    more = """\
  hole: {bore: z, at: [50, 40], diameter: 30, depths: 8, points: 8, angle: 1 deg}
  pin: {shaft: z, at: [50, 40], depths: 8, points: 8}
dimensions:
  - {position: bore}
  - {diameter: bore, tolerance: 1 deg}
"""
    assert refusal(tmp_path, more) == [
        "8: features.hole.angle: unknown key; known: probe, helix",
        '9: features.pin.diameter: missing; add "diameter" (diameter)',
        '11: dimensions[0].datums: missing; add "datums" (features in their order)',
        '12: dimensions[1].tolerance: "1 deg" is an angle; a length is expected, for example'
        ' "750 mm"',
    ]
    more = """\
  edge: {line: x, on: bore, at: {z: 30}, from: 20, to: 180, points: 5}
dimensions:
  - {diameter: bore}
"""
    assert refusal(tmp_path, more) == [
        '8: features.edge: "bore" is no plane above it; name one that it is on'
    ]


def test_dimensions_without_a_meaning_are_refused(tmp_path):
    more = """\
  other: {like: bore, at: [10, 40]}
dimensions:
  - {diameter: boer}
  - {flatness: bore}
  - {parallelism: bore, datums: A}
  - {diameter: bore}
  - {diameter: bore}
  - {distance: [A, bore]}
  - {distance: [bore, bore]}
  - {angle: [bore, other]}
  - {position: A, datums: [A]}
"""
    assert refusal(tmp_path, more) == [
        '10: dimensions[0].diameter: no feature "boer"; did you mean "bore"?',
        "11: dimensions[1].flatness: a cylinder has no flatness; name a plane",
        "12: dimensions[2].parallelism: bore has no nominal parallelism to A",
        '14: dimensions[4]: another is called "diameter bore"; add name: …',
        "15: dimensions[5].distance: of features that are not parallel; state an angle",
        "16: dimensions[6].distance: is 0; state a position",
        "17: dimensions[7].angle: of parallel directions; state their orientation",
        "18: dimensions[8].datums: A is its own datum; name others",
    ]


def test_the_schema_is_shipped_and_accepts_the_example():
    assert schema() == json.loads(Path("designs/part-schema.json").read_text())
    lint = [sys.executable, "-m", "check_jsonschema", "--schemafile", "designs/part-schema.json"]
    subprocess.run([*lint, "designs/parts/block.yaml"], check=True, capture_output=True)
