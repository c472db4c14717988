"""Certified distances that follow from others: what is drawn or computed contradicts nothing."""

from __future__ import annotations

from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.estimation.implied_values import implied_values
from ballplate.simulator.experiment.layout import lay_out

from tests.reference.small_quickstart import small_quickstart

QUICKSTART = Path("designs/quickstart.yaml").read_text(encoding="utf-8")

SMALL = """
title: small
machine: {volume: [600 mm, 500 mm, 400 mm], repeatability: 0.5 um}
error_model: {kind: metric}
probes: {down: [0 mm, 0 mm, -50 mm], right: [60 mm, 0 mm, 0 mm]}
artefacts: {plate: {kind: grid, balls: [2, 2], size: [300 mm, 300 mm]}}
positions:
  - {name: low, plane: z, level: 100 mm, corner: {x: 50 mm, y: 50 mm}, probes: [down]}
  - {name: wall, plane: x, level: 200 mm, corner: {y: 50 mm, z: 45 mm}, probes: [right, down]}
  - {name: side, plane: y, level: 200 mm, corner: {z: 45 mm, x: 50 mm}, probes: [down]}
calibration:
  - {kind: distances, pairs: all, standard_uncertainty: 0.5 um}
evaluation: {points: {random: 8, seed: 1}, probe: down}
"""


def loaded(folder: Path, text: str) -> bp.Experiment:
    (folder / "some.yaml").write_text(text, encoding="utf-8")
    return bp.load(folder / "some.yaml")


# In a plane n balls have 2 n - 3 distances that tell of their places.
@pytest.mark.parametrize(
    ("pairs", "implied"),
    [("corner sides", 0), ("corners", 6 - 5), ("neighbours", 0), ("all", 300 - 47)],
)
def test_drawn_distances_follow_from_as_many_as_there_are_co_ordinates(
    pairs: str, implied: int, tmp_path: Path
) -> None:
    text = QUICKSTART.replace("pairs: corner sides", f"pairs: {pairs}")
    design = lay_out(loaded(tmp_path, text))
    assert implied_values(design, design.balls.places) == implied
    distances, generator = design.of(CalibratedDistances), np.random.default_rng(1)
    measured = distances.value + distances.errors(generator, 1)[0]
    assert not implied_values(design.observed(distances.given(value=measured)), design.balls.places)


def test_sum_of_squares_is_that_of_the_degrees_of_freedom() -> None:
    every = {"kind": "distances", "pairs": "all", "standard_uncertainty": "0.2 um"}
    given = small_quickstart(calibration=[every])
    fits = [bp.fit(given, bp.simulate(given, seed=seed)) for seed in range(8)]
    freedom = fits[0].degrees_of_freedom
    assert freedom == lay_out(given).observation_count - lay_out(given).parameter_count - (36 - 15)
    mean = np.mean([fit.sum_of_squares for fit in fits])
    assert abs(mean - freedom) < 4.0 * np.sqrt(2.0 * freedom / len(fits))


def test_noise_alone_contradicts_nothing_where_distances_agree_exactly(tmp_path: Path) -> None:
    given = loaded(tmp_path, SMALL)
    fits = [bp.fit(given, bp.simulate(given, seed=seed)) for seed in range(8)]
    found = [fit.diagnosis.findings for fit in fits if fit.diagnosis is not None]
    # At a level of 1 %.
    assert len(found) == len(fits) and sum(map(bool, found)) < 2
