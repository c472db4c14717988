"""Tables of `run --errors`, `run --assumptions`, `map`, `plan --done` and files of `init`, against
the dense reference and sums by hand.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray

from tests.extensions.planning.test_interrupted import TEXT
from tests.oracle.campaigns import Expected, campaign_file, planned
from tests.oracle.printed import FACTORS, NUMBER, agrees, output_of, place, step_of, table, within
from tests.oracle.test_campaigns import measured, offset_of
from tests.reference import dense
from tests.reference.designs import altered

Real = NDArray[np.float64]
TIMES = {"set_up": "10 min", "reading": "20 s", "probe_change": "3 min", "plane_change": "20 min"}
# Places along the axis of a curve.
PLACES = np.linspace(0.0, 1.0, 41)


def of_lengths(expected: Expected, spread: dense.Spread) -> Real:
    return spread.of(expected.linear(expected.functions["U6"]))


def mean_variances(expected: Expected, spread: dense.Spread) -> dict[str, float]:
    """The mean variance of each error along its axis."""
    linear = expected.linear(dense.quantities(expected.problem)["U3"])
    found, start = {}, 0
    for function in expected.problem.functions:
        count = function.coefficients - 1
        powers = PLACES[:, None] ** np.arange(1, count + 1)
        u = spread.of(powers[1:] @ linear[start : start + count])
        found[function.name] = float((u**2).sum() / len(PLACES))
        start += count
    return found


@pytest.mark.parametrize("seed", [1, 2])
def test_errors_by_positions(seed: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = campaign_file(seed, tmp_path)
    told = yaml.safe_load(path.read_text(encoding="utf-8"))
    more = {**told["positions"][0], "name": "more", "quarter_turns": 2}
    told["pool"] = {"times": TIMES, "candidates": [more]}
    path.write_text(yaml.safe_dump(told, sort_keys=False), encoding="utf-8")
    expected = planned(path)
    whole = mean_variances(expected, expected.spread)
    readings, names = expected.problem.design.readings, expected.problem.design.positions.names
    kept = [
        np.delete(expected.rows, np.flatnonzero(np.repeat(readings.position == k, 3)), axis=0)
        for k in range(len(names))
    ]
    without = [dense.spread(rows) for rows in kept]
    variances = [mean_variances(expected, spread) for spread in without]
    text = output_of(capsys, "run", "--errors", path)
    rows = table(text, "error ")
    assert [row[0] for row in rows] == list(whole)
    for name, u, unit, *shares in rows:
        assert agrees(u, np.sqrt(whole[name]) / FACTORS[unit], 3)
        for told, other in zip(shares, variances, strict=True):
            if np.isnan(other[name]):
                assert told == "all"
            else:
                assert within(told, 100.0 * (1.0 - whole[name] / other[name]), 0.1), name
    for k, row in enumerate(table(text, "position ")):
        own = readings.position == k
        count, probes = int(own.sum()), len(set(readings.probe[own].tolist()))
        lengths = of_lengths(expected, without[k])
        assert row[:2] == [names[k], str(count)]
        assert within(row[2], 10.0 + count / 3.0 + 3.0 * (probes - 1), 1.0)
        if np.isnan(lengths).any():
            assert row[3] == "-"
        else:
            assert agrees(row[3], 1e6 * lengths.mean(), 3)


def with_nuisances(expected: Expected, change: Real) -> dense.Spread:
    """The spread where disturbances of one standard uncertainty change rows (r, m) in common."""
    covariance = np.eye(len(change)) + change @ change.T
    return dense.spread(np.linalg.solve(np.linalg.cholesky(covariance), expected.rows))


def of_offsets(expected: Expected) -> Real:
    """What 0.5 um of each co-ordinate of each tip but the first changes of rows."""
    problem, zero, parts = expected.problem, np.zeros(expected.problem.parameters), []
    for probe in range(1, len(problem.design.probes.offsets)):
        for axis in range(3):
            offsets = problem.design.probes.offsets.copy()
            offsets[probe, axis] += 1e-3
            moved = replace(problem, design=altered(problem.design, probes={"offsets": offsets}))
            parts.append(dense.residuals(moved, zero) - dense.residuals(problem, zero))
    return np.stack(parts, axis=1) * 0.5e-3


def of_temperatures(expected: Expected) -> Real:
    """What 0.1 K of plate and scales changes of rows, in all positions alike and in each."""
    problem = expected.problem
    design, readings = problem.design, problem.design.readings
    balls = design.balls.places[readings.ball]
    arms = np.einsum("mij,mj->mi", design.positions.rotations[readings.position], balls)
    in_each = np.eye(len(design.positions.names))[readings.position]
    parts = []
    for along in (arms, problem.scales):
        rows = (11.5e-6 * 0.1 * along / design.machine.repeatability).ravel()
        parts += [rows, *(rows * np.repeat(one, 3) for one in in_each.T)]
    change = np.zeros((len(expected.rows), len(parts)))
    change[: 3 * len(readings)] = np.stack(parts, axis=1)
    return change


def of_certificates(expected: Expected) -> dense.Spread:
    """The spread where values of one certificate correlate by 0.9."""
    rows, start = expected.rows.copy(), 3 * len(expected.problem.design.readings)
    for kind in ("distance", "coordinate"):
        end = start + len(dense.known(expected.problem.design, kind).value)
        alike = np.full((end - start, end - start), 0.9) + 0.1 * np.eye(end - start)
        rows[start:end] = np.linalg.solve(np.linalg.cholesky(alike), rows[start:end])
        start = end
    return dense.spread(rows)


def of_scatter(expected: Expected) -> dense.Spread:
    weights = np.ones(len(expected.rows))
    weights[: 3 * len(expected.problem.design.readings)] = 1.0 / 1.5
    return dense.spread(weights[:, None] * expected.rows)


INSTEAD: dict[str, Callable[[Expected], dense.Spread]] = {
    "temperatures exactly known": lambda one: with_nuisances(one, of_temperatures(one)),
    "repeatability of the data sheet": of_scatter,
    "independent values of certificates": of_certificates,
    "exact offsets of tips": lambda one: with_nuisances(one, of_offsets(one)),
}


def all_assumed(text: str) -> dict[str, list[str]]:
    """Rows of the last table, which has all that is assumed."""
    return {row[0]: row for row in table(text[text.rindex("\nassumed ") + 1 :], "assumed ")}


@pytest.mark.parametrize("seed", [1, 4])
def test_assumptions(seed: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = campaign_file(seed, tmp_path)
    expected = planned(path)
    rows = all_assumed(output_of(capsys, "run", "--assumptions", path))
    lengths = {"as the file states": expected.quantities["U6"]}
    lengths |= {name: of_lengths(expected, spread(expected)) for name, spread in INSTEAD.items()}
    told = yaml.safe_load(path.read_text(encoding="utf-8"))["error_model"]
    counts = (told[f"{kind}_coefficients"] + 1 for kind in ("position", "rotation"))
    richer = Expected(dense.planned(expected.problem.design, *counts))
    lengths["no further terms of the error model"] = richer.quantities["U6"]
    stated = lengths["as the file states"].mean()
    for name, values in lengths.items():
        average, maximum, times = rows[name][-3:]
        assert agrees(average, 1e6 * values.mean(), 3), name
        assert agrees(maximum, 1e6 * values.max(), 3), name
        assert agrees(times, values.mean() / stated, 3), name


def test_assumptions_of_a_design_without_probes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without certificates everything is in proportion to the scatter of readings."""
    told = yaml.safe_load(Path("designs/hocken_borchardt/angles.yaml").read_text("utf-8"))
    told |= told.pop("variants")["any angles"]
    told.pop("probes", None)
    path = tmp_path / "plane.yaml"
    path.write_text(yaml.safe_dump(told), encoding="utf-8")
    rows = all_assumed(output_of(capsys, "run", "--assumptions", path))
    stated, scattered = rows["as the file states"], rows["repeatability of the data sheet"]
    for one, other in zip(stated[-3:], scattered[-3:], strict=True):
        assert agrees(other, 1.5 * float(one), 2)


@pytest.mark.parametrize("seed", [1, 4])
def test_maps(seed: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = campaign_file(seed, tmp_path)
    expected, _, fit = measured(path, capsys, 3)
    volume, offset = expected.problem.design.machine.volume, offset_of("right")

    def errors(points: Real) -> tuple[Real, Real]:
        values, root = expected.corrected(points, offset)
        return values - points - offset, root

    text = output_of(capsys, "map", fit, "--grid", "2,3,2", "--probe", "right")
    rows = [[float(cell) for cell in row] for row in table(text, "x, mm")[:12]]
    points = 1e-3 * np.array([row[:3] for row in rows])
    ends = [np.linspace(volume.lower[k], volume.upper[k], (2, 3, 2)[k]) for k in range(3)]
    grid = np.stack(np.meshgrid(*ends, indexing="ij"), axis=-1).reshape(-1, 3)
    np.testing.assert_allclose(points, grid, rtol=0, atol=1e-6)
    found, root = errors(grid)
    u = np.linalg.norm(root, axis=1).reshape(-1, 3)
    for row, value, own in zip(rows, found, u, strict=True):
        for k in range(3):
            assert within(f"{row[6 + k]}", 2e6 * own[k], step_of(2e6 * own[k], 3))
            step = min(step_of(2e6 * own[k], 3), 0.1) or 1e-6
            assert within(f"{row[3 + k]}", 1e6 * value[k], step)
        assert within(f"{row[9]}", 1e6 * np.linalg.norm(value), 0.01)
    for row in table(text, "length error of"):
        corners = np.array([place(row[1]), place(row[2])])
        apart = corners[1] - corners[0]
        along = apart / np.linalg.norm(apart)
        value, root = errors(corners)
        blocks = root.reshape(2, 3, -1)
        own = 2e6 * float(np.linalg.norm(along @ (blocks[1] - blocks[0])))
        assert agrees(row[3], 1e3 * float(np.linalg.norm(apart)), 7) and agrees(row[5], own, 3)
        assert within(row[4], 1e6 * along @ (value[1] - value[0]), step_of(own, 3)), row
    curves: dict[str, list[list[float]]] = {}
    of_curves = output_of(capsys, "map", fit, "--curves", "--format", "csv")
    for one in csv.DictReader(io.StringIO(of_curves)):
        assert (one["k"], one["unit"]) == ("2", "urad" if one["error"][1] in "ABC0" else "um")
        figures = [float(one[key] or "nan") for key in ("position_mm", "value", "U")]
        curves.setdefault(one["error"], []).append(figures)
    shown = {row[0][:3]: row for row in table(output_of(capsys, "map", fit, "--curves"), "error ")}
    for function in expected.problem.functions:
        axis, told = function.axis, np.array(curves[function.name])
        value, own = expected.curve(function.name, PLACES)
        along = volume.lower[axis] + PLACES * volume.size[axis]
        right = np.stack([1e3 * along, 1e6 * value, 2e6 * own], axis=1)
        np.testing.assert_allclose(told, right, rtol=1e-5, atol=1e-6)
        least, largest, most = shown[function.name][-4:-1]
        step = step_of(2e6 * own.max(), 3)
        assert within(least, 1e6 * value.min(), step) and within(largest, 1e6 * value.max(), step)
        assert agrees(most, 2e6 * own.max())


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_drafts(seed: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Tips of a tenth of the shortest edge and at most 60 mm, and shares of the MPE."""
    draw = np.random.default_rng(seed)
    edges = draw.integers(400, 560, 3) if seed < 3 else draw.integers(900, 1300, 3)
    constant, slope = round(float(draw.uniform(0.6, 3.0)), 2), int(draw.integers(200, 500))
    path = tmp_path / "draft.yaml"
    sheet = {
        "machine-type": "moving bridge",
        "volume": f"{edges[0]} {edges[1]} {edges[2]} mm",
        "mpe": f"{constant} um + L/{slope}",
        "plate": "4 x 3, 210 x 160 mm",
        "certificate": "0.5 um + 0.8 um/m, k=2",
        "tips": "star, 0.3 um",
    }
    words = [word for name, said in sheet.items() for word in (f"--{name}", said)]
    output_of(capsys, "init", path, *words)
    told: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
    # Half as far below the last carriage is the centre of the star.
    arm = min(60.0, int(min(edges)) / 10.0)
    probes = list(told["probes"].values())
    tips = [[float(one.removesuffix(" mm")) for one in probe["offset"]] for probe in probes]
    arms = np.array(tips) + [0.0, 0.0, arm]
    expected = arm * np.array([[0, 0, -1], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
    np.testing.assert_allclose(sorted(arms.tolist()), sorted(expected.tolist()), atol=1e-9)
    assert {probe["standard_uncertainty"] for probe in probes[1:]} == {"0.3 um"}
    assert told["machine"]["volume"] == [f"{edge} mm" for edge in edges]
    error = (constant + np.linalg.norm(edges) / slope) / 8.0
    truth = told["true_machine"]
    for text, value in (
        (told["machine"]["repeatability"], constant / 3.0),
        (truth["position"], error),
        (truth["rotation"], 1e3 * error / max(edges)),
    ):
        assert agrees(text.split()[0], value, 2)
    (certificate,) = told["calibration"]
    assert (certificate["standard_uncertainty"], certificate["common"]) == ("0.25 um", "0.4 um/m")
    goal = re.fullmatch(rf"({NUMBER}) um \+ L/(\d+)", told["target_uncertainty"])
    assert goal is not None and told["coverage_factor"] == 2
    assert float(goal[1]) == pytest.approx(constant / 2.0) and int(goal[2]) == 2000 * slope
    plate = told["artefacts"]["plate"]
    assert (plate["balls"], plate["size"]) == ([4, 3], ["210 mm", "160 mm"])


def test_hours_of_a_plan_that_goes_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What is done costs nothing more; the rest is added up from the sheet by hand."""
    told = yaml.safe_load(TEXT)
    by_name = {one["name"]: one for one in told["pool"]["candidates"]}
    path, day, readings = (tmp_path / name for name in ("pool.yaml", "day.yaml", "done.csv"))
    path.write_text(TEXT, encoding="utf-8")
    output_of(capsys, "plan", path, "--positions", 5, "-o", day, "--workers", 1)
    output_of(capsys, "simulate", day, "-o", readings, "-q")
    head, *lines = readings.read_text(encoding="utf-8").splitlines()
    first = [line for line in lines if line.split(",")[0] in ("low", "side")]
    readings.write_text("\n".join([head, *first, ""]), encoding="utf-8")
    line = ["plan", path, "--done", readings, "--from", day, "--hours", 3, "--workers", 1]
    text = output_of(capsys, *line)
    steps = [row for row in table(text, "   start") if len(row) > 5]
    done = [row for row in steps if row[1] == "done"]
    rest = [row for row in steps if re.fullmatch(r"\d+:\d\d", row[1])]
    assert {row[2] for row in done} == {"low", "side"} and len(rest) == 3
    seconds, before = 0.0, None
    for row in rest:
        one = by_name[row[3]]
        own = 600.0 + 60.0 * int(row[-1]) + 180.0 * (len(one["probes"]) - 1)
        if before is not None:
            own += 1200.0 * (before["plane"] != one["plane"])
            own += 180.0 * (before["probes"][-1] != one["probes"][0])
        seconds, before = seconds + own, one
    (chosen,) = [row for row in table(text, "                ") if row[0] == "chosen"]
    count = str(sum(int(row[-1]) for row in rest))
    assert within(chosen[-3], seconds / 3600.0, 0.01) and chosen[-2:] == [count, "3"]
    total = re.search(rf"(\d+) positions, (\d+) readings: ({NUMBER}) h.*; 2 positions done", text)
    assert total is not None and total.groups()[:2] == ("3", count)
    assert within(total[3], seconds / 3600.0, 0.01)
