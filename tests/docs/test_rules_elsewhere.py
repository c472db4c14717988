"""Statements of the rules for planners on machines that are not those of the study, with positions
written by hand: within the range of the rule, widened by a tenth of the effect.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import ballplate as bp
import pytest

sys.path.insert(0, str(Path("docs/_extensions").resolve()))
rules = importlib.import_module("study_rules")

Changes = Mapping[str, Any]
# Plane, level, lower corner along the next two axes in turn, quarter turns; in millimetres.
SQUAT = [
    *(("x", 50, 380, 20, 1), ("x", 340, 40, 130, 0), ("x", 650, 200, 60, 1)),
    *(("y", 50, 120, 360, 0), ("y", 330, 20, 60, 1), ("y", 650, 130, 210, 0)),
    *(("z", 20, 60, 350, 1), ("z", 230, 380, 40, 0), ("z", 410, 180, 210, 0)),
]
TALL = [
    *(("x", 70, 450, 40, 1), ("x", 400, 60, 300, 0), ("x", 730, 250, 200, 1)),
    *(("y", 70, 300, 280, 0), ("y", 500, 50, 70, 1), ("y", 930, 300, 150, 0)),
    *(("z", 30, 70, 450, 1), ("z", 400, 290, 60, 0), ("z", 770, 150, 250, 0)),
]
AXES = {"x": "yz", "y": "zx", "z": "xy"}
STAR = {"x": ["right", "left"], "y": ["back", "front"], "z": ["down"]}
MACHINES = {
    "squat": (SQUAT, (700, 700, 500), 280, 40, "0.25 um", ("0.15 um", "0.2 um/m"), "MB1", 21),
    "tall": (TALL, (800, 1000, 900), 480, 60, "0.35 um", ("0.2 um", "0.25 um/m"), "FB1", 22),
}
TEMPERATURE = {"value": "20 degC", "standard_uncertainty": "0 K", "sensor_uncertainty": "0 K"}
STEEL = {"value": "11.5 um/m/K", "standard_uncertainty": "0 um/m/K"}


def placed(name: str, tips: Mapping[str, Sequence[str]] = STAR, **more: Any) -> list[Any]:
    return [
        {
            "name": f"{plane} {level}",
            "plane": plane,
            "level": f"{level} mm",
            "corner": {a: f"{c} mm" for a, c in zip(AXES[plane], corner, strict=True)},
            "quarter_turns": turns,
            "probes": list(tips[plane]),
            **more,
        }
        for plane, level, *corner, turns in MACHINES[name][0]
    ]


def certified(name: str, pairs: str) -> list[Any]:
    constant, common = MACHINES[name][5]
    item = {"kind": "distances", "pairs": pairs, "standard_uncertainty": constant}
    return [item | {"common": common}]


@cache
def machine(name: str) -> Any:
    _, volume, side, tip, repeatability, _, arrangement, seed = MACHINES[name]
    offsets = {"down": (0, 0, -2), "right": (1, 0, -1), "left": (-1, 0, -1)}
    offsets |= {"back": (0, 1, -1), "front": (0, -1, -1)}
    probes: dict[str, Any] = {
        key: {"offset": [f"{tip * one} mm" for one in offset], "standard_uncertainty": "0.5 um"}
        for key, offset in offsets.items()
    }
    del probes["down"]["standard_uncertainty"]
    model = {"kind": "kinematic", "arrangement": arrangement}
    return bp.experiment(
        {
            "title": name,
            "machine": {"volume": [f"{v} mm" for v in volume], "repeatability": repeatability},
            "error_model": model | {"position_coefficients": 4, "rotation_coefficients": 4},
            "probes": probes,
            "artefacts": {"plate": {"kind": "grid", "balls": [5, 5], "size": 2 * [f"{side} mm"]}},
            "positions": placed(name),
            "calibration": certified(name, "corners"),
            "evaluation": {"points": {"random": 300, "seed": seed}, "probe": "down"},
        }
    )


@cache
def usual(name: str) -> float:
    return float(bp.run(machine(name))["U6"].average)


def ratio(name: str, changes: Changes) -> float:
    return float(bp.run(machine(name).with_(changes))["U6"].average) / usual(name)


def heat(*which: str) -> Changes:
    found = TEMPERATURE | dict.fromkeys(which, "0.1 K")
    bodies = {f"{one}_temperature": found for one in ("artefact", "scale")}
    bodies |= {f"{one}_expansion": STEEL for one in ("artefact", "scale")}
    return {"influences": [{"kind": "temperature", **bodies}]}


BOTH = {"x": ["right", "left"], "y": ["back", "front"], "z": ["down", "right"]}
ONE = dict.fromkeys("xyz", ["down"])
STATEMENTS: dict[str, tuple[Callable[[str], Changes], Any]] = {
    "three by three balls read thrice": (
        lambda name: {"artefacts.plate.balls": [3, 3], "positions": placed(name, repeats=3)},
        rules.compared(3, "nine", 3),
    ),
    "seven by seven balls": (
        lambda name: {"artefacts.plate.balls": [7, 7]},
        rules.compared(7, "nine", 1),
    ),
    "read twice": (
        lambda name: {"positions": placed(name, repeats=2)},
        rules.compared(5, "nine", 2),
    ),
    "sides alone": (
        lambda name: {"calibration": certified(name, "corner sides")},
        rules.certificate("corner sides") / rules.certificate("corners"),
    ),
    "all distances": (
        lambda name: {"calibration": certified(name, "all")},
        rules.certificate("all") / rules.certificate("corners"),
    ),
    "offsets known to ten micrometres": (
        lambda name: {
            f"probes.{tip}.standard_uncertainty": "10 um"
            for tip in ("right", "left", "back", "front")
        },
        rules.known(1e-5),
    ),
    "two tips across z": (
        lambda name: {"positions": placed(name, BOTH)},
        rules.tips("star, two tips across z as well") / rules.tips(rules.STAR),
    ),
    "one tip": (
        lambda name: {"positions": placed(name, ONE)},
        rules.tips("one tip") / rules.tips(rules.STAR),
    ),
    "a tenth of a kelvin": (
        lambda name: heat("standard_uncertainty", "sensor_uncertainty"),
        rules.thermometers("0.1 K both"),
    ),
    "six coefficients": (
        lambda name: {
            "error_model.position_coefficients": 6,
            "error_model.rotation_coefficients": 6,
        },
        rules.coefficients(6, "nine shifted"),
    ),
}


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("statement", STATEMENTS)
def test_a_statement_holds_elsewhere(statement: str, name: str) -> None:
    changes, stated = STATEMENTS[statement]
    effects = stated - 1.0
    # Ranges are printed to a percent.
    slack = 0.1 * effects.abs().max() + 0.005
    found = ratio(name, changes(name)) - 1.0
    assert effects.min() - slack <= found <= effects.max() + slack


@pytest.mark.parametrize("name", MACHINES)
def test_an_error_of_all_temperatures_matters_more(name: str) -> None:
    each, common = (ratio(name, heat(f"{one}_uncertainty")) for one in ("standard", "sensor"))
    assert common > each > 1.0


@pytest.mark.parametrize("name", MACHINES)
def test_what_stays_undetermined(name: str) -> None:
    """One tip for each plane, one in all, or without any across x or y."""
    plane = {key: tips[:1] for key, tips in STAR.items()}
    stated = [rules.tips("star, one tip for a plane", rules.DEFICIENCY)]
    stated += [rules.tips("one tip", rules.DEFICIENCY)]
    stated += 2 * [rules.values("planes", rules.DEFICIENCY, shares="none across x")]
    positions = [placed(name, plane), placed(name, ONE)]
    positions += [[one for one in placed(name) if one["plane"] != axis] for axis in "xy"]
    for expected, chosen in zip(stated, positions, strict=True):
        deficiency = bp.check(machine(name).with_(positions=chosen)).verdict.deficiency
        assert set(expected) == {deficiency}
