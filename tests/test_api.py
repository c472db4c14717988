"""From Python: the same figures as from the command, and experiments changed and written there."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import ballplate as bp
import pytest
import yaml
from ballplate.cli import main

QUICKSTART = "designs/quickstart.yaml"


def printed(capsys: pytest.CaptureFixture[str], *arguments: str) -> Any:
    """What a command prints as JSON."""
    assert main([*arguments, "--json"]) in (0, 1)
    return json.loads(capsys.readouterr().out)


def test_results_are_those_of_the_commands(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "readings.csv"
    readings = bp.simulate(QUICKSTART)
    readings.to_csv(file, index=False)
    assert main(["simulate", QUICKSTART, "-o", str(tmp_path / "other.csv")]) == 0
    assert file.read_bytes() == (tmp_path / "other.csv").read_bytes()
    assert bp.check(QUICKSTART).to_dict() == printed(capsys, "check", QUICKSTART)
    assert bp.run(QUICKSTART, trials=20).to_dict() == printed(
        capsys, "run", QUICKSTART, "--trials", "20"
    )
    assert bp.fit(QUICKSTART, file).to_dict() == printed(capsys, "fit", QUICKSTART, str(file))
    assert bp.reliability(QUICKSTART).to_dict() == printed(
        capsys, "run", "--reliability", QUICKSTART
    )


def test_a_changed_experiment_is_one_with_the_text_changed(tmp_path: Path) -> None:
    text = (
        Path(QUICKSTART)
        .read_text("utf-8")
        .replace("repeatability: 0.2 um", "repeatability: 0.4 um")
    )
    file = tmp_path / "changed.yaml"
    file.write_text(text.replace("balls: [5, 5]", "balls: [7, 7]"), "utf-8")
    changed = (
        bp.quickstart()
        .with_({"machine.repeatability": "0.4 um"})
        .with_({"artefacts.plate.balls": [7, 7]})
    )
    assert bp.run(changed).quantities == bp.run(file).quantities
    assert bp.run(bp.quickstart()).quantities == bp.run(QUICKSTART).quantities


def test_sections_are_replaced_and_entries_removed() -> None:
    given = bp.quickstart().with_(target_uncertainty="1 um", title="another")
    assert given.title == "another" and given.target_uncertainty is not None
    assert given.with_(target_uncertainty=None).target_uncertainty is None
    less = given.with_({"positions[z high]": None})
    assert [one.name for one in less.positions] == ["z low", "x low", "x high", "y low", "y high"]
    assert len(given.positions) == 6


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"machine.repeatability": "1 kg"}, "machine.repeatability: .*unknown unit"),
        ({"machine.repeatibility": "1 um"}, "unknown key; did you mean"),
        ({"positions[z middle]": None}, 'there is no "z middle" in positions'),
        ({"positions[9]": None}, r"there is no positions\[9\]"),
        ({"seed": object()}, "an? object cannot be written"),
        ({"machine.volume": None}, 'missing; add "volume"'),
    ],
)
def test_wrong_changes_are_refused_with_their_path(changes: dict[str, Any], told: str) -> None:
    with pytest.raises(bp.ExperimentError, match=told):
        bp.quickstart().with_(changes)


def test_an_experiment_written_in_python(tmp_path: Path) -> None:
    sections = {
        "title": "two positions",
        "machine": {"volume": ["600 mm", "600 mm"], "repeatability": "0.5 um"},
        "error_model": {"kind": "metric"},
        "artefacts": {"plate": {"kind": "grid", "balls": [4, 4], "size": ["300 mm", "300 mm"]}},
        "positions": [
            {"name": "straight", "corner": {"x": "100 mm", "y": "100 mm"}},
            {"name": "turned", "corner": {"x": "200 mm", "y": "200 mm"}, "quarter_turns": 1},
        ],
    }
    file = tmp_path / "experiment.yaml"
    file.write_text(yaml.safe_dump(sections), "utf-8")
    given = bp.experiment(sections)
    assert bp.run(given).to_dict() == bp.run(file).to_dict()
    assert bp.run(given).quantities["U1"].count == 32
    with pytest.raises(bp.ExperimentError, match='experiment: title: missing; add "title"'):
        bp.experiment({})
    with pytest.raises(bp.ExperimentError, match="variants: are for files"):
        bp.experiment({"variants": {}})


def test_variants_are_chosen_by_name() -> None:
    with pytest.raises(bp.ExperimentError, match="several variants; choose one"):
        bp.load("designs/npl/6.1.1.yaml")
    with pytest.raises(bp.ExperimentError, match='no variant "E"; '):
        bp.load("designs/npl/6.1.1.yaml", variant="E")
    with pytest.raises(bp.ExperimentError, match="the file has no variants"):
        bp.load(QUICKSTART, variant="A")
