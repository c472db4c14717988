"""The page of promises: every test that it names exists, and none of those that hold the most is
left out.
"""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

PAGE = Path("docs/reference/promises.md")
# A test, or a file of tests, and whether the page says that it takes long.
NAMED = re.compile(r"`(tests/[\w/]+\.py)(?:::([\w:]+))?`( \(long\))?")
OF_ALL = [
    *sorted(Path("tests/robustness").glob("test_*.py")),
    Path("tests/cli/test_outputs.py"),
    Path("tests/cli/test_signals.py"),
    Path("tests/extensions/sweeps/test_damaged_stores.py"),
]


def rows() -> list[str]:
    """The rows of all tables but their heads."""
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    return [line for line in lines if line.startswith("| ") and not line.startswith("| promise |")]


@cache
def long_by_test(path: str) -> dict[str, bool]:
    """The tests of a file, those of classes with the name of the class before, and whether they run
    only when asked.
    """
    found = {}
    for node in ast.parse(Path(path).read_text(encoding="utf-8")).body:
        of_class = node.body if isinstance(node, ast.ClassDef) else [node]
        prefix = f"{node.name}::" if isinstance(node, ast.ClassDef) else ""
        for one in of_class:
            if isinstance(one, ast.FunctionDef) and one.name.startswith("test_"):
                found[prefix + one.name] = "pytest.mark.long" in map(
                    ast.unparse, one.decorator_list
                )
    return found


def test_every_promise_names_tests() -> None:
    assert len(rows()) > 90
    for row in rows():
        promise, held_by = re.fullmatch(r"\| (.+) \| (.+) \|", row).groups()  # type: ignore[union-attr]
        assert "tests/" not in promise
        # Tests and nothing else.
        assert re.fullmatch(rf"{NAMED.pattern}(, {NAMED.pattern})*", held_by), row


def test_every_test_named_exists() -> None:
    named = NAMED.findall("\n".join(rows()))
    assert len(named) > 200
    for path, test, is_long in named:
        if test:
            assert test in long_by_test(path), f"{path}::{test}"
            assert long_by_test(path)[test] == bool(is_long), f"{path}::{test}"
        else:
            assert long_by_test(path) and not is_long, path


def test_no_name_of_a_test_is_overlooked() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert len(re.findall(r"\btest_\w+\.py", text)) == len(NAMED.findall("\n".join(rows())))


def test_the_files_that_hold_the_most_are_named() -> None:
    named = {path for path, _, _ in NAMED.findall("\n".join(rows()))}
    assert len(OF_ALL) >= 7
    assert not {path.as_posix() for path in OF_ALL} - named


def test_all_tests_of_outputs_signals_and_stores_are_named() -> None:
    named = {(path, test) for path, test, _ in NAMED.findall("\n".join(rows()))}
    for path in (
        "tests/cli/test_outputs.py",
        "tests/cli/test_signals.py",
        "tests/extensions/sweeps/test_damaged_stores.py",
    ):
        missing = [test for test in long_by_test(path) if (path, test) not in named]
        assert not missing, path
