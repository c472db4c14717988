"""The readings of NBSIR 79-1752: the report's own fits, and multiple redundancy by the general
estimator.

Misprints of the tables that are put right here or in the readings shipped, each the only change of
a digit or sign with which the report's own results come out:

- made-up readings, ball 1, x in position 2: .000010, must be -.000010;
- made-up readings, ball 8, true and computed x: 1.110020, must be 1.111020; by multiple redundancy
1.110028: 1.111028;
- made-up readings, ball 5, "true" y: 13.777777, which the readings do not contain; they give
13.777770;
- made-up readings, ball 4, x by multiple redundancy: .132674, must be .132672;
- made-up readings, ball 9, x by the three-parameter fit: 9.735171, must be 9.735173;
- real readings, ball 12, y in position 2: 12.002806, must be 12.002796;
- real readings, ball 8, y by the three-parameter fit: 8.999460, must be 8.999360.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.estimators.reversal_fits import ReversalFit, fit_reversal
from ballplate.results.fits import Fit
from ballplate.results.fitting import fit
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.machines.metric import Scale
from ballplate.simulator.readings.reading_files import read_readings

FOLDER = Path("designs/hocken_borchardt")
INCH = 0.0254
# The last digit printed.
DIGIT = 1e-6
# Table 1: the co-ordinates by the five-parameter fit with the whole scale difference in x, by
# multiple redundancy without one, and those that the readings were made from.
FIVE_PARAMETERS = np.array(
    [
        (0.0, 0.0),
        (12.526471, 0.0),
        (3.141597, 2.674327),
        (0.132671, 11.989642),
        (12.026449, 13.777770),
        (6.936245, 7.216943),
        (12.137425, 9.873462),
        (1.111020, 3.762542),
        (9.735164, 3.164786),
    ]
)
REDUNDANT = np.array(
    [
        (0.0, 0.0),
        (12.526557, 0.0),
        (3.141619, 2.674346),
        (0.132672, 11.989724),
        (12.026532, 13.777864),
        (6.936293, 7.216993),
        (12.137508, 9.873530),
        (1.111028, 3.762568),
        (9.735231, 3.164807),
    ]
)
# Table A1: the co-ordinates by the three-parameter fit, relative to the zero of the readings.
THREE_PARAMETERS = np.array(
    [
        (0.000007, -0.000005),
        (12.526483, 0.0),
        (3.141604, 2.674324),
        (0.132673, 11.989642),
        (12.026455, 13.777775),
        (6.936251, 7.216943),
        (12.137433, 9.873466),
        (1.111026, 3.762539),
        (9.735173, 3.164785),
    ]
)
# Tables 2 and A1, real readings: by the five-parameter fit, the three-parameter fit, and Reeve's
# program.
REAL_FIVE = np.array(
    [
        (0.0, 0.0),
        (-3.000864, 3.999145),
        (-2.000515, 10.999406),
        (-4.000532, 13.999428),
        (0.0, 14.999408),
        (-8.001196, 1.999381),
        (-6.000930, 5.999259),
        (-9.001258, 8.999363),
        (-7.000682, 12.999380),
        (-15.002107, 0.999012),
        (-13.001700, 4.999086),
        (-12.001292, 9.999367),
        (-14.002106, 14.998583),
    ]
)
REAL_THREE = np.array(
    [
        (0.0, 0.0),
        (-3.000862, 3.999144),
        (-2.000514, 10.999401),
        (-4.000530, 13.999422),
        (0.0, 14.999401),
        (-8.001193, 1.999381),
        (-6.000928, 5.999257),
        (-9.001253, 8.999360),
        (-7.000678, 12.999374),
        (-15.002101, 0.999012),
        (-13.001694, 4.999084),
        (-12.001287, 9.999362),
        (-14.002099, 14.998577),
    ]
)
REAL_REDUNDANT = np.array(
    [
        (0.0, 0.0),
        (-3.000868, 3.999151),
        (-2.000517, 10.999422),
        (-4.000537, 13.999447),
        (0.0, 14.999429),
        (-8.001207, 1.999384),
        (-6.000939, 5.999268),
        (-9.001270, 8.999376),
        (-7.000692, 12.999398),
        (-15.002129, 0.999014),
        (-13.001718, 4.999092),
        (-12.001309, 9.999381),
        (-14.002125, 14.998604),
    ]
)
TRUE = np.array(
    [(12.026450, 13.777770) if i == 4 else row for i, row in enumerate(FIVE_PARAMETERS)]
)


def observed(data: str, variant: str):  # type: ignore[no-untyped-def]
    experiment = {e.name: e for e in load(FOLDER / f"{data}.yaml")}[variant]
    return experiment, read_readings(FOLDER / f"{data}-readings.csv", lay_out(experiment))


def fitted(data: str, variant: str) -> Fit:
    return fit(*observed(data, variant))


def reversed_(data: str, scale: Scale, offsets: bool = True) -> ReversalFit:
    return fit_reversal(*observed(data, "with scale"), scale, offsets)


def values(found: Fit | ReversalFit) -> dict[str, float]:
    return {e.name: e.value * 1e6 for e in found.estimates}


def test_five_parameters() -> None:
    """Table 1, to the last digit printed."""
    found = reversed_("dummy", "x")
    estimates = values(found)
    for name, published in (("alpha", 4.81), ("beta", -131.24), ("gamma", 13.69)):
        assert round(estimates[name], 2) == published
    assert round(estimates["offset x"] / INCH, 2) == -14.04
    assert round(estimates["offset y"] / INCH, 2) == 9.45
    assert round(found.found.sigma / INCH * 1e6, 1) == 0.5
    inches = found.coordinates / INCH
    np.testing.assert_allclose(inches, FIVE_PARAMETERS, rtol=0, atol=DIGIT)
    # All but one are the same when rounded: x of ball 5 is 12.0264498, and printed .026449.
    assert (np.round(inches, 6) != FIVE_PARAMETERS).sum() == 1
    np.testing.assert_allclose(inches, TRUE, rtol=0, atol=DIGIT)
    assert (found.first, found.second) == ("first", "turned")
    assert found.warnings == ()


def test_five_parameters_by_multiple_redundancy() -> None:
    """The full estimate agrees within what the equations of the first order neglect, and has
    uncertainties.
    """
    found = reversed_("dummy", "x")
    full = {e.name: e for e in found.redundant}
    for estimate in found.estimates:
        beside = full[estimate.name]
        assert abs(estimate.value - beside.value) < found.found.bias * beside.standard_uncertainty
    plate = found.full.plates[0]
    np.testing.assert_allclose(plate.coordinates / INCH, FIVE_PARAMETERS, rtol=0, atol=DIGIT)
    free = plate.standard_uncertainties > 0
    off = np.abs(found.coordinates - plate.coordinates)[free] / plate.standard_uncertainties[free]
    assert 0.1 < found.found.bias < 0.5 and off.max() < found.found.bias
    assert (found.full.degrees_of_freedom, found.found.degrees_of_freedom) == (13, 13)


def test_true_parameters_are_within_the_uncertainties() -> None:
    """Table 1 tells what the readings were made with; rounding to a microinch is their only
    error.
    """
    full = {e.name: e for e in reversed_("dummy", "x").redundant}
    microinch = 1e-6 * INCH
    true = {"alpha": 4.79e-6, "beta": -131.26e-6, "gamma": 13.70e-6, "offset x": -14.20 * microinch}
    for name, value in (true | {"offset y": 9.60 * microinch}).items():
        assert abs(full[name].value - value) < full[name].standard_uncertainty


def test_three_parameters() -> None:
    """Table A1."""
    found = reversed_("dummy", "x", offsets=False)
    estimates = values(found)
    assert {name: round(value, 2) for name, value in estimates.items()} == {
        "alpha": 5.03,
        "beta": -130.55,
        "gamma": 12.99,
    }
    assert round(found.found.sigma / INCH * 1e6, 1) == 7.0
    assert np.abs(found.coordinates / INCH - TRUE).max() < 14e-6
    # The table's axes go through the zero of the readings, from which ball 1 is off by the mean of
    # both its readings, the second turned back, and through ball 2.
    shifted = found.coordinates / INCH + (0.000014 / 2, -0.000010 / 2)
    turn = shifted[1, 1] / shifted[1, 0]
    turned = shifted + turn * np.column_stack([shifted[:, 1], -shifted[:, 0]])
    np.testing.assert_allclose(turned, THREE_PARAMETERS, rtol=0, atol=DIGIT)
    assert any("fit without --no-offsets" in warning for warning in found.warnings)


def test_options() -> None:
    """Where the scale difference goes changes no parameter, and the co-ordinates by gamma along the
    machine's axes.
    """
    found: dict[Scale, ReversalFit] = {
        scale: reversed_("dummy", scale) for scale in ("x", "y", "split", "none")
    }
    assert len({tuple(values(one).items()) for one in found.values()}) == 1
    gamma = found["x"].found.gamma
    x, y, split, none = (found[scale].coordinates / INCH for scale in ("x", "y", "split", "none"))
    # The plate is aligned with the axes of the first position.
    np.testing.assert_allclose(y, x * (1 + gamma), rtol=0, atol=3e-9)
    np.testing.assert_allclose(split, x * (1 + gamma / 2), rtol=0, atol=3e-9)
    np.testing.assert_allclose(none, x * (1 + gamma, 1), rtol=0, atol=3e-9)
    for scale, one in found.items():
        if scale != "none":
            assert [e.name for e in one.redundant] == [
                "alpha",
                "beta",
                "gamma",
                "offset x",
                "offset y",
            ]
            np.testing.assert_allclose(
                one.coordinates, one.full.plates[0].coordinates, rtol=0, atol=3e-9
            )
    # Multiple redundancy has no scale difference to leave unapplied: it shares out what it finds
    # between both axes.
    assert [e.name for e in found["none"].redundant] == ["alpha", "beta", "offset x", "offset y"]
    other = found["none"].full.plates[0].coordinates / INCH
    np.testing.assert_allclose(other, split, rtol=0, atol=3e-6)


def test_multiple_redundancy_without_scale() -> None:
    """Table 1: the results of Reeve's program, which knows no scale difference."""
    found = fitted("dummy", "without scale")
    estimates = values(found)
    assert round(estimates["alpha"], 2) == 4.66
    assert round(estimates["first: rotation z"], 2) == -133.98
    np.testing.assert_array_equal(np.round(found.plates[0].coordinates / INCH, 6), REDUNDANT)
    # Its sigma of 57.5 is of single readings, and has two degrees of freedom less than there are.
    assert found.degrees_of_freedom == 14
    assert np.sqrt(found.solution.factor.sum_of_squares / 12) == pytest.approx(57.5, abs=0.05)


def test_no_degrees_of_freedom_explain_reeves_sigma_of_the_real_readings() -> None:
    """Table 2 prints 17.0: 20 of 22 degrees of freedom, counted as for the made-up readings, make
    it 16.8.
    """
    found = fitted("real", "without scale")
    freedom = found.design.observation_count - found.design.parameter_count
    assert freedom == 22 and {e.name: 1e6 * e.value for e in found.estimates}[
        "alpha"
    ] == pytest.approx(-0.66, abs=0.005)
    by_count = {
        n: float(np.sqrt(found.solution.factor.sum_of_squares / n))
        for n in range(freedom - 6, freedom + 1)
    }
    assert {n: round(sigma, 1) for n, sigma in by_count.items() if n in (19, 20, 22)} == {
        19: 17.2,
        20: 16.8,
        22: 16.0,
    }
    assert min(abs(sigma - 17.0) for sigma in by_count.values()) > 0.15


def test_multiple_redundancy_with_scale() -> None:
    found = fitted("dummy", "with scale")
    estimates = values(found)
    assert round(estimates["alpha"], 2) == 4.81
    assert round(estimates["first: rotation z"], 2) == -131.24
    assert round(estimates["gamma"], 2) == 13.69
    assert found.solution.status == "converged"
    assert found.verdict.deficiency == 0


@pytest.mark.parametrize(
    ("offsets", "parameters", "sigma", "coordinates"),
    [
        (
            True,
            {
                "alpha": -0.67,
                "beta": -141.27,
                "gamma": 2.82,
                "offset x": -14.30,
                "offset y": -17.58,
            },
            16.9,
            REAL_FIVE,
        ),
        (False, {"alpha": -0.81, "beta": -140.40, "gamma": 3.69}, 17.6, REAL_THREE),
    ],
    ids=["five parameters", "three parameters"],
)
def test_published_results_for_the_real_readings(
    offsets: bool, parameters: dict[str, float], sigma: float, coordinates: np.ndarray
) -> None:
    """Tables 2 and A1."""
    found = reversed_("real", "x", offsets)
    scales = {
        "alpha": 1e6,
        "beta": 1e6,
        "gamma": 1e6,
        "offset x": 1e6 / INCH,
        "offset y": 1e6 / INCH,
    }
    assert {e.name: round(e.value * scales[e.name], 2) for e in found.estimates} == parameters
    assert round(found.found.sigma / INCH * 1e6, 1) == sigma
    # The program computed in single steps: the last digit may differ by one.
    off = np.abs(found.coordinates / INCH - coordinates)
    assert off.max() < 1.1 * DIGIT and (off > 0.5 * DIGIT).mean() < 0.35


def test_multiple_redundancy_for_the_real_readings() -> None:
    """Tables 2 and A1: the results of Reeve's program, whose sigma of 17.0 does not come out."""
    found = fitted("real", "without scale")
    estimates = values(found)
    assert round(estimates["alpha"], 2) == -0.66
    assert round(estimates["first: rotation z"], 1) == -141.5
    np.testing.assert_allclose(
        found.plates[0].coordinates / INCH, REAL_REDUNDANT, rtol=0, atol=0.5 * DIGIT
    )
    assert found.degrees_of_freedom == 22
    # With two degrees of freedom less, as for the made-up readings.
    assert np.sqrt(found.solution.factor.sum_of_squares / 20) == pytest.approx(16.8, abs=0.05)


@pytest.mark.parametrize("variant", ["with scale", "without scale"])
def test_real_readings(variant: str) -> None:
    found = fitted("real", variant)
    assert found.solution.status == "converged"
    assert found.verdict.deficiency == 0
    estimates = {e.name: e for e in found.estimates}
    assert all(np.isfinite(e.value) and e.standard_uncertainty > 0 for e in found.estimates)
    assert estimates["alpha"].unit == "rad"
    # The residuals are of some ten microinches, what such a machine repeated to in 1979.
    assert 5 < found.sigma < 20


@pytest.mark.parametrize("offsets", [True, False])
def test_real_readings_reversed(offsets: bool) -> None:
    """Both estimates within their uncertainties, and no term of the second order that counts."""
    found = reversed_("real", "x", offsets)
    full = {e.name: e for e in found.redundant}
    within = found.found.bias if offsets else 2.0
    assert found.found.bias < 0.05
    for estimate in found.estimates:
        assert (
            abs(estimate.value - full[estimate.name].value)
            < within * full[estimate.name].standard_uncertainty
        )
    plate = found.full.plates[0]
    free = plate.standard_uncertainties > 0
    off = np.abs(found.coordinates - plate.coordinates)[free] / plate.standard_uncertainties[free]
    assert free.sum() == 23 and off.max() < within
    # The report's sigma is of the difference of two readings; the full estimate's, in microinches,
    # of one.
    if offsets:
        assert found.full.sigma * 1e-6 * INCH == pytest.approx(found.found.single, rel=1e-3)
