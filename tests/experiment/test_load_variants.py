"""Variants: overrides by path, and messages at the variant's own line."""

from pathlib import Path

import pytest
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.messages import ExperimentError

from tests.experiment import wording

BASE = """\
title: base
machine: {volume: [1 m, 1 m, 1 m], repeatability: 1 um}
error_model: {kind: kinematic}
probes: {down: [0 mm, 0 mm, 0 mm]}
artefacts: {plate: {kind: grid, balls: [2, 2], size: [500 mm, 500 mm]}}
positions:
  - {name: low, plane: z, level: 0 mm, corner: {x: 0 mm, y: 0 mm}}
  - {name: high one, plane: z, level: 1 m, corner: {x: 0 mm, y: 0 mm}}
"""


def loaded(folder: Path, text: str) -> tuple[Experiment, ...]:
    path = folder / "e.yaml"
    path.write_text(text, encoding="utf-8")
    return load(path)


def refusals(folder: Path, text: str) -> list[str]:
    with pytest.raises(ExperimentError) as caught:
        loaded(folder, text)
    return str(caught.value).replace(f"{folder}/", "").split("\n")


def test_variants_replace_a_place_once(tmp_path: Path) -> None:
    text = (
        BASE
        + """\
variants:
  A:
    positions[low].level: 1 mm
    positions[0].level: 2 mm
  B:
    positions: []
    positions[0].level: 2 mm
"""
    )
    lines = refusals(tmp_path, text)
    assert lines[0].startswith(wording.IS_PART_OF_THE_SAME_2)
    assert lines[1].startswith(wording.IS_PART_OF_THE_SAME_PLACE)


@pytest.mark.parametrize("value", ["true", '"7"', "7.0", "1e0"])
@pytest.mark.parametrize("key", ["seed", "expected_rank_deficiency"])
def test_whole_numbers_are_whole_numbers(tmp_path: Path, key: str, value: str) -> None:
    (line,) = refusals(tmp_path, f"{BASE}{key}: {value}\n")
    assert line.startswith(f"e.yaml:9:{len(key) + 3}: {key}: expected a whole number")


def test_one_experiment_per_variant(tmp_path: Path) -> None:
    first, second, third = loaded(
        tmp_path,
        BASE
        + """\
variants:
  A: {}
  B:
    title: other
    calibration: [{kind: distances, pairs: all, standard_uncertainty: 1 um}]
    positions[1].quarter_turns: 1
    positions[high one].level: 900 mm
  3:
    error_model.position_coefficients: 3
    artefacts.plate.size: [600 mm, 600 mm]
    positions[0]: {name: new, plane: z, level: 0 mm, corner: {x: 0 mm, y: 0 mm}}
""",
    )
    assert [one.label for one in (first, second, third)] == ["e[A]", "e[B]", "e[3]"]
    assert [one.name for one in (first, second, third)] == ["A", "B", "3"]
    assert (first.title, second.title) == ("base", "other")
    assert (len(first.calibration), len(second.calibration)) == (0, 1)
    assert second.positions[1].pose.origin[2] == 0.9
    assert second.positions[1].pose.rotation[0, 0] == 0.0
    assert first.positions[1].pose.rotation[0, 0] == 1.0
    assert third.error_model.position_coefficients == 3
    assert third.layouts["plate"].coordinates[-1, 0] == 0.6
    assert third.positions[0].name == "new"


def test_the_base_need_not_be_complete(tmp_path: Path) -> None:
    text = BASE.replace("error_model: {kind: kinematic}\n", "")
    (only,) = loaded(tmp_path, text + "variants: {A: {error_model: {kind: kinematic}}}\n")
    assert only.error_model.kind == "kinematic"
    lines = refusals(tmp_path, text + "variants: {A: {error_model: {kind: kinematic}}, B: {}}\n")
    about = "the errors of the machine that are estimated"
    assert lines == [
        f'e.yaml:1:1: error_model: missing; add "error_model" ({about}) (in variant B)'
    ]


def test_messages_stand_at_the_line_of_the_variant(tmp_path: Path) -> None:
    text = BASE + "variants:\n  A: {}\n  B:\n    positions[low].level: 5\n    seed: x\n"
    assert refusals(tmp_path, text) == [(wording.HAS_NO_UNIT), (wording.EXPECTED_A_WHOLE)]


def test_a_message_about_the_base_comes_once(tmp_path: Path) -> None:
    text = BASE.replace("1 um", "1 mu") + "variants: {A: {}, B: {}}\n"
    (line,) = refusals(tmp_path, text)
    assert line.startswith(wording.HAS_THE_UNKNOWN_UNIT)
    assert "variant" not in line


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("positions[hihg one].level", 'there is no "hihg one" in positions; did you mean "high one"?'),
        ("positions[2]", "there is no positions[2]; the indices are 0 to 1"),
        ("artefacts.plat.size", 'there is no artefacts.plat; did you mean "plate"?'),
        ("calibration[0].pairs", 'there is no calibration; known: title, machine, error_model, '
        'probes, artefacts, '
         "positions"),
        ("tilte", '"tilte" cannot be replaced in a variant; did you mean "title"?'),
        ("title.x", 'title is the text "base" and has no entries; replace it as a whole'),
        ("positions[0", '"positions[0" is not a path; write for example positions[1].level or '
         "artefacts.plate.size"),
    ],
)  # fmt: skip
def test_paths_that_lead_nowhere(tmp_path: Path, path: str, text: str) -> None:
    (line,) = refusals(tmp_path, BASE + f"variants:\n  A:\n    {path}: 1\n")
    assert line.startswith("e.yaml:11:5: variants.A") and line.endswith(f": {text}")


def test_variants_that_are_none(tmp_path: Path) -> None:
    assert refusals(tmp_path, BASE + "variants: 5\n") == [wording.EXPECTED_A_MAPPING_NAME]
    assert refusals(tmp_path, BASE + "variants: {A: 5}\n") == [wording.EXPECTED_A_MAPPING]
