"""What fit, correct, diff and budget print of campaigns, against least squares and
covariances of the dense reference.
"""

from __future__ import annotations

import csv
import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import fdtrc, stdtr

from tests.oracle.campaigns import AXES, Fitted, campaign_file, fitted, planned
from tests.oracle.printed import (
    FACTORS,
    NUMBER,
    agrees,
    cells,
    output_of,
    place,
    step_of,
    table,
    within,
)
from tests.oracle.uncertainties import judge_data, judge_text
from tests.reference import dense
from tests.reference.random_experiments import PROBES

Real = NDArray[np.float64]
# Coverage factors of two campaigns.
FACTOR_OF = {1: 2.0, 4: 3.0}
# Derivatives of two maps are compared at one point between them.
RELATIVE = 1e-4
# A turn that is held about one axis follows those about the others in the second order, and as it
# is reached: 0.1 mrad twice is 10 nrad at the most, and of these a part.
OF_TURNS = 2e-3


@pytest.fixture(params=FACTOR_OF)
def path(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    return campaign_file(request.param, tmp_path)


@pytest.fixture
def k(path: Path) -> float:
    return FACTOR_OF[int(path.stem.removeprefix("campaign"))]


def measured(
    path: Path, capsys: pytest.CaptureFixture[str], seed: int
) -> tuple[Fitted, Path, Path]:
    """The dense least squares of synthetic readings, their file, and the map of their fit."""
    readings, fit = path.with_name(f"r{seed}.csv"), path.with_name(f"m{seed}.yaml")
    output_of(capsys, "simulate", path, "-o", readings, "--seed", seed, "-q")
    output_of(capsys, "fit", path, readings, "-o", fit, "-q")
    return fitted(path, readings), readings, fit


def to_step(text: str, value: float, u: float) -> bool:
    """Whether a figure is a value to the third digit of its standard uncertainty."""
    return within(text, value, min(step_of(u, 3), 1.0))


def offset_of(name: str) -> Real:
    return 1e-3 * np.array([float(one.removesuffix(" mm")) for one in PROBES[name]])


def test_fit(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    expected, readings, _ = measured(path, capsys, 3)
    text = output_of(capsys, "fit", path, readings, "--monomials")
    judge_text(text, expected)
    total = re.search(
        rf"S\^2 = ({NUMBER}) with (\d+) degrees of freedom; sigma = ({NUMBER}) times", text
    )
    assert total is not None
    assert agrees(total[1], expected.sum_of_squares, 6)
    assert int(total[2]) == expected.degrees_of_freedom
    assert agrees(total[3], expected.sigma)
    shown = expected.names["U3"] + [n for n in expected.names["U2"] if "rotation" in n]
    rows = table(text, "parameter ")
    assert [row[0] for row in rows] == shown
    for name, value, u, unit in rows:
        assert unit == ("µrad" if "rotation" in name or name[1] in "ABC" else "µm")
        right = expected.standard_uncertainties[name] / FACTORS[unit]
        assert agrees(u, right, 3)
        slack = OF_TURNS * right if "rotation" in name else 0.0
        step = step_of(right, 3) + 2.0 * slack
        assert within(value, expected.estimates[name] / FACTORS[unit], step), name
    left = dense.residuals(expected.problem, np.zeros(expected.problem.parameters))
    design = expected.problem.design
    own = design.readings
    largest = np.argsort(-np.abs(left[: 3 * len(own)]))
    for row, k in zip(table(text, "largest residuals"), largest, strict=False):
        reading, axis = divmod(int(k), 3)
        names = (
            design.positions.names[own.position[reading]],
            design.balls.names[own.ball[reading]],
            design.probes.names[own.probe[reading]],
            AXES[axis],
        )
        assert tuple(row[:4]) == names
        assert agrees(row[5], left[k] / expected.sigma)
        micrometres = 1e6 * left[k] * design.machine.repeatability[axis]
        assert agrees(row[4], micrometres)
    data = json.loads(output_of(capsys, "fit", path, readings, "--monomials", "--json"))
    judge_data(data["quantities"], expected)
    assert set(data["estimates"]) == set(expected.estimates)
    for name, told in data["estimates"].items():
        right = expected.standard_uncertainties[name]
        of_plate = ": rotation" in name or name[0] == "r"
        slack = OF_TURNS if of_plate else 1e-5
        assert abs(told["value"] - expected.estimates[name]) < slack * right + 1e-15, name
        assert told["standard_uncertainty"] == pytest.approx(right, rel=1e-6)
    sums = data["sum_of_squares"], data["sigma"], data["degrees_of_freedom"]
    right_sums = expected.sum_of_squares, expected.sigma, expected.degrees_of_freedom
    assert sums == pytest.approx(right_sums, rel=1e-6)


def corrected(expected: Fitted, x: Real, probes: list[str]) -> tuple[Real, Real]:
    """Corrected points (m, 3) and a root of their covariance, each with its own probe."""
    found = [
        expected.corrected(one[None], offset_of(name)) for one, name in zip(x, probes, strict=True)
    ]
    return np.concatenate([one for one, _ in found]), np.concatenate([root for _, root in found])


def test_correct(path: Path, k: float, capsys: pytest.CaptureFixture[str]) -> None:
    expected, _, fit = measured(path, capsys, 3)
    volume = expected.problem.design.machine.volume
    x = np.random.default_rng(int(k)).uniform(volume.lower, volume.upper, (4, 3)).round(4)
    x[3] = volume.upper + 0.01
    names, probes = list("ABCD"), ["down", "right", "front", "down"]
    points = path.with_name("points.csv")
    with points.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(["name", "probe", "x_mm", "y_mm", "z_mm"])
        writer.writerows(
            [n, p, *(1e3 * one).tolist()] for n, p, one in zip(names, probes, x, strict=True)
        )
    out, covariance = path.with_name("out.csv"), path.with_name("covariance.csv")
    lengths = [("A", "B"), ("C", "A")]
    asked = [word for pair in lengths for word in ("--length", *pair)]
    line = ["correct", fit, points, *asked, "--coverage-factor", k]
    text = output_of(capsys, *line, "-o", out, "--covariance", covariance)
    data = json.loads(output_of(capsys, *line, "--json"))
    value, root = corrected(expected, x, probes)
    whole = root @ root.T
    u = np.sqrt(np.diagonal(whole)).reshape(-1, 3)
    tips = x + np.array([offset_of(name) for name in probes])
    correction = value - tips
    largest = re.search(rf"U = ({NUMBER}) u = ({NUMBER}) µm at most", text)
    assert largest is not None and float(largest[1]) == k
    assert agrees(largest[2], 1e6 * k * u.max())
    assert f"U = {k:g} u, without" in text and f"sigma {expected.sigma:.4g} (est" in text
    assert "1 of 4 points lie outside the volume of the map" in data["warnings"][0]
    assert data["warnings"][0].endswith(": D")
    rows = table(text, "point ")
    assert [row[:2] for row in rows] == [list(one) for one in zip(names, probes, strict=True)]
    for i, row in enumerate(rows):
        for axis in range(3):
            standard = u[i, axis]
            place_, change, expanded = (row[2 + 3 * part + axis] for part in range(3))
            assert to_step(place_, 1e3 * value[i, axis], 1e3 * standard)
            assert to_step(change, 1e6 * correction[i, axis], 1e6 * standard)
            assert agrees(expanded, 1e6 * k * standard, 3)
    with out.open(encoding="utf-8") as stream:
        written = list(csv.DictReader(stream))
    for i, (row, told) in enumerate(zip(written, data["points"], strict=True)):
        assert (row["name"], row["probe"], float(row["k"])) == (names[i], probes[i], k)
        assert row["outside"] == ("yes" if i == 3 else "no") and told["outside"] == (i == 3)
        assert (told["name"], told["probe"]) == (names[i], probes[i])
        in_file = [
            [float(row[head.format(axis)]) for axis in AXES]
            for head in ("{}_mm", "correction_{}_um", "U_{}_um")
        ]
        right = [1e3 * value[i], 1e6 * correction[i], 1e6 * k * u[i]]
        np.testing.assert_allclose(in_file, right, rtol=1e-6, atol=1e-9)
        in_data = [told["point"], told["correction"], told["standard_uncertainty"]]
        np.testing.assert_allclose(in_data, [value[i], correction[i], u[i]], rtol=1e-6, atol=1e-13)
    with covariance.open(encoding="utf-8") as stream:
        head, *body = list(csv.reader(stream))
    assert head[1:] == [row[0] for row in body] == [f"{n}: {axis}" for n in names for axis in AXES]
    size = 1e12 * np.outer(u.ravel(), u.ravel())
    told_covariance = np.array([[float(one) for one in row[1:]] for row in body])
    assert (np.abs(told_covariance - 1e12 * whole) < 1e-6 * size).all()
    table_rows, blocks = table(text, "length "), root.reshape(4, 3, -1)
    assert len(table_rows) == len(data["lengths"]) == len(lengths)
    for row, told, (one, other) in zip(table_rows, data["lengths"], lengths, strict=True):
        i, j = names.index(one), names.index(other)
        between = value[i] - value[j]
        length = float(np.linalg.norm(between))
        standard = float(np.linalg.norm(between / length @ (blocks[i] - blocks[j])))
        change = length - float(np.linalg.norm(tips[i] - tips[j]))
        assert row[0] == told["name"] == f"{one} to {other}"
        assert to_step(row[1], 1e3 * length, 1e3 * standard)
        assert to_step(row[2], 1e6 * change, 1e6 * standard)
        assert agrees(row[3], 1e6 * k * standard, 3) and float(row[4]) == k
        right_one = {"value": length, "correction": change, "standard_uncertainty": standard}
        for key, right_value in right_one.items():
            assert told[key] == pytest.approx(right_value, rel=1e-6, abs=1e-13), key


class Difference:
    """What the second map says less what the first does, with standard uncertainties."""

    def __init__(self, first: Fitted, second: Fitted):
        self.maps = first, second
        volume = first.problem.design.machine.volume
        self.offset = offset_of("right")
        ends = [np.linspace(low, up, 4) for low, up in zip(volume.lower, volume.upper, strict=True)]
        self.grid = np.stack(np.meshgrid(*ends, indexing="ij"), axis=-1).reshape(-1, 3)
        values, roots = zip(
            *(one.corrected(self.grid, self.offset) for one in self.maps), strict=True
        )
        self.values = (values[1] - values[0]).ravel()
        self.root = np.concatenate([roots[0], roots[1]], axis=1)
        middle = self.grid - self.grid.mean(axis=0)
        n = len(self.grid)
        motions = np.zeros((3 * n, 6))
        for axis in range(3):
            motions[axis::3, axis] = 1.0
            motions[:, 3 + axis] = np.cross(np.eye(3)[axis], middle).ravel()
        self.to_motion = np.linalg.pinv(motions)
        self.less = np.eye(3 * n) - motions @ self.to_motion

    def by(self, matrix: Real) -> tuple[Real, Real]:
        return matrix @ self.values, np.sqrt(((matrix @ self.root) ** 2).sum(axis=-1))

    def point(self, where: list[float]) -> int:
        distance = np.linalg.norm(self.grid - np.array(where), axis=1)
        assert distance.min() < 1e-5
        return int(distance.argmin())

    def of(self, name: str) -> tuple[float, float]:
        """The figure of a name: a length between places, an error at one, or a function's value."""
        if " to (" in name:
            i, j = (self.point(place(part)) for part in name.split(" to "))
            apart = self.grid[j] - self.grid[i]
            row = np.zeros((len(self.grid), 3))
            row[j], row[i] = apart / np.linalg.norm(apart), -apart / np.linalg.norm(apart)
            value, u = self.by(row.ravel())
        elif " at (" in name:
            axis, where = name.split(" at ")
            value, u = self.by(self.less[3 * self.point(place(where)) + AXES.index(axis)])
        else:
            value, u = self.of_function(*re.fullmatch(r"(E\w\w) at (\d+) %", name).groups())  # type: ignore[union-attr]
        return float(value), float(u)

    def of_function(self, name: str, share: str) -> tuple[float, float]:
        figures = [
            [float(part[0]) for part in one.curve(name, np.array([float(share) / 100.0]))]
            for one in self.maps
        ]
        return figures[1][0] - figures[0][0], math.hypot(figures[0][1], figures[1][1])


def judge_joint_test(text: str, first: Fitted, second: Fitted) -> None:
    """One test of all that two maps say of all probes at points through the volume, whatever the
    frame and the offsets of the probes.
    """
    line = re.search(
        rf"^errors through the volume, one joint test: chi-squared ({NUMBER}) of (\d+) independent"
        rf" differences \(sigma of (\d+) degrees of freedom\), p = (below )?({NUMBER}): ",
        text,
        re.M,
    )
    assert line is not None
    volume = first.problem.design.machine.volume
    points = np.random.default_rng(7).uniform(volume.lower, volume.upper, (25, 3))
    blocks, values, roots = [], [], []
    middle = points - points.mean(axis=0)
    for k, name in enumerate(PROBES):
        block = np.zeros((len(points), 3, 3 + 3 * len(PROBES)))
        for axis in range(3):
            block[:, :, axis] = np.cross(np.eye(3)[axis], middle)
            block[:, axis, 3 + 3 * k + axis] = 1.0
        blocks.append(block.reshape(-1, block.shape[2]))
        (one, root), (other, other_root) = (
            each.corrected(points, offset_of(name)) for each in (first, second)
        )
        values.append((other - one).ravel())
        roots.append(np.hstack([root, other_root]))
    free = np.linalg.qr(np.vstack(blocks))[0]
    whole = np.vstack(roots)
    left = whole - free @ (free.T @ whole)
    difference = np.concatenate(values)
    vectors, sizes, _ = np.linalg.svd(left, full_matrices=False)
    kept = sizes > 1e-7 * sizes[0]
    count = int(kept.sum())
    statistic = float(((vectors[:, kept].T @ difference / sizes[kept]) ** 2).sum())
    assert int(line[2]) == count
    # The directions that are known best follow the point at which both maps are linear.
    assert within(line[1], statistic, step_of(statistic, 4) + 0.01 * statistic)
    freedom = [one.degrees_of_freedom for one in (first, second)]
    # Of campaigns of one plan the variances are alike: Welch's formula for shares of one ratio, and
    # Fisher's distribution for the sum of both residuals.
    share = first.sigma**2 / (first.sigma**2 + second.sigma**2)
    welch = 1.0 / (share**2 / freedom[0] + (1.0 - share) ** 2 / freedom[1])
    assert abs(int(line[3]) - welch) < 1.0
    chance = float(fdtrc(count, sum(freedom), float(line[1]) / count))
    assert not line[4] and float(line[5]) == pytest.approx(chance, rel=0.06)


def test_diff(path: Path, k: float, capsys: pytest.CaptureFixture[str]) -> None:
    first, _, one = measured(path, capsys, 3)
    second, _, other = measured(path, capsys, 4)
    found, out = Difference(first, second), path.with_name("figures.csv")
    line = ["diff", one, other, "--coverage-factor", k, "--probe", "right"]
    text = output_of(capsys, *line, "-o", out)
    data = json.loads(output_of(capsys, *line, "--json"))
    assert f"U = {k:g} u, E_n = difference / U" in text and data["coverage_factor"] == k
    judge_joint_test(text, first, second)
    motion, u_motion = found.by(found.to_motion)
    for row, told, value, u in zip(
        table(text, "free motion"), data["motion"], motion, u_motion, strict=False
    ):
        assert row[0] == told["name"]
        assert row[3] == ("µm" if "shift" in row[0] else "µrad")
        assert told["value"] == pytest.approx(value, abs=RELATIVE * u)
        assert told["standard_uncertainty"] == pytest.approx(u, rel=RELATIVE)
        assert within(row[1], 1e6 * value, step_of(1e6 * value, 4) + 1e6 * RELATIVE * u)
        assert agrees(row[2], 1e6 * k * u)
    with out.open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    groups: dict[str, list[tuple[str, float]]] = {}
    draw = np.random.default_rng(1)
    for row in rows:
        name, u = row["figure"], float(row["standard uncertainty"])
        kind = "error functions" if name.startswith("E") else row["kind"]
        normalised = float(row["E_n"]) if row["E_n"] else math.nan
        assert row["unit"] == ("rad" if name[:2] in ("EA", "EB", "EC") else "m")
        if row["E_n"]:
            groups.setdefault(kind, []).append((name, normalised))
            assert normalised * k * u == pytest.approx(float(row["difference"]), rel=1e-6)
        if len(rows) < 300 or draw.random() < 0.15 or kind.endswith(("diagonals", "edges")):
            right, right_u = found.of(name)
            assert float(row["difference"]) == pytest.approx(right, abs=RELATIVE * right_u + 1e-15)
            assert u == pytest.approx(right_u, rel=RELATIVE, abs=1e-15)
    freedom = np.array([each.degrees_of_freedom for each in (first, second)])
    counted = table(text, "figures ")
    assert [row[0] for row in counted] == list(groups)
    for kind, compared, exceeding, chance, largest, where in counted:
        figures = groups[kind]
        sizes = np.array([abs(size) for _, size in figures])
        above = int((sizes > 1.0).sum())
        assert int(compared) == len(figures)
        assert exceeding == f"{above} ({100 * above / len(figures):.1f} %)"
        assert agrees(largest, sizes.max(), 3)
        assert where in [name for name, size in figures if abs(size) > sizes.max() * (1 - 1e-5)]
        # Degrees of freedom of a difference lie between the smaller and the sum of both.
        bounds = [200.0 * stdtr(one, -k) for one in (freedom.sum(), freedom.min())]
        assert bounds[0] - 0.051 <= float(chance.removesuffix(" %")) <= bounds[1] + 0.051
    for row in table(text, "length "):
        name = row[0].partition(": ")[2]
        value, u = found.of(name)
        assert within(row[1], 1e6 * value, step_of(1e6 * value, 4) + 1e6 * RELATIVE * u)
        assert agrees(row[2], 1e6 * k * u)
        assert within(row[3], value / (k * u), step_of(value / (k * u), 3) + RELATIVE)
    by_function: dict[str, list[tuple[str, float]]] = {}
    for name, size in groups["error functions"]:
        by_function.setdefault(name[:3], []).append((name, abs(size)))
    for row in table(text, "error function "):
        sizes_of = by_function[row[0][:3]]
        name, size = max(sizes_of, key=lambda pair: pair[1])
        assert agrees(row[1], size, 3)
        assert f"{row[0][:3]} at {row[2]}" in [n for n, s in sizes_of if s > size * (1 - 1e-5)]


def test_budget(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    expected = planned(path)
    problem = expected.problem
    design = problem.design
    rows = expected.rows
    size = np.linalg.norm(rows, axis=0)
    inverse = np.linalg.pinv(rows / size, rcond=1e-11) / size[:, None]
    ends = [0, 3 * len(design.readings), len(dense.known(design, "distance").first)]
    ends = [0, ends[1], ends[1] + ends[2], len(rows)]
    sources = (
        "readings",
        "calibration[0]: distances of plate",
        "calibration[1]: coordinates of plate",
    )
    volume = design.machine.volume
    text = output_of(capsys, "run", "--budget", path)
    data = json.loads(output_of(capsys, "run", "--budget", path, "--json"))
    told = dict(
        re.findall(r"^(diagonal \d): length of the body diagonal from (.* mm)$", text, re.M)
    )
    assert len(told) == 4
    heads = cells(next(one for one in text.splitlines() if one.startswith("standard uncertainty,")))
    of_text = {row[0]: row[1:] for row in table(text, "standard uncertainty, µm")}
    assert heads[1:] == ["U4", "U6", *told] == [one["figure"] for one in data["figures"]]
    for column, (figure, one) in enumerate(zip(heads[1:], data["figures"], strict=True)):
        if figure in told:
            start, end = (np.array(place(part)) for part in told[figure].split(" to "))
            for corner in (start, end):
                assert (np.isclose(corner, volume.lower) | np.isclose(corner, volume.upper)).all()
            assert np.isclose(np.abs(end - start), volume.upper - volume.lower).all()
            offset = design.probes.offsets[design.evaluation.probe]
            function = expected.displacements(np.array([start, end]), offset)
            linear = expected.linear(
                lambda step, f=function: dense.length(np.diff(f(step), axis=0))
            )
        else:
            linear = expected.linear(expected.functions[figure])
        by_row = (linear @ inverse) ** 2
        parts = [
            float(np.sqrt(by_row[:, low:high].sum(axis=1).mean()))
            for low, high in zip(ends[:-1], ends[1:], strict=True)
        ]
        total = math.hypot(*parts)
        assert one["standard_uncertainty"] == pytest.approx(total, rel=1e-6)
        assert one["expanded_uncertainty"] == pytest.approx(2 * total, rel=1e-6)
        assert agrees(of_text["together, in squares"][column], 1e6 * total)
        assert agrees(of_text["expanded, k = 2"][column], 2e6 * total)
        by_source = {each["source"]: each for each in one["contributions"]}
        assert set(by_source) == set(sources) <= set(of_text)
        for source, part in zip(sources, parts, strict=True):
            share = (part / total) ** 2
            assert by_source[source]["standard_uncertainty"] == pytest.approx(part, rel=1e-6)
            assert by_source[source]["share_of_variance"] == pytest.approx(share, rel=1e-6)
            cell = re.fullmatch(rf"({NUMBER}) \((<?\s*{NUMBER}) %\)", of_text[source][column])
            assert cell is not None, of_text[source][column]
            assert agrees(cell[1], 1e6 * part, 3), (figure, source)
            assert within(cell[2].lstrip("< "), 100 * share, 1.0)


def test_temperatures_of_a_map(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Mean temperatures over the positions, some of which have their own."""
    known = {"value": "11.5e-6 1/K", "standard_uncertainty": "1e-6 1/K"}
    own: dict[str, Any] = {
        "z0": {"artefact": "22 degC", "scales": "23 degC"},
        "y5": {"scales": "26 degC"},
    }
    influence = {
        "kind": "temperature",
        "artefact_expansion": known,
        "artefact_temperature": {"value": "21 degC", "standard_uncertainty": "0.01 K"},
        "scale_expansion": known,
        "scale_temperature": {"value": "20.6 degC", "standard_uncertainty": "0.01 K"},
        "positions": own,
    }
    path = campaign_file(1, tmp_path, influences=[influence])
    _, _, fit = measured(path, capsys, 3)
    points = path.with_name("points.csv")
    points.write_text("x_mm,y_mm,z_mm\n2000,2000,2000\n", encoding="utf-8")
    (line,) = [
        one
        for one in output_of(capsys, "correct", fit, points).splitlines()
        if one.startswith("temperatures of the campaign")
    ]
    told = {word: float(value) for word, value in re.findall(rf"(\w+) ({NUMBER}) °C", line)}
    assert told == pytest.approx(
        {
            "reference": 20.0,
            "scales": (23.0 + 26.0 + 4 * 20.6) / 6,
            "artefact": (22.0 + 5 * 21.0) / 6,
        },
        abs=0.006,
    )
