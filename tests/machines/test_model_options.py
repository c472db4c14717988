"""Options of error models by themselves: spaces of functions, counts, names and messages."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ballplate.extensions.machine_files.curves import Points, curves_model
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.machines._basis_settings import WITH_CONSTANT, RadialName
from ballplate.simulator.machines._empirical import empirical_model
from ballplate.simulator.machines._terms import RADIAL, Radial, sums, univariate
from ballplate.simulator.machines.arrangement import (
    ARRANGEMENTS,
    AXIS_ERRORS,
    ERRORS,
    SQUARENESS_ERRORS,
)
from ballplate.simulator.machines.bases import Polynomial
from ballplate.simulator.machines.kinematic import KinematicModel, in_plane, kinematic_model_of
from ballplate.simulator.machines.settings import build_error_model
from ballplate.simulator.machines.spline_basis import Spline

LOWER, UPPER = (-0.2, 0.1, 0.0), (0.8, 0.7, 1.3)


def test_names_are_those_that_their_parts_spell() -> None:
    letters = [(kind, axis) for axis in "XYZ" for kind in "XYZABC"]
    assert list(AXIS_ERRORS) == [f"E{kind}{axis}" for kind, axis in letters]
    for (kind, axis), error in zip(letters, AXIS_ERRORS.values(), strict=True):
        assert "XYZ"[error.axis] == axis
        assert (error.is_rotation, error.component) == (kind in "ABC", "XYZABC".index(kind) % 3)
    # The last letter is the axis, the second what it turns about, the other is the third.
    for name, error in SQUARENESS_ERRORS.items():
        assert {error.axis, error.to, error.about} == {0, 1, 2}
        assert (name[1], name[3]) == ("ABC"[error.about], "XYZ"[error.axis])
        turned = np.cross(np.eye(3)[error.about], np.eye(3)[error.axis])
        assert turned.tolist() == (error.sign * np.eye(3)[error.to]).tolist()


@pytest.mark.parametrize("name", ERRORS)
def test_what_is_in_the_plane_is_what_moves_points_in_it(name: str) -> None:
    """Each error by itself, at the height of the lower corner, with offsets in the plane."""
    model = kinematic_model_of(
        ARRANGEMENTS["CX1"], Polynomial(3), Polynomial(3), LOWER, UPPER, squareness=True
    )
    generator = np.random.default_rng(1)
    x, p = generator.uniform(LOWER, UPPER, (9, 3)), generator.normal(0.0, 0.05, (9, 3))
    x[:, 2], p[:, 2] = LOWER[2], 0.0
    own = [k for k, one in enumerate(model.parameters) if one.function == name]
    moved = model.jacobian(x, np.zeros(len(model.parameters)), p)[:, :2, own]
    assert np.abs(moved).max() > 1e-3 if ERRORS[name].in_plane else not moved.any()


@pytest.mark.parametrize("full", [False, True])
@pytest.mark.parametrize("arrangement", ARRANGEMENTS)
def test_squareness_is_the_straight_part_of_three_straightness_errors(
    arrangement: str, full: bool
) -> None:
    """The two forms are one machine: EXY = -EC0Y y and so on, beside the same other coefficients,
    for errors of any size.
    """
    # Monomials t^k of one form are t and t^k - t of the other; k = 2 only, so that they are few.
    one, other = (
        kinematic_model_of(
            ARRANGEMENTS[arrangement], Polynomial(3), Polynomial(3), LOWER, UPPER, full, (), square
        )
        for square in (False, True)
    )
    assert len(one.parameters) == len(other.parameters) == 51 - 18
    generator = np.random.default_rng(3)
    a = 1e-2 * generator.standard_normal(len(other.parameters))
    same = np.zeros(len(one.parameters))
    spans = dict(zip("XYZ", np.subtract(UPPER, LOWER), strict=True))
    for k, parameter in enumerate(other.parameters):
        if parameter.name in SQUARENESS_ERRORS:
            function, sign = {"EC0Y": ("EXY", -1), "EB0Z": ("EXZ", 1), "EA0Z": ("EYZ", -1)}[
                parameter.name
            ]
            same[one.slices[function].start] += sign * a[k] * spans[function[2]]
        elif parameter.function in ("EXY", "EXZ", "EYZ"):
            # t - t^2 is t (1 - t); in the other form t and 2 t^2 - t stand in its place.
            start = one.slices[parameter.function].start
            same[start] += 0.5 * a[k]
            same[start + 1] += -0.5 * a[k]
        else:
            own = other.slices[parameter.function]
            same[one.slices[parameter.function].start + k - own.start] = a[k]
    x, p = generator.uniform(LOWER, UPPER, (20, 3)), generator.normal(0.0, 0.05, (20, 3))
    np.testing.assert_allclose(one.error(x, same, p), other.error(x, a, p), rtol=0, atol=1e-15)


def counted(model: KinematicModel) -> dict[str, int]:
    return {f.name: f.basis.size for f in model.functions}


def test_parameters_are_as_many_as_the_documentation_says() -> None:
    def made(own: tuple[Any, ...] = (), square: bool = False) -> KinematicModel:
        return kinematic_model_of(
            ARRANGEMENTS["MB2"], Polynomial(5), Polynomial(4), LOWER, UPPER, False, own, square
        )

    # 9 (n - 1) + 9 (m - 1), less one for each straightness held at the far end.
    assert len(made().parameters) == 9 * 4 + 9 * 3 - 3
    assert len(made(square=True).parameters) == 9 * 4 + 9 * 3 - 6 + 3
    own = (("EXX", Polynomial(8)), ("EYX", Spline(4, (0.2, 0.5))), ("ECZ", Polynomial(1)))
    sizes = counted(made(own))
    # A spline has order + knots coefficients, the constant counted.
    assert (sizes["EXX"], sizes["EYX"], sizes["ECZ"]) == (7, 4 + 2 - 2, 0)
    assert len(made(own).parameters) == 60 + 3 + 1 - 3
    assert len(in_plane(made(square=True)).parameters) == 4 * 4 - 2 + 2 * 3 + 1
    assert len(univariate(Polynomial(5)).names) == 1 + 3 * 4


@pytest.mark.parametrize("function", RADIAL)
def test_radial_functions_interpolate_as_scipy_does(function: RadialName) -> None:
    from scipy.interpolate import RBFInterpolator

    constant = 0.7
    radial = Radial((3, 2, 4), constant, function)
    kernel = {"thin plate": "thin_plate_spline"}.get(function, function.replace(" ", "_"))
    shape = {"epsilon": 1.0 / constant} if function in WITH_CONSTANT else {}
    places = np.random.default_rng(5).uniform(0.0, 1.0, (40, 3))
    centres = radial.centres
    values = RBFInterpolator(centres, np.eye(len(centres)), kernel=kernel, degree=1, **shape)
    np.testing.assert_allclose(radial.values(places), values(places), rtol=0, atol=1e-9)
    np.testing.assert_allclose(radial.values(centres), np.eye(len(centres)), rtol=0, atol=1e-9)
    assert np.abs(radial.values(places) - Radial((3, 2, 4), 2.0 * constant, function).values(
        places)).max() > 1e-3 or function not in WITH_CONSTANT  # fmt: skip


@pytest.mark.parametrize("arrangement", ["MB2", "FB1", "CX1"])
def test_an_empirical_model_contains_the_twenty_one_parameter_form(arrangement: str) -> None:
    model = kinematic_model_of(
        ARRANGEMENTS[arrangement], Polynomial(4), Polynomial(3), LOWER, UPPER, squareness=True,
        single_families=(("EXX", Spline(4, (0.3,))),),
    )  # fmt: skip
    outer = empirical_model(sums(Spline(4, (0.3,))), LOWER, UPPER, frame=())
    generator = np.random.default_rng(2)
    x, p = generator.uniform(LOWER, UPPER, (800, 3)), generator.normal(0.0, 0.1, (800, 3))
    inner, many = np.zeros(len(model.parameters)), np.zeros(len(outer.parameters))
    rows = outer.jacobian(x, many, p).reshape(-1, len(many))
    wanted = model.jacobian(x, inner, p).reshape(len(rows), -1)
    size = np.linalg.norm(rows, axis=0)
    matrix = np.linalg.lstsq(rows / size, wanted, rcond=1e-13)[0] / size[:, None]
    x, p = generator.uniform(LOWER, UPPER, (30, 3)), generator.normal(0.0, 0.1, (30, 3))
    a = generator.standard_normal(len(model.parameters))
    np.testing.assert_allclose(
        model.error(x, a, p), outer.error(x, matrix @ a, p), rtol=0, atol=1e-8
    )


def test_curves_in_a_plane_are_the_sum_that_is_written_down() -> None:
    """y carries x: a turn of y moves what is at (x, 0), one of x the offset alone."""
    t = np.linspace(0.0, 1.0, 6)
    given = {
        name: Points(tuple((0.8 * t).tolist()), tuple((k * 1e-6 * t**2).tolist()))
        for k, name in enumerate(("EXX", "EYX", "ECX", "EXY", "EYY", "ECY", "EZX", "EBY"), start=1)
    }
    model = curves_model(given, "linear", ARRANGEMENTS["MB1"], (0.0, 0.0), (0.8, 0.8))
    assert model.dimension == 2
    assert [one.function for one in model.parameters] == list(given)[:6]
    x = np.array([[0.1, 0.7], [0.55, 0.3], [0.0, 0.8]])
    p = np.array([[0.02, -0.03], [0.0, 0.0], [-0.05, 0.01]])
    curve = {
        name: np.interp(x[:, 0 if name[2] == "X" else 1], one.positions, one.values)
        for name, one in given.items()
    }
    expected_x = curve["EXX"] + curve["EXY"] - curve["ECX"] * p[:, 1] - curve["ECY"] * p[:, 1]
    expected_y = (
        curve["EYX"] + curve["EYY"] + curve["ECX"] * p[:, 0] + curve["ECY"] * (x[:, 0] + p[:, 0])
    )
    np.testing.assert_allclose(
        model.error(x, np.ones(6), p) - p,
        np.stack([expected_x, expected_y], axis=1),
        rtol=0,
        atol=1e-16,
    )


QUICKSTART = Path("designs/quickstart.yaml").read_text(encoding="utf-8")


def with_model(text: str) -> str:
    before, _, rest = QUICKSTART.partition("error_model:\n")
    return f"{before}error_model: {text}\n\n# The machine{rest.partition('# The machine')[2]}"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "{kind: kinematic, functions: {EXW: 4}}",
            'functions.EXW: unknown key; did you mean "EZX"?',
        ),
        (
            "{kind: kinematic, functions: {EXX: 0}}",
            "functions.EXX: the number 0 is out of range; give one at least 1",
        ),
        (
            "{kind: kinematic, position_coefficients: 2, rotation_coefficients: 1, functions:"
            " {EXX: 1, EYX: 1, EZX: 1, EXY: 1, EYY: 1, EZY: 1, EXZ: 1, EYZ: 1, EZZ: 1}}",
            "functions: leaves no error to be estimated; give one function more than 1 coefficient",
        ),
        (
            "{kind: empirical, rotation_functions: {terms: quadratic, coefficients: 2}}",
            '"coefficients" has no meaning with quadratic terms; remove it',
        ),
        (
            "{kind: empirical, terms: {centres: [3, 3, 3], function: cubic, constant: 0.5}}",
            '"constant" has no meaning with the function cubic; remove it',
        ),
        (
            "{kind: empirical, terms: {centres: [6, 6, 6], function: gaussian, constant: 8}}",
            "these functions are too similar to be distinguished",
        ),
    ],
)
def test_messages(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "one.yaml"
    path.write_text(with_model(text), encoding="utf-8")
    with pytest.raises(ExperimentError) as caught:
        load(path)
    assert message in str(caught.value)


def test_functions_of_their_own_reach_the_model(tmp_path: Path) -> None:
    path = tmp_path / "one.yaml"
    path.write_text(
        with_model("{kind: kinematic, basis: monomial, functions: {EXX: 7, EAY: {order: 3}}}"),
        encoding="utf-8",
    )
    [experiment] = load(path)
    model = build_error_model(experiment.error_model, (0.0,) * 3, (1.0,) * 3)
    assert isinstance(model, KinematicModel)
    sizes = counted(model)
    assert (sizes["EXX"], sizes["EAY"], sizes["EYY"]) == (6, 2, 4)
