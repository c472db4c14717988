"""Distances, balls and radii that may be calibrated."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from ballplate.simulator.design import CoordinateCalibration, DistanceCalibration, RadiusCalibration
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.geometry import BallLayout, BryanGaugeSettings, TwoSpheresSettings, pairs
from ballplate.simulator.inputs import Indices, LengthFunction, format_length

from .changes import Change, ChangeKind
from .written import length_function, written_length

# Distances between two balls that are offered, without sides and diagonals.
MOST_DISTANCES = 10


def certificates(experiment: Experiment) -> Iterator[Change]:
    """Distances and balls of plates, and lengths of bars and gauges, not calibrated yet."""
    u = LengthFunction(float(experiment.machine.repeatability.min()))
    for name, settings in experiment.artefacts.items():
        layout = experiment.layouts[name]
        items = [item for item in experiment.calibration if item.artefact == name]
        if isinstance(settings, BryanGaugeSettings):
            if not items:
                radius = RadiusCalibration(name, settings.radius, u.constant)
                words = f"calibrate the radius of {name} to {format_length(u.constant)}"
                yield Change(ChangeKind.CERTIFICATE, words, f"length of {name}", radius, values=1)
        elif settings.role == "plate":
            yield from _of_plate(experiment, name, layout, u)
        elif isinstance(settings, TwoSpheresSettings) and not items:
            pair = np.array([[0, 1]], np.intp)
            yield _distances(experiment, name, f"distance of the balls of {name}", pair, u)


def _of_plate(
    experiment: Experiment, name: str, layout: BallLayout, u: LengthFunction
) -> Iterator[Change]:
    calibrations = [item for item in experiment.calibration if item.artefact == name]
    distances = [item for item in calibrations if isinstance(item, DistanceCalibration)]
    stated = [item.standard_uncertainty for item in distances]
    # As good as the certificate that there is.
    like = next((each for each in stated if each not in (None, LengthFunction(0.0))), u) or u
    calibrated = {frozenset(pair) for item in distances for pair in item.pairs.tolist()}
    for words, chosen in _natural_distances(layout, name):
        if any(frozenset(pair) not in calibrated for pair in chosen.tolist()):
            yield _distances(experiment, name, words, chosen, like)
    if any(isinstance(item, CoordinateCalibration) for item in calibrations):
        return
    axes = tuple(range(experiment.dimension))
    for words, balls in (("corner balls", layout.corner_set), ("balls", range(len(layout.names)))):
        if balls:
            indices = np.array(balls, np.intp)
            values = layout.coordinates[indices][:, list(axes)]
            uncertainties = np.full(len(axes), like.constant or u.constant)
            item = CoordinateCalibration(name, indices, axes, values, False, uncertainties)
            text = f"calibrate the co-ordinates of the {len(balls)} {words} of {name}"
            text += f" to {written_length(float(uncertainties[0])).replace(' um', ' µm')}"
            kind, subject = ChangeKind.CERTIFICATE, f"co-ordinates of {name}"
            yield Change(kind, text, subject, item, values=values.size)


def _distances(
    experiment: Experiment, artefact: str, words: str, chosen: Indices, u: LengthFunction
) -> Change:
    """Return the change of calibrating distances between pairs (m, 2) of balls."""
    dimensions: Any = 2 if experiment.dimension == 2 else 3
    ends = experiment.layouts[artefact].coordinates[chosen][:, :, :dimensions]
    values = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    item = DistanceCalibration(
        artefact, chosen, dimensions, values, False, u, u.at(values), "distance", "included"
    )
    text = f"calibrate the {words} to {length_function(u).replace(' um', ' µm')}"
    subject = f"distances {artefact} {chosen.tolist()}"
    return Change(ChangeKind.CERTIFICATE, text, subject, item, values=len(chosen))


def _natural_distances(layout: BallLayout, name: str) -> Iterator[tuple[str, Indices]]:
    """Return words and pairs (m, 2): single sides, diagonals and distances between outer balls,
    and sets of pairs.
    """
    sets = ("corner sides", "corner diagonals")
    singles = [tuple(pair) for each in sets for pair in layout.pair_sets.get(each, ())]
    first, second = np.triu_indices(len(layout.names), 1)
    lengths = np.linalg.norm(layout.coordinates[first] - layout.coordinates[second], axis=1)
    longest = np.argsort(-np.round(lengths, 9), kind="stable")[:MOST_DISTANCES]
    singles += [(int(first[k]), int(second[k])) for k in longest]
    by_pair = {frozenset(pair): pair for pair in reversed(singles)}
    for pair in reversed(by_pair.values()):
        ends = "-".join(layout.names[ball] for ball in pair)
        yield f"distance {ends} of {name}", np.array([pair], np.intp)
    for each, words in (
        ("corner sides", "four sides"),
        ("corner diagonals", "two diagonals"),
        ("neighbours", "distances between neighbours"),
        ("braced", "braced net of distances"),
    ):
        if each in layout.pair_sets:
            yield f"{words} of {name} ({len(layout.pair_sets[each])})", pairs(layout, each)
