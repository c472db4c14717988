"""Tables with semicolons, tabs and decimal commas mean what those with commas and points mean, at
every place that reads a table.
"""

import ast
import csv
import io
import re
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.certificates.certificate_files import certified_values, read_certificate
from ballplate.extensions.machine_files import load_machine
from ballplate.extensions.maps.point_files import read_points as points_to_correct
from ballplate.extensions.parts.acceptance_readings import acceptance_evaluation
from ballplate.extensions.parts.acceptance_rules import Agreed
from ballplate.extensions.parts.measured_parts import read_part_points
from ballplate.extensions.parts.part_file import load_part
from ballplate.extensions.parts.part_values import lay_out_part
from ballplate.extensions.parts.touched import of_design
from ballplate.extensions.splines.read_points import read_points
from ballplate.simulator.inputs import ExperimentError, LengthFunction
from ballplate.simulator.inputs.tables import read_table
from ballplate.simulator.readings import read_readings

ROOT = Path(__file__).parents[2]

EXPERIMENT = """\
title: a table at every place
machine: {volume: [1 m, 1 m, 1 m], repeatability: 0.2 um}
error_model: {kind: metric}
true_machine: {kind: curves, files: [exx.csv]}
probes: {down: [0 mm, 0 mm, -50 mm], long: [10 mm, 0 mm, -80 mm]}
stars: [{standard_uncertainty: 1 um, values: star.csv}]
artefacts: {plate: {kind: balls, file: balls.csv}}
positions:
  - {name: one, pose: {origin: [100 mm, 100 mm, 200 mm], rotation: [0 deg, 0 deg, 0 deg]}, probes: [down, long]}
  - {name: two, pose: {origin: [500 mm, 100 mm, 200 mm], rotation: [0 deg, 0 deg, 90 deg]}, probes: [down]}
calibration:
  - {kind: distances, pairs: [[a, b], ["1.5", b]], values: lengths.csv}
  - {kind: coordinates, balls: [a, "1.5"], axes: [x, y], values: coordinates.csv, covariance: covariance.csv}
  - {kind: python, object: "tables_of_own:build", values: own.csv}
influences: [{kind: sag, standard_uncertainty: 1 um, values: sag.csv}]
evaluation: {points: {file: points.csv}, probe: down}
"""
OWN = """\
import numpy as np

class Difference:
    names = (("a", "b"),)
    unit = "m"
    def values(self, balls):
        return np.linalg.norm(balls[0] - balls[1], keepdims=True)
    def derivatives(self, balls):
        found = np.zeros((1, *balls.shape))
        along = (balls[0] - balls[1]) / np.linalg.norm(balls[0] - balls[1])
        found[0, 0], found[0, 1] = along, -along
        return found

def build(names, balls):
    return Difference()
"""
TABLES = {
    # A name that looks like a number, and one with what separates columns.
    "balls.csv": 'ball,x_mm,y_mm,z_mm\na,0,0,0.5\nb,300.25,0,0\n1.5,0,300,0\n"c, d;e",300,300,0\n',
    "lengths.csv": (
        "ball_1,ball_2,distance_mm,expanded_uncertainty_um,k\na,b,300.2512,0.4,2.0\n"
        "1.5,b,424.4409,0.5,2.5\n"
    ),
    "coordinates.csv": "ball,x_mm,y_mm\na,0.001,0.002\n1.5,0.0005,300.001\n",
    "covariance.csv": (
        "covariance_um2,a x,a y,1.5 x,1.5 y\na x,0.04,0.01,0,0\na y,0.01,0.04,0,0\n"
        "1.5 x,0,0,0.09,-0.01\n1.5 y,0,0,-0.01,0.09\n"
    ),
    "own.csv": "first,second,value_mm,standard_uncertainty_um\na,b,300.2505,0.3\n",
    "sag.csv": 'ball,sag_um\na,0.5\nb,1.25\n1.5,1\n"c, d;e",0.1\n',
    "star.csv": "probe,x_mm,y_mm,z_mm\ndown,0,0,-50.0\nlong,10.001,0,-80.0\n",
    "points.csv": "x_mm,y_mm,z_mm\n100.5,200,300\n500,500,500.25\n",
    "exx.csv": "position_mm,EXX_um,EAX_urad\n0,0.0,0\n500,1.25,-0.5\n1000,2.5,1e-1\n",
}
MACHINE = """\
title: measured
arrangement: MB2
volume: {x: [0 mm, 1000 mm], y: [0 mm, 1000 mm], z: [0 mm, 1000 mm]}
reference_point: [0 mm, 0 mm, 0 mm]
probe: [0 mm, 0 mm, -100 mm]
errors: {EYX: {file: eyx.csv, sigmas: 2}}
"""
OTHERS = {
    "eyx.csv": (
        "# line: y = 400 mm, z = 250.5 mm\nposition_mm,EYX_um,EYX_bandwidth_nm\n0,0.5,1000\n"
        "1000,-1.5,1500.5\n"
    ),
    "spline.csv": (
        "point,feature,nominal_x_mm,nominal_z_mm,error_um\n1,face,10.5,0,1.5\n2,face,20.5,0,2.5\n"
    ),
    "correct.csv": "probe,ball,x_mm,y_mm,z_mm\ndown,a,100.5,200,300\nlong,b,500,500,500.25\n",
}
PART = """\
part: a face
probing: {point_repeatability: 1 um, tip: {diameter: 4}}
places: {there: {origin: [300, 300, 300]}}
features: {top: {points: face.csv, fit: plane, normal: z+}}
dimensions: [{flatness: top}]
"""
FACES = {
    "face.csv": "x_mm,y_mm,z_mm\n0,0,20.5\n50.5,0,20\n0,50,20.25\n50,50,20.75\n",
    "touched.csv": (
        "place,feature,point,x_mm,y_mm,z_mm\nthere,top,1,300.5,300,372\nthere,top,2,350.5,300,372\n"
        "there,top,3,300,350,372.25\nthere,top,4,350,350,372.1\n"
    ),
    "acceptance.csv": (
        "direction,probe,length_mm,measured_mm\n"
        "x,down,100.5,100.5001\nx,down,100.5,100.5002\nx,down,100.5,100.5003\n"
    ),
}
NUMBER = re.compile(r"[+-]?[0-9]+\.[0-9]+(?: mm)?")
# Columns whose entries are names.
NAMES = re.compile(
    r"ball|ball_1|ball_2|first|second|probe|position|point|feature|covariance_um2|item|place|direction"
)


def semicolons(text: str, separator: str = ";", decimal: str = ",", quote: bool = False) -> str:
    """What a spreadsheet writes where decimals have a comma; comments stay as they are."""
    lines = text.splitlines()
    comments = [line for line in lines if line.startswith("#")]
    header, *rows = csv.reader(line for line in lines if not line.startswith("#"))

    def cell(name: str, entry: str) -> str:
        is_number = NUMBER.fullmatch(entry) and not NAMES.fullmatch(name)
        return entry.replace(".", decimal) if is_number else entry

    stream = io.StringIO()
    rule = csv.QUOTE_ALL if quote else csv.QUOTE_MINIMAL
    writer = csv.writer(stream, delimiter=separator, quoting=rule, lineterminator="\n")
    writer.writerow(header)
    writer.writerows([[cell(*pair) for pair in zip(header, row, strict=True)] for row in rows])
    return "\n".join([*comments, stream.getvalue()])


FORMS: dict[str, Callable[[str], str]] = {
    "semicolons": semicolons,
    "tabs": lambda text: semicolons(text, "\t"),
    "quoted commas": lambda text: semicolons(text, ",", quote=True),
    "semicolons, points": lambda text: semicolons(text, ";", "."),
    "a line for the spreadsheet": lambda text: f"sep=;\n{semicolons(text)}",
}


def numbers(value: Any) -> Iterator[Any]:
    """Everything that a value holds, without where it is from."""
    if is_dataclass(value) and not isinstance(value, type):
        for field in fields(value):
            yield from numbers(getattr(value, field.name))
    elif isinstance(value, dict):
        yield from numbers([*value.items()])
    elif isinstance(value, list | tuple):
        for one in value:
            yield from numbers(one)
    elif isinstance(value, np.ndarray):
        yield value.tolist()
    elif isinstance(value, str | int | float):
        yield value


def write(folder: Path, tables: dict[str, str], form: Callable[[str], str]) -> None:
    for name, text in tables.items():
        (folder / name).write_text(form(text), encoding="utf-8")


def experiment_of(folder: Path, form: Callable[[str], str]) -> bp.Experiment:
    write(folder, TABLES, form)
    (folder / "tables_of_own.py").write_text(OWN, encoding="utf-8")
    (folder / "e.yaml").write_text(EXPERIMENT, encoding="utf-8")
    return bp.load(folder / "e.yaml")


def content(folder: Path, form: Callable[[str], str]) -> list[Any]:
    experiment = experiment_of(folder, form)
    truth = bp.simulate(experiment, exact=True).values.tolist()
    return [*numbers(experiment), *numbers(bp.lay_out(experiment)), truth]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One for all: its module is loaded once."""
    return tmp_path_factory.mktemp("tables")


@pytest.mark.parametrize("form", FORMS)
def test_tables_that_an_experiment_names(folder: Path, form: str) -> None:
    assert content(folder, FORMS[form]) == content(folder, str)


@pytest.mark.parametrize("name", TABLES)
def test_every_table_is_part_of_what_is_compared(folder: Path, name: str) -> None:
    changed = {"balls.csv": "300.25", "covariance.csv": "0.09", "points.csv": "500.25"}
    number = changed.get(name) or re.findall(r"[1-9]+\.[0-9]+|0\.[0-9]*[1-9]", TABLES[name])[-1]
    before = content(folder, str)
    assert content(folder, lambda text: text.replace(number, f"{number}01")) != before, number


def content_of_others(folder: Path, form: Callable[[str], str]) -> list[Any]:
    experiment = experiment_of(folder, str)
    write(folder, OTHERS | FACES, form)
    (folder / "part.yaml").write_text(PART, encoding="utf-8")
    part = load_part(folder / "part.yaml")
    laid = lay_out_part(part, of_design(bp.lay_out(experiment)))
    agreed = Agreed(LengthFunction(1e-6), 1e-6)
    test = acceptance_evaluation(folder / "acceptance.csv", agreed)
    machine, volume = folder / "m.yaml", experiment.machine.volume
    machine.write_text(MACHINE, encoding="utf-8")
    return [
        *numbers(load_machine(machine)),
        *numbers(read_points(folder / "spline.csv")),
        *numbers(part),
        *numbers(read_part_points(folder / "touched.csv", laid)),
        *numbers(test),
        *numbers(points_to_correct(folder / "correct.csv", ("down", "long"), "down", volume)),
    ]


@pytest.mark.parametrize("form", FORMS)
def test_tables_that_commands_are_given(folder: Path, form: str) -> None:
    assert content_of_others(folder, FORMS[form]) == content_of_others(folder, str)


@pytest.mark.parametrize("number", ["1500.5", "-1.5,1500", "500.25", "50.5", "372.25", "100.5003"])
def test_every_one_of_these_too(folder: Path, number: str) -> None:
    before = content_of_others(folder, str)
    assert content_of_others(folder, lambda text: text.replace(number, f"{number}1")) != before


@pytest.mark.parametrize("form", FORMS)
def test_readings_and_certificates_of_a_campaign(folder: Path, form: str) -> None:
    experiment = experiment_of(folder, str)
    design = bp.lay_out(experiment)
    bp.simulate(experiment).to_csv(folder / "r.csv", index=False)
    bp.certificate(experiment).to_csv(folder / "c.csv", index=False)
    readings, values = ((folder / name).read_text("utf-8") for name in ("r.csv", "c.csv"))
    plain = read_readings(folder / "r.csv", design).x
    certified = [
        one.value for one in certified_values(read_certificate(folder / "c.csv", experiment))
    ]
    write(folder, {"r.csv": readings, "c.csv": values}, FORMS[form])
    np.testing.assert_array_equal(read_readings(folder / "r.csv", design).x, plain)
    again = certified_values(read_certificate(folder / "c.csv", experiment))
    assert [one.value for one in again] == certified


# Where a table is read, by what reads it: a new place belongs among the tables above.
READERS = {
    "simulator/experiment/certificate_tables.py",  # lengths, coordinates, own
    "analysis/extensions/influences/sag.py",
    "simulator/experiment/_probes.py",  # star
    "simulator/experiment/machine.py",  # points
    "simulator/experiment/_artefacts.py",  # balls
    "analysis/extensions/machine_files/curve_files.py",  # exx, eyx
    "simulator/inputs/covariances.py",
    "simulator/readings/reading_sources.py",
    "analysis/extensions/certificates/certificate_files.py",
    "analysis/extensions/maps/point_files.py",  # correct, map --at
    "analysis/extensions/splines/read_points.py",
    "analysis/extensions/parts/part_features.py",  # face
    "analysis/extensions/parts/measured_parts.py",  # touched
    "analysis/extensions/parts/acceptance_readings.py",  # acceptance
    "analysis/extensions/laboratory/table_forms.py",  # readings that are not plain
    "analysis/extensions/reproduction/published.py",  # a table of the project's own
}

# What writes tables.
WRITERS = {"simulator/inputs/writing.py"}


def test_no_other_place_reads_a_table() -> None:
    found = set()
    for folder in ("simulator", "analysis"):
        for path in (ROOT / folder).rglob("*.py"):
            text = path.read_text("utf-8")
            for node in ast.walk(ast.parse(text)) if re.search("csv|table", text) else ():
                if not isinstance(node, ast.Import | ast.ImportFrom):
                    continue
                source = node.module or "" if isinstance(node, ast.ImportFrom) else ""
                names = {alias.name for alias in node.names}
                of_inputs = source.endswith(("tables", "simulator.inputs"))
                if "csv" in names or (of_inputs and names & {"read_table", "table_lines"}):
                    found.add(path.relative_to(ROOT).as_posix())
    assert found - WRITERS == READERS


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        # A comma beside points may be between thousands.
        ("ball;x_mm\na;1.5\nb;1,234\n", ':3:3: "1,234" has a decimal comma; write 1.234'),
        ('ball,x_mm\na,1.5\nb,"1,234"\n', ':3:3: "1,234" has a decimal comma; write 1.234'),
        ("ball;x_mm\na;1.234,5\n", ':2:3: "1.234,5" is not a number'),
        ("ball;x_mm\na;1,5\nb,2\n", ":3:1: 1 columns instead of 2; separate them by semicolons"),
        ("ball\tx_mm\na\t1\tb\n", ":2:1: 3 columns instead of 2; write one line per row, its columns separated by tabs"),
        ('ball;x_mm\n"a;1\n', ":2:1: a quotation mark too many; write one line per row, its columns separated by semicolons"),
    ],
)  # fmt: skip
def test_faults_are_told_at_their_places(tmp_path: Path, text: str, expected: str) -> None:
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(ExperimentError) as caught:
        read_table(tmp_path / "t.csv", ["ball"], ["x"])
    assert str(caught.value).split("\n")[0].startswith(f"{tmp_path / 't.csv'}{expected}")


def test_names_keep_what_looks_like_decimals(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text('ball;x_mm\n1.5;1,25\n2,5;3\n"a;b, c";,5\n')
    rows = read_table(tmp_path / "t.csv", ["ball"], ["x"])
    assert [row.texts for row in rows] == [("1.5",), ("2,5",), ("a;b, c",)]
    assert [row.lengths for row in rows] == [(0.00125,), (0.003,), (0.0005,)]
