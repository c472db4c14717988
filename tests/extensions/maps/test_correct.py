"""Points and lengths by a map, against the error model written anew and differences of it."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import ballplate as bp
import numpy as np
import pandas
import pytest
from ballplate.cli import main
from ballplate.extensions.machine_files.fitted_map import FittedMap
from ballplate.simulator.inputs.covariances import read_matrix

from tests.extensions.machine_files.kinds import FREE, fit_of, write_files
from tests.extensions.maps import wording
from tests.reference import dense


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("correct")
    write_files(found)
    return found


@pytest.fixture(scope="module")
def fitted() -> FittedMap:
    """A map of everything: all determined, and an offset of a probe estimated."""
    probes = bp.quickstart().with_(
        {
            "probes.right": {"offset": FREE["right"]["offset"], "standard_uncertainty": "10 um"},
            "error_model.position_coefficients": 3,
            "error_model.rotation_coefficients": 3,
        }
    )
    return bp.fit(probes, bp.simulate(probes)).to_map()


def written_anew(fitted: FittedMap, b: np.ndarray, x: np.ndarray, probe: int) -> np.ndarray:
    """Corrected points by the reference's own error model, for all that the map holds."""
    functions = dense.error_functions(3, 3)
    reported = fitted.model.reported()
    n, coefficients = len(fitted.values), reported.matrix @ b[: len(fitted.values)]
    values = dict(zip(reported.names, coefficients, strict=True))
    own = []
    for one in functions:
        wanted = [
            values.get(f"{one.name} t^{k + 1}", values.get(f"{one.name} t", 0.0) if k == 0 else 0.0)
            for k in range(one.coefficients - 1)
        ]
        own.append(np.linalg.lstsq(dense.monomial_matrix(one), np.array(wanted), rcond=None)[0])
    offsets = fitted.probes.offsets.copy()
    offsets[fitted.probes.free] = b[n:]
    lower, upper = (np.array(one) for one in fitted.volume.corners)
    p = np.repeat(offsets[probe][None], len(x), axis=0)
    return x + dense.machine_error(functions, lower, upper, x, np.concatenate(own), p)


def derivatives(fitted: FittedMap, function) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Central differences of a function of what the map holds."""
    columns = []
    for k, scale in enumerate(fitted.scale):
        step = np.zeros(len(fitted.scale))
        step[k] = 1e-4 * scale
        ahead, behind = (function(fitted.estimates + sign * step) for sign in (1.0, -1.0))
        columns.append((ahead - behind) / (2.0 * step[k]))
    return np.stack(columns, axis=-1)


def test_corrected_points_and_their_covariance(fitted: FittedMap) -> None:
    x = np.random.default_rng(2).uniform(0.05, 0.95, (6, 3))
    for probe in (0, 1):
        name = fitted.probes.names[probe]
        found = bp.correct(fitted, x, name)
        right = written_anew(fitted, fitted.estimates, x, probe)
        assert np.abs(found.points - right).max() < 1e-14
        rows = derivatives(fitted, lambda b, k=probe: written_anew(fitted, b, x, k).ravel())
        covariance = rows @ fitted.covariance @ rows.T
        size = np.sqrt(np.diagonal(covariance))
        assert (np.abs(found.covariance() - covariance) < 1e-7 * np.outer(size, size)).all()
        blocks = covariance.reshape(6, 3, 6, 3)[np.arange(6), :, np.arange(6)]
        assert np.allclose(found.blocks, blocks, rtol=1e-6, atol=1e-22)
        k = found.coverage_factor
        assert np.allclose(found.expanded_uncertainties.ravel(), k * size, rtol=1e-7)
        # The correction is what is added to where the tip is by the scales.
        tip = x + fitted.drawn_offsets[probe]
        assert np.abs(tip + found.corrections - found.points).max() < 1e-15


def test_lengths_between_points_of_different_probes(fitted: FittedMap) -> None:
    x = np.array([[0.1, 0.2, 0.3], [0.8, 0.7, 0.2], [0.5, 0.1, 0.9]])
    probes = [fitted.probes.names[k] for k in (0, 1, 1)]
    found = bp.correct(fitted, x, probes, lengths=[(0, 1), (1, 2)], coverage_factor=3.0)

    def lengths(b: np.ndarray) -> np.ndarray:
        places = [written_anew(fitted, b, x[i : i + 1], k)[0] for i, k in enumerate((0, 1, 1))]
        return np.array(
            [np.linalg.norm(places[0] - places[1]), np.linalg.norm(places[1] - places[2])]
        )

    rows = derivatives(fitted, lengths)
    right = np.sqrt(np.diagonal(rows @ fitted.covariance @ rows.T))
    assert np.allclose([one.value for one in found.lengths], lengths(fitted.estimates), rtol=1e-14)
    assert np.allclose([one.standard_uncertainty for one in found.lengths], right, rtol=1e-7)
    tips = x + fitted.drawn_offsets[[0, 1, 1]]
    assert found.lengths[0].read == pytest.approx(np.linalg.norm(tips[0] - tips[1]), rel=1e-15)
    # The scatter of both readings adds to the variance.
    scattered = bp.correct(fitted, x, probes, lengths=[(0, 1)], with_repeatability=True)
    added = 2.0 * (fitted.sigma * fitted.repeatability[0]) ** 2
    variance = scattered.lengths[0].standard_uncertainty ** 2
    assert variance == pytest.approx(right[0] ** 2 + added, rel=1e-7, abs=0.0)
    assert np.allclose(
        scattered.blocks - found.blocks, 0.5 * added * np.eye(3), rtol=1e-9, atol=1e-24
    )


def test_centres_of_balls_are_taken_back_to_the_scales(fitted: FittedMap) -> None:
    x = np.array([[0.1, 0.2, 0.3], [0.8, 0.7, 0.2]])
    for name, stated in zip(fitted.probes.names, fitted.drawn_offsets, strict=True):
        centres = bp.correct(fitted, x + stated, name, coordinates="ball centres")
        assert np.abs(centres.points - bp.correct(fitted, x, name).points).max() < 1e-16 * 4


def test_what_is_undetermined_is_told(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    fit = fit_of("deficient", folder)
    bp.write_map(fit.to_map(), folder / "open.yaml")
    points = folder / "points.csv"
    points.write_text("name,x_mm,y_mm,z_mm\nA,100,200,300\nB,400,200,300\n")
    known = fit.correct([[0.1, 0.2, 0.3], [0.4, 0.2, 0.3]], "right").standard_uncertainties
    assert np.isnan(known).any() and not np.isnan(known).all()
    out = folder / "open.csv"
    status = main(
        [
            "correct",
            str(folder / "open.yaml"),
            str(points),
            "--length",
            "A",
            "B",
            "-o",
            str(out),
            "--probe",
            "right",
        ]
    )
    told = capsys.readouterr().out
    assert status == 1
    with out.open() as stream:
        rows = list(csv.DictReader(stream))
    for k, row in enumerate(rows):
        for axis, letter in enumerate("xyz"):
            u = row[f"U_{letter}_um"]
            assert (u == "") == (row[f"{letter}_mm"] == "") == bool(np.isnan(known[k, axis]))
            assert u == "" or float(u) == pytest.approx(2e6 * known[k, axis], rel=1e-9)
    assert told.count("undetermined") >= 2 * int(np.isnan(known).sum())
    assert "nan" not in told


def test_the_command_writes_what_python_gives(
    fitted: FittedMap, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bp.write_map(fitted, tmp_path / "map.yaml")
    table = pandas.DataFrame(
        {
            "name": ["A", "B", "C"],
            "probe": [fitted.probes.names[k] for k in (0, 1, 0)],
            "x_in": [4.0, 20.0, 41.0],
            "y_in": [5.0, 6.0, 7.0],
            "z_in": [8.0, 9.0, 10.0],
        }
    )
    table.to_csv(tmp_path / "points.csv", index=False)
    outputs = ["-o", str(tmp_path / "out.csv"), "--covariance", str(tmp_path / "covariance.csv")]
    arguments = ["correct", str(tmp_path / "map.yaml"), str(tmp_path / "points.csv"), *outputs]
    lengths = ["--length", "A", "C", "--length", "A", "B", "--length", "B", "C"]
    assert main([*arguments, *lengths, "--json"]) == 0
    captured = capsys.readouterr()
    data = json.loads(captured.out)
    found = bp.correct(fitted, table, lengths=[("A", "B"), ("B", "C"), ("A", "C")])
    x = 0.0254 * table[["x_in", "y_in", "z_in"]].to_numpy()
    assert np.allclose(found.points, bp.correct(fitted, x, list(table["probe"])).points, rtol=1e-15)
    assert [one["name"] for one in data["lengths"]] == ["A to C", "A to B", "B to C"]
    by_name = {one.name: one for one in found.lengths}
    for one in data["lengths"]:
        assert one["value"] == pytest.approx(by_name[one["name"]].value, rel=1e-14)
        right = by_name[one["name"]].standard_uncertainty
        assert one["standard_uncertainty"] == pytest.approx(right, rel=1e-9)
    assert np.allclose([one["point"] for one in data["points"]], found.points, rtol=1e-14)
    assert [one["outside"] for one in data["points"]] == [False, False, True]
    assert wording.OF_POINTS_LIE_OUTSIDE_THE_VOLUME in captured.err
    with (tmp_path / "out.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [row["outside"] for row in rows] == ["no", "no", "yes"]
    assert float(rows[1]["x_mm"]) == pytest.approx(1e3 * found.points[1, 0], rel=1e-14)
    # The text has what the data have, with as many digits as the uncertainty has two.
    for line, one in zip(found.lines()[-8:-5], data["points"], strict=True):
        name, probe, *cells = re.split("  +", line)
        u = np.array(one["standard_uncertainty"])
        values = [*1e3 * np.array(one["point"]), *1e6 * np.array(one["correction"]), *2e6 * u]
        off = np.abs(np.subtract(list(map(float, cells)), values))
        assert (off <= 0.06 * np.tile(u, 3) * np.repeat([1e3, 1e6, 1e6], 3)).all()
        assert (name, probe) == (one["name"], one["probe"])
    assert "A to C" in found.lines()[-1]
    for line in found.lines()[-3:]:
        name, *cells = re.split("  +", line)
        one = next(one for one in data["lengths"] if one["name"] == name)
        u = one["standard_uncertainty"]
        expected = [1e3 * one["value"], 1e6 * one["correction"], 2e6 * u, 2.0]
        off = np.abs(np.subtract(list(map(float, cells)), expected))
        assert (off <= 0.06 * u * np.array([1e3, 1e6, 1e6, 0.0])).all()
    written = read_matrix(tmp_path / "covariance.csv")
    assert np.allclose(written.values, found.covariance(), rtol=1e-12, atol=1e-24)


def test_tasks_of_an_experiment(fitted: FittedMap, tmp_path: Path) -> None:
    ends = {"from": ["100 mm", "200 mm", "300 mm"], "to": ["700 mm", "200 mm", "300 mm"]}
    task = {"name": "long", **ends, "target_uncertainty": "1 um"}
    experiment = bp.quickstart().with_(
        {"evaluation": {"tasks": [task, {**task, "name": "tight", "target_uncertainty": "1 nm"}]}}
    )
    from ballplate.extensions.maps.correction import correction
    from ballplate.extensions.maps.point_files import GivenPoints
    from ballplate.extensions.maps.selected_lengths import tasks_of_experiment

    nothing = GivenPoints(np.zeros((0, 3)), (), np.zeros(0, np.int64))
    found = correction(fitted, nothing, tasks_of_experiment(fitted, experiment))
    x = [[0.1, 0.2, 0.3], [0.7, 0.2, 0.3]]
    right = bp.correct(fitted, x, lengths=[(0, 1)]).lengths[0]
    assert [one.value for one in found.lengths] == [right.value, right.value]
    assert [one.is_met for one in found.lengths] == [True, False]


POINTS = "name,x_mm,y_mm,z_mm\nA,100,200,300\nB,400,200,300\nA,1,2,3\n"
SLIPS = {
    "unknown name": (POINTS, ["--length", "B", "C"], 2, 'no point is called "C"'),
    "name twice": (POINTS, ["--length", "B", "A"], 2, '2 points are called "A"'),
    "unit": (POINTS.replace("_mm", "_m"), [], 3, ":2:1: x is 100 m, far outside the volume"),
    "no number": (POINTS.replace("400", "4OO"), [], 3, ':3:3: "4OO" is not a number'),
    "same place": (POINTS + "D,1,2,3\nE,1,2,3\n", ["--length", "D", "E"], 2, "coincide"),
}


@pytest.mark.parametrize("case", SLIPS)
def test_slips_are_told(
    case: str, fitted: FittedMap, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, options, status, told = SLIPS[case]
    bp.write_map(fitted, tmp_path / "map.yaml")
    (tmp_path / "points.csv").write_text(text)
    arguments = ["correct", str(tmp_path / "map.yaml"), str(tmp_path / "points.csv"), *options]
    assert main(arguments) == status
    assert told in capsys.readouterr().err


def test_fits_and_files_that_name_readings_are_taken_as_their_maps_are(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A fit, its map, and a file whose readings are fitted first."""
    bp.simulate(bp.quickstart(), 3).to_csv(folder / "named.csv", index=False)
    text = Path("designs/quickstart.yaml").read_text("utf-8")
    (folder / "named.yaml").write_text(f"{text}readings: {{files: named.csv}}\n", "utf-8")
    points = folder / "ends.csv"
    points.write_text("x_mm,y_mm,z_mm\n100,200,300\n900,800,700\n", "utf-8")
    fit = bp.fit(bp.quickstart(), folder / "named.csv")
    fitted = fit.to_map()  # type: ignore[attr-defined]
    expected = bp.correct(fitted, points)
    assert np.array_equal(bp.correct(fit, points).points, expected.points)  # type: ignore[arg-type]
    assert np.array_equal(bp.correct(fit, points).covariance(), expected.covariance())  # type: ignore[arg-type]
    for call in (lambda one: bp.curves(one, points=3), lambda one: bp.map(one, grid=(2, 2, 2))):
        assert call(fit).to_dict() == call(fitted).to_dict()
    with pytest.raises(TypeError, match=wording.GIVE_A_FIT_WHAT):
        bp.correct(3, points)  # type: ignore[arg-type]
    for command, given in (("correct", [str(points)]), ("map", ["--curves"])):
        bp.write_map(fitted, folder / "named-map.yaml")
        told = []
        for name in ("named.yaml", "named-map.yaml"):
            assert main([command, str(folder / name), *given, "--json"]) == 0
            told.append(json.loads(capsys.readouterr().out))
        for one in told:
            one.pop("label", None), one.pop("file", None), one.pop("map", None)
        assert told[0] == told[1]
    assert main(["correct", "designs/quickstart.yaml", str(points)]) == 3
    assert "names no readings" in capsys.readouterr().err
    assert main(["check", str(folder / "named-map.yaml")]) == 3
    assert wording.THIS_IS_A_MAP in capsys.readouterr().err
