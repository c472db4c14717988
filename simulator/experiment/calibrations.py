"""Conversion of the settings of a calibration into ball indices, values and uncertainties."""

from __future__ import annotations

from typing import cast

import numpy as np

from ..geometry.artefacts import COINCIDENT, BallLayout, BryanGaugeSettings, frozen, pairs
from ..inputs.messages import ExperimentError, Steps
from ..inputs.settings import hint, listing
from ..inputs.tables import read_table
from ..inputs.yamltree import Mark, mark_of
from .model import (
    Calibration,
    CoordinateCalibration,
    DistanceCalibration,
    Floats,
    Indices,
    RadiusCalibration,
)
from .position_sections import CoordinatesSettings, DistancesSettings, RadiusSettings
from .references import References

AXES = ("x", "y", "z")

# Balls tied to one another by distances are estimated together, with memory that grows as the
# square of their number.
MOST_TIED_BALLS = 3000

# A certified distance that differs from the drawing by more than this fraction is a slip of the
# pen.
FAR_FROM_DRAWING = 0.1

# What balls may be off a plane that they are drawn in, in metres.
HARDLY_FLAT = 1e-3


def resolve_calibration(
    settings: DistancesSettings | CoordinatesSettings | RadiusSettings,
    steps: Steps,
    references: References,
) -> Calibration | None:
    """Return a calibration with its indices and values, or None after saying what is wrong."""
    artefact = references.artefact(settings.artefact, steps)
    if artefact is None or artefact not in references.layouts:
        return None
    if isinstance(settings, RadiusSettings):
        return _radius(settings, artefact, steps, references)
    if isinstance(references.artefacts[artefact], BryanGaugeSettings):
        text = f'"{artefact}" is a Bryan gauge and has a radius only; use kind: radius'
        references.problems.add((*steps, "kind"), text)
        return None
    if isinstance(settings, DistancesSettings):
        return _distances(settings, artefact, steps, references)
    return _coordinates(settings, artefact, steps, references)


def _radius(
    settings: RadiusSettings, artefact: str, steps: Steps, references: References
) -> RadiusCalibration | None:
    gauge = references.artefacts[artefact]
    if not isinstance(gauge, BryanGaugeSettings):
        text = f'only a Bryan gauge has a radius, and "{artefact}" is not one; use kind: distances'
        references.problems.add((*steps, "kind"), text)
        return None
    value = gauge.radius if settings.value is None else settings.value
    text = f"{far_from_drawing(value, gauge.radius)}; correct one of the two"
    if not references.require(
        abs(value - gauge.radius) <= FAR_FROM_DRAWING * gauge.radius, (*steps, "value"), text
    ):
        return None
    return RadiusCalibration(artefact, value, settings.standard_uncertainty)


def far_from_drawing(certified: float, drawn: float) -> str:
    """Say that a certified length is not that of the drawing."""
    return (
        f"{1e3 * certified:.6g} mm is far from the {1e3 * drawn:.6g} mm of the artefact's drawing"
    )


def _distances(
    settings: DistancesSettings, artefact: str, steps: Steps, references: References
) -> DistanceCalibration | None:
    layout, is_right = references.layouts[artefact], True
    if references.artefacts[artefact].role != "length_standard":
        for key in ("form", "repeatability"):
            if key in settings.model_fields_set:
                text = (
                    "is only for artefacts with role: length_standard; remove it, or give"
                    f' "{artefact}" that role'
                )
                references.problems.add((*steps, key), text, of_key=True)
                is_right = False
    if references.dimension == 2 and settings.dimensions == 3:
        text = "a two-dimensional experiment has distances in 2 dimensions; remove it"
        references.problems.add((*steps, "dimensions"), text)
        is_right = False
    dimensions = settings.dimensions or 3
    if references.dimension == 2:
        dimensions = 2
    indices = _pairs(settings.pairs, layout, (*steps, "pairs"), references)
    if indices is None or references.dimension is None:
        return None
    if not _can_be_tied(len(np.unique(indices)), (*steps, "pairs"), references):
        return None
    difference = (layout.coordinates[indices[:, 1]] - layout.coordinates[indices[:, 0]])[
        :, :dimensions
    ]
    nominal = np.linalg.norm(difference, axis=1)
    if np.any(nominal < COINCIDENT):
        i, j = indices[int(np.argmin(nominal))]
        text = (
            f'balls "{layout.names[i]}" and "{layout.names[j]}" have no distance in the plane; use'
            " dimensions: 3"
        )
        references.problems.add((*steps, "pairs"), text)
        return None
    values = _certified_distances(
        settings, indices, layout, nominal, (*steps, "values"), references
    )
    if values is None or not is_right:
        return None
    indices.setflags(write=False)
    return DistanceCalibration(
        artefact,
        indices,
        dimensions,
        frozen(values),
        settings.values is not None,
        settings.standard_uncertainty,
        frozen(settings.standard_uncertainty.at(nominal)),
        settings.form,
        settings.repeatability,
    )


def _can_be_tied(balls: int, steps: Steps, references: References) -> bool:
    text = (
        f"distances tie {balls} balls together, at most {MOST_TIED_BALLS} are possible; "
        "calibrate fewer distances, such as corner sides, or co-ordinates"
    )
    return references.require(balls <= MOST_TIED_BALLS, steps, text)


def _pairs(
    selection: str | tuple[tuple[str, str], ...],
    layout: BallLayout,
    steps: Steps,
    references: References,
) -> Indices | None:
    if isinstance(selection, str):
        # Pairs of all these balls would fill the memory before they can be refused.
        if selection == "all" and not _can_be_tied(len(layout.names), steps, references):
            return None
        try:
            found = pairs(layout, selection)
        except ValueError as error:
            references.problems.add(steps, str(error))
            return None
        if not references.require(
            len(found) > 0, steps, "the artefact has a single ball and no pairs; remove it"
        ):
            return None
        return found
    index = {name: i for i, name in enumerate(layout.names)}
    seen: dict[frozenset[str], int] = {}
    is_right = True
    for i, names in enumerate(selection):
        for j, name in enumerate(names):
            text = f'unknown ball "{name}"; {hint(name, layout.names) if name not in index else ""}'
            is_right &= references.require(name in index, (*steps, i, j), text)
        text = f'a ball has no distance from itself; name two balls, not "{names[0]}" twice'
        is_right &= references.require(names[0] != names[1], (*steps, i), text)
        pair = frozenset(names)
        text = f"is already in entry [{seen.get(pair)}]; remove one of the two"
        is_right &= references.require(pair not in seen, (*steps, i), text)
        seen.setdefault(pair, i)
    return (
        np.array([[index[a], index[b]] for a, b in selection], dtype=np.intp) if is_right else None
    )


def _certified_distances(
    settings: DistancesSettings,
    indices: Indices,
    layout: BallLayout,
    nominal: Floats,
    steps: Steps,
    references: References,
) -> Floats | None:
    if settings.values is None:
        return nominal
    problems = references.problems
    # Two names, the distance, and where it is written.
    entries: list[tuple[tuple[str, str], float, Mark, Steps]]
    if isinstance(settings.values, str):
        try:
            rows = read_table(
                references.folder / settings.values, ["ball_1", "ball_2"], ["distance"]
            )
        except ExperimentError as error:
            problems.take(error, steps)
            return None
        entries = [
            (cast(tuple[str, str], row.texts), row.lengths[0], row.mark, steps) for row in rows
        ]
    else:
        entries = [
            (entry.balls, entry.distance, mark_of(problems.root, (*steps, i)), (*steps, i))
            for i, entry in enumerate(settings.values)
        ]
    before, known = len(problems.messages), set(layout.names)
    by_pair: dict[frozenset[str], float] = {}
    for names, distance, mark, place in entries:
        for name in names:
            if name not in known:
                problems.add_at(mark, place, f'unknown ball "{name}"; {hint(name, layout.names)}')
        pair = frozenset(names)
        if len(pair) == 1:
            problems.add_at(
                mark,
                place,
                f'a ball has no distance from itself; name two balls, not "{names[0]}" twice',
            )
        if pair in by_pair:
            text = (
                f'the distance of "{names[0]}" and "{names[1]}" is given twice; remove one of'
                " the two"
            )
            problems.add_at(mark, place, text)
        if distance <= 0:
            problems.add_at(mark, place, "a distance must be above zero; correct it")
        by_pair[pair] = distance
    wanted = [(layout.names[i], layout.names[j]) for i, j in indices]
    missing = [f"{a}–{b}" for a, b in wanted if frozenset((a, b)) not in by_pair]
    drawn = {frozenset(pair): float(length) for pair, length in zip(wanted, nominal, strict=True)}
    for names, distance, mark, place in entries:
        expected = drawn.get(frozenset(names))
        if (
            expected is not None
            and distance > 0
            and not abs(distance - expected) <= FAR_FROM_DRAWING * expected
        ):
            text = f"{far_from_drawing(distance, expected)}; correct one of the two"
            problems.add_at(mark, place, text)
    if missing and len(problems.messages) == before:
        problems.add(steps, f"no distance for {listing(missing)}; add it, or leave it out of pairs")
    if len(problems.messages) > before:
        return None
    return np.array([by_pair[frozenset(pair)] for pair in wanted])


def far_spread(values: Floats, drawn: Floats) -> str:
    """What is wrong with certified co-ordinates (m, axes) whose spread is not that of the drawing;
    empty if nothing is.

    Where their axes begin may be another place than in the drawing.
    """
    # Root mean squares. A plate that is flat as drawn is not quite so as certified.
    found, expected = (
        float(np.sqrt(((one - one.mean(axis=0)) ** 2).sum(axis=1).mean()))
        for one in (values, drawn)
    )
    if abs(found - expected) <= FAR_FROM_DRAWING * expected + HARDLY_FLAT:
        return ""
    times = f"{found / expected:.3g} times as far apart as in the artefact's drawing"
    return f"the balls of these co-ordinates are {times}; correct one of the two"


def _coordinates(
    settings: CoordinatesSettings, artefact: str, steps: Steps, references: References
) -> CoordinateCalibration | None:
    problems, layout, dimension = (
        references.problems,
        references.layouts[artefact],
        references.dimension,
    )
    if references.artefacts[artefact].role == "length_standard":
        text = (
            "a length standard carries distances only; use kind: distances, or remove its role:"
            " length_standard"
        )
        problems.add((*steps, "kind"), text)
        return None
    uncertainty = settings.standard_uncertainty
    by_axis: dict[str, float] = (
        dict.fromkeys(AXES[:dimension], uncertainty)
        if isinstance(uncertainty, float)
        else uncertainty.stated
    )
    place = (*steps, "standard_uncertainty")
    is_right = references.require(
        bool(by_axis), place, "calibrates no axis; give at least one, such as {x: 0.2 um}"
    )
    text = "has no meaning in two dimensions; remove it"
    is_right &= references.require(dimension != 2 or "z" not in by_axis, (*place, "z"), text)
    balls = references.balls(settings.balls, layout, (*steps, "balls"))
    if balls is None or not is_right or dimension is None:
        return None
    values = _certified_coordinates(
        settings, balls, list(by_axis), layout, (*steps, "values"), references
    )
    if values is None:
        return None
    axes = tuple(AXES.index(axis) for axis in by_axis)
    return CoordinateCalibration(
        artefact,
        balls,
        axes,
        frozen(values),
        settings.values is not None,
        frozen(list(by_axis.values())),
    )


def _certified_coordinates(
    settings: CoordinatesSettings,
    balls: Indices,
    axes: list[str],
    layout: BallLayout,
    steps: Steps,
    references: References,
) -> Floats | None:
    problems = references.problems
    if settings.values is None:
        return layout.coordinates[balls][:, [AXES.index(axis) for axis in axes]]
    try:
        others = [axis for axis in AXES if axis not in axes]
        rows = read_table(references.folder / settings.values, ["ball"], axes, others)
    except ExperimentError as error:
        problems.take(error, steps)
        return None
    before, known = len(problems.messages), set(layout.names)
    by_ball: dict[str, tuple[float, ...]] = {}
    for row in rows:
        name = row.texts[0]
        if name not in known:
            problems.add_at(row.mark, steps, f'unknown ball "{name}"; {hint(name, layout.names)}')
        if name in by_ball:
            problems.add_at(
                row.mark, steps, f'ball "{name}" is listed twice; remove one of the two lines'
            )
        by_ball[name] = row.lengths[: len(axes)]
    missing = [layout.names[i] for i in balls if layout.names[i] not in by_ball]
    if missing and len(problems.messages) == before:
        problems.add(
            steps, f"no co-ordinates for {listing(missing)}; add them, or leave them out of balls"
        )
    if len(problems.messages) > before:
        return None
    found = np.array([by_ball[layout.names[i]] for i in balls])
    if text := far_spread(found, layout.coordinates[balls][:, [AXES.index(axis) for axis in axes]]):
        problems.add(steps, text)
        return None
    return found
