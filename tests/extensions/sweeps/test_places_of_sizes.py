"""Plates that follow their size or stay: what sweeps, `reach` and variants report, and the figures
of both.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import ballplate as bp
import pytest
from ballplate.cli import main
from ballplate.simulator.experiment.loading import load

from tests.extensions.sweeps import wording
from tests.reference.small_quickstart import in_lengths

TEXT = Path("designs/quickstart.yaml").read_text(encoding="utf-8")
AXES = {"z": "xy", "x": "yz", "y": "zx"}
LOST = "plates span x 0 to {0} of 1000 mm, y 0 to {0} of 1000 mm, z 0 to {0} of 1000 mm; {1}"


LENGTHS = in_lengths(TEXT)
SIZE = '"artefacts.plate.size": [{0} mm, {0} mm]'


def written(folder: Path, text: str) -> Path:
    path = folder / "e.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def notes(folder: Path, text: str, variants: str) -> list[tuple[str, ...]]:
    path = written(folder, f"{text}\nvariants:\n{variants}")
    return [experiment.notes for experiment in load(path)]


def test_following_is_what_one_would_write_by_hand(tmp_path: Path) -> None:
    size = "artefacts.plate.size"
    followed = bp.load(written(tmp_path, TEXT)).with_({size: ["450 mm", "600 mm"]})
    changes: dict[str, object] = {size: ["450 mm", "600 mm"]}
    turned = {"z high", "x low", "y high"}
    for position in followed.positions:
        plane, end = position.name.split()
        sides = [0.6, 0.45] if position.name in turned else [0.45, 0.6]
        # The artefact's first side goes to the first of these axes.
        corner = {
            axis: f"{1e3 * (1.0 - side) * (end == 'high')} mm"
            for axis, side in zip(AXES[plane], sides, strict=True)
        }
        changes[f"positions[{position.name}].corner"] = corner
    by_hand = bp.load(written(tmp_path, LENGTHS)).with_(changes)
    assert bp.run(by_hand).quantities["U6"].average == pytest.approx(
        bp.run(followed).quantities["U6"].average, rel=1e-9
    )


def test_variants_with_plates_that_stay_are_noted(tmp_path: Path) -> None:
    variants = f"""\
  nominal: {{}}
  small: {{{SIZE.format(450)}}}
  long: {{machine.volume: [1 m, 1500 mm, 1 m]}}
  down: {{machine.volume: {{x: [0 mm, 1 m], y: [0 mm, 1 m], z: [-200 mm, 1 m]}}}}
  noisy: {{machine.repeatability: 1 um}}
  balls: {{"artefacts.plate.balls": [4, 4]}}
  moved: {{{SIZE.format(450)}, "positions[z high].corner": {{x: 550 mm, y: 550 mm}}}}
  all moved: {{{SIZE.format(450)}, "positions[z high].corner": {{x: 550 mm, y: 550 mm}}, "positions[x high].corner.z": 550 mm}}
  flat: {{machine.volume: [1 m, 1 m], positions: [{{name: a, corner: {{x: 9 mm, y: 9 mm}}, probes: [down]}}], probes: {{down: [0 mm, 0 mm]}}, error_model: {{kind: kinematic}}, evaluation: {{points: {{random: 9}}}}}}
"""
    places = wording.THE_PLACES_ARE_LENGTHS
    found = notes(tmp_path, LENGTHS, variants)
    assert [len(lines) for lines in found] == [0, 1, 1, 1, 0, 0, 1, 0, 0]
    path, line = written(tmp_path, ""), len(LENGTHS.splitlines()) + 4
    assert found[1] == (
        f"{path}:{line}:3: variants.small: {LOST.format(700, places.format('x: high'))}",
    )
    assert found[2][0].endswith(f"plates span y 0 to 1000 of 1500 mm; {places.format('y: high')}")
    assert found[3][0].endswith(f"plates span z 0 to 1000 of 1200 mm; {places.format('z: low')}")
    # What is moved is taken as it is.
    assert found[6][0].endswith(f"plates span z 0 to 700 of 1000 mm; {places.format('z: high')}")
    # Plates that follow have nothing to note.
    assert not any(notes(tmp_path, TEXT, variants.replace("550 mm", "high")))


def test_some_places_in_lengths_are_noted(tmp_path: Path) -> None:
    """Plates that follow at one end do not make good for those that stay at the other."""
    mixed = re.sub(r"\b([xyz]): high", r"\1: 250 mm", TEXT)
    variants = f"  small: {{{SIZE.format(450)}}}\n  noisy: {{machine.repeatability: 1 um}}\n"
    small, noisy = notes(tmp_path, mixed, variants)
    assert small[0].endswith(LOST.format(700, wording.THE_PLACES_ARE_LENGTHS.format("x: high")))
    assert not noisy
    # Nothing is lost along axes where plates that follow reach both ends still.
    ends = TEXT.replace("{x: high, y: high}", "{x: 250 mm, y: 250 mm}")
    assert notes(tmp_path, ends, variants) == [(), ()]


def test_sweeps_note_it_in_text_table_json_and_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "quickstart.yaml").write_text(LENGTHS, encoding="utf-8")
    paths = '["artefacts.plate.size[0]", "artefacts.plate.size[1]"]'
    (tmp_path / "s.yaml").write_text(
        "title: sizes\nbase: quickstart.yaml\n"
        f"axes:\n  size: {{paths: {paths}, values: [450 mm, 550 mm, 750 mm]}}\n"
        "  noise: {path: machine.repeatability, values: [0.2 um, 0.3 um]}\nrecord: [U6]\n",
        encoding="utf-8",
    )
    texts = [
        LOST.format(length, wording.THE_PLACES_ARE_LENGTHS.format("x: high"))
        for length in (700, 800)
    ]
    assert main(["sweep", str(tmp_path / "s.yaml"), "--workers", "1"]) == 0
    complaints = capsys.readouterr().err
    assert f"case 0 and 1 more: {texts[0]}\ncase 2 and 1 more: {texts[1]}\n" in complaints
    result = bp.stored(tmp_path / "s.sqlite")
    expected = [*texts[:1] * 2, *texts[1:] * 2, "", ""]
    assert result.to_frame()["unspanned"].tolist() == expected
    assert [row["unspanned"] for row in result.to_dict()["rows"]] == expected
    assert texts[0] in str(result) and json.dumps(texts[0])[1:-1] in json.dumps(result.to_dict())
    main(["sweep", "--export", str(tmp_path / "s.sqlite"), "-o", str(tmp_path / "s.csv")])
    assert (tmp_path / "s.csv").read_text(encoding="utf-8").count(texts[0]) == 2
    told = [f"Places do not follow the size: {text}: 2 cases." for text in texts]
    page = bp.page(result)
    assert all(page.count(text) == 1 for text in told)
    main(["sweep", "--report", str(tmp_path / "s.sqlite"), "--format", "text"])
    lines = capsys.readouterr().out.splitlines()
    assert all(lines.count(text) == 1 for text in told)
    # Plates that follow have neither note nor column.
    (tmp_path / "quickstart.yaml").write_text(TEXT, encoding="utf-8")
    followed = bp.sweep(tmp_path / "s.yaml", store=tmp_path / "t.sqlite")
    assert "unspanned" not in followed.to_frame() and "span" not in str(followed)


def test_reach_notes_it(tmp_path: Path) -> None:
    """No size does with places as lengths where one does that follows."""
    goal = "U6 average 0.13 um"
    (followed,) = bp.reach(written(tmp_path, TEXT), goal, "size").answers
    assert followed.status == "found" and not any("span" in remark for remark in followed.remarks)
    (stays,) = bp.reach(written(tmp_path, LENGTHS), goal, "size").answers
    # The largest that fits is not enough; whether the goal can be met at all is left open.
    assert stays.status == "limited"
    note = next(remark for remark in stays.remarks if "span" in remark)
    assert re.match(r"with \S+ mm x \S+ mm plates span x 0 to ", note)
    assert note.endswith(wording.THE_PLACES_ARE_LENGTHS.format("x: high"))
    data = bp.reach(written(tmp_path, LENGTHS), goal, "size").to_dict()
    assert note in data["answers"]["size"]["remarks"]
    # Balls of the same size leave the plate where it is.
    (balls,) = bp.reach(written(tmp_path, LENGTHS), "U6 average 0.4 um", "balls").answers
    assert not any("span" in remark for remark in balls.remarks)
