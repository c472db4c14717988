"""What the reference says of the error models, each statement against something written down
independently.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from ballplate.results.prediction import predict
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.machines._empirical import empirical_model
from ballplate.simulator.machines._terms import sums
from ballplate.simulator.machines.arrangement import ARRANGEMENTS
from ballplate.simulator.machines.bases import Polynomial
from ballplate.simulator.machines.kinematic import kinematic_model
from ballplate.simulator.machines.metric import MetricModel, SpatialMetricModel
from ballplate.simulator.machines.protocol import ErrorModel
from ballplate.simulator.machines.truth import CoefficientSettings, TruthError, true_parameters
from scipy.spatial.transform import Rotation

LOWER, UPPER = (-0.2, 0.1, 0.3), (0.8, 0.7, 1.3)
GENERATOR = np.random.default_rng(5)


@pytest.mark.parametrize(
    ("model", "place"),
    [
        (kinematic_model(ARRANGEMENTS["FB1"], 4, 3, LOWER, UPPER), LOWER),
        (kinematic_model(ARRANGEMENTS["FB1"], 4, 3, LOWER, UPPER, full_rotations=True), LOWER),
        (empirical_model(sums(Polynomial(4)), LOWER, UPPER), LOWER),
        (SpatialMetricModel(True, LOWER, UPPER), LOWER),
        (MetricModel("x"), (0.0, 0.0)),
    ],
    ids=["kinematic", "full rotations", "empirical", "metric in space", "metric in the plane"],
)
def test_where_no_error_is(model: ErrorModel, place: tuple[float, ...]) -> None:
    """At one place no parameters make an error, whatever the offset; elsewhere they do."""
    a = 1e-4 * GENERATOR.standard_normal(len(model.parameters))
    x, p = np.array([place]), 0.1 * GENERATOR.standard_normal((1, len(place)))
    assert np.abs(model.error(x, a, p) - p).max() < 1e-16
    assert np.abs(model.error(x + 0.3, a, p) - p).max() > 1e-6


def test_rotation_matrices_of_both_sides() -> None:
    """FB2: y carries z carries the probe, x carries the workpiece."""
    model = kinematic_model(ARRANGEMENTS["FB2"], 2, 2, (0.0,) * 3, (1.0,) * 3, full_rotations=True)
    a = 1e-2 * GENERATOR.standard_normal(len(model.parameters))
    x, p = GENERATOR.random(3), 0.1 * GENERATOR.standard_normal(3)
    shift, turn = np.zeros((3, 3)), np.zeros((3, 3))
    for parameter, value in zip(model.parameters, a, strict=True):
        axis, kind = "XYZ".index(parameter.function[2]), parameter.function[1]
        if kind in "ABC":
            turn[axis]["ABC".index(kind)] = value * x[axis]
        else:
            shift[axis]["XYZ".index(kind)] = value * x[axis]
    # Rz Ry Rx: SciPy's lower-case axes are fixed ones, turned about in the order written.
    rotations = [Rotation.from_euler("xyz", angles) for angles in turn]
    moved = np.diag(x) + shift
    outside = moved[1] + rotations[1].apply(moved[2] + rotations[2].apply(p))
    tip = rotations[0].inv().apply(outside + moved[0])
    assert np.abs(model.error(x[None], a, p[None])[0] - (tip - x)).max() < 1e-15


def test_t_is_another_name_of_its_first_power() -> None:
    model = kinematic_model(ARRANGEMENTS["MB2"], 3, 3, LOWER, UPPER)

    def machine(**values: str) -> np.ndarray:

        return true_parameters(CoefficientSettings(kind="coefficients", values=values), model)

    assert (machine(**{"EXX t": "3 um"}) == machine(**{"EXX t^1": "3 um"})).all()
    with pytest.raises(TruthError) as raised:
        machine(**{"EXX t": "3 um", "EXX t^1": "1 um"})
    assert "by another name" in str(raised.value.problems)


EXPERIMENT = """\
title: t
machine: {volume: [1 m, 1 m, 1 m], repeatability: 0.2 um}
error_model: {kind: kinematic, position_coefficients: 2, rotation_coefficients: 2}
probes:
  down: [0 mm, 0 mm, -50 mm]
  side: {offset: [50 mm, 0 mm, 0 mm], standard_uncertainty: 1 um}
artefacts: {plate: {kind: grid, balls: [3, 3], size: [600 mm, 600 mm]}}
positions:
  - {name: one, plane: z, level: 200 mm, corner: {x: 100 mm, y: 100 mm}, probes: [down, side]}
  - {name: two, plane: z, level: 700 mm, corner: {x: 300 mm, y: 200 mm}, quarter_turns: 1, probes: [down]}
  - {name: three, plane: x, level: 400 mm, corner: {y: 100 mm, z: 100 mm}, probes: [side]}
"""


def written(folder: Path, more: str) -> Path:
    path = folder / "e.yaml"
    path.write_text(EXPERIMENT + more, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("certificate", "held"),
    [
        ("{kind: distances, pairs: corner sides, standard_uncertainty: 0.2 um}", 6),
        ("{kind: coordinates, balls: [r1c1], standard_uncertainty: 0.2 um}", 3),
        ("{kind: coordinates, balls: all, standard_uncertainty: {z: 0.2 um}}", 3),
        ("{kind: coordinates, balls: [r1c1, r3c3], standard_uncertainty: 0.2 um}", 1),
        ("{kind: coordinates, balls: corners, standard_uncertainty: 0.2 um}", 0),
    ],
)
def test_as_much_of_the_first_pose_is_held_as_the_certificate_leaves_open(
    certificate: str, held: int, tmp_path: Path
) -> None:
    (experiment,) = load(written(tmp_path, f"calibration: [{certificate}]\n"))
    design = lay_out(experiment)
    assert design.positions.held.sum(axis=1).tolist() == [held, 0, 0]


def test_priors_of_poses_free_nothing(tmp_path: Path) -> None:
    certificate = (
        "calibration: [{kind: distances, pairs: corner sides, standard_uncertainty: 0.2 um}]\n"
    )
    prior = "priors: [{{parameter: '{}: origin x', standard_uncertainty: 1 um}}]\n"
    (experiment,) = load(written(tmp_path, certificate + prior.format("two")))
    assert lay_out(experiment).positions.held.sum(axis=1).tolist() == [6, 0, 0]
    (experiment,) = load(written(tmp_path, certificate + prior.format("one")))
    with pytest.raises(ExperimentError) as raised:
        lay_out(experiment)
    assert '"one: origin x" is held' in str(raised.value.messages[0])


def test_u2_leaves_offsets_out(tmp_path: Path) -> None:
    certificate = "calibration: [{kind: coordinates, balls: all, standard_uncertainty: 0.2 um}]\n"
    (experiment,) = load(written(tmp_path, certificate))
    quantities = predict(experiment).quantities
    assert quantities["U2"].count == 18
    assert quantities["U2 offsets"].count == 3
    assert quantities["U2"].count == quantities["U2 lengths"].count + quantities["U2 angles"].count


def test_a_prior_may_say_t_for_its_first_power(tmp_path: Path) -> None:
    rows = []
    for name in ("EXX t", "EXX t^1"):
        (experiment,) = load(
            written(tmp_path, f"priors: [{{parameter: {name}, standard_uncertainty: 1 um}}]\n")
        )
        (prior,) = experiment.priors
        assert prior.name == "EXX t^1"
        rows.append(prior.by_model)
    assert (rows[0] == rows[1]).all()
    assert rows[0].any()
