"""Places by intent in the studio, in repairs, in plans and on run sheets: what is moved becomes a
length, what is not moved stays as it is written, and no pose changes unasked.
"""

from __future__ import annotations

from pathlib import Path

import ballplate as bp
import numpy as np
import pytest

pytest.importorskip("starlette", reason="the studio is an extra")

from ballplate.extensions.studio.actions import done
from ballplate.extensions.studio.document import DesignDocument, experiment_of, opened
from ballplate.extensions.studio.judging import judgement


@pytest.fixture
def document(design: Path) -> DesignDocument:
    return opened(design)


def line_of(document: DesignDocument, name: str) -> str:
    return next(line for line in document.text.splitlines() if f"name: {name}," in line)


def origins(experiment: bp.Experiment) -> dict[str, list[float]]:
    return {place.name: place.pose.origin.tolist() for place in experiment.positions}


def test_dragging_writes_lengths_along_the_axes_that_change(document: DesignDocument) -> None:
    moved = done(document, {"do": "move", "position": "z low", "by": [0.1, 0, 0]})
    assert "level: 30 %, corner: {x: 100 mm, y: low}" in line_of(moved, "z low")
    lines = zip(document.text.splitlines(), moved.text.splitlines(), strict=True)
    assert [old for old, new in lines if old != new] == [line_of(document, "z low")]
    before, after = origins(experiment_of(document)), origins(experiment_of(moved))
    assert after["z low"] == pytest.approx(np.add(before["z low"], [0.1, 0.0, 0.0]))
    del before["z low"], after["z low"]
    assert before == after


@pytest.mark.parametrize(
    "action",
    [
        {"do": "probes", "position": "z low", "probes": ["left", "down"]},
        {"do": "balls", "position": "z low", "balls": ["r3c1", "r1c1", "r2c2"]},
    ],
)
def test_other_readings_leave_the_plate_where_it_is(
    document: DesignDocument, action: dict[str, object]
) -> None:
    changed = done(document, action)
    assert "level: 250 mm, corner: {x: 0 mm, y: 0 mm}" in line_of(changed, "z low")
    assert origins(experiment_of(changed)) == origins(experiment_of(document))
    (group,) = experiment_of(changed).positions[0].readings
    assert list(group.probes) == action.get("probes", ["down"])
    # In the order of the artefact.
    assert "balls" not in action or group.balls == ("r1c1", "r2c2", "r3c1")


@pytest.mark.parametrize("name", ["z low", "x high"])
def test_turned_standing_copied_and_added_plates_are_where_they_are_drawn(
    document: DesignDocument, name: str
) -> None:
    oblong = document.text.replace("[750 mm, 750 mm]", "[400 mm, 300 mm]")
    oblong = oblong.replace(": low", ": 40 %").replace(": high", ": 60 %")
    document = done(document, {"do": "text", "text": oblong})
    for action in (
        {"do": "turn", "position": name},
        {"do": "stand", "position": name, "across": "y"},
        {"do": "copy", "position": name},
        {"do": "put", "like": name, "at": [0.5, 0.5, 0.5]},
    ):
        changed = done(document, action)
        scene = judgement(changed).scene
        assert scene is not None
        drawn = {place["name"]: place["origin"] for place in scene["positions"]}
        for place, origin in origins(experiment_of(changed)).items():
            assert drawn[place] == pytest.approx(origin, abs=1e-9)


def test_what_is_put_without_a_place_is_far_from_the_others(document: DesignDocument) -> None:
    text = document.text
    begin = text.index("  - {name: z high")
    one = done(document, {"do": "text", "text": text[:begin] + text[text.index("calibration:") :]})
    first, second = origins(experiment_of(done(one, {"do": "put"}))).values()
    assert np.abs(np.subtract(first, second)).max() > 0.2


def test_a_typed_place_is_kept(document: DesignDocument) -> None:
    path = ["positions", 1, "corner", "x"]
    typed = done(document, {"do": "set", "path": path, "value": "middle"})
    assert "corner: {x: middle, y: high}" in line_of(typed, "z high")
    assert origins(experiment_of(typed))["z high"][0] == pytest.approx(0.75 + 0.125)
    wrong = judgement(done(document, {"do": "set", "path": path, "value": "midle"}))
    assert any('did you mean "middle"?' in message.text for message in wrong.messages)


def test_a_plate_too_large_is_drawn_and_reported(document: DesignDocument) -> None:
    path = ["artefacts", "plate", "size"]
    large = judgement(done(document, {"do": "set", "path": path, "value": "[1200 mm, 900 mm]"}))
    assert large.scene is not None and len(large.scene["positions"]) == 6
    problems = [place["problem"] for place in large.scene["positions"]]
    assert all("there is no room along" in problem for problem in problems)
