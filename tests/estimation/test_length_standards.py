"""What a length standard can tell, against closed forms."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from ballplate.montecarlo.experiments import trials
from ballplate.results.checked_designs import predict
from ballplate.simulator.design.arrays import nominal_state
from ballplate.simulator.design.observations.lengths import Lengths
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.readings.generate import noisy_certificate

QUICKSTART = Path("designs/quickstart.yaml").read_text(encoding="utf-8")


def with_bar(
    tmp_path: Path, positions: int, uncertainty: str, repeatability: str = "included"
) -> Experiment:
    """The quickstart without calibrated sides; a bar of 400 mm along x gives the scale."""
    before, _, after = QUICKSTART.partition("calibration:\n")
    rest = after[after.index("\n\n") :]
    before = before.replace(
        "artefacts:\n",
        "artefacts:\n  bar: {kind: two_spheres, length: 400 mm, role: length_standard}\n",
    )
    before = before.replace("  - {name: ", "  - {artefact: plate, name: ")
    # Offsets that were well known would be a scale, too.
    for name in ("right", "left", "back", "front"):
        before = re.sub(
            rf"  {name}: (\[.*\])",
            rf"  {name}: {{offset: \1, standard_uncertainty: 0.5 mm}}",
            before,
        )
    places = "".join(
        f"  - {{name: bar {k}, artefact: bar, pose: {{origin: [300 mm, {200 + 50 * k} mm, 300"
        " mm]}, probes: [down]}\n"
        for k in range(positions)
    )
    known = (
        "calibration:\n  - {kind: distances, artefact: bar, pairs: all, "
        f"standard_uncertainty: {uncertainty}, repeatability: {repeatability}}}"
    )
    path = tmp_path / f"bar {positions} {repeatability}.yaml"
    path.write_text(before.rstrip() + "\n" + places + "\n" + known + rest, encoding="utf-8")
    (experiment,) = load(path)
    return experiment


@pytest.mark.parametrize("positions", [1, 8])
def test_no_number_of_positions_betters_a_certificate(tmp_path: Path, positions: int) -> None:
    """The scale cannot be known better than the one certified length, and far from its noise just
    as well.
    """
    experiment = with_bar(tmp_path, positions, "20 um")
    found = predict(experiment)
    assert found.verdict.deficiency == 0
    design = lay_out(experiment)
    plate = design.balls.places[design.artefacts.is_plate[design.balls.artefact]]
    longest = max(float(np.linalg.norm(one - other)) for one in plate for other in plate)
    assert 0.999 <= found.quantities["U5"].maximum / (20e-6 * longest / 0.4) < 1.001


def test_ignoring_the_repeatability_counts_each_position_anew(tmp_path: Path) -> None:
    one, four = (
        predict(with_bar(tmp_path, k, "20 um", "ignored")).quantities["U5"].maximum for k in (1, 4)
    )
    assert four == pytest.approx(one / 2, rel=0.01)


def test_a_certificate_has_one_error(tmp_path: Path) -> None:
    design = lay_out(with_bar(tmp_path, 4, "20 um"))
    assert design.of(Lengths).certificate.tolist() == [0, 0, 0, 0]
    certified = noisy_certificate(design, nominal_state(design), np.random.default_rng(1))
    drawn = certified.of(Lengths).value
    assert len(set(drawn.tolist())) == 1 and drawn[0] != 0.4


@pytest.mark.parametrize("file", ["bar-bell", "bryan-gauge"])
def test_a_certificate_that_differs_from_the_drawing_is_no_bias(tmp_path: Path, file: str) -> None:
    text = Path(f"designs/hurt_foss/{file}.yaml").read_text(encoding="utf-8").split("variants:")[0]
    text = text.replace(
        "pairs: all,", 'pairs: all, values: [{balls: ["1", "2"], distance: 500.05 mm}],'
    )
    text = text.replace("kind: radius,", "kind: radius, value: 300.05 mm,")
    (tmp_path / "e.yaml").write_text(text, encoding="utf-8")
    (experiment,) = load(tmp_path / "e.yaml")
    assert "00.05 mm" in text
    done = trials(experiment, 256)
    assert done.outcome is not None
    for one in done.outcome.comparisons.values():
        assert one.bias.value < 5.0 * one.bias.error
        assert abs(one.spread.value - 1.0) < 4.0 * one.spread.error


def test_replicates_scatter_as_foretold(tmp_path: Path) -> None:
    done = trials(with_bar(tmp_path, 4, "2 um", "ignored"), 256)
    assert done.outcome is not None
    for one in done.outcome.comparisons.values():
        assert abs(one.spread.value - 1.0) < 4.0 * one.spread.error
