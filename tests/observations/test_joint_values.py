"""Certified values that are correlated or exact, against dense computations of the definitions."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
import yaml
from ballplate.extensions.diagnosis.redundancy import reliability
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.observations.joint_values import JointValues
from ballplate.simulator.estimation.gauss_newton import estimate
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.readings.true_artefacts import true_artefacts
from numpy.typing import NDArray
from scipy.linalg import null_space
from scipy.stats import norm

from tests.reference import dense
from tests.reference.small_quickstart import small_sections

TOP = Path(__file__).parents[2]
Real = NDArray[np.float64]

BALLS = [f"r{i}c{j}" for i in (1, 2, 3) for j in (1, 2, 3)]
PAIRS = [("r1c1", "r1c3"), ("r1c1", "r3c1"), ("r3c3", "r1c3"), ("r3c3", "r3c1"), ("r1c1", "r3c3")]
QUANTITIES = ("U1", "U2", "U3", "U4", "U5", "U6")


def written(folder: Path, *calibration: dict[str, Any], **changes: Any) -> Experiment:
    """An experiment of a plate of 3 x 3 balls, in a file."""
    plate = {"kind": "grid", "balls": [3, 3], "size": ["600 mm", "600 mm"]}
    found = small_sections(12, 1, artefacts={"plate": plate}, calibration=list(calibration))
    path = folder / "e.yaml"
    path.write_text(yaml.safe_dump(found | changes))
    return load(path)[0]


def distances(**more: Any) -> dict[str, Any]:
    return {"kind": "distances", "pairs": [list(pair) for pair in PAIRS], **more}


def covariance_file(path: Path, names: list[str], covariance: Real, first: str) -> str:
    rows = [[first, *names]]
    rows += [[name, *map(repr, row.tolist())] for name, row in zip(names, covariance, strict=True)]
    path.write_text("\n".join(",".join(row) for row in rows) + "\n", encoding="utf-8")
    return path.name


def random_covariance(size: int, seed: int, rank: int | None = None) -> Real:
    """A covariance of correlated values of about 0.2 um, in square micrometres."""
    factor = np.random.default_rng(seed).standard_normal((size, rank or size))
    return np.asarray(0.01 * factor @ factor.T + (0.01 * np.eye(size) if rank is None else 0.0))


def problem(experiment: Experiment) -> dense.Problem:
    return dense.planned(lay_out(experiment), 3, 3)


def lengths(of: dense.Problem, step: dense.Values) -> dense.Values:
    """Distances of `PAIRS` where balls are moved by a step."""
    balls = dense.unpack(of, step)[0]
    ends = np.array([[BALLS.index(a), BALLS.index(b)] for a, b in PAIRS])
    return dense.length(balls[ends[:, 0]] - balls[ends[:, 1]])


def coordinates(of: dense.Problem, step: dense.Values) -> dense.Values:
    return np.asarray(dense.unpack(of, step)[0].ravel())


def stacked(of: dense.Problem, values: Any, weight: Real) -> Real:
    """Jacobian of all rows, those of the values last, each a row of `weight` (k, m) of them."""
    return dense.jacobian(
        lambda step: np.concatenate([dense.residuals(of, step), weight @ values(of, step)]),
        of.parameters,
    )


def constrained(rows: Real, exact: Real) -> dense.Spread:
    """Covariance where combinations `exact` (k, parameters) are known, in their null space."""
    free = null_space(exact, rcond=1e-10)
    inside = dense.spread(rows @ free)
    scale = np.asarray((inside.scale[:, None] * free.T).max(axis=0))
    return dense.Spread(free @ inside.root, free @ inside.null, scale, inside.singular_values)


def agree(experiment: Experiment, of: dense.Problem, spread: dense.Spread, rel: float) -> None:
    found = bp.run(experiment).to_dict()
    expected = dense.standard_uncertainties(of, spread)
    assert found["rank_deficiency"] == spread.deficiency == 0
    for symbol in QUANTITIES:
        own = found["quantities"][symbol]
        # Of balls what is exact has 1e-13 m instead of none.
        near = 1e-13 if symbol in ("U1", "U5") else 0.0
        for word, value in (
            ("maximum", expected[symbol].max()),
            ("average", expected[symbol].mean()),
        ):
            assert own[word] == pytest.approx(value, rel=rel, abs=near), (symbol, word)


def inverse_root(covariance: Real) -> Real:
    """Rows that make a covariance the unit matrix; Cholesky."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))


@pytest.fixture
def correlated(tmp_path: Path) -> tuple[Experiment, Real]:
    covariance = random_covariance(len(PAIRS), 3)
    names = [f"{b} {a}" for a, b in PAIRS]
    order = np.random.default_rng(5).permutation(len(PAIRS))
    file = covariance_file(
        tmp_path / "c.csv",
        [names[k] for k in order],
        covariance[np.ix_(order, order)],
        "covariance_um2",
    )
    return written(tmp_path, distances(covariance=file)), 1e-12 * covariance


def test_correlated_distances_are_those_of_a_dense_computation(
    correlated: tuple[Experiment, Real],
) -> None:
    experiment, covariance = correlated
    of = problem(experiment)
    agree(experiment, of, dense.spread(stacked(of, lengths, inverse_root(covariance))), 1e-9)


def test_a_correlation_is_a_covariance(correlated: tuple[Experiment, Real], tmp_path: Path) -> None:
    experiment, covariance = correlated
    size = np.sqrt(np.diag(covariance))
    names = [" ".join(pair) for pair in PAIRS]
    file = covariance_file(
        tmp_path / "r.csv", names, covariance / np.outer(size, size), "correlation"
    )
    rows = ["ball_1,ball_2,distance_mm,expanded_uncertainty_um,k"]
    true = lengths(problem(experiment), np.zeros(problem(experiment).parameters))
    rows += [
        f"{a},{b},{1e3 * value!r},{2.5e6 * u!r},2.5"
        for (a, b), value, u in zip(PAIRS, true.tolist(), size.tolist(), strict=True)
    ]
    (tmp_path / "v.csv").write_text("\n".join(rows), encoding="utf-8")
    other = written(tmp_path, distances(covariance=file, values="v.csv"))
    of = problem(other)
    agree(other, of, dense.spread(stacked(of, lengths, inverse_root(covariance))), 1e-9)


@pytest.mark.parametrize("kind", ["distances", "coordinates"])
@pytest.mark.parametrize("part", [{"common": "0.1 um + 0.5 um/m"}, {"correlation": 0.9}])
def test_a_part_in_common_is_that_covariance(
    tmp_path: Path, kind: str, part: dict[str, Any]
) -> None:
    item = {"standard_uncertainty": "0.2 um", **part}
    item = distances(**item) if kind == "distances" else {"kind": kind, **item}
    of = problem(written(tmp_path, item))
    values = lengths if kind == "distances" else coordinates
    at = values(of, np.zeros(of.parameters))
    constant = 1e-7 if "+" in str(part.get("common")) else 0.0
    shared = constant + 0.5e-6 * at
    own, share = 4e-14 * np.ones(len(at)), np.outer(shared, shared)
    if "correlation" in part:
        own, share = 0.1 * own, 0.9 * np.full((len(at), len(at)), 4e-14)
    covariance = np.diag(own) + share
    spread = dense.spread(stacked(of, values, inverse_root(covariance)))
    agree(written(tmp_path, item), of, spread, 1e-9)


@pytest.mark.parametrize(
    ("item", "fault"),
    [
        (distances(standard_uncertainty="1 um", common="1 um/m", correlation=0.5), "correlation"),
        (distances(standard_uncertainty="1 um", correlation=1), "correlation"),
        (distances(standard_uncertainty="1 um", common="-1 um/m"), "common"),
        (distances(common="1 um/m"), "standard_uncertainty"),
    ],
)
def test_a_wrong_part_in_common_is_refused(
    tmp_path: Path, item: dict[str, Any], fault: str
) -> None:
    with pytest.raises(bp.ExperimentError, match=rf"calibration\[0\]\.{fault}:"):
        written(tmp_path, item)


def test_a_constant_part_in_common_of_coordinates_has_no_step(tmp_path: Path) -> None:
    """A frame moved by a nanometre, across or beside the balls' own axes, changes nothing."""
    item = {"kind": "coordinates", "standard_uncertainty": "0.2 um", "common": "0.3 um"}

    def average(offset: float) -> float:
        balls = {
            name: [f"{300 * j - 300 + offset} mm", f"{300 * i - 300 + offset} mm", f"{offset} mm"]
            for i in range(3)
            for j in range(3)
            for name in [f"r{i + 1}c{j + 1}"]
        }
        plate = {"kind": "balls", "coordinates": balls}
        run = bp.run(written(tmp_path, item, artefacts={"plate": plate}))
        return run.quantities["U5"].average

    at = average(0.0)
    assert average(1e-6) == pytest.approx(at, rel=1e-6)
    assert average(-1e-6) == pytest.approx(at, rel=1e-6)


def equal_correlations(folder: Path, entry: str, one: str = "1") -> Experiment:
    """All 36 distances of nine balls, correlated by the text of an entry."""
    names = [f"{a} {b}" for k, a in enumerate(BALLS) for b in BALLS[k + 1 :]]
    rows = [["correlation", *names]]
    rows += [[a, *(one if a == b else entry for b in names)] for a in names]
    (folder / "r.csv").write_text("\n".join(",".join(row) for row in rows), encoding="utf-8")
    item = {"kind": "distances", "pairs": "all", "standard_uncertainty": "0.3 um"}
    return written(folder, {**item, "covariance": "r.csv"})


@pytest.mark.parametrize(("entry", "doubts"), [("0.9", 1), ("0.90", 0), ("0.9000", 0)])
def test_digits_of_a_correlation_do_not_change_it(tmp_path: Path, entry: str, doubts: int) -> None:
    stated = equal_correlations(tmp_path, entry)
    item = {"kind": "distances", "pairs": "all", "standard_uncertainty": "0.3 um"}
    expected = bp.run(written(tmp_path, {**item, "correlation": 0.9}))
    found = bp.run(stated)
    for symbol in QUANTITIES:
        own, other = found.quantities[symbol], expected.quantities[symbol]
        assert own.average == pytest.approx(other.average, rel=1e-9)
    assert sum("give more digits" in doubt for doubt in stated.doubts) == doubts


def test_a_matrix_that_rounding_made_indefinite_is_the_nearest_covariance(tmp_path: Path) -> None:
    """Five values of two causes, to two decimals: near the matrix of all digits, and said."""
    covariance = random_covariance(len(PAIRS), 4, rank=2)
    size = np.sqrt(np.diag(covariance))
    exact = covariance / np.outer(size, size)
    rounded = exact.round(2)
    assert np.linalg.eigvalsh(rounded)[0] < 0.0
    names = [" ".join(pair) for pair in PAIRS]
    file = covariance_file(tmp_path / "r.csv", names, rounded, "correlation")
    text = re.sub(r"(\.\d)(?=[,\n])", r"\g<1>0", (tmp_path / file).read_text(encoding="utf-8"))
    (tmp_path / file).write_text(text, encoding="utf-8")
    stated = written(tmp_path, distances(covariance=file, standard_uncertainty="0.2 um"))
    assert ["give more digits" in doubt for doubt in stated.doubts] == [True]
    (root,) = lay_out(stated).of(JointValues).roots
    used = (root.vectors * root.deviations**2) @ root.vectors.T
    assert np.linalg.eigvalsh(used)[0] > 1e-3
    assert np.abs(used - exact).max() < -2.0 * np.linalg.eigvalsh(rounded)[0] + 0.005


def test_simulated_artefacts_do_not_depend_on_the_choice_of_eigenvectors(tmp_path: Path) -> None:
    """Processors choose other eigenvectors of equal variances; a seed's readings stay the same."""
    item = distances(standard_uncertainty="1 um", correlation=0.9)
    design = lay_out(written(tmp_path, item))
    joint = design.of(JointValues)
    (root,) = joint.roots
    equal = root.deviations < root.deviations.max() / 2.0
    turned = root.vectors.copy()
    turned[:, equal] = turned[:, equal][:, ::-1] * [1, -1, 1, -1]
    other = design.observed(joint.given(roots=(replace(root, vectors=turned),)))  # type: ignore[arg-type]
    drawn = [true_artefacts(one, np.random.default_rng(3)) for one in (design, other)]
    assert np.abs(drawn[0] - design.balls.places).max() > 1e-7
    np.testing.assert_allclose(*drawn, rtol=0, atol=1e-15)


def test_exact_values_leave_uncertain_ones_beside_them(tmp_path: Path) -> None:
    rows = ["ball_1,ball_2,distance_mm,standard_uncertainty_um"]
    places = {name: np.array([300.0 * (k // 3), 300.0 * (k % 3)]) for k, name in enumerate(BALLS)}
    us = [0.0, 0.3, 0.0, 0.1, 0.2]
    rows += [
        f"{a},{b},{float(np.linalg.norm(places[a] - places[b]))!r},{u}"
        for (a, b), u in zip(PAIRS, us, strict=True)
    ]
    (tmp_path / "v.csv").write_text("\n".join(rows), encoding="utf-8")
    experiment = written(tmp_path, distances(values="v.csv"))
    of = problem(written(tmp_path))
    known = [k for k, u in enumerate(us) if u]
    weight = np.zeros((len(known), len(us)))
    weight[range(len(known)), known] = [1e6 / us[k] for k in known]
    exact = dense.jacobian(lambda step: lengths(of, step), of.parameters)
    exact = exact[[k for k, u in enumerate(us) if not u]]
    agree(experiment, of, constrained(stacked(of, lengths, weight), exact), 1e-9)


def singular_item(folder: Path) -> tuple[dict[str, Any], Real]:
    """All co-ordinates of a network without a frame of its own: no covariance along rigid motions."""
    names = [f"{ball} {axis}" for ball in BALLS for axis in "xyz"]
    places = np.array([[0.3 * (k // 3), 0.3 * (k % 3), 0.0] for k in range(9)])
    centred = places - places.mean(axis=0)
    motions = [np.tile(np.eye(3)[axis], 9) for axis in range(3)]
    motions += [np.cross(np.eye(3)[axis], centred).ravel() for axis in range(3)]
    inside, _ = np.linalg.qr(np.array(motions).T)
    project = np.eye(27) - inside @ inside.T
    covariance = project @ random_covariance(27, 7) @ project
    covariance = (covariance + covariance.T) / 2
    file = covariance_file(folder / "c.csv", names, covariance, "covariance_um2")
    return {"kind": "coordinates", "covariance": file}, 1e-12 * covariance


def test_a_singular_covariance_is_one_with_constraints(tmp_path: Path) -> None:
    item, covariance = singular_item(tmp_path)
    experiment = written(tmp_path, item)
    # Poses are as free as with co-ordinates of all balls.
    of = problem(written(tmp_path, {"kind": "coordinates", "standard_uncertainty": "1 m"}))
    values, vectors = np.linalg.eigh(covariance)
    assert (values < 1e-9 * values[-1]).sum() == 6
    weight = vectors[:, 6:].T / np.sqrt(values[6:])[:, None]
    exact = vectors[:, :6].T @ dense.jacobian(lambda step: coordinates(of, step), of.parameters)
    agree(experiment, of, constrained(stacked(of, coordinates, weight), exact), 1e-9)


def test_a_value_among_correlated_ones_has_the_bias_of_the_full_weight_matrix(
    correlated: tuple[Experiment, Real],
) -> None:
    """Baarda: lambda / sqrt(e' P Q P e), with the weights P and the residuals' covariance Q."""
    experiment, covariance = correlated
    of = problem(experiment)
    rows = dense.jacobian(
        lambda step: np.concatenate([dense.residuals(of, step), lengths(of, step)]), of.parameters
    )
    m = len(PAIRS)
    weights = np.eye(len(rows))
    weights[-m:, -m:] = np.linalg.inv(covariance)
    root = np.linalg.cholesky(weights).T
    q, _ = np.linalg.qr(root @ rows / np.linalg.norm(root @ rows, axis=0))
    left = root.T @ (np.eye(len(rows)) - q @ q.T) @ root
    limit = norm.isf(0.0005) + norm.isf(0.2)
    found = reliability(experiment, sigma="given").to_dict()["observations_by_name"]
    mine = {one["name"]: one for one in found if one["kind"] == "certified value"}
    assert len(mine) == m
    for k, (a, b) in enumerate(PAIRS):
        one = mine[f"distance {a} to {b}"]
        expected = limit / np.sqrt(left[k - m, k - m])
        assert one["minimal_detectable"] == pytest.approx(expected, rel=1e-4)
        share = left[k - m, k - m] / weights[k - m, k - m]
        assert one["redundancy"] == pytest.approx(share, rel=1e-6)


def test_exact_values_are_not_tested(tmp_path: Path) -> None:
    experiment = written(tmp_path, distances(standard_uncertainty="0 um"))
    found = reliability(experiment)
    kinds = {one["kind"] for one in found.to_dict()["observations_by_name"]}
    assert "distance" not in kinds and "reading" in kinds
    # As many degrees of freedom as with constraints: each is an equation.
    other = reliability(written(tmp_path, distances(standard_uncertainty="0.2 um")))
    assert found.to_dict()["degrees_of_freedom"] == other.to_dict()["degrees_of_freedom"]


def fitted(experiment: Experiment, seed: int) -> tuple[Design, Real, Any]:
    design = lay_out(experiment)
    generator = np.random.default_rng(seed)
    exact = dense.planned(design, 3, 3).scales
    assert not design.readings.repeats.max() > 1
    x = exact + 2e-7 * generator.standard_normal(exact.shape)
    return design, x, estimate(design, x)


def test_a_fit_meets_exact_values_and_minimises_the_rest(tmp_path: Path) -> None:
    experiment = written(tmp_path, distances(standard_uncertainty="0 um"))
    design, x, solution = fitted(experiment, 11)
    assert solution.status == "converged"
    bare = written(tmp_path)
    of = replace(dense.planned(lay_out(bare), 3, 3), scales=x)
    want = np.array([one for one in design.observations if one.word == "distance"][0].value)
    at = np.zeros(of.parameters)
    for _ in range(12):
        rows = dense.jacobian(lambda step, at=at: dense.residuals(of, at + step), of.parameters)
        exact = dense.jacobian(lambda step, at=at: lengths(of, at + step), of.parameters)
        off = want - lengths(of, at)
        particular = np.linalg.lstsq(exact, off, rcond=1e-12)[0]
        free = null_space(exact, rcond=1e-10)
        rest = -(dense.residuals(of, at) + rows @ particular)
        inside = rows @ free
        size = np.linalg.norm(inside, axis=0)
        at = at + particular + free @ (np.linalg.lstsq(inside / size, rest, rcond=None)[0] / size)
    expected = float((dense.residuals(of, at) ** 2).sum())
    # What rounding leaves of an exact distance, a few 1e-16 m, counts in units of 1e-13 m.
    assert solution.factor.sum_of_squares == pytest.approx(expected, abs=1e-4)
    np.testing.assert_allclose(solution.state.balls, dense.unpack(of, at)[0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(lengths(of, at), want, rtol=0, atol=1e-15)


@pytest.mark.parametrize("kind", ["correlated", "singular"])
def test_replicates_scatter_by_the_uncertainty(
    correlated: tuple[Experiment, Real], tmp_path: Path, kind: str
) -> None:
    experiment = correlated[0]
    if kind == "singular":
        experiment = written(tmp_path, singular_item(tmp_path)[0])
    found = bp.run(experiment, trials=2000).to_dict()["monte_carlo"]
    for one in found["quantities"].values():
        ratio, covered = one["spread_ratio"], one["coverage_sigma_given"]
        assert abs(ratio["value"] - 1.0) < 4.0 * ratio["standard_error"]
        assert abs(covered["value"] - 0.95) < 4.0 * covered["standard_error"]


def test_a_deficient_design_stays_so(tmp_path: Path) -> None:
    """Exact distances hide no deficiency, and make none."""
    places = yaml.safe_load((TOP / "designs" / "quickstart.yaml").read_text())["positions"]
    for how in ({"standard_uncertainty": "0 um"}, {"standard_uncertainty": "0.2 um"}):
        experiment = written(tmp_path, distances(**how), positions=places[:1])
        of = dense.planned(lay_out(experiment), 3, 3)
        found = linearise(lay_out(experiment))
        nominal = dense.planned(lay_out(written(tmp_path, positions=places[:1])), 3, 3)
        expected = dense.spread(stacked(nominal, lengths, 5e6 * np.eye(len(PAIRS)))).deficiency
        assert found.deficiency == expected > 0
        assert of.parameters == nominal.parameters


@pytest.mark.usefixtures("correlated")
def test_a_plan_weighs_them_as_run_does(tmp_path: Path) -> None:
    """What a pool offers at a price is worth what it is worth in the experiment."""
    item = distances(covariance="c.csv")
    sides = {"kind": "distances", "pairs": "corner sides", "standard_uncertainty": "0.4 um"}
    priced = item | {"name": "laser", "price": "1 h"}
    offered = written(tmp_path, sides, pool={"calibration": [priced]})
    found = bp.plan(offered, hours=20).to_dict()
    assert "laser" in str(found["chosen"])
    both = bp.run(written(tmp_path, sides, item)).to_dict()["quantities"]["U6"]["average"]
    without = bp.run(written(tmp_path, sides)).to_dict()["quantities"]["U6"]["average"]
    assert found["value"] == pytest.approx(both, rel=1e-6)
    assert both < 0.99 * without
