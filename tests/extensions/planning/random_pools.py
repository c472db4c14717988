"""Pools at random: one to three artefacts of different kinds, certificates, times, limits of every
kind, readings done.

Lengths are chosen so that whatever is drawn lies inside the volume.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from ballplate.extensions.campaign.positions_read import done_candidates
from ballplate.extensions.planning.campaign_choice import Request, campaign
from ballplate.extensions.planning.constraints import HOUR, Budget
from ballplate.extensions.planning.criteria import NAMES, CriterionName
from ballplate.extensions.planning.remaining_candidates import offer
from ballplate.extensions.planning.selection import Campaign
from ballplate.extensions.planning.set_ups import SetUp
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment, Position
from ballplate.simulator.readings.reading_files import write_readings
from ballplate.simulator.readings.simulated import exact_readings

PLATES: tuple[dict[str, Any], ...] = (
    {"kind": "grid", "balls": [3, 2], "size": ["240 mm", "160 mm"]},
    {"kind": "square", "balls": 2, "size": "220 mm"},
    {"kind": "grid", "balls": [3, 3], "size": ["200 mm", "200 mm"]},
)
FREE: dict[str, Any] = {
    "kind": "balls",
    "coordinates": {
        "a": ["0 mm", "0 mm", "0 mm"],
        "b": ["200 mm", "0 mm", "10 mm"],
        "c": ["30 mm", "180 mm", "0 mm"],
        "d": ["190 mm", "170 mm", "40 mm"],
    },
}
BAR: dict[str, Any] = {"kind": "two_spheres", "length": "230 mm", "role": "length_standard"}
SIDES = {"x": 600, "y": 500, "z": 450}
# What the longest offset of a probe takes the scales beyond a ball.
MARGIN = 50
PROBES = {"down": [0, 0, -40], "right": [40, 0, 0], "back": [0, 40, 0]}


@dataclass(frozen=True)
class RandomPool:
    """A file with a pool and what is asked of it: criterion, budget, and readings of the first
    positions drawn.

    `path` is the file's; `readings` the readings' that have been taken, None where nothing is done,
    after which the artefact may be `standing` where it was.
    """

    path: Path
    criterion: CriterionName
    budget: Budget
    readings: Path | None
    standing: bool

    @property
    def experiment(self) -> Experiment:
        return load(self.path, planning=True)[0]

    @property
    def taken(self) -> tuple[SetUp, ...]:
        return () if self.readings is None else done_candidates(self.readings, self.experiment)

    def planned(self, taken: tuple[SetUp, ...], curve: bool = False) -> Campaign:
        """The choice after some set-ups have been read."""
        experiment = self.experiment
        assert experiment.pool is not None
        request = Request(self.criterion, self.budget, curve)
        return campaign(experiment, request, offer(experiment.pool, taken, self.standing))


def random_pool(folder: Path, seed: int) -> RandomPool:
    """Write the pool of a seed, and readings of some of its positions for every third."""
    generator = np.random.default_rng([13, seed])
    said = _said(generator)
    path = folder / f"pool-{seed}.yaml"
    path.write_text(yaml.safe_dump(said, sort_keys=False))
    name = NAMES[seed % len(NAMES)]
    limited = generator.integers(4)
    budget = Budget(
        float(generator.uniform(1.5, 5.0)) * HOUR if limited in (0, 3) else None,
        int(generator.integers(25, 90)) if limited == 2 else None,
        int(generator.integers(3, 6)) if limited in (1, 3) else None,
    )
    readings = _readings(path, generator) if seed % 3 == 2 else None
    return RandomPool(path, name, budget, readings, bool(generator.random() < 0.7))


def _said(generator: np.random.Generator) -> dict[str, Any]:
    d = 2 if generator.random() < 0.4 else 3
    axes = "xyz"[:d]
    kinematic = d == 3 and generator.random() < 0.4
    artefacts = _artefacts(generator, d)
    probes = {name: [f"{x} mm" for x in PROBES[name][:d]] for name in PROBES}
    volume = {axis: [f"-{MARGIN} mm", f"{SIDES[axis] + MARGIN} mm"] for axis in axes}
    said: dict[str, Any] = {
        "title": "a pool at random",
        "machine": {"volume": volume, "repeatability": "1 um"},
        "error_model": {"kind": "metric"},
        "probes": probes,
        "artefacts": artefacts,
    }
    if kinematic:
        said["error_model"] = {
            "kind": "kinematic",
            "arrangement": "MB2",
            "position_coefficients": 2,
            "rotation_coefficients": int(generator.integers(1, 3)),
        }
    names = list(artefacts)
    drawn = int(generator.integers(0, 3))
    count = drawn + int(generator.integers(4, 8 if generator.random() < 0.8 else 14))
    positions = [
        _position(generator, d, k, names, artefacts) for k in range(max(count, len(names)))
    ]
    if drawn:
        said["positions"] = positions[:drawn]
    calibration = [
        one
        for name in names
        if generator.random() < 0.6
        for one in [_certificate(generator, name, artefacts)]
    ]
    if calibration:
        said["calibration"] = calibration
    offered = []
    known = {one["artefact"] for one in calibration}
    # The length of a standard that has a certificate is not asked for any more.
    open_ = [name for name in names if name not in known or not artefacts[name].get("role")]
    for k in range(int(generator.integers(0, 3)) if open_ else 0):
        name = open_[int(generator.integers(len(open_)))]
        price = f"{int(generator.integers(10, 90))} min"
        offered.append(
            {"name": f"certificate {k}", **_certificate(generator, name, artefacts), "price": price}
        )
    for k, one in enumerate(positions[drawn:]):
        if k % 3 == 1:
            one["times"] = {"set_up": f"{int(generator.integers(1, 40))} min"}
    said["pool"] = {
        "times": {
            "set_up": "10 min",
            "reading": "20 s",
            "probe_change": "3 min",
            "plane_change": "15 min",
        },
        "candidates": positions[drawn:],
        "limits": _limits(generator, positions, drawn),
    }
    if offered:
        said["pool"]["calibration"] = offered
    ends = [[f"{int(share * SIDES[axis])} mm" for axis in axes] for share in (0.1, 0.9)]
    across = [f"{int((0.9 if axis == 'y' else 0.2) * SIDES[axis])} mm" for axis in axes]
    said["evaluation"] = {
        "points": {"random": 12, "seed": 3},
        "probe": "down",
        "tasks": [
            {"name": "long", "from": ends[0], "to": ends[1]},
            {"name": "other", "from": ends[0], "to": across},
        ],
    }
    return said


def _artefacts(generator: np.random.Generator, d: int) -> dict[str, dict[str, Any]]:
    kinds = [*PLATES, *([FREE, BAR] if d == 3 else [BAR])]
    chosen = generator.permutation(len(kinds))[: int(generator.integers(1, 4))]
    found = {f"artefact {k}": kinds[k] for k in sorted(chosen.tolist())}
    if all(one.get("role") for one in found.values()):
        found["artefact 0"] = PLATES[0]
    return found


def _position(
    generator: np.random.Generator,
    d: int,
    k: int,
    names: Sequence[str],
    artefacts: dict[str, dict[str, Any]],
) -> dict[str, Any]:
    is_next = k < len(names) or generator.random() < 0.7
    name = names[k % len(names)] if is_next else names[int(generator.integers(len(names)))]
    said: dict[str, Any] = {"name": f"place {k}", "artefact": name}
    at = {axis: f"{int(generator.integers(1, SIDES[axis] - 270))} mm" for axis in "xyz"[:d]}
    kind = artefacts[name]["kind"]
    if kind in ("grid", "square"):
        plane = "xyz"[k % 3] if d == 3 else "z"
        if d == 3:
            said |= {"plane": plane, "level": f"{int(generator.integers(1, SIDES[plane]))} mm"}
        said["corner"] = {axis: place for axis, place in at.items() if axis != plane}
        said["quarter_turns"] = int(generator.integers(4))
    else:
        # Where a bar is turned it stays in the octant that it points to.
        turn = (
            int(generator.integers(0, 91))
            if kind == "two_spheres"
            else int(generator.integers(0, 20))
        )
        origin = [f"{int(generator.integers(70, SIDES[axis] - 270))} mm" for axis in "xyz"[:d]]
        rotation = [
            "0 deg",
            f"{-int(generator.integers(0, 60))} deg" if kind == "two_spheres" else "0 deg",
            f"{turn} deg",
        ]
        said["pose"] = {"origin": origin, "rotation": rotation if d == 3 else rotation[2]}
    probes = list(PROBES) if generator.random() < 0.3 else [list(PROBES)[k % 3]]
    said["probes"] = probes[: d + 1]
    if generator.random() < 0.25:
        said["repeats"] = 2
    if generator.random() < 0.15:
        said["standard_uncertainty"] = f"{float(generator.uniform(0.3, 3.0)):.2f} um"
    return said


def _certificate(
    generator: np.random.Generator, name: str, artefacts: dict[str, dict[str, Any]]
) -> dict[str, Any]:
    u = f"{float(np.exp(generator.uniform(np.log(0.3), np.log(30.0)))):.3g} um"
    kind = artefacts[name]["kind"]
    if kind == "two_spheres":
        return {"artefact": name, "kind": "distances", "pairs": "all", "standard_uncertainty": u}
    if generator.random() < 0.3:
        return {"artefact": name, "kind": "coordinates", "balls": "all", "standard_uncertainty": u}
    pairs = (
        "all"
        if kind == "balls"
        else ["corner sides", "corners", "neighbours"][int(generator.integers(3))]
    )
    return {"artefact": name, "kind": "distances", "pairs": pairs, "standard_uncertainty": u}


def _limits(
    generator: np.random.Generator, positions: Sequence[dict[str, Any]], drawn: int
) -> dict[str, Any]:
    names = [one["name"] for one in positions]
    limits: dict[str, Any] = {}
    if generator.random() < 0.3:
        limits["keep"] = [names[int(generator.integers(len(names)))]]
    if generator.random() < 0.3:
        limits["at_most"] = [{"of": {"name": names[-2:]}, "count": 1}]
    if generator.random() < 0.3:
        limits["at_most"] = [
            *limits.get("at_most", ()),
            {"of": {"artefact": positions[-1]["artefact"]}, "count": int(generator.integers(2, 4))},
        ]
    return limits


def _readings(path: Path, generator: np.random.Generator) -> Path:
    """Exact readings of some positions of the pool, the last of them perhaps in part."""
    (experiment,) = load(path, planning=True)
    assert experiment.pool is not None
    places = [one.item for one in experiment.pool.candidates if isinstance(one.item, Position)]
    chosen = places[: int(generator.integers(1, 4))]
    return write_some(
        experiment, chosen, path.with_suffix(".csv"), float(generator.choice([0.4, 0.7, 1.0]))
    )


def write_some(
    experiment: Experiment, positions: Sequence[Position], path: Path, share: float
) -> Path:
    """Write exact readings of positions, of the last of them only a share."""
    design = lay_out(replace(experiment, positions=tuple(positions)))
    readings, x = exact_readings(design, nominal_state(design))
    last = np.flatnonzero(readings.position == len(positions) - 1)
    kept = np.setdiff1d(np.arange(len(readings)), last[max(int(share * len(last)), 1) :])
    with path.open("w", encoding="utf-8", newline="") as stream:
        write_readings(stream, design, readings.select(kept), x[kept])
    return path
