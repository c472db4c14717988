"""The house: rooms one above the other, no circle, and one name for one thing.

A room is a folder directly inside `simulator/` or `analysis/` with Python files in it; a folder
inside a room is a part of that room. The face of the package (`analysis/*.py`) lies on top.
"""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from itertools import takewhile
from pathlib import Path

import pytest
from ballplate.cli._parsers import COMMANDS

TOP = Path(__file__).parents[1]
PACKAGES = {"simulator": "ballplate.simulator", "analysis": "ballplate"}

EXTENSIONS = Path("analysis/extensions")

# From the ground up: a room imports only those before it.
ROOMS = (
    "simulator/inputs",
    "simulator/computing",
    "simulator/geometry",
    "simulator/splines",
    "simulator/machines",
    "simulator/design",
    "simulator/experiment",
    "simulator/estimation",
    "simulator/readings",
    "analysis/uncertainty",
    "analysis/rank",
    "analysis/presentation",
    "analysis/montecarlo",
    "analysis/results",
    "analysis/cli",
)
MOST_ROOMS = 18
# Lines of a function's body, its docstring left out, beyond which a comment has to say why.
LONGEST = 60
REASON = "# In one piece"


@cache
def trees() -> dict[Path, ast.Module]:
    """The syntax of every module, by its path from the top."""
    return {
        path.relative_to(TOP): ast.parse(path.read_text(encoding="utf-8"))
        for folder in PACKAGES
        for path in sorted((TOP / folder).rglob("*.py"))
    }


def module_of(path: Path) -> str:
    parts = [PACKAGES[path.parts[0]], *path.with_suffix("").parts[1:]]
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported(path: Path, tree: ast.Module) -> Iterator[str]:
    """Names that a module imports anywhere in it, in functions and for types too."""
    package = module_of(path).split(".")
    if path.name != "__init__.py":
        package.pop()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else []
            source = ".".join([*above, node.module] if node.module else above)
            yield source
            yield from (f"{source}.{alias.name}" for alias in node.names)


@cache
def arrows() -> dict[Path, frozenset[Path]]:
    """Modules that each module imports."""
    paths = {module_of(path): path for path in trees()}
    return {
        path: frozenset(paths[name] for name in imported(path, tree) if name in paths) - {path}
        for path, tree in trees().items()
    }


def room_of(path: Path) -> str | None:
    """The room of a module; of an extension none of these, but its own folder."""
    return "/".join(path.parts[:2]) if len(path.parts) > 2 else None


def kernel() -> dict[Path, frozenset[Path]]:
    """The arrows of the kernel's modules; those of extensions are in `test_extensions.py`."""
    return {path: found for path, found in arrows().items() if EXTENSIONS not in path.parents}


def functions() -> Iterator[tuple[Path, ast.FunctionDef | ast.AsyncFunctionDef]]:
    for path, tree in trees().items():
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                yield path, node


def test_imports_are_found() -> None:
    found = arrows()[Path("analysis/api.py")]
    assert Path("simulator/experiment/loading.py") in found  # at the top
    assert Path("analysis/montecarlo/experiments.py") in found  # for types, or in a function
    assert sum(map(len, arrows().values())) > 1000


def test_no_modules_import_each_other_in_a_circle() -> None:
    order = TopologicalSorter(arrows())
    try:
        order.prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(map(str, error.args[1])))


def test_the_simulator_knows_nothing_of_the_analysis() -> None:
    for path, found in arrows().items():
        if path.parts[0] == "simulator":
            assert not [other for other in found if other.parts[0] == "analysis"], path


def test_rooms_import_only_rooms_below() -> None:
    level = {room: number for number, room in enumerate(ROOMS)}
    upward = []
    for path, found in kernel().items():
        here = room_of(path)
        for other in found:
            there = room_of(other)
            is_face = here is None or EXTENSIONS in other.parents
            if not is_face and other != Path("simulator/__init__.py"):
                # The face lies above every room but the commands, which are a user of it.
                is_below = (
                    str(here).endswith("/cli")
                    if there is None
                    else level[there] <= level[str(here)]
                )
                if not is_below:
                    upward.append(f"{path} -> {other}")
    assert not upward


def test_imports_within_a_room_are_relative_and_between_rooms_absolute() -> None:
    for path in kernel():
        here = room_of(path)
        for node in ast.walk(trees()[path]) if here else ():
            if not isinstance(node, ast.ImportFrom) or not f"{node.module}".startswith("ballplate"):
                # As many dots as lead out of the room.
                assert getattr(node, "level", 0) <= len(path.parts) - 2, (path, node.lineno)
            else:
                room = f"{PACKAGES[path.parts[0]]}.{path.parts[1]}"
                assert not f"{node.module}.".startswith(f"{room}."), (path, node.lineno)


def shown_by_faces() -> set[Path]:
    """Modules with names that a package, or `import ballplate` itself, makes public."""
    shown = set()
    for stub in TOP.glob("*/*/__init__.pyi"), [TOP / "analysis" / "__init__.pyi"]:
        for path in stub:
            for node in ast.parse(path.read_text(encoding="utf-8")).body:
                if isinstance(node, ast.ImportFrom):
                    parts = f"{node.module}".split(".")
                    folder = TOP if parts[0] in PACKAGES else path.parent
                    shown.add(folder.joinpath(*parts).with_suffix(".py").relative_to(TOP))
    return shown


def test_modules_of_one_room_alone_begin_with_an_underscore() -> None:
    shown = shown_by_faces()
    for path in kernel():
        is_command = path.parent.name == "cli" and path.stem in COMMANDS
        if room_of(path) is None or path.name == "__init__.py" or is_command:
            continue
        users = {room_of(other) for other, used in arrows().items() if path in used}
        is_private = users == {room_of(path)} and path not in shown
        assert is_private == path.name.startswith("_"), (path, users)


def test_there_are_few_rooms_and_all_are_in_order() -> None:
    found = {room_of(path) for path in kernel()} - {None}
    assert found == set(ROOMS)
    assert len(ROOMS) == len(set(ROOMS)) <= MOST_ROOMS


def test_beside_the_rooms_there_is_only_the_face() -> None:
    flat = {str(path) for path in trees() if room_of(path) is None}
    assert flat == {
        "analysis/__init__.py",
        "analysis/__main__.py",
        "analysis/api.py",
        "analysis/models.py",
        "analysis/testing.py",
        "analysis/arguments.py",
        "simulator/__init__.py",
    }


def test_no_two_public_classes_have_the_same_name() -> None:
    names = Counter(
        node.name
        for tree in trees().values()
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_")
    )
    assert not [name for name, count in names.items() if count > 1]


def test_no_module_name_is_used_more_than_twice() -> None:
    names = Counter(
        path.stem for path in trees() if not path.stem.startswith("__") and path.stem != "interface"
    )
    assert not [name for name, count in names.items() if count > 2]


def test_long_functions_say_why() -> None:
    silent = []
    for path, node in functions():
        body = node.body[1:] if ast.get_docstring(node) is not None else node.body
        if not body or (node.end_lineno or 0) - body[0].lineno + 1 <= LONGEST:
            continue
        lines = (TOP / path).read_text(encoding="utf-8").splitlines()
        first = min([node.lineno, *(one.lineno for one in node.decorator_list)])
        above = takewhile(lambda line: line.lstrip().startswith("#"), reversed(lines[: first - 1]))
        if not any(re.match(rf"\s*{REASON}: \w+", line) for line in above):
            silent.append(f"{path}:{node.lineno} {node.name}")
    assert not silent


def test_only_the_commands_write_to_the_terminal() -> None:
    written = []
    for path, tree in trees().items():
        # What code of a user's own prints goes where it mixes with no result.
        if _is_command(path) or path == Path("simulator/inputs/own_code.py"):
            continue
        for node in ast.walk(tree):
            is_print = isinstance(node, ast.Name) and node.id == "print"
            is_stream = (
                isinstance(node, ast.Attribute)
                and node.attr in ("stdout", "stderr", "__stdout__", "__stderr__")
                and isinstance(node.value, ast.Name)
                and node.value.id == "sys"
            )
            is_imported = (
                isinstance(node, ast.ImportFrom)
                and node.module == "sys"
                and any(alias.name in ("stdout", "stderr") for alias in node.names)
            )
            if is_print or is_stream or is_imported:
                written.append(f"{path}:{node.lineno}")
    assert not written


def _is_command(path: Path) -> bool:
    return room_of(path) == "analysis/cli" or path.stem.endswith("_command")
