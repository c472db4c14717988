"""Distances and radii that may be calibrated."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from ballplate.simulator.design import DistanceCalibration, Indices, RadiusCalibration
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.geometry import BallLayout, BryanGaugeSettings, TwoSpheresSettings, pairs
from ballplate.simulator.inputs import LengthFunction, format_length

from .changes import Change, ChangeKind, distances, with_calibration
from .written import length_function

# Distances between two balls of a line.
MOST_DISTANCES = 200


def certificates(experiment: Experiment) -> Iterator[Change]:
    """Distances of plates and lengths of bars and gauges that are not calibrated yet."""
    for name, settings in experiment.artefacts.items():
        layout = experiment.layouts[name]
        if isinstance(settings, BryanGaugeSettings):
            if not any(item.artefact == name for item in experiment.calibration):
                u = float(experiment.machine.repeatability.min())
                radius = RadiusCalibration(name, settings.radius, u)
                add = partial(with_calibration, item=radius)
                words = f"calibrate the radius of {name} to {format_length(u)}"
                yield Change(
                    ChangeKind.CERTIFICATE, words, 1.0, frozenset({f"length of {name}"}), add
                )
            continue
        if settings.role != "plate" and not isinstance(settings, TwoSpheresSettings):
            continue
        calibrations = [item for item in experiment.calibration if item.artefact == name]
        if settings.role != "plate" and calibrations:
            continue
        like = like_distances(experiment, name)
        calibrated = {
            frozenset(pair)
            for item in calibrations
            if isinstance(item, DistanceCalibration)
            for pair in item.pairs.tolist()
        }
        for words, chosen in natural_distances(layout):
            if any(frozenset(pair) not in calibrated for pair in chosen.tolist()):
                new = distances(like, layout, chosen)
                yield calibrated_distances(name, words, new)


def calibrated_distances(artefact: str, words: str, item: DistanceCalibration) -> Change:
    """The change of calibrating distances."""
    assert item.standard_uncertainty is not None
    u = length_function(item.standard_uncertainty).replace(" um", " µm")
    change_words = f"calibrate the {words.replace('{}', artefact)} to {u}"
    touched = frozenset(
        f"distance {artefact} {min(pair)} {max(pair)}" for pair in item.pairs.tolist()
    )
    return Change(
        ChangeKind.CERTIFICATE,
        change_words,
        float(len(item.pairs)),
        touched,
        partial(with_calibration, item=item),
        item,
    )


def like_distances(experiment: Experiment, artefact: str) -> DistanceCalibration:
    """Return distances of an artefact without any, with the uncertainty of its other calibrations,
    or else of readings.
    """
    calibrations = [
        c
        for c in experiment.calibration
        if isinstance(c, DistanceCalibration)
        and c.artefact == artefact
        and c.standard_uncertainty not in (None, LengthFunction(0.0))
    ]
    uncertainty = (
        calibrations[0].standard_uncertainty
        if calibrations
        else LengthFunction(float(experiment.machine.repeatability.min()))
    )
    none, no_pairs = np.zeros(0), np.zeros((0, 2), np.intp)
    dimensions: Any = 2 if experiment.dimension == 2 else 3
    return DistanceCalibration(
        artefact, no_pairs, dimensions, none, False, uncertainty, none, "distance", "included"
    )


def natural_distances(layout: BallLayout) -> Iterator[tuple[str, Indices]]:
    """Return names and pairs (m, 2) of single distances along the edges, diagonals and rows, and
    of sets of these pairs.
    """
    n = len(layout.names)
    if n < 2:
        return
    if n == 2:
        yield "distance of its balls on {}", np.array([[0, 1]], np.intp)
        return
    singles = [
        pair
        for name in ("corner sides", "corner diagonals")
        for pair in layout.pair_sets.get(name, ())
    ]
    if not layout.pair_sets:
        far = np.linalg.norm(layout.coordinates[:, None] - layout.coordinates[None], axis=2)
        order = np.argsort(-far[np.triu_indices(n, 1)], kind="stable")[:10]
        singles = [(int(i), int(j)) for i, j in np.column_stack(np.triu_indices(n, 1))[order]]
    singles += row_pairs(layout)
    for pair in dict.fromkeys(singles):
        first, second = (layout.names[k] for k in pair)
        yield f"distance {first}-{second} of {{}}", np.array([pair], np.intp)
    for name, words in (
        ("corner sides", "four sides of {}"),
        ("corner diagonals", "two diagonals of {}"),
        ("neighbours", "distances between neighbours on {}"),
        ("braced", "braced net of distances on {}"),
    ):
        if name in layout.pair_sets:
            yield f"{words} ({len(layout.pair_sets[name])})", pairs(layout, name)


def row_pairs(layout: BallLayout) -> list[tuple[int, int]]:
    """Return pairs of an outer ball and the balls on its line along x or y, at most
    `MOST_DISTANCES`, evenly spread.
    """
    chosen_pairs = []
    xy = np.round(layout.coordinates[:, :2], 9)
    for across, along in ((1, 0), (0, 1)):
        for line in np.unique(xy[:, across]):
            members = np.flatnonzero(xy[:, across] == line)
            members = members[np.argsort(xy[members, along], kind="stable")]
            chosen_pairs += [(int(members[0]), int(member)) for member in members[:0:-1]]
    if len(chosen_pairs) <= MOST_DISTANCES:
        return chosen_pairs
    return [
        chosen_pairs[k] for k in np.linspace(0, len(chosen_pairs) - 1, MOST_DISTANCES).astype(int)
    ]
