"""Results that draw themselves: a figure, a file, what a notebook shows, and what is said where
that cannot be.
"""

from __future__ import annotations

import io
import sys
from pathlib import Path

import ballplate as bp
import pytest
from ballplate.cli import main
from ballplate.results.prediction import Prediction

from tests.extensions.pages import wording

pytest.importorskip("matplotlib", reason="pictures need matplotlib")
MACHINE = "designs/park/machines/npl-like.yaml"
PLACES = {
    "planes": ["z"],
    "levels": ["100 mm", "400 mm"],
    "corners": {"x": ["50 mm"], "y": ["50 mm"]},
}


@pytest.fixture(scope="module")
def planned() -> Prediction:
    return bp.check(bp.quickstart())


def test_a_figure_is_the_picture_of_the_command(tmp_path: Path) -> None:
    """The same bytes from the method and from the command."""
    command, method = tmp_path / "command.svg", tmp_path / "method.svg"
    assert main(["map", MACHINE, "--grid", "2,2,2", "--plot", str(command)]) == 0
    figure = bp.map(MACHINE, grid=(2, 2, 2)).plot(method)
    assert method.read_bytes() == command.read_bytes()
    assert "magnified" in str(figure.get_label())


def test_a_notebook_shows_a_figure(planned: Prediction) -> None:
    from matplotlib.image import imread

    figure = planned.plot()
    image = imread(io.BytesIO(figure._repr_png_()), format="png")
    # Opaque and white at its corner, as dark letters need it, with something drawn on it.
    assert image[0, 0].min() == 1.0 and image[..., :3].min() < 0.2


def test_predictions_and_plans_draw_their_positions(tmp_path: Path) -> None:
    prediction = bp.check(bp.quickstart())
    names = [text.get_text() for text in prediction.plot().axes[0].texts]
    assert set(prediction.design.positions.names) <= set(names)
    pool = {"candidates": [PLACES | {"probes": ["down"]}]}
    campaign = bp.plan(bp.quickstart().with_(pool=pool), positions=7)
    assert repr(campaign).startswith(wording.CAMPAIGN_OF_QUICKSTART) and len(repr(campaign)) < 100
    assert bp.run(campaign.chosen_experiment).quantities == campaign.prediction.quantities
    figure = campaign.plot(str(tmp_path / "plan.png"))
    assert (tmp_path / "plan.png").read_bytes().startswith(b"\x89PNG")
    drawn = {text.get_text() for axes in figure.axes for text in axes.texts}
    assert {campaign.title_of(one) for one in campaign.chosen} <= drawn


def test_what_cannot_be_drawn_is_refused(planned: Prediction, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=wording.SHOULD_END_IN_ONE_OF_SVG):
        planned.plot(tmp_path / "picture.jpg")


def test_a_missing_matplotlib_is_named_with_the_command(
    planned: Prediction, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [one for one in sys.modules if one.partition(".")[0] == "matplotlib"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(ImportError, match=r"python -m pip install 'ballplate\[report\]'"):
        planned.plot()
