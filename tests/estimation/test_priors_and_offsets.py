"""Prior information and probe offsets as parameters, against dense differences and by what they
do.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ballplate.results.fitting import fit
from ballplate.results.prediction import check
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.observations.priors import Priors
from ballplate.simulator.design.observations.readings import reading_blocks
from ballplate.simulator.design.parameters import shared_layout
from ballplate.simulator.design.state import State
from ballplate.simulator.estimation.gauss_newton import moved
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.machines.truth import true_parameters
from ballplate.simulator.readings.reading_files import read_readings, write_readings
from ballplate.simulator.readings.simulated import exact_readings
from scipy.spatial.transform import Rotation

from tests.estimation import wording

TEXT = Path("designs/quickstart.yaml").read_text(encoding="utf-8")
PRIORS = """\
priors:
  - {parameter: EAX, standard_uncertainty: 5 urad}
  - {parameter: "EXX[2]", value: 1 um, standard_uncertainty: 0.3 um}
  - {parameter: EYY t^2, standard_uncertainty: 3 um}
  - {parameter: "x low: rotation y", value: 3 mrad, standard_uncertainty: 10 urad}
  - {parameter: "y high: origin z", standard_uncertainty: 4 um}
"""
UNKNOWN = (
    TEXT.replace(
        "right: [50 mm, 0 mm, 0 mm]", "right: {offset: [50 mm, 0 mm, 0 mm], unknown: true}"
    )
    .replace(
        "left: [-50 mm, 0 mm, 0 mm]",
        "left: {offset: [-50 mm, 0 mm, 0 mm], standard_uncertainty: 3 um}",
    )
    .replace("back: [0 mm, 50 mm, 0 mm]", "back: {offset: [0 mm, 50 mm, 0 mm], unknown: true}")
    .replace("front: [0 mm, -50 mm, 0 mm]", "front: {offset: [0 mm, -50 mm, 0 mm], unknown: true}")
)
SPHERE = (
    UNKNOWN.replace("artefacts:\n", "artefacts:\n  reference: {kind: sphere}\n")
    .replace(
        "positions:\n",
        "positions:\n  - {name: qualification, artefact: reference, pose: {origin: [800 mm, 100 mm,"
        " 100 mm]}, probes: [down, right, left, back, front], repeats: 3}\n",
    )
    .replace("{name: z", "{artefact: plate, name: z")
    .replace("{name: x", "{artefact: plate, name: x")
    .replace("{name: y", "{artefact: plate, name: y")
    .replace("kind: distances\n", "kind: distances\n    artefact: plate\n")
)


@pytest.fixture
def written(tmp_path: Path) -> Callable[[str], Path]:
    def write(text: str) -> Path:
        path = tmp_path / "e.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def with_bar(text: str) -> str:
    bar = "  bar: {kind: two_spheres, length: 400 mm, role: length_standard}\n"
    place = (
        "  - {name: bar, artefact: bar, pose: {origin: [300 mm, 300 mm, 300 mm]}, probes: [left,"
        " back]}\n"
    )
    known = "  - {kind: distances, artefact: bar, pairs: all, standard_uncertainty: 0.2 um}\n"
    text = text.replace("artefacts:\n", "artefacts:\n" + bar).replace(
        "\n# What is known of", place + "\n# What is known of"
    )
    return text.replace("calibration:\n", "calibration:\n" + known)


def all_residuals(design: Design, state: State, x: np.ndarray) -> np.ndarray:
    chosen = design.plate_readings
    blocks = reading_blocks(design, state, design.readings.select(chosen), x[chosen])
    return np.concatenate(
        [
            blocks.residual.ravel(),
            *(one.rows(design, state, x).residual for one in design.observations),
        ]
    )


def test_the_factor_is_that_of_dense_differences(written: Callable[[str], Path]) -> None:
    text = (
        with_bar(SPHERE)
        .replace("balls: [5, 5]", "balls: [3, 3]")
        .replace("cal_coefficients: 5", "cal_coefficients: 3")
    )
    design = lay_out(
        load(written(text.replace("n_coefficients: 5", "n_coefficients: 3") + PRIORS))[0]
    )
    layout = shared_layout(design)
    generator = np.random.default_rng(4)
    shared = 1e-3 * generator.standard_normal(len(layout))
    balls = (
        1e-3
        * generator.standard_normal(design.balls.places.shape)
        * design.artefacts.is_plate[design.balls.artefact][:, None]
    )
    state = moved(nominal_state(design), layout, shared, balls)
    _, x = exact_readings(
        replace(
            design, readings=replace(design.readings, repeats=np.ones_like(design.readings.ball))
        ),
        nominal_state(design),
    )

    members = design.plate_balls
    count = len(layout)

    def residual(step: np.ndarray) -> np.ndarray:
        of_balls = np.zeros(design.balls.places.shape)
        of_balls[members] = step[count:].reshape(-1, 3)
        there = moved(state, layout, step[:count], of_balls)
        return all_residuals(design, there, x)

    size = np.concatenate([np.minimum(layout.scale, 1.0), np.ones(3 * len(members))]) * 1e-4
    columns = [
        (residual(s) - residual(-s)) / (2 * h) for s, h in zip(np.diag(size), size, strict=True)
    ]
    dense = np.stack(columns, axis=1)
    at = linearise(design, state, x)
    now = residual(np.zeros(len(size)))
    assert at.factor.sum_of_squares == pytest.approx(now @ now, rel=1e-12)
    scaled = dense * size
    expected = np.sqrt(np.diag(np.linalg.inv(scaled.T @ scaled)))[:count] * size[:count]
    found = at.of_shared(np.eye(count))
    np.testing.assert_allclose(found, expected, rtol=1e-5)


def test_a_prior_is_about_what_it_names(written: Callable[[str], Path]) -> None:
    """Turns as scipy has them, co-ordinates and coefficients of a state that is nothing like the
    drawing.
    """
    design = lay_out(load(written(UNKNOWN + PRIORS))[0])
    generator = np.random.default_rng(6)
    layout = shared_layout(design)
    step = 0.1 * generator.standard_normal(len(layout))
    state = moved(nominal_state(design), layout, step, np.zeros_like(design.balls.places))
    priors = design.of(Priors)
    values = priors.rows(design, state, None).residual * priors.uncertainty + priors.value
    found = dict(zip(priors.names, values.tolist(), strict=True))
    low, high = (design.positions.names.index(name) for name in ("x low", "y high"))
    turn = Rotation.from_matrix(state.rotations[low] @ design.positions.rotations[low].T)
    names = [one.name for one in design.model.parameters]
    reported = design.model.reported()
    row = reported.names.index("EYY t^2")
    left = design.probes.names.index("left")
    wanted = {
        "EAX": None,
        "EXX[2]": state.a[names.index("EXX[2]")],
        "EYY t^2": reported.matrix[row] @ state.a,
        "x low: rotation y": turn.as_rotvec()[1],
        "y high: origin z": state.origins[high, 2],
    }
    wanted |= {f"probe left: offset {axis}": state.probes[left, k] for k, axis in enumerate("xyz")}
    assert len({round(value, 9) for value in found.values()}) == len(found)
    for name, value in wanted.items():
        if value is not None:
            assert found[name] == pytest.approx(value, abs=1e-14), name


@pytest.mark.parametrize(
    ("prior", "message"),
    [
        (
            "{parameter: EAZX, standard_uncertainty: 5 urad}",
            'unknown parameter "EAZX"; did you mean "E',
        ),
        ("{parameter: EAX, standard_uncertainty: 5 um}", "priors[0].standard_uncertainty: "),
        (
            "{parameter: 'z lo: origin x', standard_uncertainty: 1 um}",
            'did you mean "z low: origin x"?',
        ),
        (
            "{parameter: 'r1c1: x', standard_uncertainty: 1 um}",
            "state a calibration of kind: coordinates",
        ),
        (
            "{parameter: 'probe left: offset x', standard_uncertainty: 1 um}",
            "state the standard_uncertainty with the",
        ),
    ],
)
def test_messages(written: Callable[[str], Path], prior: str, message: str) -> None:
    with pytest.raises(ExperimentError) as caught:
        load(written(f"{TEXT}priors:\n  - {prior}\n"))
    assert message in str(caught.value) and "priors[0]" in str(caught.value)


def test_a_held_pose_has_no_prior(written: Callable[[str], Path]) -> None:
    text = TEXT + "priors:\n  - {parameter: 'z low: origin x', standard_uncertainty: 1 um}\n"
    with pytest.raises(ExperimentError, match=wording.IS_HELD_TO_FIX_THE_FRAME):
        lay_out(load(written(text))[0])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("unknown: true}", "unknown: true, standard_uncertainty: 1 um}", "cannot be combined with"),
        (
            "unknown: true}",
            "unknown: true, reference: true}",
            "the offset of the reference is held",
        ),
    ],
)
def test_messages_about_probes(
    written: Callable[[str], Path], old: str, new: str, message: str
) -> None:
    with pytest.raises(ExperimentError, match=message):
        load(written(UNKNOWN.replace(old, new)))


def test_unknown_offsets_need_the_sphere(written: Callable[[str], Path]) -> None:
    """Without it the probes of each side move with the positions that they read; the verdict names
    them.
    """
    without = check(
        load(written(UNKNOWN.replace(", standard_uncertainty: 3 um", ", unknown: true")))[0]
    ).verdict
    assert without.deficiency == 6
    assert {part.name for direction in without.null for part in direction.probes} == {
        "right",
        "left",
        "back",
        "front",
    }
    assert any("offsets of probes: " in str(direction) for direction in without.null)
    assert check(load(written(SPHERE))[0]).verdict.deficiency == 0


def test_offsets_come_back(written: Callable[[str], Path], tmp_path: Path) -> None:
    experiment = load(written(SPHERE))[0]
    design = lay_out(experiment)
    shift = 1e-4 * np.random.default_rng(5).standard_normal((5, 3))
    shift[0] = 0.0
    truth = replace(
        nominal_state(design),
        a=true_parameters(experiment.true_machine, design.model),
        probes=design.probes.offsets + shift,
    )
    # The certificate of probe "left" must be right for exact data to fit exactly.
    priors = design.of(Priors)
    design = design.observed(replace(priors, value=truth.probes[priors.probe, priors.component]))
    readings, x = exact_readings(design, truth)
    with (tmp_path / "r.csv").open("w", encoding="utf-8") as stream:
        write_readings(stream, design, readings, x)
    found = fit(experiment, read_readings(tmp_path / "r.csv", design))
    assert found.solution.status == "converged" and found.solution.factor.sum_of_squares < 1e-12
    np.testing.assert_allclose(found.solution.state.probes, truth.probes, rtol=0, atol=1e-13)
    np.testing.assert_allclose(found.solution.state.a, truth.a, rtol=0, atol=1e-12)
    estimates = {e.name: e.value for e in found.estimates}
    assert estimates["probe left: offset x"] == pytest.approx(-0.05 + shift[2, 0], abs=1e-12)
    assert "probe down: offset x" not in estimates
    assert len(estimates) == design.parameter_count
