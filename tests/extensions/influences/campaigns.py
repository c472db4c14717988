"""Simulated campaigns with influence quantities by laws that are written down beside the program,
and how far what is fitted from them is covered.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.design.observations.priors import Priors
from ballplate.simulator.estimation.functions import linear_functions
from ballplate.simulator.estimation.gauss_newton import estimate, linearised_fit
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.readings.simulated import scale_readings
from ballplate.uncertainty.quantities import QUANTITIES
from numpy.typing import NDArray
from scipy.stats import chi2

from tests.reference import dense
from tests.reference.small_quickstart import small_sections

Real = NDArray[np.float64]
TOP = Path(__file__).parents[3]

# What is added to the locations (m, d) of a design's readings, at scale readings x (m, d), by
# parameters e (p,).
Law = Callable[[Design, Real, Any], Any]


def file_with(folder: Path, influences: list[dict[str, Any]] | None, **changed: Any) -> Experiment:
    """The first example with influence quantities, a smaller plate and fewer coefficients."""
    told = small_sections(20, true_machine={"kind": "zero"}, sigma="given")
    told |= {"influences": influences} if influences else {}
    path = folder / "file.yaml"
    path.write_text(yaml.safe_dump(told | changed), encoding="utf-8")
    return load(path)[0]


def plain(design: Design) -> Design:
    """The design without its influence quantities and what is known of them."""
    given = design.of(Priors)
    none = {
        name: value[:0]
        for name, value in vars(given).items()
        if name != "influence" and value is not None
    }
    readings = replace(design.readings, beside=None)
    undisturbed = replace(design, influences=(), readings=readings)
    return undisturbed.observed(replace(given, **none, influence=None))


def nominal_arms(design: Design) -> Real:
    """From the centres of artefacts to the balls read (m, d), turned as the artefacts are."""
    readings, state = design.readings, nominal_state(design)
    return np.asarray(
        np.einsum("mij,mj->mi", state.rotations[readings.position], state.balls[readings.ball])
    )


def dense_spread(design: Design, law: Law, spread: Real) -> tuple[dense.Spread, dense.Problem]:
    """The dense covariance of a design whose last parameters are influences with these prior
    uncertainties, infinite ones of what is unknown.
    """
    of = dense.planned(plain(design), 3, 3)
    count, m = len(spread), design.dimension * len(design.readings)

    def rows(step: Any) -> Any:
        found = dense.residuals(of, step[:-count])
        shift = law(design, of.scales, step[-count:]) / design.machine.repeatability
        found[:m] = found[:m] - shift.ravel()
        return np.concatenate([found, (step[-count:] / spread)[np.isfinite(spread)]])

    return dense.spread(dense.jacobian(rows, of.parameters + count)), of


@dataclass(frozen=True)
class Shares:
    """Share of distances within 1.96 uncertainties, root mean square of their errors in
    uncertainties, and share of fits that would warn of S^2: one in a thousand does by chance.
    """

    within: dict[str, float]
    size: dict[str, float]
    noticed: float

    @property
    def row(self) -> list[float]:
        """As the documentation's tables have it."""
        within, size = self.within, self.size
        shares = [100 * within["U5"], 100 * within["U6"], size["U5"], size["U6"]]
        return [*shares, 100 * self.noticed]


def coverage(design: Design, told: Design, law: Law, spread: Real, count: int) -> Shares:
    """Campaigns of a design with parameters drawn with these uncertainties, certificates that are
    wrong as stated, and noise, fitted as the design `told` has them.
    """
    return shares_of(_campaigns(design, told, law, spread, count))


def _campaigns(
    design: Design, told: Design, law: Law, spread: Real, count: int
) -> Iterator[tuple[Design, Real]]:
    generator = np.random.default_rng(20261122)
    state, readings = nominal_state(design), design.readings
    p = state.probes[readings.probe]
    true = nominal_arms(design) + state.origins[readings.position]
    given = design.of(CalibratedDistances)
    for _ in range(count):
        e = spread * generator.standard_normal(len(spread))
        x = true - p
        for _ in range(6):
            x = scale_readings(design.model, true + law(design, x, e), state.a, p)
        x += design.machine.repeatability * generator.standard_normal(x.shape)
        wrong = given.value + given.uncertainty * generator.standard_normal(len(given))
        yield told.observed(given.given(value=wrong)), x


def shares_of(campaigns: Iterable[tuple[Design, Real]]) -> Shares:
    """What fits cover of campaigns: designs, with what they know, and their scale readings. Nominal
    places are the true ones.
    """
    ratios: dict[str, list[Real]] = {"U5": [], "U6": []}
    noticed = count = 0
    for one, x in campaigns:
        solution = estimate(one, x)
        assert solution.status == "converged"
        at = linearised_fit(one, solution)
        freedom = one.observation_count - one.parameter_count
        noticed += int(solution.factor.sum_of_squares > chi2.isf(0.001, freedom))
        count += 1
        for symbol, errors in ratios.items():
            (functions,) = QUANTITIES[symbol].functions(one, at.layout)
            places = functions.places.at(one, at.state)
            first, second = np.triu_indices(len(places), 1)
            true_places = functions.places.at(one, nominal_state(one))
            lengths, true_lengths = (
                np.linalg.norm(some[first] - some[second], axis=1) for some in (places, true_places)
            )
            uncertainty = at.uncertainty(linear_functions(at, functions))
            errors.append((lengths - true_lengths) / uncertainty)
    both = {symbol: np.array(one) for symbol, one in ratios.items()}
    return Shares(
        {symbol: float((np.abs(one) < 1.96).mean()) for symbol, one in both.items()},
        {symbol: float(np.sqrt((one**2).mean())) for symbol, one in both.items()},
        noticed / count,
    )


def assert_covered(found: Shares, count: int) -> None:
    """Coverage is 95 % and errors are as stated, within what so many campaigns tell."""
    # Distances of one campaign have a scale in common: they are one draw at the worst.
    for symbol in ("U5", "U6"):
        assert abs(found.within[symbol] - 0.95) < 4.0 * np.sqrt(0.95 * 0.05 / count)
        assert abs(found.size[symbol] - 1.0) < 4.0 * np.sqrt(0.5 / count)
    assert found.noticed < 0.001 + 6.0 * np.sqrt(0.001 / count)


def told_on_page(name: str) -> list[float]:
    """The figures of a row of a table of the documentation, after its first cell."""
    pages = (
        TOP / "docs" / page
        for page in ("reference/validation.md", "how-to/influence-quantities.md")
    )
    lines = [line for page in pages for line in page.read_text(encoding="utf-8").splitlines()]
    (line,) = [line for line in lines if line.startswith(f"| {name} |")]
    return [float(cell.split()[0]) for cell in line.split("|")[2:-1]]
