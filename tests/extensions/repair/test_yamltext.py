"""Changes of a YAML text: everything about the place stays, byte for byte."""

from __future__ import annotations

import copy
from random import Random
from typing import Any

import pytest
from ballplate.extensions.repair.yamltext import TextChange, with_changes
from ballplate.simulator.inputs.messages import ExperimentError
from hypothesis import given, settings, strategies as st

from tests.extensions.repair import wording
from tests.reference.yaml_styles import COMMENTS, Writer, lines_ended, plain

WORDS = ["z low", "Prüfkörper", "a: b", "# no comment", "1e-3", "on", "125 mm", "β, γ", "it's", ""]
KEYS = ["name", "level", "quarter_turns", "ß", "two words", "#7"]


def data(random: Random, depth: int = 0) -> Any:
    kind = random.random()
    if depth == 0 or (depth < 3 and kind < 0.35):
        return {key: data(random, depth + 1) for key in random.sample(KEYS, random.randint(1, 4))}
    if depth < 3 and kind < 0.6:
        return [data(random, depth + 1) for _ in range(random.randint(0, 3))]
    return random.choice([*WORDS, 7, 2.5, True])


def places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[tuple[Any, ...], Any]]:
    found = [(path, value)]
    if isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        for key, item in items:
            found += places(item, (*path, key))
    return found


def at(value: Any, path: tuple[Any, ...]) -> Any:
    for step in path:
        value = value[step]
    return value


def is_kept(old: str, new: str) -> bool:
    """Whether all characters of a text are in another in their order."""
    rest = iter(new)
    return all(one in rest for one in old)


@settings(max_examples=100, deadline=None)
@given(
    random=st.integers(0, 2**32).map(Random),
    line_end=st.sampled_from(["\n", "\r\n"]),
    has_last=st.booleans(),
)
def test_all_but_one_value_stays(random: Random, line_end: str, has_last: bool) -> None:
    """The whole text is known beforehand: it is written with another piece for the value."""
    said = data(random)
    writer = Writer(random)
    writer.block(said, 0, ())
    scalars = [k for k, (_, path) in enumerate(writer.pieces) if path is not None]
    if not scalars:
        return
    chosen = random.choice(scalars)
    pieces = [text for text, _ in writer.pieces]
    text = lines_ended("".join(pieces), line_end, has_last)
    assert plain(text) == said
    path = writer.pieces[chosen][1]
    assert path is not None
    quote = pieces[chosen][0] if pieces[chosen][0] in "'\"" else ""
    pieces[chosen] = f"{quote}375 mm{quote}"
    expected = lines_ended("".join(pieces), line_end, has_last)
    assert with_changes(text, "f", [TextChange(path, "375 mm")]) == expected


@settings(max_examples=100, deadline=None)
@given(
    random=st.integers(0, 2**32).map(Random),
    line_end=st.sampled_from(["\n", "\r\n"]),
    has_last=st.booleans(),
    new=st.sampled_from(
        [3, "1e-3", "a, b # c", {"name": "new", "corner": {"x": "1 mm"}}, [{"a": 1}, {"b": [2]}]]
    ),
)
def test_all_stays_beside_what_is_added(
    random: Random, line_end: str, has_last: bool, new: Any
) -> None:
    said = data(random)
    writer = Writer(random)
    writer.block(said, 0, ())
    text = lines_ended("".join(one for one, _ in writer.pieces), line_end, has_last)
    path, into = random.choice([one for one in places(said) if isinstance(one[1], dict | list)])
    expected = copy.deepcopy(said)
    if isinstance(into, list):
        change = TextChange(path, new, "append")
        at(expected, path).append(new)
    else:
        change = TextChange((*path, "positions[z low].level"), new)
        at(expected, path)["positions[z low].level"] = new
    after = with_changes(text, "f", [change])
    assert is_kept(text, after)
    assert plain(after) == expected
    assert after.count("\r") in (0, after.count("\n"))
    assert after.endswith("\n") == text.endswith("\n")


@settings(max_examples=100, deadline=None)
@given(random=st.integers(0, 2**32).map(Random), has_comments=st.booleans())
def test_all_stays_beside_what_is_removed(random: Random, has_comments: bool) -> None:
    said = data(random)
    writer = Writer(random, has_comments)
    writer.block(said, 0, ())
    text = "".join(one for one, _ in writer.pieces)
    path = random.choice([path for path, _ in places(said) if path])
    if len(at(said, path[:-1])) == 1:
        return
    expected = copy.deepcopy(said)
    del at(expected, path[:-1])[path[-1]]
    try:
        after = with_changes(text, "f", [TextChange(path, kind="remove")])
    except ExperimentError as error:
        assert has_comments
        assert wording.A_COMMENT_HERE_WOULD in str(error)
        return
    assert is_kept(after, text)
    assert plain(after) == expected
    # No comment has gone; those in quotes are values.
    for comment in {one.strip() for one in COMMENTS} - {""}:
        assert after.count(comment) == text.count(comment)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "a:\n  # all\n  - b: 1  # one\n    c: 2\n  # second\n  - 2\n\n  - 3  # three\nd: 1\n",
            "a:\n  # all\n\n  - 3  # three\n  - b: 1  # one\n    c: 2\n  # second\n  - 2\nd: 1\n",
        ),
        ("a:\r\n- 1\r\n- 2\r\n- 3", "a:\r\n- 3\r\n- 1\r\n- 2"),
    ],
)
def test_entries_take_another_order_with_their_comments(text: str, expected: str) -> None:
    assert with_changes(text, "f", [TextChange(("a",), [2, 0, 1], "order")]) == expected


def test_an_alias_stays_after_its_anchor() -> None:
    with pytest.raises(ExperimentError, match="change it by hand"):
        with_changes("a:\n- &x 1\n- *x\n", "f", [TextChange(("a",), [1, 0], "order")])


@pytest.mark.parametrize(
    "text, change, place",
    [
        ("a: &x {b: 1}\nc: *x\n", TextChange(("a", "b"), 2), "f:1:4: a.b: others refer to this"),
        ("a: &x {b: 1}\nc: *x\n", TextChange(("c", "b"), 2), "f:2:4: c.b: is an alias"),
        ("a: &x 1\nc: *x\n", TextChange(("a",), 2), "f:1:4: a: others refer to this as *x"),
        ("a: [1, &x 2]\nc: *x\n", TextChange(("a",), 2), "f:1:8: a: an anchor here"),
        ("a: &x 1\nc: *x\nd: [*x]\n", TextChange(("d",), 2), "f:3:5: d: an alias here"),
        ("a:  # why\n  b: 1 # here\n", TextChange(("a", "b"), kind="remove"), "f:2:8: a.b: a comment"),
        ("a: 1\n", TextChange(("a", "c"), 2), "f:1:4: a.c: there is no mapping or list to extend"),
        ("a: text\n", TextChange(("a",), 2, "append"), "f:1:4: a: cannot be changed without"),
        ("? a\n: {b: 1}\n", TextChange(("c",), 2), "f:1:1: c: cannot be changed without"),
    ],
)  # fmt: skip
def test_places_that_others_share_are_refused(text: str, change: TextChange, place: str) -> None:
    with pytest.raises(ExperimentError) as caught:
        with_changes(text, "f", [change])
    assert str(caught.value).startswith(place)


@pytest.mark.parametrize(
    "text, change, expected",
    [
        ("a: &x 1\nc: *x\nd: 1", TextChange(("d",), 2), "a: &x 1\nc: *x\nd: 2"),
        ("a: # empty\nb: 1\n", TextChange(("a",), 2), "a: 2 # empty\nb: 1\n"),
        ("a:\n- 1\nb: 1\n", TextChange(("a",), 2, "append"), "a:\n- 1\n- 2\nb: 1\n"),
        ("a:\n- b: 1\n", TextChange(("a",), {"b": 2, "c": 3}, "append"),
         "a:\n- b: 1\n- b: 2\n  c: 3\n"),
        ("a:\n- {b: 1}\n", TextChange(("a",), {"b": 2}, "append"), "a:\n- {b: 1}\n- {b: 2}\n"),
        ("a: [1,\n    2 # two\n   ]\n", TextChange(("a",), 3, "append"),
         "a: [1,\n    2, # two\n    3\n   ]\n"),
        ("a: [1,\n    2, # two\n   ]\n", TextChange(("a",), 3, "append"),
         "a: [1,\n    2, # two\n    3\n   ]\n"),
        ("a: |\n  text\n\nb: 1\n", TextChange(("a",), "other"), "a: other\n\nb: 1\n"),
        ("- {a: 1,\n   b: 2}\n", TextChange((0, "c"), 3), "- {a: 1,\n   b: 2,\n   c: 3}\n"),
        ("a: 1\n", TextChange(("b", "c"), 2), "a: 1\nb: {c: 2}\n"),
        ("a:\nb: 1\n", TextChange(("a", "c", "d"), 2, "append"), "a: {c: {d: [2]}}\nb: 1\n"),
        ("a:\n  b: 1\n# last", TextChange(("a", "c"), 2), "a:\n  b: 1\n  c: 2\n# last"),
    ],
)  # fmt: skip
def test_styles(text: str, change: TextChange, expected: str) -> None:
    assert with_changes(text, "f", [change]) == expected
