"""The difference of two maps does not depend on the frames in which they were estimated."""

from __future__ import annotations

from dataclasses import dataclass, replace

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.machine_files.framing import FramedModel
from ballplate.extensions.maps.compared_maps import ComparedMap, map_of_fit
from ballplate.extensions.maps.comparison import compared
from ballplate.results.fits import Fit
from ballplate.simulator.estimation.gauss_newton import estimate, linearised_fit
from ballplate.simulator.geometry.motions import cross_matrices
from ballplate.simulator.machines.protocol import Array, ErrorModel, Parameter, Reported

from tests.extensions.maps.campaigns import simulated_fit


@dataclass(frozen=True)
class TurnedModel:
    """A model whose corrected points are turned as a whole, by `turn` (3, n) times its parameters:
    the same errors in a frame that other conditions hold.
    """

    model: ErrorModel
    turn: Array

    @property
    def dimension(self) -> int:
        return 3

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.model.parameters

    def error(self, x: Array, a: Array, p: Array) -> Array:
        return self.model.error(x, a, p) + np.cross(self.turn @ a, x + p)

    def jacobian(self, x: Array, a: Array, p: Array) -> Array:
        return self.model.jacobian(x, a, p) + cross_matrices(x + p) @ self.turn

    def reported(self) -> Reported:
        return self.model.reported()


def held_by_other_lines(model: ErrorModel) -> TurnedModel:
    """A model of one cubic metre whose frame is held by the far ends of EXY, EXZ and EYZ, instead
    of those of EYX, EZX and EZY.
    """
    far, none = np.eye(3)[[1, 2]], np.zeros((2, 3))
    along_y, along_z = model.jacobian(far, np.zeros(len(model.parameters)), none)
    return TurnedModel(model, np.stack([along_z[1], -along_z[0], along_y[0]]))


@pytest.fixture(scope="module")
def fits() -> tuple[Fit, Fit]:
    experiment = bp.quickstart()
    return simulated_fit(experiment, 1), simulated_fit(experiment, 2)


def in_other_frame(fit: Fit) -> ComparedMap:
    """The map of the same readings by a model whose frame is held by other conditions."""
    design = replace(fit.design, model=held_by_other_lines(fit.design.model))
    at = linearised_fit(design, estimate(design, fit.observed.x))
    own = at.layout.model
    return replace(
        map_of_fit(fit),
        model=design.model,
        values=at.state.a,
        root=fit.sigma * at.shared[own],
        undetermined=at.shared_null[own],
        fit=None,
    )


def test_another_frame_changes_the_motion_alone(fits: tuple[Fit, Fit]) -> None:
    first, second = (map_of_fit(fit) for fit in fits)
    usual = compared(first, second)
    other = compared(first, in_other_frame(fits[1]))
    u = usual.places.standard_uncertainties
    assert np.abs(other.places.standard_uncertainties / u - 1.0).max() < 1e-4
    assert np.abs(other.places.differences - usual.places.differences).max() < 1e-3 * u.max()
    for ours, theirs in zip(usual.lengths, other.lengths, strict=True):
        ratios = theirs.standard_uncertainties / ours.standard_uncertainties
        assert np.abs(ratios - 1.0).max() < 1e-4
    assert usual.test is not None and other.test is not None
    assert other.test.dimensions == usual.test.dimensions == 69
    assert other.test.statistic == pytest.approx(usual.test.statistic, rel=1e-3)
    # The frames differ by far more than the campaigns do, and functions are others in them.
    assert np.abs(other.motion.values - usual.motion.values).max() > 1e-6
    largest = [np.abs(one.motion.standard_uncertainties).max() for one in (usual, other)]
    assert abs(largest[1] / largest[0] - 1.0) > 0.01


def test_a_map_moved_as_a_whole_differs_by_that_motion(fits: tuple[Fit, Fit]) -> None:
    first = map_of_fit(fits[0])
    framed = FramedModel(first.model, (0.0, 0.0, 0.0))
    motion = np.array([3e-6, -2e-6, 1e-6, 4e-6, -5e-6, 2e-6])
    none = np.zeros((6, first.root.shape[1]))
    second = replace(
        first,
        model=framed,
        values=np.concatenate([first.values, motion]),
        root=np.concatenate([first.root, none]),
        undetermined=np.zeros((len(first.values) + 6, 0)),
        shared=np.zeros((len(first.values) + 6, 0)),
    )
    found = compared(first, second)
    assert found.places.exceeding == 0
    assert np.abs(found.places.differences).max() < 1e-14
    assert np.abs(found.lengths[-1].differences).max() < 1e-14
    # Told at the middle of the points, from where the turns shift the corner, less what the first
    # map's probe does at its corner.
    assert found.motion.values[3:] == pytest.approx(motion[3:], abs=1e-12)
    shift = motion[:3] + np.cross(motion[3:], [0.5, 0.5, 0.5])
    assert found.motion.values[:3] == pytest.approx(shift, abs=1e-12)


def test_the_joint_test_is_that_of_the_parameters(fits: tuple[Fit, Fit]) -> None:
    # All parameters are determined, and none of them is a motion of the frame.
    first, second = (fit.covariance("machine").to_numpy() for fit in fits)
    apart = np.subtract(*(fit.functions.choose(["machine"]).values for fit in fits))
    expected = float(apart @ np.linalg.solve(first + second, apart))
    test = compared(map_of_fit(fits[0]), map_of_fit(fits[1])).test
    assert test is not None and test.dimensions == len(apart)
    assert test.statistic == pytest.approx(expected, rel=1e-6)


def test_functions_are_compared_by_their_coefficients(fits: tuple[Fit, Fit]) -> None:
    found = compared(map_of_fit(fits[0]), map_of_fit(fits[1]))
    names = [one.kind for one in found.functions]
    assert names[:3] == ["EXX", "EYX", "EZX"] and len(names) == 18
    for name in ("EXX", "EYX", "ECZ"):
        one = next(one for one in found.functions if one.kind == name)
        own = [k for k, p in enumerate(fits[0].design.model.parameters) if p.function == name]
        covariance = sum(fit.covariance("machine").to_numpy()[np.ix_(own, own)] for fit in fits)
        apart = np.subtract(*(fit.functions.choose(["machine"]).values[own] for fit in fits))
        assert one.test is not None and one.test.dimensions == len(own)
        expected = float(apart @ np.linalg.solve(covariance, apart))
        assert one.test.statistic == pytest.approx(expected, rel=1e-6)
    # EYX is zero at both ends, where there is nothing to compare.
    straight = next(one for one in found.functions if one.kind == "EYX")
    assert straight.count == 9 and np.isnan(straight.normalised[-1])
