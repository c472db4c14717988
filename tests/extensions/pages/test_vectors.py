"""Residual vectors as a picture."""

from __future__ import annotations

from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.estimators.reversal_fits import fit_reversal
from ballplate.presentation.scenes import LONGEST, Vectors, draw_vectors, magnification
from ballplate.results.fitting import fit
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.readings.reading_files import read_readings

pytest.importorskip("matplotlib", reason="pictures need matplotlib")

FOLDER = Path("designs/hocken_borchardt")
REAL = [str(FOLDER / "real.yaml"), str(FOLDER / "real-readings.csv"), "--variant", "with scale"]


def test_vectors_are_the_residuals() -> None:
    experiment = load(FOLDER / "real.yaml")[0]
    observed = read_readings(FOLDER / "real-readings.csv", lay_out(experiment))
    found = fit(experiment, observed)
    turned, first = found.residual_vectors()
    assert (turned.label, first.label) == ("turned", "first") and turned.residuals.shape == (13, 2)
    every = np.concatenate([turned.residuals, first.residuals])
    assert np.abs(every).max() == pytest.approx(abs(found.largest[0].value))
    assert (every**2).sum() / 0.0254e-6**2 == pytest.approx(found.solution.factor.sum_of_squares)
    np.testing.assert_array_equal(first.places, observed.x[observed.design.readings.position == 1])
    # The reversal has the residuals of both positions in the first: as much each, and so twice as
    # much there.
    (both,) = fit_reversal(experiment, observed).residual_vectors()
    np.testing.assert_array_equal(both.places, first.places)
    np.testing.assert_allclose(both.residuals, 2 * first.residuals, rtol=0, atol=5e-9)


@pytest.mark.parametrize("size", [1e-9, 3.1e-7, 0.5e-6, 2e-5])
def test_the_longest_vector_takes_its_part_of_the_drawing(size: float) -> None:
    group = Vectors("", np.zeros((2, 2)), np.array([[0.0, size], [size / 3, 0.0]]))
    assert 0.4 * LONGEST * 0.3 < size * magnification((group,), 0.3) <= LONGEST * 0.3 * (1 + 1e-9)


def test_too_many_names_are_left_out(tmp_path: Path) -> None:
    names = tuple(f"b{k}" for k in range(61))
    places = np.stack([np.arange(61.0), np.arange(61.0) % 7], axis=1)
    for count in (60, 61):
        group = Vectors("", places[:count], np.full((count, 2), 1e-6), names[:count])
        draw_vectors((group,), "many", tmp_path / "many.svg")
        assert ("<!-- b59 -->" in (tmp_path / "many.svg").read_text()) == (count == 60)


def test_fit_draws_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, estimator in (("full.svg", "full"), ("reversal.svg", "reversal")):
        assert main(["fit", *REAL, "--estimator", estimator, "--plot", str(tmp_path / name)]) == 0
        drawn = (tmp_path / name).read_text()
        found = bp.fit(bp.load(REAL[0], REAL[-1]), REAL[1], estimator=estimator)
        found.plot(tmp_path / "method.svg")
        assert "magnified" in drawn and drawn == (tmp_path / "method.svg").read_text()
        # Ball 13, which the documentation speaks of, can be found.
        assert drawn.count("<!-- 13 -->") == (2 if estimator == "full" else 1)
    assert main(["fit", *REAL, "--plot", str(tmp_path / "none" / "a.svg")]) == 3
    assert "cannot be written" in capsys.readouterr().err
    assert main(["fit", *REAL, "--estimator", "kruth", "--plot", str(tmp_path / "a.svg")]) == 2
    assert "--plot draws residuals" in capsys.readouterr().err
