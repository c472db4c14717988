"""Machine files and their tables travel with a sweep and count in its fingerprints."""

from __future__ import annotations

from pathlib import Path

import pytest
from ballplate.extensions.sweeps.bundle import bundle_of, unpack
from ballplate.extensions.sweeps.fingerprint import fingerprint
from ballplate.extensions.sweeps.load import experiment_of, load_sweep
from ballplate.simulator.experiment.loading import load

from tests.reference.copies import copy_tree

SWEEP = """\
title: with a machine file
base: park/plate.yaml
axes:
  repeatability: {path: machine.repeatability, values: [1 um, 2 um]}
trials: 8
record: [U4]
"""


@pytest.fixture
def sweep(tmp_path: Path) -> Path:
    copy_tree("designs/park", tmp_path / "park")
    plate = tmp_path / "park/plate.yaml"
    text = plate.read_text(encoding="utf-8")
    truth = "true_machine: {kind: machine, file: machines/"
    assert truth in text
    # The plate stands within the smaller machine's volume as well.
    text = text.replace(f"{truth}npl-like.yaml", f"{truth}measured-errors.yaml")
    text = text.replace(
        "x: [0 mm, 900 mm], y: [0 mm, 1150 mm]", "x: [0 mm, 800 mm], y: [0 mm, 600 mm]"
    )
    head, _, tail = text.partition("positions:\n")
    kept = (
        "  - {name: low, plane: z, level: 60 mm, corner: {x: 60 mm, y: 60 mm}, probes: [down,"
        " left]}\n"
    )
    plate.write_text(
        head + "positions:\n" + kept + "\n" + tail[tail.index("calibration:") :], encoding="utf-8"
    )
    path = tmp_path / "sweep.yaml"
    path.write_text(SWEEP, encoding="utf-8")
    return path


def test_they_travel(sweep: Path, tmp_path: Path) -> None:
    bundle = bundle_of(load_sweep(sweep))
    names = [name for name, _ in bundle.files]
    machines = "park/machines"
    tables = [path.name for path in Path("designs/park/machines/measured").iterdir()]
    assert len(tables) == 12
    assert sorted(names) == sorted(
        [
            *(f"{machines}/measured/{name}" for name in tables),
            *(f"{machines}/{name}.yaml" for name in ("measured-errors", "npl-like")),
            "park/plate.yaml",
            "sweep.yaml",
        ]
    )
    elsewhere = load_sweep(unpack(bundle, tmp_path / "elsewhere"))
    here = load_sweep(sweep)
    assert [fingerprint(experiment_of(elsewhere, k)) for k in (0, 1)] == [
        fingerprint(experiment_of(here, k)) for k in (0, 1)
    ]


def test_they_count(sweep: Path) -> None:
    folder = sweep.parent / "park"

    def now() -> str:
        return fingerprint(load(folder / "plate.yaml")[0])

    found = [now()]
    for name, old, new in (
        ("machines/measured/exx.csv", "800,", "800,9"),
        ("machines/measured/exx.csv", "z = 400 mm", "z = 399 mm"),
        ("machines/measured/ezx.csv", "minimum zone", "least squares"),
        ("machines/measured-errors.yaml", "21 urad", "22 urad"),
        ("machines/npl-like.yaml", "9 um, -3 um]", "9 um]"),
    ):
        path = folder / name
        text = path.read_text(encoding="utf-8")
        assert old in text
        path.write_text(text.replace(old, new, 1), encoding="utf-8")
        found.append(now())
    assert len(set(found)) == 6
    # Words are only words.
    path = folder / "machines/npl-like.yaml"
    path.write_text(
        path.read_text(encoding="utf-8").replace("title: moving", "title: a moving"),
        encoding="utf-8",
    )
    assert now() == found[-1]
