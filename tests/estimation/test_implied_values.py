"""Certified distances that follow from others: what is drawn or computed contradicts nothing."""

from __future__ import annotations

from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.estimation.implied_values import implied_count
from ballplate.simulator.experiment.layout import lay_out
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import chi2

from tests.reference.small_plate import PLATE
from tests.reference.small_quickstart import small_quickstart

QUICKSTART = Path("designs/quickstart.yaml").read_text(encoding="utf-8")

SMALL = PLATE.replace("balls: [3, 3]", "balls: [2, 2]")


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
    assert implied_count(design, nominal_state(design)) == implied
    distances, generator = design.of(CalibratedDistances), np.random.default_rng(1)
    measured = distances.value + distances.errors(generator, 1)[0]
    contradicting = design.observed(distances.given(value=measured))
    assert not implied_count(contradicting, nominal_state(design))


def test_sum_of_squares_is_that_of_the_degrees_of_freedom() -> None:
    every = {"kind": "distances", "pairs": "all", "standard_uncertainty": "0.2 um"}
    given = small_quickstart(calibration=[every])
    fits = [bp.fit(given, bp.simulate(given, seed=seed)) for seed in range(8)]
    freedom = fits[0].degrees_of_freedom
    assert freedom == lay_out(given).observation_count - lay_out(given).parameter_count - (36 - 15)
    mean = np.mean([fit.sum_of_squares for fit in fits])
    assert abs(mean - freedom) < 4.0 * np.sqrt(2.0 * freedom / len(fits))


DISTANCES = "{kind: distances, pairs: all, standard_uncertainty: 0.5 um"
SIDES = "{kind: distances, pairs: corner sides, standard_uncertainty: 0.5 um}"
DIAGONALS = SIDES.replace("sides", "diagonals").replace("}", ", common: 0.5 um/m}")
PLACES = "{kind: coordinates, balls: all, standard_uncertainty: 0.5 um}"


@pytest.mark.parametrize(
    "certificates",
    [
        [DISTANCES + "}"],
        [DISTANCES + ", common: 0.5 um/m}"],
        [DISTANCES + ", correlation: 0.5}"],
        [SIDES, DIAGONALS],
        [PLACES, DISTANCES + "}"],
        [PLACES, SIDES],
    ],
)
def test_noise_alone_contradicts_nothing_where_values_agree_exactly(
    certificates: list[str], tmp_path: Path
) -> None:
    given = loaded(tmp_path, SMALL.replace(DISTANCES + "}", ", ".join(certificates)))
    fits = [bp.fit(given, bp.simulate(given, seed=seed)) for seed in range(6)]
    found = [fit.diagnosis.findings for fit in fits if fit.diagnosis is not None]
    # At a level of 1 %.
    assert len(found) == len(fits) and sum(map(bool, found)) < 2
    squares, freedom = [fit.sum_of_squares for fit in fits], fits[0].degrees_of_freedom
    assert abs(np.mean(squares) - freedom) < 4.0 * np.sqrt(2.0 * freedom / len(fits))


@pytest.mark.parametrize("factor", [1.2, 3.0])
def test_too_large_uncertainties_of_distances_tell_nothing_of_readings(factor: float) -> None:
    """Their residuals count for as many degrees of freedom as their squares."""
    every = {"kind": "distances", "pairs": "all", "standard_uncertainty": "0.2 um"}
    given = small_quickstart(calibration=[every])
    design, generator = lay_out(given), np.random.default_rng(2)
    distances = design.of(CalibratedDistances)
    measured = distances.value + distances.errors(generator, 1)[0]
    stated = distances.given(value=measured, uncertainty=factor * distances.uncertainty)
    own = nominal_state(design)
    implied = implied_count(design.observed(stated), own)
    misfit = sum_left(design, distances.given(value=measured)) / factor**2
    assert implied == (round(36 - 15 - misfit) if chi2.cdf(misfit, 21) < 1e-2 else 0)


def sum_left(design: Design, distances: CalibratedDistances) -> float:
    """Sum of squares of distances that no places of the balls explain."""

    def residuals(places: NDArray[np.float64]) -> NDArray[np.float64]:
        balls = np.concatenate([places.reshape(-1, 2), np.zeros((len(places) // 2, 1))], axis=1)
        return np.asarray((distances.values(balls)[0] - distances.value) / distances.uncertainty)

    found = least_squares(residuals, design.balls.places[:, :2].ravel(), x_scale=1e-6, xtol=1e-15)
    return 2.0 * float(found.cost)


@pytest.mark.parametrize("height", ["0.01 mm", "0.1 mm", "1 mm", "40 mm"])
def test_nearly_flat_plates_are_as_their_certificates(height: str, tmp_path: Path) -> None:
    balls = "{a: [0 mm, 0 mm, 0 mm], b: [300 mm, 0 mm, 0 mm], c: [0 mm, 300 mm, Z]"
    balls += ", d: [300 mm, 300 mm, 0 mm], e: [150 mm, 150 mm, Z]}"
    plate = f"{{kind: balls, coordinates: {balls.replace('Z', height)}}}"
    text = SMALL.replace("{kind: grid, balls: [2, 2], size: [300 mm, 300 mm]}", plate)
    given = loaded(tmp_path, text)
    fits = [bp.fit(given, bp.simulate(given, seed=seed)) for seed in range(6)]
    squares, freedom = [fit.sum_of_squares for fit in fits], fits[0].degrees_of_freedom
    assert abs(np.mean(squares) - freedom) < 4.0 * np.sqrt(2.0 * freedom / len(fits))
