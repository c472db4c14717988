"""Errors and curves of fitted maps, against formulas written out and finite differences."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pandas as pd
import pytest
import yaml
from ballplate.cli import main
from ballplate.extensions.machine_files.fitted_map import FittedMap
from ballplate.extensions.maps.error_functions import error_functions
from ballplate.extensions.maps.fitted_errors import fitted_lengths
from ballplate.extensions.maps.map_places import PlacesAsked, map_places
from ballplate.results.fits import Fit
from ballplate.simulator.estimation.gauss_newton import estimate, linearised_fit
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.readings.simulated import simulated_readings
from numpy.polynomial.chebyshev import cheb2poly, chebvander
from numpy.polynomial.legendre import poly2leg
from numpy.typing import NDArray

from tests.extensions.machine_files import kinds
from tests.extensions.maps import wording
from tests.reference import dense

TOP = Path(__file__).parents[3]
Real = NDArray[np.float64]


def small(**changed: Any) -> Experiment:
    """Nine balls in the six positions of the first example, with a volume that is no cube."""
    told = yaml.safe_load((TOP / "designs" / "quickstart.yaml").read_text(encoding="utf-8"))
    told["machine"]["volume"] = {
        "x": ["-100 mm", "1 m"],
        "y": ["0 m", "1.1 m"],
        "z": ["0 m", "1 m"],
    }
    told["artefacts"] = {"plate": {"kind": "grid", "balls": [3, 3], "size": ["750 mm", "750 mm"]}}
    told["error_model"] |= {"position_coefficients": 4, "rotation_coefficients": 3}
    told["evaluation"] = {"points": {"random": 12, "seed": 3}, "probe": "right"}
    told["sigma"] = "given"
    return bp.experiment(told | changed)


@pytest.fixture(scope="module")
def fit() -> Fit:
    experiment = small()
    return bp.fit(experiment, bp.simulate(experiment, seed=6))


@pytest.fixture(scope="module")
def fitted(fit: Fit) -> FittedMap:
    return fit.to_map()


def by_hand(fitted: FittedMap, x: Real, a: Real, p: Real) -> Real:
    """The errors at x (m, 3), by the formulas of the dense reference, whose polynomials are
    Legendre's.
    """
    functions, start, legendre = dense.error_functions(4, 3), 0, []
    for function in functions:
        own = a[start : start + function.free]
        found = poly2leg(cheb2poly(own))
        legendre.append(np.append(found, np.zeros(len(own) - len(found))))
        start += function.free
    probes = np.tile(p, (len(x), 1))
    lower, upper = fitted.volume.lower, fitted.volume.upper
    own = np.concatenate(legendre)
    return np.asarray(dense.machine_error(functions, lower, upper, x, own, probes) - probes)


def slopes(fitted: FittedMap, function: Any) -> Real:
    """Derivatives (..., n) of a function of a, by differences: it is linear."""
    own = np.eye(len(fitted.values))
    return np.stack([function(one) - function(0.0 * one) for one in own], axis=-1)


def test_errors_and_lengths_are_those_of_the_formulas(fitted: FittedMap) -> None:
    found = bp.map(fitted, grid=(3, 2, 4), probe="back")
    points = np.array(list(product((-0.1, 0.45, 1.0), (0.0, 1.1), np.linspace(0.0, 1.0, 4))))
    assert np.abs(found.errors.points - points).max() < 1e-15
    p = fitted.probes.offsets[fitted.probes.names.index("back")]
    values = by_hand(fitted, points, fitted.values, p)
    assert np.abs(found.errors.errors - values).max() < 1e-15
    rows = slopes(fitted, lambda a: by_hand(fitted, points, a, p))
    u = np.sqrt(np.einsum("mdi,ij,mdj->md", rows, fitted.covariance, rows))
    assert found.errors.uncertainties == pytest.approx(u, rel=1e-9, abs=1e-15)
    # Four ways through the volume, true lengths less those that the scales say.
    for k, (start, end) in enumerate(
        [
            ((-0.1, 0.0, 0.0), (1.0, 1.1, 1.0)),
            ((1.0, 0.0, 0.0), (-0.1, 1.1, 1.0)),
            ((-0.1, 1.1, 0.0), (1.0, 0.0, 1.0)),
            ((-0.1, 0.0, 1.0), (1.0, 1.1, 0.0)),
        ]
    ):
        ends = np.array([start, end])

        def length(a: Real, ends: Real = ends) -> float:
            moved = ends + by_hand(fitted, ends, a, p)
            return float(np.linalg.norm(moved[1] - moved[0]) - np.linalg.norm(np.ptp(ends, axis=0)))

        steps = 1e-6 * np.eye(len(fitted.values))
        row = np.array([(length(one) - length(-one)) / 2e-6 for one in steps])
        u_length = np.sqrt(row @ fitted.covariance @ row)
        assert found.lengths.errors[k] == pytest.approx(length(fitted.values), abs=2e-15)
        assert found.lengths.uncertainties[k] == pytest.approx(u_length, rel=1e-6)


def test_a_line_a_plane_and_points_are_places_of_the_same_map(fitted: FittedMap) -> None:
    line = bp.map(fitted, line="y = 300 mm, z = 200 mm", points=3)
    expected = np.array([[-0.1, 0.3, 0.2], [0.45, 0.3, 0.2], [1.0, 0.3, 0.2]])
    assert line.errors.points == pytest.approx(expected)
    plane = bp.map(fitted, plane="y = 300 mm", grid=(3, 6))
    assert plane.errors.points.shape == (18, 3) and set(plane.errors.points[:, 1]) == {0.3}
    table = pd.DataFrame(line.errors.points, columns=["x_m", "y_m", "z_m"])
    table["probe"] = ["right", "down", "right"]
    table["name"] = ["left end", "middle, low", "right end"]
    given = bp.map(fitted, points=table)
    right, down = (
        bp.map(fitted, points=line.errors.points, probe=name) for name in ("right", "down")
    )
    assert [row["probe"] for row in given.rows()] == ["right", "down", "right"]
    assert [one["probe"] for one in given.to_dict()["points"]] == ["right", "down", "right"]
    assert (given.errors.errors[::2] == right.errors.errors[::2]).all()
    assert (given.errors.uncertainties[1] == down.errors.uncertainties[1]).all()
    assert (down.errors.errors[1] != right.errors.errors[1]).any()
    assert (line.errors.errors == right.errors.errors).all()
    inside = np.flatnonzero(np.isclose(plane.errors.points, [0.45, 0.3, 0.2]).all(axis=1))
    assert plane.errors.errors[inside[0]] == pytest.approx(line.errors.errors[1], abs=1e-20)
    csv = list(given.point_lines())
    assert csv[0].startswith("point,probe,x_mm") and csv[2].startswith(
        '"middle, low",down,450,300,200,'
    )
    assert [row["point"] for row in given.rows()] == table["name"].tolist()


def test_undetermined_offsets_are_no_errors_of_the_machine() -> None:
    """With the offset of a probe estimated, an error has the uncertainty of what rotations make of
    it alone: that of the stated formula, by differences in the parameters and in the offset.
    """
    told = yaml.safe_load((TOP / "designs" / "quickstart.yaml").read_text(encoding="utf-8"))
    right = {"offset": told["probes"]["right"], "standard_uncertainty": "5 um"}
    experiment = small(probes=told["probes"] | {"right": right})
    fitted = bp.fit(experiment, bp.simulate(experiment, seed=6)).to_map()
    found = bp.map(fitted, points=[[0.9, 0.8, 0.7]])
    ends = np.concatenate([found.lengths.starts, found.lengths.ends])
    pairs = [(k, 4 + k) for k in range(4)]
    corrected = bp.correct(fitted, ends, "right", pairs)
    covariance = corrected.covariance().reshape(8, 3, 8, 3)
    for k, (start, end) in enumerate(pairs):
        one = corrected.lengths[k]
        assert found.lengths.errors[k] == pytest.approx(one.value - one.read, abs=1e-14)
        # Along the line between the scale readings, which the errors turn by some 10 µrad.
        way = (ends[end] - ends[start]) / found.lengths.nominal[k]
        moving = np.zeros((8, 3))
        moving[start], moving[end] = -way, way
        u = np.sqrt(np.einsum("ai,aibj,bj->", moving, covariance, moving))
        assert found.lengths.uncertainties[k] == pytest.approx(u, rel=1e-9)
    n = len(fitted.values)
    p = fitted.probes.offsets[fitted.probes.names.index("right")]
    assert len(fitted.scale) == n + 3 and fitted.probe == "right"

    def error(b: Real) -> Real:
        return by_hand(fitted, found.errors.points, fitted.values + b[:n], p + b[n:])[0]

    steps = np.concatenate([np.full(n, 1e-3), np.full(3, 0.1)])
    rows = np.stack([(error(s) - error(-s)) / (2.0 * s.max()) for s in np.diag(steps)], axis=-1)
    u = np.sqrt(np.einsum("di,ij,dj->d", rows, fitted.covariance, rows))
    assert found.errors.uncertainties[0] == pytest.approx(u, rel=1e-6)
    assert u.max() < 1e-6


def test_realisations_scatter_as_stated(fitted: FittedMap) -> None:
    found = bp.map(fitted, grid=(2, 2, 2), draw=1000, seed=8)
    again = bp.map(fitted, grid=(2, 2, 2), draw=1000, seed=8)
    other = bp.map(fitted, grid=(2, 2, 2), draw=1000, seed=9)
    assert found.realisations and again.realisations and other.realisations
    assert (found.realisations.errors == again.realisations.errors).all()
    assert (found.realisations.errors[0] != other.realisations.errors[0]).any()
    u = found.errors.uncertainties
    apart = found.realisations.errors - found.errors.errors
    known = u > 0.0
    # 1000 draws know a standard deviation to 2.2 %, a mean to 3.2 % of it.
    assert np.abs(apart.std(axis=0)[known] / u[known] - 1.0).max() < 0.12
    assert np.abs(apart.mean(axis=0)[known] / u[known]).max() < 0.17
    assert (apart[:, ~known] == 0.0).all()
    lengths = found.realisations.lengths - found.lengths.errors
    assert lengths.std(axis=0) == pytest.approx(found.lengths.uncertainties, rel=0.12)
    # A length of a realisation is that of the same machine as its points.
    start, end = (
        int(np.flatnonzero((found.errors.points == one[0]).all(axis=1))[0])
        for one in (found.lengths.starts, found.lengths.ends)
    )
    way = (found.lengths.ends[0] - found.lengths.starts[0]) / found.lengths.nominal[0]
    moved = (apart[:, end] - apart[:, start]) @ way
    assert lengths[:, 0] == pytest.approx(moved, abs=1e-12)


def test_curves_are_the_functions_with_their_bands(fit: Fit, fitted: FittedMap) -> None:
    """Each function from the estimates that the fit reports and their covariance, in the basis as
    it is documented: t T(2t - 1), or t (1 - t) T(2t - 1) where both ends are held.
    """
    found = bp.curves(fitted, points=9)
    covariance = fit.covariance("machine")
    estimates = {one.name: one.value for one in fit.estimates}
    curves = {one.name: one for one in found.functions.curves}
    assert len(curves) == 18
    t = np.linspace(0.0, 1.0, 9)
    for function in dense.error_functions(4, 3):
        one = curves[function.name]
        basis = t[:, None] * chebvander(2.0 * t - 1.0, function.free - 1)
        if function.zero_at_one:
            basis *= 1.0 - t[:, None]
        names = [f"{function.name}[{k + 1}]" for k in range(function.free)]
        values = basis @ [estimates[name] for name in names]
        u = np.sqrt(np.einsum("mi,ij,mj->m", basis, covariance.loc[names, names], basis))
        assert one.values == pytest.approx(values, abs=1e-18)
        assert one.uncertainties == pytest.approx(u, rel=1e-9, abs=1e-16)
        low, high = (-0.1, 0.0, 0.0), (1.0, 1.1, 1.0)
        axis = function.axis
        assert one.positions == pytest.approx(np.linspace(low[axis], high[axis], 9))
        assert one.unit == ("rad" if function.turns else "m")
    single = bp.curves(fitted, "EXX")
    assert [one.name for one in single.functions.curves] == ["EXX"]
    rows = [row for row in found.rows() if row["error"] == "EXX"]
    assert [row["U"] for row in rows] == pytest.approx(2.0 * curves["EXX"].uncertainties)


def test_squareness_is_the_same_angle_in_both_forms_of_the_model() -> None:
    """The 21-parameter form has the angles as parameters, the other form the ends of edges."""
    told = yaml.safe_load((TOP / "designs" / "quickstart.yaml").read_text(encoding="utf-8"))
    model = told["error_model"] | {"position_coefficients": 4, "rotation_coefficients": 3}
    plain = small()
    readings = bp.simulate(plain, seed=6)
    angles = []
    for form in ("straightness", "parameters"):
        experiment = small(error_model=model | {"squareness": form})
        found = bp.curves(bp.fit(experiment, readings).to_map()).functions.squareness
        assert [one.name for one in found] == ["EC0Y", "EB0Z", "EA0Z"]
        angles.append(np.array([(one.value, one.standard_uncertainty) for one in found]))
    assert angles[0] == pytest.approx(angles[1], rel=1e-5)
    assert np.abs(angles[0][:, 0]).min() > 1e-8


QUICK = ("metric", "table", "deficient", "estimated probe", "plane")
KINDS = [
    pytest.param(kind, marks=[] if kind in QUICK else [pytest.mark.long]) for kind in kinds.MODELS
]


@pytest.mark.parametrize("kind", KINDS)
def test_every_model_has_errors_and_curves(kind: str, tmp_path: Path) -> None:
    """Errors are what `Fit.correct` adds to readings, but for the offset of the probe. The
    squareness of a plane's metric is -alpha, that of the spatial metric its parameter.
    """
    kinds.write_files(tmp_path)
    fit = kinds.fit_of(kind, tmp_path)
    fitted = fit.to_map()
    volume = fitted.volume
    draw = np.random.default_rng(5).random((6, fitted.dimension))
    points = volume.lower + volume.size * draw
    found, given = bp.map(fitted, points=points, draw=2), fit.correct(points)
    offset = fitted.probes.offsets[fitted.probes.names.index(fitted.probe)]
    u = given.standard_uncertainties
    if not fitted.probes.free.any():
        assert found.errors.uncertainties == pytest.approx(u, rel=1e-6, nan_ok=True)
    expected = np.where(np.isnan(u), np.nan, given.points - points - offset)
    assert found.errors.errors == pytest.approx(expected, abs=1e-15, nan_ok=True)
    curves = bp.curves(fitted, points=5)
    own = dict(zip([one.name for one in fitted.model.parameters], fitted.values, strict=True))
    angles = {one.name: one.value for one in curves.functions.squareness}
    for name, value in own.items():
        if name == "alpha":
            assert angles["EC0Y"] == pytest.approx(-value, rel=1e-4)
        if name in ("C0Y", "B0Z", "A0Z") and not np.isnan(angles[f"E{name}"]):
            assert angles[f"E{name}"] == pytest.approx(value, rel=1e-4)
    reported = {one.function for one in fitted.model.parameters}
    functions = curves.functions
    told = {one.name for one in (*functions.curves, *functions.squareness, *functions.numbers)}
    assert reported <= told | {one.function for one in fitted.model.parameters if one.name in told}
    for result in (found, curves):
        assert "NaN" not in json.dumps(result.to_dict()) and str(result) and result.rows()
    if not np.isnan(found.errors.resultant).all():
        assert found.plot() is not None


def undetermined() -> FittedMap:
    """A plate in two positions, which leave most rotations open."""
    told = yaml.safe_load((TOP / "designs" / "quickstart.yaml").read_text(encoding="utf-8"))
    experiment = small(positions=told["positions"][:3])
    return bp.fit(experiment, bp.simulate(experiment)).to_map()


def test_what_is_undetermined_is_said_everywhere(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fitted = undetermined()
    assert fitted.undetermined.shape[1] > 0
    found = bp.curves(fitted)
    open_ = [one for one in found.functions.curves if np.isnan(one.uncertainties).any()]
    assert open_ and any(one.is_undetermined for one in open_)
    # The covariance and the null directions themselves say which functions are open.
    for one in found.functions.curves:
        columns = [k for k, p in enumerate(fitted.model.parameters) if p.function == one.name]
        moved = np.abs(fitted.undetermined[columns] / fitted.scale[columns, None]).max(initial=0.0)
        assert (moved > 1e-6) == bool(np.isnan(one.uncertainties).any()), one.name
    path = tmp_path / "map.yaml"
    bp.write_map(fitted, path)
    assert main(["map", "--curves", str(path)]) == 0
    printed, told = capsys.readouterr()
    name = next(one.name for one in open_ if one.is_undetermined)
    line = next(line for line in printed.splitlines() if line.startswith(f"{name} "))
    assert "undetermined" in line and wording.UNDETERMINED_WHAT_THESE_CHANGE in told
    assert main(["map", "--curves", str(path), "--format", "csv", "--error", name]) == 0
    rows = capsys.readouterr().out.splitlines()[1:]
    # Zero where the frame holds it, and otherwise empty.
    assert {tuple(row.split(",")[3:5]) for row in rows} <= {("", ""), ("0", "0")} and len(
        rows
    ) == 41
    whole = bp.map(fitted)
    assert np.isnan(whole.errors.errors).any() and "undetermined" in str(whole)
    assert (np.isnan(whole.errors.errors) == np.isnan(whole.errors.uncertainties)).all()
    data = json.dumps(whole.to_dict())
    assert "NaN" not in data and "null" in data
    assert whole.plot() is not None


def test_commands_print_what_results_say(
    fitted: FittedMap, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "map.yaml"
    bp.write_map(fitted, path)
    given = [str(path), "--plane", "z = 200 mm", "--grid", "2,3", "--probe", "back", "--draw", "2"]
    assert main(["map", *given, "--seed", "4", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    found = bp.map(path, (2, 3), plane={"z": 0.2}, probe="back", draw=2, seed=4)
    assert printed == found.to_dict()
    assert "correction" in printed["convention"] and printed["coverage_factor"] == 2.0
    assert main(["map", "--curves", str(path), "--error", "EXX"]) == 0
    assert capsys.readouterr().out == "\n".join([*bp.curves(path, "EXX").lines(), ""])
    assert "<table" in bp.curves(path)._repr_html_() and "<table" in found._repr_html_()


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--probe", "dwn"], 'no probe "dwn"; did you mean "down"'),
        (["--plane", "z = 200 mm", "--grid", "2,2,2"], "a plane has points along two axes"),
        (["--seed", "3"], "--seed needs --draw"),
        (["--budget"], "a budget is made of a machine file alone"),
    ],
)
def test_what_does_not_go_together_is_refused(
    options: list[str],
    told: str,
    fitted: FittedMap,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    bp.write_map(fitted, tmp_path / "map.yaml")
    assert main(["map", str(tmp_path / "map.yaml"), *options]) == 2
    assert told in capsys.readouterr().err


def test_a_machine_file_has_no_map_and_no_probe(capsys: pytest.CaptureFixture[str]) -> None:
    machine = str(TOP / "designs/park/machines/npl-like.yaml")
    assert main(["map", machine, "--probe", "down"]) == 2
    assert wording.A_MACHINE_FILE_STATES_ITS_OWN in capsys.readouterr().err
    gantry = str(TOP / "designs/park/machines/gec-like.yaml")
    assert main(["map", gantry, "--draw", "2"]) == 2
    assert "no random part" in capsys.readouterr().err


def covered(fitted: FittedMap, experiment: Experiment, campaigns: int) -> list[Real]:
    """For so many campaigns, artefacts that differ from their certificates among what is drawn,
    whether the truth is within U, k = 2: of curves (campaigns, functions, positions), of the
    diagonals' errors, of squareness errors.
    """
    truth = simulated_readings(experiment, exact=True).truth.a
    inside: list[list[Any]] = [[], [], []]
    of_truth = replace(fitted, values=truth)
    for seed in range(1, campaigns + 1):
        drawn = simulated_readings(experiment, seed)
        at = linearised_fit(drawn.design, estimate(drawn.design, drawn.x))
        root = at.shared[at.layout.model]
        own = replace(fitted, values=at.state.a, covariance=root @ root.T)
        one, other = (error_functions(each, positions=5) for each in (own, of_truth))
        inside[0].append(
            [
                np.abs(f.values - g.values) <= 2.0 * f.uncertainties + 1e-18
                for f, g in zip(one.curves, other.curves, strict=True)
            ]
        )
        places = map_places(fitted.volume, PlacesAsked())
        found, true = (fitted_lengths(each, places, 0) for each in (own, of_truth))
        inside[1].append(np.abs(found.errors - true.errors) <= 2.0 * found.uncertainties)
        inside[2].append(
            [
                abs(f.value - g.value) <= 2.0 * f.standard_uncertainty
                for f, g in zip(one.squareness, other.squareness, strict=True)
            ]
        )
    return [np.array(one, float) for one in inside]


@pytest.mark.long
def test_bands_cover_the_truth_in_a_thousand_campaigns(fitted: FittedMap) -> None:
    """Pointwise: every position of every curve, every diagonal and angle by itself."""
    count = 1000
    curves, *others = covered(fitted, small(), count)
    held = np.ptp(curves, axis=0) == 0.0
    assert held.sum() == 18 + 3
    shares = [curves[:, ~held], *others]
    for found in shares:
        by_figure = found.mean(axis=0)
        print(
            f"{by_figure.size} figures, covered {by_figure.mean():.4f},"
            f" {by_figure.min():.3f} to {by_figure.max():.3f}"
        )
        # Each share is known to 0.0066; four of these for the extremes of many.
        assert np.abs(by_figure - 0.9545).max() < 4.0 * 0.0066
