"""Whatever stands in a file, there is a result or what is wrong with the file, soon and in bounded memory."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, given, settings

from simulator.experiment.schema import schema

from tests.robustness.mutations import Mutant, emit_file, mutants, trees, vocabulary
from tests.robustness.worker import Worker, complaint

SEED = 1
FILES = Path(__file__).parent / "files"
# Those that are planned in no time are tried more often.
QUICK = [Path("designs/quickstart.yaml"), *sorted(Path("designs/hocken_borchardt").glob("*.yaml")), *FILES.glob("*.yaml")]
EXPERIMENTS = [*sorted(Path("designs/npl").glob("*.yaml")), *5 * sorted(QUICK)]
SIZES = ["0 mm", "-1 m", "1 nm", "1 pm", "1e-300 m", "1e300 m", "1e9 m", "1e-9 pm", "999999 m", "5", 5, "1e-18 m"]
WILD: dict[str, list[Any]] = {
    "balls": [[500, 500], [200, 200], [2, 500], [10**5, 10**5], [10**9, 2], 10**9, 500, 2, [1, 1], ["r1c1"] * 3, "corners"],
    "size": [*SIZES, ["1e300 m", "1 m"], ["1 nm", "1 nm"]],
    "volume": [["1e300 m"] * 3, ["1 nm"] * 3, ["1e-300 m"] * 2, ["1 m"] * 4, {"x": ["0 m", "0 m"], "y": ["0 m", "1e300 m"]}],
    "repeatability": [*SIZES, ["1e-300 m", "1e300 m", "1 um"]],
    "standard_uncertainty": [*SIZES, "1e-300 m + L/1e-300", "1e300 um + L/1", {"z": "1 um"}, ["1 um", "1e300 m"]],
    "target_accuracy": [*SIZES, "1e-300 m + L/1e300"],
    "level": SIZES,
    "length": SIZES,
    "repeats": [10_000, 10_001, 10**12, 0],
    "random": [10**9, 1_000_000, 1_000_001, 0],
    "seed": [10**290, 2**64, -1, 1.5],
    "quarter_turns": [10**18, -(10**18), 10**290, 3],
    "position_coefficients": [10**6, 30, 31, 2],
    "rotation_coefficients": [10**6, 30, 31, 1],
    "coefficients": [10**6, 12, 13, 2],
    "order": [10**6, 12, 13, 2],
    "knots": [[k / 30_001 for k in range(1, 30_001)], [k / 101 for k in range(1, 101)], [0.5] * 11, [1e-300], [1e-9, 2e-9]],
    "centres": [[8, 8, 8], [9, 9, 9], [2, 2, 8], [10**9] * 3],
    "constant": [1e-300, 1e-9, 10],
    "terms": [{"centres": [8, 8, 8]}, "tensor", "quadratic", {"centres": [4, 4, 4], "constant": 1e-300}],
    "pairs": ["all", "braced", "neighbours", [["r1c1", "r1c1"]], [[f"r1c{k}", f"r2c{k}"] for k in range(20_000)]],
    "origin": [["1e300 m"] * 3, ["-1e300 m", "0 m"], ["0 m"] * 2],
    "rotation": ["1e300 rad", ["1e300 rad"] * 3, ["90 deg"] * 3, "90 deg"],
    "rotations": ["full", "linearised"],
    "offset": [["1e300 m"] * 3, ["1e9 m", "0 m", "0 m"]],
    "object": ["json:loads", "os:getcwd", "no_such_module:build", "math:pi", ":", "a:b:c", "os.path:join", "mutant", "x" * 5000],
    "options": [{"a": 10**290}, {"": 1}],
    "values": [{"EXX t^2": "1e300 m"}, {"EXX[1]": "1e-300 m"}, {"EAX t^1": "1e5 rad"}, {"x": "1 um"}, {f"EXX t^{k}": "1 um" for k in range(9)}],
    "position": ["1e300 m", "1e9 m", "10 m", "1e-300 m"],
    "expected_rank_deficiency": [10**290, 10**9, 5],
    "variants": [{str(k): {"title": "a"} for k in range(3)}, {f"v{k}": {"title": "a"} for k in range(300)}, {"a": {"positions[0]": 5}}],
    "parameter": ["EXX", "EAX", "x" * 5000, "EXX[1]", "EXX t^2", "low: rotation x"],
    "value": ["1e300 m", "1 um", "1e5 rad"],
}
WORDS = vocabulary(schema(), WILD)


def check(path: Path) -> str | None:
    """What is wrong with what `ballplate check` makes of a file."""
    return complaint(["check", *(["--json"] if path.stat().st_size % 2 else []), str(path)], path.parent)


def run(path: Path) -> str | None:
    """What is wrong with what `ballplate run` makes of a file."""
    return complaint(["run", *(["--json"] if path.stat().st_size % 2 else []), str(path)], path.parent)


def simulate(path: Path) -> str | None:
    """What is wrong with the readings that `ballplate simulate` makes of a file."""
    return complaint(["simulate", str(path), "-o", "-"], path.parent)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Where mutants are tried, with the tables that they name, and other things that can be named."""
    for table in FILES.glob("*.csv"):
        shutil.copy(table, tmp_path)
    (tmp_path / "loop.csv").symlink_to("loop.csv")
    os.mkfifo(tmp_path / "pipe.csv")
    return tmp_path


def faults(worker: Worker, found: Iterable[Mutant], folder: Path, at_most: int = 5) -> Iterator[str]:
    """Mutants that go wrong, each kept in the folder."""
    for mutant in found:
        path = folder / "mutant.yaml"
        path.write_bytes(mutant.content)
        fault = worker(path)
        if fault is None:
            continue
        kept = folder / f"fault-{mutant.number}.yaml"
        shutil.copy(path, kept)
        yield f"{mutant}, kept as {kept}\n{fault}"
        at_most -= 1
        if at_most == 0:
            return


@pytest.mark.parametrize(("trial", "numbers"), [(check, range(200)), (run, range(1000, 1050)), (simulate, range(2000, 2050))])
def test_some_mutants(trial: Any, numbers: range, folder: Path) -> None:
    with Worker(trial, QUICK[0]) as worker:
        assert list(faults(worker, mutants(sorted(QUICK), WORDS, SEED, numbers), folder)) == []
