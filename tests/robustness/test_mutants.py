"""Whatever stands in a file, there is a result or what is wrong with the file, soon and in bounded
memory.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import pytest
from ballplate.cli import main
from hypothesis import HealthCheck, Phase, given, settings

from tests.reference.copies import copy_file
from tests.robustness.experiments import (
    EXPERIMENTS,
    FILES,
    QUICK,
    QUICKSTART,
    SEED,
    SWEEP_WORDS,
    SWEEPS,
    WORDS,
    check,
    fit,
    run,
    simulate,
    sweep,
)
from tests.robustness.mutations import Mutant, emit_file, mutants, table_mutants, trees
from tests.robustness.worker import Worker

# Where a test ends, as the next may fail for the same reason.
ENOUGH = 5


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Where mutants are tried, with the tables that they name, and other things that can be
    named.
    """
    for table in FILES.glob("*.csv"):
        copy_file(table, tmp_path)
    copy_file(QUICKSTART, tmp_path)
    copy_file(FILES / "splines.yaml", tmp_path)
    (tmp_path / "loop.csv").symlink_to("loop.csv")
    os.mkfifo(tmp_path / "pipe.csv")
    return tmp_path


def faults(worker: Worker, found: Iterable[Mutant], folder: Path) -> Iterator[str]:
    """What goes wrong with mutants, each of which is then kept in the folder."""
    for mutant in found:
        name = "mutant.yaml" if mutant.origin.suffix == ".yaml" else mutant.origin.name
        path = folder / name
        path.write_bytes(mutant.content)
        fault = worker(path)
        if fault is not None:
            kept = folder / f"fault-{mutant.number}-{name}"
            copy_file(path, kept)
            yield f"{mutant}, kept as {kept}\n{fault}"


def try_experiments(trial: Any, files: list[Path], numbers: range, folder: Path) -> None:
    with Worker(trial, [QUICKSTART]) as worker:
        found = list(islice(faults(worker, mutants(files, WORDS, SEED, numbers), folder), ENOUGH))
    assert not found, "\n\n".join(found)


def try_sweeps(numbers: range, folder: Path) -> None:
    # Data sets of designs that hardly determine anything take long, and rightly so.
    with Worker(sweep, [Path("designs/sweeps/plate-size.yaml")], seconds=60.0) as worker:
        found = list(
            islice(faults(worker, mutants(SWEEPS, SWEEP_WORDS, SEED, numbers), folder), ENOUGH)
        )
    assert not found, "\n\n".join(found)


def try_readings(numbers: range, folder: Path) -> None:
    tables = []
    for design in (QUICKSTART, FILES / "tables.yaml"):
        copy_file(design, folder)
        tables.append(folder / "good" / f"{design.stem}.csv")
        tables[-1].parent.mkdir(exist_ok=True)
        copy_file(design, tables[-1].parent)
        for table in FILES.glob("*.csv"):
            copy_file(table, tables[-1].parent)
        assert main(["simulate", str(design), "-o", str(tables[-1])]) == 0
    with Worker(fit, [tables[0]]) as worker:
        found = list(islice(faults(worker, table_mutants(tables, SEED, numbers), folder), ENOUGH))
    assert not found, "\n\n".join(found)


def try_trees(count: int, folder: Path) -> None:
    path = folder / "mutant.yaml"
    with Worker(check, [QUICKSTART]) as worker:

        @settings(
            max_examples=count,
            deadline=None,
            derandomize=True,
            database=None,
            phases=(Phase.explicit, Phase.generate, Phase.shrink),
            suppress_health_check=list(HealthCheck),
        )
        @given(trees(WORDS))
        def holds(tree: Any) -> None:
            path.write_bytes(emit_file(tree))
            assert worker(path) is None, f"kept as {path}"

        holds()


@pytest.mark.parametrize(
    ("trial", "numbers"),
    [(check, range(40)), (run, range(20_000, 20_008)), (simulate, range(30_000, 30_008))],
)
def test_some_mutants(trial: Any, numbers: range, folder: Path) -> None:
    try_experiments(trial, QUICK, numbers, folder)


def test_some_sweeps(folder: Path) -> None:
    try_sweeps(range(20), folder)


def test_some_tables_of_readings(folder: Path) -> None:
    try_readings(range(6), folder)


def test_some_trees(folder: Path) -> None:
    try_trees(20, folder)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(
    ("trial", "files", "numbers"),
    [
        (check, EXPERIMENTS, range(6000)),
        (run, QUICK, range(20_000, 21_000)),
        (simulate, QUICK, range(30_000, 31_000)),
    ],
)
def test_many_mutants(trial: Any, files: list[Path], numbers: range, folder: Path) -> None:
    try_experiments(trial, files, numbers, folder)


@pytest.mark.slow
@pytest.mark.long
def test_many_sweeps(folder: Path) -> None:
    try_sweeps(range(3000), folder)


@pytest.mark.slow
@pytest.mark.long
def test_many_tables_of_readings(folder: Path) -> None:
    try_readings(range(1000), folder)


@pytest.mark.slow
@pytest.mark.long
def test_many_trees(folder: Path) -> None:
    try_trees(1000, folder)
