"""Detection of readings that cannot be of the stated ball, and of their probable cause.

Two comparisons are made before anything is fitted, both of places after the best rigid motion of
each position:

- against the drawing: a reading is wrong if it is further from its ball's place than 0.3 of the
  distance from that ball to its nearest neighbour. A drawing that is off by a tenth of that
  distance passes.
- against the other readings of the same ball: a reading is wrong if it is further from their median
  than 0.02 of that distance *and* than ten times the median of all such differences. The latter is
  what the machine's own errors and the noise amount to, so that a bad machine is not taken for bad
  readings.

Uncertain probe offsets widen the second limit by six of their standard uncertainties, up to the
first limit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from ballplate.simulator.computing import svd
from ballplate.simulator.design import Design, Flags, Lengths, Priors, seen_places
from ballplate.simulator.estimation import initial_state
from ballplate.simulator.geometry import fit_motion
from ballplate.simulator.machines import Array, Integers

from .consensus import consensus_motion, distances
from .plate_sizes import read_in_positions

AGAINST_DRAWING = 0.3
# Extent across a line, as a fraction of that along it, below which balls are in one line.
FLAT = 1e-6
AGAINST_READINGS = 0.02
TIMES_USUAL = 10.0
TIMES_OFFSET = 6.0

# A different ball or probe explains a reading if it leaves no more than this share of the misfit.
EXPLAINED = 0.25


@dataclass(frozen=True)
class WrongReading:
    """A reading off by `misfit` (d,) metres; `other_ball`, `other_probe` explain it if they are
    not -1.

    `partner` is a reading with the reverse error (exchanged balls), or one that disagrees with
    this one without a decision between the two (`undecided`); -1 without.
    """

    reading: int
    misfit: Array
    other_ball: int = -1
    other_probe: int = -1
    partner: int = -1
    undecided: bool = False

    @property
    def is_unexplained(self) -> bool:
        return max(self.other_ball, self.other_probe, self.partner) < 0


@dataclass(frozen=True)
class WrongPosition:
    """A position whose readings fit the artefact turned onto itself, or in no pose at all.

    `turned` states the turn as text and is empty in the latter case, where only `agreeing` of
    `count` readings fit.
    """

    position: int
    turned: str
    agreeing: int
    count: int


@dataclass(frozen=True)
class _Motions:
    """Poses (k, d, d) and (k, d) that the readings of each position agree on, and which readings
    agree (m,).
    """

    rotations: Array
    origins: Array
    agreeing: Flags


def find_gross_errors(design: Design, x: Array) -> tuple[list[WrongPosition], list[WrongReading]]:
    """Return positions and readings that cannot be right, from scale readings x (readings, d).

    Readings of Bryan gauges pass: their directions need not be nominal.
    """
    compared = np.flatnonzero(~np.isin(design.readings.position, design.gauge_positions))
    if not len(compared):
        return [], []
    of_others = replace(design, readings=design.readings.select(compared)).observed(
        design.of(Lengths).select(np.zeros(0, np.int64))
    )
    positions, errors = _gross_errors(of_others, x[compared])
    back = np.append(compared, -1)
    return positions, [
        replace(error, reading=int(back[error.reading]), partner=int(back[error.partner]))
        for error in errors
    ]


def _gross_errors(design: Design, x: Array) -> tuple[list[WrongPosition], list[WrongReading]]:
    readings = design.readings
    places = seen_places(design, readings, x)
    pitch = ball_pitches(design)
    gross, positions = _against_drawing(design, places, pitch)
    lost = np.isin(readings.position, [wrong.position for wrong in positions])
    wrong = ~gross.agreeing & ~lost
    shape = design.balls.places
    pairs: list[tuple[int, int]] = []
    if not positions:
        gross, shape, wrong, pairs = _against_readings(design, x, places, pitch, gross, wrong)
    named = _explained(design, places, pitch, gross, shape, np.flatnonzero(wrong))
    for first, second in pairs:
        apart = _in_frame(gross, readings.position, places)
        named.append(
            WrongReading(first, apart[first] - apart[second], partner=second, undecided=True)
        )
    return positions, sorted(named, key=lambda reading: reading.reading)


def ball_pitches(design: Design) -> Array:
    """Distance (n,) from each ball to the nearest one of its artefact, infinite for a single
    ball.
    """
    from scipy.spatial import cKDTree

    pitch = np.full(len(design.balls.places), np.inf)
    for artefact in np.unique(design.balls.artefact):
        members = design.balls.of(artefact)
        if len(members) > 1:
            pitch[members] = cKDTree(design.balls.places[members]).query(
                design.balls.places[members], 2
            )[0][:, 1]
    return pitch


def _against_drawing(
    design: Design, places: Array, pitch: Array
) -> tuple[_Motions, list[WrongPosition]]:
    readings = design.readings
    rotations, origins = design.positions.rotations.copy(), design.positions.origins.copy()
    agreeing = np.ones(len(readings), bool)
    wrong = []
    for k, rows, nominal in read_in_positions(design, readings):
        if len(np.unique(readings.ball[rows])) < 2:
            origins[k] = (places[rows] - nominal @ rotations[k].T).mean(axis=0)
            continue
        reach = AGAINST_DRAWING * pitch[readings.ball[rows]]
        rotations[k], origins[k], agreeing[rows] = consensus_motion(nominal, places[rows], reach)
        count = int(agreeing[rows].sum())
        if 2 * count <= len(rows):
            wrong.append(WrongPosition(k, "", count, len(rows)))
        elif design.artefacts.is_plate[design.positions.artefact[k]] and not _in_line(nominal):
            turned = _turned_onto_itself(design, int(k), rotations[k], pitch)
            if turned:
                wrong.append(WrongPosition(k, turned, count, len(rows)))
    return _Motions(rotations, origins, agreeing), wrong


def _in_line(places: Array) -> bool:
    """True if points (m, d) lie on one line in space, about which any turn fits."""
    extent = svd(places - places.mean(axis=0), compute_uv=False)
    return places.shape[1] == 3 and bool(extent[1] < FLAT * extent[0])


def _turned_onto_itself(design: Design, position: int, rotation: Array, pitch: Array) -> str:
    """Return a description of the turn from the planned pose that moves every ball to another's
    location; possibly empty.
    """
    from scipy.spatial import cKDTree

    members = design.balls.of(design.positions.artefact[position])
    balls = design.balls.places[members]
    turn = design.positions.rotations[position].T @ rotation
    centre = balls.mean(axis=0)
    apart, nearest = cKDTree(balls).query((balls - centre) @ turn.T + centre)
    if (nearest == np.arange(len(members))).all() or (
        apart > AGAINST_DRAWING * pitch[members]
    ).any():
        return ""
    if design.dimension == 3 and turn[2, 2] < 0.5:
        return "over"
    return f"by {round(np.degrees(np.arctan2(turn[1, 0], turn[0, 0]))) % 360} degrees"


def _in_frame(motions: _Motions, position: Integers, places: Array) -> Array:
    """Return points at (m, d) in the frames of the artefacts."""
    return np.einsum("mji,mj->mi", motions.rotations[position], places - motions.origins[position])


def _against_readings(
    design: Design,
    x: Array,
    places_seen: Array,
    pitch: Array,
    motions_found: _Motions,
    wrong: Flags,
) -> tuple[_Motions, Array, Flags, list[tuple[int, int]]]:
    """Compare readings of the same ball, after assembling each plate from its positions.

    Returns the motions of the assembled artefacts, their shapes (n, d), a mask of gross errors,
    and pairs of readings with one gross error.
    """
    readings, wrong = design.readings, wrong.copy()
    right = np.flatnonzero(~wrong)
    # A ball without any reading keeps its place in the drawing.
    start = initial_state(replace(design, readings=readings.select(right)), x[right])
    rotations, origins, shape = start.rotations.copy(), start.origins.copy(), start.balls.copy()
    for k in np.flatnonzero(~design.artefacts.is_plate[design.positions.artefact]).tolist():
        rotations[k], origins[k] = motions_found.rotations[k], motions_found.origins[k]
    off_drawing = np.zeros(len(readings))
    for k, rows, nominal in read_in_positions(design, readings):
        off_drawing[rows] = distances(
            nominal, places_seen[rows], motions_found.rotations[k], motions_found.origins[k]
        )
    limit = (
        AGAINST_READINGS * pitch[readings.ball]
        + TIMES_OFFSET * _offset_uncertainties(design)[readings.probe]
    )
    limit = np.minimum(limit, AGAINST_DRAWING * pitch[readings.ball])
    undecided = []
    apart = np.zeros(len(readings))
    for sweep in range(12):
        motions = _Motions(rotations, origins, ~wrong)
        local = _in_frame(motions, readings.position, places_seen)
        use = np.flatnonzero(~wrong)
        shape, count = _medians(local[use], readings.ball[use], shape)
        apart = np.sqrt(((local - shape[readings.ball]) ** 2).sum(axis=1))
        several = ~wrong & (count[readings.ball] > 1)
        usual = float(np.median(apart[several])) if several.any() else 0.0
        # Two readings share their difference, which here is told apart in full.
        apart = np.where(count[readings.ball] == 2, 2.0 * apart, apart)
        suspect = several & (apart > np.maximum(limit, TIMES_USUAL * usual))
        if sweep >= 3:
            fresh = _worst_of_each_ball(readings.ball, apart, suspect & (count[readings.ball] > 2))
            # Two readings are equally far from their mean; the drawing may tell which of them is
            # wrong.
            halves = np.flatnonzero(suspect & (count[readings.ball] == 2))
            two = halves[np.argsort(readings.ball[halves], kind="stable")].reshape(-1, 2)
            clear = off_drawing[two].max(axis=1, initial=0.0) > 4 * off_drawing[two].min(
                axis=1, initial=np.inf
            )
            decided = two[clear]
            fresh[decided[np.arange(len(decided)), off_drawing[decided].argmax(axis=1)]] = True
            undecided = [(int(i), int(j)) for i, j in two[~clear]]
            if not fresh.any():
                break
            wrong |= fresh
            suspect = np.zeros(len(readings), bool)
        for k in design.plate_positions:
            rows = np.flatnonzero((readings.position == k) & ~wrong & ~suspect)
            if len(np.unique(readings.ball[rows])) > design.dimension:
                places = shape[readings.ball[rows]]
                if sweep < 2:
                    # What is wrong has spread to all motions; most readings agree on better ones.
                    rotations[k], origins[k], _ = consensus_motion(
                        places, places_seen[rows], limit[rows]
                    )
                else:
                    rotations[k], origins[k] = fit_motion(places, places_seen[rows])
    return _Motions(rotations, origins, ~wrong), shape, wrong, undecided


def _offset_uncertainties(design: Design) -> Array:
    """Return standard uncertainties (l,) of the probes' offsets in all axes, infinite for an
    unknown one.
    """
    variance = np.where(design.probes.free, np.inf, 0.0)
    uncertain = np.flatnonzero(design.of(Priors).probe >= 0)
    probe, axis = design.of(Priors).probe[uncertain], design.of(Priors).component[uncertain]
    variance[probe, axis] = design.of(Priors).uncertainty[uncertain] ** 2
    return np.sqrt(variance.sum(axis=1))


def _medians(local: Array, ball: Integers, otherwise: Array) -> tuple[Array, Integers]:
    """Return the median location (n, d) of the readings of each ball, and their number (n,)."""
    count = np.bincount(ball, minlength=len(otherwise))
    order = np.argsort(ball, kind="stable")
    place = np.arange(len(ball)) - (np.cumsum(count) - count)[ball[order]]
    table = np.full((len(otherwise), max(int(count.max(initial=0)), 1), local.shape[1]), np.nan)
    table[ball[order], place] = local[order]
    result = otherwise.copy()
    result[count > 0] = np.nanmedian(table[count > 0], axis=1)
    return result, count


def _worst_of_each_ball(ball: Integers, apart: Array, suspect: Flags) -> Flags:
    """Return the reading of each ball that is furthest off."""
    worst = np.zeros(len(ball), bool)
    rows = np.flatnonzero(suspect)
    rows = rows[np.argsort(-apart[rows], kind="stable")]
    worst[rows[np.unique(ball[rows], return_index=True)[1]]] = True
    return worst


def _explained(
    design: Design, places: Array, pitch: Array, motions: _Motions, shape: Array, wrong: Integers
) -> list[WrongReading]:
    """Return probable explanations of gross errors: another ball, another probe, or
    unexplained.
    """
    from scipy.spatial import cKDTree

    readings = design.readings
    named = []
    local = _in_frame(motions, readings.position, places)
    other_ball = np.full(len(readings), -1)
    for artefact in np.unique(design.balls.artefact[readings.ball[wrong]]):
        members = design.balls.of(artefact)
        tree = cKDTree(shape[members])
        rows = wrong[design.balls.artefact[readings.ball[wrong]] == artefact]
        apart, nearest = tree.query(local[rows])
        ball = members[nearest]
        misfit = np.sqrt(((local[rows] - shape[readings.ball[rows]]) ** 2).sum(axis=1))
        there = (apart < np.minimum(AGAINST_DRAWING * pitch[ball], EXPLAINED * misfit)) & (
            ball != readings.ball[rows]
        )
        other_ball[rows[there]] = ball[there]
    key = {
        (int(readings.position[i]), int(readings.probe[i]), int(readings.ball[i])): int(i)
        for i in wrong
    }
    # A loop over the wrong ones only, and these are few.
    for i in map(int, wrong):
        position, probe, ball_of = (
            int(readings.position[i]),
            int(readings.probe[i]),
            int(readings.ball[i]),
        )
        should = motions.rotations[position] @ shape[ball_of] + motions.origins[position]
        misfit_of = places[i] - should
        size = float(np.sqrt(misfit_of @ misfit_of))
        with_probe = np.sqrt(
            ((misfit_of + design.probes.offsets - design.probes.offsets[probe]) ** 2).sum(axis=1)
        )
        with_probe[probe] = np.inf
        other_probe = int(with_probe.argmin())
        if with_probe[other_probe] > min(EXPLAINED * size, AGAINST_DRAWING * pitch[ball_of]):
            other_probe = -1
        other_index = int(other_ball[i])
        if other_index >= 0 and other_probe >= 0:
            remainder = local[i] - shape[other_index]
            if with_probe[other_probe] < np.sqrt(remainder @ remainder):
                other_index = -1
            else:
                other_probe = -1
        partner = key.get((position, probe, other_index), -1) if other_index >= 0 else -1
        if partner >= 0 and other_ball[partner] != ball_of:
            partner = -1
        named.append(WrongReading(i, misfit_of, other_index, other_probe, partner))
    return named
