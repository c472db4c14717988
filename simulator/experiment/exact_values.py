"""Check of certified values that are stated as exact: whether any balls have them all."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

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
        misfit = least[1]
        most = float(np.abs(misfit).max())
        order = np.argsort(-comparable(_doubtfulness(exact, *least), DIGITS), kind="stable")
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


def _doubtfulness(exact: _Exact, balls: Array, misfit: Array) -> Array:
    """Return the misfit per value (m,): misfits divided by the roots of their redundancies
    [Baarda].
    """
    rows = exact.misfit(balls)[1]
    u, values, _ = np.linalg.svd(rows.reshape(len(rows), -1), full_matrices=False)
    unexplained = 1.0 - (u[:, values > KNOWN * values.max(initial=0.0)] ** 2).sum(axis=1)
    return np.abs(misfit) / np.sqrt(np.maximum(unexplained, SHARE))


def _least_misfit(exact: _Exact, drawn: Array) -> tuple[Array, Array] | None:
    """Return the balls (n, d) that satisfy the values best and their misfits (m,), or None if
    every arrangement does.
    """
    extent = float(np.ptp(drawn, axis=0).max())
    generator = np.random.default_rng(0)
    best = None
    for start in STARTS:
        off = start * extent * generator.standard_normal(drawn.shape)
        balls, misfit = _solved(exact, drawn + off)
        if np.abs(misfit).max() <= exact.rounding:
            return None
        if best is None or (misfit**2).sum() < (best[1] ** 2).sum():
            best = balls, misfit
    return best


def _solved(exact: _Exact, balls: Array) -> tuple[Array, Array]:
    """Balls (n, d) and misfits (m,) at a minimum of their sum of squares [Levenberg; Marquardt]."""
    misfit, rows = exact.misfit(balls)
    damping = 0.0
    for _ in range(STEPS):
        if np.abs(misfit).max() <= exact.rounding:
            break
        u, values, vh = np.linalg.svd(rows.reshape(len(rows), -1), full_matrices=False)
        is_known = values > KNOWN * values.max(initial=0.0)
        gain = np.where(is_known, values / np.where(is_known, values**2 + damping**2, 1.0), 0.0)
        step = np.zeros_like(balls)
        step[exact.balls] = -(vh.T @ (gain * (u.T @ misfit))).reshape(rows.shape[1:])
        if np.abs(step).max() <= 1e-16:
            break
        # Balls may come to be at one place, or far out.
        with np.errstate(all="ignore"):
            new, new_rows = exact.misfit(balls + step)
            is_better = (new**2).sum() < (misfit**2).sum() and np.isfinite(new_rows).all()
        if is_better:
            balls, misfit, rows, damping = balls + step, new, new_rows, damping / 10.0
        else:
            damping = max(10.0 * damping, 1e-6)
            if damping > 1e3:
                break
    return balls, misfit
