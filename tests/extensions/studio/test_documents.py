"""A design file while it is changed: steps back and forward, saving, what others wrote."""

import pytest
from ballplate.extensions.studio.actions import ActionError, done
from ballplate.extensions.studio.document import (
    ChangedOnDiskError,
    experiment_of,
    opened,
    redone,
    reopened,
    saved,
    undone,
)
from ballplate.simulator.inputs.messages import ExperimentError


def test_steps_back_and_forward_lead_through_the_same_texts(design):
    texts = [opened(design).text]
    document = opened(design)
    for k in (6, 7, 8):
        action = {"do": "set", "path": ["artefacts", "plate", "balls"], "value": f"[{k}, {k}]"}
        document = done(document, action)
        texts.append(document.text)
    for text in texts[-2::-1]:
        document = undone(document)
        assert document.text == text
    assert undone(document) is document and document.is_saved
    for text in texts[1:]:
        document = redone(document)
        assert document.text == text
    assert redone(document) is document and not document.is_saved


def test_saving_writes_the_text_and_keeps_mark_and_permissions(design):
    design.write_bytes(b"\xef\xbb\xbf" + design.read_bytes())
    design.chmod(0o640)
    document = done(opened(design), {"do": "turn", "position": "z low"})
    after = saved(document)
    assert after.is_saved
    assert design.read_bytes() == b"\xef\xbb\xbf" + document.text.encode()
    assert design.stat().st_mode & 0o777 == 0o640
    assert [one.name for one in design.parent.iterdir()] == ["plate.yaml"]


@pytest.mark.parametrize("how", ["changed", "removed"])
def test_what_others_did_to_the_file_is_never_overwritten(design, how):
    document = done(opened(design), {"do": "turn", "position": "z low"})
    if how == "changed":
        design.write_bytes(design.read_bytes() + b"# another hand\n")
    else:
        design.unlink()
    with pytest.raises(ChangedOnDiskError, match=f"has .*{how} on disk"):
        saved(document)
    assert not design.exists() or design.read_bytes().endswith(b"# another hand\n")


def test_another_name_that_is_taken_is_not_overwritten(design):
    other = design.with_name("other.yaml")
    other.write_text("mine")
    with pytest.raises(ChangedOnDiskError, match="is there already"):
        saved(opened(design), other)
    assert other.read_text() == "mine"


def test_reading_the_file_again_leaves_the_text_that_was_here_one_step_back(design):
    document = done(opened(design), {"do": "turn", "position": "z low"})
    design.write_bytes(design.read_bytes() + b"# another hand\n")
    again = reopened(document)
    assert again.text.endswith("# another hand\n") and again.is_saved
    assert undone(again).text == document.text
    # What is saved from there was seen.
    assert saved(undone(again)).is_saved


def test_standing_across_another_axis_keeps_the_middle(design):
    before = opened(design)
    up = done(before, {"do": "move", "position": "z low", "by": [0.1, 0.1, 0.3]})
    read = done(up, {"do": "probes", "position": "z low", "probes": ["right", "left"]})
    after = done(read, {"do": "stand", "position": "z low", "across": "x"})
    old, new = (experiment_of(one) for one in (up, after))
    middles = []
    for experiment in (old, new):
        pose, layout = experiment.positions[0].pose, experiment.layouts["plate"]
        middle = layout.coordinates.mean(axis=0)
        middles.append(pose.rotation @ middle + pose.origin)
    assert middles[1] == pytest.approx(middles[0], abs=1e-9)
    assert abs(new.positions[0].pose.rotation[:, 2]) == pytest.approx([1.0, 0.0, 0.0])


@pytest.mark.parametrize(
    "action, words",
    [
        ({"do": "fly"}, 'no action "fly"'),
        ({}, 'no action "None"'),
        ({"do": "move", "position": "z low"}, "move needs 'by'"),
        ({"do": "move", "position": "nowhere", "by": [0, 0, 0]}, 'no position "nowhere"'),
        ({"do": "move", "position": "z low", "by": [0.1, 0.1]}, "2 co-ordinates in 3 dimensions"),
        ({"do": "move", "position": "z low", "by": [0, 0, "nan"]}, "is no vector"),
        ({"do": "stand", "position": "z low", "across": "w"}, "across is x, y or z"),
        ({"do": "balls", "position": "z low", "balls": ["r9c9"]}, 'no ball "r9c9"'),
        ({"do": "balls", "position": "z low", "balls": []}, "reads some ball"),
        ({"do": "set", "path": "title", "value": "x"}, "a path is a list"),
        ({"do": "set", "path": ["title"], "value": "[1, 2"}, "is no value of a file"),
    ],
)
def test_what_an_action_lacks_is_told(design, action, words):
    with pytest.raises(ActionError) as told:
        done(opened(design), action)
    assert words in str(told.value)


def test_a_text_that_is_wrong_is_kept_and_told_with_its_line(design):
    document = done(opened(design), {"do": "text", "text": "title: [\n"})
    with pytest.raises(ExperimentError) as told:
        experiment_of(document)
    assert told.value.messages[0].line == 2
    assert undone(document).is_saved
