"""The page of guarantees: every guarantee names tests, and those exist."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

PAGE = Path("docs/developer/guarantees.md").read_text(encoding="utf-8")
ROW = re.compile(r"^\| (\d+) \| (.+) \| (.+) \|$", re.MULTILINE)
NAMED = re.compile(r"`(tests/[\w/]+(?:\.py)?)`")
ROWS = [match.groups() for match in ROW.finditer(PAGE)]


def quick_tests(path: Path) -> list[str]:
    """Names of the tests of a file that run without being asked for, also those of classes."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return [
        node.name
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef)
        and node.name.startswith("test_")
        and "pytest.mark.long" not in map(ast.unparse, node.decorator_list)
    ]


def test_there_are_twelve_guarantees_and_each_names_tests() -> None:
    assert [number for number, _, _ in ROWS] == [str(k) for k in range(1, 13)]
    for _, guarantee, held_by in ROWS:
        assert "tests/" not in guarantee
        # Tests and nothing else.
        assert re.fullmatch(rf"{NAMED.pattern}(, {NAMED.pattern})*", held_by), held_by


@pytest.mark.parametrize("name", NAMED.findall(PAGE))
def test_what_is_named_has_tests_of_the_test_command(name: str) -> None:
    path = Path(name)
    files = sorted(path.rglob("test_*.py")) if path.is_dir() else [path]
    assert files
    assert any(quick_tests(file) for file in files)


def test_no_name_of_a_test_is_overlooked() -> None:
    assert len(re.findall(r"\btests/\w", PAGE)) == len(
        NAMED.findall("".join(row[2] for row in ROWS))
    )
