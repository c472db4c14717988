"""Questions of the data sheet as a form, and what is made of answers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from ballplate.cli import main
from ballplate.extensions.drafting.data_sheet import READERS
from ballplate.extensions.drafting.machine_tables import chain_words, table
from ballplate.extensions.drafting.sheet_form import sheet_draft, sheet_questions

from tests.extensions.drafting import wording
from tests.extensions.drafting.sheets import BRIDGE, SHEETS, options

QUESTIONS = {question["name"]: question for question in sheet_questions()}


def entry(question: dict[str, Any], unit: int = 0) -> str:
    """What a form answers with the defaults of all fields, in one of their units."""
    text = ""
    for field in question["fields"]:
        units = field.get("units", [])
        chosen = units[min(unit, len(units) - 1)] if units else field | {"text": "{}"}
        text += chosen["text"].replace("{}", chosen["default"]) if chosen.get("default") else ""
    return text


def test_questions_are_those_of_init() -> None:
    """By name and order, and fields left as they are give the entry that it takes."""
    assert list(QUESTIONS) == list(READERS)
    for name, question in QUESTIONS.items():
        assert question["label"] and question["hint"] and question["default"] == entry(question)
        assert question["default"] or question["usual"], name
    for name in ("mpe", "plate"):
        again = READERS[name](entry(QUESTIONS[name], 1))
        assert again == READERS[name](QUESTIONS[name]["default"]), name
    assert [one["value"] for one in QUESTIONS["tips"]["fields"][0]["choices"]] == [*table("tips")]


def test_machines_are_choices_with_their_chain_of_axes_and_a_picture() -> None:
    choices = QUESTIONS["machine_type"]["fields"][0]["choices"]
    assert (
        choices[0]["value"] == "moving bridge"
        and choices[0]["words"] == f"MB1: {chain_words('MB1')}"
    )
    drawn = {choice["value"] for choice in choices if choice["shapes"]}
    assert drawn == {*table("kinds")}
    for choice in choices:
        assert READERS["machine_type"](choice["value"]) == choice["value"]
        letters = [one["text"] for one in choice["shapes"] if one["role"] == "letter"]
        assert not letters or {*letters} >= {*"xyz"}, choice["value"]


@pytest.mark.parametrize("name", SHEETS)
def test_the_same_answers_give_the_file_of_init(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    sheet = SHEETS[name] | {"tips": "star, 40 mm", "temperature": "0.1 K", "hours": "8"}
    assert main(["init", "m.yaml", *options(sheet), "--quiet"]) == 0
    draft = sheet_draft(Path("m.yaml"), sheet | {"repeatability": " "})
    assert draft["messages"] == {}
    assert draft["text"].encode() == Path("m.yaml").read_bytes()
    assert set(draft["words"]) < set(READERS) and "40 mm long" in draft["words"]["tips"]
    roles = [shape["role"] for shape in draft["shapes"]]
    assert roles.count("plate") == draft["text"].count("plane: ") >= 6
    assert roles.count("volume") == 6


@pytest.mark.parametrize(
    ("changed", "messages"),
    [
        (
            {"volume": "900 1200 700 500 mm", "temperature": "20 degC"},
            {"volume": wording.FOUR_LENGTHS, "temperature": wording.NO_UNCERTAINTY_OF_TEMPERATURE},
        ),
        ({"repeatability": "2 um"}, {"repeatability": wording.COARSE_REPEATABILITY}),
    ],
)
def test_wrong_answers_are_reported_by_name(
    changed: dict[str, str], messages: dict[str, str]
) -> None:
    found = sheet_draft(Path("m.yaml"), BRIDGE | changed)["messages"]
    assert set(found) == set(messages)
    assert all(text in found[name] for name, text in messages.items())
