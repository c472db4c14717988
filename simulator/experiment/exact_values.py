"""Check of certified values that are stated as exact: whether any balls have them all."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..computing.decompositions import svd
from ..computing.rounding import comparable
from ..design.lookup import References
from ..design.observations.balls import BallObservations
from ..design.observations.calibration import Calibration
from ..design.observations.coordinates import CoordinateCalibration
from ..design.observations.distances import DistanceCalibration
from ..design.observations.stated_values import value_name
from ..geometry.ball_layouts import BallLayout
from ..inputs.settings import listing
from ..machines.protocol import Array, Integers

# Values that balls meet within this, in metres, or in parts of the largest if that is longer, agree
# but for the rounding of the computation.
AGREE = 1e-11

# Places (m, per length of the artefact) that the search begins at: the drawing, and about it, since
# balls in a line or a plane are in another shape only if they are off these.
STARTS = (0.0, 1e-4, 1e-4, 1e-3, 1e-3, 1e-2, 1e-2)

STEPS = 50

# A value whose misfit is less than this share of the largest is none of those that contradict.
SHARE = 1e-3

# Singular values below this share of the largest are those of motions.
KNOWN = 1e-10

# Binary digits in which values have to agree that are as doubtful as one another: their misfits may
# be little above rounding.
DIGITS = 10

# Entries of the matrix of values and co-ordinates, with which the search takes seconds at the most;
# more values are left to the fit.
MOST_ENTRIES = 200_000


@dataclass(frozen=True)
class _Exact:
    """Exact values (m,) of an artefact, each with its item and its name."""

    parts: tuple[tuple[BallObservations, Integers], ...]
    item: tuple[int, ...]
    name: tuple[str, ...]

    @cached_property
    def balls(self) -> Integers:
        """The balls (k,) that they are of."""
        return np.unique(np.concatenate([one.balls[at].ravel() for one, at in self.parts]))

    @cached_property
    def rounding(self) -> float:
        """Largest misfit that rounding explains, in metres."""
        return AGREE * max(1.0, *(float(np.abs(one.value).max()) for one, _ in self.parts))

    def misfit(self, balls: Array) -> tuple[Array, Array]:
        """Values less those stated (m,) at `balls` (n, d), and their derivatives (m, k, d)."""
        misfits, rows = [], []
        for values, chosen in self.parts:
            value, slope = values.values(balls)
            misfits.append((value - values.value)[chosen])
            row = np.zeros((len(chosen), len(self.balls), balls.shape[1]))
            for k, ball in enumerate(values.balls[chosen].T):
                place = np.searchsorted(self.balls, ball)
                row[np.arange(len(chosen)), place] += slope[chosen, k]
            rows.append(row)
        return np.concatenate(misfits), np.concatenate(rows)


def check_exact_values(calibrations: Mapping[int, Calibration], references: References) -> None:
    """Report exact distances and co-ordinates of a plate that no arrangement of balls has."""
    plates = [
        name
        for name, settings in references.artefacts.items()
        if settings.role != "length_standard"
    ]
    for item, text in exact_contradictions(calibrations, plates, references.layouts):
        references.problems.add(("calibration", item), text)


def exact_contradictions(
    calibrations: Mapping[int, Calibration],
    plates: Iterable[str],
    layouts: Mapping[str, BallLayout],
) -> Iterator[tuple[int, str]]:
    """Return contradictory exact distances and co-ordinates of plates: the item of the first, and
    a description.
    """
    for artefact in plates:
        mine = {
            i: calibration
            for i, calibration in calibrations.items()
            if calibration.artefact == artefact
        }
        layout = layouts[artefact]
        exact = _exact_values(mine, layout)
        if not exact.name:
            continue
        if len(exact.name) * len(exact.balls) * layout.coordinates.shape[1] > MOST_ENTRIES:
            continue
        least = _least_misfit(exact, layout.coordinates)
        if least is None:
            continue
        misfit, rows = least
        most = float(np.abs(misfit).max())
        order = np.argsort(-comparable(_doubtfulness(misfit, rows), DIGITS), kind="stable")
        contradictory = [k for k in order.tolist() if abs(misfit[k]) > SHARE * most]
        names = listing(f"{exact.name[k]} in calibration[{exact.item[k]}]" for k in contradictory)
        yield (
            min(exact.item[k] for k in contradictory),
            f"values that are stated as exact contradict one another: {names}; no balls have them"
            f" all, at best one is off by {1e6 * most:.3g} µm: correct the one that is wrong, or"
            " state uncertainties above 0 um",
        )


def _exact_values(calibrations: Mapping[int, Calibration], layout: BallLayout) -> _Exact:
    parts, items, names = [], [], []
    for i, calibration in calibrations.items():
        if not isinstance(calibration, DistanceCalibration | CoordinateCalibration):
            continue
        observed = calibration.observed(0)
        chosen = np.flatnonzero(observed.is_exact)
        if not len(chosen):
            continue
        called = calibration.names(layout)
        parts.append((observed, chosen))
        items += [i] * len(chosen)
        names += [
            f"{value_name(called[k], calibration.are_lengths)} {1e3 * observed.value[k]:.10g} mm"
            for k in chosen.tolist()
        ]
    return _Exact(tuple(parts), tuple(items), tuple(names))


def _doubtfulness(misfit: Array, rows: Array) -> Array:
    """Return the misfit per value (m,): misfits divided by the roots of their redundancies
    [Baarda].
    """
    u, values, _ = svd(rows, full_matrices=False)
    unexplained = 1.0 - (u[:, values > KNOWN * values.max(initial=0.0)] ** 2).sum(axis=1)
    return np.abs(misfit) / np.sqrt(np.maximum(unexplained, SHARE))


def _least_misfit(exact: _Exact, drawn: Array) -> tuple[Array, Array] | None:
    """Return the misfits (m,) of the balls that satisfy the values best, with their derivatives
    (m, k d), or None if all values are satisfied somewhere.
    """
    if np.abs(exact.misfit(drawn)[0]).max() <= exact.rounding:
        return None
    # Imported late: it loads slowly, and few certificates have exact values off the drawing.
    from scipy.optimize import least_squares

    def at(move: Array) -> tuple[Array, Array]:
        balls = begin.copy()
        balls[exact.balls] += move.reshape(len(exact.balls), -1)
        misfit, rows = exact.misfit(balls)
        return misfit, rows.reshape(len(misfit), -1)

    extent = float(np.ptp(drawn, axis=0).max())
    generator = np.random.default_rng(0)
    solutions = []
    for start in STARTS:
        begin = drawn + start * extent * generator.standard_normal(drawn.shape)
        nothing = np.zeros(len(exact.balls) * drawn.shape[1])
        solution = least_squares(
            lambda move: at(move)[0],
            nothing,
            lambda move: at(move)[1],
            ftol=None,
            xtol=1e-15,
            gtol=1e-15,
            max_nfev=STEPS,
        )
        if np.abs(solution.fun).max() <= exact.rounding:
            return None
        solutions.append(solution)
    best = min(solutions, key=lambda solution: float(solution.cost))
    return best.fun, best.jac
