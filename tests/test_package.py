"""The package as it is installed: one name, a face that loads lazily, and what it is made of."""

from __future__ import annotations

import ast
import doctest
import re
import subprocess
import sys
import tomllib
import zipfile
from importlib.metadata import packages_distributions
from pathlib import Path

import ballplate
import pytest

TOP = Path(__file__).parents[1]


def python(code: str, folder: Path) -> str:
    """What code prints in a new process."""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_importing_loads_nothing_heavy(tmp_path: Path) -> None:
    heavy = ("numpy", "pydantic", "yaml", "pandas", "scipy")
    code = f"import sys, ballplate; print([name for name in {heavy} if name in sys.modules])"
    assert python(code, tmp_path).strip() == "[]"


def test_folders_of_the_user_hide_nothing(tmp_path: Path) -> None:
    for name in ("analysis", "simulator", "designs"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("raise RuntimeError('not mine')")
    (tmp_path / "simulator.py").write_text("raise RuntimeError('not mine')")
    done = subprocess.run(
        [sys.executable, "-m", "ballplate", "check", str(TOP / "designs" / "quickstart.yaml")],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    assert "full rank, as expected" in done.stdout


def test_every_name_of_the_face_is_there_and_told() -> None:
    for name in ballplate.__all__:
        assert getattr(ballplate, name).__doc__, name
        assert name in dir(ballplate)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = ballplate.nothing


def test_every_function_of_the_face_has_an_example_that_calls_it() -> None:
    """The examples run in tests/test_docstring_examples.py; one that only prepares a call shows
    nothing.
    """
    functions = [name for name in ballplate.__all__ if name[0].islower()]
    for name in functions:
        examples = (
            doctest.DocTestFinder(recurse=False).find(getattr(ballplate, name), name)[0].examples
        )
        assert any(f"{name}(" in one.source and one.want for one in examples), name
    assert len(functions) > 10


def test_no_module_hides_a_function_of_the_face() -> None:
    """`import ballplate.x` sets the name x of the package, whatever stood there."""
    modules = {path.stem if path.is_file() else path.name for path in (TOP / "analysis").iterdir()}
    assert not modules & {name for name in ballplate.__all__ if name[0].islower()}


def test_all_packages_are_listed() -> None:
    settings = tomllib.loads((TOP / "pyproject.toml").read_text("utf-8"))["tool"]["setuptools"]
    names = {"ballplate.designs"}
    for package, folder in (("ballplate", "analysis"), ("ballplate.simulator", "simulator")):
        for path in (TOP / folder).rglob("__init__.py"):
            names.add(".".join([package, *path.parent.relative_to(TOP / folder).parts]))
    assert names == set(settings["packages"])


def imported(source: str) -> set[str]:
    """Modules that a file imports."""
    modules = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            modules |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            modules.add(node.module.partition(".")[0])
    return modules


def test_what_is_imported_is_declared() -> None:
    project = tomllib.loads((TOP / "pyproject.toml").read_text("utf-8"))["project"]
    groups = [project["dependencies"], *project["optional-dependencies"].values()]
    declared = {re.split(r"[^\w-]", entry)[0].lower() for group in groups for entry in group}
    distributions = packages_distributions()

    def is_declared(module: str) -> bool:
        name = re.sub("[-_.]+", "-", distributions.get(module, [module])[0]).lower()
        return module in sys.stdlib_module_names or name in {
            *declared,
            "ballplate",
            "benchmarks",
            "tests",
        }

    for folder in ("simulator", "analysis", "tests", "docs/_extensions"):
        for path in (TOP / folder).rglob("*.py"):
            source = path.read_text("utf-8")
            # Prose has such words as well, which few files are parsed for.
            if not all(map(is_declared, re.findall(r"(?m)^ *(?:import|from) (\w+)", source))):
                assert all(map(is_declared, imported(source))), path


@pytest.mark.slow
def test_a_wheel_holds_one_package(tmp_path: Path) -> None:
    build = f"from setuptools.build_meta import build_wheel; print(build_wheel({str(tmp_path)!r}))"
    copied = tmp_path / "source"
    files = subprocess.run(
        ["git", "-c", "safe.directory=*", "ls-files"],
        cwd=TOP,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    for name in files.splitlines():
        if (TOP / name).is_file():
            (copied / name).parent.mkdir(parents=True, exist_ok=True)
            (copied / name).write_bytes((TOP / name).read_bytes())
    wheel = tmp_path / python(build, copied).splitlines()[-1]
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    assert {name.partition("/")[0].partition("-")[0] for name in names} == {"ballplate"}
    shipped = {
        f"ballplate/{path.relative_to(TOP).as_posix()}"
        for path in (TOP / "designs").rglob("*.yaml")
    }
    assert shipped <= set(names)
    assert "ballplate/py.typed" in names
