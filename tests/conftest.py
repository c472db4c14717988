"""What the tests need of the system: those that need what it lacks are skipped with a reason, and a
checkout that takes no files is enough.
"""

from __future__ import annotations

import ast
import atexit
import compileall
import contextlib
import gc
import importlib
import importlib.util
import inspect
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]

if not os.access(ROOT, os.W_OK) and sys.pycache_prefix is None:
    sys.pycache_prefix = os.environ["PYTHONPYCACHEPREFIX"] = tempfile.mkdtemp()
    atexit.register(shutil.rmtree, sys.pycache_prefix, ignore_errors=True)

# Hundreds of commands are run, each of which would compile all modules anew: once is enough. None of
# them writes what it has compiled, since some are run on a disk that takes no more.
if "PYTEST_XDIST_WORKER" not in os.environ:
    for folder in ("analysis", "simulator", "tests"):
        compileall.compile_dir(ROOT / folder, quiet=2)
os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
# What pytest makes of the tests is kept for the next run, by its own processes too.
sys.dont_write_bytecode = not os.access(ROOT, os.W_OK)

# The program takes one thread of linear algebra, dense references would take all: beside other
# processes these wait for each other a hundred times as long as they compute.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Modules of Python that only POSIX has.
MODULES = ("fcntl", "pty", "resource", "termios")
# What only POSIX has: pipes with names, links that anybody may make, groups of processes, devices,
# a shell.
WORDS = re.compile(
    r"\b(?:mkfifo|symlink_to|killpg|preexec_fn|start_new_session|SIGKILL|chmod|shell)\b|\bos\.kill\b|\"bash\"|/dev/|/proc/"
)
# What macOS lacks. Others are taken to lack what is named here, so that it can be imitated.
DEVICES = ("/dev/full", "/proc/")
PRETENDED = os.environ.get("BALLPLATE_TESTS_WITHOUT", "").split()
MISSING = tuple(
    name
    for name in DEVICES
    if name in PRETENDED or not Path(name, "self" * (name == "/proc/")).exists()
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


def sources(function: Any) -> Iterator[str]:
    """The text of a test, and of the functions of tests that it uses, fixtures included."""
    waiting, seen = [function], set[int]()
    while waiting:
        function = inspect.unwrap(waiting.pop())
        module = getattr(function, "__module__", None) or ""
        if id(function) in seen or not inspect.isfunction(function) or module[:6] != "tests.":
            continue
        seen.add(id(function))
        source = inspect.getsource(function)
        yield source
        names = set(re.findall(r"\w+", source)) & function.__globals__.keys()
        waiting += [function.__globals__[name] for name in names]


def device_needed(item: pytest.Function, missing: tuple[str, ...] = MISSING) -> str:
    """A device that a test needs and the system lacks; empty where none."""
    parameters = getattr(item, "callspec", None)
    texts = [repr(parameters.params) if parameters else "", *sources(item.function)]
    return next((name for name in missing if any(name in text for text in texts)), "")


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
    # What collection makes is kept: looking for garbage in it takes a sixth of its time, and a tenth
    # of that of small tests.
    gc.disable()
    if not os.access(ROOT, os.W_OK):
        from hypothesis import settings

        settings.register_profile("read-only", database=None)
        settings.load_profile("read-only")


def pytest_sessionstart(session: pytest.Session) -> None:
    """Half of the processes load all files beginning with the last, so that of two processes in a
    new checkout each compiles half of them, and not both all.
    """
    worker = os.environ.get("PYTEST_XDIST_WORKER", "gw0")
    if session.config.args_source is session.config.ArgsSource.TESTPATHS and int(worker[2:]) % 2:
        for path in sorted((ROOT / "tests").rglob("test_*.py"), reverse=True):
            # Whatever a file raises, its collection raises and reports, too.
            with contextlib.suppress(Exception, pytest.skip.Exception):
                importlib.import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))


def pytest_collection_finish() -> None:
    gc.freeze()
    gc.enable()


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
    for item in items:
        if isinstance(item, pytest.Function):
            word = "" if IS_POSIX else word_needed(inspect.getsource(item.function))
            if word := word or (device_needed(item) if MISSING else ""):
                item.add_marker(pytest.mark.skip(reason=f"needs {word}, which is missing here"))


def pytest_terminal_summary(terminalreporter: Any) -> None:
    for report in terminalreporter.getreports("passed") + terminalreporter.getreports("failed"):
        for name, text in report.user_properties:
            if name == "report" and report.when == "call":
                terminalreporter.section(report.nodeid)
                terminalreporter.write_line(text)
