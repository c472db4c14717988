"""What each reader of reports takes, leaves and refuses, in files that state known centres."""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.laboratory.formats.registered import FORMATS, read_report
from ballplate.extensions.laboratory.formats.report import Feature
from ballplate.simulator.inputs.messages import ExperimentError

from tests.extensions.laboratory import makers, wording
from tests.extensions.laboratory.makers import Ball

D = Decimal
BALLS = [
    Ball("P1_r1c1", "DOWN", (D("10.00012"), D("-20.50003"), D("300.12345"))),
    Ball("P1_r1c2", "DOWN", (D("-0.00310"), D("0.00000"), D("1.00000"))),
    Ball("P2_r1c1", "LEFT", (D("510.98765"), D("2.00001"), D("30.00000"))),
]
WRITTEN: dict[str, Callable[[], str]] = {
    "dmis": lambda: makers.dmis(BALLS),
    "dmis inch": lambda: makers.dmis(BALLS, "INCH", "25.4"),
    "dmis feet": lambda: makers.dmis(BALLS, "FEET", "304.8"),
    "dmis m": lambda: makers.dmis(BALLS, "M", "1000"),
    "pcdmis": lambda: makers.pcdmis(BALLS),
    "pcdmis newer": lambda: makers.pcdmis(BALLS, newer=True),
    "calypso": lambda: makers.calypso(BALLS),
    "calypso with commas": lambda: makers.calypso(BALLS, comma=True),
    "german": lambda: makers.german(BALLS),
    "qif 2": lambda: makers.qif(BALLS, 2),
    "qif 3": lambda: makers.qif(BALLS, 3),
}


def features(tmp_path: Path, text: str | bytes, name: str = "report") -> tuple[Feature, ...]:
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_report(path).features


def spheres(tmp_path: Path, text: str | bytes) -> dict[str, tuple[float, ...] | None]:
    return {one.name: one.centre for one in features(tmp_path, text) if one.kind != "plane"}


def refusal(tmp_path: Path, text: str, **settings: str) -> str:
    path = tmp_path / "report"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ExperimentError) as caught:
        bp.read_report(path, **settings)  # type: ignore[arg-type]
    return str(caught.value).replace(str(path), "report")


@pytest.mark.parametrize("kind", WRITTEN)
def test_centres_are_those_that_were_written(tmp_path: Path, kind: str) -> None:
    found = spheres(tmp_path, WRITTEN[kind]())
    assert list(found) == [ball.name for ball in BALLS]
    for ball in BALLS:
        expected = [float(value) / 1000 for value in ball.centre]
        np.testing.assert_allclose(found[ball.name], expected, rtol=0, atol=1e-15)


@pytest.mark.parametrize("kind", WRITTEN)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_encodings_and_line_ends_change_nothing(tmp_path: Path, kind: str, encoding: str) -> None:
    text = WRITTEN[kind]()
    expected = spheres(tmp_path, text)
    if encoding == "utf-16":
        text = text.replace('encoding="UTF-8"', 'encoding="UTF-16"')
    for end in ("\n", "\r\n", "\r"):
        content = (end.join(text.splitlines()) + end).encode(encoding)
        assert spheres(tmp_path, content) == expected


def test_every_format_recognises_its_own_and_no_other() -> None:
    for kind, write in WRITTEN.items():
        recognised = [one.name for one in FORMATS if one.recognises(write())]
        own = {"german": "calypso"}.get(kind, kind.split()[0])
        assert recognised == [own]
    for text in (
        "",
        "position,ball,probe,x_mm,y_mm,z_mm\nP1,r1c1,down,1,2,3\n",
        "title: a plate\n",
    ):
        assert not [one.name for one in FORMATS if one.recognises(text)]


def test_what_is_left_is_counted(tmp_path: Path) -> None:
    path = tmp_path / "report"
    path.write_text(makers.dmis(BALLS), encoding="utf-8")
    found = bp.read_report(path)
    assert found.told == (
        f"{path}: DMIS output; taken: 3 sphere centres; left: 1 plane, 1 tolerance",
    )
    assert found.to_frame().to_dict("list") == {
        "position": ["P1", "P1", "P2"],
        "ball": ["r1c1", "r1c2", "r1c1"],
        "probe": ["DOWN", "DOWN", "LEFT"],
        "x_mm": [10.00012, -0.0031, 510.98765],
        "y_mm": [-20.50003, 0.0, 2.00001],
        "z_mm": [300.12345, 1.0, 30.0],
    }
    assert found.remarks == (f"{path}: names are read as {{position}}_{{ball}}",)


DMIS = "FILNAM/'A'\nUNITS/{units}\n{lines}\nENDFIL\n"


@pytest.mark.parametrize(
    ("units", "plane", "written", "expected"),
    [
        ("MM,ANGDEC", "XYPLAN", "POL,100,30,7", (86.60254037844386, 50.0, 7.0)),
        ("MM,ANGDEC", "YZPLAN", "POL,100,30,7", (7.0, 86.60254037844386, 50.0)),
        ("MM,ANGDEC", "ZXPLAN", "POL,100,30,7", (50.0, 7.0, 86.60254037844386)),
        ("MM,ANGRAD", "XYPLAN", "POL,100,1.5707963267948966,7", (0.0, 100.0, 7.0)),
        ("MM,ANGDMS", "XYPLAN", "POL,100,29:59:60,7", (86.60254037844386, 50.0, 7.0)),
        ("CM,ANGDEC", "XYPLAN", "CART,1.5,-2,+.5", (15.0, -20.0, 5.0)),
        ("INCH,ANGDEC,TEMPC", "XYPLAN", "CART,1,2E+0,3.", (25.4, 50.8, 76.2)),
    ],
)
def test_dmis_in_all_units_and_polar(
    tmp_path: Path, units: str, plane: str, written: str, expected: tuple[float, ...]
) -> None:
    line = f"WKPLAN/{plane}\nFA(S1) = FEAT/SPHERE, {written}, 22"
    found = spheres(tmp_path, DMIS.format(units=units, lines=line))
    np.testing.assert_allclose(found["S1"], np.array(expected) / 1000, atol=1e-15)


def test_dmis_tells_systems_and_sensors(tmp_path: Path) -> None:
    lines = """D(M)=DATSET/MCS
SNSLCT/SA(TIP_1)
FA(A_1)=FEAT/SPHERE,OUTER,CART,1,2,3,4
D(PART)=DATSET/DAT(A),ZDIR,ZORIG
SNSLCT/S(TIP2),SNSANG,0
FA(A_2)=FEAT/SPHERE,OUTER,CART,1,2,3,4
RECALL/D(M)
FA(A_3)=FEAT/SPHERE,OUTER,CART,1,2,3,4
RECALL/DA(PART)
FA(A_4)=FEAT/SPHERE,OUTER,CART,1,2,3,4"""
    found = features(tmp_path, DMIS.format(units="MM", lines=lines))
    assert [(one.probe, one.system, one.of) for one in found] == [
        ("TIP_1", "machine", ""), ("TIP2", "part", "PART"), ("TIP2", "machine", ""), ("TIP2", "part", "PART"),
    ]  # fmt: skip
    read = bp.read_report(tmp_path / "report")
    assert wording.CENTRES_ARE_IN_A_PARTS_CO in read.remarks[-2]
    assert read.remarks[-1].startswith(wording.CENTRES_IN_THE_MACHINES)
    assert "coordinates: ball centres" in read.key


def test_a_part_system_throughout_is_told_as_the_key_to_state(tmp_path: Path) -> None:
    lines = "D(PART)=DATSET/DAT(A),ZDIR\nFA(P_1)=FEAT/SPHERE,OUTER,CART,1,2,3,4"
    (tmp_path / "report").write_text(DMIS.format(units="MM", lines=lines), encoding="utf-8")
    assert "readings: {coordinates: part}" in bp.read_report(tmp_path / "report").key


POINTS = [(0, 0, 11), (11, 0, 0), (-11, 0, 0), (0, 11, 0), (0, -11, 0), (6.6, 8.8, 0)]


def lines_of_points(count: int, word: str = "PTMEAS") -> str:
    texts = [f"{word}/CART,{100 + x},{200 + y},{300 + z},0,0,1" for x, y, z in POINTS[:count]]
    return "\n".join(["MEAS/SPHERE,F(P_1),9", *texts, "ENDMES"])


@pytest.mark.parametrize("word", ["PTMEAS", "PTDATA"])
def test_points_that_were_measured_make_a_sphere(tmp_path: Path, word: str) -> None:
    sphere = "F(P_1)=FEAT/SPHERE,OUTER,CART,100.1,200.1,300.1,22\n"
    text = DMIS.format(units="MM", lines=sphere + lines_of_points(6, word))
    (tmp_path / "report").write_text(text, encoding="utf-8")
    (one,) = bp.read_report(tmp_path / "report").readings
    np.testing.assert_allclose(one.centre, (0.1, 0.2, 0.3), atol=1e-12)
    assert one.uncertainty is not None and one.uncertainty < 1e-12


def test_points_of_a_program_are_no_measurements(tmp_path: Path) -> None:
    sphere = "MODE/PROG,MAN\nF(P_1)=FEAT/SPHERE,OUTER,CART,100,200,300,22\n"
    told = refusal(tmp_path, DMIS.format(units="MM", lines=sphere + lines_of_points(6)))
    assert wording.PTMEAS_OF_A_PROGRAM_ARE_WHERE in told


def test_four_points_are_too_few_and_a_plane_of_points_is_no_sphere(tmp_path: Path) -> None:
    sphere = "F(P_1)=FEAT/SPHERE,OUTER,CART,100,200,300,22\n"
    told = refusal(tmp_path, DMIS.format(units="MM", lines=sphere + lines_of_points(4)))
    assert "1 sphere (has 4 points; a sphere needs 5)" in told
    sphere = sphere.replace("P_1", "P_1r")
    flat = "\n".join(f"FA(P_1r_{k})=FEAT/POINT,CART,{k},{k * k},7,0,0,1" for k in range(6))
    told = refusal(tmp_path, DMIS.format(units="MM", lines=sphere + flat))
    assert wording.SPHERE_HAS_POINTS_ABOUT in told


def test_a_program_has_only_nominal_features(tmp_path: Path) -> None:
    text = DMIS.format(units="MM", lines="F(P_1)=FEAT/SPHERE,OUTER,CART,1,2,3,4")
    assert "1 sphere (nominal only, not measured)" in refusal(tmp_path, text)


def test_what_is_printed_twice_is_taken_once_and_measured_twice_twice(tmp_path: Path) -> None:
    lines = "\n".join(
        f"FA(P_1)=FEAT/SPHERE,OUTER,CART,{x},2,3,4" for x in ("1.0001", "1.0001", "1.0002")
    )
    (tmp_path / "report").write_text(DMIS.format(units="MM", lines=lines), encoding="utf-8")
    found = bp.read_report(tmp_path / "report")
    assert len(found.readings) == 2
    assert "left: 1 sphere (printed again)" in found.told[0]


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("FA(A)=FEAT/SPHERE,OUTER,CART,1,2,3", "report:3:1: 3 numbers instead of 4; was the file cut off?"),
        ("FA(A)=FEAT/SPHERE,OUTER,1,2,3,4", 'report:3:1: "1" where CART or POL is expected'),
        ("FA(A)=FEAT/SPHERE,OUTER,CART,1,2,x,4", 'report:3:1: "x" is not a number; write for example "500.0003"'),
        ("FA(A)=FEAT/SPHERE,OUTER,CART,1,2,,4", 'report:3:1: "" is not a number; write for example "500.0003"'),
        ("FA(A)=FEAT/SPHERE,OUTER,CART,1,2,nan,4", 'report:3:1: "nan" is not a number; write for example "500.0003"'),
        ("UNITS/PARSEC", 'report:3:1: unknown unit "PARSEC"; DMIS has MM, CM, M, INCH, FEET'),
        ("GA(A)=FEAT/SPHERE,OUTER,CART,1,2,3,4", 'report:3:1: "GA(A)=FEAT" is no feature of DMIS; write F(name)=FEAT/… or FA(name)=FEAT/…'),
        ("FA(A)=FEAT/SPHERE,OUTER,CART,1,2,3,4$", 'report:3:1: "4ENDFIL" is not a number; write for example "500.0003"'),
        ("FA(A=FEAT/SPHERE,OUTER,CART,1,2,3,4", 'report:3:1: "FA(A=FEAT/SPHERE,OUTER,CART,1,2,3,4" is no DMIS statement; check whether the file is complete'),
    ],
)  # fmt: skip
def test_wrong_statements_of_dmis_are_told_with_their_lines(
    tmp_path: Path, lines: str, message: str
) -> None:
    told = refusal(tmp_path, DMIS.format(units="MM", lines=lines))
    assert told.split("\n")[0] == message


def test_units_that_are_not_stated_have_to_be_given(tmp_path: Path) -> None:
    text = "FILNAM/'A'\nFA(P_1)=FEAT/SPHERE,OUTER,CART,1,2,3,4\nENDFIL\n"
    told = "no UNITS/ before the first feature; state the unit with --unit mm or --unit in"
    assert refusal(tmp_path, text) == f"report:2:1: {told}"
    (one,) = bp.read_report(tmp_path / "report", unit="in").readings
    np.testing.assert_allclose(one.centre, (0.0254, 0.0508, 0.0762))
    stated = makers.dmis(BALLS)
    (tmp_path / "report").write_text(stated, encoding="utf-8")
    assert bp.read_report(tmp_path / "report", unit="in").to_frame()["x_mm"][0] == 10.00012


def test_rows_of_pcdmis_that_are_damaged_are_told(tmp_path: Path) -> None:
    text = makers.pcdmis(BALLS)
    assert "10.00012" in text
    damaged = text.replace("10.0001200", "10.0901200")
    assert wording.THE_DEVIATION_IS_NOT_MEASURED_MINUS in refusal(tmp_path, damaged)
    short = text.replace("     0.0500     10.0001200", "     10.0001200")
    assert wording.ITS_NUMBERS_ARE_NOT_BELOW_THE_HEADINGS in refusal(
        tmp_path, short.replace("0.0500    10.", "10.")
    )
    headless = text.replace("MEAS", "MIST")
    assert "no column MEAS" in refusal(tmp_path, headless)
    unitless = text.replace("UNITS=MM", "")
    assert wording.NO_UNITS_OF_THIS_DIMENSION in refusal(tmp_path, unitless)


PCDMIS = """DIM #4A,5 LOC1= LOCATION OF SPHERE P1_r1c1  UNITS=MM
AX    NOMINAL       +TOL       -TOL       MEAS        DEV     OUTTOL
X     100.000      0.400      0.400    100.049      0.049      0.000 -----#---
Y     -57.000                          -57.049     -0.049            ---#-----
PART NUMBER=PLATE    DATE=30-Aug-25     TIME=11:56:18 AM           PAGE#=4
Z       1.000      0.400      0.400      1.002      0.002      0.000
DIM #42A,43A LOC7= POSITION OF SPHERE P1_r1c2  UNITS=MM
AX    NOMINAL       +TOL       -TOL      BONUS       MEAS        DEV     OUTTOL
X    -197.000                                    -196.998      0.002
TP        MMC      0.200                 0.000      0.079      0.079      0.000 ---#-----
DIM #6 LOC2= LOCATION OF PLANE PLN24  UNITS=MM
AX    NOMINAL       +TOL       -TOL       MEAS        DEV     OUTTOL
X      57.750      damaged
"""


def test_reports_of_pcdmis_have_names_with_blanks_and_blank_columns(tmp_path: Path) -> None:
    assert spheres(tmp_path, PCDMIS) == {"P1_r1c1": (0.100049, -0.057049, 0.001002)}
    told = bp.read_report(tmp_path / "report").told[0]
    assert wording.DIMENSION_POSITION_OF_SPHERE in told
    # Where a column is blank and the others are not below their headings, it is not clear.
    shifted = PCDMIS.replace("Y     -57.000   ", "Y     -57.000")
    assert wording.ITS_NUMBERS_ARE_NOT_BELOW in refusal(tmp_path, shifted)


def test_circles_of_every_format(tmp_path: Path) -> None:
    texts = (
        DMIS.format(units="MM", lines="FA(P_1)=FEAT/CIRCLE,INNER,CART,1,2,3,0,0,1,22"),
        "DIM A= LOCATION OF CIRCLE P_1 UNITS=MM\nAX MEAS\nX 1\nY 2\nZ 3\n",
        makers.qif([Ball("P_1", "", (D(1), D(2), D(3)))]).replace("Sphere", "Circle"),
    )
    for text in texts:
        (tmp_path / "report").write_text(text, encoding="utf-8")
        (one,) = bp.read_report(tmp_path / "report", circles=True).readings
        assert one.centre == (0.001, 0.002, 0.003)
        assert "circle" in refusal(tmp_path, text)


def test_a_feature_without_all_axes_is_left(tmp_path: Path) -> None:
    every = makers.pcdmis(BALLS).split("\n")
    lines = [line for line in every if not (line.startswith("Z") and " 30.0" in line)]
    (tmp_path / "report").write_text("\n".join(lines), encoding="utf-8")
    found = bp.read_report(tmp_path / "report")
    assert wording.DIMENSION_FLATNESS_OF_PLANE in found.told[0]
    assert '1 left, no row Z: "P2_r1c1"' in found.remarks[0]


QIF3_POINTS = """<MeasuredFeatures n="1"><SphereFeatureMeasurement id="7"><FeatureItemId>1000</FeatureItemId>
<PointList n="2">{refs}</PointList></SphereFeatureMeasurement></MeasuredFeatures>
<MeasuredPointSets n="1"><MeasuredPointSet id="12" count="6"><Points>{points}</Points>
<Compensated>false</Compensated><ProbeRadius>2.5</ProbeRadius></MeasuredPointSet></MeasuredPointSets>
"""


def qif_of_points(refs: str, points: str) -> str:
    text = makers.qif(BALLS[:1], 3)
    before, _, rest = text.partition('<MeasuredFeatures n="9">')
    after = rest.partition("</MeasuredFeatures>")[2]
    return before + QIF3_POINTS.format(refs=refs, points=points) + after


def test_points_of_qif_are_found_through_their_sets(tmp_path: Path) -> None:
    points = " ".join(f"{100 + x} {200 + y} {300 + z}" for x, y, z in POINTS)
    refs = '<RangePointSetId range="2 6">12</RangePointSetId>'
    for more in ("", '<SinglePointSetId index="1">12</SinglePointSetId>'):
        (one,) = features(tmp_path, qif_of_points(refs + more, points))
        assert one.points is not None and len(one.points) == (6 if more else 5)
    (one,) = features(tmp_path, qif_of_points("<WholePointSetId>12</WholePointSetId>", points))
    assert one.points is not None
    np.testing.assert_allclose(one.points[5], (0.1066, 0.2088, 0.3))
    wrong = qif_of_points('<RangePointSetId range="2 7">12</RangePointSetId>', points)
    assert wording.ARE_NOT_AMONG_THE_POINTS in refusal(tmp_path, wrong)
    wrong = qif_of_points("<WholePointSetId>13</WholePointSetId>", points)
    assert wording.NO_POINTS_WITH_THE_ID in refusal(tmp_path, wrong)
    wrong = qif_of_points("<WholePointSetId>12</WholePointSetId>", points + " 1")
    assert wording.CO_ORDINATES_WHICH_IS_NO_MULTIPLE in refusal(tmp_path, wrong)


def test_points_of_qif_2_stand_below_their_sphere(tmp_path: Path) -> None:
    points = "".join(
        f'<MeasurePoint id="{k}"><Point>{100 + x} {200 + y} {300 + z}</Point></MeasurePoint>'
        for k, (x, y, z) in enumerate(POINTS, start=20)
    )
    text = makers.qif(BALLS[:1], 2).replace(
        "<Location>10.00012 -20.50003 300.12345</Location>",
        f'<PointList n="6">{points}</PointList>',
    )
    (tmp_path / "report").write_text(text, encoding="utf-8")
    (one,) = bp.read_report(tmp_path / "report").readings
    np.testing.assert_allclose(one.centre, (0.1, 0.2, 0.3), atol=1e-12)


def test_documents_that_are_no_results_of_qif_are_refused(tmp_path: Path) -> None:
    text = makers.qif(BALLS)
    other = text.replace("qifstandards.org/xsd/qif3", "example.org/x")
    assert wording.QIFDOCUMENT_IS_NO_DOCUMENT_OF_QIF in refusal(tmp_path, other)
    plan = text.replace("MeasurementResults id", "Plan id").replace(
        "/MeasurementResults>", "/Plan>"
    )
    assert wording.NO_MEASUREMENT_RESULTS in refusal(tmp_path, plan)
    unitless = text.replace("LinearUnit>", "MassUnit>")
    assert wording.THE_FILE_STATES_NO_UNIT in refusal(tmp_path, unitless)
    other = text.replace("<Location>10", '<Location linearUnit="furlong">10')
    assert 'unknown unit "furlong"' in refusal(tmp_path, other)


@pytest.mark.parametrize(
    "text", ["", "\n" * 1000, "a,b,c,d\ne,1,2,3\n", "Lorem ipsum\n", "{}", "<a/>"]
)
def test_files_of_no_format_are_refused_with_the_formats_that_there_are(
    tmp_path: Path, text: str
) -> None:
    assert wording.NOT_RECOGNISED_AS_QIF_RESULTS in refusal(tmp_path, text)
