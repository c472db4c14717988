"""Predicted uncertainties of a part against simulated campaigns, parts at their limits, and fits to
drawn machines.
"""

from __future__ import annotations

from functools import cache, partial
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.parts.measured_parts import with_readings
from scipy.spatial.transform import Rotation

from tests.extensions.parts import reference as own

# A probing so good that the campaign is a good part of the uncertainty.
PRECISE = {"point": "0.1 um", "tip": "0.05 um", "form": "0.1 um", "kelvin": 0.05, "celsius": 20.0}
MACHINES: dict[str, tuple[Any, Any]] = {
    "quickstart": (own.quick, own.QUICK),
    "bridge": (own.bridge, own.BRIDGE),
    "fixed bridge": (lambda: own.bridge("FB1", (5, 3)), own.BRIDGE),
    "horizontal arm": (lambda: own.bridge("MH1", (3, 4)), own.BRIDGE),
    "column": (lambda: own.bridge("CX1", (4, 3)), own.BRIDGE),
}
# Errors: standard ones of a mean and a standard deviation, of more than a hundred comparisons.
WITHIN = 4.0


@cache
def planned(name: str) -> tuple[Any, own.Campaign]:
    told = MACHINES[name][0]()
    experiment = bp.experiment(told)
    return experiment, own.planned(bp.lay_out(experiment), own.machine_of(told))


def part_file(folder: Path, places: Any, **changed: Any) -> Path:
    path = folder / "part.yaml"
    path.write_text(own.part_text(places, **changed), encoding="utf-8")
    return path


def judge_draws(found: Any, draws: int) -> None:
    for one in found.dimensions:
        name, u = one.dimension.name, one.value.standard_uncertainty
        others = 500 if name.startswith("roundness") else 10_000
        linear = name in own.LINEAR
        scatter = np.sqrt(1 / draws + (0 if linear else 1 / others))
        assert abs(one.drawn.shift - one.value.shift) < WITHIN * scatter * u, one.name
        ratio = one.drawn.standard_uncertainty / u
        # Of ranges the fourth moment is above that of normal errors.
        excess = 1.0 if linear else 1.2
        assert abs(ratio - 1) < WITHIN * excess * scatter / np.sqrt(2), (one.name, ratio)


@pytest.mark.parametrize("name", MACHINES)
def test_linear_uncertainties_are_those_of_fits_to_drawn_machines(
    name: str, tmp_path: Path
) -> None:
    experiment, plan = planned(name)
    places = MACHINES[name][1]
    truth = own.drawn_truth(plan, np.random.default_rng(6))
    path = part_file(tmp_path, {"low": places["low"]}, **PRECISE)
    judge_draws(bp.part(path, experiment, draws=600, seed=2), 600)
    fit = bp.fit(experiment, own.table_of(truth))
    path = part_file(tmp_path, {"turned": places["turned"]}, names=list(own.TOLERANCES)[:11])
    judge_draws(bp.part(path, fitted=fit, draws=600, seed=3), 600)


def measured_errors(
    name: str, folder: Path, campaigns: int, parts: int, seed: int
) -> tuple[Any, np.ndarray]:
    """The part by the design, and errors (campaigns, parts, dimensions) of parts measured on true
    machines and corrected by the maps of campaigns on them.
    """
    experiment, plan = planned(name)
    places, rng = MACHINES[name][1], np.random.default_rng(seed)
    design = plan.design
    names = list(design.probes.names)
    found = bp.part(part_file(folder, places, **PRECISE), experiment)
    # The form that the file expects of A, as a displacement of its points.
    bow = np.zeros(len(own.POINTS))
    bow[own.OF == "A"] = own.expected("flatness A")
    errors = np.zeros((campaigns, parts, len(found.dimensions)))
    true = np.array([one.dimension.form for one in found.dimensions])
    for i in range(campaigns):
        truth = own.drawn_truth(plan, rng)
        fitted = bp.fit(experiment, own.table_of(truth), sigma="given").to_map()
        for j in range(parts):
            kelvin = 0.05 * rng.normal()
            radii = 0.05e-6 / 2 * rng.normal(size=len(names))
            lobes: dict[Any, float] = {}
            x = []
            for place, where in places.items():
                rotation, origin = own.placed(where)
                probes = np.array([names.index(one) for one in own.probes_of(place)])
                out = own.NORMALS @ rotation.T
                keys = [(p, *row) for p, row in zip(probes, out.round(6) + 0.0, strict=True)]
                lobe = [lobes.setdefault(key, rng.uniform(-1e-7, 1e-7)) for key in keys]
                beside = 1e-7 * rng.normal(size=len(out)) + radii[probes] + lobe
                surface = own.POINTS * (1 + own.STRAIN * kelvin) + bow[:, None] * own.NORMALS
                centres = surface + (own.DIAMETER / 2 + beside)[:, None] * own.NORMALS
                turned = Rotation.from_rotvec(1e-4 * rng.normal(size=3)).as_matrix() @ rotation
                tips = centres @ turned.T + origin + 1e-4 * rng.normal(size=3)
                x.append(truth.machine.readings(tips, truth.a, truth.offsets[probes]))
            told = with_readings(found, fitted, np.concatenate(x))
            errors[i, j] = [one.measured for one in told.dimensions]
    return found, errors - true


def judge_campaigns(found: Any, errors: np.ndarray, tolerance: float) -> str:
    """Errors in units of their predicted uncertainties; `tolerance` is that of the whole."""
    count = errors.shape[0]
    shift = np.array([one.value.shift for one in found.dimensions])
    u = np.array([one.value.standard_uncertainty for one in found.dimensions])
    linear = np.array([one.dimension.name in own.LINEAR for one in found.dimensions])
    normalised = (errors - shift) / u
    rms = np.sqrt((normalised**2).mean(axis=(0, 1)))
    # A part measured twice has the map in common: campaigns are counted, not parts.
    single = WITHIN * 1.2 / np.sqrt(2 * count)
    for one, ratio in zip(found.dimensions, rms, strict=True):
        assert abs(ratio - 1) < single, (one.name, ratio)
    whole = np.sqrt((normalised**2).mean(axis=(0, 1)))
    shares = [np.sqrt((whole[some] ** 2).mean()) for some in (linear, ~linear)]
    assert all(abs(one - 1) < tolerance for one in shares), shares
    inside = (np.abs(errors) < 2 * u)[..., linear].mean()
    ends = np.array([one.value.quantiles[0][::3] for one in np.array(found.dimensions)[~linear]])
    between = ((errors[..., ~linear] > ends[:, 0]) & (errors[..., ~linear] < ends[:, 1])).mean()
    # About a tenth of the deviations of 2 u follows a deviation of u by a hundredth.
    assert abs(inside - 0.9545) < 0.3 * tolerance, inside
    assert abs(between - 0.95) < 0.3 * tolerance, between
    return f"rms {shares[0]:.3f}, {shares[1]:.3f}; inside {inside:.4f}, {between:.4f}; of one {rms.min():.3f} to {rms.max():.3f}"


@pytest.mark.parametrize("name", ["quickstart", "bridge"])
def test_errors_of_measured_parts(name: str, tmp_path: Path, record_property: Any) -> None:
    found, errors = measured_errors(name, tmp_path, 20, 4, 7)
    record_property("report", judge_campaigns(found, errors, 0.1))


@pytest.mark.long
@pytest.mark.parametrize("name", ["quickstart", "bridge"])
def test_errors_of_parts_of_two_hundred_campaigns(
    name: str, tmp_path: Path, record_property: Any
) -> None:
    found, errors = measured_errors(name, tmp_path, 200, 4, 8)
    record_property("report", judge_campaigns(found, errors, 0.05))


def shapes_at_limit(name: str, rng: np.random.Generator) -> list[np.ndarray]:
    """Deviations of the members of a zone whose value is one."""
    if name.startswith("position"):
        count = 3 if name.endswith("ball") else 2
        vectors = rng.normal(size=(8, count))
        found = [vectors if name.endswith("ball") else np.tile(vectors, 2)]
        if count == 2:
            found.append(np.concatenate([vectors, vectors * rng.uniform(-1, 1, (8, 1))], axis=1))
    else:
        feature = name.removeprefix(name.split()[0] + " ")
        some, points = feature == own.OF, own.SURFACE[feature][0]
        n = len(points)
        away = (points - points.mean(axis=0)) / np.ptp(points)
        moved = [rng.normal(size=(6, n)), np.eye(n)]
        moved += [((away @ rng.normal(size=(3, 4))) ** 2).T, (away @ rng.normal(size=(3, 4))).T]
        found = [np.concatenate(moved) @ own.slopes()[name][:, some].T]
    members = np.concatenate(found)
    sizes = (own.zones if name.startswith("roundness") else partial(own.values, name))(members)
    # What only rounding makes of a value is no shape.
    kept = sizes > 1e-3 * np.abs(members).max()
    return list(members[kept] / sizes[kept, None])


def decided(found: Any, covariance: np.ndarray, name: str) -> tuple[float, float]:
    """Largest frequencies with which a dimension at its limit is accepted, and rejected, by the
    covariance of displacements along normals.
    """
    covariance = own.slopes()[name] @ covariance @ own.slopes()[name].T
    (one,) = [one for one in found.dimensions if one.dimension.name == name]
    (_, upper), rng = one.dimension.tolerance, np.random.default_rng(9)
    sizes, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(sizes, 0.0))
    errors = rng.standard_normal((20_000, len(root))) @ root.T
    if name in own.LINEAR:
        measured = [upper + errors[:, 0]]
    else:
        value = own.zones if name.startswith("roundness") else partial(own.values, name)
        measured = [value(upper * shape + errors) for shape in shapes_at_limit(name, rng)]
    return (
        max(float((one_ <= one.accepted[1]).mean()) for one_ in measured),
        max(float((one_ > one.rejected[1]).mean()) for one_ in measured),
    )


TOLERATED = [name for name, text in own.TOLERANCES.items() if "tolerance" in text]
# Errors of a quantile of ten thousand draws, and of the largest of several frequencies here.
CHANCE = 0.05 + 4 * np.sqrt(0.05 * 0.95 * (1 / 10_000 + 1 / 20_000))


@cache
def part_at_limits(folder: Path) -> tuple[Any, np.ndarray]:
    experiment, plan = planned("bridge")
    places = {"low": own.BRIDGE["low"]}
    whole = own.outside(plan, places) + own.by_map(plan, 1.0, places)
    return bp.part(part_file(folder, places), experiment), whole


@pytest.mark.parametrize("name", TOLERATED)
def test_parts_at_their_limits_are_rarely_accepted(
    name: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    assert decided(*part_at_limits(tmp_path_factory.getbasetemp()), name)[0] < CHANCE


@pytest.mark.parametrize("name", TOLERATED)
def test_parts_at_their_limits_are_rarely_rejected(
    name: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    assert decided(*part_at_limits(tmp_path_factory.getbasetemp()), name)[1] < CHANCE


@pytest.mark.parametrize("name", ["cylindricity bore 2", "perpendicularity B"])
def test_expected_deviations_are_of_their_size(name: str, tmp_path: Path) -> None:
    path = part_file(tmp_path, {"low": own.QUICK["low"]}, names=[name])
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("tolerance: ", "nominal: 3 um, tolerance: "), encoding="utf-8")
    found = bp.part(path, planned("quickstart")[0], draws=400)
    (one,) = found.laid.dimensions
    assert np.abs(one.bow).max() < 10.0
    judge_draws(found, 400)
