"""Dimensions and their uncertainties against a block, machines and campaigns computed anew."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pandas
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from tests.extensions.parts import reference as own

MACHINES = {"quickstart": (own.quick, own.QUICK), "bridge": (own.bridge, own.BRIDGE)}
# Their value is a range, without what all points have in common.
OF_PLANES = ["parallelism right", "perpendicularity B"]


@cache
def campaign(name: str) -> tuple[Any, own.Campaign]:
    told = MACHINES[name][0]()
    experiment = bp.experiment(told)
    return experiment, own.planned(bp.lay_out(experiment), own.machine_of(told))


@cache
def measured(name: str) -> tuple[Any, own.Campaign, own.Campaign, float]:
    """A fit of readings by the package, the campaign on its true machine, and both fitted anew."""
    experiment, plan = campaign(name)
    rng = np.random.default_rng(3)
    truth = own.drawn_truth(plan, rng)
    fitted, sigma = replace(plan, x=truth.x).fitted()
    return bp.fit(experiment, own.table_of(truth)), truth, fitted, sigma


def part_file(folder: Path, places: Any, **changed: Any) -> Path:
    path = folder / "part.yaml"
    path.write_text(own.part_text(places, **changed), encoding="utf-8")
    return path


def of_members(name: str, k: int, covariance: np.ndarray) -> np.ndarray:
    """Covariance of the members of a dimension in the place k."""
    rows = slice(k * len(own.POINTS), (k + 1) * len(own.POINTS))
    return np.asarray(own.slopes()[name] @ covariance[rows, rows] @ own.slopes()[name].T)


def judge(found: Any, places: Any, fixed: np.ndarray, estimated: np.ndarray) -> None:
    """Uncertainties of all dimensions, and the shares of the campaign in them."""
    for one in found.dimensions:
        name, k = one.dimension.name, list(places).index(one.place)
        beside, map_ = (of_members(name, k, covariance) for covariance in (fixed, estimated))
        whole = beside + map_
        if name not in OF_PLANES:
            assert_allclose(one.value.share, np.trace(map_) / np.trace(whole), rtol=1e-6)
        if name in own.LINEAR:
            assert_allclose(one.value.standard_uncertainty, np.sqrt(whole[0, 0]), rtol=1e-6)
            assert_allclose(one.value.outside, np.sqrt(beside[0, 0]), rtol=1e-6)
            continue
        # Standard errors of means and standard deviations, of the package's draws and as many here.
        count = 500 if name.startswith("roundness") else 10_000
        errors = own.drawn_values(name, whole, own.expected(name), count, np.random.default_rng(k))
        u, scatter = one.value.standard_uncertainty, np.sqrt(2 / count)
        assert abs(one.value.shift - errors.mean()) < 4 * scatter * u, name
        assert abs(u / errors.std() - 1) < 4 * scatter, name


@pytest.mark.parametrize("name", MACHINES)
def test_uncertainties_by_a_design(name: str, tmp_path: Path) -> None:
    experiment, plan = campaign(name)
    places = MACHINES[name][1]
    found = bp.part(part_file(tmp_path, places), experiment)
    judge(found, places, own.outside(plan, places), own.by_map(plan, 1.0, places))


@pytest.mark.parametrize("dimension", OF_PLANES)
def test_what_all_points_of_a_plane_share_is_no_share_of_its_orientation(
    dimension: str, tmp_path: Path
) -> None:
    experiment, plan = campaign("bridge")
    found = bp.part(part_file(tmp_path, own.BRIDGE, names=[dimension]), experiment)
    beside = of_members(dimension, 0, own.outside(plan, own.BRIDGE))
    map_ = of_members(dimension, 0, own.by_map(plan, 1.0, own.BRIDGE))
    middle = np.eye(len(map_)) - 1 / len(map_)
    share = np.trace(middle @ map_) / np.trace(middle @ (beside + map_))
    assert_allclose(found.dimensions[0].value.share, share, rtol=1e-4)


@pytest.mark.parametrize("name", MACHINES)
def test_uncertainties_by_a_map(name: str, tmp_path: Path) -> None:
    fit, _, fitted, sigma = measured(name)
    places = MACHINES[name][1]
    assert_allclose(fit.sigma, sigma, rtol=1e-6)
    found = bp.part(part_file(tmp_path, places), fitted=fit)
    # Points are touched where they are nominally, by the stated offsets.
    judge(found, places, own.outside(fitted, places), own.by_map(fitted, sigma, places))


@pytest.mark.parametrize("celsius", [20.0, 23.0])
@pytest.mark.parametrize("coordinates", ["scale readings", "tip centres"])
@pytest.mark.parametrize("name", MACHINES)
def test_dimensions_by_readings(
    name: str, coordinates: str, celsius: float, tmp_path: Path
) -> None:
    fit, truth, fitted, _ = measured(name)
    places, names = MACHINES[name][1], list(truth.design.probes.names)
    rng = np.random.default_rng(4)
    rows, expected = [], {}
    for place, where in places.items():
        rotation, origin = own.placed(where)
        set_up = Rotation.from_rotvec(1e-3 * rng.normal(size=3)).as_matrix() @ rotation
        probes = np.array([names.index(one) for one in own.probes_of(place)])
        bent = own.POINTS + 5e-6 * rng.normal(size=(len(own.POINTS), 1)) * own.NORMALS
        ratio = 1 + own.STRAIN * (celsius - 20)
        tips = (ratio * bent + own.DIAMETER / 2 * own.NORMALS) @ set_up.T + origin
        tips += 1e-3 * rng.normal(size=3)
        x = truth.machine.readings(tips, truth.a, truth.offsets[probes])
        corrected = fitted.corrected(np.zeros(sum(fitted.sizes)), x, probes)
        # The tip does not grow with the part.
        smaller = own.DIAMETER / 2 * (1 - 1 / ratio) * own.NORMALS
        expected[place] = own.dimensions(own.aligned(own.aligned(corrected / ratio) + smaller))
        shown = x + (coordinates == "tip centres") * truth.design.probes.offsets[probes]
        rows += own.rows_of(place, 1e3 * shown)
    table = pandas.DataFrame(rows, columns=["place", "feature", "point", "x_mm", "y_mm", "z_mm"])
    found = bp.part(
        part_file(tmp_path, places, celsius=celsius),
        fitted=fit,
        readings=table,
        coordinates=coordinates,
    )
    for one in found.dimensions:
        assert abs(one.measured - expected[one.place][one.dimension.name]) < 1e-9, one.name


def test_short_waves_are_a_gaussian_process_of_each_axis(tmp_path: Path) -> None:
    waves = "short_waves: {amplitude: 0.3 um, correlation_length: 10 mm}"
    experiment, plan = campaign("bridge")
    path = part_file(tmp_path, own.BRIDGE, waves=waves)
    found = bp.part(path, experiment)
    x, _, normals = own.laid(plan, own.BRIDGE)
    apart = np.exp(-(((x[:, None] - x) / 0.01) ** 2) / 2).sum(axis=2)
    process = (0.3e-6) ** 2 * (normals @ normals.T) * apart
    root = found.laid.outside.toarray()
    expected = own.outside(plan, own.BRIDGE) + process
    assert_allclose(root @ root.T, expected, rtol=1e-6, atol=1e-6 * process.max())
    judge(found, own.BRIDGE, expected, own.by_map(plan, 1.0, own.BRIDGE))
