"""How often one wrong probe offset is named: single mistakes in the offsets of three designs, and
what reading and fit say of each.

Run as `python -m tests.extensions.reliability.offsets` it prints the rates with their confidence limits.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import combinations, product
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from ballplate.extensions.reliability.cause_search import FAMILY, Search
from ballplate.extensions.reliability.hat import row_places
from ballplate.extensions.reliability.power import noncentrality
from ballplate.extensions.reliability.refits import diagnosis_with_refits
from ballplate.extensions.reliability.wording import diagnosis_words
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.observations.priors import Priors
from ballplate.simulator.estimation.gauss_newton import estimate, linearised_fit
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.machines.true_machine_settings import RandomSettings
from ballplate.simulator.machines.truth import true_machine
from ballplate.simulator.readings.generate import noisy_certificate, noisy_readings, on_true_machine
from ballplate.simulator.readings.observed_readings import observe
from numpy.typing import NDArray
from scipy.stats import beta

from tests.extensions.reliability.designs import PLATE, experiment

Real = NDArray[np.float64]

SIZES = (5e-6, 50e-6, 0.3e-3, 2e-3, 10e-3, 50e-3)
UNCERTAIN = 2e-6

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
DESIGNS = {
    "quickstart": Path("designs/quickstart.yaml").read_text(encoding="utf-8"),
    "few balls": PLATE,
    "three probes in each position": OBLIQUE,
}


@dataclass(frozen=True)
class Mistake:
    """True less stated offsets (l, d), and what names it in a sentence: any of `names`."""

    words: str
    change: Real
    names: tuple[str, ...]
    kind: str


@dataclass(frozen=True)
class Plan:
    """A design whose offsets may be wrong."""

    design: Design

    @cached_property
    def search(self) -> Search:
        """What is left of readings without a mistake."""
        design, x = drawn(self.design, np.zeros(self.design.probes.offsets.shape), 0)
        at = linearised_fit(design, estimate(design, x))
        return Search(at, x, at.degrees_of_freedom, True)

    def detectable(self, change: Real) -> float:
        """A change (l, d) of the offsets in minimal detectable biases."""
        given, priors = self.search.patterns, self.design.of(Priors)
        chosen = given.of_kind("probe")
        rows = given.matrix[:, chosen] @ change[given.subject[chosen], given.axis[chosen]]
        of_priors = change[priors.probe, priors.component] / priors.uncertainty
        rows[row_places(self.search.design)["prior"]] += of_priors
        left = self.search.start.of(rows[:, None])[:, 0]
        least = noncentrality(0.5 * FAMILY / self.search.tests, 0.8, self.search.freedom - 1)
        return float(np.sqrt(left @ left) / least)


def text_of(name: str, is_uncertain: bool) -> str:
    """A design as a file, with offsets that are exact or uncertain."""
    stated = f"{{offset: \\2, standard_uncertainty: {1e6 * UNCERTAIN:g} um}}"
    if not is_uncertain:
        return DESIGNS[name]
    head, tail = DESIGNS[name].split("artefacts:", 1)
    return re.sub(r"(?m)^(  \w+: )(\[.*\])$", f"\\1{stated}", head) + "artefacts:" + tail


@cache
def plan(name: str, is_uncertain: bool, folder: Path) -> Plan:
    design = lay_out(experiment(folder, text_of(name, is_uncertain)))
    assert design.probes.free.any() == is_uncertain
    return Plan(design)


def drawn(design: Design, change: Real, seed: int) -> tuple[Design, Real]:
    """Readings of a machine of its own, with true offsets that differ by a change (l, d) from those
    stated.
    """
    generator = np.random.default_rng(seed)
    settings = RandomSettings(kind="random", position="2 um", rotation="4 urad", seed=seed)
    machine = true_machine(settings, design.model, *design.machine.volume.corners)
    on_truth, truth = on_true_machine(design, machine)
    error = UNCERTAIN * design.probes.free * generator.standard_normal(change.shape)
    certificate = noisy_certificate(design, truth, generator, machine.model)
    # The file states what the probes were taken for, whatever they are.
    certificate = certificate.observed(design.of(Priors))
    there = replace(truth, probes=truth.probes + change + error)
    readings, x = noisy_readings(on_truth, there, generator)
    observed = observe(certificate, readings, x)
    return observed.design, observed.x


def mistakes(design: Design) -> Iterator[Mistake]:
    """Every single mistake: an offset by each size along each axis, a sign, two exchanged."""
    offsets, names = design.probes.offsets, design.probes.names
    for probe, axis in np.ndindex(offsets.shape):
        letter, label = "xyz"[axis], names[probe]
        prior = f"prior of probe {label}: offset {letter}"
        named = f"offset {letter} of probe {label}", f"offset of probe {label}", prior
        off = (*named, f"the offset of probe {label} is another one")
        change = np.zeros_like(offsets)
        for size in (sign * size for size in SIZES for sign in (1, -1)):
            change[probe, axis] = size
            words = f"{letter} of {label} by {1e3 * size:g} mm"
            yield Mistake(words, change.copy(), off, f"{1e3 * abs(size):g} mm")
        if offsets[probe, axis]:
            change[probe, axis] = -2.0 * offsets[probe, axis]
            sign = (f"offset {letter} of probe {label} has the wrong sign",)
            yield Mistake(f"sign of {letter} of {label}", change, sign, "sign")
    for one, other in combinations(range(len(names)), 2):
        change = np.zeros_like(offsets)
        change[one], change[other] = offsets[other] - offsets[one], offsets[one] - offsets[other]
        exchanged = (f"the offsets of probes {names[one]} and {names[other]} are exchanged",)
        yield Mistake(f"{names[one]} and {names[other]}", change, exchanged, "exchange")


def sentences(plan: Plan, mistake: Mistake, seed: int) -> list[str]:
    """The suspects of a fit with a mistake, none if it diverges."""
    design, x = drawn(plan.design, mistake.change, seed)
    solution = estimate(design, x)
    if solution.status != "converged":
        return []
    at = linearised_fit(design, solution)
    return diagnosis_words(diagnosis_with_refits(at, x, at.degrees_of_freedom, True))


def outcome(mistake: Mistake, said: list[str]) -> str:
    """Right where the mistake is among what every sentence names, wrong where one names others
    only.
    """
    if not said:
        return "nothing"
    return "right" if all(any(name in one for name in mistake.names) for one in said) else "wrong"


def limits(count: int, total: int, level: float = 0.95) -> tuple[float, float]:
    """Exact confidence limits of a share, after Clopper and Pearson."""
    tail = 0.5 * (1.0 - level)
    lower = beta.ppf(tail, count, total - count + 1) if count else 0.0
    upper = beta.ppf(1.0 - tail, count + 1, total - count) if count < total else 1.0
    return float(lower), float(upper)


@dataclass(frozen=True)
class Rates:
    """Outcomes of all mistakes, and of those above twice the minimal detectable bias."""

    every: Counter[str]
    large: Counter[str]
    failures: tuple[str, ...]

    def lines(self) -> list[str]:
        rows = (
            ("another cause named", self.every, "wrong"),
            ("the right one, above twice the minimal detectable bias", self.large, "right"),
        )
        found = []
        for words, counts, which in rows:
            count, total = counts[which], counts.total()
            lower, upper = limits(count, total)
            found.append(
                f"{words}: {count} of {total}, {100 * count / max(total, 1):.2f} % (95 %:"
                f" {100 * lower:.2f} to {100 * upper:.2f} %)"
            )
        return found


def rates(name: str, is_uncertain: bool, folder: Path, sets: int = 1, first: int = 0) -> Rates:
    """Outcomes of so many data sets of every mistake in a design."""
    given = plan(name, is_uncertain, folder)
    every, large, failures = Counter[str](), Counter[str](), []
    for number, mistake in enumerate(mistakes(given.design)):
        is_large = given.detectable(mistake.change) > 2.0
        for repeat in range(sets):
            said = sentences(given, mistake, 1000 * first + sets * number + repeat + 1)
            word = outcome(mistake, said)
            every[word] += 1
            large[word] += is_large
            if word == "wrong" or (is_large and word != "right"):
                failures.append(f"{mistake.words}: {word}: {said[:1]}")
    return Rates(every, large, tuple(failures))


def main() -> None:
    with TemporaryDirectory() as folder:
        for name, is_uncertain in product(DESIGNS, (False, True)):
            found = rates(name, is_uncertain, Path(folder))
            print(f"{name}, offsets {'uncertain' if is_uncertain else 'exact'}")
            print(*found.lines(), *found.failures, sep="\n  ", flush=True)


if __name__ == "__main__":
    main()
