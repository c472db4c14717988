"""Every repair that is suggested for deficient designs, written into their files and computed again
from these.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from ballplate.cli import main
from ballplate.extensions.repair.mending import mended
from ballplate.extensions.repair.repair_search import repairs
from ballplate.extensions.repair.repairs import Repair
from ballplate.presentation.formatting import number
from ballplate.results.checked_designs import check, predict
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment

from tests.extensions.repair import wording

TRIAL = "1 um"
PLANES = {"x": ("right", "yz"), "y": ("back", "zx"), "z": ("down", "xy")}


def said_at_random(seed: int) -> dict[str, Any]:
    """A small plate in one to four positions: read with one probe, which positions may leave out, or
    with one for each plane and further ones; with or without a certificate, a pool and variants.
    """
    generator = np.random.default_rng([25, seed])
    is_single = seed % 2 == 0
    probes = {"down": ["0 mm", "0 mm", "-50 mm"]}
    if not is_single:
        probes |= {"right": ["50 mm", "0 mm", "0 mm"], "back": ["0 mm", "50 mm", "0 mm"]}
    positions = []
    for k in range(int(generator.integers(1, 5))):
        plane = "zxyz"[int(generator.integers(4))]
        probe, axes = PLANES[plane]
        positions.append(
            {
                "name": f"p {k}",
                "plane": plane,
                "level": f"{100 + 130 * k} mm",
                "corner": dict.fromkeys(axes, f"{60 + 20 * k} mm"),
                "quarter_turns": int(generator.integers(2)),
            }
        )
        if not is_single:
            positions[-1]["probes"] = [probe]
        elif generator.random() < 0.3:
            positions[-1] |= {"readings": [{"balls": "all"}]}
        elif generator.random() < 0.3:
            positions[-1] |= {"repeats": 2, "probes": ["down"]}
    said: dict[str, Any] = {
        "title": "deficient",
        "machine": {"volume": ["600 mm"] * 3, "repeatability": "0.2 um"},
        "error_model": {
            "kind": "kinematic",
            "position_coefficients": int(generator.integers(2, 4)),
            "rotation_coefficients": 2,
        },
        "probes": probes,
        "artefacts": {"plate": {"kind": "grid", "balls": [3, 3], "size": ["300 mm", "300 mm"]}},
        "positions": positions,
        "evaluation": {"points": {"random": 20, "seed": 1}, "probe": "down"},
    }
    if generator.random() < 0.5:
        side = {"kind": "distances", "pairs": "corner sides", "standard_uncertainty": "0.2 um"}
        said["calibration"] = [side]
    if seed % 5 == 4:
        offered = {"name": "offered", "plane": "z", "level": "300 mm"}
        offered["corner"] = {"x": "150 mm", "y": "250 mm"}
        offered |= {} if is_single else {"probes": ["down"]}
        said["pool"] = {"candidates": [offered]}
    if seed % 5 == 3:
        said["variants"] = {"as it is": {}, "noisy": {"machine.repeatability": "0.3 um"}}
    return said


def with_uncertain_offsets(said: dict[str, Any]) -> dict[str, Any]:
    """The same with a micrometre stated for every probe but the first."""
    _, *others = said["probes"]
    for name in others:
        said["probes"][name] = {"offset": said["probes"][name], "standard_uncertainty": TRIAL}
    return said


def average(experiment: Experiment) -> str:
    """U6 as it is printed."""
    return number(1e6 * predict(experiment).quantities["U6"].average)


def check_written(said: dict[str, Any], folder: Path) -> tuple[Repair, ...]:
    """Write each suggestion as --fix does; what is read back has the rank and the U6 that the line
    of the suggestion says.
    """
    path, variant = folder / "deficient.yaml", "noisy" if "variants" in said else None
    path.write_text(yaml.safe_dump(said, sort_keys=False), encoding="utf-8")
    (design,) = (one for one in load(path, planning=True) if one.name == variant)
    found = repairs(design)
    for k, repair in enumerate(found.repairs, 1):
        (line,) = [one for one in found.lines() if one.startswith(f"repair {k}: ")]
        text = mended(path.read_text(encoding="utf-8"), path, variant, repair)
        (after,) = (one for one in load(path, text=text) if one.name == variant)
        judged = check(after)
        assert not judged.verdict.deficiency and len(judged.verdict.weak) == repair.weak
        assert f"average U6 {average(after)} µm" in line
        assert judged.scale is not None
        assert judged.scale.rests_on_offsets == (wording.SCALE_RESTS_ON_PROBE_OFFSETS in line)
        if judged.scale.rests_on_offsets:
            rests = wording.THE_SCALE_RESTS_ON_PROBE_2
            assert any(told.startswith(rests) for told in judged.table_lines())
        loose = re.search(r"average U6 [\d.e+-]+ µm, ([\d.e+-]+) µm with 1 µm on the exact", line)
        if variant is None and len(after.probes) > 1:
            changed = with_uncertain_offsets(yaml.safe_load(text))
            (uncertain,) = load(path, text=yaml.safe_dump(changed, sort_keys=False))
            assert loose is not None and loose[1] == average(uncertain)
        more = sum(one.count for one in after.positions) - sum(
            one.count for one in design.positions
        )
        assert repair.readings == more and (f"; {more:+d} readings, " in line or not more)
    return found.repairs


@pytest.mark.parametrize("seed", range(4))
def test_every_suggestion_is_written(seed: int, tmp_path: Path) -> None:
    assert check_written(said_at_random(seed), tmp_path)


@pytest.mark.long
def test_every_suggestion_is_written_for_many_designs(tmp_path: Path) -> None:
    found = [check_written(said_at_random(seed), tmp_path) for seed in range(4, 124)]
    assert sum(map(bool, found)) > 90


def test_a_certificate_is_printed_and_not_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A file of one probe without a certificate."""
    said = said_at_random(0)
    said.pop("calibration", None)
    said["positions"] = [
        {"name": f"{plane} {k}", "plane": plane, "level": f"{100 + 300 * k} mm"}
        | {"corner": dict.fromkeys(PLANES[plane][1], f"{60 + 90 * k} mm"), "quarter_turns": k}
        for plane in "zx"
        for k in range(2)
    ]
    best, *_ = check_written(said, tmp_path)
    assert best.invents
    path = tmp_path / "deficient.yaml"
    main(["check", "--fix", str(path)])
    assert wording.NOT_WRITTEN in capsys.readouterr().err
    assert "calibration" not in yaml.safe_load(path.read_text(encoding="utf-8"))
