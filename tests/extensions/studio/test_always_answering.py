"""Designs that are wrong in some place: they are drawn, changed, and evaluated as far as they go."""

from __future__ import annotations

import ballplate as bp
import numpy as np
import pytest

pytest.importorskip("starlette", reason="the studio is an extra")

from ballplate.extensions.studio import judging
from ballplate.extensions.studio.actions import ActionError, done
from ballplate.extensions.studio.document import DesignDocument, experiment_of, opened, undone
from ballplate.extensions.studio.judging import judgement, previewed
from ballplate.extensions.studio.session import Session

from tests.extensions.studio.small import SMALL as TEXT
from tests.reference.small_quickstart import in_lengths

NAMES = ["z low", "z high", "x low", "x high", "y low", "y high"]


def scene_of(document: DesignDocument) -> dict:
    found = judgement(document).scene
    assert found is not None
    return found


def without(document: DesignDocument, *names: str) -> bp.Experiment:
    text = "".join(
        line
        for line in document.text.splitlines(keepends=True)
        if not any(f"name: {name}," in line for name in names)
    )
    path = document.path.with_name("without.yaml")
    path.write_text(text, encoding="utf-8")
    return bp.load(path)


def u6(found: dict) -> float:
    return next(row["average"] for row in found["quantities"] if row["symbol"] == "U6")


def test_a_plate_outside_is_drawn_there_and_the_rest_is_evaluated(document):
    moved = done(document, {"do": "move", "position": "z high", "by": [0, 0, 2]})
    found = judgement(moved)
    assert [place["name"] for place in found.scene["positions"]] == NAMES
    wrong = {p["name"]: p["problem"] for p in found.scene["positions"] if p["problem"]}
    assert list(wrong) == ["z high"] and "above the measuring volume" in wrong["z high"]
    expected = bp.run(without(document, "z high"))
    assert u6(found.answer) == expected.quantities["U6"].average
    # Other places are changed meanwhile, and it is brought back.
    other = done(moved, {"do": "turn", "position": "x low"})
    back = done(other, {"do": "move", "position": "z high", "by": [0, 0, -2]})
    assert judgement(back).messages == ()
    assert undone(back).text == other.text


def test_nothing_is_refused_because_of_another_place(document):
    """Each action works while a plate is outside, a value is wrong and a name is unknown."""
    wrong = done(document, {"do": "move", "position": "z high", "by": [0, 0, 2]})
    wrong = done(wrong, {"do": "set", "path": ["target_uncertainty"], "value": "much"})
    wrong = done(wrong, {"do": "probes", "position": "y high", "probes": ["back"]})
    wrong = done(wrong, {"do": "text", "text": wrong.text.replace("[back]", "[bakc]")})
    for action in (
        {"do": "move", "position": "z high", "by": [0.01, 0, 0]},
        {"do": "move", "position": "x low", "by": [0.0, 0.01, 0]},
        {"do": "turn", "position": "x low"},
        {"do": "stand", "position": "x low", "across": "y"},
        {"do": "copy", "position": "x low"},
        {"do": "remove", "position": "y high"},
        {"do": "off", "position": "y high"},
        {"do": "put", "at": [0.5, 0.5, 0.5], "like": "x low"},
        {"do": "fit"},
        {"do": "set", "path": ["seed"], "value": "5"},
    ):
        assert done(wrong, action).text != wrong.text, action
    found = judgement(wrong)
    assert found.scene is not None and found.answer is None
    assert {"target_uncertainty", "positions[1]"} <= {m.path for m in found.messages}


def test_what_cannot_be_understood_is_left_out_too(document):
    wrong = done(document, {"do": "text", "text": document.text.replace("[back, front]", "[bakc]")})
    found = judgement(wrong)
    assert [place["name"] for place in found.scene["positions"]] == NAMES[:4]
    assert [place["name"] for place in found.scene["positions"]] + [
        *found.scene["unclear"]
    ] == NAMES
    expected = bp.run(without(document, "y low", "y high"))
    assert found.answer["rank"]["deficiency"] == expected.verdict.deficiency > 0
    assert found.answer["rank"]["observations"] == expected.verdict.observations


def test_the_last_position_goes_and_the_first_comes(document):
    empty = document
    for name in NAMES:
        empty = done(empty, {"do": "remove", "position": name})
    assert scene_of(empty)["positions"] == [] and judgement(empty).answer is None
    first = done(empty, {"do": "put", "at": [0.5, 0.5, 0.5]})
    (place,) = scene_of(first)["positions"]
    assert np.mean(place["balls"], axis=0) == pytest.approx([0.5, 0.5, 0.5])
    assert judgement(first).answer["rank"]["deficiency"] > 0


def test_what_may_be_read_where_it_is_is_not_moved(document):
    """A thousandth of the volume beyond it is no fault."""
    out = done(document, {"do": "move", "position": "z low", "by": [-0.0005, 0.0, 0.0]})
    problems = [place["problem"] for place in scene_of(out)["positions"]]
    assert problems == [None] * len(problems)
    with pytest.raises(ActionError, match="all positions lie within the volume"):
        done(out, {"do": "fit"})


def test_a_plate_larger_than_the_volume_is_named_when_it_cannot_be_fitted(document):
    small = done(
        document, {"do": "set", "path": ["machine", "volume"], "value": "[1 m, 1 m, 0.4 m]"}
    )
    with pytest.raises(ActionError, match=r"position x low takes .* along z, more than the volume"):
        done(small, {"do": "fit"})


@pytest.mark.parametrize("like", ["z low", "x high"])
def test_an_added_position_lies_within_the_volume_wherever_it_is_asked_for(document, like):
    """A plate stands on the floor that is pointed at, and none is outside."""
    spots = [[x, y, 0.0] for x in (0, 0.5, 1) for y in (0, 0.5, 1)]
    for spot in spots:
        put = done(document, {"do": "put", "at": spot, "like": like})
        assert not any(place["problem"] for place in scene_of(put)["positions"]), spot


@pytest.mark.parametrize("sides", [(3.0, 2.0, 0.7), (0.62, 0.62, 0.62)])
def test_positions_are_fitted_to_another_volume(document, sides):
    """All are within it, at its ends if they were at those of the other, and those that were within
    stay where they were.
    """
    written = ", ".join(f"{1e3 * side:g} mm" for side in sides)
    # Places that are parts of the free room follow by themselves.
    document = done(document, {"do": "text", "text": in_lengths(document.text)})
    entered = done(document, {"do": "set", "path": ["machine", "volume"], "value": f"[{written}]"})
    entered = done(
        entered, {"do": "set", "path": ["artefacts", "plate", "size"], "value": "[500 mm, 500 mm]"}
    )
    fitted = done(entered, {"do": "fit"})
    experiment = experiment_of(fitted)
    lowest, highest = np.full(3, np.inf), np.full(3, -np.inf)
    for place in experiment.positions:
        balls = place.pose.origin + (
            experiment.layouts["plate"].coordinates @ place.pose.rotation.T
        )
        for probe in place.probes:
            ends = balls - experiment.probes[probe].offset
            lowest, highest = np.minimum(lowest, ends.min(0)), np.maximum(highest, ends.max(0))
    assert (lowest >= -2e-5).all() and (highest <= np.array(sides) + 2e-5).all()
    assert max(sides) > 1.0 or (highest - lowest > 0.98 * np.array(sides)).all()
    before = scene_of(entered)["positions"]
    after = scene_of(fitted)["positions"]
    pairs = zip(before, after, strict=True)
    moved = [not np.array_equal(old["origin"], new["origin"]) for old, new in pairs]
    assert moved == [old["problem"] is not None for old in before]
    assert not any(new["problem"] for new in after)
    # Comments and everything else are as they were.
    assert [line for line in fitted.text.splitlines() if line.startswith("#")] == [
        line for line in document.text.splitlines() if line.startswith("#")
    ]


@pytest.mark.parametrize(
    "action",
    [
        {"do": "move", "position": "z low", "by": [0.05, 0.0, 0.1]},
        {"do": "move", "position": "x low", "by": [0.9, 0.0, 0.0]},
        {"do": "put", "at": [0.5, 0.5, 0.5]},
        {"do": "off", "position": "z high"},
        {"do": "set", "path": ["machine", "repeatability"], "value": "0.4 um"},
    ],
    ids=str,
)
def test_a_preview_is_what_the_design_becomes(document, action):
    """It writes nothing, and has the figures and the faults of what is written."""
    found, after = previewed(document, action), judgement(done(document, action))
    assert u6(found) == pytest.approx(u6(after.answer), rel=1e-9)
    assert found["rank"]["observations"] == after.answer["rank"]["observations"]
    assert [(place["name"], place["problem"]) for place in found["scene"]["positions"]] == [
        (place["name"], place["problem"]) for place in after.scene["positions"]
    ]


def test_maps_and_motions_of_one_state_are_of_one_evaluation(document):
    judging._evaluated.cache_clear()
    for arguments in ({"map": "lengths"}, {"map": "points"}, {"motion": 0}):
        judging.VIEWS["drawn"](document, arguments | {"revision": 1}, lambda step: None)
    assert judging._evaluated.cache_info().misses == 1
    judging.VIEWS["drawn"](document, {"revision": 2}, lambda step: None)
    assert judging._evaluated.cache_info().misses == 2


def test_keys_in_a_burst_are_one_step_back_and_messages_name_the_position(document):
    session = Session(document.path)
    try:
        for k in range(3):
            action = {"do": "move", "position": "x low", "by": [0.0, 0.01, 0.0], "burst": k > 0}
            session.act(action)
        session.act({"do": "move", "position": "y low", "by": [0.01, 0.0, 2.0], "burst": True})
        (message,) = session.state()["messages"]
        assert message["what"] == 'position "y low"'
        session.act({"do": "undo"})
        session.act({"do": "undo"})
        state = session.state()
        assert state["text"] == TEXT and not state["back"]
    finally:
        session.close()


def test_suggestions_are_for_what_can_be_read(document):
    """A plate outside is no reason not to look for further positions."""
    from ballplate.extensions.repair.candidates import new_positions
    from ballplate.extensions.repair.changes import changed
    from ballplate.extensions.studio.suggestions import next_positions
    from ballplate.results import planned_uncertainty

    outside = done(document, {"do": "move", "position": "z high", "by": [0, 0, 2]})
    expected = done(document, {"do": "off", "position": "z high"})
    found, experiment = next_positions(outside, {}), experiment_of(expected)
    best: dict[object, float] = {}
    for change in new_positions(experiment):
        place, after = change.item, changed(experiment, [change])
        average = planned_uncertainty(after).quantities["U6"].average
        # The best of each plane, each third of the volume that is read and each set of probes.
        normal = int(np.argmax(abs(place.pose.rotation[:, 2])))
        offsets = [experiment.probes[name].offset[normal] for name in place.probes]
        third = np.floor(3 * (place.pose.origin[normal] - np.mean(offsets)))
        key = normal, third, place.probes
        best[key] = min(best.get(key, np.inf), average)
    averages = sorted(best.values())[:5]
    assert [one["average"] for one in found] == pytest.approx(averages, rel=1e-9)
    added = done(outside, {"do": "add", "settings": found[0]["settings"]})
    assert len(scene_of(added)["positions"]) == len(NAMES) + 1


def test_a_further_position_has_a_name_of_its_own_beside_one_that_is_off(document):
    """Both for what is added by hand and for what a repair adds."""
    copied = done(document, {"do": "copy", "position": "z low"})
    off = done(copied, {"do": "off", "position": "z low 2"})
    again = done(off, {"do": "copy", "position": "z low"})
    assert [place["name"] for place in scene_of(again)["positions"]][-2:] == ["z low 2", "z low 3"]
    assert judgement(again).messages == ()
    strict = experiment_of(off)
    from ballplate.extensions.repair.changes import with_added

    added = with_added(strict, strict.positions[0])
    assert added.positions[-1].name == "z low 3"


def test_an_artefact_of_the_pool_alone_is_not_evaluated(tmp_path):
    """What a plan might set up has no readings yet, as for the commands."""
    path = tmp_path / "pool.yaml"
    bar = "artefacts:\n  bar: {kind: two_spheres, length: 500 mm}\n"
    pool = """
pool:
  candidates:
    - {name: on bar, artefact: bar, pose: {origin: [200 mm, 500 mm, 500 mm]}, probes: [down]}
"""
    text = TEXT.replace("artefacts:\n", bar).replace(", plane: ", ", artefact: plate, plane: ")
    text = text.replace("- kind: distances\n", "- kind: distances\n    artefact: plate\n")
    path.write_text(text + pool, encoding="utf-8")
    found, expected = judgement(opened(path)).answer, bp.run(path)
    assert found["rank"]["parameters"] == expected.design.parameter_count
    assert u6(found) == expected.quantities["U6"].average
