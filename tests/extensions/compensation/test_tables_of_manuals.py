"""Tables are read as the manuals of the controllers describe them, and read back as written.

The examples are made after those of Beckhoff's TF5280 (ISG CSV format), and of HEIDENHAIN's
Technical Manual MANUALplus 620, pages 715 to 718, whose figures they have where there are any.
"""

from __future__ import annotations

from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.compensation.compensation_tables import (
    made_compensation,
    tabled_machine,
)
from ballplate.simulator.experiment.machine_file import load_machine
from ballplate.simulator.machines.description import true_volumetric
from numpy.testing import assert_allclose

from tests.extensions.compensation import wording

MACHINES = Path("designs/park/machines")
NODES = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.005, 0.0, 0.0]])

ISG = """\
// Position errors alone.
C0Y    A0Z    B0Z
0.0001 0.0002 0.00011
#
// The header has the argument X and component errors of the X axis.
X      EXX    EYX    EZX    EAX    EBX    ECX
0.0    0.02   0.01   0.07   0.00   0.0042 0.003
10.0   0.00   -0.1   0.01   0.00   0.0011 0.002   // a remark
#
Y      EXY
0.0    0.0
20.0   0.04
#
Z      EZZ    EAZ
-5     0.01   0.001
0      0      0
"""

IN_BLOCKS = """\
Z      Y    X      EXX    EYX    EZX    ECZ
0.0    0    0.0    0.02   0.01   0.07   0.003
0.0    0    10.0   0.00   -0.1   0.01   0.002
0.0    50   0.0    0.02   0.01   0.07   0.003
0.0    50   10.0   0.00   -0.1   0.01   0.002
100.0  0    0.0    0.01   0.02   0.03   0.003
100.0  0    10.0   0.03   -0.09  0.03   0.000
100.0  50   0.0    0.01   0.02   0.03   0.003
100.0  50   10.0   0.03   -0.09  0.03   0.000
"""

# Screw pitch errors of Y and Z and the sag of Z as Y moves; positions of Y begin at -90 mm.
CMA = """\
BEGIN CONFIG.CMA
NR   ACTIVE   X       Y        Z
0             X1.COM  Y1.COM   Z1.COM
1    *        X1.COM  TNC:\\table\\Y2.COM   Z1.COM
[END]
"""
COM = {
    "X1.COM": "NR AXISPOS BACKLASH X Y Z\n0 0 0.002 0 0 0\n1 5 0.002 0 0 0\n",
    "Y2.COM": (
        "NR  AXISPOS   BACKLASH  Y        Z\n"
        "0   -90.0000            +0.0100  +0.0000\n"
        "1   -85.0000            +0.0150  -0.0050\n"
        "2   -80.0000            -0.0050  -0.0100\n"
    ),
    "Z1.COM": "NR AXISPOS Z\n0 -200 0.01\n1 -195 0.03\n",
}


def written(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text)
    return path


def test_isg_tables_of_axes_and_position_errors(tmp_path: Path) -> None:
    file = written(tmp_path, "volcomp.csv", ISG)
    read = bp.read_compensation(file, "isg", "corrections", "MB2")
    # Linear between positions; millimetres, radians.
    found = read.correction([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.005, 0.0, 0.0]])
    assert_allclose(1e3 * found, [[0.02, 0.01, 0.07], [0.0, -0.1, 0.01], [0.01, -0.045, 0.04]])
    # Y is turned by C0Y, Z by A0Z and B0Z, and what X has turned at x = 0 turns y and z.
    beside = 1e3 * (read.correction([[0.0, 0.02, -0.005]])[0] - found[0])
    turned = np.cross([0.0, 0.0042, 0.003], [0.0, 20.0, -5.0])
    own = np.array([0.04 - 0.0001 * 20.0 + 0.00011 * -5.0, -0.0002 * -5.0, 0.01])
    assert_allclose(beside, own + turned, atol=1e-12)
    # The tool's length counts where Z has turned it.
    longer = read.correction([[0.0, 0.0, -0.005]], [0.0, 0.0, -0.1])
    other = read.correction([[0.0, 0.0, -0.005]])
    turned = np.cross([0.001, 0.0042, 0.003], [0.0, 0.0, -100.0])
    assert_allclose(1e3 * (longer - other), turned[None], atol=1e-12)


def test_an_isg_table_of_all_axes(tmp_path: Path) -> None:
    read = bp.read_compensation(written(tmp_path, "v.csv", IN_BLOCKS), "isg", "corrections")
    assert read.headline() == "isg, 2 x 2 x 2 nodes"
    found = 1e3 * read.correction([[0.005, 0.01, 0.0], [0.01, 0.05, 0.075]])
    assert_allclose(found, [[0.01, -0.045, 0.04], [0.0225, -0.0925, 0.025]])
    with_tool = 1e3 * read.correction([[0.0, 0.0, 0.0]], [0.1, 0.0, 0.0])
    assert_allclose(with_tool, [[0.02, 0.01 + 0.003 * 100.0, 0.07]])
    with pytest.raises(ValueError, match=wording.IS_NO_MACHINE_FILE):
        read.machine_files("m")


def test_heidenhain_tables_by_the_active_line_of_their_assignment(tmp_path: Path) -> None:
    file = written(tmp_path, "config.cma", CMA)
    for name, text in COM.items():
        written(tmp_path, name, f"BEGIN {name} MM\n{text}[END]\n")
    read = bp.read_compensation(file, "heidenhain", "errors of indication", "MB2")
    assert any(wording.BACKLASH_IS_NOT_READ in note for note in read.notes)
    assert any("no rotations" in note for note in read.notes)
    found = -1e3 * read.correction([[0.0, -0.0875, -0.1975]])
    assert_allclose(found, [[0.0, 0.0125, -0.0025 + 0.02]], atol=1e-15)


@pytest.mark.parametrize("name", ["csv", "isg", "heidenhain"])
@pytest.mark.parametrize(
    ("source", "sense"), [("npl-like", "corrections"), ("measured-errors", "errors of indication")]
)
def test_a_written_table_becomes_a_machine_file_with_the_same_errors(
    name: str, sense: str, source: str, tmp_path: Path
) -> None:
    """But for a turn of the frame, which nothing measured tells, within what was stated."""
    machine, _ = tabled_machine(MACHINES / f"{source}.yaml")
    made = made_compensation(
        machine,
        "m",
        name,
        (0.13,),
        None,
        sense,
        False,
        name == "heidenhain",  # type: ignore[arg-type]
    )
    for file, text in made.files("t").items():
        written(tmp_path, file, text)
    files = [tmp_path / one for one in made.files("t") if not one.endswith(".com")]
    arrangement = "probe y x z" if source == "npl-like" else "MB2"
    if name == "heidenhain":
        with pytest.raises(bp.ExperimentError, match=wording.DOES_NOT_STATE_WHETHER_2):
            bp.read_compensation(files, name, arrangement=arrangement)
    say = sense if name == "heidenhain" else None
    read = bp.read_compensation(files, name, say, arrangement)  # type: ignore[arg-type]
    for file, text in read.machine_files("back").items():
        written(tmp_path, file, text)
    truth = true_volumetric(load_machine(tmp_path / "back.yaml"))
    generator = np.random.default_rng(2)
    x = generator.uniform(machine.lower, machine.upper, (400, 3))
    p = np.zeros(x.shape) if name == "heidenhain" else generator.uniform(-0.1, 0.1, x.shape)
    left = truth.model.error(x, truth.a, p) - machine.model.error(x, machine.a, p)
    # A shift of the frame, its turn, and offsets that turn with it.
    motion = [np.tile(one, (400, 1)) for one in np.eye(3)]
    motion += [np.cross(one, x) for one in np.eye(3)] + [np.cross(one, p) for one in np.eye(3)]
    columns = np.stack([one.ravel() for one in motion], 1)
    columns = columns[:, np.abs(columns).max(axis=0) > 0.0]
    left -= (columns @ np.linalg.lstsq(columns, left.ravel(), rcond=None)[0]).reshape(-1, 3)
    largest = float(np.linalg.norm(left, axis=1).max())
    # Tools that are longer than those of the machine are turned as well as their angles are known.
    assert largest <= made.made.written + 0.1 * made.format.angle_step
    assert largest > 1e-10


def test_the_sense_is_never_guessed(tmp_path: Path) -> None:
    file = written(tmp_path, "v.csv", ISG)
    with pytest.raises(bp.ExperimentError, match=wording.DOES_NOT_STATE_WHETHER_VALUES):
        bp.read_compensation(file, "isg", arrangement="MB2")
    file = written(tmp_path, "v.csv", f"// states: errors of indication\n{ISG}")
    with pytest.raises(bp.ExperimentError, match=wording.STATES_ERRORS_OF_INDICATION):
        bp.read_compensation(file, "isg", "corrections", "MB2")
    one = bp.read_compensation(file, "isg", arrangement="MB2")
    two = bp.read_compensation(written(tmp_path, "w.csv", ISG), "isg", "corrections", "MB2")
    assert_allclose(one.correction(NODES), -two.correction(NODES))


def test_files_of_one_table_state_the_same_sense(tmp_path: Path) -> None:
    made = bp.compensation(MACHINES / "npl-like.yaml", "csv", "200 mm").files("t")
    files = [written(tmp_path, name, text) for name, text in made.items()]
    written(tmp_path, "t-y.csv", made["t-y.csv"].partition("\n")[2])
    with pytest.raises(bp.ExperimentError, match=wording.DOES_NOT_STATE_WHETHER):
        bp.read_compensation(files, "csv", "corrections")
    one = written(tmp_path, "a.csv", "// states: corrections\nX EXX\n0 0\n1 0\n")
    two = written(tmp_path, "b.csv", "Y EYY\n0 0\n1 0\n")
    with pytest.raises(bp.ExperimentError, match=wording.STATES_NOT_WHAT_ANOTHER_FILE_DOES):
        bp.read_compensation([one, two], "isg", "corrections", "MB2")


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("isg", "// chain XXZ\nX EXX\n0 0\n1 0\n", "has an axis twice"),
        ("isg", "X EXX\n0 0\n1 0,5\n", "decimal comma"),
        ("isg", "X EXX EXX\n0 0 0\n1 0 0\n", "second column EXX"),
        ("isg", "X EXW\n0 0\n1 0\n", 'column "EXW" is no linear axis'),
        ("isg", "X EXY\n0 0\n1 0\n", "EXY depends on X"),
        ("isg", "X EXX\n0 0\n1\n", "1 columns instead of 2"),
        ("isg", "X EXX\n0 0\n1 0\n", "has no table of y, z"),
        ("isg", "X EXX\n0 0\n0 0\n#\nY EYY\n0 0\n1 0\n", "each once"),
        ("isg", "B0X\n0.1\n#\n" + ISG, "position error B0X is not read"),
        ("isg", "X Y Z EXX EBX\n0 0 0 0 0\n", "turns by Z only"),
        ("isg", "X Y Z EXX\n0 0 0 0\n1 0 0 0\n", "no grid of 2 x 1 x 1"),
        ("isg", "// nothing\n", "no table"),
        ("csv", "position_mm,EXX_um\n0,0\n1,0\n", "no table of y"),
        ("csv", "# states: nothing\nposition_mm,EXX_um\n0,0\n1,0\n", "write corrections or"),
        ("csv", "# arrangement: MB7\nposition_mm,EXX_um\n0,0\n1,0\n", "is no arrangement"),
        ("heidenhain", "BEGIN A.CMA\nNR ACTIVE X\n0 * a.com\n", "not whole"),
        ("heidenhain", "BEGIN A.CMA\nNR ACTIVE X\n0   a.com\n[END]\n", "0 lines are active"),
        ("heidenhain", "X EXX\n", "first line begins with BEGIN"),
    ],
)
def test_wrong_tables_are_told(name: str, text: str, told: str, tmp_path: Path) -> None:
    ending = "cma" if name == "heidenhain" else "csv"
    file = written(tmp_path, f"wrong.{ending}", text)
    with pytest.raises(bp.ExperimentError, match=told):
        bp.read_compensation(file, name, "corrections", "MB2")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("NR AXISPOS X\n0 0 0\n1 1 0\n2 3 0\n", "evenly spaced"),
        ("NR AXISPOS C4\n0 0 0\n1 1 0\n", "column C4 is not read"),
        ("NR AXISPOS X\n0 0 zero\n1 1 0\n", '"zero"'),
    ],
)
def test_wrong_value_tables_are_told(text: str, told: str, tmp_path: Path) -> None:
    file = written(tmp_path, "a.cma", "BEGIN A.CMA\nNR ACTIVE X Y\n0 * a.com a.com\n[END]\n")
    written(tmp_path, "a.com", f"BEGIN A.COM MM\n{text}[END]\n")
    with pytest.raises(bp.ExperimentError, match=told):
        bp.read_compensation(file, "heidenhain", "corrections", "MB2")
