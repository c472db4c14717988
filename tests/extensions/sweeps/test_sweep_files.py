"""Sweep files: axes, ranges, subsets, conditions, and what is said of wrong ones."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from ballplate.extensions.sweeps.load import experiment_of, load_sweep
from ballplate.extensions.sweeps.model import Sweep
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.inputs.messages import ExperimentError

from tests.extensions.sweeps import wording
from tests.reference.copies import copy_file

HEAD = "title: a test\nbase: quickstart.yaml\n"
SIZE = '["artefacts.plate.size[0]", "artefacts.plate.size[1]"]'
BALLS = '["artefacts.plate.balls[0]", "artefacts.plate.balls[1]"]'

Written = Callable[[str], Path]


@pytest.fixture
def written(tmp_path: Path) -> Written:
    copy_file("designs/quickstart.yaml", tmp_path)

    def write(text: str) -> Path:
        path = tmp_path / "s.yaml"
        path.write_text(HEAD + text, encoding="utf-8")
        return path

    return write


def labels(sweep: Sweep) -> list[str]:
    return [sweep.label(k) for k in range(len(sweep.cells))]


def refusal(path: Path) -> list[str]:
    with pytest.raises(ExperimentError) as caught:
        load_sweep(path)
    return [str(message).removeprefix(f"{path.parent}/") for message in caught.value.messages]


def test_every_combination_is_a_cell(written: Written) -> None:
    sweep = load_sweep(
        written(
            f"axes:\n  size: {{paths: {SIZE}, from: 500 mm, to: 750 mm, step: 125 mm}}\n"
            f"  balls: {{paths: {BALLS}, values: [4, 5]}}\n"
        )
    )
    assert labels(sweep) == [
        f"size {size} mm, balls {balls}" for size in (500, 625, 750) for balls in (4, 5)
    ]
    assert [axis.column for axis in sweep.axes] == ["size_m", "balls"]
    assert [choice.value for choice in sweep.axes[0].choices] == [0.5, 0.625, 0.75]
    experiment = experiment_of(sweep, 2)
    np.testing.assert_allclose(
        np.ptp(experiment.layouts["plate"].coordinates, axis=0), [0.625, 0.625, 0.0], atol=1e-15
    )
    assert len(experiment.layouts["plate"].names) == 16


def test_values_that_change_together(written: Written) -> None:
    together = (
        'together: {"positions[z low].level": [100 mm, 200 mm], "positions[z high].level": [900 mm,'
        " 800 mm]}"
    )
    sweep = load_sweep(written(f"axes:\n  levels:\n    {together}\n    names: [wide, narrow]\n"))
    assert labels(sweep) == ["levels wide", "levels narrow"]
    second = experiment_of(sweep, 1)
    assert [one.pose.origin[2] for one in second.positions[:2]] == [0.2, 0.8]
    assert labels(load_sweep(written(f"axes:\n  levels:\n    {together}\n"))) == [
        "levels 100 mm / 900 mm",
        "levels 200 mm / 800 mm",
    ]


def test_named_values_and_conditions(written: Written) -> None:
    text = (
        f"axes:\n  size: {{paths: {SIZE}, values: {{small: 450 mm, middle: 600 mm, large: 750"
        f" mm}}}}\n  balls: {{paths: {BALLS}, values: [4, 5, 7]}}\n"
    )
    assert labels(
        load_sweep(written(text + "skip: [{size: {below: 500 mm}, balls: [5, 7]}]\n"))
    ) == [
        "size small, balls 4",
        *(f"size {size}, balls {balls}" for size in ("middle", "large") for balls in (4, 5, 7)),
    ]
    assert labels(
        load_sweep(written(text + "only: [{size: small}, {balls: {above: 5}, size: 0.75 m}]\n"))
    ) == [*(f"size small, balls {balls}" for balls in (4, 5, 7)), "size large, balls 7"]


@pytest.mark.parametrize("always, among", [("", "abcdef"), ("c", "abf"), ("bd", "")])
def test_subsets_are_all_of_a_size(always: str, among: str, written: Written) -> None:
    (base,) = load(Path("designs/quickstart.yaml"))
    names = dict(zip("abcdef", (one.name for one in base.positions), strict=True))
    fewest, most = max(len(always), 1), len({*always, *among})

    def subsets(*sizes: int) -> Path:
        chosen = f"always: {[names[k] for k in always]}, among: {[names[k] for k in among]}"
        subsets = f"{{sizes: {[*sizes]}, {chosen}}}"
        return written(f"axes: {{kept: {{path: positions, subsets: {subsets}}}}}\n")

    sizes = range(fewest, most + 1)
    sweep = load_sweep(subsets(*sizes))
    every = (some for size in sizes for some in combinations("abcdef", size))
    expected = [some for some in every if {*always} <= {*some} <= {*always, *among}]
    for cell, some in enumerate(expected):
        kept, others = [names[k] for k in some], [names[k] for k in "abcdef" if k not in some]
        words = f"all but {' and '.join(others)}" if others else "all"
        words = words if 2 * len(others) < len(kept) else " + ".join(kept)
        assert sweep.axes[0].choices[cell].label == words
    assert [one.name for one in experiment_of(sweep, len(expected) - 1).positions] == kept
    assert len(sweep.cells) == len(expected)
    for size in {max(fewest - 1, 1), most + 1} - {fewest}:
        assert f" {size} entries; give {fewest} to {most}" in refusal(subsets(size))[0]


def test_variants_are_an_axis(written: Written, tmp_path: Path) -> None:
    text = (tmp_path / "quickstart.yaml").read_text(encoding="utf-8")
    variants = (
        'variants: {few: {"artefacts.plate.balls": [4, 4]}, many: {"artefacts.plate.balls": [7,'
        " 7]}}\n"
    )
    (tmp_path / "quickstart.yaml").write_text(text + variants, encoding="utf-8")
    levels = 'level: {path: "positions[z low].level", values: [100 mm, 200 mm]}'
    sweep = load_sweep(written(f"axes:\n  design: {{variants: all}}\n  {levels}\n"))
    assert labels(sweep)[1] == "design few, level 200 mm"
    assert [len(experiment_of(sweep, k).layouts["plate"].names) for k in (1, 2)] == [16, 49]
    assert refusal(written(f"axes:\n  {levels}\n"))[0] == wording.HAS_THE_VARIANTS_FEW
    assert len(load_sweep(written(f"variant: many\naxes:\n  {levels}\n")).cells) == 2
    assert refusal(written(f"variant: mny\naxes:\n  {levels}\n"))[0].startswith(
        wording.NO_VARIANT_IN_QUICKSTART_YAML
    )


def test_subsets_are_of_each_variants_own_list(written: Written, tmp_path: Path) -> None:
    text = (tmp_path / "quickstart.yaml").read_text(encoding="utf-8")
    variants = (
        'variants: {low: {"positions[z low].level": 100 mm}, high: {"positions[z low].level": 300'
        " mm}}\n"
    )
    (tmp_path / "quickstart.yaml").write_text(text + variants, encoding="utf-8")
    subsets = "kept: {path: positions, subsets: {sizes: [5], always: [z low]}}"
    sweep = load_sweep(written(f"axes:\n  design: {{variants: all}}\n  {subsets}\n"))
    levels = [experiment_of(sweep, k).positions[0].pose.origin[2] for k in range(len(sweep.cells))]
    assert levels == [0.1] * 5 + [0.3] * 5
    assert refusal(written("axes:\n  a: {variants: all}\n  b: {variants: [low]}\n")) == [
        wording.THE_AXIS_CHOOSES_THE_VARIANT_ALREADY
    ]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "axis: {a: {path: seed, values: [1]}}\n",
            ["s.yaml:3:1: axis: unknown key"],
        ),
        (
            "axes:\n"
            + "".join(
                f"  {a}: {{path: 'positions[{k}].level', from: 1 mm, to: 100 mm, count: 100}}\n"
                for k, a in enumerate("abcd")
            ),
            ["s.yaml:3:1: axes: 100000000 combinations of values; 1000000 are the limit"],
        ),
    ],
)
def test_what_is_wrong_is_said(written: Written, text: str, expected: list[str]) -> None:
    found = refusal(written(text))
    assert len(found) == len(expected), found
    for one in expected:
        assert any(line.startswith(one) for line in found), (one, found)


def test_a_wrong_base_file_is_refused(written: Written, tmp_path: Path) -> None:
    path = written("axes:\n  a: {path: seed, values: [1]}\n")
    text = (tmp_path / "quickstart.yaml").read_text(encoding="utf-8")
    (tmp_path / "quickstart.yaml").write_text(text.replace("[5, 5]", "[5, 0]"), encoding="utf-8")
    assert refusal(path)[0].startswith("quickstart.yaml:35:34: artefacts.plate.balls[1]: ")
    (tmp_path / "quickstart.yaml").unlink()
    assert refusal(path) == [
        "s.yaml:2:7: base: "
        + f"{tmp_path}/quickstart.yaml: there is no such file; check the name and the folder"
    ]
