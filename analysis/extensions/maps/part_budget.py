"""Contributions of parametric errors to the errors of a fitted machine and their uncertainties.

The error of a point, and of a length to first order, is a sum over the parametric errors. The share
of a part in a mean square is its mean product with the whole, in a variance its covariance with the
whole: such shares add to one. Estimates are correlated: a share may be negative, and a part alone
less certain than the whole.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.machines import Array, ErrorModel, Integers
from ballplate.simulator.maps import FittedMap

from .fitted_errors import ErrorRows, length_ends, length_rows, rows_of_errors
from .map_places import MapPlaces
from .volumetric_errors import length_errors

REST = "together", "joint effect of the parts beyond the sum of their single effects"
OFFSETS = "offsets", "estimated offsets of probes, which rotations turn"


@dataclass(frozen=True, eq=False)
class PartBudget:
    """Contributions of `parts` (k), names and meanings, to one error; in metres.

    For a length, `errors` (k,) add to its error `total`. For errors at points, with root mean
    square `total`, they are those of the parts alone. `shares` (k,) of the total, or of its square,
    add to one. `uncertainties` (k,) are standard ones of the parts alone, `uncertainty` that of the
    whole, for points the root of the mean sum of squares; `variance_shares` (k,) add to one. All
    are NaN where undetermined.
    """

    figure: str
    is_length: bool
    parts: tuple[tuple[str, str], ...]
    errors: Array
    shares: Array
    total: float
    uncertainties: Array
    variance_shares: Array
    uncertainty: float


@dataclass(frozen=True, eq=False)
class _Split:
    """An error model at parameters `a` (n,), whose parts are those that `masks` (k, n) choose."""

    model: ErrorModel
    a: Array
    masks: Array

    def errors(self, points: Array, offset: Array) -> Array:
        """Return errors (k + 1, m, d) of each part alone, and the remainder of the whole, with
        offsets of probes (m, d), or one (d,).
        """
        probe = np.broadcast_to(offset, points.shape)
        by_part = [self.model.error(points, self.a * mask, probe) - probe for mask in self.masks]
        whole = self.model.error(points, self.a, probe) - probe
        return np.stack([*by_part, whole - np.sum(by_part, axis=0)])


@dataclass(frozen=True, eq=False)
class _End:
    """An end of lengths: scale readings `points` (k, d), offsets of probes (k, d), and stated
    offsets.
    """

    points: Array
    offsets: Array
    stated_offsets: Array

    @property
    def tips(self) -> Array:
        """Where the tips (k, d) are by the scales."""
        return self.points + self.stated_offsets


def _figures(
    split: _Split, places: MapPlaces, of_points: Array, ends: tuple[_End, _End], offset: int
) -> Iterator[tuple[str, bool, Array, Array, float]]:
    """Yield budgets without uncertainties: errors at points, with offsets of probes (m, d) or (d,),
    then lengths, to which the part of index `offset` contributes estimated offsets.
    """
    points, (first, last) = places.points, ends
    at_points = split.errors(points, of_points)
    whole = at_points.sum(axis=0)
    square = float((whole**2).sum()) / len(points)
    alone = np.sqrt((at_points**2).sum(axis=(1, 2)) / len(points))
    products = (at_points * whole).sum(axis=(1, 2)) / len(points)
    yield places.kind, False, alone, _ratio(products, square), float(np.sqrt(square))
    moved = split.errors(last.points, last.offsets) - split.errors(first.points, first.offsets)
    if offset >= 0:
        moved[offset] += last.offsets - last.stated_offsets - (first.offsets - first.stated_offsets)
    totals = length_errors(first.tips, last.tips, moved.sum(axis=0))
    along = np.einsum("md,kmd->km", _directions(first.tips, last.tips), moved)
    # What is of second order belongs to no part alone.
    along[-1] += totals - along.sum(axis=0)
    for k, name in enumerate(places.names):
        yield name, True, along[:, k], _ratio(along[:, k], float(totals[k])), float(totals[k])


def _flat(rows: ErrorRows, count: int) -> ErrorRows:
    """The rows of all co-ordinates, whose squares add to the mean over points."""
    return rows.by(lambda part: part.reshape(-1, part.shape[-1]) / np.sqrt(count))


def _row(rows: ErrorRows, k: int) -> ErrorRows:
    return rows.by(lambda part: part[k : k + 1])


def _masked(rows: ErrorRows, mask: Array) -> ErrorRows:
    return rows.by(lambda part: part * mask)


def _directions(starts: Array, ends: Array) -> Array:
    return (ends - starts) / np.linalg.norm(ends - starts, axis=1)[:, None]


def _ratio(parts: Array, whole: float) -> Array:
    return parts / whole if whole else np.zeros(len(parts))


@single_threaded
def fitted_budget(
    fitted: FittedMap, places: MapPlaces, probes: Integers, probe: int
) -> tuple[PartBudget, ...]:
    """Return budgets of the errors of a fitted machine at points, and of lengths."""
    functions = {parameter.function: parameter.meaning for parameter in reversed(fitted.parameters)}
    functions_in_order = list(dict.fromkeys(parameter.function for parameter in fitted.parameters))
    masks = np.array(
        [
            [parameter.function == name for parameter in fitted.parameters]
            for name in functions_in_order
        ]
    )
    parts = [
        OFFSETS if name == "offset" else (name, functions[name]) for name in functions_in_order
    ]
    offsets = fitted.probes.offsets
    split = _Split(fitted.model, fitted.values, masks[:, : len(fitted.values)])
    at_points = rows_of_errors(fitted, places.points, probes)
    of_lengths = length_rows(fitted, places, probe)
    count = len(places.points)
    rows = [_flat(at_points, count), *(_row(of_lengths, k) for k in range(len(places.names)))]
    first, last = (
        _End(points, offsets[end_probes], fitted.drawn_offsets[end_probes])
        for points, end_probes in length_ends(places, probe)
    )
    estimated = functions_in_order.index("offset") if "offset" in functions_in_order else -1
    figures = _figures(split, places, offsets[probes], (first, last), estimated)
    budgets = []
    for (name, is_length, errors, shares, total), rows_of_figure in zip(figures, rows, strict=True):
        is_open = np.array(
            [np.isnan(_masked(rows_of_figure, mask).uncertainties(fitted)).any() for mask in masks]
        )
        is_open = np.append(is_open, is_open.any())
        undetermined = bool(np.isnan(rows_of_figure.uncertainties(fitted)).any())
        squares = rows_of_figure.rows.T @ rows_of_figure.rows
        alone = np.array([np.sum(fitted.covariance[m][:, m] * squares[m][:, m]) for m in masks])
        with_whole = masks @ np.einsum("ij,ji->i", fitted.covariance, squares)
        variance = float(with_whole.sum())
        is_unknown = is_open | undetermined
        budget = PartBudget(
            name,
            is_length,
            (*parts, REST),
            np.where(is_open, np.nan, errors),
            np.where(is_unknown, np.nan, shares),
            np.nan if undetermined else total,
            np.where(is_open, np.nan, np.sqrt(np.append(alone, 0.0))),
            np.where(is_unknown, np.nan, _ratio(np.append(with_whole, 0.0), variance)),
            np.nan if undetermined else float(np.sqrt(variance)),
        )
        budgets.append(budget)
    return tuple(budgets)
