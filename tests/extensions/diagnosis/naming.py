"""How often a fit names the right cause: data sets with one mistake or one model error each, and a
table of them.

Run as `python -m tests.extensions.diagnosis.naming` it prints a table; docs/reference/validation.md has it of
fewer data sets.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from ballplate.extensions.diagnosis.cause_search import FAMILY, Search, diagnosis
from ballplate.extensions.diagnosis.events import Cause, cause
from ballplate.extensions.diagnosis.power import noncentrality
from ballplate.extensions.diagnosis.suspects import Diagnosis
from ballplate.simulator.design.arrays import Design, Readings
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.estimation.gauss_newton import estimate, linearised_fit
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.machines.arrangement import ARRANGEMENTS
from ballplate.simulator.machines.kinematic import kinematic_model
from ballplate.simulator.machines.true_machine_settings import RandomSettings
from ballplate.simulator.machines.truth import TrueMachine, true_machine
from ballplate.simulator.readings.generate import noisy_certificate, noisy_readings, on_true_machine
from ballplate.simulator.readings.observed_readings import observe
from numpy.typing import NDArray

Real = NDArray[np.float64]
Generator = np.random.Generator
LOWER, UPPER = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class DataSet:
    """What has been measured, and the true cause: a kind, what it is about, the first reading after
    a slip.
    """

    design: Design
    readings: Readings
    x: Real
    cause: Cause


class World:
    """An experiment of which data sets are drawn, and how large mistakes must be to be found."""

    def __init__(self, file: str = "designs/quickstart.yaml", times: float = 2.0) -> None:
        self.design = lay_out(load(Path(file))[0])
        self.times = times
        generator = np.random.default_rng(0)
        plain = self.drawn(self.machine(1), generator)
        solution = estimate(plain.design, plain.x)
        self.freedom = self.design.observation_count - self.design.parameter_count
        self.search = Search(linearised_fit(plain.design, solution), plain.x, self.freedom, True)
        self.least = noncentrality(0.5 * FAMILY / self.search.tests, 0.8, self.freedom - 1)

    def machine(self, seed: int) -> TrueMachine:
        settings = RandomSettings(kind="random", position="2 um", rotation="4 urad", seed=seed)
        return true_machine(settings, self.design.model, LOWER, UPPER)

    def drawn(self, machine: TrueMachine, generator: Generator) -> DataSet:
        design, truth = on_true_machine(self.design, machine)
        certificate = noisy_certificate(self.design, truth, generator, machine.model)
        readings, x = noisy_readings(design, truth, generator)
        return DataSet(certificate, readings, x, Cause("", ()))

    def detectable(self, change: Real) -> float:
        """Size of a bias of which a unit changes scale readings by `change` (m, d), such as is
        found so often.
        """
        rows = (change / self.design.machine.repeatability).ravel()
        return self._detectable(
            np.concatenate([rows, np.zeros(len(self.search.left.residual) - len(rows))])
        )

    def _detectable(self, rows: Real) -> float:
        left = self.search.start.of(rows[:, None])[:, 0]
        return float(self.times * self.least / np.sqrt(left @ left))

    def of_certificate(self, distance: int) -> float:
        rows = np.zeros(len(self.search.left.residual))
        rows[-len(self.design.of(CalibratedDistances)) + distance] = (
            1.0 / self.design.of(CalibratedDistances).uncertainty[distance]
        )
        return self._detectable(rows)


Draw = Callable[[World, DataSet, Generator], DataSet]


def biased(
    world: World, data: DataSet, change: Real, found: Cause, generator: Generator
) -> DataSet:
    size = world.detectable(change) * generator.choice([-1.0, 1.0])
    return replace(data, x=data.x + size * change, cause=found)


def direction(generator: Generator) -> Real:
    drawn = generator.standard_normal(3)
    return np.asarray(drawn / np.sqrt(drawn @ drawn))


def a_reading(world: World, data: DataSet, generator: Generator) -> DataSet:
    i, axis = int(generator.integers(len(data.x))), int(generator.integers(3))
    change = np.zeros_like(data.x)
    change[i, axis] = 1.0
    return biased(world, data, change, Cause("reading", (i,)), generator)


def swapped_ball(world: World, data: DataSet, generator: Generator) -> DataSet:
    """From one position on another ball is in its place, somewhere else on the plate."""
    readings = data.readings
    k, ball = (
        int(generator.integers(1, len(world.design.positions.names))),
        int(generator.integers(25)),
    )
    later = (readings.ball == ball) & (readings.position >= k)
    change = np.zeros_like(data.x)
    change[later] = (world.design.positions.rotations @ direction(generator))[
        readings.position[later]
    ]
    first = int(np.flatnonzero(later)[0])
    return biased(world, data, change, Cause("moved", (first,)), generator)


def dirt(world: World, data: DataSet, generator: Generator) -> DataSet:
    readings = data.readings
    k, ball = int(generator.integers(2, 6)), int(generator.integers(25))
    here = (readings.ball == ball) & (readings.position == k)
    change = here[:, None] * direction(generator)
    return biased(world, data, change, Cause("ball", (int(np.flatnonzero(here)[0]),)), generator)


def slip(where: str) -> Draw:
    def draw(world: World, data: DataSet, generator: Generator) -> DataSet:
        readings = data.readings
        k = int(generator.integers(2, 6) if where == "between probes" else generator.integers(6))
        rows = np.flatnonzero(readings.position == k)
        half = len(rows) // 2
        start = half if where != "elsewhere" else int(generator.integers(4, len(rows) - 4))
        places = data.x + world.design.probes.offsets[readings.probe]
        arm = places - places[rows].mean(axis=0)
        moved = np.zeros(len(data.x), bool)
        moved[rows[start:]] = True
        turning = (
            2.0 * np.cross(direction(generator), arm) if generator.random() < 0.5 else np.zeros(3)
        )
        change = moved[:, None] * (direction(generator) + turning)
        return biased(world, data, change, Cause("slip", (k,), int(rows[start])), generator)

    return draw


def probe_offset(world: World, data: DataSet, generator: Generator) -> DataSet:
    """Of probes along the directions that poses do not take up."""
    probe, axis = int(generator.integers(1, 5)), int(generator.integers(3))
    change = (data.readings.probe == probe)[:, None] * np.eye(3)[axis]
    return biased(world, data, change, Cause("probe", (probe,)), generator)


def certificate(world: World, data: DataSet, generator: Generator) -> DataSet:
    k = int(generator.integers(len(world.design.of(CalibratedDistances))))
    value = data.design.of(CalibratedDistances).value.copy()
    value[k] += world.of_certificate(k) * generator.choice([-1.0, 1.0])
    design = data.design.observed(replace(data.design.of(CalibratedDistances), value=value))
    return replace(data, design=design, cause=Cause("distance", (k,)))


def expansion(positions: int) -> Draw:
    def draw(world: World, data: DataSet, generator: Generator) -> DataSet:
        some = np.sort(generator.choice(6, positions, replace=False))
        places = data.x + world.design.probes.offsets[data.readings.probe]
        change = np.zeros_like(data.x)
        for k in some:
            rows = data.readings.position == k
            change[rows] = places[rows] - places[rows].mean(axis=0)
        return biased(world, data, change, Cause("expansion", tuple(some.tolist())), generator)

    return draw


def noise(world: World, data: DataSet, generator: Generator) -> DataSet:
    k = int(generator.integers(6))
    rows = data.readings.position == k
    more = (
        np.sqrt(8.0) * generator.standard_normal(data.x.shape) * world.design.machine.repeatability
    )
    return replace(data, x=data.x + rows[:, None] * more, cause=Cause("scatter", (k,)))


def share(generator: Generator) -> float:
    """How large a model error is, of the largest that is drawn."""
    return float(np.exp(generator.uniform(np.log(0.2), 0.0)))


def random_settings(generator: Generator, position: float, rotation: float) -> RandomSettings:
    seed = int(generator.integers(2**31))
    return RandomSettings(
        kind="random", position=f"{position} m", rotation=f"{rotation} rad", seed=seed
    )


def wave(world: World, data: DataSet, generator: Generator) -> DataSet:
    """A scale that is wrong by a sine."""
    axis, length = int(generator.integers(3)), float(generator.uniform(0.05, 0.6))
    x = data.x.copy()
    x[:, axis] += (
        1e-6 * share(generator) * np.sin(2.0 * np.pi * (x[:, axis] / length + generator.random()))
    )
    return replace(data, x=x)


def other_machine(make: Callable[[World, Generator], TrueMachine]) -> Draw:
    def draw(world: World, data: DataSet, generator: Generator) -> DataSet:
        return world.drawn(make(world, generator), generator)

    return draw


def richer(world: World, generator: Generator) -> TrueMachine:
    """Polynomials of seven coefficients where five are estimated."""
    model = kinematic_model(ARRANGEMENTS["MB2"], 7, 7, LOWER, UPPER)
    size = share(generator)
    settings = random_settings(generator, 2e-6 * size, 4e-6 * size)
    return true_machine(settings, model, LOWER, UPPER)


def full_rotations(world: World, generator: Generator) -> TrueMachine:
    """A machine with rotations of up to a milliradian, whose products count."""
    model = kinematic_model(ARRANGEMENTS["MB2"], 5, 5, LOWER, UPPER, full_rotations=True)
    settings = random_settings(generator, 2e-6, 1e-3 * share(generator))
    return true_machine(settings, model, LOWER, UPPER)


def other_arrangement(world: World, generator: Generator) -> TrueMachine:
    names = sorted(set(ARRANGEMENTS) - {"MB2"})
    model = kinematic_model(ARRANGEMENTS[names[generator.integers(len(names))]], 5, 5, LOWER, UPPER)
    size = share(generator)
    settings = random_settings(generator, 2e-6 * size, 4e-6 * size)
    return true_machine(settings, model, LOWER, UPPER)


def tilted_axes(world: World, data: DataSet, generator: Generator) -> DataSet:
    """A machine that tilts with all that it carries, as one of its axes moves, by up to 10 urad at
    its end.
    """
    along, about = int(generator.integers(3)), int(generator.integers(3))
    angle = 10e-6 * share(generator) * data.x[:, along]
    turn = np.cross(np.eye(3)[about], data.x + world.design.probes.offsets[data.readings.probe])
    return replace(data, x=data.x - angle[:, None] * turn)


def drift(world: World, data: DataSet, generator: Generator) -> DataSet:
    """The machine drifts against the plate, by up to 10 um over all readings."""
    time = np.linspace(0.0, 1.0, len(data.x))
    return replace(data, x=data.x + 10e-6 * share(generator) * time[:, None] * direction(generator))


def nothing(world: World, data: DataSet, generator: Generator) -> DataSet:
    return data


MODEL_ERRORS: dict[str, Draw] = {
    "a wave in a scale, 0.2 to 1 µm": wave,
    "polynomials of degree 6, not 4": other_machine(richer),
    "full rotations, 0.2 to 1 mrad": other_machine(full_rotations),
    "another arrangement": other_machine(other_arrangement),
    "tilting axes, 2 to 10 µrad": tilted_axes,
    "a drift, 2 to 10 µm": drift,
}
MISTAKES: dict[str, Draw] = {
    "a reading": a_reading,
    "a swapped ball": swapped_ball,
    "dirt on a ball": dirt,
    "a slip half-way": slip("half-way"),
    "a slip elsewhere": slip("elsewhere"),
    "a slip between probes": slip("between probes"),
    "a probe's offset": probe_offset,
    "a certified distance": certificate,
    "expansion in a position": expansion(1),
    "expansion in two positions": expansion(2),
    "noise three times as large in a position": noise,
}
OUTCOMES = ("right", "model", "nothing", "wrong")


def outcome(data: DataSet, found: Diagnosis) -> str:
    """What a diagnosis is worth: every cause that is told must be the true one, or cannot be told
    from it.

    A slip must have come in the range that is told.
    """
    if found.unexplained:
        return "model"
    if not found:
        return "nothing"
    if not data.cause.kind:
        of_model = (
            found.suspects and not found.scatter and all(one.of_model for one in found.suspects)
        )
        return "model" if of_model else "wrong"
    expanded: set[int] = set()
    for one in found.suspects:
        told = [
            cause(one.patterns, np.array(columns)) for columns in (one.columns, *one.alternatives)
        ]
        if told[0].kind == data.cause.kind == "expansion":
            expanded |= set(told[0].subjects)
        elif told[0].kind == data.cause.kind == "slip":
            if (
                told[0].subjects != data.cause.subjects
                or not one.first <= data.cause.start <= one.last
            ):
                return "wrong"
        elif data.cause not in told:
            return "wrong"
    if found.scatter and Cause("scatter", (found.scatter.of.position,)) != data.cause:
        return "wrong"
    return "right" if not expanded or expanded == set(data.cause.subjects) else "wrong"


def draw_one(world: World, make: Draw, seed: int) -> tuple[DataSet, Diagnosis]:
    generator = np.random.default_rng(seed)
    data = make(world, world.drawn(world.machine(seed), generator), generator)
    observed = observe(data.design, data.readings, data.x)
    solution = estimate(observed.design, observed.x)
    return data, diagnosis(
        linearised_fit(observed.design, solution), observed.x, world.freedom, True
    )


def counts(world: World, kind: str, sets: int) -> Counter[str]:
    """Outcomes of the first data sets of a kind."""
    kinds = {"nothing wrong": nothing, **MODEL_ERRORS, **MISTAKES}
    first = 10_000 * list(kinds).index(kind)
    return Counter(outcome(*draw_one(world, kinds[kind], first + r)) for r in range(sets))


def row(kind: str, found: Counter[str]) -> str:
    """A row of the table, in per cent; only a mistake has a cause to be named."""
    total = sum(found.values())
    cells = [f"{100 * found[name] / total:.1f}" for name in OUTCOMES]
    return f"| {kind} | " + " | ".join(cells if kind in MISTAKES else ["–", *cells[1:]]) + " |"


def main(arguments: Iterable[str] | None = None) -> None:
    parser = ArgumentParser()
    parser.add_argument("--sets", type=int, default=300, help="data sets of each kind")
    parser.add_argument(
        "--times", type=float, default=2.0, help="mistakes, in sizes that a fit finds with 80 %%"
    )
    options = parser.parse_args(arguments)
    world = World(times=options.times)
    print(
        "| in the readings | right cause | the model | nothing | wrong cause |",
        "|---|---|---|---|---|",
        sep="\n",
    )
    for kind in ("nothing wrong", *MODEL_ERRORS, *MISTAKES):
        print(row(kind, counts(world, kind, options.sets)), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
