"""The examples in docstrings run."""

from __future__ import annotations

import doctest
import importlib
from pathlib import Path

import pytest

TOP = Path(__file__).parents[1]
FOLDERS = {
    "analysis": "ballplate",
    "simulator": "ballplate.simulator",
    "designs": "ballplate.designs",
}


def with_examples() -> list[str]:
    """Names of all modules that have examples, of `ballplate` below two of the top folders."""
    names = []
    for folder, package in FOLDERS.items():
        for path in sorted((TOP / folder).rglob("*.py")):
            if ">>> " in path.read_text("utf-8"):
                parts = path.relative_to(TOP / folder).with_suffix("").parts
                names.append(".".join([package, *(part for part in parts if part != "__init__")]))
    return names


@pytest.mark.parametrize("name", with_examples())
def test_examples_run(name: str) -> None:
    module = importlib.import_module(name)
    found = doctest.testmod(module)
    assert found.attempted > 0
    assert found.failed == 0
