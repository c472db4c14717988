"""The volume limits what error models are functions of: scale readings, the ball less the probe's
offset.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from ballplate.cli import main
from ballplate.simulator.design.measurement import locations, nominal_state
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.inputs.messages import ExperimentError

from tests.extensions.maps import wording

EXPERIMENT = """\
title: a long probe
machine: {{volume: [1 m, 1 m, 1 m], repeatability: 1 um}}
error_model: {{kind: {model}}}
probes: {{long: [{offset}], short: [0 mm, 0 mm, 0 mm]}}
artefacts:
  plate: {{kind: grid, balls: [3, 3], size: [500 mm, 500 mm]}}
positions:
  - {{name: flat, plane: {plane}, level: {level}, corner: {corner}, probes: {probes}}}
calibration:
  - {{kind: coordinates, standard_uncertainty: 1 um}}
"""


def write(
    folder: Path,
    offset: Sequence[float] = (0.0, 0.0, -0.4),
    plane: str = "z",
    level: str = "300 mm",
    corner: str = "{x: 100 mm, y: 100 mm}",
    probes: str = "[long]",
    model: str = "kinematic",
) -> str:
    listed = ", ".join(f"{1000 * one} mm" for one in offset)
    path = folder / "e.yaml"
    path.write_text(
        EXPERIMENT.format(
            offset=listed, plane=plane, level=level, corner=corner, probes=probes, model=model
        )
    )
    return str(path)


def test_scale_readings_outside_are_refused_though_the_balls_are_inside(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path, level="900 mm", probes="[short, long]")
    assert main(["simulate", path, "-o", str(tmp_path / "r.csv")]) == 3
    assert capsys.readouterr().err.removeprefix(f"{path}:") == (
        '8:5: positions[0]: reading ball "r1c1" with probe "long" moves the scales to z ='
        " 1300 mm (the ball at 900 mm less the offset of -400 mm), 300 mm above the"
        " measuring volume, and 8 more readings; move the artefact, or read it otherwise\n"
    )
    assert not (tmp_path / "r.csv").exists()


def test_a_file_is_accepted_just_where_all_scale_readings_are_inside(tmp_path: Path) -> None:
    """Readings as the design has them, in random places with random probes."""
    generator = np.random.default_rng(5)
    accepted = 0
    for _ in range(40):
        offset, at = (
            generator.uniform(-0.3, 0.3, 3).round(3),
            generator.uniform(-0.3, 0.9, 3).round(3),
        )
        plane = "xyz"[generator.integers(3)]
        axes = [axis for axis in "xyz" if axis != plane]
        corner = ", ".join(f"{axis}: {1000 * at['xyz'.index(axis)]} mm" for axis in axes)
        level = f"{1000 * at['xyz'.index(plane)]} mm"
        text = {"offset": offset, "plane": plane, "level": level, "corner": f"{{{corner}}}"}
        path = Path(write(tmp_path, **text))
        narrow = path.read_text()
        path.write_text(
            narrow.replace("[1 m, 1 m, 1 m]", "{x: [-2 m, 3 m], y: [-2 m, 3 m], z: [-2 m, 3 m]}")
        )
        design = lay_out(load(path)[0])
        balls = locations(design, nominal_state(design), design.readings)
        x = balls - design.probes.offsets[design.readings.probe]
        expected = bool((x >= -1e-9).all() and (x <= 1 + 1e-9).all())
        path.write_text(narrow)
        if expected:
            assert len(load(path)) == 1
        else:
            with pytest.raises(ExperimentError, match=wording.PUTS_THE_SCALES):
                load(path)
        accepted += expected
    assert 1 < accepted < 39


def test_readings_outside_are_told_by_fit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, readings = write(tmp_path, level="300 mm"), tmp_path / "r.csv"
    assert main(["simulate", path, "-o", str(readings)]) == 0
    main(["fit", path, str(readings)])
    assert "extrapolated" not in capsys.readouterr().err
    # The whole plate stood 350 mm higher than planned, and its last ball stands in line 10.
    lines = readings.read_text().splitlines()
    cells = [line.split(",") for line in lines[1:]]
    higher = [
        ",".join([*row[:-1], repr(float(row[-1]) + 350 + (k == 8) * 0.02)])
        for k, row in enumerate(cells)
    ]
    readings.write_text("\n".join([lines[0], *higher]))
    main(["fit", path, str(readings)])
    told = [line for line in capsys.readouterr().err.splitlines() if "extrapolated" in line]
    assert told == [wording.READINGS_ARE_OUTSIDE_THE_MEASURING_VOLUME]
