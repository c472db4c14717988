"""The lengths that ball bars, Bryan gauges and other length standards contribute to a design."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import count

import numpy as np
from ballplate.simulator.design.arrays import Readings
from ballplate.simulator.design.objects import UnknownLengths
from ballplate.simulator.design.observations.distances import DistanceCalibration, RadiusCalibration
from ballplate.simulator.design.observations.lengths import Lengths
from ballplate.simulator.design.observations.whitening import at_least_exact
from ballplate.simulator.geometry.artefacts import BryanGaugeSettings, TwoSpheresSettings
from ballplate.simulator.inputs.number_arrays import Array, Integers

from .model import Experiment


@dataclass(frozen=True)
class _Row:
    """A length: indices of the readings of its ends (-1: pivot), its direction, and its value."""

    value: float
    certificate: tuple[object, int]
    uncertainty: float = 0.0
    projected: bool = False
    scatters: bool = True
    free: int = -1
    first: int = -1
    second: int = -1
    direction: tuple[float, ...] = ()


# In one piece: rows, names and drawn values are counted together, in the order of the file.
def standard_lengths(
    experiment: Experiment,
    readings: Readings,
    first_ball: dict[str, int],
    rotations: Array,
    position_artefact: Integers,
    balls: Array,
) -> tuple[Lengths, UnknownLengths]:
    """Return the lengths of all standards, and the unknown ones.

    A length standard contributes each of its calibrated distances once for every position and
    probe with which both its balls are read. The error of a certificate is the same in all of
    these, unless the readings' repeatability is ignored: then the stated uncertainty covers all
    deviations of a length, separately each time. A Bryan gauge contributes its radius with every
    reading. Without a certificate the length of a ball bar and the radius of a gauge are unknown,
    and the same in all readings.
    """
    artefacts = list(experiment.artefacts)
    rows: list[_Row] = []
    names = []
    standing = []
    drawn = []
    index_of_pair = {}
    standards = [
        k
        for k, artefact in enumerate(experiment.artefacts.values())
        if artefact.role == "length_standard"
    ]
    for i in np.flatnonzero(np.isin(position_artefact[readings.position], standards)).tolist():
        index_of_pair[int(readings.position[i]), int(readings.probe[i]), int(readings.ball[i])] = i
    # Certificates are told apart by keys: the item and its pair, or, without repeatability, a
    # number that no other length has.
    anew = count()

    def between(number: int, kinds: list[tuple[_Row, Array]]) -> Iterator[_Row]:
        for k in np.flatnonzero(position_artefact == number):
            for probe in range(len(experiment.probes)):
                for kind, pair in kinds:
                    first, second = (
                        index_of_pair.get((int(k), probe, int(ball)), -1) for ball in pair
                    )
                    if first < 0 or second < 0:
                        continue
                    along = rotations[k] @ (balls[pair[0]] - balls[pair[1]])
                    unit = along / np.sqrt(along @ along)
                    # What repeatability does not excuse is off anew each time.
                    source = kind.certificate if kind.scatters else ("anew", next(anew))
                    yield replace(
                        kind, first=first, second=second, direction=tuple(unit), certificate=source
                    )

    def unknown(name: str, noun: str, value: float) -> _Row:
        names.append(f"{name}: {noun}")
        standing.append(artefacts.index(name))
        drawn.append(value)
        return _Row(value=value, certificate=(name, 0), free=len(names) - 1)

    certified = set()
    for i, item in enumerate(experiment.calibration):
        certified.add(item.artefact)
        if (
            isinstance(item, DistanceCalibration)
            and experiment.artefacts[item.artefact].role == "length_standard"
        ):
            is_projected, scatters = item.form == "projection", item.repeatability == "included"
            uncertainty = item.standard_uncertainties
            # A length that scatters has at least the noise of its readings. One that does not has
            # no other weight than its stated uncertainty, which may be zero.
            if not scatters:
                uncertainty = at_least_exact(uncertainty)
            given = zip(item.pairs, item.values.tolist(), uncertainty.tolist(), strict=True)
            kinds = [
                (_Row(value, (i, j), u, is_projected, scatters), first_ball[item.artefact] + pair)
                for j, (pair, value, u) in enumerate(given)
            ]
            rows += between(artefacts.index(item.artefact), kinds)
    for number, (name, settings) in enumerate(experiment.artefacts.items()):
        if (
            isinstance(settings, TwoSpheresSettings)
            and settings.role == "length_standard"
            and name not in certified
        ):
            kind = unknown(name, "length", settings.length)
            rows += between(number, [(kind, first_ball[name] + np.array([0, 1]))])
        elif isinstance(settings, BryanGaugeSettings):
            calibrations = [
                calibration
                for calibration in experiment.calibration
                if calibration.artefact == name
            ]
            kind = (
                unknown(name, "radius", settings.radius)
                if not calibrations
                else _certified_radius(name, calibrations[0])
            )
            for k in np.flatnonzero(position_artefact[readings.position] == number):
                along = rotations[readings.position[k]] @ balls[readings.ball[k]]
                unit = along / np.sqrt(along @ along)
                rows.append(replace(kind, first=int(k), direction=tuple(unit)))
    unknown_lengths = UnknownLengths(
        tuple(names), np.array(standing, np.int64), np.array(drawn, float)
    )
    return _arrays(rows, experiment.dimension), unknown_lengths


def _certified_radius(name: str, item: object) -> _Row:
    assert isinstance(item, RadiusCalibration)
    return _Row(item.value, (name, 0), item.standard_uncertainty)


def _arrays(rows: list[_Row], dimension: int) -> Lengths:
    numbers = {
        certificate: i
        for i, certificate in enumerate(dict.fromkeys(row.certificate for row in rows))
    }
    return Lengths(
        np.array([row.first for row in rows], np.int64),
        np.array([row.second for row in rows], np.int64),
        np.array([row.value for row in rows], float),
        np.array([row.uncertainty for row in rows], float),
        np.array([row.projected for row in rows], bool),
        np.array([row.direction for row in rows], float).reshape(-1, dimension),
        np.array([row.scatters for row in rows], bool),
        np.array([numbers[row.certificate] for row in rows], np.int64),
        np.array([row.free for row in rows], np.int64),
    )
