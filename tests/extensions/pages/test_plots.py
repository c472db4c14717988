"""Results that draw themselves: a figure, a file, what a notebook shows, and what is said where
that cannot be.
"""

from __future__ import annotations

import io
import sys
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.results.fits import Fit

from tests.extensions.pages import wording

pytest.importorskip("matplotlib", reason="pictures need matplotlib")

REAL = (
    Path("designs/hocken_borchardt/real.yaml"),
    Path("designs/hocken_borchardt/real-readings.csv"),
)
PLACES = {
    "planes": ["z"],
    "levels": ["100 mm", "400 mm"],
    "corners": {"x": ["50 mm"], "y": ["50 mm"]},
}


@pytest.fixture(scope="module")
def planar() -> Fit:
    return bp.fit(bp.load(REAL[0], "with scale"), REAL[1])


def test_vectors_begin_where_balls_were_read(planar: Fit) -> None:
    """Of the drawn markers each is at the place of a reading, in millimetres."""
    axes = planar.plot().axes[0]
    markers = [line.get_xydata()[::3] for line in axes.lines if line.get_markevery() == 3]
    drawn = np.array(sorted(np.concatenate(markers).tolist()))
    np.testing.assert_allclose(drawn, sorted((1e3 * planar.observed.x).tolist()))


def test_a_notebook_shows_a_figure(planar: Fit) -> None:
    from matplotlib.image import imread

    figure = planar.plot()
    image = imread(io.BytesIO(figure._repr_png_()), format="png")
    # Opaque and white at its corner, as dark letters need it, with something drawn on it.
    assert image[0, 0].min() == 1.0 and image[..., :3].min() < 0.2


def test_a_plan_is_run_as_it_was_predicted() -> None:
    pool = {"candidates": [PLACES | {"probes": ["down"]}]}
    campaign = bp.plan(bp.quickstart().with_(pool=pool), positions=7)
    assert repr(campaign).startswith(wording.CAMPAIGN_OF_QUICKSTART) and len(repr(campaign)) < 160
    assert bp.run(campaign.chosen_experiment).quantities == campaign.prediction.quantities


def test_what_cannot_be_drawn_is_refused(planar: Fit, tmp_path: Path) -> None:
    experiment = bp.quickstart()
    other = bp.fit(experiment, bp.simulate(experiment), estimator="distances")
    with pytest.raises(ValueError, match=wording.BY_THE_FULL_ESTIMATOR_AND_REVERSAL):
        other.plot()
    with pytest.raises(ValueError, match=wording.SHOULD_END_IN_ONE_OF_SVG):
        planar.plot(tmp_path / "picture.jpg")


def test_a_missing_matplotlib_is_named_with_the_command(
    planar: Fit, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [one for one in sys.modules if one.partition(".")[0] == "matplotlib"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(ImportError, match=r"python -m pip install 'ballplate\[report\]'"):
        planar.plot()
