"""Detection of standards whose lengths are all read too long or too short by one factor.

Scale errors of the machine would explain that as well, so that no fit shows it; but no scale has
such an error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.computing import svd
from ballplate.simulator.design import Design, Lengths
from ballplate.simulator.geometry import FLAT, fit_sphere
from ballplate.simulator.machines import Array

# Departures of the factor from one that are doubtful, and that no machine has; a length that is
# only drawn may be off.
DOUBTFUL, IMPOSSIBLE = 1e-3, 1e-2
OFF_DRAWING = 0.3

# Half of the lengths agree with the factor to within this share of its departure from one.
AGREEMENT = 0.25


@dataclass(frozen=True)
class LengthRatio:
    """Read lengths of an artefact over stated ones, the same `ratio` for all; the first has been
    read in `reading`.

    Lengths that are not known have been drawn.
    """

    artefact: int
    ratio: float
    stated: float
    reading: int
    is_radius: bool
    is_known: bool

    @property
    def is_impossible(self) -> bool:
        """True if no machine has such a scale error."""
        return abs(self.ratio - 1.0) > (IMPOSSIBLE if self.is_known else OFF_DRAWING)


def doubtful_lengths(design: Design, x: Array) -> tuple[LengthRatio, ...]:
    """Artefacts whose stated lengths are off by a common factor of more than 0.1 %, from readings x
    (readings, d).

    Of unknown lengths the drawn ones, if they are off by more than 30 %.
    """
    lengths, readings = design.of(Lengths), design.readings
    is_certified = np.ones(len(lengths), bool) if lengths.free is None else lengths.free < 0
    places = x + design.probes.offsets[readings.probe]
    artefact = design.balls.artefact[readings.ball[lengths.first]]
    doubtful = []
    for number in np.unique(artefact):
        mine = np.flatnonzero(artefact == number)
        is_known = bool(is_certified[mine[0]])
        is_radius = bool(lengths.to_pivot[mine[0]])
        if is_radius:
            ratios = _of_radii(design, places, mine)
        else:
            apart = places[lengths.first[mine]] - places[lengths.second[mine]]
            size = np.sqrt((apart**2).sum(axis=1))
            along = np.abs((apart * lengths.direction[mine]).sum(axis=1))
            ratios = np.where(lengths.projected[mine], along, size) / lengths.value[mine]
        if not len(ratios):
            continue
        ratio = float(np.median(ratios))
        agree = float(np.median(np.abs(ratios - ratio))) < AGREEMENT * abs(ratio - 1.0)
        if abs(ratio - 1.0) > (DOUBTFUL if is_known else OFF_DRAWING) and agree:
            first = mine[0]
            stated_value, reading = (
                float(lengths.value[first]),
                int(lengths.first[first]),
            )
            doubtful.append(
                LengthRatio(int(number), ratio, stated_value, reading, is_radius, is_known)
            )
    return tuple(doubtful)


def _of_radii(design: Design, places: Array, rows: np.ndarray) -> Array:
    """Return radii of the spheres through the readings over the stated one, without poorly
    determined ones.
    """
    lengths = design.of(Lengths)
    position = design.readings.position[lengths.first[rows]]
    ratios = []
    for k in np.unique(position):
        points = places[lengths.first[rows[position == k]]]
        centre, radius = fit_sphere(points, design.positions.origins[k])
        away = points - centre
        size = np.sqrt((away**2).sum(axis=1))
        _, values, vh = svd(
            np.column_stack([away / size[:, None], np.ones(len(size))]), full_matrices=False
        )
        if len(points) <= len(values) or values[-1] < FLAT * values[0]:
            continue
        scatter = np.sqrt(((size - radius) ** 2).sum() / (len(points) - len(values)))
        uncertainty = scatter * np.sqrt(((vh[:, -1] / values) ** 2).sum())
        ratio = radius / lengths.value[rows[0]]
        if abs(ratio - 1.0) * lengths.value[rows[0]] > 10.0 * uncertainty:
            ratios.append(ratio)
    return np.array(ratios)
