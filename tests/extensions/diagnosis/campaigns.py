"""Simulated campaigns that contradict one assumption of their experiment, and what the fit says.

Run as `python -m tests.extensions.diagnosis.campaigns` it prints the rates with their confidence
limits.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from ballplate.extensions.diagnosis.bias_patterns import LinearisedDesign
from ballplate.extensions.diagnosis.cause_search import Search
from ballplate.extensions.diagnosis.score_tests import LEVEL, tested
from ballplate.extensions.diagnosis.smooth import rows_of
from ballplate.results.fitting import fit
from ballplate.simulator.estimation.gauss_newton import estimate, linearised_fit
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.machines.arrangement import ARRANGEMENTS
from ballplate.simulator.readings.observed_readings import ObservedReadings, observe
from ballplate.simulator.readings.simulated import simulated_readings
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.stats import f as fisher
from scipy.stats import ncf

from tests.extensions.diagnosis.designs import PLATE, experiment
from tests.extensions.diagnosis.offsets import OBLIQUE, limits

Real = NDArray[np.float64]

QUICKSTART = Path("designs/quickstart.yaml").read_text(encoding="utf-8")

CAUSES = ("chain", "tip", "certificate", "temperature", "none")

# Relative expansion of steel by 0.3 K.
COLD = 0.3 * 11.5e-6


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


DESIGNS = {
    "quickstart": with_bar(QUICKSTART, "down"),
    "few balls": with_bar(PLATE, "down"),
    "three probes in each position": with_bar(OBLIQUE, "a"),
}


@dataclass(frozen=True)
class Campaign:
    """Readings with one cause, whose `name` is in the words of what names it; `displacement`
    (readings, d) is what it adds to them.
    """

    observed: ObservedReadings
    name: str
    displacement: Real


def campaigns(given: Experiment, cause: str, count: int, seed: int) -> Iterator[Campaign]:
    """So many campaigns with a cause of random size."""
    generator = np.random.default_rng(seed)
    plain = lay_out(given)
    arrangement = given.error_model.arrangement
    chains = [name for name in ARRANGEMENTS if ARRANGEMENTS[name] != ARRANGEMENTS[arrangement]]
    plate = plain.artefacts.names.index("plate")
    positions = np.flatnonzero(plain.positions.artefact == plate)
    for number in range(count):
        machine_seed = int(generator.integers(1 << 31))
        machine = {"kind": "random", "position": "2 um", "rotation": "4 urad", "seed": machine_seed}
        changes: dict[str, object] = {"true_machine": machine}
        name = ""
        if cause == "chain":
            name = chains[number % len(chains)]
            changes["error_model.arrangement"] = name
        simulated = simulated_readings(given.with_(changes), machine_seed)
        readings = simulated.readings
        sign = float(generator.choice([-1.0, 1.0]))
        added = np.zeros_like(simulated.x)
        if cause == "chain":
            offsets = plain.probes.offsets[readings.probe]
            added = offsets - simulated.model.error(simulated.x, simulated.truth.a, offsets)
        elif cause == "tip":
            probe = int(generator.choice(np.unique(readings.probe)))
            axis, size = generator.integers(3), 10.0 ** generator.uniform(-6.3, -5.0)
            added[readings.probe == probe, axis] = sign * size
            name = f"offset of probe {plain.probes.names[probe]}"
        elif cause in ("certificate", "temperature"):
            chosen = positions
            size, name = 10.0 ** generator.uniform(-6.0, -5.0), "scale of the certificate of plate"
            if cause == "temperature":
                chosen, size = generator.choice(positions, 1), COLD
                name = f"size of plate in position {plain.positions.names[chosen[0]]}"
            arms = plain.balls.places[readings.ball]
            turned = np.einsum("mij,mj->mi", plain.positions.rotations[readings.position], arms)
            added[:] = sign * size * turned
            added[~np.isin(readings.position, chosen)] = 0.0
        x = simulated.x if cause == "chain" else simulated.x + added
        yield Campaign(observe(plain, readings, x), name, added)


def visible(given: Experiment, campaign: Campaign) -> float:
    """How far a cause moves the residuals, relative to what its test notices with 80 %."""
    plain = lay_out(given)
    design = replace(plain, readings=campaign.observed.design.readings)
    x = campaign.observed.x
    solution = estimate(design, x)
    at = linearised_fit(design, solution)
    freedom = at.degrees_of_freedom
    search = Search(at, x, freedom, True)
    every = [each for each in tested(search) if each.dimensions]
    named = [each for each in every if campaign.name in each.cause.words]
    if not named:
        return 0.0
    linearised = LinearisedDesign(design, solution.state, None)
    rows = rows_of(linearised, campaign.displacement[:, :, None])
    q = named[0].dimensions
    chance = LEVEL / len(every)
    threshold = fisher.isf(chance, q, freedom - q)

    def missed(square: float) -> float:
        return float(ncf.sf(threshold, q, freedom - q, square)) - 0.8

    return float(np.linalg.norm(search.start.of(rows)) / np.sqrt(brentq(missed, 1e-3, 1e5)))


@dataclass
class Rates:
    """Outcomes of campaigns: of all, and of those with a cause above twice what is noticed."""

    every: Counter[str] = field(default_factory=Counter)
    large: Counter[str] = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)

    def lines(self) -> list[str]:
        rows = (
            ("another cause", self.every["wrong"], self.every.total()),
            ("the right one, above twice what is noticed", self.large["right"], self.large.total()),
        )
        found = []
        for words, count, total in rows:
            lower, upper = limits(count, max(total, 1))
            share = f"{100 * count / max(total, 1):.2f} %"
            found.append(
                f"{words}: {count} of {total}, {share} ({100 * lower:.2f} to {100 * upper:.2f} %)"
            )
        return found


def outcome(given: Experiment, campaign: Campaign) -> tuple[str, list[str]]:
    """Right if every cause that the fit names may be the true one, wrong if one may not."""
    found = fit(given, campaign.observed)
    if found.assumptions is not None:
        said = list(found.assumptions.verdict)
    else:
        # A fit with other offsets has been named already, which may be one of several.
        assert found.diagnosis and found.diagnosis.refit
        said = [", or ".join(found.diagnosis.refit.causes)]
    if not said:
        return "nothing", said
    name = campaign.name or "no cause"
    return ("right" if all(name in words for words in said) else "wrong"), said


def rates(given: Experiment, cause: str, count: int, seed: int = 1) -> Rates:
    """Outcomes of so many campaigns with a cause."""
    found = Rates()
    for campaign in campaigns(given, cause, count, seed):
        word, said = outcome(given, campaign)
        size = visible(given, campaign) if campaign.name else 0.0
        found.every[word] += 1
        found.large[word] += size > 2.0
        if word == "wrong" or (size > 2.0 and word != "right"):
            found.failures.append(f"{campaign.name} ({size:.2f}): {word}: {said}")
    return found


def main() -> None:
    with TemporaryDirectory() as folder:
        for design, text in DESIGNS.items():
            given = experiment(Path(folder), text)
            for cause in CAUSES:
                found = rates(given, cause, 100)
                print(f"{design}, {cause}", *found.lines(), *found.failures, sep="\n  ", flush=True)


if __name__ == "__main__":
    main()
