"""The studio's verdict on targets, which a person acts on, and its hours of measuring."""

from __future__ import annotations

from pathlib import Path

import pytest
from ballplate.designs import shipped

pytest.importorskip("starlette", reason="the studio is an extra")

from ballplate.extensions.studio.actions import done
from ballplate.extensions.studio.document import DesignDocument
from ballplate.extensions.studio.judging import VIEWS, judgement
from ballplate.simulator.computing import unreported

TEXT = Path(shipped("quickstart.yaml")).read_text(encoding="utf-8")
POINTS = "[[250 mm, 250 mm, 250 mm], [750 mm, 250 mm, 250 mm], [750 mm, 750 mm, 250 mm]]"


def document(text: str = TEXT) -> DesignDocument:
    return DesignDocument(Path("/nowhere/plate.yaml"), None, text, None)


def with_values(**values: str) -> DesignDocument:
    found = document()
    for key, value in values.items():
        found = done(found, {"do": "set", "path": key.split("__"), "value": value})
    return found


def drawn(found: DesignDocument) -> dict:
    return VIEWS["drawn"](found, {"revision": 0}, unreported)


def verdict(found: DesignDocument) -> str:
    answer = judgement(found).answer
    assert answer is not None
    word: str = answer["met"]
    return word


def test_one_length_of_many_is_enough_to_miss_a_target():
    """The largest U6 is between these two targets, and nearly all lengths are below both."""
    largest = next(
        row["maximum"]
        for row in judgement(document()).answer["quantities"]
        if row["symbol"] == "U6"
    )
    for factor, word in ((1 + 1e-6, "met"), (1 - 1e-6, "missed")):
        target = f"{factor * 1e6 * largest:.9f} um"
        assert verdict(with_values(target_uncertainty=target)) == word
    assert verdict(with_values(target_uncertainty="")) == ""


def test_an_undetermined_design_misses_its_target_or_leaves_it_undecided():
    """Whatever lengths are evaluated: these three do not show what is undetermined."""
    found = with_values(evaluation__points=POINTS)
    assert verdict(found) == "met"
    for name in ("y low", "y high"):
        found = done(found, {"do": "off", "position": name})
    answer = judgement(found).answer
    assert answer["rank"]["deficiency"] == 5 and answer["within"] == 1.0
    assert answer["met"] == "undecided"
    # The file may expect it; another number is not expected.
    for expected, word in ((5, "met"), (4, "undecided")):
        action = {"do": "set", "path": ["expected_rank_deficiency"], "value": str(expected)}
        assert verdict(done(found, action)) == word
    # Undetermined lengths miss any target.
    for name in ("x low", "x high", "z high"):
        found = done(found, {"do": "off", "position": name})
    action = {"do": "set", "path": ["target_uncertainty"], "value": "1 m"}
    assert verdict(done(found, action)) == "missed"


def test_without_evaluated_lengths_no_target_is_judged():
    answer = judgement(with_values(evaluation__points="[]")).answer
    assert answer is None or (answer["met"] == "" and answer["shares"] == [])


def test_a_measuring_task_misses_its_own_target():
    ends = "from: [100 mm, 100 mm, 100 mm], to: [300 mm, 100 mm, 100 mm]"
    for target, word, share in (("1 um", "met", "100 %"), ("1 nm", "missed", "0 %")):
        tasks = f"[{{name: bore, {ends}, target_uncertainty: {target}}}]"
        found = with_values(evaluation__tasks=tasks)
        answer = judgement(found).answer
        assert answer["met"] == word and answer["within"] == 1.0
        assert answer["shares"][1].startswith(f"{share} of the lengths of measuring tasks")


def test_hours_are_those_of_the_order_of_least_change_over():
    """Set-ups of 20 min, readings of 15 s, 4 changes of tips within and 2 between positions of 2 min,
    and 2 changes of plane of 30 min; with times that the file states, those.
    """
    found = drawn(document())
    assert found["usual"]
    assert found["hours"] * 60 == pytest.approx(6 * 20 + 250 / 4 + 6 * 2 + 2 * 30)
    times = "{set_up: 10 min, reading: 30 s, probe_change: 0 s, plane_change: 0 s}"
    found = drawn(with_values(pool=f"{{times: {times}}}"))
    assert not found["usual"] and found["hours"] * 60 == pytest.approx(6 * 10 + 250 / 2)
    # Positions that are off take no time.
    off = done(document(), {"do": "off", "position": "z low"})
    assert drawn(off)["hours"] * 60 < 6 * 20 + 250 / 4 + 6 * 2 + 2 * 30 - 20


def test_an_effect_is_stated_where_a_file_has_none():
    """The first makes the list, the second is added to it."""
    found = document()
    for kind in ("{kind: sag, standard_uncertainty: 0.3 um}", "{kind: probing}"):
        found = done(found, {"do": "set", "path": ["influences", "+"], "value": kind})
    judged = judgement(found)
    assert [entry["kind"] for entry in judged.data["influences"]] == ["sag", "probing"]
    assert judged.messages == () and found.text.startswith(TEXT.rstrip("\n"))


def test_the_example_of_two_axes_meets_its_target():
    text = Path(judgement.__code__.co_filename).parent.joinpath("static", "two-axes.yaml")
    judged = judgement(document(text.read_text(encoding="utf-8")))
    assert judged.answer["rank"]["deficiency"] == 0 and judged.answer["met"] == "met"
    assert judged.scene["dimension"] == 2 and judged.messages == ()
