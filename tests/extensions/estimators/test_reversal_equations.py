"""The first-order equations of a reversal: what they give, what they neglect, and the full estimate
beside them.
"""

from __future__ import annotations

import numpy as np
import pytest
from ballplate.extensions.estimators.reversal import (
    Reversal,
    UndeterminedError,
    reverse,
    turn_between,
)
from ballplate.results.plates import PlateAxes, in_plate_axes
from ballplate.simulator.machines.metric import Scale
from ballplate.simulator.machines.protocol import Array

ALPHA, GAMMA = 8e-6, -5e-6
PLATE = np.array(
    [(0.0, 0.0), (0.30, 0.0), (0.31, 0.12), (0.02, 0.25), (0.15, 0.11), (0.07, 0.20), (0.22, 0.04)]
)
AXES = PlateAxes(0, 1, 0)
METRICS = {
    "x": np.array([[1 + GAMMA, -ALPHA], [0, 1]]),
    "y": np.array([[1, -ALPHA], [0, 1 - GAMMA]]),
    "split": np.array([[1 + GAMMA / 2, -ALPHA], [0, 1 - GAMMA / 2]]),
}


def readings(
    beta: float, scale: str = "x", offset: tuple[float, float] = (0.0, 0.0), tilt: float = 0.3
) -> list[Array]:
    """Exact readings of the plate in both positions, the second turned clockwise by 90 degrees +
    beta.
    """
    found = []
    for angle, shift in ((tilt, offset), (tilt - np.pi / 2 - beta, (0.0, 0.0))):
        c, s = np.cos(angle), np.sin(angle)
        true = PLATE @ np.array([[c, s], [-s, c]])
        found.append(true @ METRICS[scale].T + shift)
    return found


@pytest.mark.parametrize("scale", ["x", "y", "split"])
@pytest.mark.parametrize("offsets", [True, False])
def test_exact_readings_give_their_parameters(scale: Scale, offsets: bool) -> None:
    first, second = readings(2e-5, scale, (3e-6, -4e-6) if offsets else (0.0, 0.0))
    found = reverse(first, second, scale, offsets)
    assert turn_between(first, second) == pytest.approx(-np.pi / 2 - 2e-5, abs=2e-5)
    # What is left is of the second order: 2e-5 squared, and products with alpha and gamma.
    assert found.alpha == pytest.approx(ALPHA, abs=1e-9)
    assert found.beta == pytest.approx(2e-5, abs=1e-9)
    assert found.gamma == pytest.approx(GAMMA, abs=1e-9)
    np.testing.assert_allclose(found.offset, (3e-6, -4e-6) if offsets else 0.0, rtol=0, atol=1e-10)
    assert found.degrees_of_freedom == 2 * len(PLATE) - (5 if offsets else 3)
    np.testing.assert_allclose(in_plate_axes(found.coordinates, AXES)[0], PLATE, rtol=0, atol=3e-10)


def test_the_share_of_gamma_changes_the_plate_alone() -> None:
    """Appendix B: the parameters are the same whichever axis takes the scale difference; the sizes
    are not.
    """
    first, second = readings(2e-5)
    found: dict[Scale, Reversal] = {
        scale: reverse(first, second, scale) for scale in ("x", "y", "split", "none")
    }
    assert len({(one.alpha, one.beta, one.gamma, one.sigma) for one in found.values()}) == 1
    sides = {scale: in_plate_axes(one.coordinates, AXES)[0][1, 0] for scale, one in found.items()}
    assert sides["x"] == pytest.approx(0.3, abs=1e-9)
    assert sides["y"] / sides["x"] == pytest.approx(1 + GAMMA, abs=1e-9)
    assert sides["split"] / sides["x"] == pytest.approx(1 + GAMMA / 2, abs=1e-9)
    # Neither scale corrected: here the side lies at 0.3 rad to x, and each scale acts along its own
    # axis.
    assert sides["none"] / sides["x"] == pytest.approx(1 + GAMMA * np.cos(0.3) ** 2, abs=2e-9)


@pytest.mark.parametrize("beta", [1e-4, 1e-3, 1e-2])
def test_what_is_neglected_is_told(beta: float) -> None:
    """It grows with the square of beta, bounds what comes out wrong, and is what the exact readings
    leave behind.
    """
    first, second = readings(beta)
    found = reverse(first, second, "x")
    arms = np.sqrt(((second - second.mean(axis=0)) ** 2).sum(axis=1))
    np.testing.assert_allclose(
        np.sqrt((found.neglected**2).sum(axis=1)), beta**2 / 2 * arms, rtol=0.3, atol=1e-11
    )
    noise = np.random.default_rng(3).normal(0.0, 1e-7, (200, 2, *PLATE.shape))
    noisy = [reverse(first + a, second + b, "x") for a, b in noise]
    for name, true in (("alpha", ALPHA), ("gamma", GAMMA)):
        values = np.array([getattr(one, name) for one in noisy])
        wrong = abs(values.mean() - true)
        neglected = np.sqrt((found.neglected**2).sum())
        assert wrong < values.std() * (neglected / 1e-7 + 4 / np.sqrt(200))
    # A warning is due where the bound is noticeable, and it is a bound that is nearly reached.
    assert (noisy[0].bias > 0.5) == (beta > 5e-4)
    # A linear function whose coefficients are as what is neglected changes by all of it.
    size = np.sqrt((noisy[0].neglected ** 2).sum())
    assert noisy[0].bias == pytest.approx(size / noisy[0].scatter)


@pytest.mark.parametrize("beta", [1e-3, 0.2, -0.7])
def test_scatter_is_that_of_the_readings_at_any_angle(beta: float) -> None:
    """Noise of 1 um is found again where sigma has grown to millimetres, and the plate as it is."""
    first, second = readings(beta)
    exact = reverse(first, second, "x")
    assert exact.exact_beta == pytest.approx(beta, abs=1e-10) and exact.scatter < 1e-12
    sides, _ = in_plate_axes(exact.exact_coordinates, AXES)
    # The correction for alpha and gamma leaves their products out.
    assert sides[1, 0] == pytest.approx(0.3, abs=1e-11)
    noise = np.random.default_rng(1).normal(0.0, 1e-6, (100, 2, *PLATE.shape))
    found = [reverse(first + a, second + b, "x") for a, b in noise]
    assert np.sqrt(np.mean([one.scatter**2 for one in found])) == pytest.approx(
        1e-6, rel=4 / np.sqrt(2 * 9 * 100)
    )
    assert min(one.single for one in found) > (1e-3 if abs(beta) > 0.1 else 1e-8)


def test_few_balls_and_balls_on_a_line() -> None:
    first, second = readings(1e-5)
    for chosen in ([0], [0, 1], [1, 1]):
        with pytest.raises(UndeterminedError, match="on one line"):
            reverse(first[chosen], second[chosen], "x")
    assert reverse(first[:3], second[:3], "x").degrees_of_freedom == 1
    # Without offsets the origin is one more place that is known.
    two = reverse(first[[1, 3]], second[[1, 3]], "x", offsets=False)
    assert two.degrees_of_freedom == 1 and two.alpha == pytest.approx(ALPHA, abs=1e-9)
    with pytest.raises(UndeterminedError):
        reverse(first[:2], second[:2], "x", offsets=False)
