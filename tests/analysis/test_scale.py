"""What carries scale: against dense generalised least squares, and against what must hold of any
design.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from ballplate.cli import main
from ballplate.results.prediction import check, predict
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.objects import Volume
from ballplate.simulator.estimation.functions import Distances, MeasuredPoints, linear_functions
from ballplate.simulator.estimation.linearisation import Linearisation, linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.machines.protocol import Parameter, Reported
from ballplate.uncertainty.scale import (
    EXACT_OFFSETS,
    OWN_SCALES,
    can_stretch,
    lengths_with_offsets,
    scale_row,
    scale_uncertainty,
    stretches,
    with_offsets,
)

from tests.analysis import wording
from tests.reference import dense
from tests.reference.designs import altered, grid, plate_design, six_positions

QUICKSTART = Path("designs/quickstart.yaml").read_text(encoding="utf-8")
SMALL = QUICKSTART.replace("coefficients: 5", "coefficients: 3").replace(
    "balls: [5, 5]", "balls: [3, 3]"
)
SMALL = SMALL.replace("random: 200", "random: 12")
CERTIFICATE = SMALL[SMALL.index("calibration:") : SMALL.index("# Where U4")]

ONE_PROBE = """\
title: one probe
machine: {volume: [1 m, 1 m, 1 m], repeatability: 0.2 um}
error_model: {kind: metric}
probes: {down: [0 mm, 0 mm, -50 mm]}
artefacts:
  plate: {kind: square, balls: 4, size: 600 mm}
positions:
  - {name: a, plane: z, level: 500 mm, corner: {x: 0 mm, y: 0 mm}}
  - {name: b, plane: z, level: 500 mm, corner: {x: 300 mm, y: 300 mm}, quarter_turns: 1}
  - {name: c, plane: x, level: 500 mm, corner: {y: 0 mm, z: 300 mm}, quarter_turns: 2}
  - {name: d, plane: y, level: 500 mm, corner: {x: 300 mm, z: 0 mm}, quarter_turns: 3}
calibration:
  - {kind: distances, pairs: corner sides, standard_uncertainty: 0.2 um}
evaluation: {points: {random: 20}}
"""


def experiment_of(folder: Path, text: str) -> Experiment:
    file = folder / "design.yaml"
    file.write_text(text, encoding="utf-8")
    return load(file)[0]


def without_certificate(text: str = SMALL) -> str:
    return text.replace(CERTIFICATE, "")


def dense_lengths(experiment: Experiment, offset_uncertainty: float) -> tuple[float, np.ndarray]:
    """Scale and U6 of all pairs by generalised least squares: errors of the offsets are those of
    readings, together.
    """
    design = lay_out(experiment)
    problem = dense.planned(design, 3, 3)
    zero = np.zeros(problem.parameters)
    rows = dense.jacobian(lambda step: dense.residuals(problem, step), problem.parameters)
    parts = []
    for probe, axis in itertools.product(range(1, len(design.probes.offsets)), range(3)):
        offsets = design.probes.offsets.copy()
        size = 1e-3
        offsets[probe, axis] += size
        other = replace(problem, design=altered(design, probes={"offsets": offsets}))
        change = (dense.residuals(other, zero) - dense.residuals(problem, zero)) / size
        of_plates = len(design.readings.ball) * 3
        assert not change[of_plates:].any()
        parts.append(change * offset_uncertainty)
    common = np.stack(parts, axis=1)
    weight = np.linalg.inv(np.linalg.cholesky(np.eye(len(common)) + common @ common.T))
    found = dense.spread(weight @ rows)
    assert found.deficiency == 0
    points = dense.jacobian(dense.quantities(problem)["U4"], problem.parameters).reshape(
        -1, 3, problem.parameters
    )
    first, second = dense.pairs_of(len(design.evaluation.points))
    apart = design.evaluation.points[first] - design.evaluation.points[second]
    by_length = np.einsum("md,mdp->mp", apart, points[first] - points[second])
    scale = by_length.sum(axis=0) / (apart**2).sum()
    lengths = found.of(by_length / np.linalg.norm(apart, axis=1)[:, None])
    return float(found.of(scale[None])[0]), lengths


@pytest.mark.parametrize("uncertainty", [1e-9, 1e-6, 2e-5])
def test_offsets_with_an_uncertainty_are_what_generalised_least_squares_makes_of_them(
    tmp_path: Path, uncertainty: float
) -> None:
    for text in (SMALL, without_certificate()):
        experiment = experiment_of(tmp_path, text)
        scale, lengths = dense_lengths(experiment, uncertainty)
        assert scale_uncertainty(with_offsets(experiment, uncertainty)) == pytest.approx(
            scale, rel=1e-6
        )
        found = lengths_with_offsets(experiment, uncertainty)
        assert found is not None
        assert found.total / found.count == pytest.approx(lengths.mean(), rel=1e-6)
        assert found.maximum == pytest.approx(lengths.max(), rel=1e-6)


def test_a_design_without_a_certificate_is_told_where_its_scale_comes_from(tmp_path: Path) -> None:
    found = check(experiment_of(tmp_path, without_certificate()))
    assert found.verdict.deficiency == 0 and found.scale is not None
    assert [one.words for one in found.scale.carriers] == [EXACT_OFFSETS]
    assert found.scale.rests_on_offsets and found.scale.loosened is not None
    assert found.scale.loosened.before == pytest.approx(
        found.lengths.average if found.lengths else None
    )
    # Offsets off by u make a relative error of about u over their distances, here 100 mm.
    loose = with_offsets(found.experiment, found.scale.loosened.offset_uncertainty)
    u6 = predict(loose).quantities["U6"]
    expected = pytest.approx((u6.average, u6.maximum))
    assert (found.scale.loosened.average, found.scale.loosened.maximum) == expected
    assert found.scale.loosened.average > 5 * found.scale.loosened.before


def test_a_certificate_and_offsets_are_each_told_with_what_is_left_without(tmp_path: Path) -> None:
    certified = experiment_of(tmp_path, QUICKSTART)
    found = predict(certified).scale
    assert found is not None and not found.rests_on_offsets and found.loosened is None
    told = {one.words: one.without for one in found.carriers}
    bare = experiment_of(tmp_path, without_certificate(QUICKSTART))
    assert told["certificates of plate"] == pytest.approx(scale_uncertainty(bare))
    assert told[EXACT_OFFSETS] == pytest.approx(scale_uncertainty(with_offsets(certified, np.inf)))
    # Two independent sources: the variances of what each alone says add up as their inverses.
    both = sum(without**-2 for without in told.values() if without is not None) ** -0.5
    assert found.uncertainty == pytest.approx(both, rel=0.02)


def test_one_probe_leaves_nothing_but_the_certificate(tmp_path: Path) -> None:
    found = check(experiment_of(tmp_path, ONE_PROBE))
    assert found.verdict.deficiency == 0 and found.scale is not None
    assert [one.words for one in found.scale.carriers] == ["certificates of plate"]
    bare = (
        ONE_PROBE[: ONE_PROBE.index("calibration:")] + ONE_PROBE[ONE_PROBE.index("evaluation:") :]
    )
    open_ = check(experiment_of(tmp_path, bare))
    assert open_.verdict.deficiency and open_.scale is None


def test_priors_and_stated_offsets_are_told(tmp_path: Path) -> None:
    """Without certificates, scale comes from what is known of one axis, or of offsets."""
    stated = without_certificate()
    for name in ("right", "left", "back", "front"):
        line = next(one for one in stated.splitlines() if one.strip().startswith(f"{name}: ["))
        offset = line.split(": ", 1)[1]
        stated = stated.replace(line, f"  {name}: {{offset: {offset}, standard_uncertainty: 1 um}}")
    found = check(experiment_of(tmp_path, stated)).scale
    assert found is not None and not found.rests_on_offsets
    assert [one.words for one in found.carriers] == [wording.PROBE_OFFSETS_WITH_A_STANDARD]
    prior = (
        stated + "\npriors:\n  - {parameter: EXX t^1, value: 0 um, standard_uncertainty: 0.1 um}\n"
    )
    both = check(experiment_of(tmp_path, prior)).scale
    assert both is not None and both.carriers[0].words == "priors"
    assert both.uncertainty < found.uncertainty


def test_a_model_that_cannot_stretch_has_the_machines_own_scale(tmp_path: Path) -> None:
    known = []
    for scale, is_free in (("each", True), ("none", False)):
        experiment = experiment_of(
            tmp_path, ONE_PROBE.replace("{kind: metric}", f"{{kind: metric, scale: {scale}}}")
        )
        design = lay_out(experiment)
        assert can_stretch(design, nominal_state(design)) is is_free
        found = check(experiment)
        assert found.scale is not None
        assert (OWN_SCALES in [one.words for one in found.scale.carriers]) is not is_free
        assert ("the machine's own scales" in "\n".join(found.lines())) is not is_free
        # A figure would be that of squareness, and say nothing of the scales.
        uncertain = any(line.startswith("scale known to") for line in found.lines())
        assert uncertain is any(one.without is not None for one in found.scale.carriers)
        known.append(found.scale.uncertainty)
    # Without scales in the model only its squareness is left to be uncertain of.
    assert known[1] < 0.5 * known[0]


def test_a_model_that_can_stretch_in_part_has_certificates_and_its_own_scales(
    tmp_path: Path,
) -> None:
    """Splines that are level at their ends cannot stretch evenly, though their scales are uncertain
    all the same.
    """
    (experiment,) = [
        one
        for one in load(Path("designs/gilsinn/scales-in-two-parts.yaml"))
        if one.name == "level ends"
    ]
    found = check(experiment).scale
    assert found is not None and found.uncertainty > 1e-8
    assert found.carriers[-1].words == OWN_SCALES
    for one in found.carriers[:-1]:
        assert one.without is not None and one.without > found.uncertainty


def test_a_certificate_is_suggested_and_does_what_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The file as suggested, with a micrometre stated for the offsets, has the U6 that was told."""
    experiment_of(tmp_path, without_certificate())
    file = tmp_path / "design.yaml"
    assert main(["check", str(file), "--suggest"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any(line.startswith(wording.THE_SCALE_RESTS_ON_PROBE_OFFSETS) for line in lines)
    (edit,) = [
        line for line in lines if line.startswith("repair 1, in the file: add to calibration: ")
    ]
    (told,) = [line for line in lines if line.startswith("repair 1: calibrate the distance ")]
    text = (
        file.read_text(encoding="utf-8") + f"\ncalibration:\n  - {edit.split('calibration: ')[1]}\n"
    )
    loose = with_offsets(experiment_of(tmp_path, text), 1e-6)
    average = predict(loose).quantities["U6"].average
    assert f", {1e6 * average:.4f} µm with 1 µm on the exact probe offsets" in told
    assert main(["check", str(file), "--suggest"]) == 0
    assert "warning" not in capsys.readouterr().out


def test_what_cannot_be_laid_out_has_no_scale(tmp_path: Path) -> None:
    """Without the certificate a pose is held that the file states a prior of."""
    text = ONE_PROBE.replace("distances, pairs: corner sides,", "coordinates,")
    prior = '{parameter: "a: rotation z", value: 0 urad, standard_uncertainty: 10 urad}'
    experiment = experiment_of(tmp_path, f"{text}\npriors:\n  - {prior}\n")
    without = replace(experiment, calibration=())
    with pytest.raises(ExperimentError, match='"a: rotation z" is held'):
        lay_out(without)
    assert 0.0 < scale_uncertainty(experiment) < 1e-6
    assert scale_uncertainty(without) == np.inf
    found = check(experiment).scale
    assert found is not None
    assert [(one.words, one.without) for one in found.carriers] == [
        ("certificates of plate", np.inf)
    ]
    assert lengths_with_offsets(experiment, 1e-6) is not None
    assert lengths_with_offsets(without, 1e-6) is None


@dataclass(frozen=True)
class Strains:
    """An error model whose parameters strain the volume: e = sum of a_k times matrices (d, d) times
    x.
    """

    matrices: tuple[np.ndarray, ...]

    @property
    def dimension(self) -> int:
        return 3

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(Parameter(f"S{k}", "1", f"S{k}", "strain") for k in range(len(self.matrices)))

    def error(self, x: np.ndarray, a: np.ndarray, p: np.ndarray) -> np.ndarray:
        return p + np.asarray(self.jacobian(x, a, p) @ a)

    def jacobian(self, x: np.ndarray, a: np.ndarray, p: np.ndarray) -> np.ndarray:
        columns = [x @ one.T for one in self.matrices]
        return np.stack(columns, axis=2) if columns else np.zeros((*x.shape, 0))

    def reported(self) -> Reported:
        return Reported.as_is(self.parameters)


X, Y, Z = (np.outer(axis, axis) for axis in np.eye(3))
SHEAR = np.outer(np.eye(3)[0], np.eye(3)[1])
LINE = np.linspace(-0.5, 0.5, 3)
# In the middle of which a point is no distance from the centroid along any axis.
SYMMETRIC = np.array(list(itertools.product(LINE, LINE, LINE)))
PLACES = {
    "symmetric": SYMMETRIC,
    "elsewhere": SYMMETRIC + [0.2, 0.7, 0.1],
    "random": np.random.default_rng(1).random((20, 3)),
    "none": np.zeros((0, 3)),
    "level": np.random.default_rng(2).random((20, 3)) * [1.0, 1.0, 0.0],
}


@pytest.mark.parametrize(
    ("matrices", "in_space", "in_a_level"),
    [
        ((X + Y + Z,), True, True),
        ((X, Y, Z), True, True),
        ((X - Y, SHEAR, 1e-6 * Z, X + Y), True, True),
        ((X + Y + Z + SHEAR,), False, False),
        ((X + Y + Z + SHEAR, 1e6 * SHEAR), True, True),
        ((X + Y + Z + 1e-8 * SHEAR,), True, True),
        ((X + Y,), False, True),
        ((X, Y, SHEAR), False, True),
        ((X, Z), False, False),
        ((0.0 * X,), False, False),
        ((), False, False),
    ],
)
@pytest.mark.parametrize("points", PLACES.values(), ids=PLACES)
def test_a_model_stretches_where_it_holds_the_unit_strain(
    matrices: tuple[np.ndarray, ...], in_space: bool, in_a_level: bool, points: np.ndarray
) -> None:
    """At all points at once, which in a level are less than the whole volume."""
    design = plate_design(
        grid(3), six_positions(), (), (), position_coefficients=3, rotation_coefficients=3
    )
    model = Strains(matrices)
    moved = altered(design, model=model, evaluation={"points": points})
    is_level = len(points) > 0 and not np.ptp(points[:, 2])
    expected = in_a_level if is_level else in_space
    assert can_stretch(moved, nominal_state(moved)) is expected
    volume = Volume(np.array([-0.5, 0.0, 0.2]), np.array([0.5, 2.0, 0.6]))
    assert stretches(model, volume, np.zeros(len(matrices))) is in_space


def with_points(at: Linearisation, points: np.ndarray) -> Linearisation:
    """The same with other evaluation points (n, d)."""
    evaluation = replace(at.design.evaluation, points=points)
    return replace(at, design=replace(at.design, evaluation=evaluation))


def test_the_scale_is_the_mean_change_of_distances_also_in_a_plane() -> None:
    """Weighted by their squares; of one point or none, or of points that coincide, that of the
    corners of the volume.
    """
    at = linearise(lay_out(load("designs/quickstart.yaml")[0]))
    volume = at.design.machine.volume
    corners = np.array(list(itertools.product(*zip(volume.lower, volume.upper, strict=True))))
    for few in (corners[:0], corners[:1], corners[[3, 3]]):
        np.testing.assert_array_equal(
            scale_row(with_points(at, few)), scale_row(with_points(at, corners))
        )
    for points in (corners, corners[:4], corners[[0, 2, 6]]):
        moved = with_points(at, points)
        pairs = np.stack(np.triu_indices(len(points), 1), axis=1)
        probes = np.full(len(points), at.design.evaluation.probe)
        distances = Distances(MeasuredPoints(points, probes), pairs, ("",) * len(pairs))
        changes = linear_functions(moved, distances).shared
        places = MeasuredPoints(points, probes).at(at.design, at.state)
        lengths = np.linalg.norm(places[pairs[:, 0]] - places[pairs[:, 1]], axis=1)
        row = (lengths @ changes) / (lengths**2).sum()
        np.testing.assert_allclose(scale_row(moved), row, atol=1e-6 * np.abs(row).max())
