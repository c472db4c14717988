"""A sweep takes along the files that its experiments name, and no other."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from ballplate.cli import main
from ballplate.extensions.sweeps import bundle as bundles
from ballplate.extensions.sweeps.bundle import bundle_of
from ballplate.extensions.sweeps.load import load_sweep
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.inputs.yamltree import read_tree

from tests.extensions.sweeps import wording

EXPERIMENT = """\
title: "../secret/id_rsa"
description: "secret.txt"
machine: {volume: [1 m, 1 m, 1 m], repeatability: 0.2 um}
error_model: {kind: kinematic, position_coefficients: 2, rotation_coefficients: 2}
probes: {down: [0 mm, 0 mm, -50 mm]}
artefacts: {plate: {kind: balls, file: balls.csv}}
positions:
  - {name: "secret.txt", pose: {origin: [100 mm, 100 mm, 100 mm]}}
  - {name: "../secret/id_rsa", pose: {origin: [200 mm, 100 mm, 300 mm], rotation: [20 deg, 10 deg, 0 deg]}}
calibration: [{kind: coordinates, standard_uncertainty: 0.2 um, values: balls.csv}]
variants: {other: {artefacts.plate.file: other.csv}, "secret.txt": {}}
"""
SWEEP = """\
title: "secret.txt"
base: e.yaml
variant: other
axes:
  plate: {path: artefacts.plate.file, values: {one: balls.csv, two: third.csv}}
  words: {path: description, values: [secret.txt, ../secret/id_rsa]}
record: [U4]
"""
BALLS = "ball,x_mm,y_mm,z_mm\na,0,0,0\nb,300,0,0\nc,0,300,0\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    own = tmp_path / "own"
    (tmp_path / "secret").mkdir()
    own.mkdir()
    (tmp_path / "secret/id_rsa").write_text("PRIVATE KEY")
    for name, text in (("e.yaml", EXPERIMENT), ("s.yaml", SWEEP), ("secret.txt", "PRIVATE KEY")):
        (own / name).write_text(text)
    for name in ("balls.csv", "other.csv", "third.csv"):
        (own / name).write_text(BALLS)
    return own


def names(folder: Path, *further: Path) -> list[str]:
    return [name for name, _ in bundle_of(load_sweep(folder / "s.yaml", folders=further)).files]


def test_only_paths_are_paths(folder: Path) -> None:
    assert names(folder) == ["balls.csv", "e.yaml", "other.csv", "s.yaml", "third.csv"]


@pytest.mark.parametrize("where", ["base", "axis"])
def test_a_file_outside_is_refused_or_allowed_by_its_folder(where: str, folder: Path) -> None:
    (folder.parent / "common").mkdir()
    (folder.parent / "common/balls.csv").write_text(BALLS)
    path = folder / ("e.yaml" if where == "base" else "s.yaml")
    old = "file: balls.csv" if where == "base" else "two: third.csv"
    path.write_text(path.read_text().replace(old, old.partition(": ")[0] + ": ../common/balls.csv"))
    with pytest.raises(ExperimentError) as raised:
        load_sweep(folder / "s.yaml")
    message = str(raised.value.messages[0])
    assert str(path) in message
    assert wording.OUTSIDE_THE_FOLDERS_OF_THE_SWEEP_AND_ITS_BASE in message
    assert "common/balls.csv" in names(folder, folder.parent / "common")
    options = ["--workers", "2", "--folder", str(folder.parent / "common")]
    assert main(["sweep", str(folder / "s.yaml")]) == 3
    assert main(["sweep", str(folder / "s.yaml"), *options]) == 0


def test_readings_of_the_base_stay_where_they_are(folder: Path) -> None:
    """Cells fit none; what tells how readings were made is another matter."""
    (folder.parent / "lab.csv").write_text("position,ball,x_mm,y_mm,z_mm\n")
    (folder / "own.csv").write_text("position,ball,x_mm,y_mm,z_mm\n")
    stated = "readings: {files: [../lab.csv, own.csv]}\n"
    (folder / "e.yaml").write_text(EXPERIMENT.replace("variants:", f"{stated}variants:"))
    assert names(folder) == ["balls.csv", "e.yaml", "other.csv", "s.yaml", "third.csv"]
    assert main(["sweep", str(folder / "s.yaml"), "--workers", "1"]) == 0
    axis = SWEEP.replace(
        "  words:", "  lab: {path: readings.files, values: [../lab.csv]}\n  words:"
    )
    (folder / "s.yaml").write_text(axis)
    assert names(folder) == ["balls.csv", "e.yaml", "other.csv", "s.yaml", "third.csv"]
    (folder.parent / "curve.csv").write_text("position_mm,EXX_um\n0,0\n500,1\n1000,2\n")
    curves = "true_machine: {kind: curves, files: [../curve.csv]}\n"
    (folder / "e.yaml").write_text(EXPERIMENT.replace("variants:", f"{stated}{curves}variants:"))
    with pytest.raises(ExperimentError, match=wording.OUTSIDE_THE_FOLDERS_OF_THE_SWEEP):
        load_sweep(folder / "s.yaml")


def test_a_link_to_a_file_outside_is_refused(folder: Path) -> None:
    (folder / "balls.csv").unlink()
    (folder.parent / "secret/balls.csv").write_text(BALLS)
    (folder / "balls.csv").symlink_to(folder.parent / "secret/balls.csv")
    with pytest.raises(ExperimentError, match="outside"):
        load_sweep(folder / "s.yaml")


ROOTED = ("C:\\balls.csv", "/balls.csv", "~/balls.csv")


def files_of(folder: Path, text: str) -> list[Path]:
    """Files of the sweep with another experiment in place of its base."""
    sweep = load_sweep(folder / "s.yaml")
    (folder / "other.yaml").write_text(text)
    return bundles.files_of(replace(sweep, trees={None: read_tree(folder / "other.yaml")}))


@pytest.mark.parametrize("name", ROOTED)
def test_names_from_a_root_or_a_drive_are_left_out(name: str, folder: Path) -> None:
    beside = folder / name
    if beside.is_relative_to(folder):
        # Here some of these are names of files beside the experiment.
        beside.parent.mkdir(exist_ok=True)
        beside.write_text(BALLS)
    found = files_of(folder, f"artefacts: {{a: {{file: '{name}'}}, b: {{file: other.csv}}}}\n")
    assert [path.name for path in found] == [
        "balls.csv",
        "e.yaml",
        "other.csv",
        "s.yaml",
        "third.csv",
    ]


def test_modules_come_with_what_they_import(folder: Path) -> None:
    (folder / "mine.py").write_text("import math\nimport helper\nfrom tools.inner import one\n")
    (folder / "helper.py").write_text("import deeper\n")
    (folder / "deeper.py").write_text("import helper\n")
    (folder / "unrelated.py").write_text("KEY = 'PRIVATE KEY'\n")
    (folder / "tools").mkdir()
    for name in ("__init__.py", "inner.py", "other.py"):
        (folder / "tools" / name).write_text("one = 1\n")
    (folder / "tools/notes.txt").write_text("PRIVATE KEY")
    found = files_of(folder, "error_model: {kind: python, object: 'mine:build'}\n")
    modules = [path.relative_to(folder).as_posix() for path in found if path.suffix != ".yaml"]
    assert modules == [
        "balls.csv",
        "deeper.py",
        "helper.py",
        "mine.py",
        "third.csv",
        "tools/__init__.py",
        "tools/inner.py",
        "tools/other.py",
    ]


def test_too_much_is_refused(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bundles, "MOST_BYTES", 100)
    assert main(["sweep", str(folder / "s.yaml"), "--workers", "1"]) == 3
    assert wording.ARE_THE_LIMIT_OF_A_STORE in capsys.readouterr().err
