"""Campaigns with one error each on designs other than those of the page, and the sums of squares
of what a fit names, by fits of files that state it.

Run as `python -m tests.extensions.diagnosis.rivals` it prints how often another cause is named.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from ballplate.results.fits import Fit
from ballplate.results.fitting import fit
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.machines.arrangement import ARRANGEMENTS
from ballplate.simulator.readings.observed_readings import ObservedReadings, observe
from ballplate.simulator.readings.simulated import simulated_readings
from numpy.typing import NDArray

Real = NDArray[np.float64]

TIPS = {
    "down": (0.0, 0.0, -50.0),
    "right": (50.0, 0.0, 0.0),
    "left": (-50.0, 0.0, 0.0),
    "back": (0.0, 50.0, 0.0),
    "front": (0.0, -50.0, 0.0),
}

# Distance of balls from the sides of the volume (mm) that no tip exceeds.
ROOM = 60


@dataclass(frozen=True)
class Position:
    """A plate across an axis, at fractions of the volume."""

    plane: str
    level: float
    corner: tuple[float, float]
    turns: int
    probes: tuple[str, ...]
    plate: str = "plate"


def text_of(
    arrangement: str,
    size: tuple[int, int, int],
    plates: dict[str, tuple[int, int, int]],
    positions: list[Position],
    unknown: str = "",
    coefficients: int = 3,
    deficiency: int = 0,
) -> str:
    """A file: `size` of the volume in millimetres, `plates` with rows, columns and their side."""
    used = [name for name in TIPS if any(name in one.probes for one in positions)]
    probes = [
        f"  {name}: {{offset: [{', '.join(f'{v:g} mm' for v in TIPS[name])}], unknown: true}}"
        if name == unknown
        else f"  {name}: [{', '.join(f'{v:g} mm' for v in TIPS[name])}]"
        for name in used
    ]
    lines = [
        "title: rivals",
        f"machine: {{volume: [{', '.join(f'{v} mm' for v in size)}], repeatability: 0.2 um}}",
        f"error_model: {{kind: kinematic, arrangement: {arrangement}, position_coefficients:"
        f" {coefficients}, rotation_coefficients: {coefficients}}}",
        "true_machine: {kind: random, position: 2 um, rotation: 4 urad, seed: 7}",
        "probes:",
        *probes,
        "artefacts:",
    ]
    for name, (rows, columns, side) in plates.items():
        lines.append(
            f"  {name}: {{kind: grid, balls: [{rows}, {columns}], size: [{side} mm, {side} mm]}}"
        )
    lines.append("positions:")
    for number, one in enumerate(positions):
        across = "xyz".index(one.plane)
        first, second = (across + 1) % 3, (across + 2) % 3
        side = plates[one.plate][2]
        places = [
            f"{'xyz'[axis]}: {ROOM + fraction * (size[axis] - side - 2 * ROOM):.0f} mm"
            for axis, fraction in zip((first, second), one.corner, strict=True)
        ]
        lines.append(
            f"  - {{name: p{number}, artefact: {one.plate}, plane: {one.plane}, level:"
            f" {ROOM + one.level * (size[across] - 2 * ROOM):.0f} mm, corner: {{{', '.join(places)}}}, quarter_turns:"
            f" {one.turns}, probes: [{', '.join(one.probes)}]}}"
        )
    lines.append("calibration:")
    for name in plates:
        lines.append(
            f"  - {{kind: distances, artefact: {name}, pairs: corner sides, standard_uncertainty:"
            " 0.2 um}"
        )
    probe = next(name for name in used if name != unknown)
    lines.append(f"expected_rank_deficiency: {deficiency}")
    lines.append(f"evaluation: {{points: {{random: 8, seed: 1}}, probe: {probe}}}")
    return "\n".join(lines) + "\n"


def _six(plates: tuple[str, ...], x: tuple[str, ...], y: tuple[str, ...]) -> list[Position]:
    """Two positions across each axis, as in the quickstart."""
    down, some = ("down",), plates * 6
    return [
        Position("z", 0.25, (0.0, 0.0), 0, down, some[0]),
        Position("z", 0.75, (1.0, 1.0), 1, down, some[1]),
        Position("x", 0.25, (0.1, 0.1), 1, x, some[2]),
        Position("x", 0.75, (0.9, 0.9), 0, x, some[3]),
        Position("y", 0.25, (0.2, 0.8), 1, y, some[4]),
        Position("y", 0.75, (0.8, 0.2), 0, y, some[5]),
    ]


BOTH = (("right", "left"), ("back", "front"))
DESIGNS = {
    "MB1, small": text_of("MB1", (300, 250, 280), {"plate": (3, 3, 120)}, _six(("plate",), *BOTH)),
    "FB1, two plates": text_of(
        "FB1",
        (1000, 900, 800),
        {"plate": (4, 4, 600), "other": (3, 3, 500)},
        _six(("plate", "other"), *BOTH)
        + [
            Position("z", 0.5, (0.5, 0.5), 2, ("down",), "other"),
            Position("x", 0.5, (0.5, 0.3), 2, ("right", "left"), "other"),
        ],
    ),
    "CX1, six balls": text_of(
        "CX1",
        (800, 700, 600),
        {"plate": (3, 2, 450)},
        _six(("plate",), ("right", "left"), ("back",))
        + [
            Position("z", 0.5, (0.3, 0.7), 2, ("down",)),
            Position("x", 0.5, (0.7, 0.3), 3, ("right", "left")),
        ],
    ),
    "MH1, 2 x 2 balls, two tips": text_of(
        "MH1",
        (700, 800, 900),
        {"plate": (2, 2, 400)},
        [
            Position(plane, level, corner, turns, ("down", "right"))
            for plane, level, corner, turns in (
                ("z", 0.2, (0.0, 0.0), 0),
                ("z", 0.8, (1.0, 1.0), 1),
                ("z", 0.5, (0.0, 1.0), 2),
                ("x", 0.2, (0.0, 0.2), 1),
                ("x", 0.8, (1.0, 0.8), 0),
                ("y", 0.2, (0.1, 1.0), 3),
                ("y", 0.8, (0.9, 0.0), 0),
                ("y", 0.5, (0.5, 0.5), 1),
            )
        ],
        # Two tips alone do not show how X, which carries nothing else, turns about their difference.
        deficiency=2,
    ),
    "FB2, an unknown tip": text_of(
        "FB2", (700, 600, 500), {"plate": (3, 3, 400)}, _six(("plate",), *BOTH), "left"
    ),
}


def random_text(seed: int) -> str:
    """A design of random arrangement, plates, positions and tips."""
    generator = np.random.default_rng(seed)
    arrangement = str(generator.choice(sorted(ARRANGEMENTS)))
    size = tuple(int(v) for v in generator.integers(300, 1200, 3))
    share = generator.uniform(0.4, 0.6)
    balls = [(2, 2), (2, 3), (3, 3), (4, 3), (4, 4)][int(generator.integers(5))]
    plates = {"plate": (*balls, int(share * min(size)))}
    if generator.random() < 0.3:
        plates["other"] = (3, 3, int(0.8 * share * min(size)))
    positions = []
    for plane in "zxy":
        for level in (0.2, 0.8, 0.5)[: int(generator.integers(2, 4))]:
            several = {"z": ("down",), "x": ("right", "left"), "y": ("back", "front")}[plane]
            probes = several[: int(generator.integers(1, len(several) + 1))]
            if generator.random() < 0.3 and "down" not in probes:
                probes = (*probes, "down")
            corner = float(generator.random()), float(generator.random())
            plate = str(generator.choice(sorted(plates)))
            turns = int(generator.integers(4))
            positions.append(Position(plane, level, corner, turns, probes, plate))
    plates = {name: plate for name, plate in plates.items() if name in {p.plate for p in positions}}
    return text_of(arrangement, size, plates, positions, "", int(generator.integers(3, 5)))


def random_designs(folder: Path, count: int, first: int = 0) -> Iterator[tuple[str, Experiment]]:
    """So many random designs of full rank with at least twenty degrees of freedom."""
    seed = first
    while count:
        given = loaded(folder, random_text(seed))
        design = lay_out(given)
        freedom = design.observation_count - design.parameter_count
        if linearise(design).deficiency == 0 and freedom >= 20:
            yield f"random {seed}", given
            count -= 1
        seed += 1


def loaded(folder: Path, text: str) -> Experiment:
    path = folder / "rivals.yaml"
    path.write_text(text, encoding="utf-8")
    return load(path)[0]


@dataclass(frozen=True)
class Campaign:
    """Readings with one error; a sentence that has any of its `names` names it."""

    observed: ObservedReadings
    names: tuple[str, ...]
    words: str


ERRORS = ("tip", "tip 8 µm in z", "chain", "reading", "swapped ball", "wave", "none")


def campaign(given: Experiment, error: str, seed: int) -> Campaign:
    """Readings of a random machine with an error of random size."""
    generator = np.random.default_rng(seed)
    plain = lay_out(given)
    changes: dict[str, object] = {
        "true_machine": {"kind": "random", "position": "2 um", "rotation": "4 urad", "seed": seed}
    }
    names: tuple[str, ...] = ()
    words = error
    if error == "chain":
        stated = ARRANGEMENTS[given.error_model.arrangement]
        others = [name for name in ARRANGEMENTS if ARRANGEMENTS[name] != stated]
        words = str(generator.choice(others))
        changes["error_model.arrangement"] = words
        names = (words,)
    simulated = simulated_readings(given.with_(changes), seed)
    readings, x = simulated.readings, simulated.x.copy()
    if error.startswith("tip"):
        probe = int(generator.choice(np.unique(readings.probe)))
        axis = int(generator.integers(3))
        size = 10.0 ** generator.uniform(-6.3, -5.0) * generator.choice([-1.0, 1.0])
        if error != "tip":
            axis, size = 2, 8e-6
        x[readings.probe == probe, axis] += size
        name = plain.probes.names[probe]
        names = tuple(
            f"{words} of probe {name}" for words in ("offset", "offset x", "offset y", "offset z")
        )
        words = f"{name} {'xyz'[axis]} {1e6 * size:.2f} µm"
    elif error == "reading":
        row, axis = int(generator.integers(len(x))), int(generator.integers(3))
        size = 10.0 ** generator.uniform(-5.7, -5.0) * generator.choice([-1.0, 1.0])
        x[row, axis] += size
        ball, probe = readings.ball[row], readings.probe[row]
        place = plain.positions.names[readings.position[row]]
        names = (f"{place}: ball {plain.ball_label(ball)}", f"ball {plain.ball_label(ball)}")
        words = f"{place} {plain.ball_label(ball)} {'xyz'[axis]} {1e6 * size:.2f} µm"
    elif error == "swapped ball":
        # The ball is displaced on its plate from a position on.
        position = int(generator.integers(1, len(plain.positions.names)))
        plate = plain.positions.artefact[position]
        ball = int(generator.choice(np.flatnonzero(plain.balls.artefact == plate)))
        moved = 10.0 ** generator.uniform(-5.7, -5.0) * _direction(generator)
        later = (readings.ball == ball) & (readings.position >= position)
        x[later] += (plain.positions.rotations @ moved)[readings.position[later]]
        names = (f"ball {plain.ball_label(ball)}",)
        words = f"{plain.ball_label(ball)} from {plain.positions.names[position]} on"
    elif error == "wave":
        axis, length = int(generator.integers(3)), generator.uniform(0.05, 0.6)
        x[:, axis] += 1e-6 * np.sin(2.0 * np.pi * (x[:, axis] / length + generator.random()))
        names = ("depends on", "several co-ordinates", "rotation of the probes")
    return Campaign(observe(plain, readings, x), names, words)


def _direction(generator: np.random.Generator) -> Real:
    drawn = generator.standard_normal(3)
    return np.asarray(drawn / np.linalg.norm(drawn))


def named_causes(found: Fit) -> list[tuple[str, ...]]:
    """What a fit names, each with what it says cannot be told apart from it."""
    named: list[tuple[str, ...]] = []
    if found.assumptions is not None:
        named += [(one.cause, *one.others) for one in found.assumptions.contradicted]
    if found.diagnosis:
        for one in found.diagnosis.data():
            if one["kind"] != "model":
                named.append((one["name"], *one["alternatives"], one["words"]))
    return named


def outcome(case: Campaign, found: Fit) -> str:
    """Right if each sentence that names a cause has the true one, wrong if one has not."""
    named = named_causes(found)
    if not named:
        return "nothing"
    have = [any(name in words for words in one for name in case.names) for one in named]
    return "right" if all(have) else "wrong"


@dataclass(frozen=True)
class Refit:
    """What a fit leaves of a file that states a cause, and its number of further parameters."""

    sum_of_squares: float
    parameters: int


def _offset(probe: str, factors: tuple[float, ...] = (1.0, 1.0, 1.0), by: str = "") -> list[str]:
    """Its stated offset, or one that differs by what a sentence says."""
    units = {"nm": 1e-6, "µm": 1e-3, "mm": 1.0, "m": 1e3}
    change = dict.fromkeys("xyz", 0.0)
    for value, unit, axis in re.findall(r"(-?[\d.e-]+) (nm|µm|mm|m) along (\w)", by):
        change[axis] = float(value) * units[unit]
    moved = zip(factors, TIPS[probe], change.values(), strict=True)
    return [f"{factor * value + more:.9g} mm" for factor, value, more in moved]


def refit_of(given: Experiment, case: Campaign, words: str) -> Refit | None:
    """The fit of a file that states a cause, made by the public interface; None of causes that
    no key states.
    """
    changes: dict[str, object] = {}
    readings, x, parameters = case.observed.design.readings, case.observed.x, 3
    design = lay_out(given)
    if match := re.search(r"offset (\w) of probe (\w+) has the wrong sign", words):
        factors = tuple(-1.0 if axis == match[1] else 1.0 for axis in "xyz")
        changes[f"probes.{match[2]}"], parameters = _offset(match[2], factors), 1
    elif match := re.search(r"offsets of probes (\w+) and (\w+) are exchanged", words):
        changes = {
            f"probes.{one}": _offset(other) for one, other in (match.groups(), match.groups()[::-1])
        }
        parameters = 1
    elif match := re.search(r"offset (?:\w )?of probe (\w+)", words):
        changes[f"probes.{match[1]}"] = {"offset": _offset(match[1], by=words), "unknown": True}
        held = next(name for name in design.probes.names if name != match[1])
        if match[1] == design.probes.names[0]:
            changes[f"probes.{held}"] = {"offset": _offset(held), "reference": True}
    elif match := re.match(r"the arrangement of the axes is (\w+)", words):
        changes["error_model.arrangement"], parameters = match[1], 1
    elif match := re.match(r"(size of|scales of the machine, not) \w+,? in position (\w+)", words):
        by_axis = match[1] != "size of"
        scale = {"kind": "position scale", "positions": [match[2]], "by_axis": by_axis}
        changes["influences"], parameters = [scale], 3 if by_axis else 1
    elif match := re.match(r"ball (\S+) in position (\w+) with (\w+), \w$", words):
        chosen = [
            (design.ball_label(ball), design.positions.names[position], design.probes.names[probe])
            != match.groups()
            for ball, position, probe in zip(
                readings.ball, readings.position, readings.probe, strict=True
            )
        ]
        readings, x = readings.select(np.flatnonzero(chosen)), x[chosen]
    else:
        return None
    stated = given.with_(changes)
    found = fit(stated, observe(lay_out(stated), readings, x))
    return Refit(found.sum_of_squares, parameters) if found.converged else None


def main() -> None:
    """Print how often each error is named rightly, wrongly or not at all."""
    with TemporaryDirectory() as folder:
        for error in ERRORS:
            for name, text in DESIGNS.items():
                given = loaded(Path(folder), text)
                cases = (campaign(given, error, 7000 + number) for number in range(8))
                found = Counter(outcome(case, fit(given, case.observed)) for case in cases)
                print(f"{error}, {name}: {dict(found)}", flush=True)


if __name__ == "__main__":
    main()
