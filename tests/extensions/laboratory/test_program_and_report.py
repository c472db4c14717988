"""The program of points that `sheet` writes is told from a report of it, and a report that has its
names imports to the planned readings.
"""

from __future__ import annotations

import re
from pathlib import Path

import ballplate as bp
import pytest
from ballplate.cli import main
from ballplate.simulator.inputs.messages import ExperimentError

QUICKSTART = "designs/quickstart.yaml"


@pytest.fixture
def program(tmp_path: Path) -> Path:
    path = tmp_path / "plate.dmi"
    given = ["--points", str(path), "--ball-diameter", "22 mm"]
    assert main(["sheet", QUICKSTART, *given]) == 0
    return path


def test_a_program_is_no_report(program: Path) -> None:
    for experiment in (None, QUICKSTART):
        with pytest.raises(ExperimentError) as caught:
            bp.read_report(program, experiment)
        told = "spheres (PTMEAS of a program are points to probe, not measured points)"
        assert told in str(caught.value)


def test_a_report_of_the_program_has_the_planned_readings(program: Path) -> None:
    kept = [
        re.sub(r"^F\(", "FA(", line)
        for line in program.read_text(encoding="utf-8").splitlines()
        if not line.startswith(("MEAS", "PTMEAS", "ENDMES", "MODE"))
    ]
    report = program.with_suffix(".dmo")
    report.write_text("\n".join([*kept, ""]), encoding="utf-8")
    found = bp.read_report(report, QUICKSTART)
    planned = bp.simulate(QUICKSTART, exact=True)
    keys = ["position", "ball", "probe"]
    read = found.to_frame()
    assert set(read[keys].itertuples(index=False)) == set(planned[keys].itertuples(index=False))
    assert len(read) == len(planned) and "coordinates: ball centres" in found.key
