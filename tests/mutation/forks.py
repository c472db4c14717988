"""Tests of one session of pytest, run again and again in forks of it, in each of which one change of
the code is made.

Nothing is loaded or collected twice, and a change is made to the functions that are loaded, so that
what other modules imported by name has it, too. Commands that tests run as processes do not see it.
"""

from __future__ import annotations

import ast
import contextlib
import functools
import gc
import importlib
import json
import os
import resource
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

import pytest

from tests.mutation.mutants import Mutant, changed_tree, new_value, probed_tree, source_of
from tests.reference.installed_extension import TOP

OPTIMIZED = 1  # a flag of the code of functions, which that of classes has not
# Tests wait for others where processors are shared, but not for so many times their own time.
WAITING = 20.0


class Session:
    """A plug-in of pytest that does something else with the tests than to run them once."""

    def __init__(self, work: Callable[[list[pytest.Item]], None]) -> None:
        self.work = work

    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        self.work(session.items)
        return True


def collected(paths: Sequence[str], work: Callable[[list[pytest.Item]], None]) -> None:
    """Do something with the fast tests of files and folders."""
    line = ["-q", "-s", "-p", "no:cacheprovider", "-p", "no:xdist", "-p", "no:terminalreporter"]
    line += ["-m", "not slow and not long and not browser", *paths]
    status = pytest.main(line, plugins=[Session(work)])
    if status not in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
        raise RuntimeError(f"pytest {' '.join(line)}: {status!r}")


def in_fork(work: Callable[[], Any], seconds: float) -> Any:
    """What a function returns in a fork; None where that takes more seconds of the processor."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "result.json")
        child = os.fork()
        if child == 0:
            _work_in_fork(work, path, seconds)
        end = time.monotonic() + WAITING * seconds
        while os.waitpid(child, os.WNOHANG) == (0, 0):
            if time.monotonic() > end:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(child, signal.SIGKILL)
            time.sleep(0.01)
        return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def _work_in_fork(work: Callable[[], Any], path: Path, seconds: float) -> None:
    os.setsid()
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(nowhere, stream)
    spent = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
    limit = int(spent + seconds) + 1
    resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 5))
    try:
        path.with_suffix(".part").write_text(json.dumps(work()), encoding="utf-8")
        path.with_suffix(".part").rename(path)
    finally:
        os._exit(0)


def first_failure(items: Sequence[pytest.Item]) -> str | None:
    """The first of the tests that fails."""
    for item, following in zip_longest(items, items[1:]):
        item.ihook.pytest_runtest_protocol(item=item, nextitem=following)
        if item.session.testsfailed:
            return item.nodeid
    return None


def probed(every: Sequence[Mutant]) -> set[int]:
    """Probe the places of the changes: the set that is returned gets the numbers of those reached."""
    places: set[int] = set()
    paths: dict[str, dict[int, Mutant]] = {}
    settings: dict[str, dict[str, list[int]]] = {}
    sources = _sources() if any(mutant.setting for mutant in every) else {}
    for k, mutant in enumerate(every):
        if not mutant.setting:
            paths.setdefault(mutant.path, {})[k] = mutant
        for path, text in sources.items() if mutant.setting else ():
            # A file that only has the same name for something else is probed in vain.
            if mutant.setting in text:
                settings.setdefault(path, {}).setdefault(mutant.setting, []).append(k)
    trees = {
        path: probed_tree(path, paths.get(path, {}), settings.get(path, {}), "__reached__")
        for path in {*paths, *settings}
    }
    exchange(trees, {"__reached__": places.add})
    return places


def _sources() -> dict[str, str]:
    """The sources of the package, by path below it."""
    folders = {"simulator": TOP, "analysis": TOP / "analysis"}
    return {
        path.relative_to(below).as_posix(): path.read_text(encoding="utf-8")
        for folder, below in folders.items()
        for path in sorted((TOP / folder).rglob("*.py"))
        if path.name not in ("__init__.py", "__main__.py")
    }


def reached(items: Sequence[pytest.Item], every: Sequence[Mutant]) -> Iterator[dict[str, Any]]:
    """Of each test its processor time in seconds, whether it passes, and the changes whose place in
    the code it reaches.
    """
    places = probed(every)
    for item, following in zip_longest(items, items[1:]):
        places.clear()
        start = sum(os.times()[:4])
        failed = item.session.testsfailed
        item.ihook.pytest_runtest_protocol(item=item, nextitem=following)
        yield {
            "test": item.nodeid,
            "seconds": round(sum(os.times()[:4]) - start, 2),
            "passes": item.session.testsfailed == failed,
            "reaches": [every[k].name for k in sorted(places)],
        }


def change(mutant: Mutant) -> None:
    """Make a change in this process."""
    if not mutant.setting:
        exchange({mutant.path: changed_tree(mutant)}, {})
        return
    names = vars(_module(mutant.path))
    old, new = names[mutant.setting], new_value(mutant, names)
    for name, module in list(sys.modules.items()):
        here = vars(module)
        if name.partition(".")[0] == "ballplate" and here.get(mutant.setting) is old:
            here[mutant.setting] = new
    exchange({}, {})


def _module(path: str) -> Any:
    name = path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    return importlib.import_module(f"ballplate.{name}")


def exchange(trees: Mapping[str, ast.Module], names: dict[str, Any]) -> None:
    """Give the loaded functions of files the codes of trees, which may use further names."""
    codes: dict[str, dict[tuple[str, int], CodeType]] = {}
    for path, tree in trees.items():
        file = str(source_of(path))
        vars(_module(path)).update(names)
        codes[file] = dict(_functions(compile(tree, file, "exec")))
    # What is frozen is not listed.
    gc.unfreeze()
    for some in gc.get_objects():
        if isinstance(some, FunctionType) and some.__code__.co_filename in codes:
            old = some.__code__
            key = old.co_qualname, old.co_firstlineno
            some.__code__ = codes[old.co_filename].get(key, old)
        elif isinstance(some, functools._lru_cache_wrapper):
            some.cache_clear()


def _functions(code: CodeType) -> Iterator[tuple[tuple[str, int], CodeType]]:
    """The functions of a module and of its classes, by name and line."""
    for inner in code.co_consts:
        if isinstance(inner, CodeType) and inner.co_flags & OPTIMIZED:
            yield (inner.co_qualname, inner.co_firstlineno), inner
        elif isinstance(inner, CodeType):
            yield from _functions(inner)
