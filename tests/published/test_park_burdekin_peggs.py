"""Park, Burdekin and Peggs, Appendix A: equations and rules as printed, against the chain formula
and rigid bodies.

Every coefficient of every error in every equation and rule is compared; those that differ are
listed as misprints in the data, and each is shown to be one by a product of full rotations that
uses nothing of the package.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from ballplate.extensions.machine_files.description import (
    AxisTemperature,
    MachineDescription,
    ParametricError,
    PowerSeries,
    Squareness,
    coupling,
    true_volumetric,
)
from ballplate.simulator.machines.arrangement import ARRANGEMENTS

from tests.published.rigid_body import tip_error

PRINTED: dict[str, Any] = yaml.safe_load(
    Path(__file__).with_name("park-burdekin-peggs.yaml").read_text("utf-8")
)
CHAINS: dict[str, list[list[str]]] = PRINTED["chains"]
AXES = "xyz"
FUNCTIONS = [f"{kind}{c}_{axis}" for axis in AXES for kind in "dE" for c in AXES]
ROTATIONS = [name for name in FUNCTIONS if name[0] == "E"]
SQUARENESS = ["a", "b1", "b2"]
ISO = {"a": ("EC0Y", 1.0), "b1": ("EB0Z", -1.0), "b2": ("EA0Z", 1.0)}

machines = pytest.mark.parametrize("name", CHAINS)

# Positions from the reference point, and probes, without accidental equalities.
POSITIONS = np.random.default_rng(7).uniform(0.3, 1.5, (4, 3))
PROBES = np.random.default_rng(8).uniform(-0.2, 0.2, (4, 3))


def iso(name: str) -> str:
    """dy_x is EYX and Ey_x is EBX."""
    letters = "XYZ" if name[0] == "d" else "ABC"
    return f"E{letters[AXES.index(name[1])]}{name[3].upper()}"


def coefficient(expression: str, error: str, position: np.ndarray, probe: np.ndarray) -> float:
    """What the error is multiplied by in a printed expression."""
    names = dict.fromkeys([*FUNCTIONS, *SQUARENESS, "thermal", "phi1", "phi2"], 0.0)
    for letters, values in (
        ("xyz", position),
        (("xm", "ym", "zm"), position),
        (("Xp", "Yp", "Zp"), probe),
    ):
        names |= dict(zip(letters, values.tolist(), strict=True))
    return float(eval(expression, {}, names | {error: 1.0}))


def by_rigid_bodies(name: str, error: str, position: np.ndarray, probe: np.ndarray) -> np.ndarray:
    """Derivative (3,) of the tip by an error, from full rotations."""
    return _by_rigid_bodies(name, error, tuple(position.tolist()), tuple(probe.tolist()))


@cache
def _by_rigid_bodies(
    name: str, error: str, position: tuple[float, ...], probe: tuple[float, ...]
) -> np.ndarray:
    step = 1e-5
    x, p = np.array(position), np.array(probe)
    after, before = (tip_error(CHAINS[name], x, p, {error: sign * step}) for sign in (1.0, -1.0))
    return np.asarray((after - before) / (2.0 * step))


def by_the_package(name: str, error: str, position: np.ndarray, probe: np.ndarray) -> np.ndarray:
    """The same from the volumetric model, with one error of 1 and all others 0."""
    return _by_the_package(name, error, tuple(position.tolist()), tuple(probe.tolist()))


@cache
def _by_the_package(
    name: str, error: str, position: tuple[float, ...], probe: tuple[float, ...]
) -> np.ndarray:
    x, p = np.array([position]), np.array([probe])
    found = true_volumetric(described(name, {error: 1.0}, at=x[0]))
    return np.asarray((found.model.error(x, found.a, p) - p)[0])


def described(name: str, errors: dict[str, float], at: np.ndarray) -> MachineDescription:
    """A machine whose errors have the values `errors` where the axes stand at `at`, and are 0 at
    the reference point.

    Straightness errors bend, so that no straight line can be taken off them.
    """
    functions = []
    for error in FUNCTIONS:
        if error in errors:
            t = at[AXES.index(error[3])] / 2.0
            curve = (0.0, 1.0, -1.0) if error[0] == "d" and error[1] != error[3] else (0.0, 1.0)
            scale = errors[error] / np.polynomial.polynomial.polyval(t, curve)
            functions.append(
                ParametricError(iso(error), PowerSeries(tuple(scale * np.array(curve))))
            )
    square = [
        Squareness(ISO[one][0], ISO[one][1] * errors[one]) for one in SQUARENESS if one in errors
    ]
    return MachineDescription(
        title=name,
        arrangement_name=name,
        arrangement=ARRANGEMENTS[name],
        lower=(0.0, 0.0, 0.0),
        upper=(2.0, 2.0, 2.0),
        reference=(0.0, 0.0, 0.0),
        errors=tuple(functions),
        squareness=tuple(square),
    )


def differences(
    expressions: dict[str, str],
    errors: list[str],
    right: Callable[[str, str, np.ndarray, np.ndarray], float],
) -> set[tuple[str, str]]:
    """Expressions and errors whose printed coefficients are not the right ones at all positions."""
    found = set()
    for key, expression in expressions.items():
        for error in errors:
            for position, probe in zip(POSITIONS, PROBES, strict=True):
                if (
                    abs(
                        coefficient(expression, error, position, probe)
                        - right(key, error, position, probe)
                    )
                    > 1e-9
                ):
                    found.add((key, error))
    return found


def listed(name: str, kind: str) -> dict[tuple[str, str], dict[str, str]]:
    entries = [one for one in PRINTED["misprints"][kind] if one["at"].split()[0] == name]
    return {(one["at"].split()[1], one["error"]): one for one in entries}


def assert_right(
    entry: dict[str, str], key: str, value: Callable[[np.ndarray, np.ndarray], float]
) -> None:
    """What an entry says is right is what comes out, and what is printed is not."""
    for position, probe in zip(POSITIONS[:2], PROBES[:2], strict=True):
        found = value(position, probe)
        assert found == pytest.approx(
            coefficient(f"{entry[key]} + 0 * a", "a", position, probe), abs=1e-7
        ), entry
        other = entry.get("printed", entry.get("rule", ""))
        assert abs(found - coefficient(f"{other} + 0 * a", "a", position, probe)) > 1e-3, entry


@machines
def test_equations_are_the_chain_formula_but_for_the_misprints(name: str) -> None:
    def right(key: str, error: str, position: np.ndarray, probe: np.ndarray) -> float:
        return float(by_the_package(name, error, position, probe)["XYZ".index(key)])

    found = differences(PRINTED["equations"][name], [*FUNCTIONS, *SQUARENESS], right)
    assert found == set(listed(name, "equations"))


@machines
def test_the_chain_formula_is_what_rigid_bodies_do(name: str) -> None:
    for error in [*FUNCTIONS, *SQUARENESS]:
        for position, probe in zip(POSITIONS[:2], PROBES[:2], strict=True):
            np.testing.assert_allclose(
                by_the_package(name, error, position, probe),
                by_rigid_bodies(name, error, position, probe),
                atol=1e-8,
            )


@machines
def test_rigid_bodies_differ_from_the_formula_to_second_order(name: str) -> None:
    generator = np.random.default_rng(9)
    errors = dict(
        zip([*FUNCTIONS, *SQUARENESS], generator.normal(0.0, 1e-5, 21).tolist(), strict=True)
    )
    position, probe = POSITIONS[0], PROBES[0]
    off = []
    for factor in (1.0, 10.0):
        larger = {key: factor * value for key, value in errors.items()}
        found = true_volumetric(described(name, larger, at=position))
        formula = found.model.error(position[None], found.a, probe[None])[0] - probe
        off.append(np.linalg.norm(tip_error(CHAINS[name], position, probe, larger) - formula))
    assert 1e-12 < off[0] < 1e-8
    assert off[1] / off[0] == pytest.approx(100.0, rel=0.02)


@pytest.mark.parametrize(
    "entry", PRINTED["misprints"]["equations"], ids=lambda one: f"{one['at']} {one['error']}"
)
def test_a_misprint_in_an_equation_is_none_of_rigid_bodies(entry: dict[str, str]) -> None:
    name, component = entry["at"].split()
    k = "XYZ".index(component)
    assert_right(
        entry,
        "right",
        lambda position, probe: by_rigid_bodies(name, entry["error"], position, 0 * probe)[k],
    )


@machines
def test_thermal_terms_lack_their_length(name: str) -> None:
    temperature = {axis: AxisTemperature(11e-6, 2.0) for axis in AXES}
    machine = described(name, {}, at=POSITIONS[0])
    found = true_volumetric(MachineDescription(**{**vars(machine), "temperature": temperature}))
    error = found.model.error(POSITIONS, found.a, np.zeros((4, 3)))
    np.testing.assert_allclose(error, 22e-6 * POSITIONS, rtol=1e-12)
    for component, axis in zip("XYZ", AXES, strict=True):
        expression = PRINTED["equations"][name][component]
        assert {coefficient(expression, "thermal", x, x) for x in POSITIONS} == {1.0}, axis


@pytest.mark.parametrize("name", ["MH1", "MH2"])
def test_droop_is_as_printed(name: str) -> None:
    for which in ("phi1", "phi2"):
        machine = described(name, {}, at=POSITIONS[0])
        found = true_volumetric(MachineDescription(**{**vars(machine), "droop": {which: 3e-6}}))
        error = found.model.error(POSITIONS, found.a, np.zeros((4, 3)))
        for position, row in zip(POSITIONS, error, strict=True):
            printed = [
                coefficient(PRINTED["equations"][name][c], which, position, position) for c in "XYZ"
            ]
            np.testing.assert_allclose(row, 3e-6 * np.array(printed), atol=1e-18)


@pytest.mark.parametrize(("name", "arm", "about"), [("MH1", 0, 1), ("MH2", 1, 0)])
def test_signs_of_a_sagging_arm(name: str, arm: int, about: int) -> None:
    """Weight at the end of the arm turns the column, and bends the arm downwards, whichever way the
    arm points.
    """
    out, height, stiffness = 0.8, 0.6, 1e-6
    weight = np.array([0.0, 0.0, -1.0])
    moment = np.cross(out * np.eye(3)[arm], weight)
    assert abs(moment[about]) == pytest.approx(out)
    shift = np.cross(stiffness * moment, height * np.eye(3)[2])
    position = np.zeros(3)
    position[arm], position[2] = out, height
    tilt = (
        coefficient(PRINTED["equations"][name]["XYZ"[arm]], "phi1", position, position) * stiffness
    )
    assert tilt == pytest.approx(shift[arm], rel=1e-12) and tilt > 0
    bend = coefficient(PRINTED["equations"][name]["Z"], "phi2", position, position)
    assert (bend < 0) == (name == "MH1")


def seen(name: str, error: str, line: np.ndarray) -> np.ndarray:
    """What a rotation adds (3,) on a line parallel to its axis, against the line through the
    reference point.

    `line` has the offsets of the line, and along the axis where it stands.
    """
    through = np.where(np.array(list(AXES)) == error[3], line, 0.0)
    return by_rigid_bodies(name, error, line, np.zeros(3)) - by_rigid_bodies(
        name, error, through, np.zeros(3)
    )


def displacement_rules(name: str) -> dict[str, str]:
    return {key: rule for key, rule in PRINTED["rules"][name].items() if key not in SQUARENESS}


@machines
def test_rules_for_displacements_are_the_coupling_but_for_the_misprints(name: str) -> None:
    def right(key: str, error: str, position: np.ndarray, probe: np.ndarray) -> float:
        if error[3] != key[3]:
            return 0.0
        machine = described(name, {}, at=position)
        measured = ParametricError(iso(key), line=tuple(position.tolist()))
        return float(-coupling(machine, measured)[AXES.index(error[1])])

    assert differences(displacement_rules(name), ROTATIONS, right) == set(listed(name, "rules"))


@machines
def test_the_coupling_is_what_rigid_bodies_show(name: str) -> None:
    for key in displacement_rules(name):
        for error in (one for one in ROTATIONS if one[3] == key[3]):
            for position in POSITIONS:
                measured = ParametricError(iso(key), line=tuple(position.tolist()))
                found = coupling(described(name, {}, at=position), measured)[AXES.index(error[1])]
                assert found == pytest.approx(
                    seen(name, error, position)[AXES.index(key[1])], abs=1e-8
                )


@pytest.mark.parametrize(
    "entry", PRINTED["misprints"]["rules"], ids=lambda one: f"{one['at']} {one['error']}"
)
def test_a_misprint_in_a_rule_is_not_what_is_seen(entry: dict[str, str]) -> None:
    name, key = entry["at"].split()
    assert_right(
        entry,
        "right",
        lambda position, probe: -seen(name, entry["error"], position)[AXES.index(key[1])],
    )


def slope(name: str, error: str, corner: np.ndarray, along: int, across: int) -> float:
    """Slope between the ends of a line that begins at the reference position of `along` and ends at
    the corner.

    Rotations grow from 0 at the reference point to 1 at the corner, so that Ex_x / xm is a slope.
    """
    start = np.where(np.arange(3) == along, 0.0, corner)
    at_end = by_rigid_bodies(name, error, corner, np.zeros(3))[across]
    moves = AXES.index(error[3]) == along
    at_start = 0.0 if moves else by_rigid_bodies(name, error, start, np.zeros(3))[across]
    return float((at_end - at_start) / corner[along])


PLANES = {"a": (0, 1), "b1": (0, 2), "b2": (1, 2)}


def angle(name: str, key: str, error: str, corner: np.ndarray) -> float:
    """What a rotation adds to the slopes of both lines across one another: -alpha, where alpha is
    measured.
    """
    first, second = PLANES[key]
    return slope(name, error, corner, first, second) + slope(name, error, corner, second, first)


def in_the_documents_way(name: str, key: str, error: str, corner: np.ndarray) -> float:
    """What the printed rules count: for alpha the slope of the X line alone; for the others the
    slope of the Z line, and of the other line only what the rule for its straightness takes off it.
    """
    first, second = PLANES[key]
    if key == "a":
        return slope(name, error, corner, first, second)
    found = slope(name, error, corner, second, first)
    if AXES.index(error[3]) == first:
        found += seen(name, error, corner)[second] / corner[first]
    return float(found)


def squareness_rules(name: str) -> dict[str, str]:
    return {key: rule for key, rule in PRINTED["rules"][name].items() if key in SQUARENESS}


@machines
def test_rules_for_squareness_follow_the_documents_way_but_for_the_misprints(name: str) -> None:
    found = set()
    for key, rule in squareness_rules(name).items():
        for error in ROTATIONS:
            for corner in POSITIONS:
                printed = coefficient(rule, error, corner, np.zeros(3))
                if abs(printed - in_the_documents_way(name, key, error, corner)) > 1e-6:
                    found.add((key, error))
    assert found == set(listed(name, "squareness"))


@machines
def test_what_the_angle_between_the_lines_has_besides(name: str) -> None:
    found = set()
    for key in squareness_rules(name):
        for error in ROTATIONS:
            for corner in POSITIONS:
                if (
                    abs(
                        angle(name, key, error, corner)
                        - in_the_documents_way(name, key, error, corner)
                    )
                    > 1e-6
                ):
                    found.add((key, error))
    assert found == set(listed(name, "angle"))


@pytest.mark.parametrize(
    "entry", PRINTED["misprints"]["squareness"], ids=lambda one: f"{one['at']} {one['error']}"
)
def test_a_misprint_in_a_rule_for_squareness(entry: dict[str, str]) -> None:
    name, key = entry["at"].split()
    assert_right(
        entry,
        "right",
        lambda corner, probe: in_the_documents_way(name, key, entry["error"], corner),
    )


@pytest.mark.parametrize(
    "entry", PRINTED["misprints"]["angle"], ids=lambda one: f"{one['at']} {one['error']}"
)
def test_a_term_that_rules_for_squareness_have_otherwise(entry: dict[str, str]) -> None:
    name, key = entry["at"].split()
    assert_right(entry, "angle", lambda corner, probe: angle(name, key, entry["error"], corner))


@machines
@pytest.mark.parametrize("key", SQUARENESS)
def test_squareness_at_the_reference_point_is_the_angle_measured_less_the_tilts(
    name: str, key: str
) -> None:
    """An angle measured elsewhere on rigid bodies comes back as what was put in."""
    generator = np.random.default_rng(11)
    errors = dict(zip(ROTATIONS, generator.normal(0.0, 1e-5, 9).tolist(), strict=True))
    true, corner = 2e-5, np.array([2.0, 2.0, 2.0])
    at = np.array([0.5, 0.9, 1.3])
    measured = true
    for error, value in errors.items():
        # Over the whole axes: rotations grow linearly to `value` at the upper end.
        first, second = PLANES[key]
        for along, across in ((first, second), (second, first)):
            end, start = at.copy(), at.copy()
            end[along], start[along] = 2.0, 0.0
            k = AXES.index(error[3])
            shift = [
                by_rigid_bodies(name, error, x, np.zeros(3))[across] * value * x[k] / 2.0
                for x in (end, start)
            ]
            measured -= (shift[0] - shift[1]) / 2.0
    machine = described(name, errors, at=corner)
    iso_name, sign = ISO[key]
    found = true_volumetric(
        MachineDescription(
            **{**vars(machine), "squareness": (Squareness(iso_name, sign * measured, tuple(at)),)}
        )
    )
    value = found.a[[one.name for one in found.model.parameters].index(iso_name)]
    assert value == pytest.approx(sign * true, abs=1e-12)


def test_the_data_have_every_equation_and_rule() -> None:
    assert set(PRINTED["equations"]) == set(PRINTED["rules"]) == set(CHAINS) == set(ARRANGEMENTS)
    assert all(list(one) == ["X", "Y", "Z"] for one in PRINTED["equations"].values())
    assert all(len(one) == 12 for one in PRINTED["rules"].values())
