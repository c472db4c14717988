"""A part on a machine: the points that are touched in all places, with their tips and scales."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from ballplate.simulator.design import Design, Volume
from ballplate.simulator.inputs import Array, Integers, hint, listed

from .part import PartFeature, Place, Workpiece

# A stylus touches a surface from outside: the cosine of its direction with the outward normal.
ALONG = 0.1


@dataclass(frozen=True, eq=False)
class ProbingMachine:
    """What a machine measures parts with: its `volume`, and probes by `names` with `offsets` (l, 3)
    in metres, the one of index `probe` where several serve.
    """

    volume: Volume
    names: tuple[str, ...]
    offsets: Array
    probe: int


@dataclass(frozen=True, eq=False)
class TouchedPoints:
    """All n touched points of a part, feature by feature and place by place.

    `readings` (n, 3) are the scale readings of the tip's centre, `probes` (n,) indices of probes,
    `normals` (n, 3) away from the material. In the frame of the part, the surface is touched at
    `surface` (n, 3) with normals `of_part` (n, 3) by tips of `radii` (n,); lengths in metres.
    `rotations` (n, 3, 3) are those of places, and `rows` those of each feature in each place.
    """

    rows: Mapping[tuple[str, str], slice]
    readings: Array
    probes: Integers
    normals: Array
    surface: Array
    of_part: Array
    radii: Array
    rotations: Array

    @property
    def centres(self) -> Array:
        """Nominal centres (n, 3) of tips in the frame of the part."""
        return self.surface + self.radii[:, None] * self.of_part

    def in_place(self, name: str) -> slice:
        """Return the rows of all points in a place."""
        some = [rows for (place, _), rows in self.rows.items() if place == name]
        return slice(some[0].start, some[-1].stop)


def of_design(design: Design) -> ProbingMachine:
    """Return the machine of a design, with the probe of its evaluation points first."""
    probes = design.probes
    return ProbingMachine(
        design.machine.volume, probes.names, probes.offsets, design.evaluation.probe
    )


def touched(part: Workpiece, machine: ProbingMachine) -> TouchedPoints:
    """Return the points of a part on a machine.

    :raises ValueError: the machine has two axes, lacks a probe, or a point is outside its volume.
    """
    if machine.offsets.shape[1] != 3:
        raise ValueError("a part is measured on three axes, and the machine has two")
    tips = {name: part.probing.tip(name) for name in machine.names}
    columns, rows, start = [], {}, 0
    for place in part.places:
        for feature in part.features.values():
            probe = _probe(feature, place, machine, [k for k, t in enumerate(tips.values()) if t])
            tip = tips[machine.names[probe]]
            if tip is None:
                text = f'{feature.name}: no tip is stated for the probe "{machine.names[probe]}"'
                raise ValueError(f"{text}; state it under probing")
            radius = tip.diameter / 2
            if feature.nominal.is_inner and 0.0 < feature.nominal.radius <= radius:
                raise ValueError(f"a tip of {1e3 * tip.diameter:g} mm does not fit {feature.name}")
            out = feature.normals @ place.rotation.T
            centres = feature.points @ place.rotation.T + place.origin + radius * out
            columns.append(
                (
                    centres - machine.offsets[probe],
                    np.full(len(out), probe),
                    out,
                    feature.points,
                    feature.normals,
                    np.full(len(out), radius),
                    np.broadcast_to(place.rotation, (len(out), 3, 3)),
                )
            )
            rows[place.name, feature.name] = slice(start, start + len(out))
            start += len(out)
    arrays = (np.concatenate(column) for column in zip(*columns, strict=True))
    found = TouchedPoints(rows, *arrays)
    _ensure_inside(found, machine)
    return found


def _probe(feature: PartFeature, place: Place, machine: ProbingMachine, with_tip: list[int]) -> int:
    """Return the probe of a feature: its own, or of those with a tip the first whose stylus touches
    all of its points from outside, or else the one that comes nearest to it.
    """
    if feature.probe is not None:
        if feature.probe not in machine.names:
            known = hint(feature.probe, machine.names)
            raise ValueError(f'{feature.name}: no probe "{feature.probe}"; {known}')
        return machine.names.index(feature.probe)
    lengths = np.linalg.norm(machine.offsets, axis=1)
    styli = machine.offsets / np.where(lengths > 0.0, lengths, 1.0)[:, None]
    worst = (styli @ (feature.normals @ place.rotation.T).T).max(axis=1)
    return min(
        with_tip,
        key=lambda k: (max(worst[k], ALONG), k != machine.probe),
        default=machine.probe,
    )


def _ensure_inside(points: TouchedPoints, machine: ProbingMachine) -> None:
    lower, upper = machine.volume.of_readings
    beyond = (points.readings < lower) | (points.readings > upper)
    outside = [key for key, rows in points.rows.items() if beyond[rows].any()]
    if outside:
        place = outside[0][0]
        names = listed([feature for where, feature in outside if where == place])
        raise ValueError(
            f'in the place "{place}", scale readings of {names} are outside the machine\'s volume;'
            " change its origin"
        )
