"""A design is compared with the simple strategies that drafts begin with."""

from __future__ import annotations

from pathlib import Path

import ballplate as bp
import pytest
import yaml
from ballplate.cli import main

from tests.extensions.drafting.sheets import BRIDGE, options

# As everybody begins: opposite corners of the volume.
CORNERS = [
    {"name": f"{plane} {end}", "plane": plane, "level": end, "corner": dict.fromkeys(others, end)}
    | {"quarter_turns": int(end == "high"), "probes": probes}
    for plane, others, probes in (
        ("x", "yz", ["right", "left"]),
        ("y", "zx", ["back", "front"]),
        ("z", "xy", ["down"]),
    )
    for end in ("low", "high")
]


@pytest.fixture
def corners(tmp_path: Path) -> Path:
    path = tmp_path / "corners.yaml"
    assert main(["init", str(path), *options(BRIDGE), "-q"]) == 0
    content = yaml.safe_load(path.read_text(encoding="utf-8")) | {"positions": CORNERS}
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return path


def test_a_better_strategy_is_suggested_and_is_as_good_as_stated(
    corners: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["check", str(corners), "--suggest", "-q"])
    lines = [one for one in capsys.readouterr().out.splitlines() if one.startswith("strategy")]
    before = bp.run(bp.load(corners))["U6"].average
    entries = [yaml.safe_load(one.partition(": - ")[2]) for one in lines[2:]]
    changed = bp.load(corners).with_(positions=entries)
    after = bp.run(changed)["U6"].average
    assert after < 0.95 * before and len(entries) == 6
    assert f"U6 would be {1e6 * after:.4g} µm instead of {1e6 * before:.4g} µm" in lines[0]
    corners.write_text(
        yaml.safe_dump(
            yaml.safe_load(corners.read_text(encoding="utf-8")) | {"positions": entries}
        ),
        encoding="utf-8",
    )
    main(["check", str(corners), "--suggest", "-q"])
    assert "strategy" not in capsys.readouterr().out


def test_a_strategy_reads_with_the_tips_of_each_plane(
    corners: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Also where a position that is switched off comes first."""
    content = yaml.safe_load(corners.read_text(encoding="utf-8"))
    content["positions"].insert(0, CORNERS[4] | {"name": "off", "enabled": False})
    corners.write_text(yaml.safe_dump(content), encoding="utf-8")
    main(["check", str(corners), "--suggest", "-q"])
    lines = capsys.readouterr().out.splitlines()
    entries = [yaml.safe_load(one.partition(": - ")[2]) for one in lines if ": - " in one]
    probes = {one["plane"]: one["probes"] for one in CORNERS}
    assert entries and all(one["probes"] == probes[one["plane"]] for one in entries)


@pytest.mark.parametrize(
    "file", ["hocken_borchardt/dummy.yaml", "planning/campaign.yaml", "hurt_foss/bar-bell.yaml"]
)
def test_other_designs_have_no_strategy(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Two dimensions, several artefacts, positions that are not across an axis."""
    main(["check", f"designs/{file}", "--suggest", "-q"])
    assert "strategy" not in capsys.readouterr().out
