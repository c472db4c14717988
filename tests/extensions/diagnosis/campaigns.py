"""Campaigns with one error each on designs of the page and others, and how often a fit names it.

Run as `python -m tests.extensions.diagnosis.campaigns --sets 8` it prints the rates.
"""

from __future__ import annotations

from argparse import ArgumentParser
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from ballplate.extensions.diagnosis.bias_patterns import LinearisedDesign, patterns
from ballplate.extensions.diagnosis.cause_search import FAMILY, Search
from ballplate.extensions.diagnosis.events import cause, event_groups
from ballplate.extensions.diagnosis.exact_values import searched_with_exact_values
from ballplate.extensions.diagnosis.hypotheses import CHAIN, MODEL, PossibleCause
from ballplate.extensions.diagnosis.power import noncentrality
from ballplate.extensions.diagnosis.remainders import Columns, leftover
from ballplate.simulator.estimation.gauss_newton import estimate, linearised_fit
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.machines.arrangement import ARRANGEMENTS
from ballplate.simulator.readings.observed_readings import ObservedReadings, observe
from ballplate.simulator.readings.simulated import simulated_readings
from numpy.typing import NDArray

from tests.extensions.diagnosis.designs import PLATE

Real = NDArray[np.float64]
Generator = np.random.Generator

QUICKSTART = Path("designs/quickstart.yaml").read_text(encoding="utf-8")

# Three probes in each position, of oblique offsets.
OBLIQUE = """
title: oblique
machine: {volume: [800 mm, 600 mm, 700 mm], repeatability: 0.4 um}
error_model: {kind: kinematic, arrangement: MB1, position_coefficients: 4, rotation_coefficients: 3}
true_machine: {kind: random, position: 3 um, rotation: 6 urad, seed: 3}
probes:
  a: [0 mm, 0 mm, -80 mm]
  b: [40 mm, 30 mm, -60 mm]
  c: [-50 mm, 20 mm, -45 mm]
artefacts:
  plate: {kind: grid, balls: [4, 3], size: [420 mm, 300 mm]}
positions:
  - {name: low, plane: z, level: 120 mm, corner: {x: 50 mm, y: 50 mm}, probes: [a, b, c]}
  - {name: high, plane: z, level: 380 mm, corner: {x: 300 mm, y: 100 mm}, quarter_turns: 1, probes: [a, b, c]}
  - {name: near, plane: x, level: 200 mm, corner: {y: 60 mm, z: 40 mm}, probes: [a, b, c]}
  - {name: far, plane: x, level: 600 mm, corner: {y: 100 mm, z: 60 mm}, quarter_turns: 1, probes: [a, b, c]}
  - {name: side, plane: y, level: 150 mm, corner: {z: 40 mm, x: 100 mm}, probes: [a, b, c]}
  - {name: back, plane: y, level: 450 mm, corner: {z: 60 mm, x: 300 mm}, quarter_turns: 1, probes: [a, b, c]}
calibration:
  - {kind: distances, artefact: plate, pairs: corner sides, standard_uncertainty: 0.3 um}
evaluation: {points: {random: 12, seed: 1}, probe: a}
"""


def with_bar(text: str, probe: str) -> str:
    """A design with a second certificate: that of a bar along x and along y."""
    bar = "  bar: {kind: two_spheres, length: 500 mm, role: length_standard}\npositions:"
    turned = "rotation: [0 deg, 0 deg, 90 deg]"
    head, tail = text.split("artefacts:", 1)
    tail = tail.replace("positions:", bar, 1)
    tail = tail.replace("artefact: plate, ", "").replace("plane: ", "artefact: plate, plane: ")
    tail = tail.replace("- {kind: distances, pairs", "- {kind: distances, artefact: plate, pairs")
    tail = tail.replace("- kind: distances\n", "- kind: distances\n    artefact: plate\n")
    tail = tail.replace("{kind: distances, pairs", "{kind: distances, artefact: plate, pairs")
    return f"{head}artefacts:" + tail.replace(
        "calibration:",
        f"""  - {{name: along x, artefact: bar, pose: {{origin: [150 mm, 300 mm, 350 mm]}}, probes: [{probe}]}}
  - {{name: along y, artefact: bar, pose: {{origin: [400 mm, 50 mm, 300 mm], {turned}}}, probes: [{probe}]}}
calibration:
  - {{kind: distances, artefact: bar, pairs: all, standard_uncertainty: 0.2 um}}""",
        1,
    )


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
    "quickstart": with_bar(QUICKSTART, "down"),
    "few balls": with_bar(PLATE, "down"),
    "three probes in each position": with_bar(OBLIQUE, "a"),
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
    """Readings with one error of `times` the size that is found with 80 %; `truth` are what names
    it, as `named` does.
    """

    observed: ObservedReadings
    truth: frozenset[tuple[object, ...]]
    times: float


class World:
    """An experiment of which campaigns are drawn, with what residuals show of it as drawn."""

    def __init__(self, given: Experiment) -> None:
        self.given, self.design = given, lay_out(given)
        at = linearise(self.design)
        self.start = leftover(at, None, at.degrees_of_freedom)
        self.weight = LinearisedDesign(self.design, at.state, None).weight
        every = patterns(self.design, at.state, None, every_start=True)
        tests = Columns(every.matrix, event_groups(every), self.start).tests()
        self.least = noncentrality(0.5 * FAMILY / tests, 0.8, at.degrees_of_freedom - 1)

    def detectable(self, change: Real) -> float:
        """Size of a change (m, d) of the readings that is found with a power of 80 %."""
        rows = np.zeros((len(self.start.residual), 1))
        white = (self.weight * change[self.design.plate_readings]).ravel()
        rows[: len(white), 0] = white
        shown, size = np.linalg.norm(self.start.of(rows)), np.linalg.norm(rows)
        return float(self.least / shown) if shown > 1e-6 * size else np.inf


# Errors of readings and of assumptions, of the model, and none.
GROSS = ("reading", "moved", "ball", "slip", "scatter")
ASSUMED = ("expansion", "scale", "probe", "drift", "chain")
OF_MODEL = ("wave", "rotations", "polynomials", "tilt")
ERRORS = ("none", *GROSS, *ASSUMED, *OF_MODEL)


def campaign(world: World, error: str, seed: int, times: float | None = None) -> Campaign | None:
    """Readings of a random machine with an error; None if it cannot occur or be seen."""
    generator = np.random.default_rng([seed, ERRORS.index(error)])
    design, machine_seed = world.design, int(generator.integers(1 << 31))
    share = float(np.exp(generator.uniform(np.log(0.2), 0.0)))
    machine = {"kind": "random", "position": "2 um", "rotation": "4 urad", "seed": machine_seed}
    changes: dict[str, object] = {"true_machine": machine}
    truth: set[tuple[object, ...]] = {(MODEL,)} if error in OF_MODEL else set()
    if error == "chain":
        stated = ARRANGEMENTS[world.given.error_model.arrangement]
        names = [name for name in ARRANGEMENTS if ARRANGEMENTS[name] != stated]
        changes["error_model.arrangement"] = name = str(generator.choice(names))
        truth = {(error, name)}
    elif error == "rotations":
        changes["error_model.rotations"] = "full"
        machine["rotation"] = f"{1e-3 * share} rad"
    elif error == "polynomials":
        changes["error_model.position_coefficients"] = 7
        changes["error_model.rotation_coefficients"] = 7
        machine["position"], machine["rotation"] = f"{2e-6 * share} m", f"{4e-6 * share} rad"
    simulated = simulated_readings(world.given.with_(changes), machine_seed)
    readings, x = simulated.readings, simulated.x.copy()
    if error == "scatter":
        position = int(generator.choice(design.plate_positions))
        noise = np.sqrt(8.0) * generator.standard_normal(x.shape) * design.machine.repeatability
        x += (readings.position == position)[:, None] * noise
        truth = {("scatter", position)}
    elif error == "wave":
        axis, length = int(generator.integers(3)), generator.uniform(0.05, 0.6)
        phase = generator.random()
        x[:, axis] += 1e-6 * share * np.sin(2.0 * np.pi * (x[:, axis] / length + phase))
    elif error == "tilt":
        along, about = generator.integers(3, size=2)
        angle = 10e-6 * share * x[:, along]
        x -= angle[:, None] * np.cross(np.eye(3)[about], x + design.probes.offsets[readings.probe])
    elif error == "drift":
        x += 10e-6 * share * np.linspace(0.0, 1.0, len(x))[:, None] * direction(generator)
        truth = {("drift",)}
    elif error not in ("none", "chain", *OF_MODEL):
        found = _change(world, readings.position, readings.ball, readings.probe, error, generator)
        if found is None:
            return None
        change, truth = found
        times = times or float(np.exp(generator.uniform(0.0, np.log(4.0))))
        size = times * world.detectable(change)
        if not size < 1e-3:
            return None
        x += size * generator.choice([-1.0, 1.0]) * change
    return Campaign(observe(design, readings, x), frozenset(truth), times or 1.0)


def _change(
    world: World, position: Real, ball: Real, probe: Real, error: str, generator: Generator
) -> tuple[Real, set[tuple[object, ...]]] | None:
    """What an error of one unit changes readings (m, d) by, and what names it."""
    design, plate = world.design, np.isin(np.arange(len(ball)), world.design.plate_readings)
    change, turned = np.zeros((len(ball), 3)), design.positions.rotations[position]
    arms = np.einsum("mij,mj->mi", turned, design.balls.places[ball])
    if error == "reading":
        row = int(generator.choice(design.plate_readings))
        change[row, generator.integers(3)] = 1.0
        return change, {(error, row)}
    if error in ("moved", "ball"):
        row = int(generator.choice(design.plate_readings))
        same = plate & (ball == ball[row])
        here = same & (position >= position[row] if error == "moved" else position == position[row])
        is_seen = (same & ~here).any() if error == "moved" else here.sum() > 1
        moved = direction(generator)
        change[here] = (turned @ moved)[here] if error == "moved" else moved
        return (change, {(error, int(np.flatnonzero(here)[0]))}) if is_seen else None
    if error == "probe":
        wrong = int(generator.choice(np.unique(probe)))
        change[probe == wrong, generator.integers(3)] = 1.0
        return change, {(error, wrong)}
    if error == "scale":
        artefact = int(generator.choice(design.positions.artefact[design.plate_positions]))
        here = design.positions.artefact[position] == artefact
        return np.where(here[:, None], arms, 0.0), {(error, artefact)}
    chosen = int(generator.choice(design.plate_positions))
    rows = np.flatnonzero(position == chosen)
    if error == "expansion":
        change[rows] = arms[rows]
        return change, {(error, chosen)}
    if len(rows) < 9:
        return None
    start = int(generator.integers(4, len(rows) - 4))
    turning = np.cross(2.0 * direction(generator), arms) if generator.random() < 0.5 else change
    change[rows[start:]] = (direction(generator) + turning)[rows[start:]]
    return change, {(error, chosen, int(rows[start]))}


def direction(generator: Generator) -> Real:
    drawn = generator.standard_normal(3)
    return np.asarray(drawn / np.linalg.norm(drawn))


def named(search: Search | None) -> list[set[tuple[object, ...]]]:
    """What a search names, each with what it does not tell apart from it."""
    if search is None:
        return []
    names = []
    for found in search.found:
        own = [] if found.hypothesis is None else [found.hypothesis]
        one = set[tuple[object, ...]]().union(*map(_of_hypothesis, (*own, *found.of_others)))
        for columns in (found.columns, *found.others):
            if len(columns):
                each = cause(search.patterns, columns)
                starts = range(found.first, found.last + 1) if each.kind == "slip" else ()
                one |= {
                    (each.kind, subject, start) for subject in each.subjects for start in starts
                }
                one |= {(each.kind, subject) for subject in each.subjects if not starts}
        names.append(one)
    if search.scatter:
        names.append({("scatter", search.scatter[0].position)})
    if search.model:
        best = search.model.hypothesis
        names.append({(MODEL,), *(_of_hypothesis(best) if best else ())})
    return names


def _of_hypothesis(one: PossibleCause) -> set[tuple[object, ...]]:
    if one.assumed == CHAIN:
        return {("chain", name) for name in one.words.split(" is ")[1].split(" or ")}
    return {(one.assumed,)}


def outcome(case: Campaign, is_of_model: bool, names: list[set[tuple[object, ...]]]) -> str:
    """Right if each name may be the true one; if not, of the model, or wrong."""
    if not names:
        return "silent"
    right, of_model = (
        [not one.isdisjoint(causes) for one in names] for causes in (case.truth, {(MODEL,)})
    )
    if is_of_model or all(right):
        return "right" if all(right) else "wrong"
    if all(hit or model for hit, model in zip(right, of_model, strict=True)):
        return "right" if any(right) else "model"
    return "wrong"


def rates(world: World, error: str, count: int, first: int = 0) -> Counter[str]:
    """Outcomes of so many campaigns with an error."""
    found: Counter[str] = Counter()
    for seed in range(first, first + count):
        case = campaign(world, error, seed)
        if case is None:
            continue
        solution = estimate(case.observed.design, case.observed.x)
        at = linearised_fit(case.observed.design, solution)
        names = named(searched_with_exact_values(at, case.observed.x, True))
        word = outcome(case, error in OF_MODEL, names)
        found[word] += 1
        found["large"] += case.times > 2.0
        found["large right"] += case.times > 2.0 and word == "right"
    return found


def main() -> None:
    """Print how often each error is named rightly, wrongly or not at all, over all designs."""
    parser = ArgumentParser()
    parser.add_argument("--sets", type=int, default=8, help="campaigns of each error and design")
    parser.add_argument("--seed", type=int, default=0, help="the first of the random numbers")
    arguments = parser.parse_args()
    count, first = arguments.sets, arguments.seed
    with TemporaryDirectory() as folder:
        designs = [(name, loaded(Path(folder), text)) for name, text in DESIGNS.items()]
        worlds = [World(one) for _, one in (*designs, *random_designs(Path(folder), 3, first))]
    print(
        "| error | right | model | silent | wrong | above twice: right |",
        "|---|---|---|---|---|---|",
        sep="\n",
    )
    for error in ERRORS:
        found = sum((rates(world, error, count, first) for world in worlds), Counter[str]())
        cells = [found[word] for word in ("right", "model", "silent", "wrong")]
        large = f"{found['large right']} of {found['large']}"
        print(f"| {error} | {' | '.join(map(str, cells))} | {large} |", flush=True)


if __name__ == "__main__":
    main()
