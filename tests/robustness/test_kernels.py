"""What is told does not depend on the kernels of linear algebra, which round in other ways.

OpenBLAS has kernels for many processors and takes those that the variable OPENBLAS_CORETYPE names.
Symmetrical designs are the hard ones: of what is equal but for rounding anything could be told
first, and a null space in any basis.
"""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from tests.extensions.planning.small_pool import TEXT as POOL
from tests.reference.copies import copy_file
from tests.robustness.kernels import architectures

ROOT = Path(__file__).parents[2]

# What OpenBLAS calls each processor that a kernel is for, and what that has to have.
KERNELS = {
    "Haswell": ({"Haswell"}, {"avx2", "fma"}),
    "SkylakeX": ({"SkylakeX"}, {"avx512f", "avx512bw", "avx512dq", "avx512vl", "avx512cd"}),
    "Sandybridge": ({"Sandybridge"}, {"avx"}),
    "Prescott": ({"Prescott", "Katmai"}, {"pni"}),
}
# All tests run with one of these where the machine has it, and the other is between the two that
# are tried every time: with and without the multiplication that rounds once.
OTHERS = ("SkylakeX", "Sandybridge")

# Status, standard output and standard error of each command.
Said = list[tuple[int, str, str]]

# Three positions that any turn about the volume's diagonal takes into one another.
CENTRED = """positions:
  - {name: z, plane: z, level: 500 mm, corner: {x: 125 mm, y: 125 mm}, probes: [down]}
  - {name: x, plane: x, level: 500 mm, corner: {y: 125 mm, z: 125 mm}, probes: [right, left]}
  - {name: y, plane: y, level: 500 mm, corner: {z: 125 mm, x: 125 mm}, probes: [back, front]}
"""

FEW = [
    "check centred.yaml weak.yaml",
    "check --suggest small.yaml",
    "run --json small.yaml",
    "simulate centred.yaml -o centred.csv",
    "fit centred.yaml centred.csv",
]
COMMANDS = [
    "check npl.yaml quickstart.yaml bar-bell.yaml bryan-gauge.yaml",
    "check known.yaml alone.yaml",
    "check --json npl.yaml centred.yaml weak.yaml",
    "check --suggest npl.yaml --variant B",
    "run npl.yaml quickstart.yaml centred.yaml",
    "run --reliability npl.yaml --variant B",
    "run --reliability small.yaml",
    "simulate npl.yaml --variant B -o npl.csv",
    "fit npl.yaml npl.csv --variant B",
    "plan pool.yaml --positions 3 --workers 1",
]


def designs(folder: Path) -> None:
    """Write the designs: as symmetrical as they can be, of full rank, deficient, and with weak
    directions.
    """
    quickstart = (ROOT / "designs" / "quickstart.yaml").read_text(encoding="utf-8")
    centred, count = re.subn(r"positions:\n(  - .*\n)+", CENTRED, quickstart)
    assert count == 1
    target, calibration = (
        "target_uncertainty: 0.5 um + L/1000000",
        re.compile(r"calibration:.*?\n\n", re.DOTALL),
    )
    for text, one in (
        (quickstart, target),
        (centred, "_coefficients: 5"),
        (centred, "balls: [5, 5]"),
    ):
        assert one in text
    assert calibration.search(centred)
    written = {
        "quickstart": quickstart,
        "centred": centred,
        # Only the scale of one plate, and hardly anything determined.
        "known": calibration.sub("", centred),
        "alone": re.sub(r"  - \{name: [xy],.*\n", "", centred),
        "weak": quickstart.replace(target, "target_uncertainty: 0.02 um"),
        "small": (
            centred.replace("_coefficients: 5", "_coefficients: 3").replace(
                "balls: [5, 5]", "balls: [4, 4]"
            )
        ),
        "pool": POOL,
    }
    for name, text in written.items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    copy_file(ROOT / "designs" / "npl" / "6.1.1.yaml", folder / "npl.yaml")
    for name in ("bar-bell", "bryan-gauge"):
        copy_file(ROOT / "designs" / "hurt_foss" / f"{name}.yaml", folder)


def why_not(kernel: str) -> str:
    """Why a kernel cannot be tried here; empty where it can."""
    if not architectures():
        return "NumPy has no OpenBLAS"
    try:
        features = set(
            re.findall(r"^flags\s*:(.*)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)[
                0
            ].split()
        )
    except (OSError, IndexError):
        return "what this processor can do is not known"
    missing = KERNELS[kernel][1] - features
    return f"this processor lacks {', '.join(sorted(missing))}" if missing else ""


@pytest.fixture(scope="module")
def said(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, bool], Said]:
    """What the commands say under a kernel that can be tried."""

    @cache
    def under(kernel: str, is_whole: bool) -> Said:
        folder = tmp_path_factory.mktemp(kernel)
        designs(folder)
        environment = os.environ | {
            "OPENBLAS_CORETYPE": kernel,
            "OPENBLAS_NUM_THREADS": "1",
            "PYTHONPATH": str(ROOT),
        }
        done = subprocess.run(
            [sys.executable, ROOT / "tests" / "robustness" / "kernels.py"],
            cwd=folder,
            env=environment,
            input=json.dumps([line.split() for line in (FEW + COMMANDS if is_whole else FEW)]),
            stdout=subprocess.PIPE,
            text=True,
            check=True,
        )
        answer = json.loads(done.stdout)
        assert set(answer["architectures"]) <= KERNELS[kernel][0]
        return [tuple(one) for one in answer["said"]]

    return under


def assert_same_text(one: str, other: str, of: str) -> None:
    """Line by line; the bound of a plan, an iteration's, which ends within a thousandth, to
    that.  Progress, which a busy machine shows for steps that are silent on an idle one, is left
    out.
    """
    lines, others = (
        [line for line in text.splitlines() if " so far, " not in line] for text in (one, other)
    )
    assert len(lines) == len(others), of
    for line, same in zip(lines, others, strict=True):
        if line.startswith(("bound of any choice", "the choice is ")):
            numbers, words = zip(*(split(text) for text in (line, same)), strict=True)
            assert words[0] == words[1], of
            assert numbers[0] == pytest.approx(numbers[1], rel=1e-3), of
        else:
            assert line == same, of


def split(line: str) -> tuple[list[float], str]:
    """The numbers of a line, and what is left of it."""
    pattern = r"\d+(?:\.\d+)?"
    return [float(number) for number in re.findall(pattern, line)], re.sub(pattern, "#", line)


def assert_same_data(one: Any, other: Any, place: str = "") -> None:
    """JSON: the same words, counts and keys in the same order; numbers to six digits, beside what
    is rounding.
    """
    assert type(one) is type(other), place
    if isinstance(one, dict):
        assert list(one) == list(other), place
        for key in one:
            if key == "singular_values":
                assert one[key] == pytest.approx(other[key], rel=1e-6, abs=1e-13 * one[key][0]), (
                    place
                )
            else:
                assert_same_data(one[key], other[key], f"{place}.{key}")
    elif isinstance(one, list):
        assert len(one) == len(other), place
        for k, (left, right) in enumerate(zip(one, other, strict=True)):
            assert_same_data(left, right, f"{place}[{k}]")
    elif isinstance(one, float):
        assert math.isclose(one, other, rel_tol=1e-6, abs_tol=1e-16), (place, one, other)
    else:
        assert one == other, place


@pytest.mark.parametrize(
    ("kernel", "is_whole"),
    [
        pytest.param(kernel, is_whole, marks=pytest.mark.long)
        for kernel, is_whole in [("Prescott", False), *((kernel, True) for kernel in KERNELS)]
    ],
)
def test_the_same_is_told_with_every_kernel(
    kernel: str, is_whole: bool, said: Callable[[str, bool], Said]
) -> None:
    """As with the first that can be tried."""
    if why_not(kernel):
        pytest.skip(why_not(kernel))
    first = said(next(one for one in KERNELS if not why_not(one)), is_whole)
    # What the commands are about must show.
    text = "".join(out for _, out, _ in first)
    words = ["undetermined 2: ", "weakly determined 2: "]
    for word in words + ["bound of any choice", "cannot be detected"] * is_whole:
        assert word in text, word
    assert {status for status, _, _ in first} == {0, 1}
    commands = FEW + COMMANDS * is_whole
    for command, one, other in zip(commands, first, said(kernel, is_whole), strict=True):
        assert one[0] == other[0], command
        assert_same_text(one[2], other[2], command)
        if "--json" in command:
            assert_same_data(json.loads(one[1]), json.loads(other[1]), command)
        else:
            assert_same_text(one[1], other[1], command)
