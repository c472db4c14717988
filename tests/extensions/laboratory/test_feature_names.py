"""Positions, balls and probes out of names of features, by rules that are found, told or given."""

from __future__ import annotations

from pathlib import Path

import ballplate as bp
import pytest
from ballplate.cli import main
from ballplate.extensions.laboratory.feature_names import named, position_of_file
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.readings_section import check_rule
from ballplate.simulator.inputs.messages import ExperimentError

from tests.extensions.laboratory import wording
from tests.extensions.laboratory.tables import DESIGN

QUICKSTART = "designs/quickstart.yaml"


def parts(names: list[str], rule: str | None = None, design: object = DESIGN) -> list[object]:
    found = named(names, rule, design, "f")  # type: ignore[arg-type]
    return [found.rule, *(None if one is None else tuple(one.values()) for one in found.parts)]


def refusal(names: list[str], rule: str | None = None, design: object = DESIGN) -> str:
    with pytest.raises(ExperimentError) as caught:
        named(names, rule, design, "f")  # type: ignore[arg-type]
    return str(caught.value)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("z low_r1c1_down", ["{position}_{ball}_{probe}", ("z low", "r1c1", "down")]),
        ("ZLOW R1C1 DOWN", ["{position}_{ball}_{probe}", ("z low", "r1c1", "down")]),
        ("SPH_z-low.r2c5", ["SPH_{position}_{ball}", ("z low", "r2c5")]),
        ("x_high_left_r5c5", ["{position}_{probe}_{ball}", ("x high", "r5c5", "left")]),
        ("r3c3:Y LOW:back", ["{ball}_{position}_{probe}", ("y low", "r3c3", "back")]),
        ("r3c3", ["{ball}", ("r3c3",)]),
        ("Kugel r3c3", ["KUGEL_{ball}", ("r3c3",)]),
        ("zlow_07_down", ["{position}_{ball}_{probe}", ("z low", "r2c2", "down")]),
        ("1_25_down", ["{position}_{ball}_{probe}", ("z low", "r5c5", "down")]),
    ],
)
def test_names_of_an_experiment_are_found_in_many_forms(name: str, expected: list[object]) -> None:
    found = parts([name])
    assert found[0] == expected[0]
    # In the order of the rule's places.
    assert set(found[1]) == set(expected[1])  # type: ignore[call-overload]


def test_numbers_are_told_and_names_come_first() -> None:
    assert named(["zlow_07_down"], None, DESIGN, "f").numbered == ("ball",)
    assert named(["zlow_r1c1_down"], None, DESIGN, "f").numbered == ()
    assert parts(["zlow_r1c1_down", "zlow_07_down"])[2] is None


def test_what_can_be_read_in_two_ways_is_refused(tmp_path: Path) -> None:
    text = Path(QUICKSTART).read_text(encoding="utf-8")
    text = text.replace("left", "r1c1").replace("right", "r1c2")
    (tmp_path / "twin.yaml").write_text(text, encoding="utf-8")
    design = lay_out(bp.load(tmp_path / "twin.yaml"))
    told = refusal(["x low_r1c1_r1c2", "x low_r1c2_r1c1"], None, design)
    assert wording.THE_NAMES_CAN_BE_READ in told
    rule = "{position}_{probe}_{ball}"
    assert named(["x low_r1c1_r1c2"], rule, design, "f").parts == (
        {"position": "x low", "probe": "r1c1", "ball": "r1c2"},
    )


def test_names_that_are_not_of_the_experiment_say_what_is() -> None:
    assert wording.NO_NAMES_OF_THE_EXPERIMENT in refusal(["KUGEL A", "KUGEL B"])


@pytest.mark.parametrize(
    ("names", "rule", "first"),
    [
        (["P1_r1c1_down", "P2_r1c1_left"], "{position}_{ball}_{probe}", ("P1", "r1c1", "down")),
        (["P1.r1c1", "P2.r1c2"], "{position}.{ball}", ("P1", "r1c1")),
        (["B1", "B2"], "{ball}", ("B1",)),
        (["a-b_1-c", "a-d_1-e"], "{position}_{ball}", ("a-b", "1-c")),
    ],
)
def test_without_an_experiment_names_are_parted_alike(
    names: list[str], rule: str, first: tuple[str, ...]
) -> None:
    assert parts(names, None, None)[:2] == [rule, first]


def test_without_an_experiment_what_is_not_alike_is_refused() -> None:
    assert wording.NO_RULE_PARTS_THE_NAMES_INTO in refusal(["P_1", "P_1_2_3"], None, None)
    told = refusal(["z_low_r1c1"], "{position}_{ball}", None)
    assert wording.THE_NAME_CAN_BE_PARTED in told


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        ("{position}", "needs {ball}"), ("{ball}_{ball}", "each place at most once"),
        ("{bal}", '"bal" in a rule of names'), ("{ball}_{", "a brace without its other one"),
        ("{point}{ball}", '"point" in a rule of names'), ("", "needs {ball}"),
    ],
)  # fmt: skip
def test_rules_that_are_wrong_are_refused(
    rule: str, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(ValueError, match=message.replace("{", r"\{")):
        check_rule(rule)
    with pytest.raises(SystemExit):
        main(["import", "report", "-o", "-", "--name", rule])
    assert message in capsys.readouterr().err


def test_a_file_tells_the_position_if_no_name_does() -> None:
    assert position_of_file("2026-03-04 Z_low run 2", DESIGN, "f") == "z low"
    assert position_of_file("anything", None, "f") == "anything"
    for stem in ("plate", "z low x low"):
        with pytest.raises(ExperimentError, match=wording.PUT_IT_INTO_THE_FILES_NAME):
            position_of_file(stem, DESIGN, "f")


SPHERES = "UNITS/MM\nSNSLCT/SA({sensor})\nFA({name})=FEAT/SPHERE,OUTER,CART,1,2,3,4\nENDFIL\n"


@pytest.mark.parametrize(
    ("sensor", "name", "probe"),
    [("LEFT", "xlow_r1c1", "left"), ("TIP_9", "zlow_r1c1", "down"), ("LEFT", "xlow_r1c1_right", "right")],
)  # fmt: skip
def test_probes_are_of_the_name_then_the_sensor_then_the_plan(
    tmp_path: Path, sensor: str, name: str, probe: str
) -> None:
    path = tmp_path / "a.dmo"
    path.write_text(SPHERES.format(sensor=sensor, name=name), encoding="utf-8")
    assert bp.read_report(path, QUICKSTART).to_frame()["probe"].tolist() == [probe]


def test_a_probe_that_nothing_tells_is_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "a.dmo"
    path.write_text(SPHERES.format(sensor="TIP_9", name="xlow_r1c1"), encoding="utf-8")
    with pytest.raises(ExperimentError) as caught:
        bp.read_report(path, QUICKSTART)
    assert str(caught.value) == (
        f'{path}:3:1: the sensor "TIP_9" does not state which probe read "xlow_r1c1": left, right;'
        " name features or sensors by the experiment's probes, or state the rule with --name"
    )


def test_several_files_each_of_a_position(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    paths = []
    for stem in ("z low", "z high"):
        paths.append(tmp_path / f"{stem}.dmo")
        text = SPHERES.format(sensor="DOWN", name="r1c1")
        paths[-1].write_text(text, encoding="utf-8")
    written = tmp_path / "readings.csv"
    assert main(["import", *map(str, paths), "--for", QUICKSTART, "-o", str(written)]) == 0
    lines = written.read_text(encoding="utf-8").splitlines()
    assert lines[-3:] == [
        "position,ball,probe,x_mm,y_mm,z_mm",
        "z low,r1c1,down,1.0,2.0,3.0",
        "z high,r1c1,down,1.0,2.0,3.0",
    ]
    assert all(line.startswith("# ") for line in lines[:-3])
    assert wording.POSITION_BY_THE_NAME_OF_THE_FILE in capsys.readouterr().err
    assert main(["import", str(paths[0]), "-o", str(paths[1])]) == 3
    assert main(["import", str(paths[0]), "-o", str(paths[0]), "--force"]) == 2


def test_points_of_one_name_and_their_numbers_are_those_of_a_ball(tmp_path: Path) -> None:
    path = tmp_path / "a.dmo"
    places = [(11, 0, 0), (-11, 0, 0), (0, 11, 0), (0, -11, 0), (0, 0, 11), (0, 8.8, 6.6)]
    points = "\n".join(
        f"FA(zlow r1c1 down #{k})=FEAT/POINT,CART,{100 + x},{200 + y},{300 + z},0,0,1"
        for k, (x, y, z) in enumerate(places)
    )
    path.write_text(f"UNITS/MM\n{points}\nENDFIL\n", encoding="utf-8")
    found = bp.read_report(path, QUICKSTART)
    (one,) = found.readings
    assert [round(1e3 * value, 6) for value in one.centre] == [100, 200, 300]
    told = found.told
    assert told[0].endswith("taken: 1 sphere centre; left: nothing")
    assert told[1].startswith(wording.CENTRE_IS_OF_POINTS)
