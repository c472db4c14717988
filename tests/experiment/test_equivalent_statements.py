"""Pairs of files that state the same thing in two ways: the same ranks, uncertainties and
simulated readings.

Each pair is a change of one small experiment, by paths, and the same as it can be written
otherwise; `None` removes a key. What is equal by a law (a temperature's error and a scale's, two
readings and one of less uncertainty) is the only thing that the pairs assume.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from ballplate.simulator.estimation.functions import linear_functions
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.readings.reading_files import read_readings, write_readings
from ballplate.simulator.readings.simulated import simulated_readings
from ballplate.uncertainty.quantities import QUANTITIES

DESIGNS = Path(__file__).parents[2] / "designs"
Changes = Mapping[str, object]
EVERY = ("U1", "U2", "U2 offsets", "U3", "U4", "U5", "U6", "tasks")
Z, X, Y = "positions.0", "positions.2", "positions.4"
BALLS = [f"r{row}c{column}" for row in (1, 2, 3) for column in (1, 2, 3)]
SIDES = [["r1c1", "r1c3"], ["r3c1", "r3c3"], ["r1c1", "r3c1"], ["r1c3", "r3c3"]]


@cache
def experiment(design: str) -> dict[str, Any]:
    """A design, or the quickstart with nine balls, three coefficients, a few places and a task."""
    path = DESIGNS / f"{design or 'quickstart'}.yaml"
    tree: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
    if not design:
        tree["artefacts"]["plate"]["balls"] = [3, 3]
        tree["error_model"] |= {"position_coefficients": 3, "rotation_coefficients": 3}
        points = [[100, 200, 300], [700, 600, 500], [250, 800, 50]]
        tree["evaluation"]["points"] = [[f"{x} mm" for x in point] for point in points]
        tree["true_machine"] = {
            "kind": "coefficients",
            "error_model": dict(tree["error_model"]),
            "values": {"EXX t^2": "30 um", "EAY t": "20 urad"},
        }
        start, end = ([f"{x} mm" for x in point] for point in ([0, 10, 20], [500, 500, 500]))
        tree["evaluation"]["tasks"] = [{"name": "bore", "from": start, "to": end}]
    return tree


def changed(tree: dict[str, Any], changes: Changes) -> dict[str, Any]:
    """A copy with other values at the paths; None removes what is there."""
    tree = copy.deepcopy(tree)
    for path, value in changes.items():
        *parents, last = path.split(".")
        holder: Any = tree
        for step in parents:
            holder = holder[int(step)] if isinstance(holder, list) else holder[step]
        key: Any = int(last) if isinstance(holder, list) else last
        if value is None:
            del holder[key]
        else:
            holder[key] = copy.deepcopy(value)
    return tree


@dataclass(frozen=True)
class Pair:
    """Two statements of the same thing, `common` in both; `files` are beside them by their names.

    `quantities` are those that are compared, all unless a page says that one is counted otherwise.
    `design` names a file to start from in place of the quickstart.
    """

    first: Changes
    second: Changes
    common: Changes = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)
    quantities: tuple[str, ...] = EVERY
    design: str = ""


def temperature(**keys: object) -> Changes:
    return {"influences": [{"kind": "temperature", **keys}]}


def influences(*items: dict[str, object]) -> Changes:
    return {"influences": list(items)}


def exact(value: str) -> dict[str, object]:
    return {"value": value, "standard_uncertainty": "0 um/m/K"}


def priors(*items: tuple[str, str]) -> Changes:
    return {"priors": [{"parameter": name, "standard_uncertainty": u} for name, u in items]}


SENSOR = {"value": "20.8 degC", "standard_uncertainty": "50 mK", "sensor_uncertainty": "200 mK"}
OFFSET_OF_LEFT = ["-50 mm", "0 mm", "0 mm"]
SPLINE = {"order": 3, "knots": []}
STAR = {"probes": ["right", "left", "back"], "standard_uncertainty": "0.5 um", "place": "unknown"}
DISTANCES = "calibration.0"
UNCERTAIN = {"balls": "all", "kind": "coordinates"}
COORDINATES = "".join(
    f"{ball},{375 * column},{375 * row},0\n"
    for ball, (row, column) in zip(BALLS, np.ndindex(3, 3), strict=True)
)


def column_of(heading: str, value: object) -> str:
    rows = COORDINATES.splitlines()
    return "\n".join([f"ball,x_mm,y_mm,z_mm,{heading}", *(f"{row},{value}" for row in rows)]) + "\n"


PAIRS: dict[str, Pair] = {
    # Scalars and lists.
    "repeatability by axis": Pair(
        {"machine.repeatability": "0.3 um"}, {"machine.repeatability": ["0.3 um"] * 3}
    ),
    "repeatability by named axes": Pair(
        {"machine.repeatability": ["0.3 um", "0.2 um", "0.4 um"]},
        {"machine.repeatability": {"x": "0.3 um", "y": "0.2 um", "z": "0.4 um"}},
    ),
    "volume by its ends": Pair({}, {"machine.volume": {axis: ["0 mm", "1 m"] for axis in "xyz"}}),
    "readings of a position by axis": Pair(
        {f"{X}.standard_uncertainty": "0.4 um"}, {f"{X}.standard_uncertainty": ["0.4 um"] * 3}
    ),
    "readings of a position as the machine's": Pair({}, {f"{X}.standard_uncertainty": "0.2 um"}),
    "offset by axis": Pair(
        {"probes.left": {"offset": OFFSET_OF_LEFT, "standard_uncertainty": "1 um"}},
        {"probes.left": {"offset": OFFSET_OF_LEFT, "standard_uncertainty": ["1 um"] * 3}},
    ),
    "one sensor of scales with three expansions": Pair(
        temperature(scale_expansion=exact("10 um/m/K"), scale_temperature=SENSOR),
        temperature(scale_expansion=[exact("10 um/m/K")] * 3, scale_temperature=SENSOR),
    ),
    "co-ordinates by axis": Pair(
        {DISTANCES: UNCERTAIN | {"standard_uncertainty": "0.5 um"}},
        {DISTANCES: UNCERTAIN | {"standard_uncertainty": dict.fromkeys("xyz", "0.5 um")}},
    ),
    # Variants and full text, by group and by item.
    "terms of the true machine": Pair(
        {"true_machine.values": {"EXX t": "30 um", "EAY t^2": "20 urad"}},
        {"true_machine.values": {"EXX t^1": "0.03 mm", "EAY t^2": "20e-6 rad"}},
    ),
    "arrangement in full": Pair(
        {}, {"error_model.arrangement": {"probe_side": ["x", "y", "z"], "workpiece_side": []}}
    ),
    "splines without knots": Pair(
        {},
        {"error_model": {"kind": "kinematic", "arrangement": "MB2", "basis": SPLINE}},
        quantities=("U1", "U2", "U4", "U5", "U6", "tasks"),
    ),
    "monomials": Pair({}, {"error_model.basis": "monomial"}),
    "grid as square": Pair(
        {"artefacts.plate.balls": [2, 2]},
        {"artefacts.plate": {"kind": "square", "balls": 2, "size": "750 mm"}},
    ),
    "grid as a list of balls": Pair(
        {DISTANCES + ".pairs": SIDES},
        {
            "artefacts.plate": {
                "kind": "balls",
                "coordinates": {
                    ball: [f"{375 * column} mm", f"{375 * row} mm", "0 mm"]
                    for ball, (row, column) in zip(BALLS, np.ndindex(3, 3), strict=True)
                },
            }
        },
        {DISTANCES + ".pairs": SIDES},
    ),
    "corner and centre": Pair(
        {f"{Z}.corner": {"x": "100 mm", "y": "0 mm"}},
        {f"{Z}.corner": None, f"{Z}.centre": {"x": "475 mm", "y": "375 mm"}},
    ),
    "turn and pose": Pair(
        {},
        {
            **{f"positions.1.{key}": None for key in ("plane", "level", "corner", "quarter_turns")},
            "positions.1.pose": {
                "origin": ["1 m", "250 mm", "750 mm"],
                "rotation": ["0 deg", "0 deg", "90 deg"],
            },
        },
    ),
    "no turns": Pair({}, {f"{Z}.quarter_turns": 0}),
    "all balls named": Pair({}, {f"{X}.balls": BALLS}),
    "balls in groups": Pair(
        {},
        {
            f"{X}.probes": None,
            f"{X}.readings": [
                {"probes": ["right", "left"], "balls": BALLS[:4]},
                {"probes": ["right", "left"], "balls": BALLS[4:]},
            ],
        },
    ),
    "repeats of a group": Pair(
        {f"{Z}.repeats": 3, f"{Z}.standard_uncertainty": "0.5 um"},
        {
            f"{Z}.probes": None,
            f"{Z}.readings": [
                {"probes": ["down"], "repeats": 3, "standard_uncertainty": ["0.5 um"] * 3}
            ],
        },
    ),
    "repeats as smaller uncertainties": Pair(
        {f"{Z}.repeats": 4}, {f"{Z}.standard_uncertainty": "0.1 um"}
    ),
    "artefact named": Pair(
        {},
        {f"positions.{k}.artefact": "plate" for k in range(6)} | {DISTANCES + ".artefact": "plate"},
    ),
    "reference named": Pair(
        {},
        {"probes.down": {"offset": ["0 mm", "0 mm", "-50 mm"], "reference": True}},
        {"probes.left": {"offset": OFFSET_OF_LEFT, "unknown": True}},
    ),
    # Calibration.
    "sides by name": Pair({}, {DISTANCES + ".pairs": SIDES}),
    "co-ordinates with U": Pair(
        {DISTANCES: UNCERTAIN | {"standard_uncertainty": "0.5 um"}},
        {DISTANCES: {"kind": "coordinates", "values": "balls.csv", "coverage_factor": 2}},
        files={"balls.csv": column_of("expanded_uncertainty_um", 1.0)},
    ),
    "calibrated twice": Pair(
        {DISTANCES + ".standard_uncertainty": "0.3 um"},
        {
            "calibration": [
                {"kind": "distances", "pairs": "corner sides", "standard_uncertainty": u}
                for u in ("0.5 um", "0.375 um")
            ]
        },
    ),
    # A prior and the same as a certificate, common and by item.
    "prior of a function": Pair(
        priors(("EAX", "1 urad")), priors(("EAX[1]", "1 urad"), ("EAX[2]", "1 urad"))
    ),
    "priors stated twice": Pair(
        priors(("EXX t^2", "0.3 um")), priors(("EXX t^2", "0.5 um"), ("EXX t^2", "0.375 um"))
    ),
    "prior with its value": Pair(
        priors(("z high: origin z", "2 um")),
        {
            "priors": [
                {"parameter": "z high: origin z", "value": "750 mm", "standard_uncertainty": "2 um"}
            ]
        },
    ),
    # Influences.
    "temperatures of positions and their scales": Pair(
        temperature(
            artefact_expansion=exact("10 um/m/K"),
            artefact_temperature={"value": "20 degC", "standard_uncertainty": "50 mK"},
        ),
        influences({"kind": "position scale", "standard_uncertainty": "0.5 ppm"}),
    ),
    "re-indexing as reproducibility": Pair(
        influences({"kind": "re-indexing", "standard_uncertainty": "1 um"}),
        influences(
            {
                "kind": "reproducibility",
                "each": ["position", "probe"],
                "standard_uncertainty": "1 um",
            }
        ),
    ),
    "reproducibility of each reading": Pair(
        {"machine.repeatability": "0.5 um"},
        influences(
            {
                "kind": "reproducibility",
                "each": ["position", "probe", "ball"],
                "standard_uncertainty": "0.4 um",
            }
        ),
        {"machine.repeatability": "0.3 um"},
    ),
    # Other artefacts and models.
    "repeats of a hole plate": Pair(
        {f"{Z}.repeats": 4, f"{X}.repeats": 4},
        {f"{Z}.standard_uncertainty": "0.1 um", f"{X}.standard_uncertainty": "0.1 um"},
        {"artefacts.plate.reads": "in plane", "artefacts.plate.flatness": "5 um"},
    ),
    "repeats of a bar": Pair(
        {"positions.0.repeats": 4},
        {"positions.0.standard_uncertainty": "0.5 um"},
        {"artefacts.bar.role": "length_standard"},
        design="certified/ball-bar",
    ),
    "ends of a bar in groups": Pair(
        {},
        {
            "positions.0.probes": None,
            "positions.0.readings": [
                {"probes": ["cone"], "balls": ["1"]},
                {"probes": ["cone"], "balls": ["2"]},
            ],
        },
        {"artefacts.bar.role": "length_standard"},
        design="certified/ball-bar",
    ),
    "repeats in two dimensions": Pair(
        {"positions.0.repeats": 4, "positions.0.standard_uncertainty": "1 um"},
        {"positions.0.standard_uncertainty": ["0.5 um", "0.5 um"]},
        design="certified/two-dimensions",
    ),
    # Stars, units, targets and what is evaluated.
    "star in a table": Pair(
        {"stars": [STAR]},
        {"stars": [STAR | {"values": "star.csv"}]},
        files={"star.csv": "probe,x_mm,y_mm,z_mm\nright,50,0,0\nleft,-50,0,0\nback,0,50,0\n"},
    ),
    "star of all its probes": Pair(
        {"stars": [STAR | {"probes": ["down", "right", "left", "back", "front"]}]},
        {"stars": [{key: value for key, value in STAR.items() if key != "probes"}]},
    ),
    "lengths in other units": Pair(
        {},
        {
            "machine.volume": ["1000 mm", "1000000 um", "1 m"],
            "machine.repeatability": "200 nm",
            "artefacts.plate.size": ["0.75 m", "750000 um"],
            f"{Z}.level": "0.25 m",
            DISTANCES + ".standard_uncertainty": "0.0002 mm",
        },
    ),
    "uncertainty of one length": Pair(
        {DISTANCES + ".standard_uncertainty": "0.1 um + 1 ppm"},
        {DISTANCES + ".standard_uncertainty": "0.85 um"},
    ),
    "points drawn": Pair(
        {"evaluation.points": {"random": 5}}, {"evaluation.points": {"random": 5, "seed": 1}}
    ),
    "probe of the points": Pair({}, {"evaluation.probe": None}),
    "probe of the task": Pair(
        {"evaluation.tasks.0.probe": "left"}, {"evaluation.tasks.0.probes": ["left", "left"]}
    ),
}


def figures(tree: dict[str, Any], folder: Path, pair: Pair) -> dict[str, Any]:
    """Rank deficiency, degrees of freedom, and standard uncertainties of all quantities with their
    targets.
    """
    # JSON is YAML, and quicker to write.
    (folder / "file.yaml").write_text(json.dumps(tree), encoding="utf-8")
    experiment = load(folder / "file.yaml")[-1]
    design = lay_out(experiment)
    at = linearise(design)
    found: dict[str, Any] = {"deficiency": at.deficiency}
    x = simulated_readings(experiment, exact=True).x
    # Repeats of exact readings are the same, and may be counted otherwise.
    x = x[np.lexsort(np.round(x, 12).T)]
    found["readings"] = x[np.append(True, (np.diff(x, axis=0) > 1e-12).any(axis=1))]
    for symbol in pair.quantities:
        for k, functions in enumerate(QUANTITIES[symbol].functions(design, at.layout)):
            u = at.uncertainty(linear_functions(at, functions))
            found[f"{symbol} {k}"] = u
    targets = [task.target for task in experiment.evaluation.tasks]
    found["target"] = [
        [np.nan if target is None else target.at(length) for length in (0.0, 0.3, 1.0)]
        for target in [experiment.target_uncertainty, *targets]
    ]
    return found


@pytest.mark.parametrize("name", PAIRS)
def test_two_statements_of_the_same_give_the_same_figures(name: str, tmp_path: Path) -> None:
    pair = PAIRS[name]
    tree = changed(experiment(pair.design), pair.common)
    for file, text in pair.files.items():
        (tmp_path / file).write_text(text, encoding="utf-8")
    first = figures(changed(tree, pair.first), tmp_path, pair)
    second = figures(changed(tree, pair.second), tmp_path, pair)
    assert first.keys() == second.keys()
    for key, value in first.items():
        np.testing.assert_allclose(second[key], value, rtol=1e-9, atol=0, err_msg=key)


def test_repeats_have_the_uncertainties_of_their_groups(tmp_path: Path) -> None:
    groups = [{"probes": ["down"], "standard_uncertainty": u} for u in ("0.5 um", "0.2 um")]
    tree = changed(experiment(""), {f"{Z}.probes": None, f"{Z}.readings": groups})
    (tmp_path / "file.yaml").write_text(json.dumps(tree), encoding="utf-8")
    simulated = simulated_readings(load(tmp_path / "file.yaml")[0])
    with (tmp_path / "readings.csv").open("w", encoding="utf-8", newline="") as stream:
        write_readings(stream, simulated.design, simulated.readings, simulated.x)
    observed = read_readings(tmp_path / "readings.csv", simulated.design)
    assert observed.design.readings.uncertainty is not None
    planned = simulated.readings.uncertainty
    assert planned is not None and set(planned[:, 0]) == {0.5e-6, 0.2e-6}
    np.testing.assert_array_equal(observed.design.readings.uncertainty, planned)
