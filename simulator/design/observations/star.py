"""Stars of styli as rigid bodies: tips known relative to one another, with an unknown rotation of
the star (NPL Report CISE 15/98, section 2.4.2).

A star with tips at c, turned by a rotation R, has the offsets p = R c. The rotation is not a
parameter: the one nearest to offsets p follows from them, and rows compare R' p with c across the
directions in which a small turn moves the tips. The remaining deviation lies there, so that the
sum of squares is the least over all rotations, exactly and for turns of any size, and rows are
independent. If the location of the star is unknown too, shifts are omitted in the same manner.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from ballplate.simulator.computing.numerics import lstsq, svd
from ballplate.simulator.geometry.motions import AXIS_NAMES
from ballplate.simulator.inputs.number_arrays import Array, Integers
from ballplate.simulator.machines.protocol import ErrorModel

from ..arrays import Design, Observations, Rows
from ..parameters import shared_layout
from ..state import Replicates, State
from .readings import rotation_sensitivity

# A turn that moves tips by less than this share of their distances moves none: tips are in a line.
IN_LINE = 1e-9

# Tips in a line leave the turn about it open, and rounding would choose it. By this share the
# rotation is drawn to none, which chooses the least turn, and moves tips by far less than a
# nanometre.
LEAST_TURN = 1e-11


@dataclass(frozen=True, eq=False)
class Star:
    """A star of `probes` (names) whose tips are at ``coordinates`` (l, d) in its own frame, in
    metres, each known to ``standard_uncertainty`` along each axis.

    ``has_place``: true if it turns about the machine's reference point, the origin of the
    coordinates; otherwise its location is unknown as well.
    """

    probes: tuple[str, ...]
    coordinates: Array
    standard_uncertainty: float
    has_place: bool

    @property
    def names(self) -> list[tuple[str, str]]:
        """Probe and axis of each co-ordinate."""
        letters = AXIS_NAMES[: self.coordinates.shape[1]]
        return [(probe, letter) for probe in self.probes for letter in letters]

    def with_values(self, values: Array) -> Star:
        """The same with other co-ordinates (l d,), from a certificate."""
        return replace(self, coordinates=values.reshape(self.coordinates.shape))

    def true_values(self, offsets: Array) -> Array:
        """Its co-ordinates (l d,) where its tips have `offsets` (l, d) and it lies in its own
        frame as it does now.
        """
        turn = self.rotation(offsets)
        if self.has_place:
            return (offsets @ turn).ravel()
        return ((offsets - offsets.mean(axis=0)) @ turn + self.coordinates.mean(axis=0)).ravel()

    def rotation(self, offsets: Array) -> Array:
        """Rotations (..., d, d) that bring the star nearest to `offsets` (..., l, d)."""
        source = self.coordinates
        if not self.has_place:
            source = source - source.mean(axis=0)
            offsets = offsets - offsets.mean(axis=-2, keepdims=True)
        # The least sum of squares of p - R c over rotations: R = U V' of the singular value
        # decomposition of the sum of p c', with the sign of the last vector chosen so that R is no
        # reflection.
        together = offsets.swapaxes(-1, -2) @ source
        if _in_line(self):
            together = together + LEAST_TURN * (source**2).sum() * np.eye(source.shape[1])
        u, _, vh = svd(together)
        sign = np.ones(together.shape[:-1])
        sign[..., -1] = np.sign(np.linalg.det(u @ vh))
        return (u * sign[..., None, :]) @ vh


def _moves(star: Star) -> Array:
    """Return the motions of its tips under small turns, and shifts if its location is unknown: (l
    d, k).
    """
    arms = star.coordinates if star.has_place else star.coordinates - star.coordinates.mean(axis=0)
    count, d = arms.shape
    turns = rotation_sensitivity(arms).reshape(count * d, -1)
    if star.has_place:
        return turns
    size = max(float(np.sqrt((arms**2).sum())), np.finfo(float).tiny)
    # Shifts as long as the turns' columns, so that one threshold of singular values serves both.
    return np.concatenate([turns, np.tile(size * np.eye(d), (count, 1)) / np.sqrt(count)], axis=1)


def _free(star: Star) -> Array:
    """Orthonormal directions (l d, k) in which its tips move as one body."""
    left_vectors, sizes, _ = svd(_moves(star), full_matrices=False)
    return left_vectors[:, sizes > IN_LINE * sizes.max(initial=0.0)]


def _in_line(star: Star) -> bool:
    d = star.coordinates.shape[1]
    turns = 3 if d == 3 else 1
    return _free(star).shape[1] < turns + (0 if star.has_place else d)


def _shape(star: Star) -> tuple[Array, Integers]:
    """Orthonormal columns (l d, m) across all motions of the body, each mostly one co-ordinate of a
    tip, and which (m,).
    """
    free = _free(star)
    # Any orthonormal basis across the motions of the body gives the same sum of squares. This one
    # can be named: co-ordinates of tips are chosen one after the other, each with the largest part
    # that those before leave, and the basis nearest to their projections is U V' of these. Each row
    # is then mostly one co-ordinate, which messages name.
    across = np.eye(len(free)) - free @ free.T
    remainder, chosen = across.copy(), []
    for _ in range(len(free) - free.shape[1]):
        size = (remainder**2).sum(axis=0)
        # Of those that are as large but for rounding, the first.
        k = int(np.flatnonzero(size > size.max() * (1.0 - 1e-6))[0])
        chosen.append(k)
        direction = remainder[:, k] / np.sqrt(size[k])
        remainder = remainder - np.outer(direction, direction @ remainder)
    places = np.sort(np.array(chosen, np.int64))
    u, _, vh = svd(across[:, places], full_matrices=False)
    return u @ vh, places


@dataclass(frozen=True)
class Stars(Observations):
    """The shapes of all `stars`; `value` and `uncertainty` (m,) are in metres.

    `probes` are the indices of each star's, `bases` (l d, m) the directions of its rows, and
    `place` (m,) the dominant co-ordinate of each row among all tips of its star.
    """

    word: ClassVar[str] = "star"

    stars: tuple[Star, ...]
    probes: tuple[Integers, ...]
    bases: tuple[Array, ...]
    star: Integers
    place: Integers
    value: Array
    uncertainty: Array

    def rows(self, design: Design, state: State, x: Array | None) -> Rows:
        columns = design.once(shared_layout).offset_columns
        by_shared = np.zeros((len(self), len(design.once(shared_layout)) + 1))
        row = 0
        for star, probes, basis in zip(self.stars, self.probes, self.bases, strict=True):
            # The derivative holds the nearest rotation, as in variable projection: a change of it
            # moves R' p nearly along the motions of the body, and the rows are across these.
            turn = star.rotation(state.probes[probes])
            slopes = np.einsum("ldm,ed->mle", basis.reshape(*star.coordinates.shape, -1), turn)
            # What is held goes to the extra column.
            by_shared[row : row + basis.shape[1], columns[probes].ravel()] = slopes.reshape(
                basis.shape[1], -1
            )
            row += basis.shape[1]
        by_shared = by_shared[:, :-1] / self.uncertainty[:, None]
        residual = (self.values(state.probes) - self.value) / self.uncertainty
        return Rows(residual, by_shared, np.zeros((len(self), 0, design.dimension)))

    def values(self, offsets: Array) -> Array:
        """Values (..., m) with offsets (..., probes, d), turned back into the stars' frames."""
        departures = []
        for star, probes, basis in zip(self.stars, self.probes, self.bases, strict=True):
            star_offsets = offsets[..., probes, :]
            turned = star_offsets @ star.rotation(star_offsets)
            departures.append(turned.reshape(*turned.shape[:-2], -1) @ basis)
        return np.concatenate(departures, axis=-1)

    def true_values(self, design: Design, truth: State, model: ErrorModel) -> Array:
        return self.values(truth.probes)

    def name(self, design: Design, k: int) -> str:
        probe, letter = self.stars[self.star[k]].names[self.place[k]]
        return f"shape of the star, mostly {letter} of probe {probe}"

    def as_read(self, design: Design, x: Array) -> Design:
        offsets = design.probes.offsets.copy()
        for star, probes in zip(self.stars, self.probes, strict=True):
            offsets[probes] = _turned(star, probes, design, x)
        return replace(design, probes=replace(design.probes, offsets=offsets))

    def add_misfit(self, rows: Rows, errors: Array, at: Replicates) -> None:
        """Exact for every turn of the star."""
        offsets = (
            at.start.probes + np.append(at.shared, 0.0 * at.shared[:, :1], axis=1)[:, at.offsets]
        )
        residual = (self.values(offsets) - self.values(at.truth.probes) - errors) / self.uncertainty
        at.squares[:] += (residual**2).sum(axis=1)
        forces = np.zeros(offsets.shape)
        first = 0
        for star, probes, basis in zip(self.stars, self.probes, self.bases, strict=True):
            star_columns = slice(first, first + basis.shape[1])
            # A force on a tip in the star's frame, turned into the machine's. The rotation itself
            # adds nothing: the sum of squares is least there.
            pull = (residual[:, star_columns] / self.uncertainty[star_columns]) @ basis.T
            turned = pull.reshape(len(pull), *star.coordinates.shape) @ star.rotation(
                offsets[:, probes]
            ).swapaxes(-1, -2)
            forces[:, probes] += turned
            first = star_columns.stop
        probe, axis = np.nonzero(at.offsets >= 0)
        at.by_shared[:, at.offsets[probe, axis]] += forces[:, probe, axis]


def observed_stars(stars: Sequence[Star], names: Sequence[str]) -> Stars:
    """Return the shapes of stars of the named probes."""
    shapes = [_shape(star) for star in stars]
    count = [len(places) for _, places in shapes]
    return Stars(
        tuple(stars),
        tuple(np.array([names.index(name) for name in star.probes], np.int64) for star in stars),
        tuple(basis for basis, _ in shapes),
        np.repeat(np.arange(len(stars)), count),
        np.concatenate([places for _, places in shapes]),
        np.concatenate(
            [
                star.coordinates.ravel() @ basis
                for star, (basis, _) in zip(stars, shapes, strict=True)
            ]
        ),
        np.repeat([star.standard_uncertainty for star in stars], count),
    )


def _turned(star: Star, probes: Integers, design: Design, x: Array) -> Array:
    """Return offsets (l, d) of a star's tips, turned as readings of the same balls in the same
    positions indicate; unchanged without such readings.
    """
    drawn, readings = design.probes.offsets[probes], design.readings
    rows = np.flatnonzero(np.isin(readings.probe, probes))
    tip = np.argmax(readings.probe[rows][:, None] == probes, axis=1)
    key = readings.position[rows] * len(design.balls.names) + readings.ball[rows]
    _, place, count = np.unique(key, return_inverse=True, return_counts=True)
    # Every ball in every position has a place of its own, whatever it is read with: tip and scale
    # reading together.
    counts = np.zeros((len(count), len(probes)))
    total = np.zeros((len(count), len(probes), x.shape[1]))
    np.add.at(counts, (place, tip), 1.0)
    np.add.at(total, (place, tip), x[rows])
    times = counts.sum(axis=1)
    # Normal equations of x = place - offset with the unknown places eliminated: every place takes
    # the mean of its readings out of them. A common shift of all offsets stays open, and the rank
    # is one less than the number of tips if readings connect all of them.
    weights = np.diag(counts.sum(axis=0)) - counts.T @ (counts / times[:, None])
    sides = -(total.sum(axis=0) - counts.T @ (total.sum(axis=1) / times[:, None]))
    offsets, _, rank, _ = lstsq(weights, sides, rcond=1e-9)
    if rank < len(probes) - 1:
        return drawn
    # Differences of offsets alone are known here, hence the rotation about their mean.
    alone = replace(star, has_place=False)
    turn = alone.rotation(offsets)
    if star.has_place:
        return star.coordinates @ turn.T
    held_probes = np.flatnonzero(~design.probes.free[probes].any(axis=1))
    turned = star.coordinates @ turn.T
    reference_probes = held_probes if len(held_probes) else np.arange(len(probes))
    return turned + (drawn[reference_probes] - turned[reference_probes]).mean(axis=0)
