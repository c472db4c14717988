"""A chosen design written as a file is the same design when it is read again."""

from __future__ import annotations

from dataclasses import fields, replace
from itertools import count
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from ballplate.extensions.campaign.sheet import sheet_of
from ballplate.extensions.planning.constraints import with_chosen
from ballplate.extensions.planning.experiment_file import experiment_text
from ballplate.extensions.planning.schedule import run_sheet
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Candidate, Experiment, Position

from tests.extensions.own_models.test_custom_model import GOOD
from tests.reference.copies import copy_file

FOLDER = Path("designs/planning")
NUMBERS = count()


def same(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray):
        return one.shape == other.shape and bool(
            np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
        )
    if hasattr(one, "__dataclass_fields__"):
        return all(
            same(getattr(one, field.name), getattr(other, field.name)) for field in fields(one)
        )
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return bool(one == other)


def assert_same(one: Design, other: Design) -> None:
    for field in fields(one):
        if field.name != "model":
            assert same(getattr(one, field.name), getattr(other, field.name)), field.name
    assert [p.name for p in one.model.parameters] == [p.name for p in other.model.parameters]


def planned(path: Path, variant: str | None = None) -> Experiment:
    (found,) = [one for one in load(path, planning=True) if one.name == variant]
    return found


def written(
    experiment: Experiment, chosen: tuple[Candidate, ...], path: Path, **more: Any
) -> Experiment:
    path.parent.mkdir(exist_ok=True)
    path.write_text(
        experiment_text(experiment, chosen, "chosen here", path.parent, **more), "utf-8"
    )
    (found,) = load(path)
    return found


def test_a_sheet_of_the_file_has_the_minutes_of_the_plan(tmp_path: Path) -> None:
    """Of positions with times of their own too, in the order of the file."""
    experiment = planned(FOLDER / "campaign.yaml")
    assert experiment.pool is not None
    chosen = Random(2).sample(experiment.pool.candidates, 12)
    expected = run_sheet(chosen, experiment.pool.changes)
    path = tmp_path / "chosen.yaml"
    written(experiment, expected.written, path)
    found = sheet_of(planned(path)).sheet
    assert found.timed
    times = [
        [(one.name, one.change_seconds, one.seconds, one.start) for one in sheet.steps]
        for sheet in (found, expected)
    ]
    assert len(times[0]) > 8 and len({one[2] for one in times[0]}) > 1
    for (name, *minutes), (other, *others) in zip(*times, strict=True):
        assert name == other and minutes == pytest.approx(others, abs=1e-6)
    assert sheet_of(load(path)[0]).sheet.timed is False


@pytest.mark.parametrize(("name", "number"), [("plate-pool", 25), ("campaign", 12)])
@pytest.mark.parametrize("seed", range(2))
def test_round_trip(name: str, number: int, seed: int, tmp_path: Path) -> None:
    experiment = planned(FOLDER / f"{name}.yaml")
    assert experiment.pool is not None
    random = Random(seed)
    candidates = experiment.pool.candidates
    chosen = [*random.sample(candidates, number), *(one for one in candidates[-2:] if seed == 1)]
    sheet = run_sheet(list(dict.fromkeys([candidates[0], *chosen])), experiment.pool.changes)
    found = written(experiment, sheet.chosen, tmp_path / "chosen.yaml")
    expected = with_chosen(experiment, sheet.chosen)
    assert found.pool is None and [one.name for one in found.positions] == [
        one.name for one in expected.positions
    ]
    assert_same(lay_out(found), lay_out(expected))
    if set(expected.artefacts) == set(experiment.artefacts):
        items = tuple(one.item for one in sheet.calibration)
        positions = tuple(one.item for one in sheet.chosen if isinstance(one.item, Position))
        plain = replace(experiment, positions=positions, calibration=experiment.calibration + items)
        assert_same(lay_out(found), lay_out(plain))


def test_lengths_that_no_short_number_states(tmp_path: Path) -> None:
    text = (FOLDER / "campaign.yaml").read_text("utf-8")
    text = text.replace("[50 mm, 300 mm, 550 mm]", "{from: 1 in, to: 553.1 mm, count: 7}").replace(
        "x: [0 mm, 300 mm, 600 mm]", "x: [0.1234567890123456 mm, 11 in, 0.7 um]"
    )
    (tmp_path / "odd.yaml").write_text(text, "utf-8")
    experiment = planned(tmp_path / "odd.yaml")
    assert experiment.pool is not None
    chosen = tuple(one for one in experiment.pool.candidates if isinstance(one.item, Position))
    assert_same(
        lay_out(written(experiment, chosen, tmp_path / "c.yaml")),
        lay_out(with_chosen(experiment, chosen)),
    )


SOURCE = """\
# what stood at the top
title: from a campaign   # kept
machine: {volume: [1 m, 1 m, 1 m], repeatability: 1 um}

# the model
error_model: {kind: python, object: "own_scale_model:build", options: {scales: true}}
true_machine: {kind: machine, file: machines/true.yaml}
probes: {down: [0 mm, 0 mm, -50 mm]}
artefacts:
  # read from a table
  plate: {kind: balls, file: tables/balls.csv}
  spare: {kind: two_spheres, length: 300 mm, role: length_standard}
positions:
  - {name: one, artefact: plate, plane: z, level: 100 mm, corner: {x: 0 mm, y: 0 mm}}
  - {name: two, artefact: plate, plane: z, level: 300 mm, corner: {x: 0 mm, y: 0 mm}}
calibration:
  - {kind: coordinates, artefact: plate, standard_uncertainty: 1 um, values: tables/certificate.csv}
pool:
  candidates:
    - {name: more, artefact: plate, planes: [z], levels: [500 mm], corners: {x: 100 mm, y: 100 mm}}
    - {name: "on", artefact: spare, pose: {origin: [300 mm, 300 mm, 1e2 mm]}}
evaluation: {points: {file: tables/points.csv}}
expected_rank_deficiency: 3
seed: 5   # kept as well
variants:
  as is: {}
  lower:
    pool.candidates[more].levels: [450 mm]
    seed: 7
    positions[one].level: 110 mm
    priors: [{parameter: scale x, standard_uncertainty: 1 ppm}]
"""


@pytest.fixture
def source(tmp_path: Path) -> Path:
    """A file that names others: tables, a machine file, and a module beside it."""
    folder = tmp_path / "campaign"
    (folder / "tables").mkdir(parents=True)
    (folder / "machines").mkdir()
    copy_file("designs/park/machines/gec-like.yaml", folder / "machines" / "true.yaml")
    # Python knows a module by its name, wherever it was.
    module = f"own_scale_model_{next(NUMBERS)}"
    (folder / f"{module}.py").write_text(GOOD)
    (folder / "tables/balls.csv").write_text("ball,x_mm,y_mm\na,0,0\nb,200,0\nc,0,200\n")
    (folder / "tables/certificate.csv").write_text(
        "ball,x_mm,y_mm,z_mm\na,0,0,0\nb,200.01,0,0\nc,0,200.02,0\n"
    )
    (folder / "tables/points.csv").write_text("x_mm,y_mm,z_mm\n1,2,3\n400,500,600\n")
    (folder / "campaign.yaml").write_text(SOURCE.replace("own_scale_model", module), "utf-8")
    return folder / "campaign.yaml"


def by_name(experiment: Experiment, *names: str) -> tuple[Candidate, ...]:
    assert experiment.pool is not None
    known = {one.name: one for one in experiment.pool.candidates}
    return tuple(known[name] for name in names)


def test_what_belongs_to_no_chosen_position_is_left_out(source: Path) -> None:
    experiment = planned(source, "as is")
    chosen = by_name(experiment, "more z 500 mm at 100, 100 mm", "one")
    found = written(experiment, chosen, source.parent / "chosen.yaml")
    assert_same(lay_out(found), lay_out(with_chosen(experiment, chosen)))
    text = (source.parent / "chosen.yaml").read_text("utf-8")
    assert text.startswith("# chosen here\n\ntitle: from a campaign\n")
    # The bar stands nowhere.
    for gone in ("spare", "candidates", "variants", "expected_rank_deficiency"):
        assert gone not in text


def test_elsewhere_files_are_found_again(source: Path, tmp_path: Path) -> None:
    experiment = planned(source, "lower")
    chosen = by_name(experiment, "two", "one", "on", "more z 450 mm at 100, 100 mm")
    path = tmp_path / "out" / "chosen.yaml"
    found = written(experiment, chosen, path, expected_rank_deficiency=4)
    assert_same(lay_out(found), lay_out(with_chosen(experiment, chosen)))
    assert found.seed == 7 and found.expected_rank_deficiency == 4
    assert [one.name for one in found.positions] == [
        "two",
        "one",
        "on",
        "more z 450 mm at 100, 100 mm",
    ]
    assert found.positions[1].pose.origin[2] == 0.11
    text = path.read_text("utf-8")
    for name in (
        "tables/balls.csv",
        "tables/certificate.csv",
        "tables/points.csv",
        "machines/true.yaml",
    ):
        assert f"../campaign/{name}" in text
    assert "folder: ../campaign" in text


def test_tables_of_readings_and_stars_are_found_again(source: Path, tmp_path: Path) -> None:
    folder = source.parent
    (folder / "tables/tips.csv").write_text("probe,x_mm,y_mm,z_mm\ndown,0,0,-50\nup,0,0,60\n")
    (folder / "tables/covariance.csv").write_text("covariance_um2,a b,a c\na b,2,1\na c,1,2\n")
    (folder / "tables/lengths.csv").write_text("ball_1,ball_2,distance_mm\na,b,200\na,c,200\n")
    item = """calibration:
  - {kind: distances, artefact: plate, pairs: [[a, b], [a, c]], values: tables/lengths.csv,
     covariance: tables/covariance.csv}"""
    text = source.read_text("utf-8").replace("calibration:", item)
    text = text.replace("-50 mm]}", "-50 mm], up: [0 mm, 0 mm, 60 mm]}")
    for end in ("y: 0 mm}", "y: 100 mm}", "1e2 mm]}"):
        text = text.replace(f"{end}}}", f"{end}, probes: [down, up]}}")
    text += """stars: [{standard_uncertainty: 1 um, values: tables/tips.csv}]
readings:
  files: [tables/today.csv, tables/tomorrow.csv]
  compensation: {file: machines/true.yaml}
"""
    source.write_text(text, "utf-8")
    experiment = planned(source, "as is")
    chosen = by_name(experiment, "two", "one")
    found = written(experiment, chosen, tmp_path / "out" / "chosen.yaml")
    assert_same(lay_out(found), lay_out(with_chosen(experiment, chosen)))
    assert [(tmp_path / "out" / name).resolve() for name in found.readings.named_files] == [
        folder / "tables/today.csv",
        folder / "tables/tomorrow.csv",
    ]


def test_an_influence_of_a_position_left_out_goes_with_it(source: Path, tmp_path: Path) -> None:
    text = """influences:
  - {kind: position scale, standard_uncertainty: 1 um/m, positions: [two]}
  - {kind: drift, axes: {standard_uncertainty: 2 um/h}, times: {set_up: 30 min, reading: 20 s}}
"""
    plates = source.read_text("utf-8").replace(", role: length_standard", "")
    source.write_text(plates + text, "utf-8")
    experiment = planned(source, "as is")
    chosen = by_name(experiment, "one", "more z 500 mm at 100, 100 mm")
    found = written(experiment, chosen, tmp_path / "out" / "chosen.yaml")
    (drift,) = found.influences
    assert drift.kind == "drift"  # type: ignore[attr-defined]
    assert drift.times.set_up == 1800.0  # type: ignore[attr-defined]


def test_texts_that_look_like_numbers_stay_texts(source: Path) -> None:
    text = (
        source.read_text("utf-8")
        .replace("name: one,", 'name: "1e-6",')
        .replace("[one].level", "[1e-6].level")
    )
    source.write_text(text.replace('name: "on"', 'name: "0o17"'), "utf-8")
    experiment = planned(source, "as is")
    chosen = by_name(experiment, "1e-6", "0o17", "two")
    found = written(experiment, chosen, source.parent / "chosen.yaml")
    assert [one.name for one in found.positions] == ["1e-6", "0o17", "two"]


def test_positions_of_a_file_that_has_none(source: Path) -> None:
    text = source.read_text("utf-8")
    start, end = text.index("positions:\n"), text.index("calibration:\n")
    text = text[:start] + text[end : text.index("variants:")]
    source.write_text(text, "utf-8")
    experiment = planned(source)
    assert experiment.positions == ()
    chosen = by_name(experiment, "more z 500 mm at 100, 100 mm", "on")
    found = written(experiment, chosen, source.parent / "chosen.yaml")
    assert_same(lay_out(found), lay_out(with_chosen(experiment, chosen)))
