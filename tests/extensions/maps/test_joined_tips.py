"""Machines drawn from a map: one machine for all of its probes, with their offsets."""

from __future__ import annotations

import json
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.machine_files import FittedMap
from ballplate.extensions.maps.corrected_points import corrected_with_root
from ballplate.extensions.maps.realisations import drawn_machines
from numpy.typing import NDArray

from tests.extensions.maps.test_fitted_errors import small

Real = NDArray[np.float64]
POINTS = np.array([[0.2, 0.3, 0.4], [0.8, 0.9, 0.1]])


@pytest.fixture(scope="module")
def fitted() -> FittedMap:
    """Of two of its probes the offsets are estimated."""
    given = small()
    stated = {
        f"probes.{name}": {
            "offset": [f"{1e3 * value} mm" for value in given.probes[name].offset.tolist()],
            "standard_uncertainty": "5 um",
        }
        for name in ("right", "back")
    }
    experiment = given.with_(stated)
    return bp.fit(experiment, bp.simulate(experiment, seed=6)).to_map()


def covariance_of_both_tips(fitted: FittedMap) -> Real:
    """Joint covariance (12, 12) of both points, corrected with the one probe and the other."""
    names = fitted.probes.names
    probes = np.repeat([names.index("right"), names.index("back")], 2)
    _, root = corrected_with_root(fitted, np.tile(POINTS, (2, 1)), probes)
    flat = root.reshape(12, -1)
    return np.asarray(flat @ flat.T)


def in_standard_errors(samples: Real, expected: Real) -> float:
    """The largest difference of the covariance of samples (n, m) from the expected one."""
    spread = np.diag(expected)
    error = np.sqrt((np.outer(spread, spread) + expected**2) / len(samples))
    return float((np.abs(np.cov(samples.T) - expected) / error).max())


def test_drawn_machines_have_the_joint_covariance_of_two_tips(fitted: FittedMap) -> None:
    a, offsets = drawn_machines(fitted, 4000, 3)
    names = fitted.probes.names
    stated = [k for k in range(len(names)) if names[k] not in ("right", "back")]
    assert (offsets[:, stated] == fitted.probes.offsets[stated]).all()
    tips = [
        np.concatenate(
            [
                fitted.model.error(POINTS, own, np.tile(p[names.index(name)], (2, 1))).ravel()
                for name in ("right", "back")
            ]
        )
        for own, p in zip(a, offsets, strict=True)
    ]
    expected = covariance_of_both_tips(fitted)
    assert in_standard_errors(np.array(tips), expected) < 5.0
    # Of offsets drawn apart from the machine that would not hold.
    apart = np.array(tips)
    apart[:, 6:] = np.roll(apart[:, 6:], 1, axis=0)
    assert in_standard_errors(apart, expected) > 10.0


def test_realisations_of_two_probes_are_of_the_same_machines(
    fitted: FittedMap, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "map.yaml"
    bp.write_map(fitted, path)
    given = ["map", str(path), "--line", "y = 500 mm, z = 500 mm", "--draw", "2", "--json"]
    drawn = []
    for name in ("right", "back"):
        assert main([*given, "--seed", "5", "--probe", name]) == 0
        drawn.append(json.loads(capsys.readouterr().out)["realisations"])
    assert drawn[0]["offsets"] == drawn[1]["offsets"]
    found = [bp.map(fitted, points=POINTS, probe=name, draw=1000) for name in ("right", "back")]
    a, offsets = drawn_machines(fitted, 1000)
    tips = []
    for each, name in zip(found, ("right", "back"), strict=True):
        assert each.realisations is not None
        own = each.realisations.offsets[name]
        assert (own == offsets[:, fitted.probes.names.index(name)]).all()
        one = fitted.model.error(POINTS, a[7], np.tile(own[7], (2, 1))) - own[7]
        np.testing.assert_allclose(each.realisations.errors[7], one, rtol=0, atol=1e-10)
        tips.append((each.realisations.errors + own[:, None]).reshape(1000, 6))
    joined = np.concatenate(tips, axis=1)
    assert in_standard_errors(joined, covariance_of_both_tips(fitted)) < 5.0
