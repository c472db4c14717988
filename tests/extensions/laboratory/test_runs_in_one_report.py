"""Runs of a program whose results are in one report: told apart as positions, or counted and asked
about, and never merged as repeats in silence.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from decimal import Decimal
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.laboratory.formats.runs import runs_of
from ballplate.simulator.inputs.messages import ExperimentError

from tests.extensions.laboratory import makers
from tests.extensions.laboratory.makers import Ball
from tests.extensions.laboratory.tables import ROWS, names_read, of_table

D = Decimal
QUICKSTART = "designs/quickstart.yaml"


def of_run(run: int, names: Sequence[str] = ("r1c1", "r1c2", "r2c1")) -> list[Ball]:
    """Balls as one run of the program measured them: each run at another place."""
    return [
        Ball(name, "", (D(f"{100 * run + 10 * k}.0012"), D(f"20.00{run}1"), D("250.0007")))
        for k, name in enumerate(names)
    ]


def calypso_parts(runs: int, heading: str = "partnb", texts: str = "1 2 3") -> str:
    tables = [makers.calypso(of_run(run)).replace("partnb", heading, 1) for run in range(runs)]
    pieces = [table.removesuffix("END\r\n").split("\r\n", 1) for table in tables]
    head, labels = pieces[0][0], texts.split()
    rows = (
        body.replace("PLATE\t1", f"PLATE\t{label}")
        for (_, body), label in zip(pieces, labels, strict=False)
    )
    return f"{head}\r\n{''.join(rows)}END\r\n"


def calypso_by_characteristic(runs: int) -> str:
    """The rows of all runs of one characteristic below each other."""
    head, *rows, end, last = calypso_parts(runs).split("\r\n")
    return "\r\n".join([head, *sorted(rows, key=lambda row: row.split("\t")[2]), end, last])


def pcdmis_parts(runs: int, what: str = "SER NUMBER : {}") -> str:
    return "".join(
        makers.pcdmis(of_run(run)).replace("SER NUMBER : 1", what.format(run + 1))
        for run in range(runs)
    )


def dmis_files(runs: int) -> str:
    return "".join(makers.dmis(of_run(run)) for run in range(runs))


def dmis_points(runs: int) -> str:
    """Spheres that are probed at points, in a single file."""
    lines = ["DMISMN/'A',05.2", "FILNAM/'A'", "UNITS/MM"]
    lines += [f"F({ball.name})=FEAT/SPHERE,OUTER,CART,1,2,3,22" for ball in of_run(0)]
    for run in range(runs):
        lines.append(f"PS(1)=PARTSN/'{run + 1}'")
        for ball in of_run(run):
            x, y, z = map(float, ball.centre)
            lines.append(f"MEAS/SPHERE,F({ball.name}),6")
            lines += [
                f"PTMEAS/CART,{x + a:.7f},{y + b:.7f},{z + c:.7f},0,0,1"
                for a, b, c in (
                    (11, 0, 0),
                    (-11, 0, 0),
                    (0, 11, 0),
                    (0, -11, 0),
                    (0, 0, 11),
                    (6.6, 8.8, 0),
                )
            ]
            lines.append("ENDMES")
    return "\n".join([*lines, "ENDFIL", ""])


def qif_results(runs: int) -> str:
    texts = [makers.qif(of_run(run)) for run in range(runs)]
    results = [
        re.search("<MeasurementResults id.*</MeasurementResults>", text, re.DOTALL)
        for text in texts
    ]
    every = "".join(
        re.sub(r'id="(\d+)"', rf'id="{run}\1"', found[0])
        for run, found in enumerate(results)
        if found
    )
    assert results[0] is not None
    return texts[0].replace(results[0][0], every)


RUNS: dict[str, Callable[[int], str]] = {
    "part numbers": calypso_parts,
    "part numbers, by characteristic": calypso_by_characteristic,
    "a column that no list has": lambda runs: calypso_parts(runs, "Durchgang", "a b c"),
    "serial numbers": pcdmis_parts,
    "times of day": lambda runs: pcdmis_parts(runs, "DATE=04-Mar-26     TIME=09:1{}:31 AM"),
    "files of DMIS": dmis_files,
    "times of DMIS": lambda runs: "FILNAM/'A'\n" + "".join(
        makers.dmis(of_run(run)).replace("FILNAM/", "$$").replace("UNITS", f"TIME/10:0{run}:00\nUNITS")
        for run in range(runs)
    ),
    "points of DMIS": dmis_points,
    "results of QIF": qif_results,
}  # fmt: skip


@pytest.mark.parametrize("runs", [1, 2, 3])
@pytest.mark.parametrize("kind", RUNS)
def test_each_run_is_a_position(tmp_path: Path, kind: str, runs: int) -> None:
    path = tmp_path / "report.txt"
    path.write_text(RUNS[kind](runs), encoding="utf-8")
    read = bp.read_report(path)
    table = read.to_frame()
    assert len(table) == 3 * runs
    assert table["position"].nunique() == runs
    assert not table.duplicated(["position", "ball"]).any()
    groups = [group for _, group in table.groupby("position", sort=False)]
    for run, group in enumerate(groups):
        expected = [[float(value) for value in ball.centre] for ball in of_run(run)]
        np.testing.assert_allclose(group[["x_mm", "y_mm", "z_mm"]], expected, atol=1e-6)
    told = [one for one in read.remarks if f"{runs} runs by" in one]
    assert len(told) == (runs > 1)
    assert not any(one.startswith("warning") for one in read.remarks)


DMIS_NAMES = {
    "file names": (("a", ""), ("b", ""), ["a 1", "b 2"]),
    "serial numbers": (("x", "a"), ("x", "b"), ["x 1", "x 2"]),
    "a comma and a blank": (("a, b", ""), ("a, b", ""), ["a, b 1", "a, b 2"]),
}


@pytest.mark.parametrize("kind", DMIS_NAMES)
def test_files_of_dmis_are_named_without_quotes_and_versions(tmp_path: Path, kind: str) -> None:
    first, second, expected = DMIS_NAMES[kind]
    lines = list[str]()
    for run, (name, serial) in enumerate((first, second)):
        lines += [f"FILNAM/'{name}',04.0", "UNITS/MM,ANGDEC"]
        lines += [f"PS(p)=PARTSN/'{serial}'"] if serial else []
        for ball in of_run(run):
            x, y, z = ball.centre
            lines.append(f"FA({ball.name})=FEAT/SPHERE,OUTER,CART,{x},{y},{z},22.0")
        lines.append("ENDFIL")
    path = tmp_path / "report.dmo"
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")
    positions = bp.read_report(path).to_frame()["position"]
    assert list(positions.unique()) == [f"report {text}" for text in expected]


@pytest.mark.parametrize("form", ["calypso", "pcdmis", "dmis", "qif"])
def test_runs_that_nothing_tells_apart_are_counted(tmp_path: Path, form: str) -> None:
    texts = {
        "calypso": calypso_parts(2, texts="1 1"),
        "pcdmis": pcdmis_parts(2, "SER NUMBER : 1"),
        "dmis": re.sub("FILNAM/.*", "", dmis_files(2)),
        "qif": qif_results(2)
        .replace("</MeasurementResults><MeasurementResults", "<")
        .replace('< id="12">', ""),
    }
    path = tmp_path / "report.txt"
    path.write_text(texts[form], encoding="utf-8")
    read = bp.read_report(path)
    assert len(read.to_frame()) == 6
    (warning,) = [one for one in read.remarks if one.startswith("warning")]
    assert 'ball "r1c1" is read 2 times in position "report", as are 2 others (2 runs' in warning


def exact(positions: Sequence[str]) -> list[list[Ball]]:
    """Ball centres of positions of the quickstart, which one probe reads, as they are planned."""
    return [
        [
            Ball(row.ball, "", (D(row.x_mm), D(row.y_mm), D(row.z_mm) - 50))
            for row in ROWS
            if row.position == position
        ]
        for position in positions
    ]


def test_fit_matches_runs_by_their_places(tmp_path: Path) -> None:
    text = "".join(
        makers.pcdmis(balls).replace("SER NUMBER : 1", f"SER NUMBER : SN-{run}")
        for run, balls in enumerate(exact(["z low", "z high"]), start=17)
    )
    found = of_table(tmp_path, text, "monday.txt")
    assert [name for name, *_ in names_read(found)] == ["z low"] * 25 + ["z high"] * 25
    told = " ".join(found.remarks)
    assert "2 runs by SER NUMBER (SN-17, SN-18), each is a position of its own" in told
    assert "monday SN-17 = z low, monday SN-18 = z high" in told


def test_the_rule_names_a_position_by_its_run(tmp_path: Path) -> None:
    simulated = exact(["z low", "z high"])
    balls = [
        Ball(f"{ball.name}/{name}", "", ball.centre)
        for name, run in zip(("ZLOW", "ZHIGH"), simulated, strict=True)
        for ball in run
    ]
    (tmp_path / "any.txt").write_text(makers.dmis(balls), encoding="utf-8")
    read = bp.read_report(tmp_path / "any.txt", QUICKSTART, name="{ball}/{run}")
    assert read.to_frame()["position"].tolist() == ["z low"] * 25 + ["z high"] * 25
    serial = "".join(
        makers.pcdmis(run).replace("SER NUMBER : 1", f"SER NUMBER : {name}")
        for name, run in zip(("Z-LOW", "Z-HIGH"), simulated, strict=True)
    )
    # The file's name is of another position, but the rule counts.
    (tmp_path / "x low.txt").write_text(serial, encoding="utf-8")
    read = bp.read_report(tmp_path / "x low.txt", QUICKSTART, name="{run}_{ball}")
    assert read.to_frame()["position"].tolist() == ["z low"] * 25 + ["z high"] * 25


def test_runs_of_a_position_that_the_file_names_are_refused_unless_planned(tmp_path: Path) -> None:
    path = tmp_path / "z low.txt"
    path.write_text(pcdmis_parts(3), encoding="utf-8")
    read = bp.read_report(path, QUICKSTART)
    assert read.to_frame()["position"].unique().tolist() == ["z low"]
    assert any(
        "3 runs by SER NUMBER (1, 2, 3), in the same positions" in one for one in read.remarks
    )
    assert any(one.startswith('warning: ball "r1c1" is read 3 times') for one in read.remarks)
    with pytest.raises(ExperimentError):
        bp.fit(QUICKSTART, path)


def test_what_differs_within_a_run_tells_no_runs() -> None:
    keys = ["a", "b", "a", "b"]
    for texts in ("1 2 3 4", "1 2 1 2", "1 1 1 1", "1 2 2 3"):
        assert runs_of(keys, [{"sigma": text} for text in texts.split()]) == ([""] * 4, "")
    assert runs_of(keys, [{}, {}, {"part": "7"}, {"part": "8"}]) == (["7", "7", "7", "8"], "part")
    assert runs_of([], []) == ([], "")
