"""Repairs written into files: what was not to change has not."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import pytest
from ballplate.extensions.repair.changes import changed
from ballplate.extensions.repair.mending import changes_of, with_experiment, with_text_changes
from ballplate.extensions.repair.repair_search import repairs
from ballplate.extensions.repair.repairs import Repair
from ballplate.results.prediction import check
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.messages import ExperimentError

from tests.extensions.repair import wording
from tests.reference.yaml_styles import Writer, plain

SOURCE = Path("example.yaml")


def shifted(**changed: Any) -> dict[str, Any]:
    """A plate that is shifted and never turned, which leaves squareness and one scale open."""
    corner = {"x": "250 mm", "y": "250 mm"}
    return {
        "title": "ebene Platte, 4 × 4",
        "machine": {"volume": ["900 mm", "900 mm"], "repeatability": "0.2 um"},
        "error_model": {"kind": "metric", "scale": "x"},
        "artefacts": {"Prüfplatte": {"kind": "square", "balls": 4, "size": "360 mm"}},
        "positions": [
            {"name": "2", "corner": corner},
            {"name": "ü 1", "corner": {"x": "350 mm", "y": "300 mm"}},
            {"name": "0", "corner": {"x": "150 mm", "y": "400 mm"}, "repeats": 2},
        ],
        "seed": 4,
        **changed,
    }


def experiment(text: str, variant: str | None = None) -> Experiment:
    return next(one for one in load(SOURCE, planning=True, text=text) if one.name == variant)


def first_repair(text: str, variant: str | None = None) -> Repair:
    chosen = experiment(text, variant)
    found = repairs(chosen)
    assert found.repairs
    return found.repairs[0]


def mended(text: str, variant: str, repair: Repair) -> str:
    before = experiment(text, variant)
    return with_experiment(text, SOURCE, before, changed(before, repair.changes))


def text_of(said: dict[str, Any], seed: int = 0, comments: bool = False) -> str:
    writer = Writer(Random(seed), comments)
    writer.block(said, 0, ())
    return "".join(text for text, _ in writer.pieces)


@cache
def repair_of_shifted() -> Repair:
    return first_repair(text_of(shifted()))


def test_a_number_as_name_means_the_position_of_that_name() -> None:
    """In a path, a number counts entries."""
    repair = repair_of_shifted()
    (edit,) = repair.edits
    variants = {"as it is": {}, "mended": {"seed": 7}}
    text = text_of(shifted(variants=variants))
    after = plain(mended(text, "mended", repair))
    at = next(k for k, one in enumerate(shifted()["positions"]) if one["name"] == edit.steps[1])
    assert edit.steps[1] != str(at)
    turns = edit.value["quarter_turns"]
    assert after["variants"]["mended"] == {"seed": 7, f"positions[{at}].quarter_turns": turns}
    assert after["variants"]["as it is"] == {} and after["positions"] == shifted()["positions"]


def test_a_variant_of_its_own_positions_is_changed_there() -> None:
    own = shifted()["positions"]
    text = text_of(shifted(variants={"a": {"positions": own}, "b": {"positions": own[:1]}}))
    repair = first_repair(text, "a")
    after = plain(mended(text, "a", repair))
    assert after["positions"] == own and after["variants"]["b"] == {"positions": own[:1]}
    turned = [one.get("quarter_turns", 0) for one in after["variants"]["a"]["positions"]]
    assert sum(turn > 0 for turn in turned) == 1


def test_what_is_set_within_the_change_already_is_refused() -> None:
    text = """\
title: shared
machine: {volume: [900 mm, 900 mm], repeatability: 0.2 um}
error_model: {kind: metric, scale: x}
artefacts: {plate: {kind: square, balls: 4, size: 360 mm}}
positions:
  - {name: a, corner: {x: 250 mm, y: 250 mm}}
  - {name: c, corner: {x: 300 mm, y: 300 mm}}
variants:
  own: {"positions[a].corner.x": 200 mm, seed: 2}
pool: {}
"""
    # Where a pool is, no other positions are added, and one that is there is turned.
    repair = first_repair(text, "own")
    # As where the position is moved, too.
    (edit,) = repair.edits
    moved = {**edit.value, "corner": {"x": "210 mm", "y": "260 mm"}}
    changes = changes_of(experiment(text, "own"), [replace(edit, value=moved)])
    with pytest.raises(ExperimentError, match=wording.INCLUDES_THIS) as caught:
        with_text_changes(text, SOURCE, "own", changes)
    assert str(caught.value).startswith(f"{SOURCE}:9:9: variants.own: ")


def test_a_variant_gets_a_position_more_and_another_changed() -> None:
    """The list that it then has of its own is the one in which the other is changed."""
    text = """title: two
machine: {volume: [600 mm, 600 mm, 600 mm], repeatability: 0.5 um}
error_model: {kind: metric}
probes: {down: [0 mm, 0 mm, -50 mm], side: [50 mm, 0 mm, 0 mm]}
artefacts: {plate: {kind: grid, balls: [3, 3], size: [300 mm, 300 mm]}}
positions:
  - {name: a, plane: z, level: 100 mm, corner: {x: 100 mm, y: 100 mm}, probes: [down]}
  - {name: b, plane: z, level: 400 mm, corner: {x: 100 mm, y: 100 mm}, probes: [down]}
target_uncertainty: 1 um
evaluation: {points: {random: 20, seed: 1}, probe: down}
variants:
  A: {"positions[b].level": 300 mm}
  B: {machine.repeatability: 1 um}
"""
    found = mended(text, "B", first_repair(text, "B"))
    assert "positions: [{" in found.partition("B: {")[2]
    assert check(experiment(text, "B")).verdict.deficiency > 0
    assert check(experiment(found, "B")).verdict.deficiency == 0
