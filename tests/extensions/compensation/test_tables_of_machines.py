"""Tables of a machine say what the machine does, in every format, arrangement and sense.

What a controller makes of a table is computed here again, from the text of its files and by the
sums that the manuals describe, without the code that writes or reads tables.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.compensation.axis_tables import in_arrangement, on_tool_side
from ballplate.extensions.compensation.compensation_tables import (
    made_compensation,
    tabled_machine,
)
from ballplate.extensions.compensation.making import TabledMachine, nodes_along
from ballplate.simulator.experiment.machine_file import load_machine
from ballplate.simulator.machines.arrangement import ARRANGEMENTS
from ballplate.simulator.machines.description import true_volumetric

from tests.extensions.compensation import wording

MACHINES = Path("designs/park/machines")
AXES = "XYZ"


def machine_of(name: str, arrangement: str) -> TabledMachine:
    """A described machine with its axes arranged otherwise."""
    described = replace(
        load_machine(MACHINES / f"{name}.yaml"),
        arrangement=ARRANGEMENTS[arrangement],
        arrangement_name=arrangement,
    )
    truth = true_volumetric(described)
    corners = np.array(described.lower), np.array(described.upper), np.array(described.reference)
    return TabledMachine(name, truth.model, truth.a, *corners, np.array([[0.0, 0.05, -0.15]]))


def places(machine: TabledMachine, count: int = 500) -> tuple[np.ndarray, np.ndarray]:
    generator = np.random.default_rng(3)
    x = generator.uniform(machine.lower, machine.upper, (count, 3))
    return x, np.tile(machine.offsets, (count, 1))


def true_errors(machine: TabledMachine, x: np.ndarray, p: np.ndarray, zero: np.ndarray) -> Any:
    """Where the tip is less where the scales say, less that at the origin with the same probe."""
    found = machine.model.error(x, machine.a, p)
    return found - machine.model.error(zero[None], machine.a, p[:1])


def blocks(text: str, separator: str | None, comment: str) -> list[dict[str, np.ndarray]]:
    """Columns of the tables of a text by their names."""
    found, lines = [], []
    for line in [*text.split("\n"), "#"]:
        if line.startswith(comment) or (line == "#" and lines):
            if line == "#" and lines:
                rows = [one.split(separator) for one in lines]
                numbers = np.array([[float(cell) for cell in row] for row in rows[1:]])
                found.append(dict(zip(rows[0], numbers.T, strict=True)))
                lines = []
        elif line.strip() and line != "#":
            lines.append(line)
    return found


def by_chain(
    tables: list[dict[str, np.ndarray]],
    order: str,
    origin: np.ndarray,
    x: np.ndarray,
    p: np.ndarray,
) -> np.ndarray:
    """The error of a chain of axes that all carry the tool, listed from the workpiece: every axis
    displaces the tool, and turns the ways of the axes behind it and the tool (mm and rad).
    """
    found = np.zeros(x.shape)
    for place, letter in enumerate(order):
        table = next(one for one in tables if letter in one)
        k = AXES.index(letter)
        values = [np.interp(x[:, k], table[letter], table[f"E{part}{letter}"]) for part in "XYZABC"]
        arm = p + 0.0
        for beyond in order[place + 1 :]:
            j = AXES.index(beyond)
            arm[:, j] += x[:, j] - origin[j]
        displaced, turned = np.stack(values[:3], 1), np.stack(values[3:], 1)
        found += displaced + np.cross(turned, arm)
    return found


CHAINS = {"MB2": "XYZ", "MB1": "YXZ", "FB1": "YXZ", "CX1": "YXZ", "MH2": "XZY"}


@pytest.mark.parametrize("arrangement", CHAINS)
def test_an_isg_table_gives_the_machines_errors_by_the_controllers_sum(arrangement: str) -> None:
    machine = machine_of("measured-errors", arrangement)
    zero = machine.lower + 0.4 * (machine.upper - machine.lower)
    made = made_compensation(machine, "m", "isg", (0.15,), zero.tolist())
    text = made.files("m")["m.csv"]
    assert f"// chain {CHAINS[arrangement]}, workpiece_axes 0" in text
    x, p = places(machine)
    found = by_chain(blocks(text, None, "//"), CHAINS[arrangement], np.zeros(3), 1e3 * x, 1e3 * p)
    there = by_chain(
        blocks(text, None, "//"), CHAINS[arrangement], np.zeros(3), 1e3 * zero[None], 1e3 * p[:1]
    )
    left = 1e-3 * (found - there) - true_errors(machine, x, p, zero)
    largest = np.linalg.norm(left, axis=1).max()
    # Written as errors that a turned table would have, they would be wrong by micrometres.
    assert 0.3 * made.made.written < largest <= made.made.written


@pytest.mark.parametrize("arrangement", ["MB2", "FB1", "CY1"])
def test_csv_tables_give_the_machines_errors(arrangement: str) -> None:
    machine = machine_of("npl-like", arrangement)
    zero = machine.upper - 0.1
    sense = "errors of indication"
    made = made_compensation(machine, "m", "csv", (0.2,), zero.tolist(), sense)  # type: ignore[arg-type]
    tables = []
    for axis in "xyz":
        (table,) = blocks(made.files("m")[f"m-{axis}.csv"], ",", "# ")
        table = {name.partition("_")[0]: 1e-6 * values for name, values in table.items()}
        tables.append({**table, "position": 1e3 * table["position"]})
    x, p = places(machine)
    found = np.zeros(x.shape)
    sides = ARRANGEMENTS[arrangement]
    for k, (axis, table) in enumerate(zip("xyz", tables, strict=True)):
        values = [
            np.interp(x[:, k], table["position"], table[f"E{part}{AXES[k]}"]) for part in "XYZABC"
        ]
        arm = p.copy()
        if axis in sides.probe_side:
            behind = sides.probe_side[sides.probe_side.index(axis) + 1 :]
            sign = 1.0
        else:
            # A table turns under the tip, whatever brings the tip there.
            outside = sides.workpiece_side[sides.workpiece_side.index(axis) + 1 :]
            behind = tuple(name for name in "xyz" if name not in outside)
            sign = -1.0
        for name in behind:
            arm[:, "xyz".index(name)] += (x - zero)[:, "xyz".index(name)]
        found += np.stack(values[:3], 1) + sign * np.cross(np.stack(values[3:], 1), arm)
    left = -found - true_errors(machine, x, p, zero)
    assert np.linalg.norm(left, axis=1).max() <= made.made.written


def test_a_volumetric_table_holds_a_machine_that_is_no_chain() -> None:
    machine = machine_of("gec-like", "MH2")
    with pytest.raises(ValueError, match=wording.TILT_OF_THE_COLUMN):
        made_compensation(machine, "m", "isg")
    made = made_compensation(machine, "m", "isg", (0.2, 0.15, 0.15), volumetric=True)
    (table,) = blocks(made.files("m")["m.csv"], None, "//")
    nodes = [np.unique(table[letter]) for letter in AXES]
    x, p = places(machine, 200)
    found = np.zeros((len(x), 6))
    names = ("EXX", "EYX", "EZX", "EAZ", "EBZ", "ECZ")
    for k, name in enumerate(names):
        grid = table[name].reshape(*(len(one) for one in nodes))
        for row, point in enumerate(1e3 * x):
            along = grid
            for letter in range(3):
                weights = [
                    np.interp(point[letter], nodes[letter], one)
                    for one in np.eye(len(nodes[letter]))
                ]
                along = np.tensordot(weights, along, (0, 0))
            found[row, k] = along
    left = (
        1e-3 * found[:, :3] + np.cross(found[:, 3:], p) - true_errors(machine, x, p, machine.zero)
    )
    largest = np.linalg.norm(left, axis=1).max()
    assert 0.3 * made.made.written < largest <= made.made.written


def test_heidenhain_tables_are_made_without_rotations_only_if_that_is_said() -> None:
    machine, _ = tabled_machine(MACHINES / "measured-errors.yaml")
    with pytest.raises(ValueError, match=wording.DO_NOT_SAY_WHICH_SIGN):
        made_compensation(machine, "m", "heidenhain", without_rotations=True)
    with pytest.raises(ValueError, match=wording.TURN_BY_UP_TO_RAD):
        made_compensation(machine, "m", "heidenhain", sense="corrections")
    made = made_compensation(
        machine, "m", "heidenhain", (0.13,), sense="corrections", without_rotations=True
    )
    x, _ = places(machine)
    found = np.zeros(x.shape)
    for k, axis in enumerate("xyz"):
        lines = made.files("m")[f"m-{axis}.com"].split("\n")[2:-2]
        rows = np.array([[float(cell) for cell in line.split()] for line in lines])
        assert np.ptp(np.diff(rows[:, 1])) < 1e-9
        for j in range(3):
            found[:, j] += 1e-3 * np.interp(1e3 * x[:, k], rows[:, 1], rows[:, 2 + j])
    still = np.zeros(x.shape)
    left = np.linalg.norm(found - true_errors(machine, x, still, machine.zero), axis=1)
    assert 0.5 * made.made.written < left.max() <= made.made.written
    assert made.made.left_out > 5e-6
    # On the lines through the origin the three columns are all there is.
    for k in range(3):
        on_line = np.tile(machine.zero, (50, 1))
        on_line[:, k] = np.linspace(machine.lower[k], machine.upper[k], 50)
        apart = made.correction(on_line) - true_errors(machine, on_line, still[:50], machine.zero)
        assert np.abs(apart).max() <= made.made.interpolation + made.made.rounding


def test_all_that_a_heidenhain_table_wants_to_be_told_is_told_at_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = [str(MACHINES / "measured-errors.yaml"), "--format", "heidenhain"]
    given = ["--pitch", "1 mm", "-o", str(tmp_path / "t.com")]
    assert main(["compensation", *asked, *given]) == 2
    told = capsys.readouterr().err
    for words in ("should end in .cma", "choose the sense", "the pitch along x takes", "turn by"):
        assert told.count(words) == 1
    remedies = ["--sense", "corrections", "--without-rotations", "--pitch", "50 mm"]
    assert main(["compensation", *asked, *remedies, "-o", str(tmp_path / "t.cma")]) == 0


def test_the_stated_difference_is_the_largest_of_many_places() -> None:
    """At places that were not looked at it is hardly exceeded, and it is no mere bound."""
    machine, _ = tabled_machine(MACHINES / "npl-like.yaml")
    made = made_compensation(machine, "m", "csv", (0.2,))
    generator = np.random.default_rng(8)
    x = generator.uniform(machine.lower, machine.upper, (100_000, 3))
    for offset in (np.zeros(3), machine.offsets[0]):
        p = np.broadcast_to(offset, x.shape)
        apart = made.correction(x, offset) - true_errors(machine, x, p, machine.zero)
        assert np.linalg.norm(apart, axis=1).max() <= 1.01 * made.made.written
    assert np.linalg.norm(apart, axis=1).max() > 0.7 * made.made.written


def test_interpolation_errors_shrink_with_the_square_of_the_pitch() -> None:
    machine, _ = tabled_machine(MACHINES / "npl-like.yaml")
    coarse, fine = (
        made_compensation(machine, "m", "csv", (pitch,)).made.interpolation for pitch in (0.2, 0.1)
    )
    assert 3.5 < coarse / fine < 4.5


def test_positions_begin_at_the_origin_and_cover_the_axis() -> None:
    assert nodes_along(-0.1, 1.0, 0.2, 0.5, even=False).tolist() == [-0.1, 0.2, 0.7, 1.0]
    assert nodes_along(-0.1, 1.0, 0.2, 0.5, even=True).tolist() == [-0.3, 0.2, 0.7, 1.2]
    assert nodes_along(0.0, 0.9, 0.0, 0.3, even=True).tolist() == [0.0, 0.3, 0.6, 0.9]


def test_an_axis_of_the_table_is_told_as_one_of_the_tool() -> None:
    """Both ways give the same errors at the table's positions, and back the same table."""
    machine = machine_of("npl-like", "CX1")
    made = made_compensation(machine, "m", "csv", (0.2,))
    table = made.table
    other = on_tool_side(table)  # type: ignore[arg-type]
    back = in_arrangement(other, table.arrangement)  # type: ignore[union-attr]
    for one, two, turned in zip(table.axes, back.axes, other.axes, strict=True):  # type: ignore[union-attr]
        np.testing.assert_allclose(one.values, two.values, atol=1e-18)
        if one.axis < 2:
            np.testing.assert_array_equal(turned.values[:, 3:], -one.values[:, 3:])
    x, p = places(machine)
    for one in table.axes:  # type: ignore[union-attr]
        x[:, one.axis] = np.random.default_rng(one.axis).choice(one.positions, len(x))
    first, second = (one.machine() for one in (table, other))  # type: ignore[union-attr]
    np.testing.assert_allclose(
        first.model.error(x, first.a, p), second.model.error(x, second.a, p), atol=1e-16
    )


def test_the_face_takes_lengths_as_texts_or_in_metres() -> None:
    file = MACHINES / "npl-like.yaml"
    one = bp.compensation(file, "isg", "200 mm", "0 mm, 0 mm, 0 mm")
    two = bp.compensation(file, "isg", [0.2], [0.0, 0.0, 0.0])
    assert one.files("a") == two.files("a")
    with pytest.raises(ValueError, match="pitch"):
        bp.compensation(file, "isg", "50")


def test_no_probe_differs_by_more_than_is_printed() -> None:
    """What rotations make of each probe's offset is part of what a table without them leaves, in
    arrangements of every kind; summed here from the text of the files.
    """
    offsets = np.array([[0.0, 0.3, 0.2], [0.3, -0.2, 0.4]])
    for arrangement in ("MB1", "FB1", "CX1"):
        machine = replace(machine_of("npl-like", arrangement), offsets=offsets)
        made = made_compensation(
            machine, "m", "heidenhain", (0.2,), sense="corrections", without_rotations=True
        )
        assert np.array_equal(made.made.offsets, [[0.0, 0.0, 0.0], *offsets])
        x, _ = places(machine)
        found = np.zeros(x.shape)
        for k, axis in enumerate("xyz"):
            lines = made.files("m")[f"m-{axis}.com"].split("\n")[2:-2]
            rows = np.array([[float(cell) for cell in line.split()] for line in lines])
            for j in range(3):
                found[:, j] += 1e-3 * np.interp(1e3 * x[:, k], rows[:, 1], rows[:, 2 + j])
        left = [
            found - true_errors(machine, x, np.tile(offset, (len(x), 1)), machine.zero)
            for offset in made.made.offsets
        ]
        sizes = np.linalg.norm(left, axis=2).max(axis=1)
        assert 0.6 * made.made.written < sizes.max() <= made.made.written
        # Without an offset less is left: nothing that this alone would show.
        assert sizes[0] < 0.9 * sizes.max()


@pytest.mark.parametrize("offset", [(0.0, 100.0, 0.0), (80.0, -50.0, -200.0)])
def test_a_ram_that_turns_has_a_table_of_zeros(
    offset: tuple[float, float, float], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The turn of the last axis moves nothing but what the probe sticks out: |theta x p|."""
    ends = "".join(f"{axis}: [0 mm, 400 mm], " for axis in "xyz")
    (tmp_path / "ram.yaml").write_text(
        f"title: a ram that turns\narrangement: MB1\nvolume: {{{ends.rstrip(', ')}}}\n"
        f"probe: [{', '.join(f'{one} mm' for one in offset)}]\n"
        "errors:\n  EAZ: {polynomial: [0 urad, 80 urad]}\n  EBZ: {polynomial: [0 urad, 20 urad]}\n"
    )
    asked = ["--format", "heidenhain", "--sense", "corrections", "--without-rotations", "--json"]
    assert main(["compensation", str(tmp_path / "ram.yaml"), *asked]) == 0
    told = json.loads(capsys.readouterr().out)
    assert not any(row[f"displacement {axis}"] for row in told["corrections"] for axis in "xyz")
    left = np.linalg.norm(np.cross([80e-6, 20e-6, 0.0], 1e-3 * np.array(offset)))
    for name in ("all", "rotations_left_out"):
        assert told["largest_differences"][name] == pytest.approx(left, rel=1e-9)
