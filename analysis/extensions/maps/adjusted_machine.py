"""Machine after adjustments: predictions of its map and results of a second campaign.

Hurt and Foss, US 4,437,151: inspect a machine, adjust its scales and guideways accordingly, and
inspect it again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations, product
from typing import Any

import numpy as np
from ballplate.presentation import Data, Result, number, records, table_lines
from ballplate.results import ARCSECOND, coverage_factor, few_degrees_of_freedom
from ballplate.simulator.computing import lstsq, single_threaded
from ballplate.simulator.geometry import AXIS_NAMES, rigid_motions
from ballplate.simulator.inputs import number_of
from ballplate.simulator.machines import Array, Unit
from ballplate.simulator.maps import FittedMap, readings_in_common, verdict_line

from .comparison import ComparisonSettings
from .corrected_points import corrected, drawn_rows
from .machine_changes import MachineChange
from .map_difference import INDEPENDENT, MapDifference
from .sources import map_difference

# Points along each axis at which a change of the machine is followed, and the part of it that the
# model may leave out.
POINTS_ALONG = 4
LEFT_OUT = 1e-3
# Figures below this, in metres and radians, are rounding.
ROUNDING = 1e-13

# Units in which quantities are shown.
UNITS = {"rad": (ARCSECOND, "arcsec"), "1": (1e-6, "µm/m"), "m": (1e-6, "µm")}

CAMPAIGNS = "the first campaign", "the second campaign"


@dataclass(frozen=True, eq=False)
class MachineLine:
    """A quantity that adjustments change: a scale error, the excess over 90 degrees of an angle
    between axes, or the length error of a diagonal of the volume.

    It sums products of `weights` (k, d) and the errors at `ends` (k, d) less those at `starts` (k,
    d).
    """

    name: str
    unit: Unit
    ends: Array
    starts: Array
    weights: Array


def machine_lines(lower: Array, upper: Array) -> tuple[MachineLine, ...]:
    """Scale errors, angles and diagonals of a volume, axes being the lines through its lower corner
    from end to end.

    >>> [one.name for one in machine_lines(np.zeros(2), np.ones(2))]
    ['scale x', 'scale y', 'angle xy', 'diagonal ++', 'diagonal +-']
    """
    d, size = len(lower), upper - lower
    ends = lower + np.diag(size)
    per_length = np.diag(1.0 / size)
    lines = [
        MachineLine(f"scale {AXIS_NAMES[i]}", "1", ends[[i]], lower[None], per_length[[i]])
        for i in range(d)
    ]
    for i, j in combinations(range(d), 2):
        # An axis that leans towards the other makes the angle smaller.
        leaning = -np.eye(d)[[i, j]] / size[[j, i], None]
        name = f"angle {AXIS_NAMES[i]}{AXIS_NAMES[j]}"
        lines.append(MachineLine(name, "rad", ends[[j, i]], np.array([lower, lower]), leaning))
    for signs in product((True, False), repeat=d - 1):
        ups = np.array([True, *signs])
        start, end = np.where(ups, lower, upper), np.where(ups, upper, lower)
        along = (end - start) / np.linalg.norm(end - start)
        name = "diagonal " + "".join("+" if up else "-" for up in ups)
        lines.append(MachineLine(name, "m", end[None], start[None], along[None]))
    return tuple(lines)


@dataclass(frozen=True)
class LineValue:
    """Value of a quantity with its standard uncertainty; both NaN if undetermined."""

    value: float
    standard_uncertainty: float


@single_threaded
def line_values(fitted: FittedMap, lines: Sequence[MachineLine]) -> tuple[Array, Array]:
    """Return values (m,) of the quantities and a square root (m, r) of their covariance, NaN where
    undetermined.
    """
    weights, ends, starts = (
        np.concatenate([getattr(line, name) for line in lines])
        for name in ("weights", "ends", "starts")
    )
    owner = np.repeat(np.arange(len(lines)), [len(line.weights) for line in lines])
    points = np.concatenate([ends, starts])
    places, rows = corrected(fitted, points)
    drawn = drawn_rows(fitted, points)

    def summed(of_points: Array) -> Array:
        at_ends, at_starts = np.split(of_points, 2)
        apart = np.einsum("kd,kd...->k...", weights, at_ends - at_starts)
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
    """Return the map of a machine after changes, each with a relative standard uncertainty `share`.

    :raises ValueError: the machine has no such axis, or its error model cannot follow a change.
    """
    values, covariance = fitted.values, np.array(fitted.covariance)
    for change in changes:
        moved = _followed(fitted, values, change)
        step = np.zeros(len(covariance))
        step[: len(values)] = share * (moved - values)
        covariance += np.outer(step, step)
        values = moved
    change_words = "; ".join(change.words for change in changes)
    title = f"{fitted.title}, as predicted after adjustment: {change_words}"
    return replace(fitted, title=title, values=values, covariance=covariance, date=None)


def _followed(fitted: FittedMap, values: Array, change: MachineChange) -> Array:
    """Return model parameters after a change, up to a rigid motion of the whole."""
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
    state, motion, residual = values, np.zeros(motions.shape[1]), np.zeros(points.size)
    for _ in range(4):
        have = fitted.model.error(points, state, offsets).ravel() + motions @ motion
        residual = wanted.ravel() - have
        jacobian = fitted.model.jacobian(points, state, offsets).reshape(points.size, -1)
        columns = np.concatenate([jacobian * scale, motions], axis=1)
        step = lstsq(columns, residual, rcond=1e-12)[0]
        state, motion = state + scale * step[: len(values)], motion + step[len(values) :]
        residual = residual - columns @ step
    largest = abs(change.amount) * float((upper - lower).max())
    if np.abs(residual).max() > LEFT_OUT * largest:
        raise ValueError(
            f"{change.words}: the error model cannot follow that, since it has no such error; fit"
            " with a model that has"
        )
    return state


@dataclass(frozen=True, eq=False, repr=False)
class AdjustedMachine(Result):
    """Errors left by adjustments of a machine, with the results of a second campaign.

    `before`, `predicted` and `found` (second campaign) are values of `lines_of_machine`;
    `difference` is the second map less `predicted_map`. `found` and `difference` are None without a
    second campaign.
    """

    label: str
    title: str
    changes: tuple[MachineChange, ...]
    lines_of_machine: tuple[MachineLine, ...]
    before: tuple[LineValue, ...]
    predicted: tuple[LineValue, ...]
    found: tuple[LineValue, ...] | None
    difference: MapDifference | None
    coverage_factor: float
    predicted_map: FittedMap
    remarks: tuple[str, ...] = ()
    verdicts: tuple[str, ...] = ()

    @property
    def normalised_errors(self) -> Array:
        """E_n (m,) of the quantities; NaN if undetermined or exact."""
        errors = []
        for predicted, actual in zip(self.predicted, self.found or (), strict=False):
            u = np.hypot(predicted.standard_uncertainty, actual.standard_uncertainty)
            is_known = u > ROUNDING
            apart = actual.value - predicted.value
            errors.append(apart / (self.coverage_factor * u) if is_known else np.nan)
        return np.array(errors or [np.nan] * len(self.lines_of_machine))

    @property
    def is_within(self) -> bool | None:
        """True if the joint test of the second map shows no change from the prediction; None if
        untestable.
        """
        changed = None if self.difference is None else self.difference.is_changed
        return None if changed is None else not changed

    @property
    def notes(self) -> tuple[str, ...]:
        return (*self.remarks, *(() if self.difference is None else (INDEPENDENT,)))

    def headline(self) -> str:
        if self.difference is None:
            count = len(self.changes)
            return f"{number_of(count, 'change')}, predicted"
        verdicts = {True: "as predicted: ", False: "not as predicted: ", None: ""}
        return f"{verdicts[self.is_within]}{self.difference.headline()}"

    def lines(self) -> list[str]:
        k = self.coverage_factor
        columns: list[tuple[str, Any]] = [("quantity", "quantity")]
        for stage in ("before", "predicted", *([] if self.found is None else ["found"])):
            columns.append((stage, partial(_in_unit, stage)))
            columns.append((f"U (k = {k:g})", partial(_in_unit, f"u {stage}", factor=k)))
        if self.found is not None:
            columns.append(("E_n", ("E_n", number)))
        columns.append(("unit", lambda row: UNITS[row["unit"]][1]))
        table = table_lines(columns, self.rows(), unknown="undetermined")
        legend = [
            "(errors of scales: true length less reading; of angles: excess over 90 deg; of"
            " diagonals of the volume, + upwards and - downwards along x, y, z: true length less"
            " reading)"
        ]
        changes = [change.words for change in self.changes]
        return [*changes, *self.verdicts, "", *table, *legend, "", self.headline()]

    def data(self) -> Data:
        errors = self.normalised_errors
        return {
            "title": self.title,
            "changes": [
                {
                    "axis": AXIS_NAMES[change.axis],
                    "amount": change.amount,
                    "unit": "1" if change.towards is None else "rad",
                    "towards": None if change.towards is None else AXIS_NAMES[change.towards],
                    "words": change.words,
                }
                for change in self.changes
            ],
            "coverage_factor": self.coverage_factor,
            "quantities": {
                line.name: {
                    "unit": line.unit,
                    "before": self.before[i],
                    "predicted": self.predicted[i],
                    **({} if self.found is None else {"found": self.found[i]}),
                    "normalised_error": errors[i],
                }
                for i, line in enumerate(self.lines_of_machine)
            },
            "within": self.is_within,
            "difference": None if self.difference is None else self.difference.to_dict(),
            "lack_of_fit": self.verdicts,
            "notes": self.notes,
        }

    def rows(self) -> list[Data]:
        """One row for each quantity."""
        undetermined = (LineValue(np.nan, np.nan),) * len(self.lines_of_machine)
        stages = {
            "before": self.before,
            "predicted": self.predicted,
            "found": self.found or undetermined,
        }
        columns: dict[str, Any] = {
            "quantity": [line.name for line in self.lines_of_machine],
            "unit": [line.unit for line in self.lines_of_machine],
        }
        for stage, values in stages.items():
            columns[stage] = [value.value for value in values]
            columns[f"u {stage}"] = [value.standard_uncertainty for value in values]
        return records(**columns, E_n=self.normalised_errors.tolist())


def _in_unit(name: str, row: Data, factor: float = 1.0) -> float:
    return factor * float(row[name]) / UNITS[row["unit"]][0]


def adjusted_machine(
    label: str,
    fitted: FittedMap,
    changes: Sequence[MachineChange],
    second: FittedMap | None = None,
    share: float = 0.0,
) -> AdjustedMachine:
    """Return the errors left by changes of a fitted machine, compared with a `second` campaign
    after them.

    `share` is the relative standard uncertainty of each change.

    :raises ValueError: the error model cannot follow a change; the second map is of another volume,
        or rests on readings of the first.
    """
    if second is not None and readings_in_common(fitted.data, second.data) != "none":
        raise ValueError(
            "the second campaign has readings of the first, from before the changes; name only"
            " readings after them"
        )
    corners, to_corners = (
        np.array(fitted_map.volume.corners) for fitted_map in (fitted, second or fitted)
    )
    if corners.shape != to_corners.shape or not np.allclose(corners, to_corners):
        raise ValueError("the second campaign is about another volume; compare maps of the same")
    lower, upper = corners
    lines = machine_lines(lower, upper)
    after = adjusted_map(fitted, changes, share)
    k = fitted.coverage_factor
    before, predicted = line_values(fitted, lines), line_values(after, lines)
    measured = None if second is None else line_values(second, lines)
    difference = None
    if second is not None:
        # The changes' own uncertainty counts as part of the first campaign's, which is no smaller.
        difference = map_difference((after, second), ComparisonSettings(k))
    return AdjustedMachine(
        label,
        fitted.title,
        tuple(changes),
        lines,
        _listed(before),
        _listed(predicted),
        None if measured is None else _listed(measured),
        difference,
        k,
        after,
        _doubts(fitted, second),
        tuple(
            verdict_line(fitted_map.lack_of_fit, campaign)
            for campaign, fitted_map in zip(CAMPAIGNS, (fitted, second), strict=True)
            if fitted_map is not None
        ),
    )


def _listed(figures: tuple[Array, Array]) -> tuple[LineValue, ...]:
    values, root = figures
    u = np.linalg.norm(root, axis=1)
    return tuple(LineValue(*pair) for pair in zip(values.tolist(), u.tolist(), strict=True))


def _doubts(*maps: FittedMap | None) -> tuple[str, ...]:
    doubts = []
    for campaign, fitted_map in zip(CAMPAIGNS, maps, strict=True):
        if fitted_map is None:
            continue
        doubts.append(fitted_map.lack_of_fit.caution.replace("the map", campaign, 1))
        if fitted_map.sigma_is_estimated:
            remedy = (
                f"a factor of {coverage_factor(fitted_map.degrees_of_freedom):.3g} would give 95 %"
            )
            doubts.append(
                few_degrees_of_freedom(
                    fitted_map.degrees_of_freedom, f"sigma of {campaign}", remedy
                )
            )
    return tuple(filter(None, doubts))
