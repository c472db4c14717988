"""YAML as it is read here: scalars of YAML 1.2, places, and everything refused."""

import math
from pathlib import Path

import pytest
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.inputs.yamltree import (
    DEEPEST,
    mark_of,
    parse_tree,
    read_tree,
    resolve_scalar,
    to_python,
)
from hypothesis import given, strategies as st

from tests.experiment import wording


def refusals(text: str) -> list[str]:
    with pytest.raises(ExperimentError) as caught:
        parse_tree(text, "f")
    return str(caught.value).split("\n")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-6", 1e-6), ("1.", 1.0), (".5", 0.5), ("+12", 12), ("010", 10), ("0o10", 8), ("0xff", 255),
        ("12:30", "12:30"), ("on", "on"), ("yes", "yes"), ("No", "No"), ("true", True), ("FALSE", False),
        ("~", None), ("", None), ("Null", None), (".inf", math.inf), ("-.INF", -math.inf), ("1_000", "1_000"),
        ("2024-01-01", "2024-01-01"), ("tRUE", "tRUE"), ("0b1", "0b1"), ("e5", "e5"),
    ],
)  # fmt: skip
def test_plain_scalars(text: str, value: object) -> None:
    found = resolve_scalar(text)
    assert found == value and type(found) is type(value)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_floats_are_read_again(value: float) -> None:
    assert resolve_scalar(repr(value)) == value


@given(st.integers())
def test_whole_numbers_are_read_again(value: int) -> None:
    assert resolve_scalar(str(value)) == value


@given(st.text(max_size=60))
def test_no_text_breaks_the_reader(text: str) -> None:
    try:
        to_python(parse_tree(text, "f"))
    except ExperimentError as error:
        assert all(message.text for message in error.messages)


def test_values_and_quotes() -> None:
    tree = parse_tree('a: "1"\n1: [x, {b: !!str 2}]\n? c\n: |\n  two\n  lines\n', "f")
    assert to_python(tree) == {"a": "1", "1": ("x", {"b": "2"}), "c": "two\nlines\n"}


def test_places() -> None:
    tree = parse_tree("a: 1\nµ: [x, y]\nblock:\n  - b: 2\n    c: 3\n", "f")

    def place(*steps: str | int, of_key: bool = False) -> tuple[int, int]:
        mark = mark_of(tree, steps, of_key)
        return mark.line, mark.column

    assert place("a") == (1, 4)
    assert place("a", of_key=True) == (1, 1)
    assert place("µ", 1) == (2, 8)
    assert place("block") == (3, 1)
    assert place("block", 0) == (4, 5)
    assert place("block", 0, "c") == (5, 8)
    assert place("block", 0, "missing") == (4, 5)


def test_aliases_stand_where_they_are_used() -> None:
    tree = parse_tree("a: &x {b: 1}\nc: *x\n", "f")
    assert to_python(tree) == {"a": {"b": 1}, "c": {"b": 1}}
    assert (mark_of(tree, ("c",)).line, mark_of(tree, ("c", "b")).line) == (2, 1)


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("a: 1\nb: 2\na: 3\n", ['f:3:1: the key "a" is already in line 1; remove one of the two']),
        (
            "a: {b: 1}\n<<: {c: 1}\n",
            [
                "f:2:1: merge keys (<<) are not read; repeat the keys, or use an alias for a whole"
                " value"
            ],
        ),
        ('"": 1\n', ["f:1:1: an empty key; write a name before the colon"]),
        (
            "a: !!int 1\nb: !x 2\n",
            [
                "f:1:4: the tag !!int has no meaning here; remove it",
                "f:2:4: the tag !x has no meaning here; remove it",
            ],
        ),
        ("a: *b\n", ["f:1:4: no anchor &b; write the value out"]),
        (
            "a: &b [*b]\n",
            ["f:1:8: the alias *b is inside the value that it refers to; write the value out"],
        ),
        (
            "a: 1\n---\nb: 1\n",
            [
                "f:2:1: a second document begins here; write one experiment per file, or use"
                " variants"
            ],
        ),
        ("a:\n\tb: 1\n", ["f:2:1: not valid YAML: a tab; indent with spaces"]),
        (
            "a: [1, 2\nb: 3\n",
            [
                "f:1:4: not valid YAML: a list in brackets is never closed or lacks a comma; write"
                " [a, b]"
            ],
        ),
        (
            "a: b: c\n",
            [
                "f:1:5: not valid YAML: a second “: ” in one line; quote a text that contains"
                " it, and check the indentation"
            ],
        ),
        ("a: @b\n", ["f:1:4: not valid YAML: a text cannot begin with this character; quote it"]),
        ("a: µ\x07\n", ["f:1:5: the control character U+0007 is not allowed; remove it"]),
        (
            "a: " + "9" * 400,
            ["f:1:4: a number with more than 300 digits; write it with an exponent"],
        ),
        (
            "a: " + "[" * 5000,
            [f"f:1:{4 + DEEPEST - 1}: nested more than {DEEPEST} deep; check the brackets"],
        ),
        (
            "a: 1\na: 2\nb: " + "[" * 5000 + "]" * 5000,
            [
                'f:2:1: the key "a" is already in line 1; remove one of the two',
                f"f:3:{4 + DEEPEST - 1}: nested more than {DEEPEST} deep; check the brackets",
            ],
        ),
    ],
)
def test_refusals(text: str, lines: list[str]) -> None:
    assert refusals(text) == lines


@pytest.mark.parametrize("text", ["", "# only a comment\n", "---\n", "~\n"])
def test_empty_files(text: str) -> None:
    expected = (
        "f: the file is empty; write at least title, machine, error_model, artefacts and positions"
    )
    assert refusals(text) == [expected]


def test_alias_bomb() -> None:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i + 1}: &a{i + 1} [{', '.join([f'*a{i}'] * 10)}]" for i in range(40)]
    (refusal,) = refusals("\n".join(lines))
    assert refusal.endswith(wording.MORE_THAN_VALUES)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    def refusal(path: Path) -> str:
        with pytest.raises(ExperimentError) as caught:
            read_tree(path)
        return str(caught.value)

    missing, latin = tmp_path / "missing.yaml", tmp_path / "latin.yaml"
    latin.write_bytes("a: 1\nb: µm".encode("latin-1"))
    assert refusal(missing) == f"{missing}: there is no such file; check the name and the folder"
    assert refusal(tmp_path) == f"{tmp_path}: this is a folder; name a file in it"
    assert (
        refusal(latin)
        == f"{latin}:2:4: byte 0xb5 is not UTF-8; save the file with the encoding UTF-8"
    )
