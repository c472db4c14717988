"""What each parametric error contributes to the errors of a machine and to their uncertainties.

The error of a point, and of a length to first order, is a sum over the parametric errors. Of a mean
square the share of a part is its mean product with the whole, of a variance its covariance with the
whole: such shares add to one. Estimates are correlated, so that a share may be negative, and a part
alone less certain than the whole.
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
from .volumetric_errors import Volumetric, length_errors

REST = "together", "what the parts do together beyond the sum of each alone"
OFFSETS = "offsets", "estimated offsets of probes, which rotations turn"
PROBING = "probing", "what probing adds to each co-ordinate"


@dataclass(frozen=True, eq=False)
class PartBudget:
    """Contributions of `parts` (k), names and meanings, to one figure; in metres.

    Of a length `errors` (k,) add to its error `total`. Of the errors at points, whose root mean
    square `total` is, they are those of the parts alone. `shares` (k,) of the total, or of its
    square, add to one. `uncertainties` (k,) are standard ones of the parts alone, and `uncertainty`
    that of the whole, of points the root of the mean sum of squares; `variance_shares` (k,) add to
    one. All are NaN where undetermined.
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
        """Errors (k + 1, m, d) of each part alone, and of what is left of the whole, with offsets
        of probes (m, d), or the same (d,) everywhere.
        """
        probe = np.broadcast_to(offset, points.shape)
        found = [self.model.error(points, self.a * mask, probe) - probe for mask in self.masks]
        whole = self.model.error(points, self.a, probe) - probe
        return np.stack([*found, whole - np.sum(found, axis=0)])


@dataclass(frozen=True, eq=False)
class _End:
    """An end of lengths: scale readings `points` (k, d), offsets of probes (k, d), and these as
    they are stated.
    """

    points: Array
    offsets: Array
    stated: Array

    @property
    def tips(self) -> Array:
        """Where the tips (k, d) are by the scales."""
        return self.points + self.stated


def _figures(
    split: _Split, places: MapPlaces, of_points: Array, ends: tuple[_End, _End], offset: int = -1
) -> Iterator[tuple[str, bool, Array, Array, float]]:
    """Figures without uncertainties: the errors at points, with offsets of probes (m, d) or (d,),
    then those of lengths, to which the part of the index `offset` contributes estimated offsets.
    """
    points, (first, last) = places.points, ends
    at_points = split.errors(points, of_points)
    whole = at_points.sum(axis=0)
    square = float((whole**2).sum()) / len(points)
    own = np.sqrt((at_points**2).sum(axis=(1, 2)) / len(points))
    products = (at_points * whole).sum(axis=(1, 2)) / len(points)
    yield places.kind, False, own, _ratio(products, square), float(np.sqrt(square))
    moved = split.errors(last.points, last.offsets) - split.errors(first.points, first.offsets)
    if offset >= 0:
        moved[offset] += last.offsets - last.stated - (first.offsets - first.stated)
    totals = length_errors(first.tips, last.tips, moved.sum(axis=0))
    along = np.einsum("md,kmd->km", _directions(first.tips, last.tips), moved)
    # What is of second order belongs to no part alone.
    along[-1] += totals - along.sum(axis=0)
    for k, name in enumerate(places.names):
        yield name, True, along[:, k], _ratio(along[:, k], float(totals[k])), float(totals[k])


def _flat(one: ErrorRows, count: int) -> ErrorRows:
    """The rows of all co-ordinates, whose squares add to the mean over points."""
    parts = (one.rows, one.rows if one.drawn is None else one.drawn)
    rows, drawn = (part.reshape(-1, part.shape[-1]) / np.sqrt(count) for part in parts)
    return ErrorRows(rows, None if one.drawn is None else drawn)


def _one(rows: ErrorRows, k: int) -> ErrorRows:
    return ErrorRows(rows.rows[k : k + 1], None if rows.drawn is None else rows.drawn[k : k + 1])


def _masked(rows: ErrorRows, mask: Array) -> ErrorRows:
    return ErrorRows(rows.rows * mask, None if rows.drawn is None else rows.drawn * mask)


def _directions(starts: Array, ends: Array) -> Array:
    return np.asarray((ends - starts) / np.linalg.norm(ends - starts, axis=1)[:, None])


def _ratio(parts: Array, whole: float) -> Array:
    return parts / whole if whole else np.zeros(len(parts))


@single_threaded
def fitted_budget(
    fitted: FittedMap, places: MapPlaces, probes: Integers, probe: int
) -> tuple[PartBudget, ...]:
    """Budgets of the errors of a fitted machine at points, and of the lengths beside them."""
    functions = {one.function: one.meaning for one in reversed(fitted.parameters)}
    of = list(dict.fromkeys(one.function for one in fitted.parameters))
    masks = np.array([[one.function == name for one in fitted.parameters] for name in of])
    parts = [OFFSETS if name == "offset" else (name, functions[name]) for name in of]
    offsets = fitted.probes.offsets
    split = _Split(fitted.model, fitted.values, masks[:, : len(fitted.values)])
    at_points = rows_of_errors(fitted, places.points, probes)
    of_lengths = length_rows(fitted, places, probe)
    count = len(places.points)
    rows = [_flat(at_points, count), *(_one(of_lengths, k) for k in range(len(places.names)))]
    first, last = (
        _End(points, offsets[own], fitted.drawn_offsets[own])
        for points, own in length_ends(places, probe)
    )
    estimated = of.index("offset") if "offset" in of else -1
    figures = _figures(split, places, offsets[probes], (first, last), estimated)
    found = []
    for (name, is_length, errors, shares, total), own in zip(figures, rows, strict=True):
        is_open = np.array(
            [np.isnan(_masked(own, mask).uncertainties(fitted)).any() for mask in masks]
        )
        is_open = np.append(is_open, is_open.any())
        undetermined = bool(np.isnan(own.uncertainties(fitted)).any())
        squares = own.rows.T @ own.rows
        alone = np.array([np.sum(fitted.covariance[m][:, m] * squares[m][:, m]) for m in masks])
        with_whole = masks @ np.einsum("ij,ji->i", fitted.covariance, squares)
        variance = float(with_whole.sum())
        both = is_open | undetermined
        one = PartBudget(
            name,
            is_length,
            (*parts, REST),
            np.where(is_open, np.nan, errors),
            np.where(both, np.nan, shares),
            np.nan if undetermined else total,
            np.where(is_open, np.nan, np.sqrt(np.append(alone, 0.0))),
            np.where(both, np.nan, _ratio(np.append(with_whole, 0.0), variance)),
            np.nan if undetermined else float(np.sqrt(variance)),
        )
        found.append(one)
    return tuple(found)


@single_threaded
def machine_budget(built: Volumetric, places: MapPlaces) -> tuple[PartBudget, ...]:
    """Budgets of the errors that a machine file states, whose random parts are independent: their
    contributions add in squares.
    """
    points, starts, ends = places.points, places.starts, places.ends
    truth, machine = built.truth, built.machine
    functions = {one.function: one.meaning for one in truth.model.parameters}
    random = [one.function for one in built.approach[0].parameters]
    random += [PROBING[0]] * 3 + [one.function for one in built.lasting[0].parameters]
    meanings = {
        one.function: one.meaning
        for model in (built.approach[0], built.lasting[0])
        for one in model.parameters
    }
    every = list(dict.fromkeys([*functions, *random]))
    parts = [
        PROBING if name == PROBING[0] else (name, (functions | meanings)[name]) for name in every
    ]
    masks = np.array([[one.function == name for one in truth.model.parameters] for name in every])
    split = _Split(truth.model, truth.a, masks.reshape(len(every), -1))
    offset = np.array(machine.probe)
    both = _End(starts, offset, offset), _End(ends, offset, offset)
    drawn, lasting = built.random_roots(points)
    at_points = np.concatenate([drawn, lasting], axis=2)
    variances = [(at_points**2).sum(axis=(0, 1)) / len(points)]
    (first, steady), (last, moved) = built.random_roots(starts), built.random_roots(ends)
    along = [
        np.einsum("md,mdk->mk", _directions(starts, ends), one)
        for one in (first, last, moved - steady)
    ]
    variances += list(np.concatenate([along[0] ** 2 + along[1] ** 2, along[2] ** 2], axis=1))
    found = []
    for (name, is_length, errors, shares, total), own in zip(
        _figures(split, places, offset, both), variances, strict=True
    ):
        by_part = np.array([own[[one == part for one in random]].sum() for part in every] + [0.0])
        variance = float(by_part.sum())
        one = PartBudget(
            name,
            is_length,
            (*parts, REST),
            errors,
            shares,
            total,
            np.sqrt(by_part),
            _ratio(by_part, variance),
            float(np.sqrt(variance)),
        )
        found.append(one)
    return tuple(found)
