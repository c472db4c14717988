"""A machine after adjustments that were made to it: what its map predicts, and what a second
campaign says.

Hurt and Foss, US 4,437,151: a machine is inspected, its scales and guideways are adjusted by what
was found, and it is inspected again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import Any, Literal

import numpy as np
from ballplate.presentation import Result, aligned, finite, number
from ballplate.results import ARCSECOND, coverage_factor, few_degrees_of_freedom
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.geometry import AXIS_NAMES, rigid_motions
from ballplate.simulator.inputs import number_of
from ballplate.simulator.machines import Array, Unit
from ballplate.simulator.maps import FittedMap, readings_in_common, verdict_line

from .corrected_points import corrected, drawn_rows
from .machine_changes import MachineChange
from .second_campaign import (
    ROUNDING,
    CampaignComparison,
    CampaignFigures,
    compared_campaigns,
)

# Points along each axis at which a change of the machine is followed, and the part of it that the
# model may leave out.
POINTS_ALONG = 4
LEFT_OUT = 1e-3

CAMPAIGNS = "the first campaign", "the second campaign"
INDEPENDENT = (
    "The two campaigns are taken as independent. What both rest on alike, such as one certificate,"
    " has no part in their difference and makes E_n too small."
)


@dataclass(frozen=True)
class MachineLine:
    """A figure of a machine that adjustments change: a scale error, the excess of an angle between
    axes over 90 degrees, or the error of the length along a diagonal of the volume.

    It is the sum over `parts` of component `along` of the error at `end` less that at `start`,
    times a factor.
    """

    name: str
    kind: Literal["scale", "angle", "diagonal"]
    unit: Unit
    parts: tuple[tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]], ...]


def machine_lines(lower: Array, upper: Array) -> tuple[MachineLine, ...]:
    """Scale errors, angles and diagonals of a volume, axes being the lines through its lower corner
    from end to end.

    >>> [one.name for one in machine_lines(np.zeros(2), np.ones(2))]
    ['scale x', 'scale y', 'angle xy', 'diagonal ++', 'diagonal +-']
    """
    d, size = len(lower), upper - lower
    ends = lower + np.diag(size)
    unit = np.eye(d)

    def part(end: Array, start: Array, weight: Array) -> Any:
        return tuple(end.tolist()), tuple(start.tolist()), tuple(weight.tolist())

    found = []
    for i in range(d):
        name = f"scale {AXIS_NAMES[i]}"
        found.append(MachineLine(name, "scale", "1", (part(ends[i], lower, unit[i] / size[i]),)))
    for i, j in combinations(range(d), 2):
        # An axis that leans towards the other makes the angle smaller.
        both = (
            part(ends[j], lower, -unit[i] / size[j]),
            part(ends[i], lower, -unit[j] / size[i]),
        )
        found.append(MachineLine(f"angle {AXIS_NAMES[i]}{AXIS_NAMES[j]}", "angle", "rad", both))
    for signs in product((True, False), repeat=d - 1):
        ups = np.array([True, *signs])
        start, end = np.where(ups, lower, upper), np.where(ups, upper, lower)
        along = (end - start) / np.linalg.norm(end - start)
        name = "diagonal " + "".join("+" if up else "-" for up in ups)
        found.append(MachineLine(name, "diagonal", "m", (part(end, start, along),)))
    return tuple(found)


@dataclass(frozen=True)
class LineValue:
    """A figure of a machine with its standard uncertainty; NaN both where it is undetermined."""

    value: float
    standard_uncertainty: float


@single_threaded
def line_values(fitted: FittedMap, lines: Sequence[MachineLine]) -> tuple[Array, Array]:
    """Figures (m,) of a fitted machine and a square root (m, r) of their covariance, NaN where
    undetermined.
    """
    weights = np.array([part[2] for one in lines for part in one.parts])
    owner = np.array([k for k, one in enumerate(lines) for _ in one.parts])
    points = np.array([point for one in lines for part in one.parts for point in part[:2]])
    places, rows = corrected(fitted, points)
    drawn = drawn_rows(fitted, points)

    def summed(of_points: Array) -> Array:
        apart = np.einsum("kd,kd...->k...", weights, of_points[::2] - of_points[1::2])
        total = np.zeros((len(lines), *apart.shape[1:]))
        np.add.at(total, owner, apart)
        return total

    root = fitted.function_root(summed(rows), None if drawn is None else summed(drawn))
    values = summed(places - points)
    values[np.abs(values) < ROUNDING] = 0.0
    return np.where(np.isnan(root).any(axis=1), np.nan, values), root


@single_threaded
def adjusted_map(
    fitted: FittedMap, changes: Sequence[MachineChange], share: float = 0.0
) -> FittedMap:
    """The map of a machine after changes, each made as stated but for a standard uncertainty that
    is a `share` of it.

    :raises ValueError: the machine has no such axis, or its error model cannot follow a change.
    """
    values, covariance = fitted.values, np.array(fitted.covariance)
    for change in changes:
        moved = _followed(fitted, values, change)
        step = np.zeros(len(covariance))
        step[: len(values)] = share * (moved - values)
        covariance += np.outer(step, step)
        values = moved
    told = "; ".join(change.words for change in changes)
    title = f"{fitted.title}, as predicted after adjustment: {told}"
    return replace(fitted, title=title, values=values, covariance=covariance, date=None)


def _followed(fitted: FittedMap, values: Array, change: MachineChange) -> Array:
    """Parameters of the error model of a machine after a change, but for a motion of the whole."""
    d, (lower, upper) = fitted.dimension, map(np.array, fitted.volume.corners)
    if max(change.axis, change.towards or 0) >= d:
        raise ValueError(f"{change.words}: the map has the axes {', '.join(AXIS_NAMES[:d])} only")
    axes = [np.linspace(low, high, POINTS_ALONG) for low, high in zip(lower, upper, strict=True)]
    grid = np.array(list(product(*axes)))
    # With offsets too, so that no rotation of a probe is taken for a motion of the tip.
    points = np.concatenate([grid, grid])
    offsets = np.repeat([np.zeros(d), 0.1 * (upper - lower)], len(grid), axis=0)
    wanted = np.zeros(points.shape)
    if change.towards is None:
        wanted[:, change.axis] = -change.amount * (points - lower)[:, change.axis]
    else:
        wanted[:, change.towards] = change.amount * (points - lower)[:, change.axis]
    wanted = wanted + fitted.model.error(points, values, offsets)
    scale = fitted.scale[: len(values)]
    motions = rigid_motions(points - lower).reshape(points.size, -1)
    found, motion, left = values, np.zeros(motions.shape[1]), np.zeros(points.size)
    for _ in range(4):
        have = fitted.model.error(points, found, offsets).ravel() + motions @ motion
        left = wanted.ravel() - have
        jacobian = fitted.model.jacobian(points, found, offsets).reshape(points.size, -1)
        columns = np.concatenate([jacobian * scale, motions], axis=1)
        step = np.linalg.lstsq(columns, left, rcond=1e-12)[0]
        found, motion = found + scale * step[: len(values)], motion + step[len(values) :]
        left = left - columns @ step
    largest = abs(change.amount) * float((upper - lower).max())
    if np.abs(left).max() > LEFT_OUT * largest:
        raise ValueError(
            f"{change.words}: the error model cannot follow that, since it has no such error; fit"
            " with a model that has"
        )
    return found


@dataclass(frozen=True, eq=False, repr=False)
class AdjustedMachine(Result):
    """What adjustments of a machine leave of its errors, and what a second campaign found.

    `before` and `predicted` are the figures of `lines`, `found` those of the second campaign, None
    without one; `normalised_errors` (m,) are their E_n, NaN where one is undetermined and where
    both are exactly known and the same, infinite where they are exactly known and differ.
    `compared` counts figures that have an E_n, and `largest_by_chance` is the size of E_n that any
    of them exceeds at most once in a hundred by chance. `overall` compares scales and angles
    together, as E_n does one: at most 1 in at least 95 % of pairs of campaigns, where nothing else
    has changed. `predicted_map` is the machine as predicted.
    """

    label: str
    title: str
    changes: tuple[MachineChange, ...]
    lines_of_machine: tuple[MachineLine, ...]
    before: tuple[LineValue, ...]
    predicted: tuple[LineValue, ...]
    found: tuple[LineValue, ...] | None
    normalised_errors: Array
    overall: float
    compared: int
    largest_by_chance: float
    coverage_factor: float
    predicted_map: FittedMap
    remarks: tuple[str, ...] = ()
    verdicts: tuple[str, ...] = ()

    @property
    def is_within(self) -> bool:
        """Whether what was compared differs by no more than its uncertainties explain: scales and
        angles together, and no single figure by as much as one of as many does once in a hundred.
        """
        one_by_one = np.abs(self.normalised_errors[~np.isnan(self.normalised_errors)])
        return bool((one_by_one <= self.largest_by_chance).all()) and not self.overall > 1.0

    @property
    def notes(self) -> tuple[str, ...]:
        return (*self.remarks, *([INDEPENDENT] if self.found is not None else []))

    def headline(self) -> str:
        if self.found is None:
            count = len(self.changes)
            return f"{number_of(count, 'change')}, predicted"
        if not self.compared:
            if any(self._is_exact(i) for i in range(len(self.lines_of_machine))):
                return (
                    "as predicted: figures that are exactly known by both campaigns, and the same"
                )
            return "nothing is determined by both campaigns"
        return (
            f"{'as predicted' if self.is_within else 'not as predicted'}: |E_n| at most"
            f" {number(float(np.nanmax(np.abs(self.normalised_errors))), 3)} (of"
            f" {self.compared}, above {number(self.largest_by_chance, 3)} at most once in a"
            f" hundred), overall {number(self.overall, 3)} (above 1 at most once in twenty)"
        )

    def lines(self) -> list[str]:
        k = f"{self.coverage_factor:g}"
        heads = ["quantity", "before", f"U (k = {k})", "predicted", f"U (k = {k})"]
        heads += [] if self.found is None else ["found", f"U (k = {k})", "E_n"]
        rows = [[*heads, "unit"]]
        for i, one in enumerate(self.lines_of_machine):
            shown = {"rad": ARCSECOND, "1": 1e-6, "m": 1e-6}[one.unit]
            pairs = [self.before[i], self.predicted[i], *([self.found[i]] if self.found else [])]
            cells = [
                cell
                for pair in pairs
                for cell in (
                    _shown(pair.value / shown),
                    _shown(self.coverage_factor * pair.standard_uncertainty / shown),
                )
            ]
            cells += [] if self.found is None else [self._shown_error(i)]
            unit = {"rad": "arcsec", "1": "µm/m", "m": "µm"}[one.unit]
            rows.append([one.name, *cells, unit])
        table = aligned(rows, [False, *[True] * (len(heads) - 1), False])
        said = [
            "(errors of scales: true length less reading; of angles: excess over 90 deg; of"
            " diagonals of the volume, + upwards and - downwards along x, y, z: true length less"
            " reading)"
        ]
        changes = [one.words for one in self.changes]
        return [*changes, *self.verdicts, "", *table, *said, "", self.headline()]

    def _shown_error(self, i: int) -> str:
        """E_n of a figure; there is none where both campaigns know it exactly, and the same."""
        error = float(self.normalised_errors[i])
        return "-" if self._is_exact(i) and np.isnan(error) else _shown(error)

    def _is_exact(self, i: int) -> bool:
        """Whether a figure has no uncertainty in the prediction, nor in a second campaign."""
        both = (self.predicted[i], *([self.found[i]] if self.found is not None else []))
        return all(one.standard_uncertainty <= ROUNDING for one in both)

    def to_dict(self) -> dict[str, Any]:
        return {
            "title": self.title,
            "changes": [
                {
                    "axis": AXIS_NAMES[one.axis],
                    "amount": one.amount,
                    "unit": "1" if one.towards is None else "rad",
                    "towards": None if one.towards is None else AXIS_NAMES[one.towards],
                    "words": one.words,
                }
                for one in self.changes
            ],
            "coverage_factor": self.coverage_factor,
            "quantities": {
                one.name: {
                    "unit": one.unit,
                    "before": _data(self.before[i]),
                    "predicted": _data(self.predicted[i]),
                    **({} if self.found is None else {"found": _data(self.found[i])}),
                    "normalised_error": finite(float(self.normalised_errors[i])),
                }
                for i, one in enumerate(self.lines_of_machine)
            },
            "overall": finite(self.overall),
            "compared": self.compared,
            "largest_by_chance": finite(self.largest_by_chance),
            "within": self.is_within if self.compared else None,
            "lack_of_fit": list(self.verdicts),
            "notes": list(self.notes),
        }

    def rows(self) -> list[dict[str, Any]]:
        """One row for each quantity."""
        nothing = LineValue(np.nan, np.nan)
        return [
            {
                "quantity": one.name,
                "unit": one.unit,
                "before": self.before[i].value,
                "u before": self.before[i].standard_uncertainty,
                "predicted": self.predicted[i].value,
                "u predicted": self.predicted[i].standard_uncertainty,
                "found": (self.found[i] if self.found else nothing).value,
                "u found": (self.found[i] if self.found else nothing).standard_uncertainty,
                "E_n": float(self.normalised_errors[i]),
            }
            for i, one in enumerate(self.lines_of_machine)
        ]


def _shown(value: float) -> str:
    return "undetermined" if np.isnan(value) else number(value)


def _data(one: LineValue) -> dict[str, Any]:
    return {"value": finite(one.value), "standard_uncertainty": finite(one.standard_uncertainty)}


def adjusted_machine(
    label: str,
    fitted: FittedMap,
    changes: Sequence[MachineChange],
    second: FittedMap | None = None,
    share: float = 0.0,
) -> AdjustedMachine:
    """What changes leave of a fitted machine's errors and, with a `second` campaign after them,
    whether it finds that.

    `share` is the standard uncertainty of each change as a part of it.

    :raises ValueError: the error model cannot follow a change; the second map is of another volume,
        or rests on readings of the first.
    """
    if second is not None and readings_in_common(fitted.data, second.data) != "none":
        raise ValueError(
            "the second campaign has readings of the first, from before the changes; name what was"
            " read after them, and nothing else"
        )
    corners, other = (np.array(one.volume.corners) for one in (fitted, second or fitted))
    if corners.shape != other.shape or not np.allclose(corners, other):
        raise ValueError("the second campaign is about another volume; compare maps of the same")
    lower, upper = corners
    lines = machine_lines(lower, upper)
    after = adjusted_map(fitted, changes, share)
    k = fitted.coverage_factor
    before, predicted = line_values(fitted, lines), line_values(after, lines)
    found = None if second is None else line_values(second, lines)
    comparison = CampaignComparison(np.full(len(lines), np.nan), 0, 1.0, float("nan"))
    if second is not None and found is not None:
        together = np.array([one.kind != "diagonal" for one in lines])
        # The changes' own uncertainty counts as part of the first campaign's, which is no smaller.
        both = _figures(fitted, predicted), _figures(second, found)
        comparison = compared_campaigns(*both, together, k)
    return AdjustedMachine(
        label,
        fitted.title,
        tuple(changes),
        lines,
        _listed(before),
        _listed(predicted),
        None if found is None else _listed(found),
        comparison.normalised_errors,
        comparison.overall,
        comparison.compared,
        comparison.largest_by_chance,
        k,
        after,
        _doubts(fitted, second),
        tuple(
            verdict_line(one.lack_of_fit, which)
            for which, one in zip(CAMPAIGNS, (fitted, second), strict=True)
            if one is not None
        ),
    )


def _figures(fitted: FittedMap, found: tuple[Array, Array]) -> CampaignFigures:
    """Figures of a campaign, with the degrees of freedom of its sigma."""
    freedom = float(fitted.degrees_of_freedom) if fitted.sigma_is_estimated else np.inf
    return CampaignFigures(*found, freedom)


def _listed(found: tuple[Array, Array]) -> tuple[LineValue, ...]:
    values, root = found
    u = np.linalg.norm(root, axis=1)
    return tuple(LineValue(*one) for one in zip(values.tolist(), u.tolist(), strict=True))


def _doubts(*maps: FittedMap | None) -> tuple[str, ...]:
    told = []
    for which, one in zip(CAMPAIGNS, maps, strict=True):
        if one is None:
            continue
        told.append(one.known_lack_of_fit.caution.replace("the map", which, 1))
        if one.sigma_is_estimated:
            remedy = f"a factor of {coverage_factor(one.degrees_of_freedom):.3g} would give 95 %"
            told.append(few_degrees_of_freedom(one.degrees_of_freedom, f"sigma of {which}", remedy))
    return tuple(filter(None, told))
