"""Options of error models: rank and uncertainties against dense computations, and what each says."""

from __future__ import annotations

import re
from itertools import product
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.machine_files.description import true_volumetric
from ballplate.extensions.machine_files.machine_file import load_machine
from ballplate.results.prediction import Prediction

from tests.estimation import wording
from tests.reference.model_options import (
    Column,
    Found,
    empirical,
    estimate,
    kinematic,
    powers,
    splines,
)

NAMES = [f"E{letter}{axis}" for axis in "XYZ" for letter in "XYZABC"]
PLANE_NAMES = ["EXX", "EYX", "ECX", "EXY", "EYY", "ECY"]
SIDE = {"kind": "distances", "pairs": "all", "standard_uncertainty": "0.3 um"}


def spatial(error_model: dict[str, Any], deficient: bool = False) -> dict[str, Any]:
    """A plate in two levels of each plane, or in those across z with one probe."""
    planes = ("z",) if deficient else ("z", "x", "y")
    positions = [
        {
            "name": f"{plane} {level}",
            "plane": plane,
            "level": level,
            "corner": {axis: "100 mm" for axis in "xyz" if axis != plane},
            "probes": ["down"] if deficient else ["down", "right", "back"],
        }
        for plane, level in product(planes, ("250 mm", "700 mm"))
    ]
    if not deficient:
        positions.append({**positions[0], "name": "turned", "level": "450 mm", "quarter_turns": 1})
        positions.append(
            {"name": "tilted", "probes": ["down", "right", "back"],
             "pose": {"origin": ["250 mm", "180 mm", "300 mm"],
                      "rotation": ["12 deg", "-14 deg", "6 deg"]}}
        )  # fmt: skip
    return {
        "title": "options",
        "machine": {"volume": ["1 m", "0.9 m", "1.1 m"], "repeatability": "0.5 um"},
        "error_model": error_model,
        "probes": {
            "down": ["0 mm", "0 mm", "-50 mm"],
            "right": ["60 mm", "0 mm", "0 mm"],
            "back": ["0 mm", "70 mm", "-10 mm"],
        },
        "artefacts": {"plate": {"kind": "grid", "balls": [5, 5], "size": ["600 mm", "560 mm"]}},
        "positions": positions,
        "calibration": [{**SIDE, "artefact": "plate", "pairs": "corners"}],
        "evaluation": {"points": {"random": 25, "seed": 2}, "probe": "right"},
    }


def plane(error_model: dict[str, Any], deficient: bool = False) -> dict[str, Any]:
    """A plate in five positions of a plane, with two probes or, deficient, with none but offset 0."""
    places = [("60 mm", "50 mm", 0), ("240 mm", "60 mm", 0), ("50 mm", "150 mm", 0),
              ("250 mm", "160 mm", 2), ("150 mm", "60 mm", 1)]  # fmt: skip
    positions = [
        {"name": f"p{k}", "corner": {"x": x, "y": y}, "quarter_turns": turns}
        | ({} if deficient else {"probes": ["left", "up"]})
        for k, (x, y, turns) in enumerate(places)
    ]
    found = {
        "title": "options in a plane",
        "machine": {"volume": ["600 mm", "420 mm"], "repeatability": "0.5 um"},
        "error_model": error_model,
        "artefacts": {"plate": {"kind": "grid", "balls": [6, 5], "size": ["300 mm", "200 mm"]}},
        "positions": positions,
        "calibration": [{**SIDE, "pairs": "corners"}],
        "evaluation": {"points": {"random": 25, "seed": 2}},
    }
    if deficient:
        return found
    return found | {
        "probes": {"left": ["-30 mm", "0 mm"], "up": ["5 mm", "40 mm"]},
        "evaluation": {"points": {"random": 25, "seed": 2}, "probe": "left"},
    }


def families(names: list[str], position: int, rotation: int, **own: Any) -> dict[str, Any]:
    usual = {name: powers(rotation if name[1] in "ABC" else position) for name in names}
    return usual | own


CORNERS = {3: (np.zeros(3), np.array([1.0, 0.9, 1.1])), 2: (np.zeros(3), np.array([0.6, 0.42, 1]))}

OWN = {
    "position_coefficients": 4,
    "rotation_coefficients": 3,
    "functions": {
        "EXX": 6,
        "EYX": {"order": 4, "knots": [0.4]},
        "EXY": 2,
        "EZZ": {"order": 3, "knots": [0.3, 0.6]},
        "EAX": 4,
        "ECZ": 1,
    },
}
OWN_FAMILIES = {
    "EXX": powers(6),
    "EYX": splines(4, (0.4,)),
    "EXY": powers(2),
    "EZZ": splines(3, (0.3, 0.6)),
    "EAX": powers(4),
    "ECZ": [],
}
LINEAR = [lambda t: 1.0 + 0.0 * t[:, 0], lambda t: t[:, 0], lambda t: t[:, 1], lambda t: t[:, 2]]
SQUARES = [lambda t, k=k, n=n: t[:, k] ** n for k in range(3) for n in (2, 3)]  # type: ignore[misc]
PRODUCTS = [
    lambda t: t[:, 0] * t[:, 1], lambda t: t[:, 0] * t[:, 2], lambda t: t[:, 1] * t[:, 2]
]  # fmt: skip
ALL_OF_DEGREE_2 = [*LINEAR, *PRODUCTS, *SQUARES[::2]]
# Powers of x and splines of order 3 along y, each also times both other co-ordinates.
WITH_LINEAR = [
    lambda t, f=f, k=k, j=j: f(t[:, k]) * (t[:, j] if j != k else 1.0)  # type: ignore[misc]
    for k, functions in ((0, powers(4)[1:]), (1, splines(3, (0.4,))[1:]))
    for f in functions
    for j in range(3)
]

# Settings, dimension, and the same as columns.
OPTIONS: dict[str, tuple[dict[str, Any], int, list[Column]]] = {
    "squareness and own functions": (
        {"kind": "kinematic", "squareness": "parameters", **OWN},
        3,
        kinematic(families(NAMES, 4, 3, **OWN_FAMILIES), True, *CORNERS[3]),
    ),
    "plain sums": (
        {"kind": "empirical", "terms": "univariate", "coefficients": 4},
        3,
        empirical([*LINEAR, *SQUARES], [*LINEAR, *SQUARES], *CORNERS[3]),
    ),
    "functions by axis": (
        {"kind": "empirical", "terms": "sums",
         "basis": {"x": "monomial", "y": {"order": 3, "knots": [0.4]}},
         "coefficients": {"x": 4, "z": 2},
         "rotation_functions": {"terms": "univariate", "coefficients": {"x": 2, "z": 4}}},
        3,
        empirical(
            [*LINEAR, *PRODUCTS, *WITH_LINEAR],
            [*LINEAR, lambda t: t[:, 1] ** 2, lambda t: t[:, 2] ** 2, lambda t: t[:, 2] ** 3],
            *CORNERS[3],
        ),
    ),
    "no rotations": (
        {"kind": "empirical", "terms": "quadratic", "rotation_functions": "none"},
        3,
        empirical(ALL_OF_DEGREE_2, [], *CORNERS[3]),
    ),
    "plane with squareness": (
        {"kind": "kinematic", "position_coefficients": 4, "rotation_coefficients": 3,
         "squareness": "parameters", "functions": {"ECX": {"order": 3, "knots": [0.5]}, "EXX": 5}},
        2,
        kinematic(
            families(PLANE_NAMES, 4, 3, ECX=splines(3, (0.5,)), EXX=powers(5)), True, *CORNERS[2]
        )[:-2],
    ),
}  # fmt: skip


def described(name: str, deficient: bool) -> tuple[Prediction, Found]:
    settings, dimension, columns = OPTIONS[name]
    given = (spatial if dimension == 3 else plane)(settings, deficient)
    planned = bp.run(bp.experiment(given))
    return planned, estimate(planned.design, columns)


@pytest.mark.parametrize(
    ("name", "deficient"),
    [*product(OPTIONS, [False]), ("no rotations", True), ("plane with squareness", True)],
)
def test_rank_and_lengths_are_those_of_the_complete_jacobian(name: str, deficient: bool) -> None:
    planned, found = described(name, deficient)
    assert len(planned.design.model.parameters) == len(OPTIONS[name][2])
    assert planned.verdict.deficiency == found.deficiency
    assert (found.deficiency > 0) == deficient
    for symbol, expected in (("U5", found.distances), ("U6", found.lengths)):
        quantity = planned.quantities[symbol]
        assert quantity.undetermined == np.isnan(expected).sum()
        # Neither is one of the determined part alone.
        assert quantity.maximum == pytest.approx(expected.max(), rel=1e-7, nan_ok=True)
        assert quantity.average == pytest.approx(expected.mean(), rel=1e-7, nan_ok=True)


@pytest.mark.parametrize("name", ["squareness and own functions"])
def test_squareness_has_the_uncertainty_of_the_dense_estimate(name: str) -> None:
    planned, found = described(name, False)
    expected = found.of_columns[-3:]
    told = planned.quantities["squareness"]
    assert [one for one, _ in told.parameters] == ["EC0Y", "EB0Z", "EA0Z"]
    np.testing.assert_allclose([u for _, u in told.parameters], expected, rtol=1e-7)
    assert (told.unit, told.count) == ("rad", 3)
    assert told.maximum == pytest.approx(expected.max(), rel=1e-7)


@pytest.mark.parametrize("deficient", [False, True], ids=["whole", "deficient"])
@pytest.mark.parametrize("arrangement", ["MB2", "FB1"])
def test_twenty_one_parameters_say_the_same_as_eighteen_functions(
    arrangement: str, deficient: bool
) -> None:
    model = {"kind": "kinematic", "arrangement": arrangement, "position_coefficients": 4}
    one, other = (
        bp.run(bp.experiment(spatial({**model, "squareness": form}, deficient)))
        for form in ("straightness", "parameters")
    )
    assert one.verdict.deficiency == other.verdict.deficiency
    assert len(one.design.model.parameters) == len(other.design.model.parameters)
    for symbol in ("U1", "U2", "U4", "U5", "U6"):
        first, second = one.quantities[symbol], other.quantities[symbol]
        assert (first.count, first.undetermined) == (second.count, second.undetermined)
        if not deficient:
            assert first.undetermined == 0
            assert second.maximum == pytest.approx(first.maximum, rel=1e-9)
            assert second.average == pytest.approx(first.average, rel=1e-9)


def plane_of_squareness_alone() -> dict[str, Any]:
    given = plane({
        "kind": "kinematic", "squareness": "parameters",
        "functions": {name: 1 for name in PLANE_NAMES},
    }, deficient=True)  # fmt: skip
    given["positions"] = [{"name": "only", "corner": {"x": "120 mm", "y": "80 mm"}}]
    coordinates = {"kind": "coordinates", "balls": "all", "standard_uncertainty": "1e-6 um"}
    return given | {"calibration": [coordinates]}


def test_squareness_of_a_known_plate_has_its_closed_form() -> None:
    """A known plate in one position shows its turn in y along x, and turn less squareness in x
    along y: u^2 = sigma^2 (1 / sum (x - mean)^2 + 1 / sum (y - mean)^2).
    """
    planned = bp.run(bp.experiment(plane_of_squareness_alone()))
    assert [one.name for one in planned.design.model.parameters] == ["EC0Y"]
    x = np.tile(np.linspace(0.0, 0.3, 6), 5)
    y = np.repeat(np.linspace(0.0, 0.2, 5), 6)
    expected = 0.5e-6 * np.sqrt(1 / ((x - x.mean()) ** 2).sum() + 1 / ((y - y.mean()) ** 2).sum())
    assert planned.quantities["squareness"].parameters == (
        ("EC0Y", pytest.approx(expected, rel=1e-6)),
    )


def test_squareness_is_the_angle_that_was_simulated() -> None:
    """The angle between corrected lines is 90 degrees and the parameter more, and the advice turns
    the guideway back.
    """
    given = plane_of_squareness_alone()
    given["true_machine"] = {"kind": "coefficients", "values": {"EC0Y": "20 urad"}}
    design = bp.experiment(given)
    fitted = bp.fit(design, bp.simulate(design, exact=True))
    value = next(one.value for one in fitted.estimates if one.name == "EC0Y")
    assert value == pytest.approx(20e-6, rel=1e-4)
    model = fitted.design.model
    x = np.array([[0.1, 0.1], [0.5, 0.1], [0.1, 0.4]])
    corner, right, up = x + model.error(x, np.array([20e-6]), np.zeros_like(x))
    cosine = (right - corner) @ (up - corner) / np.linalg.norm(right - corner)
    angle = np.arccos(cosine / np.linalg.norm(up - corner))
    assert angle == pytest.approx(np.pi / 2 + 20e-6, abs=1e-9)
    [advice] = fitted.adjustments
    assert advice.what == "angle of X and Y"
    assert advice.value == pytest.approx(20e-6, rel=1e-4)
    assert "towards +X" in advice.words


def test_no_guideway_is_turned_where_the_workpiece_moves() -> None:
    """There an axis's own rotations turn its line as well, so that the parameter alone is no
    angle to adjust.
    """
    given = plane_of_squareness_alone()
    given["error_model"] = {**given["error_model"], "arrangement": "FB1"}
    given["true_machine"] = {"kind": "zero"}
    design = bp.experiment(given)
    fitted = bp.fit(design, bp.simulate(design, exact=True))
    assert fitted.adjustments == ()
    assert "squareness" in fitted.quantities


MACHINE = """title: bridge with errors
arrangement: MB1
volume: {x: [0 mm, 600 mm], y: [0 mm, 420 mm], z: [0 mm, 300 mm]}
errors:
  EXX: {polynomial: [0 um, 9 um, -3 um]}
  EYX: {polynomial: [0 um, 8 um, -13 um, 5 um]}
  EBX: {polynomial: [0 urad, 14 urad, -4 urad]}
  ECX: {polynomial: [0 urad, 6 urad, 5 urad]}
  EYY: {polynomial: [0 um, -8 um, 4 um]}
  EXY: {polynomial: [0 um, 7 um, -7 um]}
  EAY: {polynomial: [0 urad, -9 urad]}
  ECY: {polynomial: [0 urad, 5 urad, 8 urad]}
  EZZ: {polynomial: [0 um, 3 um]}
squareness: {EC0Y: 14 urad, EB0Z: -18 urad, EA0Z: 9 urad}
"""


@pytest.mark.parametrize("level", [None, "180 mm"])
def test_a_machine_file_is_a_true_machine_in_a_plane(tmp_path: Path, level: str | None) -> None:
    """What is estimated from its exact readings corrects lengths as the machine in space has them
    at that level.
    """
    (tmp_path / "machine.yaml").write_text(MACHINE, encoding="utf-8")
    model = {"kind": "kinematic", "arrangement": "MB1", "position_coefficients": 5,
             "rotation_coefficients": 4, "squareness": "parameters"}  # fmt: skip
    truth = {"kind": "machine", "file": "machine.yaml", **({"level": level} if level else {})}
    given = plane(model) | {"true_machine": truth, "seed": 1}
    design = bp.experiment(given, folder=tmp_path)
    fitted = bp.fit(design, bp.simulate(design, exact=True))
    # The model is linear in its parameters, the poses are not.
    assert fitted.solution.factor.sum_of_squares < 1e-6
    x = np.random.default_rng(1).uniform([0.05, 0.05], [0.55, 0.38], (12, 2))
    first, second = np.triu_indices(12, 1)
    machine = true_volumetric(load_machine(tmp_path / "machine.yaml"))
    there = np.column_stack([x, np.full(12, 0.18 if level else 0.0)])
    # Offsets are told in the frame of each of the two, so that lengths are between points with one.
    for probe in ((0.0, 0.0), (-0.03, 0.0), (0.005, 0.04)):
        p = np.tile(probe, (12, 1))
        corrected = x + fitted.design.model.error(x, fitted.solution.state.a, p)
        in_space = np.column_stack([p, np.zeros(12)])
        true = (there + machine.model.error(there, machine.a, in_space))[:, :2]
        nominal, found, expected = (
            np.linalg.norm(one[first] - one[second], axis=1) for one in (x, corrected, true)
        )
        np.testing.assert_allclose(found, expected, rtol=0, atol=2e-9)
        assert np.abs(expected - nominal).max() > 2e-6


def test_a_machine_file_is_an_error_model_in_a_plane(tmp_path: Path) -> None:
    (tmp_path / "machine.yaml").write_text(MACHINE, encoding="utf-8")
    design = bp.experiment(plane({"kind": "machine", "file": "machine.yaml"}), folder=tmp_path)
    planned = bp.run(design)
    functions = {one.function for one in planned.design.model.parameters}
    assert functions == {"EXX", "EYX", "ECX", "EYY", "EXY", "ECY", "EC0Y"}
    columns = kinematic_y_first(planned.design.machine.volume)
    assert planned.verdict.deficiency == 0 == estimate(planned.design, columns).deficiency
    expected = estimate(planned.design, columns).lengths
    assert planned.quantities["U6"].maximum == pytest.approx(expected.max(), rel=1e-7)


def kinematic_y_first(volume: Any) -> list[Column]:
    """The errors that the file states in the plane, y carrying x, with X turned for squareness."""
    width, depth = volume.upper - volume.lower

    def along(axis: int, component: int, functions: list[Any], arm: bool = False) -> list[Column]:
        def column(x: Any, p: Any, f: Any) -> Any:
            value = f(x[:, axis] / (width if axis == 0 else depth))
            if not arm:
                return value[:, None] * np.eye(3)[component]
            carried = p + (x * [1.0, 0.0, 0.0] if axis == 1 else 0.0)
            turned = np.stack([-carried[:, 1], carried[:, 0], 0.0 * value], axis=1)
            return value[:, None] * turned

        return [lambda x, p, f=f: column(x, p, f) for f in functions]  # type: ignore[misc]

    bowed = [lambda t: t - t**2, lambda t: t - t**3]
    return [
        *along(0, 0, powers(3)),
        *along(0, 1, bowed),
        *along(0, 2, powers(3), arm=True),
        *along(1, 1, powers(3)),
        *along(1, 0, bowed[:1]),
        *along(1, 2, powers(3), arm=True),
        *along(0, 1, powers(2)),
    ]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"error_model": {"kind": "kinematic", "functions": {"EZX": 3}}},
            "functions.EZX: moves no point within the plane of x and y; remove it",
        ),
        ({"error_model": {"kind": "empirical"}}, 'kind "empirical" has 3 dimensions'),
        (
            {"true_machine": {"kind": "machine", "file": "machine.yaml", "level": "400 mm"}},
            "level: is outside the file's volume (0 mm to 300 mm in z)",
        ),
        (
            {"true_machine": {"kind": "curves", "files": ["x.csv", "z.csv"]}},
            "files[1]: has no error that moves points within the plane of x and y; leave it out",
        ),
        (
            {"error_model": {"kind": "machine", "file": "across.yaml"}},
            "across.yaml states no error that could be estimated in the plane of x and y",
        ),
    ],
)
def test_what_no_plane_shows_is_refused(
    tmp_path: Path, changes: dict[str, Any], message: str
) -> None:
    (tmp_path / "machine.yaml").write_text(MACHINE, encoding="utf-8")
    head, _, _ = MACHINE.partition("errors:")
    (tmp_path / "across.yaml").write_text(
        head + "errors: {EZX: {polynomial: [0 um, 1 um, -1 um]}}\n", encoding="utf-8"
    )
    for axis, end in (("x", 600), ("z", 300)):
        text = f"position_mm,E{axis.upper()}{axis.upper()}_um\n0,0\n{end},3\n"
        (tmp_path / f"{axis}.csv").write_text(text, encoding="utf-8")
    with pytest.raises(bp.ExperimentError, match=re.escape(message)):
        bp.experiment(plane({"kind": "kinematic"}) | changes, folder=tmp_path)


def test_a_level_is_for_planes(tmp_path: Path) -> None:
    (tmp_path / "machine.yaml").write_text(MACHINE, encoding="utf-8")
    truth = {"kind": "machine", "file": "machine.yaml", "level": "100 mm"}
    given = spatial({"kind": "kinematic"}) | {"true_machine": truth}
    given["machine"] = {"volume": ["1 m", "0.9 m", "1.1 m"], "repeatability": "0.5 um"}
    with pytest.raises(bp.ExperimentError, match=wording.IS_FOR_TWO_DIMENSIONS):
        bp.experiment(given, folder=tmp_path)


@pytest.mark.parametrize(
    ("function", "advice"),
    [
        ("EXY", "let its coefficients add up to zero, and state its slope as EC0Y"),
        ("EYX", "to fix the machine's frame; let its coefficients add up to zero"),
    ],
)
def test_a_slope_is_stated_as_squareness(function: str, advice: str) -> None:
    truth = {"kind": "coefficients", "values": {f"{function} t": "3 um"}}
    given = plane(OPTIONS["plane with squareness"][0]) | {"true_machine": truth}
    with pytest.raises(bp.ExperimentError, match=re.escape(advice)):
        bp.experiment(given)


def test_priors_on_squareness_and_single_functions() -> None:
    """A prior is one more observation of the parameter that it names."""
    given = plane(OPTIONS["plane with squareness"][0])
    before = bp.run(bp.experiment(given)).quantities["squareness"].maximum
    prior = {"parameter": "EC0Y", "standard_uncertainty": "1 urad"}
    after = bp.run(bp.experiment(given | {"priors": [prior]})).quantities["squareness"].maximum
    assert after == pytest.approx((before**-2 + 1e12) ** -0.5, rel=1e-9)
