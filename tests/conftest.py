"""What the tests need of the system: those that need more than Windows has are left out there, and
told.
"""

from __future__ import annotations

import ast
import compileall
import importlib.util
import inspect
import os
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

# Hundreds of commands are run, each of which would compile all modules anew: once is enough. None of
# them writes what it has compiled, since some are run on a disk that takes no more.
if "PYTEST_XDIST_WORKER" not in os.environ:
    for folder in ("analysis", "simulator", "tests"):
        compileall.compile_dir(ROOT / folder, quiet=2)
os.environ["PYTHONDONTWRITEBYTECODE"] = "1"

# Modules of Python that only POSIX has.
MODULES = ("fcntl", "pty", "resource", "termios")
# What only POSIX has: pipes with names, links that anybody may make, groups of processes, devices,
# a shell.
WORDS = re.compile(
    r"\b(?:mkfifo|symlink_to|killpg|preexec_fn|start_new_session|SIGKILL|chmod|shell)\b|\bos\.kill\b|\"bash\"|/dev/|/proc/"
)
# Folders whose tests take longest.
LONGEST = ("sweeps", "docs")
IS_POSIX = all(importlib.util.find_spec(name) is not None for name in MODULES)


@cache
def module_needed(path: Path) -> str:
    """The module of POSIX that a file of the tests loads, by itself or through another one; empty
    where none.
    """
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        for name in names:
            other = ROOT / f"{name.replace('.', '/')}.py"
            found = name if name in MODULES else ""
            if not found and name.startswith("tests.") and other.is_file():
                found = module_needed(other)
            if found:
                return found
    return ""


def word_needed(source: str) -> str:
    """What the text of a test has that only POSIX has; empty where nothing."""
    found = WORDS.search(source)
    return found[0] if found is not None else ""


def left_out() -> dict[str, str]:
    """Files of tests that cannot be loaded without POSIX, with the module that they need."""
    found = {
        path.relative_to(ROOT).as_posix(): module_needed(path)
        for path in (ROOT / "tests").rglob("*.py")
    }
    return {name: module for name, module in sorted(found.items()) if module}


def pytest_configure(config: pytest.Config) -> None:
    # Files are handed out in the order below, not by the number of their tests.
    config.option.loadscopereorder = False


def pytest_ignore_collect(collection_path: Path) -> bool | None:
    is_test = collection_path.suffix == ".py" and not IS_POSIX
    return True if is_test and module_needed(collection_path) else None


def pytest_report_header() -> list[str]:
    if IS_POSIX:
        return []
    return [
        f"left out, for want of POSIX: {name} (module {module})"
        for name, module in left_out().items()
    ]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    # The longest first, so that several processes end together.
    items.sort(key=lambda item: item.path.parent.name not in LONGEST)
    if IS_POSIX:
        return
    for item in items:
        word = (
            word_needed(inspect.getsource(item.function))
            if isinstance(item, pytest.Function)
            else ""
        )
        if word:
            item.add_marker(pytest.mark.skip(reason=f"needs {word}, which only POSIX has"))
