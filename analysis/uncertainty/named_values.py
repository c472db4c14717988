"""Standard uncertainties of values with names: lengths of measuring tasks, dimensions of parts."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from ballplate.simulator.computing.numerics import blank, symmetric_root
from ballplate.simulator.estimation.functions import Combinations, Displacements, Distances
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.machines.protocol import Unit

from .pairs import COVERAGE, pairs_of

# Draws of the members of a value that is not linear, and fractions of its error that are kept.
DRAWS = 10_000
FRACTIONS = (0.025, 0.05, 0.95, 0.975)


@dataclass(frozen=True)
class NamedUncertainty:
    """A named value: its nominal `length`, which may be an angle, standard uncertainty and target,
    in its `unit`.

    The standard uncertainty is NaN if undetermined; `target`, if any, is compared with
    `coverage_factor` times the standard uncertainty. `outside` is the standard uncertainty by what
    no estimate reduces, and `share` that of the estimate in the variance. A value that is not
    linear has a mean error, the `shift`, and `quantiles` of its error at the `FRACTIONS`: at its
    nominal size and at the other ones of its function.
    """

    name: str
    length: float
    standard_uncertainty: float
    target: float | None = None
    coverage_factor: float = 1.0
    unit: Unit = "m"
    outside: float = 0.0
    share: float = 1.0
    shift: float = 0.0
    quantiles: tuple[tuple[float, ...], ...] = ()

    @property
    def expanded_uncertainty(self) -> float:
        """Expanded uncertainty with the target's coverage factor, or 2 if that is 1; of a value
        that is not linear, the larger end of the interval of 95 % of its errors.
        """
        if self.quantiles:
            return max(map(abs, self.quantiles[0]))
        return self.expansion * self.standard_uncertainty

    @property
    def expansion(self) -> float:
        """Coverage factor of the expanded uncertainty."""
        return expansion(self.coverage_factor)

    @property
    def share_of_target(self) -> float:
        """The uncertainty as a share of the target; NaN if either is missing."""
        compared = self.coverage_factor * self.standard_uncertainty
        compared = self.expanded_uncertainty if self.quantiles else compared
        return math.nan if self.target is None else compared / self.target

    @property
    def is_within(self) -> bool | None:
        """Whether the uncertainty is within its target; None without target."""
        return None if self.target is None else self.share_of_target <= 1.0


def expansion(coverage_factor: float) -> float:
    """Return the coverage factor of printed expanded uncertainties: the target's, or 2 if that is
    1.
    """
    return coverage_factor if coverage_factor > 1.0 else COVERAGE


def named_values(
    functions: Distances | Combinations, moved: Displacements, sigma: float
) -> tuple[NamedUncertainty, ...]:
    """Return the uncertainties of values with names, from the displacements of their places.

    `sigma` multiplies all stated uncertainties of the estimate.
    """
    if isinstance(functions, Combinations):
        return combined_uncertainties(functions, sigma * member_root(functions, moved))
    return _between(functions, moved, sigma)


def _between(
    distances: Distances, moved: Displacements, sigma: float
) -> tuple[NamedUncertainty, ...]:
    assert distances.pairs is not None
    tile = pairs_of(moved, distances.pairs)
    values = sigma * np.where(tile.is_open, np.nan, tile.uncertainties)
    targets = distances.targets or (None,) * len(distances.names)
    rows = zip(distances.names, tile.lengths.tolist(), values.tolist(), targets, strict=True)
    return tuple(
        NamedUncertainty(name, length, value)
        if target is None
        else NamedUncertainty(
            name, length, value, float(target.stated.at(length)), target.coverage_factor
        )
        for name, length, value, target in rows
    )


def member_root(combinations: Combinations, moved: Displacements) -> Array:
    """Return a square root (k, r) of the covariance of all members by the estimate, from that of
    their places; NaN where undetermined.
    """
    weights, flat = combinations.weights, moved.places.size
    root = np.asarray(weights @ moved.common.reshape(flat, -1))
    change = np.asarray(weights @ moved.null.reshape(flat, -1))
    root[np.isnan(blank(np.zeros(len(root)), change, abs(weights) @ moved.size.ravel()))] = np.nan
    return root


def combined_uncertainties(combinations: Combinations, root: Array) -> tuple[NamedUncertainty, ...]:
    """Return the uncertainties of all values, from a square root (k, r) of the covariance of their
    members by the estimate; undetermined ones are NaN.
    """
    values = []
    for i, of_members in enumerate(combinations.of_members):
        members = combinations.members(i)
        outside = combinations.outside[members].toarray()
        by_estimate, fixed = root[members] @ root[members].T, outside @ outside.T
        target = combinations.targets[i]
        value = NamedUncertainty(
            combinations.names[i],
            float(combinations.sizes[i]),
            math.sqrt((by_estimate + fixed)[0, 0]),
            None if target is None else float(target.stated.at(float(combinations.sizes[i]))),
            1.0 if target is None else target.coverage_factor,
            combinations.units[i],
            math.sqrt(fixed[0, 0]),
            float(np.trace(by_estimate) / (np.trace(by_estimate + fixed) or 1.0)),
        )
        if of_members is not None and not math.isnan(value.share):
            value = _drawn(value, of_members(_draws(by_estimate + fixed)))
            only = of_members(_draws(fixed))[:, 0]
            value = replace(value, outside=float(only.std()))
        values.append(value)
    return tuple(values)


def _draws(covariance: Array) -> Array:
    """Return draws (b, m) by a covariance (m, m)."""
    # The same numbers for each value, whatever others there are.
    generator = np.random.default_rng(np.random.SeedSequence(0))
    normal = generator.standard_normal((DRAWS, len(covariance)))
    return np.asarray(normal @ symmetric_root(covariance))


def _drawn(value: NamedUncertainty, errors: Array) -> NamedUncertainty:
    quantiles = np.quantile(errors, FRACTIONS, axis=0).T
    return replace(
        value,
        standard_uncertainty=float(errors[:, 0].std()),
        shift=float(errors[:, 0].mean()),
        quantiles=tuple(tuple(row) for row in quantiles.tolist()),
    )
