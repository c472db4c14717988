"""Names that the measuring program gives: of its probes, of features with what no rule needs, in
one column of a table.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from decimal import Decimal
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.laboratory.feature_names import named
from ballplate.simulator.experiment.readings_section import check_rule
from ballplate.simulator.inputs.messages import ExperimentError

from tests.extensions.laboratory import makers
from tests.extensions.laboratory.makers import Ball
from tests.extensions.laboratory.tables import (
    DESIGN,
    QUICKSTART,
    ROWS,
    assert_all_planned,
    names_read,
    of_table,
)

D = Decimal
TIPS = {"T1A0B0": "down", "T2A90B0": "left", "T3A90B180": "right", "T4": "front", "T5": "back"}
TIP_OF = {probe: tip for tip, probe in TIPS.items()}
SWAPPED = {"left": "right", "right": "left"}


def table(name: Callable[[Any], str], more: str = "") -> str:
    lines = [
        "Element;X;Y;Z",
        *(f"{name(row)};{row.x_mm!r};{row.y_mm!r};{row.z_mm!r}" for row in ROWS),
    ]
    return "\n".join([*lines, more, ""])


@pytest.mark.parametrize(("stated", "tip_of"), [(TIPS, TIP_OF), (SWAPPED, SWAPPED)])
def test_probes_of_tables_have_the_names_of_the_program(
    tmp_path: Path, stated: object, tip_of: Mapping[str, str]
) -> None:
    """They may be those of other probes."""
    lines = ["position,ball,probe,x_mm,y_mm,z_mm"]
    lines += [
        ",".join(map(str, [*row[:2], tip_of.get(row.probe, row.probe).lower(), *row[3:]]))
        for row in ROWS
    ]
    assert_all_planned(of_table(tmp_path, "\n".join(lines), probes=stated))
    text = table(lambda row: f"{row.position}/{row.ball}/{tip_of.get(row.probe, row.probe)}")
    rule = "{position}/{ball}/{probe}"
    assert_all_planned(of_table(tmp_path, text, names=rule, unit="mm", probes=stated))


def test_columns_of_a_wide_table_have_the_names_of_the_program(tmp_path: Path) -> None:
    rows = [row for row in ROWS if row.position == "x low"]
    tips = [TIP_OF[probe] for probe in dict.fromkeys(row.probe for row in rows)]
    lines = [";".join(["ball", *(f"{axis} {tip} [mm]" for tip in tips for axis in "XYZ")])]
    for ball in dict.fromkeys(row.ball for row in rows):
        own = {TIP_OF[row.probe]: row for row in rows if row.ball == ball}
        cells = [repr(getattr(own[tip], f"{axis}_mm")) for tip in tips for axis in "xyz"]
        lines.append(";".join([ball, *cells]))
    found = of_table(tmp_path, "\n".join(lines), "x low.csv", probes=TIPS)
    assert sorted(names_read(found)) == sorted(row[:3] for row in rows)


@pytest.mark.parametrize("form", ["dmis", "pcdmis", "calypso"])
def test_probes_of_reports_have_the_names_of_the_program(tmp_path: Path, form: str) -> None:
    offsets = {name: DESIGN.probes.offsets[k] for k, name in enumerate(DESIGN.probes.names)}
    balls = []
    for row in ROWS:
        centre = np.array([row.x_mm, row.y_mm, row.z_mm]) + 1000 * offsets[row.probe]
        x, y, z = (round(D(value), 9) for value in centre.tolist())
        sensor = "" if form == "calypso" else TIP_OF[row.probe]
        place = row.position.replace(" ", "")
        name = f"{place}_{row.ball}" + f"_{TIP_OF[row.probe]}" * (form == "calypso")
        balls.append(Ball(name, sensor, (x, y, z)))
    text = getattr(makers, form)(balls)
    if form == "pcdmis":
        # The maker has no line of the tip.
        pieces = text.split("DIM LOC")
        tips = [f"TIP/{ball.sensor}, SHANKIJK=0, 0, 1\nDIM LOC" for ball in balls]
        text = pieces[0] + "".join(a + b for a, b in zip(tips, pieces[1:], strict=True))
    assert_all_planned(of_table(tmp_path, text, "report.txt", probes=TIPS), 1e-9)


def test_a_report_of_the_program_of_points_has_the_planned_readings(tmp_path: Path) -> None:
    program, report = tmp_path / "plate.dmi", tmp_path / "plate.dmo"
    given = ["--points", str(program), "--ball-diameter", "22 mm"]
    assert main(["sheet", "designs/quickstart.yaml", *given]) == 0
    kept = [
        re.sub(r"^F\(", "FA(", line)
        for line in program.read_text(encoding="utf-8").splitlines()
        if not line.startswith(("MEAS", "PTMEAS", "ENDMES", "MODE"))
    ]
    report.write_text("\n".join([*kept, ""]), encoding="utf-8")
    found = bp.read_report(report, QUICKSTART)
    names = found.to_frame()[["position", "ball", "probe"]].itertuples(index=False, name=None)
    assert sorted(names) == sorted(row[:3] for row in ROWS)
    assert "coordinates: ball centres" in found.key


def test_a_probe_that_the_experiment_lacks_is_refused() -> None:
    with pytest.raises(ExperimentError, match='unknown probe "dwon"; did you mean "down"'):
        QUICKSTART.with_readings({"probes": {"T1": "dwon"}})


@pytest.mark.parametrize(
    ("rule", "name", "spelt"),
    [
        ("SPH_{position}_{ball}_{probe}_*", "SPH_{0}_{1}_{2}_0{3}", str),
        ("*_{position}_{ball}_{probe}", "KUG {3}_{0}_{1}_{2}", str.upper),
        ("SPH({position},{ball},{probe})*", "SPH({0},{1},{2}) {3}", lambda x: x.replace(" ", "_")),
        ("{position}.*.{ball}.{probe}", "{0}.M{3}-x.{1}.{2}", str.upper),
        ("{probe}*{ball}@{position}", "{2} no {3} {1}@{0}", str),
    ],
)
def test_one_column_of_a_table_has_all_names(
    tmp_path: Path, rule: str, name: str, spelt: Callable[[str], str]
) -> None:
    count = iter(range(1, 1000))
    text = table(
        lambda row: spelt(name.format(row.position, row.ball, row.probe, next(count))),
        "PLANE_TOP;1;2;3\nORIGIN;0;0;0",
    )
    found = of_table(tmp_path, text, names=rule, unit="mm")
    assert_all_planned(found)
    assert any(
        f"names are read as {rule}; left out, of another form (2): " in one for one in found.remarks
    )


def test_the_rule_is_for_what_has_no_names_of_the_experiment(tmp_path: Path) -> None:
    lines = ["ball,probe,x_mm,y_mm,z_mm"]
    rows = [row for row in ROWS if row.position == "x low"]
    lines += [f"{row.ball},{row.probe},{row.x_mm!r},{row.y_mm!r},{row.z_mm!r}" for row in rows]
    found = of_table(tmp_path, "\n".join(lines), "x low.csv", names="{position}_{ball}")
    assert {name for name, *_ in names_read(found)} == {"x low"}


def test_a_column_and_a_name_that_contradict_each_other_are_refused(tmp_path: Path) -> None:
    text = "position;ball;x_mm;y_mm;z_mm\nz low;zhigh_r1c1;1;2;3\n"
    with pytest.raises(ExperimentError) as caught:
        of_table(tmp_path, text, names="{position}_{ball}")
    assert 'has the position z high, and its column "z low"; state one' in str(caught.value)


def test_no_name_of_the_rule_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ExperimentError, match="state the rule with --name"):
        of_table(tmp_path, table(lambda row: f"K{row.ball}"), names="SPH_{ball}", unit="mm")


def read(names: list[str], rule: str) -> list[tuple[str, ...] | None]:
    found = named(names, rule, DESIGN, "f", TIPS)
    return [None if parts is None else tuple(parts.values()) for parts in found.parts]


@pytest.mark.parametrize(
    ("rule", "name", "expected"),
    [
        ("SPH_{ball}_*", "SPH_R1C1_001", ("r1c1",)),
        ("SPH_{ball}_*", "sph-r01c01-x-y", ("r1c1",)),
        ("*_{ball}", "A_B_r5c5", ("r5c5",)),
        # A number is never parted.
        ("*{ball}", "xr1c1", ("r1c1",)),
        ("{ball}*", "r1c15", None),
        ("{ball}_*", "r1c1", None),
        ("SPH_*", "SPH_r1c1", None),
        ("{position}_{ball}_{probe}", "ZLOW.r1c1.T1A0B0", ("z low", "r1c1", "down")),
        ("{position}_{ball}_{probe}*", "ZLOW.r1c1.t2a90b0 (2)", ("z low", "r1c1", "left")),
        ("{position}_{ball}_{run}", "z_low r1c1:007", ("z low", "r1c1", "007")),
    ],
)
def test_what_a_star_leaves_open(rule: str, name: str, expected: tuple[str, ...] | None) -> None:
    if expected is None:
        with pytest.raises((ExperimentError, ValueError)):
            read([name], check_rule(rule))
    else:
        assert read([name], rule) == [expected]


def test_a_name_that_a_star_leaves_in_doubt_is_left(tmp_path: Path) -> None:
    assert read(["r1c1_r2c2", "r1c1_x"], "*{ball}*") == [None, ("r1c1",)]
    # Two features of one ball by the rule are counted.
    balls = [Ball(f"SPH_r1c1_{k}", "", (D(k), D(2), D(3))) for k in range(1, 4)]
    (tmp_path / "z low.txt").write_text(makers.dmis(balls), encoding="utf-8")
    report = bp.read_report(tmp_path / "z low.txt", QUICKSTART, name="SPH_{ball}_*")
    assert report.to_frame()["ball"].tolist() == ["r1c1"] * 3
    assert any('ball "r1c1" is read 3 times in position "z low"' in one for one in report.remarks)


def test_without_an_experiment_a_star_is_anything() -> None:
    found = named(["SPH_a_001", "SPH_b_002"], "SPH_{ball}_*", None, "f")
    assert found.parts == ({"ball": "a"}, {"ball": "b"})
    with pytest.raises(ExperimentError, match="in several ways"):
        named(["SPH_a_1_1"], "SPH_{ball}_*", None, "f")
