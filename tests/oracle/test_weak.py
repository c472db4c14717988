"""Weakly determined directions that check and run print, against the dense covariance."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.oracle.campaigns import Expected, campaign_file, planned
from tests.oracle.null_words import Directions
from tests.oracle.printed import FACTORS, NUMBER, agrees, output_of

Real = NDArray[np.float64]

# A direction that adds more than the target, in metres, is weak.
TARGET = 0.06e-6


def relative_changes(expected: Expected) -> Real:
    """Changes (points, 3, n) of corrected points, less the motion of all that is nearest."""
    design = expected.problem.design
    points = design.evaluation.points
    offset = design.probes.offsets[design.evaluation.probe]
    function = expected.displacements(points, offset)
    change = expected.linear(lambda step: function(step).ravel())
    motions = np.zeros((*points.shape, 6))
    for axis in range(3):
        motions[:, axis, axis] = 1.0
        motions[:, :, 3 + axis] = np.cross(np.eye(3)[axis], points - points.mean(axis=0))
    basis = np.linalg.qr(motions.reshape(-1, 6))[0]
    return np.asarray(change - basis @ (basis.T @ change)).reshape(*points.shape, -1)


def weak_directions(expected: Expected) -> list[tuple[float, Real, Real]]:
    """Effect, effects at points (m,) and direction (n,) of each weak one, weakest first: principal
    directions of the covariance of poses and machine errors, by what each moves a point at most.
    """
    directions = Directions(expected)
    size = directions.size.copy()
    for k, (kind, name, _) in enumerate(directions.owner):
        if kind == "function":
            unit = np.zeros(len(size))
            unit[k] = directions.span if name[1] in "ABC" else 1.0
            size[k] = np.abs(directions.curve(unit, name)).max()
    shared = np.array([kind != "plate" for kind, _, _ in directions.owner])
    covariance = expected.spread.covariance[np.ix_(shared, shared)]
    values, vectors = np.linalg.eigh(covariance * np.outer(size[shared], size[shared]))
    changes = relative_changes(expected)
    found = []
    for value, vector in zip(values, vectors.T, strict=True):
        direction = np.zeros(len(size))
        direction[shared] = np.sqrt(value) * vector / size[shared]
        of_points = np.sqrt(2.0 * ((changes @ direction) ** 2).mean(axis=1))
        found.append((float(np.sqrt((of_points**2).mean())), of_points, direction))
    return [one for one in reversed(found) if one[0] > TARGET]


def test_weak_directions(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    # With three coefficients the reference has the program's parameters.
    model = {"kind": "kinematic", "arrangement": "MB2"}
    model |= {"position_coefficients": 3, "rotation_coefficients": 3}
    path = campaign_file(1, tmp_path, error_model=model, target_uncertainty="0.06 um")
    expected = planned(path)
    directions, weak = Directions(expected), weak_directions(expected)
    assert len(weak) > 1
    text = output_of(capsys, "run", path)
    checked = output_of(capsys, "check", path)
    data = json.loads(output_of(capsys, "run", path, "--json"))
    lines = re.findall(r"^weakly determined \d+: .*$", text, re.M)
    assert lines == re.findall(r"^weakly determined \d+: .*$", checked, re.M)
    assert len(lines) == len(data["weakly_determined"]) == len(weak)
    count = len(expected.problem.design.evaluation.points)
    for line, told, (effect, of_points, direction) in zip(
        lines, data["weakly_determined"], weak, strict=True
    ):
        beyond = int((of_points > TARGET).sum())
        end = re.search(
            rf": known only to ({NUMBER}) (µm) in corrected points, relative to one another \(root"
            rf" mean square over (\d+) points; more than ({NUMBER}) (µm) at (\d+) points\)$",
            line,
        )
        assert end is not None, line
        assert agrees(end[1], effect / FACTORS[end[2]], 3)
        assert agrees(end[4], TARGET / FACTORS[end[5]], 3)
        assert (int(end[3]), int(end[6])) == (count, beyond)
        assert told["standard_deviation"] == pytest.approx(effect, rel=1e-5)
        assert told["limit"] == pytest.approx(TARGET)
        assert (told["points"], told["points_beyond_limit"]) == (count, beyond)
        assert line.endswith(told["text"])
        amounts = re.findall(rf"(E\w\w) \([^()]*\) by ({NUMBER}) (µm|µrad)", line)
        assert amounts
        curves = {name: directions.curve(direction, name) for name, _, _ in amounts}
        first = curves[amounts[0][0]]
        sign = np.sign(first[np.abs(first).argmax()])
        for name, amount, unit in amounts:
            assert unit == ("µrad" if name[1] in "ABC" else "µm")
            # Of a curve that is as large at two places, either sign may be printed.
            peak = np.abs(curves[name]).max() / FACTORS[unit]
            ends = [sign * end / FACTORS[unit] for end in (curves[name].min(), curves[name].max())]
            assert agrees(amount.lstrip("-"), peak, 3), (line, name)
            assert min(abs(float(amount) - end) for end in ends) < 0.01 * peak, (line, name)
