"""Maps in other error models: nothing is lost where the new one can do all, and what is lost is
told where it cannot.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.maps.corrected_points import corrected, corrected_with_root
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.maps.fitted_map import FittedMap

from tests.extensions.maps import wording


@cache
def fitted(model: str = "kinematic", deficient: bool = False) -> FittedMap:
    plate = {"plate": {"kind": "grid", "balls": [3, 3], "size": ["750 mm", "750 mm"]}}
    model_ = {"kind": "kinematic", "position_coefficients": 3, "rotation_coefficients": 2}
    changes: dict[str, object] = {"artefacts": plate, "error_model": model_}
    if deficient:
        changes |= {"calibration": [], "probes": {"down": ["0 mm", "0 mm", "0 mm"]}}
        changes |= {"positions": [positions("z", 250), positions("z", 750), positions("x", 250)]}
    experiment = bp.quickstart().with_(changes)
    return bp.fit(experiment, bp.simulate(experiment)).to_map()


def positions(plane: str, level: int) -> dict[str, object]:
    others = [axis for axis in "xyz" if axis != plane]
    corner = dict.fromkeys(others, "0 mm")
    name = f"{plane} {level}"
    return {"name": name, "plane": plane, "level": f"{level} mm", "corner": corner} | {
        "probes": ["down"]
    }


def test_there_and_back() -> None:
    old = fitted()
    rich = bp.convert(old, "{kind: kinematic, position_coefficients: 5}").map
    back = bp.convert(rich, "{kind: kinematic, position_coefficients: 3, rotation_coefficients: 2}")
    assert back.is_exact
    np.testing.assert_allclose(back.map.values, old.values, atol=1e-15)
    np.testing.assert_allclose(
        back.map.covariance, old.covariance, atol=1e-9 * np.abs(old.covariance).max()
    )


def test_what_a_poorer_model_loses_is_told() -> None:
    """Least squares over the places, motions between frames beside the parameters."""
    old = fitted()
    found = bp.convert(old, "{kind: kinematic, position_coefficients: 2, rotation_coefficients: 1}")
    assert not found.is_exact
    x, p = found.conversion.places, found.conversion.offsets
    new = found.map.model
    own = new.jacobian(x, np.zeros(6), p).reshape(x.size, -1)
    tip = x + p
    motion = np.zeros((len(x), 3, 6))
    motion[:, :, :3] = np.eye(3)
    for axis in range(3):
        motion[:, :, 3 + axis] = np.cross(np.eye(3)[axis], tip)
    columns = np.concatenate([own, motion.reshape(x.size, 6)], axis=1)
    wanted = (old.model.error(x, old.values, p) - p).ravel()
    solution = np.linalg.lstsq(columns, wanted, rcond=None)[0]
    left = columns @ solution - wanted
    np.testing.assert_allclose(found.conversion.differences(x, p).ravel(), left, atol=1e-13)
    np.testing.assert_allclose(found.map.values, solution[:6], atol=1e-13)
    assert wording.CANNOT_FOLLOW_THE_OLD_ONE_EXACTLY in found.lines()[3]


def test_a_model_with_functions_by_axis_contains_one_of_the_same_degrees() -> None:
    """Splines of order 3 without knots are the polynomials of three coefficients."""
    by_axis = "{kind: empirical, basis: {x: {order: 4}, y: {order: 3}}, coefficients: {z: 3}}"
    found = bp.convert(fitted(), by_axis)
    assert found.is_exact
    points = np.random.default_rng(2).random((30, 3))
    before, after = (corrected(one, points)[0] for one in (fitted(), found.map))
    np.testing.assert_allclose(before, after, atol=1e-14)
    back = bp.convert(found.map, "{kind: empirical, coefficients: 4}")
    np.testing.assert_allclose(corrected(back.map, points)[0], before, atol=1e-14)
    assert not bp.convert(fitted(), by_axis.replace("z: 3", "z: 2")).is_exact


def test_what_is_undetermined_stays_so() -> None:
    old = fitted(deficient=True)
    assert old.undetermined.shape[1] > 0
    found = bp.convert(old, "{kind: empirical, coefficients: 4}")
    assert found.map.undetermined.shape == (len(found.map.scale), old.undetermined.shape[1])
    points = np.random.default_rng(2).random((30, 3))
    _, one = corrected_with_root(old, points)
    _, other = corrected_with_root(found.map, points)
    np.testing.assert_array_equal(np.isnan(one).any(axis=2), np.isnan(other).any(axis=2))
    assert found.length_uncertainty is None


def test_two_dimensions(tmp_path: Path) -> None:
    folder = "designs/hocken_borchardt"
    experiment = bp.load(f"{folder}/dummy.yaml", "with scale")
    old = bp.fit(experiment, f"{folder}/dummy-readings.csv").to_map()
    found = bp.convert(old, "{kind: kinematic, position_coefficients: 2, rotation_coefficients: 1}")
    points = np.random.default_rng(2).random((9, 2)) * old.volume.size
    before, after = corrected(old, points)[0], corrected(found.map, points)[0]
    pairs = np.triu_indices(9, 1)
    lengths = [np.linalg.norm(one[pairs[0]] - one[pairs[1]], axis=1) for one in (before, after)]
    np.testing.assert_allclose(*lengths, atol=1e-10)


def test_the_command_writes_a_map(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bp.write_map(fitted(), tmp_path / "map.yaml")
    arguments = [
        "map",
        "--convert",
        str(tmp_path / "map.yaml"),
        "--to",
        "{kind: empirical, coefficients: 4}",
    ]
    assert main([*arguments, "-o", str(tmp_path / "new.yaml")]) == 0
    assert wording.THE_NEW_ERROR_MODEL_DOES_ALL in capsys.readouterr().out
    again = bp.load_map(tmp_path / "new.yaml")
    np.testing.assert_array_equal(again.values, bp.convert(fitted(), arguments[-1]).map.values)
    assert main(["map", "--convert", str(tmp_path / "map.yaml"), "--to", "metric"]) == 1


@pytest.mark.parametrize(
    ("to", "told"),
    [
        ("wrong", 'unknown kind "wrong"'),
        ("{kind: kinematic, colour: red}", "colour: unknown key"),
        ("missing.yaml", "there is no such file"),
        ("[1, 2]", "kind"),
        ("{kind: python, object: 'nothing:here'}", "nothing"),
    ],
)
def test_what_is_no_error_model_is_told(to: str, told: str) -> None:
    with pytest.raises(ExperimentError, match=told):
        bp.convert(fitted(), to)


@pytest.mark.parametrize("coefficients", [(2, 1), (3, 1), (2, 2)])
def test_no_place_and_no_length_differs_by_more_than_is_printed(
    coefficients: tuple[int, int],
) -> None:
    """Corrected points of both maps at places of our own, inside, on faces, edges and at corners,
    and steps uphill at random from the worst of them.
    """
    old, (position, rotation) = fitted(), coefficients
    to = f"position_coefficients: {position}, rotation_coefficients: {rotation}"
    found = bp.convert(old, f"{{kind: kinematic, {to}}}")
    size, generator = old.volume.size, np.random.default_rng(11)

    def scattered(count: int) -> np.ndarray:
        inside = generator.random((count, 3))
        return np.where(generator.random((count, 3)) < 0.4, inside.round(), inside)

    def places(one: FittedMap, fractions: np.ndarray, offset: np.ndarray) -> np.ndarray:
        x = old.volume.lower + size * fractions
        return x + one.model.error(x, one.values, np.broadcast_to(offset, x.shape))

    def worst(value, count: int, columns: int) -> float:
        x = np.hstack([scattered(count) for _ in range(columns)])
        for spread in 0.3 ** np.arange(1, 9):
            top = x[np.argsort(value(x))[-50:]]
            steps = spread * generator.standard_normal((20, *top.shape))
            x = np.concatenate([top, np.clip(top + steps, 0.0, 1.0).reshape(-1, 3 * columns)])
        return value(x).max()

    largest = {"lengths": 0.0, "points": 0.0}
    for offset in old.probes.offsets:

        def lengths(ends: np.ndarray, offset: np.ndarray = offset) -> np.ndarray:
            sides = [
                places(one, ends[:, :3], offset) - places(one, ends[:, 3:], offset)
                for one in (old, found.map)
            ]
            return np.abs(np.subtract(*(np.linalg.norm(one, axis=1) for one in sides)))

        def apart(x: np.ndarray, offset: np.ndarray = offset) -> np.ndarray:
            moved = found.conversion.motion
            new = places(found.map, x, offset) - places(old, x, offset) + moved[:3]
            tip = old.volume.lower + size * x + offset
            centre = (found.conversion.places + found.conversion.offsets).mean(axis=0)
            return np.linalg.norm(new + np.cross(moved[3:], tip - centre), axis=1)

        largest["lengths"] = max(largest["lengths"], worst(lengths, 2000, 2))
        largest["points"] = max(largest["points"], worst(apart, 2000, 1))
    # Random steps come near the top, and never above it.
    assert 0.95 * found.lengths[0] < largest["lengths"] <= 1.001 * found.lengths[0]
    # Points are searched with tips along the axes too.
    assert largest["points"] <= 1.001 * found.residual[0]
    places_used = found.conversion.places, found.conversion.offsets
    fitted_ones = np.linalg.norm(found.conversion.differences(*places_used), axis=1)
    assert fitted_ones.max() <= found.residual[0]
    assert found.map.conversion_residual == found.residual[0]
