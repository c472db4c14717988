"""Holes read in two co-ordinates against a dense computation of the same rows, by count, by
simulation, and what files of their readings look like.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from ballplate import compare
from ballplate.extensions.diagnosis.redundancy import reliability
from ballplate.extensions.laboratory.gross_errors import find_gross_errors
from ballplate.results.fitting import fit
from ballplate.results.prediction import predict
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.parameters import shared_layout
from ballplate.simulator.estimation.elimination import eliminate
from ballplate.simulator.estimation.gauss_newton import iterate
from ballplate.simulator.estimation.initial import initial_state
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import written_in_python
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.readings.observed_readings import observe
from ballplate.simulator.readings.reading_files import read_readings, write_readings
from ballplate.simulator.readings.simulated import simulated_readings

from tests.reference import dense
from tests.reference.small_quickstart import PLATE, small_sections

QUICKSTART: dict[str, Any] = yaml.safe_load(Path("designs/quickstart.yaml").read_text("utf-8"))
HOLES = {**PLATE, "reads": "in plane", "flatness": "5 um"}
FLATNESS = 5e-6


def small(**changes: Any) -> Experiment:
    """The quickstart with nine holes and few coefficients."""
    return written_in_python(small_sections(**{"artefacts": {"plate": HOLES}} | changes), Path())


def across(design: Design) -> np.ndarray:
    """The axis (readings,) across the plate of each reading, from the poses themselves."""
    normals = np.abs(design.positions.rotations[:, :, 2]).round(12)
    assert (np.sort(normals, axis=1) == [0.0, 0.0, 1.0]).all()
    return np.asarray(normals.argmax(axis=1)[design.readings.position])


def dense_rows(design: Design, step: Any) -> Any:
    """All rows: those of a plate read in space, less co-ordinates across its plane."""
    problem = dense.planned(design, 3, 3)
    rows = dense.residuals(problem, step)
    count = 3 * len(design.readings)
    keep = np.ones(len(rows), bool)
    keep[:count] = (np.arange(3) != across(design)[:, None]).ravel()
    return rows[keep]


def test_uncertainties_are_those_of_the_rows_that_are_read() -> None:
    experiment = small()
    design = lay_out(experiment)
    # All poses keep what nothing of the plane tells of: a shift across, and two tilts.
    for k, normal in enumerate(across(design)[np.unique(design.readings.position, True)[1]]):
        expected = np.ones(6, bool) if k == 0 else np.arange(6) == normal
        if k:
            expected[3:] = np.arange(3) != normal
        np.testing.assert_array_equal(design.positions.held[k], expected)
    problem = dense.planned(design, 3, 3)
    spread = dense.spread(dense.jacobian(lambda step: dense_rows(design, step), problem.parameters))
    assert spread.deficiency == predict(experiment).verdict.deficiency == 0
    values = dense.standard_uncertainties(problem, spread)
    got = predict(experiment).quantities
    for symbol in ("U1", "U4", "U5", "U6"):
        assert got[symbol].average == pytest.approx(float(values[symbol].mean()), rel=1e-6)
        assert got[symbol].maximum == pytest.approx(float(values[symbol].max()), rel=1e-6)
    assert got["U1"].maximum == pytest.approx(FLATNESS, rel=1e-9)


def test_two_co_ordinates_of_each_reading_are_counted() -> None:
    design = lay_out(small())
    assert design.observation_count == 2 * len(design.readings) + 4 + 9
    repeated = [{**one, "repeats": 3} for one in QUICKSTART["positions"]]
    assert lay_out(small(positions=repeated)).observation_count == 6 * len(design.readings) + 13
    found = reliability(small())
    freedom = design.observation_count - design.parameter_count
    assert found.redundancy.sum() + found.among_repeats == pytest.approx(freedom, rel=1e-9)
    readings = found.patterns.of_kind("reading")
    assert len(readings) == 2 * len(design.readings)
    assert not (
        found.patterns.axis[readings] == across(design)[found.patterns.subject[readings]]
    ).any()
    # The redundancy of each is that of its row in the dense problem.
    problem = dense.planned(design, 3, 3)
    jacobian = dense.jacobian(lambda step: dense_rows(design, step), problem.parameters)
    q, _ = np.linalg.qr(jacobian)
    np.testing.assert_allclose(
        found.left[readings], 1.0 - (q**2).sum(axis=1)[: len(readings)], rtol=0, atol=1e-8
    )


def test_estimates_do_not_depend_on_what_stands_in_the_place_of_the_third(tmp_path: Path) -> None:
    """Readings written and read again, and read in memory with whatever the scales say across."""
    experiment = small()
    design = lay_out(experiment)
    found = simulated_readings(experiment, seed=4)
    path = tmp_path / "readings.csv"
    with path.open("w", encoding="utf-8") as stream:
        write_readings(stream, found.design, found.readings, found.x)
    lines = path.read_text(encoding="utf-8").splitlines()
    assert lines[1].endswith(",") and not lines[1].endswith(",,")
    observed = read_readings(path, design)
    from_file = fit(experiment, observed)
    in_memory = iterate(design, found.x, initial_state(design, found.x))
    np.testing.assert_allclose(
        from_file.solution.state.balls, in_memory.state.balls, rtol=0, atol=2e-10
    )
    assert from_file.solution.factor.sum_of_squares == pytest.approx(
        in_memory.factor.sum_of_squares, rel=1e-4
    )
    # Balls stay in the plane as far as anybody knows.
    np.testing.assert_allclose(in_memory.state.balls[:, 2], 0.0, rtol=0, atol=1e-12)


def test_heavy_weights_are_eliminated_the_same() -> None:
    """Certificates that outweigh readings take the other way of elimination from ten thousand times
    on; such certificates are as good as exact either way.
    """
    found = []
    for u, is_graded in (("1e-7 um", True), ("4e-5 um", False)):
        sides = {"kind": "distances", "pairs": "corner sides", "standard_uncertainty": u}
        plate = {**HOLES, "flatness": "0.2 um"}
        experiment = small(calibration=[sides], artefacts={"plate": plate})
        design = lay_out(experiment)
        factor = eliminate(design, design.once(shared_layout), nominal_state(design))
        assert (factor.orders is not None) == is_graded
        found.append(predict(experiment).quantities["U6"].average)
    assert found[0] == pytest.approx(found[1], rel=1e-6)


HEAD = "position,ball,probe,x_mm,y_mm,z_mm"


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("z low,r1c1,down,0,0,300", 'z is across the plane of "z low", which is read in its plane'),
        ("z low,r1c1,down,0,,", "no y; write a number"),
    ],
)
def test_cells_are_empty_where_nothing_is_read_and_nowhere_else(
    line: str, expected: str, tmp_path: Path
) -> None:
    path = tmp_path / "readings.csv"
    path.write_text(f"{HEAD}\n{line}\n", encoding="utf-8")
    with pytest.raises(ExperimentError, match=expected):
        read_readings(path, lay_out(small()))


def test_a_plate_that_is_read_in_space_needs_all_cells(tmp_path: Path) -> None:
    path = tmp_path / "readings.csv"
    path.write_text(f"{HEAD}\nz low,r1c1,down,0,0,\n", encoding="utf-8")
    with pytest.raises(ExperimentError, match="no z; write a number"):
        read_readings(path, lay_out(small(artefacts={"plate": PLATE})))


OBLIQUE = {"origin": ["100 mm", "100 mm", "300 mm"], "rotation": ["10 deg", "0 deg", "0 deg"]}


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"artefacts": {"plate": {**PLATE, "reads": "in plane"}}}, "go together; give both"),
        ({"artefacts": {"plate": {**PLATE, "flatness": "5 um"}}}, "go together; give both"),
        (
            {"artefacts": {"plate": {**HOLES, "role": "length_standard"}}},
            "only a plate in space is read in its plane",
        ),
        (
            {"positions": [{"name": "oblique", "pose": OBLIQUE, "probes": ["down"]}]},
            "has to be across an axis of the machine",
        ),
    ],
)
def test_what_cannot_be_read_in_its_plane_is_refused(
    changes: dict[str, Any], expected: str
) -> None:
    with pytest.raises(ExperimentError, match=expected):
        small(**changes)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, "cannot use readings in plane"),
        (
            {"artefacts": {"plate": PLATE}, "stars": [{"standard_uncertainty": "0.2 um"}]},
            "cannot follow where a star points",
        ),
    ],
)
def test_estimators_of_distances_alone_refuse(changes: dict[str, Any], expected: str) -> None:
    with pytest.raises(ExperimentError, match=expected):
        compare(small(**changes), trials=2)


@pytest.mark.parametrize("single", [(0,), (3,), (1, 2, 5)])
@pytest.mark.parametrize("line", ["r{}c2", "r{}c3", "r2c{}"])
def test_exact_readings_of_single_columns_and_rows_are_right(
    single: tuple[int, ...], line: str
) -> None:
    """Balls in one line leave the turn about it open, which the plane of the position tells."""
    balls = [line.format(k) for k in range(1, 4)]
    places = [
        position | ({"balls": balls} if k in single else {})
        for k, position in enumerate(QUICKSTART["positions"])
    ]
    experiment = small(positions=places)
    simulated = simulated_readings(experiment, exact=True)
    observed = observe(lay_out(experiment), simulated.readings, simulated.x)
    assert find_gross_errors(observed.design, observed.x) == ([], [])
    state, positions = initial_state(observed.design, observed.x), observed.design.positions
    np.testing.assert_allclose(state.rotations, positions.rotations, rtol=0, atol=1e-4)
    np.testing.assert_allclose(state.origins, positions.origins, rtol=0, atol=1e-4)
