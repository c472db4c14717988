"""Machine files: what they say arrives in metres and radians, and everything that is wrong is told
at once.
"""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.machine_files.curves import Points
from ballplate.extensions.machine_files.description import AxisTemperature, PowerSeries, Squareness
from ballplate.extensions.machine_files.machine_file import load_machine
from ballplate.extensions.machine_files.random_errors import random_part
from ballplate.extensions.maps.volumetric_errors import Volumetric
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.machines.settings import build_error_model

from tests.experiment import wording

MACHINE = """\
title: moving horizontal arm
arrangement: MH2
volume: {x: [-100 mm, 1800 mm], y: [0 mm, 1200 mm], z: [0 mm, 1200 mm]}
reference_point: [0 mm, 100 mm, 0 mm]
probe: [0 mm, 0 mm, -100 mm]
straightness: least squares
errors:
  EXX: {polynomial: [0 um, 12 um, -3 um], bandwidth: 6 um, sigmas: 3, line: {z: 250 mm}}
  EYX: {file: eyx.csv, sigmas: 2}
  EBX: {bandwidth: 4 urad}
squareness: {EC0Y: 12 arcsec, EB0Z: {value: 3 urad, at: [100 mm, 200 mm, 300 mm], bandwidth: 2 urad}}
temperature: {x: {deviation: -1.5 K, expansion: 11 um/m/degC, standard_uncertainty: 0.1 K}}
droop: {phi1: 2 urad/m, phi2: -3 urad/m}
probing: 1 um
"""
TABLE = """\
# measured: last year
# line: y = 400 mm, z = 250 mm
# straightness: minimum zone
# probe: 0 mm, 0 mm, -50 mm
position_mm,EYX_um,EYX_bandwidth_nm
900,3,1500
-100,0,1000
1800,-1,2000
"""


def written(folder: Path, machine: str = MACHINE, table: str = TABLE) -> Path:
    (folder / "eyx.csv").write_text(table, encoding="utf-8")
    path = folder / "m.yaml"
    path.write_text(machine, encoding="utf-8")
    return path


def told(path: Path) -> list[str]:
    with pytest.raises(ExperimentError) as caught:
        load_machine(path)
    return str(caught.value).replace(f"{path.parent}/", "").split("\n")


def test_everything_arrives(tmp_path: Path) -> None:
    found = pickle.loads(pickle.dumps(load_machine(written(tmp_path))))
    assert (found.arrangement_name, found.arrangement.probe_side) == ("MH2", ("x", "z", "y"))
    assert (found.lower, found.upper) == ((-0.1, 0.0, 0.0), (1.8, 1.2, 1.2))
    assert (found.reference, found.probe, found.probing) == (
        (0.0, 0.1, 0.0),
        (0.0, 0.0, -0.1),
        1e-6,
    )
    assert dict(found.droop) == {"phi1": 2e-6, "phi2": -3e-6}
    assert dict(found.temperature) == {"x": AxisTemperature(11e-6, -1.5, 0.1)}
    first, second = found.squareness
    assert first.value == pytest.approx(12 * np.pi / 180 / 3600)
    assert second == Squareness("EB0Z", 3e-6, (0.1, 0.2, 0.3), 1e-6)
    exx, eyx, ebx = found.errors
    assert exx.shape == PowerSeries((0.0, 12e-6, -3e-6)) and exx.deviation == pytest.approx(2e-6)
    assert exx.line == (0.0, 0.1, 0.25)
    assert eyx.shape == Points((-0.1, 0.9, 1.8), (0.0, 3e-6, -1e-6))
    assert isinstance(eyx.deviation, Points)
    np.testing.assert_allclose(eyx.deviation.values, [0.5e-6, 0.75e-6, 1e-6])
    assert (eyx.line, eyx.probe, eyx.criterion) == (
        (0.0, 0.4, 0.25),
        (0.0, 0.0, -0.05),
        "minimum zone",
    )
    assert (ebx.name, ebx.shape, ebx.deviation, ebx.criterion) == (
        "EBX",
        None,
        2e-6,
        "least squares",
    )


def test_what_may_be_left_out(tmp_path: Path) -> None:
    text = (
        "title: plain\narrangement: {probe_side: [x, z], workpiece_side: [y]}\nvolume: [1 m, 1 m, 1"
        " m]\n"
    )
    found = load_machine(written(tmp_path, text))
    assert found.reference == found.lower == (0.0, 0.0, 0.0)
    assert not found.errors and not found.squareness and found.criterion == "end points"


def test_several_mistakes_are_told_at_once(tmp_path: Path) -> None:
    text = """\
title: full of mistakes
arrangement: MH3
volume: {x: [0 mm, 1800 mm], y: [0 mm, 1200 mm], z: [0 mm, 1200 mm]}
errors:
  EXX: {polynomial: [0 um, 12 urad, -3], bandwidth: -2 um, sigmas: 4}
  EYX: {file: none.csv}
  EYQ: {file: eyx.csv}
  EBX: {polynomial: [0 urad, 20 urad], file: eyx.csv}
  EZX: {file: eyx.csv, line: {y: 1 mm}}
  EAX: {}
  EYY: {polynomial: [1 um, 2 um], straightness: end points}
squareness: {EC0Y: 12, EB0Y: 3 urad}
temperature: {x: {deviation: 1.5, expansion: 11 um/m}}
drop: {phi1: 2 urad/m}
probing: 0 um
"""
    expected = [
        'm.yaml:2:14: arrangement: unknown value "MH3"; did you mean "MH2"?',
        'm.yaml:5:28: errors.EXX.polynomial[1]: "12 urad" is an angle; a length is expected',
        'm.yaml:5:37: errors.EXX.polynomial[2]: "-3" has no unit',
        'm.yaml:5:53: errors.EXX.bandwidth: "-2 um" must be above zero',
        "m.yaml:5:68: errors.EXX.sigmas: expected one of: 1, 2, 3; found the number 4",
        "m.yaml:6:15: errors.EYX.file: none.csv: there is no such file",
        'm.yaml:7:3: errors.EYQ: unknown key; did you mean "EZY"?',
        (
            "m.yaml:8:8: errors.EBX: a polynomial and a file cannot both be the error; give only one"
            " of them"
        ),
        (
            "m.yaml:8:46: errors.EBX.file: eyx.csv: the file should have EBX alone, but has EYX,"
            " EYX_bandwidth"
        ),
        'm.yaml:9:8: errors.EZX: "line" has no meaning here; write # line: … into the file',
        "m.yaml:9:15: errors.EZX.file: eyx.csv: the file should have EZX alone",
        (
            "m.yaml:10:8: errors.EAX: has no data; give a polynomial, a file, or the bandwidth"
            " of a random error"
        ),
        "m.yaml:11:35: errors.EYY.straightness: unknown key",
        (
            'm.yaml:12:20: squareness.EC0Y: "12" has no unit; write for example "12 arcsec" or "12'
            ' deg"'
        ),
        'm.yaml:12:24: squareness.EB0Y: unknown key; did you mean "EC0Y"?',
        'm.yaml:13:30: temperature.x.deviation: "1.5" has no unit; write for example "1.5 degC"',
        (
            'm.yaml:13:46: temperature.x.expansion: "11 um/m" is a ratio; a thermal expansion is'
            " expected"
        ),
        'm.yaml:14:1: drop: unknown key; did you mean "droop"?',
        'm.yaml:15:10: probing: "0 um" must be above zero; give a small one, such as 1 nm',
    ]
    lines = told(written(tmp_path, text))
    assert len(lines) == len(expected), lines
    for line, start in zip(lines, expected, strict=True):
        assert line.startswith(start), line


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "MH2",
            "MB1",
            (
                "m.yaml:13:1: droop: only the arm of MH1, MH2 droops; leave it out, or name one of"
                " them"
            ),
        ),
        (
            "x: [-100 mm, 1800 mm]",
            "x: [1800 mm, -100 mm]",
            "m.yaml:3:13: volume.x: ends at -100 mm, not above its",
        ),
        (
            ", z: [0 mm, 1200 mm]}",
            "}",
            "m.yaml:3:9: volume.z: missing; a machine file has three axes",
        ),
        (
            "[0 mm, 100 mm, 0 mm]",
            "[0 mm, 2 m, 0 mm]",
            "m.yaml:4:18: reference_point: y = 2000 mm is outside the volume",
        ),
        (
            "line: {z: 250 mm}",
            "line: {x: 1 mm}",
            "m.yaml:8:78: errors.EXX.line.x: the line runs along x; leave it out",
        ),
        (
            "[0 um, 12 um, -3 um]",
            f"[{', '.join(['1 um'] * 12)}]",
            "m.yaml:8:21: errors.EXX.polynomial: has 12 entries",
        ),
        (
            "csv, sigmas",
            "csv, bandwidth: 1 um, sigmas",
            "m.yaml:9:35: errors.EYX.bandwidth: the file has a bandwidth",
        ),
        (
            "at: [100 mm",
            "at: [-1 m",
            "m.yaml:11:57: squareness.EB0Z.at: x = -1000 mm is outside the volume",
        ),
        (
            "title: moving",
            "positions: []\ntitle: moving",
            "m.yaml:1:1: this is an experiment or a sweep; name a machine",
        ),
    ],
)
def test_what_is_wrong_with_a_machine(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in MACHINE
    lines = told(written(tmp_path, MACHINE.replace(old, new)))
    assert lines[0].startswith(message), lines
    assert len(lines) == 1


@pytest.mark.parametrize(
    ("old", "new", "messages"),
    [
        ("y = 400 mm, z", "y = 400 mm, y", ["eyx.csv:2:9: y is given twice; give it once"]),
        ("y = 400 mm", "x = 400 mm", ["eyx.csv:2:9: the line runs along x; leave it out"]),
        ("y = 400 mm", "y = 1,5 mm", ['eyx.csv:2:9: "1,5" has a decimal comma; write 1.5']),
        (
            "y = 400 mm",
            "at the front",
            ['eyx.csv:2:9: "at the front" is not a position of an axis; write for example y'],
        ),
        (
            "y = 400 mm",
            "y = 4 m",
            ["m.yaml:9:15: errors.EYX.file: y = 4000 mm is outside the volume"],
        ),
        ("# line:", "#LINE:", ['eyx.csv:2:2: unknown "LINE:"; did you mean "line:"?']),
        (
            "# line:",
            "# line",
            ['eyx.csv:2:3: unknown "line y = 400 mm, z = 250 mm"; did you mean "line:"?'],
        ),
        ("# line:", "# Line at:", ['eyx.csv:2:3: unknown "Line at:"; did you mean "line:"?']),
        (
            "# straightness:",
            "# straigthness:",
            ['eyx.csv:3:3: unknown "straigthness:"; did you mean "straightness:"?'],
        ),
        (
            "# measured: last year",
            "# straightness of X in Y, measured along the granite: very fine",
            [],
        ),
        ("# measured: last year", "# file: 2021", []),
        ("# straightness", "# line", ['eyx.csv:3:3: "line:" is already in line 2; remove one']),
        (
            "minimum zone",
            "minimal zone",
            ['eyx.csv:3:17: unknown criterion "minimal zone"; did you mean "minimum'],
        ),
        (
            "0 mm, 0 mm, -50 mm",
            "0 mm, -50",
            ["eyx.csv:4:10: has 2 co-ordinates; give three, such as"],
        ),
        (
            "# probe",
            "# straightedge: table\n# probe",
            ["m.yaml:9:15: errors.EYX.file: the x axis moves no table; leave"],
        ),
        (
            "# probe",
            "# straightedge: box\n# probe",
            ['eyx.csv:4:17: unknown place "box"; write table, or leave'],
        ),
        ("1500", "-1500", ["m.yaml:9:15: errors.EYX.file: eyx.csv: a bandwidth is below zero"]),
        ("EYX_um", "EYX", ['eyx.csv:5:13: the column "EYX" has no unit; write for example EYX_um']),
        # The last point but a wide spacing away from the end of the axis, and a little beyond it.
        ("1800,", "1650,", []),
        ("1800,", "1890,", []),
        ("1800,", "2800,", ["eyx.csv:8:1: the table ends at 2800 mm, but the axis is"]),
        (
            "-100,",
            "-200,",
            ["eyx.csv:7:1: the table begins at -200 mm, but the axis is -100 mm to 1800 mm"],
        ),
    ],
)
def test_what_is_wrong_with_a_table(
    tmp_path: Path, old: str, new: str, messages: list[str]
) -> None:
    assert old in TABLE
    if not messages:
        load_machine(written(tmp_path, table=TABLE.replace(old, new)))
        return
    lines = told(written(tmp_path, table=TABLE.replace(old, new)))
    assert len(lines) == len(messages)
    for line, start in zip(lines, messages, strict=True):
        assert line.startswith(start), line


def test_reversed_ends_are_told_with_everything_else(tmp_path: Path) -> None:
    text = MACHINE.replace("x: [-100 mm, 1800 mm]", "x: [1800 mm, -100 mm]").replace(
        "probing: 1 um", "probing: 1"
    )
    text = text.replace("z: [0 mm, 1200 mm]", "z: [1200 mm, 0 mm]")
    lines = told(written(tmp_path, text, TABLE.replace("y = 400 mm", "y = 400")))
    places = ["m.yaml:3:13", "m.yaml:3:56", "m.yaml:14:10", "eyx.csv:2:9"]
    assert sorted(line.partition(": ")[0] for line in lines) == sorted(places), lines
    # Mistakes that only a whole machine can have.
    text = (
        text.replace("probing: 1", "probing: 1 um")
        .replace("MH2", "MB1")
        .replace("line: {z: 250", "line: {z: 2500")
    )
    lines = told(written(tmp_path, text, TABLE.replace("1800,", "180,")))
    places = ["m.yaml:3:13", "m.yaml:3:56", "m.yaml:8:77", "m.yaml:13:1", "eyx.csv:6:1"]
    assert sorted(line.partition(": ")[0] for line in lines) == sorted(places), lines


def test_a_table_that_is_too_long(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ballplate.extensions.machine_files.curve_files.MOST_POINTS", 2)
    (line,) = told(written(tmp_path))
    assert line.startswith(wording.POINTS_ARE_TOO_MANY)


EXPERIMENT = """\
title: a machine file
machine: {volume: {x: [0 mm, 1 m], y: [0 mm, 1 m], z: [0 mm, 1 m]}, repeatability: 1 um}
error_model: {kind: machine, file: m.yaml}
true_machine: {kind: machine, file: m.yaml, random_part: omitted}
probes: {down: [0 mm, 0 mm, -50 mm]}
artefacts: {plate: {kind: grid, balls: [3, 3], size: [600 mm, 600 mm]}}
positions: [{name: low, plane: z, level: 100 mm, corner: {x: 100 mm, y: 100 mm}}]
"""


def experiment(folder: Path, text: str = EXPERIMENT) -> Path:
    path = folder / "e.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_an_experiment_with_a_machine_file(tmp_path: Path) -> None:
    written(tmp_path)
    (found,) = load(experiment(tmp_path))
    again = pickle.loads(pickle.dumps(found))
    corners = found.machine.volume.corners
    model = build_error_model(found.error_model, *corners)
    first, second = (one.true_machine.true_machine(model, *corners) for one in (found, again))
    assert first.a.tolist() == second.a.tolist()


@pytest.mark.parametrize(
    ("old", "new", "random"),
    [
        ("errors:", "errors:\n  EZX: {bandwidth: 1 um}", ("EZX",)),
        (
            "errors:",
            "squareness: {EC0Y: {value: 1 urad, bandwidth: 1 urad}}\nerrors:",
            ("EC0Y",),
        ),
        ("errors:", "probing: 1 um\nerrors:", ("probing",)),
        (
            "errors:",
            (
                "temperature: {y: {deviation: 0 degC, expansion: 11 um/m/degC,"
                " standard_uncertainty: 0.1 degC}}\nerrors:"
            ),
            ("thermal y",),
        ),
        ("errors:", "errors:\n  EYX: {polynomial: [0 um, 0 um, 1 um]}", ()),
    ],
)
def test_every_random_part_is_told(
    tmp_path: Path, old: str, new: str, random: tuple[str, ...]
) -> None:
    """Whatever adds to the deviation at some point is named, and nothing is where there is none."""
    bare = (
        "title: m\narrangement: MB1\nvolume: [1 m, 1 m, 1 m]\nerrors:\n  EXX: {polynomial: [0 um, 1"
        " um]}\n"
    )
    (tmp_path / "m.yaml").write_text(bare.replace(old, new))
    machine = load_machine(tmp_path / "m.yaml")
    assert tuple(random_part(machine).meanings) == random
    deviation = Volumetric(machine).errors(np.array([[0.3, 0.6, 0.7]])).uncertainties
    assert bool(deviation.any()) == bool(random)


def test_mistakes_of_a_machine_file_are_told_with_the_experiment(tmp_path: Path) -> None:
    written(tmp_path, MACHINE.replace("12 um", "12 urad").replace("probing: 1", "probing: 1 nm #"))
    with pytest.raises(ExperimentError) as caught:
        load(experiment(tmp_path, EXPERIMENT.replace("repeatability: 1 um", "repeatability: 1")))
    lines = [line.replace(f"{tmp_path}/", "") for line in str(caught.value).split("\n")]
    assert [line.partition(": ")[0] for line in lines] == ["e.yaml:2:84", "m.yaml:8:28"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "x: [0 mm, 1 m]",
            "x: [0 mm, 3 m]",
            "e.yaml:4:37: true_machine.file: its volume is -100 mm to 1800 mm",
        ),
        ("m.yaml, random", "n.yaml, random", "e.yaml:4:37: true_machine.file:"),
        ("m.yaml}\ntrue", "n.yaml}\ntrue", "e.yaml:3:36: error_model.file:"),
    ],
)
def test_what_is_wrong_with_the_use_of_a_machine_file(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    written(tmp_path)
    with pytest.raises(ExperimentError) as caught:
        load(experiment(tmp_path, EXPERIMENT.replace(old, new)))
    (line,) = str(caught.value).replace(f"{tmp_path}/", "").split("\n")
    assert line.startswith(message)


def test_a_machine_that_states_nothing_to_be_estimated(tmp_path: Path) -> None:
    written(
        tmp_path,
        "title: random\narrangement: MB1\nvolume: [1 m, 1 m, 1 m]\nerrors: {EXX: {bandwidth: 1"
        " um}}\n",
    )
    with pytest.raises(ExperimentError, match=wording.YAML_STATES_NO_ERROR_THAT_COULD):
        load(experiment(tmp_path))
