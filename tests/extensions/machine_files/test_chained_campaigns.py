"""From a campaign by way of its map to a second one, its corrected lengths and the certificate of
its plate: intervals cover what they state, however wrong the stated uncertainties are.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.diagnosis.hat import whitened_residuals
from ballplate.extensions.machine_files.sigmas_by_campaign import compared
from ballplate.results.fitting import fit
from ballplate.simulator.design.parameters import shared_layout
from ballplate.simulator.estimation.gauss_newton import moved
from ballplate.simulator.experiment.earlier_campaigns import EarlierCampaign
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.readings.observed_readings import ObservedReadings, observe
from ballplate.simulator.readings.simulated import Simulated, simulated_readings
from scipy import linalg, stats

from tests.extensions.machine_files.kinds import IN_PLANE

# True uncertainties in parts of the stated ones.
FACTORS = (0.3, 0.55, 1.0, 1.35, 1.8, 3.0)
# Coverage probability of k = 2 with many degrees of freedom, and t-factors for the same.
NOMINAL = 2.0 * stats.norm.cdf(2.0) - 1.0
# Scale readings at the ends of three lengths.
ENDS = np.array([[0.05, 0.05], [0.45, 0.06], [0.1, 0.05], [0.1, 0.55], [0.0, 0.1], [0.4, 0.5]])
LENGTHS = [(0, 1), (2, 3), (4, 5)]


def factor_for(freedom: Any) -> Any:
    """Student's factor for the nominal coverage."""
    return stats.t.ppf(0.5 * (1.0 + NOMINAL), freedom)


@dataclass(frozen=True)
class Chain:
    """A campaign with a calibrated plate, and one with another plate in so many `places` of which
    only the map of the first tells lengths.
    """

    folder: Path
    places: int = 3

    def experiment(self, which: int, factor: float = 1.0, **more: Any) -> bp.Experiment:
        """The first or second experiment with other uncertainties."""
        machine = IN_PLANE["machine"] | {"repeatability": f"{0.5 * factor} um"}
        known = IN_PLANE["calibration"][0] | {"standard_uncertainty": f"{0.3 * factor} um"}
        truth = {"kind": "coefficients", "values": {"alpha": "2 urad", "gamma": "-1 ppm"}}
        second = {"positions": IN_PLANE["positions"][: self.places], "calibration": []}
        first = {"machine": machine, "calibration": [known]}
        return bp.experiment(
            {
                **IN_PLANE,
                **first,
                **({} if which == 0 else second),
                "error_model": {"kind": "metric", "scale": "split"},
                "true_machine": truth,
                **more,
            },
            self.folder,
        )

    def readings(self, which: int, factor: float, seed: int) -> Simulated:
        return simulated_readings(self.experiment(which, factor), seed)

    def fits(self, factors: tuple[float, float], seed: int) -> tuple[Any, Any, Simulated]:
        """The fits of both campaigns, and what the second one is of."""
        simulated = [self.readings(k, factors[k], 2 * seed + k) for k in (0, 1)]
        first = self.experiment(0)
        of_first = fit(first, seen(first, simulated[0]))
        bp.write_map(of_first.to_map(), self.folder / "first.yaml")
        second = self.experiment(1, priors=[{"kind": "map", "file": "first.yaml"}])
        return of_first, fit(second, seen(second, simulated[1])), simulated[1]

    def covered(self, factors: tuple[float, float], seed: int) -> list[bool]:
        """Which of the corrected lengths, and of the distances of the second plate's certificate,
        are within t-factors times their uncertainties of the true ones.
        """
        _, found, simulated = self.fits(factors, seed)
        offsets = np.zeros_like(ENDS)
        true = ENDS + simulated.model.error(ENDS, simulated.truth.a, offsets)
        corrected = bp.correct(found.to_map(), ENDS, lengths=LENGTHS)
        scores = [
            (length.value - np.linalg.norm(true[i] - true[j]), length.standard_uncertainty)
            for (i, j), length in zip(LENGTHS, corrected.lengths, strict=True)
        ]
        balls = dict(zip(simulated.design.balls.names, simulated.truth.balls, strict=True))
        certificate = found.certificate()
        for one in certificate.distances:
            first, second = (balls[name] for name in one.balls)
            scores.append((one.length - np.linalg.norm(first - second), one.standard_uncertainty))
        assert certificate.degrees_of_freedom == found.degrees_of_freedom
        k = factor_for(found.degrees_of_freedom)
        return [bool(abs(error) <= k * u) for error, u in scores]


def seen(experiment: bp.Experiment, simulated: Simulated) -> ObservedReadings:
    """Readings as those of an experiment that states its own uncertainties."""
    return observe(lay_out(experiment), simulated.readings, simulated.x)


class Linear:
    """The same chain to first order, by dense algebra: the map is what the first campaign tells of
    the machine, and functions are the corrected lengths and the distances of the second plate.
    """

    def __init__(self, chain: Chain) -> None:
        first, self.first_freedom = dense(chain.experiment(0))
        self.rows, self.own_freedom = dense(chain.experiment(1))
        design = lay_out(chain.experiment(1))
        model, shared = shared_layout(design).model, len(shared_layout(design))
        scale = shared_layout(design).scale[model]
        own = shared_layout(lay_out(chain.experiment(0))).model
        known = np.linalg.pinv(first.T @ first)[own, own]
        self.known = np.linalg.inv(known / np.outer(scale, scale))
        self.rows[:, model] *= scale
        self.model = model
        prior = np.zeros((self.rows.shape[1],) * 2)
        prior[model, model] = self.known
        self.prior = prior
        jacobian = design.model.jacobian(ENDS, np.zeros(len(scale)), np.zeros_like(ENDS)) * scale
        functions = []
        for i, j in LENGTHS:
            row = np.zeros(self.rows.shape[1])
            unit = (ENDS[i] - ENDS[j]) / np.linalg.norm(ENDS[i] - ENDS[j])
            row[model] = unit @ (jacobian[i] - jacobian[j])
            functions.append(row)
        places = design.balls.places
        for i, j in zip(*np.triu_indices(len(places), 1), strict=True):
            row = np.zeros(self.rows.shape[1])
            unit = (places[i] - places[j]) / np.linalg.norm(places[i] - places[j])
            row[shared + 2 * i : shared + 2 * i + 2] = unit
            row[shared + 2 * j : shared + 2 * j + 2] = -unit
            functions.append(row)
        self.functions = np.array(functions)

    @cached_property
    def common_axes(self) -> tuple[np.ndarray, np.ndarray]:
        """Axes in which the information of the map and of the readings is diagonal together, and
        the map's share of it.
        """
        own = self.rows.T @ self.rows
        share, axes = linalg.eigh(self.prior, own + self.prior)
        return np.clip(share, 0.0, 1.0), axes

    def uncertainties(self, ratio: float) -> np.ndarray:
        """Standard uncertainties of the functions, where sigma of the readings is 1 and that of the
        map is so many times that.
        """
        share, axes = self.common_axes
        return np.linalg.norm(
            self.functions @ axes / np.sqrt(share / ratio**2 + 1.0 - share), axis=1
        )

    def coverage(self, factors: tuple[float, float], count: int) -> tuple[np.ndarray, float]:
        """Shares (count,) of functions covered in simulated chains, and how often sigmas are kept
        apart.
        """
        generator = np.random.default_rng(11)
        share, axes = self.common_axes
        root = np.linalg.cholesky(np.linalg.inv(self.known))
        of_map = factors[0] * generator.normal(size=(count, len(root))) @ root.T
        noise = factors[1] * generator.normal(size=(count, len(self.rows)))
        squares = factors[0] ** 2 * generator.chisquare(self.first_freedom, count)
        basis, sizes, _ = np.linalg.svd(self.rows, full_matrices=False)
        in_range = noise @ basis[:, sizes > 1e-9 * sizes[0]]
        own = np.sqrt(((noise**2).sum(1) - (in_range**2).sum(1)) / self.own_freedom)
        campaigns = (
            EarlierCampaign("", 1.0, self.first_freedom, one, True) for one in squares.tolist()
        )
        pairs = zip(campaigns, own.tolist(), strict=True)
        common = np.array([compared(*pair, self.own_freedom).is_common for pair in pairs])
        ratio = np.where(common, 1.0, np.sqrt(squares / self.first_freedom) / own)[:, None]
        by_map = of_map @ self.known @ axes[self.model]
        by_readings = noise @ self.rows @ axes
        variances = 1.0 / (share / ratio**2 + 1.0 - share)
        found = variances * (by_map / ratio**2 + by_readings)
        joint = squares + (noise**2).sum(1) - (found * (by_map + by_readings)).sum(1)
        joint += ((of_map @ self.known) * of_map).sum(1)
        freedom = self.first_freedom + self.own_freedom + self.shared_freedom
        sigma = np.where(common, np.sqrt(joint / freedom), own)
        fewest = np.where(common, freedom, min(self.first_freedom, self.own_freedom))
        weights = self.functions @ axes
        u = sigma[:, None] * np.sqrt(variances @ (weights**2).T)
        within = np.abs(found @ weights.T) <= factor_for(fewest)[:, None] * u
        return within.mean(axis=1), float(1.0 - common.mean())

    @property
    def shared_freedom(self) -> int:
        """How many combinations of parameters map and readings both determine."""
        together = np.linalg.matrix_rank(self.rows.T @ self.rows + self.prior)
        return int(np.linalg.matrix_rank(self.rows) + len(self.known) - together)


@pytest.mark.parametrize(
    ("squares", "freedom", "sigma"), [(None, 5, 1.3), (0.0, 0, 1.3), (45.0, 5, 3.0)]
)
def test_sigma_of_an_earlier_campaign_is_the_stated_one_without_residuals(
    squares: float | None, freedom: int, sigma: float
) -> None:
    assert EarlierCampaign("", 1.3, freedom, squares).estimate == pytest.approx(sigma)


def dense(experiment: bp.Experiment) -> tuple[np.ndarray, int]:
    """Derivatives of all whitened residuals at the design as drawn by shared parameters and balls,
    by differences, and degrees of freedom; the machine's parameters in their own units.
    """
    simulated = simulated_readings(experiment, exact=True)
    design, state, x = simulated.design, simulated.truth, simulated.x
    layout, balls = shared_layout(design), design.balls.places
    columns = []
    for k in range(len(layout) + balls.size):
        step = np.zeros(len(layout) + balls.size)
        step[k] = 1e-6
        ends = [
            whitened_residuals(
                design,
                moved(
                    state,
                    layout,
                    sign * step[: len(layout)],
                    sign * step[len(layout) :].reshape(balls.shape),
                ),
                x,
            )
            for sign in (1.0, -1.0)
        ]
        columns.append((ends[0] - ends[1]) / 2e-6)
    rows = np.array(columns).T
    return rows, len(rows) - int(np.linalg.matrix_rank(rows, tol=1e-6 * np.abs(rows).max()))


def limits(shares: np.ndarray) -> tuple[float, float]:
    """Confidence limits of a mean over chains, at four standard errors."""
    error = 4.0 * float(shares.std(ddof=1)) / np.sqrt(len(shares))
    return float(shares.mean()) - error, float(shares.mean()) + error


@pytest.mark.parametrize("factors", [(1.0, 1.0), (1.0, 3.0), (3.0, 1.0)])
def test_the_linear_chain_is_that_of_full_fits(
    factors: tuple[float, float], tmp_path: Path
) -> None:
    chain = Chain(tmp_path)
    linear = Linear(chain)
    _, found, _ = chain.fits(factors, 1)
    (ratio,) = found.campaigns.ratios.values()
    is_common = factors[0] == factors[1]
    assert found.campaigns.maps[0].is_common == is_common
    # Four balls in a plane have five distances that do not follow from others.
    first_freedom = linear.first_freedom - 1
    freedom = min(first_freedom, linear.own_freedom)
    if is_common:
        freedom = first_freedom + linear.own_freedom + linear.shared_freedom
    assert found.degrees_of_freedom == freedom
    lengths = bp.correct(found.to_map(), ENDS, lengths=LENGTHS).lengths
    both = (*lengths, *found.certificate().distances)
    u = np.array([one.standard_uncertainty for one in both])
    assert u == pytest.approx(found.sigma * linear.uncertainties(ratio), rel=1e-4)


def test_intervals_cover_whatever_uncertainties_were_stated(tmp_path: Path) -> None:
    linear = Linear(Chain(tmp_path))
    for factors in product((0.3, 1.0, 3.0), repeat=2):
        shares, apart = linear.coverage(factors, 1000)
        low, high = limits(shares)
        assert low <= NOMINAL <= high, factors
        assert apart > 0.99 if factors[0] != factors[1] else 0.2 < apart < 0.3


def test_a_few_full_chains_cover_what_they_state(tmp_path: Path) -> None:
    """With uncertainties stated three times too large, scale by the map is known to a third."""
    chain = Chain(tmp_path)
    shares = np.array([chain.covered((1.0 / 3.0,) * 2, seed) for seed in range(10)])
    # Distances within the plate depend on its own readings more than on the map.
    assert shares[:, : len(LENGTHS)].mean() > 0.8
    assert shares.mean() > 0.85


@pytest.mark.long
@pytest.mark.parametrize("places", [3, 2])
def test_coverage_of_linear_chains(places: int, tmp_path: Path) -> None:
    """Sigmas that differ by less than an F-test detects cost at most two hundredths of coverage with
    eleven degrees of freedom, and one with twenty-four.
    """
    linear = Linear(Chain(tmp_path, places))
    for factors in product(FACTORS, repeat=2):
        shares, apart = linear.coverage(factors, 20000)
        low, high = limits(shares)
        print(
            f"{linear.first_freedom} and {linear.own_freedom} degrees of freedom, true/stated"
            f" {factors}: {len(shares)} chains, covered {shares.mean():.4f} ({low:.4f} to"
            f" {high:.4f}), nominal {NOMINAL:.4f}, separate sigmas {apart:.3f}"
        )
        assert high > NOMINAL - (0.01 if places == 3 else 0.02)
        assert low < NOMINAL + 0.01


@pytest.mark.long
@pytest.mark.parametrize("factors", [(0.3, 0.3), (3.0, 3.0), (1.0, 1.0), (0.3, 3.0), (3.0, 0.3)])
def test_coverage_of_full_chains(factors: tuple[float, float], tmp_path: Path) -> None:
    chain = Chain(tmp_path)
    shares = np.array([np.mean(chain.covered(factors, seed)) for seed in range(150)])
    low, high = limits(shares)
    print(
        f"true/stated {factors}: {len(shares)} chains of full fits, covered {shares.mean():.4f}"
        f" ({low:.4f} to {high:.4f}), nominal {NOMINAL:.4f}"
    )
    assert low <= NOMINAL <= high
