"""Two campaigns on the same machine: the difference of what they find, against its uncertainty.

At places in the volume the corrected points of two estimates are compared after the rigid motion
between them has been taken out, as mrcal compares two calibrations of a camera. Errors of
certificates that both use are in common, and what they do to both alike is no part of the
difference's uncertainty.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from ballplate.extensions.maps.campaign_tests import (
    TOO_ALIKE,
    TOO_RARE,
    EstimatedSigma,
    Roots,
    SigmaPair,
    joint_difference,
    with_common,
)
from ballplate.extensions.maps.same_readings import read_once_words, same_positions, same_readings
from ballplate.extensions.reliability.hat import hat_rows, row_count, row_places
from ballplate.presentation.formatting import aligned, as_data, number, picked
from ballplate.presentation.result import FitResult
from ballplate.results.campaign_sigmas import campaign_sigmas
from ballplate.simulator.computing.threads import single_threaded
from ballplate.simulator.design.observations.readings import rotation_sensitivity
from ballplate.simulator.estimation.corrections import corrected_points, correction_rows
from ballplate.simulator.estimation.gauss_newton import estimate, linearised_fit
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.messages import refused
from ballplate.simulator.machines.protocol import Array
from ballplate.simulator.readings.observed_readings import ObservedReadings

from .lack_of_fit import chance_words
from .left_out import MOST_POINTS
from .left_out_result import FAILED

# Share of the largest singular value below which a direction is rounding.
FLAT = 1e-8


@dataclass(frozen=True, repr=False)
class CrossValidation(FitResult):
    """Two campaigns compared at `places` (n, d): the `differences` (n, d) of their corrected
    points, the rigid motion taken out, and `uncertainties` (n, d), in metres.

    `sum_of_squares` of the differences, weighted with their covariance, has `dimensions`, and
    `chance` is that of one so large. `lengths` are the largest difference of a length between two
    places, and its standard uncertainty. `common` tells whether both had the same certificates,
    and `read_once` names positions whose readings are the same in both;
    `is_too_alike` tells that two independent campaigns are hardly ever so much alike.
    """

    label: str
    title: str
    observed: ObservedReadings
    places: Array
    differences: Array
    uncertainties: Array
    sum_of_squares: float
    dimensions: int
    chance: float
    lengths: tuple[float, float]
    sigmas: tuple[float, float]
    coverage_factor: float
    common: bool = True
    read_once: tuple[str, ...] = ()
    is_too_alike: bool = False

    @property
    def cautions(self) -> tuple[str, ...]:
        if self.read_once:
            return (read_once_words(self.read_once),)
        return (TOO_ALIKE,) if self.is_too_alike else ()

    @property
    def complaint(self) -> str:
        if self.chance < FAILED:
            return (
                "the two campaigns differ by more than their uncertainties explain: the machine has"
                " changed, or the error model is too poor for both"
            )
        if self.read_once:
            return (
                "readings in common may hide that the campaigns differ; compare what was read anew"
                " alone"
            )
        return ""

    def headline(self) -> str:
        size = f"{1e6 * self._rms(self.differences):.3g} µm rms"
        if self.chance >= FAILED and self.read_once:
            return f"the campaigns have readings in common, which may hide a difference, {size}"
        return f"the campaigns {'differ' if self.chance < FAILED else 'agree'}, {size}"

    @staticmethod
    def _rms(values: Array) -> float:
        return float(np.sqrt((values**2).sum(axis=1).mean()))

    def _standardised(self) -> Array:
        u = np.where(self.uncertainties > 0.0, self.uncertainties, np.inf)
        return np.asarray(np.abs(self.differences) / u)

    def lines(self) -> list[str]:
        k, worst = self.coverage_factor, self._standardised()
        place, axis = np.unravel_index(int(worst.argmax()), worst.shape)
        where = ", ".join(f"{1e3 * value:.4g}" for value in self.places[place])
        size = np.linalg.norm(self.differences, axis=1)
        rows = [
            ["corrected points, the rigid motion taken out", "difference, µm", "u, µm"],
            [
                "root mean square",
                number(1e6 * self._rms(self.differences), 3),
                number(1e6 * self._rms(self.uncertainties), 3),
            ],
            [
                "largest",
                number(1e6 * size.max(), 3),
                number(1e6 * float(np.linalg.norm(self.uncertainties[int(size.argmax())])), 3),
            ],
            [
                f"largest in its u, {worst.max():.2f} times: {'xyz'[axis]} at ({where}) mm",
                number(1e6 * abs(self.differences[place, axis]), 3),
                number(1e6 * self.uncertainties[place, axis], 3),
            ],
            [
                "largest of a length",
                number(1e6 * abs(self.lengths[0]), 3),
                number(1e6 * self.lengths[1], 3),
            ],
        ]
        return [
            f"{self.label}: {self.title}",
            (
                f"two campaigns at {len(self.places)} places; sigma {self.sigmas[0]:.3g} and"
                f" {self.sigmas[1]:.3g}; u of the difference"
                f"{' without what certificates do to both' if self.common else ''}; compare"
                f" differences with {k:g} u"
            ),
            "",
            *aligned(rows, [False, True, True]),
            (
                f"{self.headline()}: S^2 = {self.sum_of_squares:.4g} of {self.dimensions}"
                f" independent differences, chance {chance_words(self.chance)}"
            ),
        ]

    def to_dict(self) -> dict[str, Any]:
        return {
            "experiment": self.label,
            **picked(self, "title", "sum_of_squares", "dimensions", "chance"),
            "sigmas": list(self.sigmas),
            "largest_length_difference": {
                "value": self.lengths[0],
                "standard_uncertainty": self.lengths[1],
                "unit": "m",
            },
            "places": as_data(self.rows()),
            **self.said(),
        }

    def rows(self) -> list[dict[str, Any]]:
        """One row for each place."""
        letters = "xyz"[: self.places.shape[1]]
        found = []
        for place, change, u in zip(self.places, self.differences, self.uncertainties, strict=True):
            row: dict[str, Any] = dict(zip(letters, place.tolist(), strict=True))
            row |= {f"difference {a}": v for a, v in zip(letters, change.tolist(), strict=True)}
            row |= {f"u {a}": v for a, v in zip(letters, u.tolist(), strict=True)}
            found.append(row | {"unit": "m"})
        return found


@single_threaded
def cross_validate(
    experiment: Experiment,
    first: ObservedReadings,
    second: ObservedReadings,
    sigma: Literal["estimated", "given"] | None = None,
    common: bool = True,
) -> CrossValidation:
    """Compare the estimates from the readings of two campaigns by the same file.

    Errors of its certificates are in `common`, unless the plates were others.

    :raises ExperimentError: one of them does not converge, both are the same readings, or nothing
        can be compared.
    """
    if same_readings(first, second) == "same":
        text = "both campaigns have the same readings, which agree with themselves; name others"
        raise refused(experiment.source, text)
    given = (sigma or experiment.sigma) == "given"
    fits = [_fitted(experiment, one, given) for one in (first, second)]
    (one, scale_1), (two, scale_2) = fits
    design = one.design
    places = design.evaluation.points[:MOST_POINTS]
    probes = np.full(len(places), design.evaluation.probe)
    change = (
        corrected_points(two.design, two.state, places, probes)
        - corrected_points(design, one.state, places, probes)
    ).ravel()
    rows = [
        correction_rows(at.design, at.layout, at.state, places, probes).reshape(len(change), -1)
        for at, _ in fits
    ]
    scatters = _scatter(one, scale_1, given), _scatter(two, scale_2, given)
    roots, alone = _roots(fits, (first.x, second.x), rows, common, scatters)
    # Motions, and what the readings leave open, are no difference.
    free = [
        _motions(places),
        *(own @ at.shared_null for own, (at, _) in zip(rows, fits, strict=True)),
    ]
    free_of = _complement(np.concatenate(free, axis=1))
    change, alone = free_of @ change, free_of @ alone
    roots = free_of @ roots[0], free_of @ roots[1]
    root = np.hstack(roots)
    test = joint_difference(change, roots, scatters, alone)
    if test is None:
        raise refused(experiment.source, "the readings leave nothing to compare")
    shape = places.shape
    return CrossValidation(
        experiment.label,
        experiment.title,
        first,
        places,
        change.reshape(shape),
        np.sqrt((root**2).sum(axis=1)).reshape(shape),
        test.statistic,
        test.dimensions,
        test.p,
        _largest_length(places, change, root),
        (scale_1, scale_2),
        2.0 if experiment.coverage_factor == 1.0 else experiment.coverage_factor,
        common,
        same_positions(first, second),
        test.statistic > 0.0 and 1.0 - test.p < TOO_RARE,
    )


def _fitted(
    experiment: Experiment, observed: ObservedReadings, given: bool
) -> tuple[Linearisation, float]:
    campaigns = None if given else campaign_sigmas(experiment, observed)
    observed = observed if campaigns is None else campaigns.observed
    solution = estimate(observed.design, observed.x)
    if solution.status != "converged":
        text = f"the estimate from one campaign's readings has {solution.status}; see ballplate fit"
        raise refused(experiment.source, text)
    at = linearised_fit(observed.design, solution)
    freedom = at.degrees_of_freedom
    is_estimated = not given and freedom > 0
    left = solution.factor.sum_of_squares / max(freedom, 1)
    return at, float(np.sqrt(left)) if is_estimated else 1.0


def _scatter(at: Linearisation, scale: float, given: bool) -> EstimatedSigma:
    freedom = at.degrees_of_freedom
    return EstimatedSigma(scale, np.inf if given or freedom <= 0 else freedom)


def _roots(
    fits: list[tuple[Linearisation, float]],
    x: tuple[Array, Array],
    rows: list[Array],
    have_common: bool,
    scatters: SigmaPair,
) -> tuple[Roots, Array]:
    """Square roots (m, k) of both campaigns' parts of the covariance of differences of functions
    with derivatives `rows`, and of what it would be with nothing in common.

    Each estimate follows its observations by the root of the hat matrix. Certificates of plates are
    the same observations in both if they `have_common` ones.
    """
    parts: list[Array] = []
    common: list[Array] = []
    for (at, scale), own_x, derivative in zip(fits, x, rows, strict=True):
        follows = np.zeros((len(derivative), row_count(at.design)))
        function = derivative @ at.shared
        for some in hat_rows(at, own_x):
            follows[:, some.rows] = function @ some.common[:, : function.shape[1]].T
        is_common = np.zeros(follows.shape[1], bool)
        for one in at.design.observations:
            if have_common and one.balls.shape[1]:
                is_common[row_places(at.design)[one.word]] = True
        parts.append(scale * follows[:, ~is_common])
        common.append(follows[:, is_common])
    scaled = [at[1] * own for at, own in zip(fits, common, strict=True)]
    alone = np.hstack([*parts, *scaled])
    return with_common((parts[0], parts[1]), common[1] - common[0], scatters), alone


def _motions(places: Array) -> Array:
    """Displacements (n d, q) of places (n, d) by small rigid motions."""
    n, d = places.shape
    turns = rotation_sensitivity(places - places.mean(axis=0))
    shifts = np.broadcast_to(np.eye(d), (n, d, d))
    return np.concatenate([shifts, turns], axis=2).reshape(n * d, -1)


def _complement(columns: Array) -> Array:
    """The projection (m, m) that takes out what columns (m, k) span."""
    size = np.linalg.norm(columns, axis=0)
    used = size > 0.0
    u, values, _ = np.linalg.svd(columns[:, used] / size[used], full_matrices=False)
    u = u[:, values > FLAT]
    return np.asarray(np.eye(len(columns)) - u @ u.T)


def _largest_length(places: Array, change: Array, root: Array) -> tuple[float, float]:
    """The largest difference of a length between places, and its standard uncertainty."""
    first, second = np.triu_indices(len(places), 1)
    unit = places[first] - places[second]
    unit /= np.maximum(np.linalg.norm(unit, axis=1), np.finfo(float).tiny)[:, None]
    moved = change.reshape(places.shape)
    of_lengths = np.einsum("md,md->m", unit, moved[first] - moved[second])
    k = int(np.abs(of_lengths).argmax())
    roots = root.reshape(*places.shape, -1)
    own = unit[k] @ (roots[first[k]] - roots[second[k]])
    return float(of_lengths[k]), float(np.sqrt((own**2).sum()))
