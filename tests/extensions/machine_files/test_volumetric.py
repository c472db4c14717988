"""Volumetric errors: closed forms, errors measured on other lines, random parts against Monte
Carlo.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.machine_files.curves import Points
from ballplate.extensions.machine_files.description import (
    AxisTemperature,
    MachineDescription,
    ParametricError,
    PowerSeries,
    Squareness,
    fitted_volumetric,
    true_volumetric,
)
from ballplate.extensions.machine_files.machine_file import load_machine
from ballplate.extensions.machine_files.straightness import Criterion
from ballplate.extensions.maps.volumetric_errors import Volumetric
from ballplate.simulator.machines.arrangement import ARRANGEMENTS

from tests.published.rigid_body import tip_error

SIZE = np.array([1.8, 1.2, 0.9])
AXES = "xyz"


def machine(name: str = "MB2", **more: object) -> MachineDescription:
    plain = {
        "title": name,
        "arrangement_name": name,
        "arrangement": ARRANGEMENTS[name],
        "lower": (0.0, 0.0, 0.0),
        "upper": tuple(SIZE.tolist()),
        "reference": (0.0, 0.0, 0.0),
    }
    return MachineDescription(**{**plain, **more})  # type: ignore[arg-type]


def test_diagonals_of_scale_errors_have_their_closed_form() -> None:
    scales = np.array([11e-6, -7e-6, 23e-6])
    errors = tuple(
        ParametricError(f"E{axis}{axis}", PowerSeries((5e-6, scale * size)))
        for axis, scale, size in zip("XYZ", scales.tolist(), SIZE.tolist(), strict=True)
    )
    built = Volumetric(machine(errors=errors))
    found = built.lengths(*built.volume.diagonals)
    expected = np.linalg.norm(SIZE * (1 + scales)) - np.linalg.norm(SIZE)
    np.testing.assert_allclose(found.errors, expected, rtol=0, atol=1e-15)
    np.testing.assert_allclose(found.nominal, np.linalg.norm(SIZE), rtol=1e-15)


def test_diagonals_of_squareness_have_their_closed_form() -> None:
    alpha, beta1, beta2 = 31e-6, -12e-6, 19e-6
    square = (Squareness("EC0Y", alpha), Squareness("EB0Z", -beta1), Squareness("EA0Z", beta2))
    built = Volumetric(machine(squareness=square))
    found = built.lengths(*built.volume.diagonals)
    for k, (start, end) in enumerate(
        [
            ((0, 0, 0), (1, 1, 1)),
            ((1, 0, 0), (0, 1, 1)),
            ((0, 1, 0), (1, 0, 1)),
            ((0, 0, 1), (1, 1, 0)),
        ]
    ):
        x, y, z = (np.array(end) - start) * SIZE
        turned = np.linalg.norm([x - beta1 * z, y - alpha * x - beta2 * z, z])
        assert found.errors[k] == pytest.approx(turned - np.linalg.norm(SIZE), abs=1e-15)
        np.testing.assert_array_equal(found.starts[k], np.array(start) * SIZE)


def test_errors_are_zero_at_the_reference_point_wherever_it_is() -> None:
    names = [f"E{kind}{axis}" for axis in "XYZ" for kind in "XYZABC"]
    generator = np.random.default_rng(2)
    errors = tuple(
        ParametricError(name, PowerSeries(tuple(generator.normal(0, 1e-5, 4).tolist())))
        for name in names
    )
    reference = (0.7, 0.5, 0.2)
    for name in ARRANGEMENTS:
        for criterion in ("end points", "least squares", "minimum zone"):
            told = tuple(
                ParametricError(one.name, one.shape, criterion=criterion)  # type: ignore[arg-type]
                for one in errors
            )
            built = Volumetric(
                machine(name, errors=told, reference=reference, probe=(0.1, 0.2, -0.3))
            )
            np.testing.assert_allclose(built.systematic(np.array([reference])), 0.0, atol=1e-20)


# Smooth errors of all kinds, straightness errors zero at both ends, rotations and positioning
# errors at the first.
@pytest.mark.parametrize("criterion", ["end points", "least squares", "minimum zone"])
def test_a_straight_table_that_is_shorter_than_its_axis_is_no_error(criterion: Criterion) -> None:
    table = Points((0.02, 0.6, 1.75), (2e-6, 60e-6, 175e-6))
    roll = ParametricError("EAX", Points((0.02, 1.75), (1e-6, 1e-6)))
    eyx = ParametricError("EYX", table, line=(0.0, 0.0, 0.5), criterion=criterion)
    found = Volumetric(machine(errors=(roll, eyx))).systematic(
        np.linspace((0, 0, 0), (1.8, 0, 0), 181)
    )
    np.testing.assert_allclose(found, 0.0, atol=1e-15)


@pytest.mark.parametrize(("name", "error"), [("MH1", "EXX"), ("MH2", "EYY")])
def test_droop_that_was_measured_with_a_positioning_error_counts_once(
    name: str, error: str
) -> None:
    axis = AXES.index(error[2].lower())
    line = (0.1, 0.2, 0.4)
    reference = (0.3, 0.1, 0.15)
    droop = 10e-6 * (np.array([0.0, SIZE[axis]]) - reference[axis]) * (0.4 - 0.15)
    measured = PowerSeries((0.0, float(droop[1] - droop[0])))
    described = machine(
        name,
        errors=(ParametricError(error, measured, line),),
        droop={"phi1": 10e-6},
        reference=reference,
    )
    points = np.array([line, line])
    points[:, axis] = 0.0, SIZE[axis]
    found = Volumetric(described).systematic(points)
    np.testing.assert_allclose(found[:, axis], droop, rtol=0, atol=1e-18)


def true_functions(seed: int) -> dict[str, Callable[[float], float]]:
    found = {}
    generator = np.random.default_rng(seed)
    for axis in AXES:
        for kind in "dE":
            for component in AXES:
                a, b, c = (generator.normal(0, 1e-5, 3)).tolist()
                if kind == "d" and component != axis:
                    found[f"{kind}{component}_{axis}"] = lambda t, a=a, b=b: (
                        t * (1 - t) * (a + b * t)
                    )
                else:
                    found[f"{kind}{component}_{axis}"] = lambda t, a=a, b=b, c=c: (
                        a * t + b * t**2 + c * t**3
                    )
    return found


def values_at(
    functions: dict[str, Callable[[float], float]], position: np.ndarray
) -> dict[str, float]:
    return {
        name: one(position[AXES.index(name[3])] / SIZE[AXES.index(name[3])])
        for name, one in functions.items()
    }


TABLES = [name for name, one in ARRANGEMENTS.items() if one.workpiece_side]


@pytest.mark.parametrize(
    ("name", "straightedge"),
    [*((name, False) for name in ARRANGEMENTS), *((name, True) for name in TABLES)],
)
def test_errors_measured_on_other_lines_give_the_errors_of_rigid_bodies(
    name: str, straightedge: bool, tmp_path: Path
) -> None:
    """Rigid bodies are measured on lines all over the volume, with a reflector off the probe; the
    tables give the map.

    Of a table that moves a point fixed to it is measured, or the tip along a straightedge on it.
    """
    chain = [list(ARRANGEMENTS[name].probe_side), list(ARRANGEMENTS[name].workpiece_side)]
    functions, square = true_functions(5), {"a": 2e-5, "b1": -1e-5, "b2": 3e-5}
    generator = np.random.default_rng(6)
    lines = ["errors:"]
    for key in functions:
        k, component = AXES.index(key[3]), AXES.index(key[1])
        positions = np.linspace(0.0, SIZE[k], 41)
        at, reflector = generator.uniform(0.1, 0.8, 3), generator.uniform(-0.1, 0.1, 3)
        if key[0] == "E":
            values = [functions[key](x / SIZE[k]) for x in positions]
        else:
            values = []
            for x in positions:
                where = at.copy()
                where[k] = x
                errors = values_at(functions, where) | square
                follows = key[3] in chain[1] and not straightedge
                seen_from = np.where((np.arange(3) == k) & follows, 0.0, where)
                values.append(tip_error(chain, seen_from, reflector, errors)[component])
        letters = "XYZ" if key[0] == "d" else "ABC"
        iso, unit = f"E{letters[component]}{key[3].upper()}", "um" if key[0] == "d" else "urad"
        others = ", ".join(f"{AXES[j]} = {at[j]:.17g} m" for j in range(3) if j != k)
        head = [f"# line: {others}", "# probe: " + ", ".join(f"{x:.17g} m" for x in reflector)]
        if straightedge and key[3] in chain[1] and component != k:
            head.append("# straightedge: table")
        rows = [
            f"{1000 * x!r},{1e6 * value!r}"
            for x, value in zip(positions.tolist(), map(float, values), strict=True)
        ]
        text = "\n".join([*(head if key[0] == "d" else []), f"position_mm,{iso}_{unit}", *rows])
        (tmp_path / f"{iso}.csv").write_text(
            text.replace("np.float64(", "").replace(")", ""), encoding="utf-8"
        )
        lines.append(f"  {iso}: {{file: {iso}.csv}}")
    lines += [
        f"title: {name}",
        f"arrangement: {name}",
        "interpolation: cubic",
        "probe: [20 mm, -30 mm, -100 mm]",
    ]
    lines += [f"volume: [{', '.join(f'{1000 * x} mm' for x in SIZE.tolist())}]"]
    lines += ["squareness: {EC0Y: 20 urad, EB0Z: 10 urad, EA0Z: 30 urad}"]
    (tmp_path / "m.yaml").write_text("\n".join(lines), encoding="utf-8")
    built = Volumetric(load_machine(tmp_path / "m.yaml"))
    points = generator.uniform(0.0, 1.0, (10, 3)) * SIZE
    probe = np.array([0.02, -0.03, -0.1])
    expected = np.array(
        [tip_error(chain, x, probe, values_at(functions, x) | square) for x in points]
    )
    assert np.abs(expected).max() > 2e-5
    # Products of errors, and cubic splines between 41 points.
    np.testing.assert_allclose(built.systematic(points), expected, rtol=0, atol=5e-9)


RANDOM = {
    "dx_x": 1e-6,
    "dy_y": 2e-6,
    "dz_x": 0.5e-6,
    "Ey_x": 3e-6,
    "Ez_y": 2e-6,
    "Ex_y": 4e-6,
    "Ex_z": 5e-6,
}


@pytest.mark.parametrize("name", ["MB1", "CX1"])
def test_random_parts_are_those_of_monte_carlo(name: str) -> None:
    """Functions are drawn anew at each end of a length, squareness and temperature once for both,
    on rigid bodies.
    """
    chain = [list(ARRANGEMENTS[name].probe_side), list(ARRANGEMENTS[name].workpiece_side)]
    errors = tuple(
        ParametricError(
            f"E{('XYZ' if key[0] == 'd' else 'ABC')[AXES.index(key[1])]}{key[3].upper()}",
            deviation=size,
        )
        for key, size in RANDOM.items()
    )
    probe = np.array([0.03, -0.05, -0.12])
    described = machine(
        name,
        errors=errors,
        probe=tuple(probe.tolist()),
        squareness=(
            Squareness("EC0Y", 0.0, deviation=2e-6),
            Squareness("EB0Z", 0.0, deviation=3e-6),
        ),
        temperature={"x": AxisTemperature(11e-6, 0.0, 0.2), "z": AxisTemperature(8e-6, 0.0, 0.3)},
        probing=0.7e-6,
    )
    start, end = np.array([1.5, 0.1, 0.2]), np.array([0.2, 1.0, 0.8])
    count = 2000
    generator = np.random.default_rng(4)
    found = {"start": np.zeros((count, 3)), "end": np.zeros((count, 3)), "length": np.zeros(count)}
    for k in range(count):
        lasting = {"a": generator.normal(0, 2e-6), "b1": generator.normal(0, 3e-6)}
        stretch = np.array([11e-6 * generator.normal(0, 0.2), 0.0, 8e-6 * generator.normal(0, 0.3)])
        tips = []
        for x in (start, end):
            drawn = {key: generator.normal(0, size) for key, size in RANDOM.items()}
            tips.append(
                x
                + tip_error(chain, x, probe, drawn | lasting)
                + stretch * x
                + generator.normal(0, 0.7e-6, 3)
            )
        found["start"][k], found["end"][k] = tips[0] - start, tips[1] - end
        found["length"][k] = np.linalg.norm(tips[1] - tips[0]) - np.linalg.norm(end - start)
    built = Volumetric(described)
    deviation = built.errors(np.array([start, end])).uncertainties
    # The standard error of a standard deviation is a part 1 / sqrt(2 n) of it.
    limit = 4.0 / np.sqrt(2 * count)
    np.testing.assert_allclose(found["start"].std(axis=0), deviation[0], rtol=limit)
    np.testing.assert_allclose(found["end"].std(axis=0), deviation[1], rtol=limit)
    of_length = built.lengths(start[None], end[None]).uncertainties[0]
    assert found["length"].std() == pytest.approx(of_length, rel=limit)


def test_the_fitted_model_has_what_is_stated() -> None:
    described = load_machine("designs/park/machines/gec-like.yaml")
    model = fitted_volumetric(described, (0.0, 0.0, 0.0), (1.8, 1.2, 1.2), 3)
    names = [one.name for one in model.parameters]
    assert names[-4:] == ["EC0Y", "EB0Z", "EA0Z", "phi1"]
    # A cubic that is zero at one end has three coefficients, a straightness error of degree two
    # one.
    assert [name for name in names if name.startswith("EXX")] == ["EXX[1]", "EXX[2]", "EXX[3]"]
    assert [name for name in names if name.startswith("EYX")] == ["EYX[1]"]
    straight = MachineDescription(**{**vars(described), "errors": described.errors[:1]})
    assert "phi2" in [
        one.name for one in fitted_volumetric(straight, (0.0,) * 3, (1.0,) * 3, 3).parameters
    ]


@pytest.mark.parametrize("knots", [0, 3])
def test_tables_are_fitted_by_cubic_splines_with_even_knots(knots: int) -> None:
    """Both span the same functions as truncated powers: zero at the lower end, and straightness
    errors at both.
    """
    table = Points((0.0, 0.7, 1.8), (0.0, 2e-6, 1e-6))
    described = machine(errors=(ParametricError("EXX", table), ParametricError("EYX", table)))
    model = fitted_volumetric(described, described.lower, described.upper, knots)
    t = np.linspace(0.0, 1.0, 61)
    points = np.outer(t, [1.8, 0.0, 0.0])
    columns = model.jacobian(points, np.zeros(len(model.parameters)), np.zeros((61, 3)))
    inside = np.arange(1, knots + 1) / (knots + 1)
    powers = np.array([t, t**2, t**3, *(np.maximum(t - knot, 0.0) ** 3 for knot in inside)]).T
    for axis, wanted in ((0, powers), (1, powers[:, 1:] - t[:, None] * powers[-1, 1:])):
        used = columns[:, axis, np.abs(columns[:, axis]).max(axis=0) > 0.0]
        assert used.shape[1] == wanted.shape[1]
        for one, other in ((used, wanted), (wanted, used)):
            left = one - other @ np.linalg.lstsq(other, one, rcond=None)[0]
            np.testing.assert_allclose(left, 0.0, atol=1e-12)


def test_a_truth_within_the_fitted_family_is_met_by_its_parameters() -> None:
    """The same file as machine and as model: the stated coefficients are the fitted model's own.

    The bend of the arm is told as straightness of its axis, whose own direction the fitted model's
    frame takes: the two frames are turned to one another, and the probe is not.
    """
    described = load_machine("designs/park/machines/gec-like.yaml")
    truth = true_volumetric(described)
    model = fitted_volumetric(described, described.lower, described.upper, 3)
    generator = np.random.default_rng(1)
    points = generator.uniform(described.lower, described.upper, (200, 3))
    probe = generator.normal(0.0, 0.1, (200, 3))
    wanted = truth.model.error(points, truth.a, probe) - probe
    columns = model.jacobian(points, np.zeros(len(model.parameters)), probe).reshape(600, -1)
    turns = np.stack([np.cross(one, points) for one in np.eye(3)], axis=2).reshape(600, 3)
    columns = np.concatenate([columns, turns], axis=1)
    solution = np.linalg.lstsq(columns, wanted.ravel(), rcond=None)[0]
    np.testing.assert_allclose(columns @ solution, wanted.ravel(), rtol=0, atol=1e-15)
    a, turn = solution[:-3], solution[-3:]
    np.testing.assert_allclose(turn, [-9e-6 * 1.2 / 2, 0.0, 0.0], atol=1e-15)
    reported = model.reported()
    values = dict(zip(reported.names, (reported.matrix @ a).tolist(), strict=True))
    assert values["EXX t^3"] == pytest.approx(44e-6) and values["EC0Y"] == pytest.approx(-45e-6)
    assert values["phi1"] == pytest.approx(6e-6 * 1.2)
    # What the arm's bend is not told apart from.
    assert values["EZY t^2"] == pytest.approx(-12e-6 - 9e-6 * 1.2**2 / 2)
