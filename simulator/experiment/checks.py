"""Checks that need several sections: names used twice, balls outside the volume, balls never
read.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ..design.lookup import Indices, References
from ..design.objects import SLIGHTLY, Machine, Volume
from ..design.observations.calibration import Calibration
from ..design.observations.distances import DistanceCalibration
from ..design.observations.radius import RadiusCalibration
from ..geometry.artefacts import BryanGaugeSettings, TwoSpheresSettings
from ..geometry.motions import pose_size
from ..geometry.positions import ball_coordinates
from ..inputs.extensions import provided
from ..inputs.messages import ExperimentError, Steps
from ..inputs.number_arrays import Array
from ..inputs.problems import Problems, written_text
from ..inputs.quantities import format_length
from ..inputs.settings import listing, number_of
from ..inputs.yamltree import Mark
from ..machines.model_kinds import CustomModelError
from ..machines.settings import (
    build_error_model,
    kind_of,
)
from ..machines.true_machine_settings import FurtherTrueMachine, RandomSettings
from ..machines.truth import TruthError, true_machine
from .model import Evaluation, Position, Probe
from .structure import Sections

TOLERANCE = 1e-9

# Parameters besides those of the balls: their time grows with the cube of the number, their memory
# with its square.
MOST_SHARED = 3500
# Lengths that the standards contribute, each a row over the machine's errors.
MOST_LENGTHS = 20_000
# Lengths of a standard of which some have a ball in common, whose uncertainties are therefore
# treated together.
MOST_JOINT_LENGTHS = 3000
# Derivatives of the evaluation points by machine errors: for each point, axis and error.
MOST_DERIVATIVES = 50_000_000
AXES = ("x", "y", "z")


def check_error_model(sections: Sections, machine: Machine | None, references: References) -> None:
    """Report an error model for another number of dimensions than the volume has, or a user's own
    that is wrong.
    """
    settings = sections.get("error_model")
    if settings is not None and not _check_model(settings, ("error_model",), machine, references):
        # What is wrong may stand in another file; nothing can be built of it.
        del sections.values["error_model",]


def _check_model(
    settings: Any, steps: Steps, machine: Machine | None, references: References
) -> bool:
    """Report faults; return true if the settings can be used further."""
    kind, dimension = kind_of(settings), references.dimension
    try:
        kind.read(settings, references.folder, references.trust)
    except ExperimentError as error:
        references.problems.take(error, (*steps, "file"))
        return False
    if kind.is_code:
        if machine is None:
            return True
        try:
            build_error_model(settings, *machine.volume.corners)
        except CustomModelError as error:
            references.problems.add((*steps, error.key), str(error))
        return True
    if dimension is None:
        return True
    if dimension not in kind.dimensions:
        text = (
            f'kind "{settings.kind}" has {kind.dimensions[0]} dimensions, but machine.volume has'
            f" {dimension}; change one of the two"
        )
        references.problems.add((*steps, "kind"), text)
        return True
    wrong = list(kind.wrong(settings, dimension))
    for below, text in wrong:
        references.problems.add((*steps, *below), text)
    return not wrong


def check_true_machine(sections: Sections, machine: Machine | None, references: References) -> None:
    """Report a true machine whose own error model is wrong, or values that its error model cannot
    have.
    """
    settings, truth = sections.get("error_model"), sections.get("true_machine")
    if truth is None:
        return
    true_model = getattr(truth, "error_model", None)
    if true_model is not None and not _check_model(true_model, _TRUE_MODEL, machine, references):
        return
    if isinstance(truth, FurtherTrueMachine):
        read = provided("true_machines", vars(truth)["kind"], "read")
        assert read is not None
        read(truth, machine, references)
        return
    problems = references.problems
    if isinstance(truth, RandomSettings) and truth.position is None and truth.rotation is None:
        text = (
            "without sizes it is a machine without errors; give position: 2 um, rotation: 4 urad,"
            " or both"
        )
        problems.add(("true_machine",), text)
    if (
        settings is None
        or machine is None
        or problems.has_below(("error_model",))
        or problems.has_below(_TRUE_MODEL)
    ):
        return
    corners = machine.volume.corners
    model = build_error_model(settings, *corners)
    if isinstance(truth, RandomSettings):
        # Whatever is drawn is right.
        return
    try:
        true_machine(truth, model, *corners)
    except TruthError as error:
        for name, text in error.problems:
            problems.add(("true_machine", "values", name), text)


_TRUE_MODEL = ("true_machine", "error_model")


def check_names(position_count: int, problems: Problems) -> None:
    """Report positions that have the same name."""
    first: dict[str, int] = {}
    for i in range(position_count):
        name = written_text(problems.root, "positions", i, "name")
        if name is None:
            continue
        if name in first:
            text = (
                f'"{name}" is the name of positions[{first[name]}] already; names of positions must'
                " differ"
            )
            problems.add(("positions", i, "name"), text)
        first.setdefault(name, i)


def check_inside(
    position: Position,
    steps: Steps,
    volume: Volume,
    probes: Mapping[str, Probe],
    references: References,
) -> None:
    """Report readings with scale readings outside the measuring volume.

    Error models are functions of the scale readings, where the ball is less the probe's offset.
    Balls may be outside, and scale readings by a thousandth of the volume.
    """
    layout = references.layouts[position.artefact]
    rows = [
        (group.ball_indices, probe, probes[probe].offset)
        for group in position.readings
        for probe in group.probes
        if probe in probes and probes[probe].offset.shape == volume.lower.shape
    ]
    if not rows:
        return
    places = ball_coordinates(position.pose, layout)
    balls = np.concatenate([indices for indices, _, _ in rows])
    by_how_much, axes, sides = excess(
        np.concatenate([places[reading] - offset for reading, _, offset in rows]), volume
    )
    outside = np.flatnonzero(by_how_much > SLIGHTLY * (volume.upper - volume.lower)[axes])
    if len(outside) == 0:
        return
    # The first of those furthest outside, whatever rounding makes of equal ones.
    worst = int(outside[np.argmax(by_how_much[outside] > by_how_much.max() - TOLERANCE)])
    axis, probe = int(axes[worst]), [probe for indices, probe, _ in rows for _ in indices][worst]
    offset, place = float(probes[probe].offset[axis]), float(places[balls[worst], axis])
    others_text = f", and {number_of(len(outside) - 1, 'more reading')}" if len(outside) > 1 else ""
    less = (
        f" (the ball at {format_length(place)} less the offset of {format_length(offset)})"
        if offset
        else ""
    )
    remedy = "move the artefact"
    if AXES[axis] in position.parts:
        remedy = f"there is no room along {AXES[axis]}: take a smaller artefact"
    text = (
        f'reading ball "{layout.names[balls[worst]]}" with probe "{probe}" moves the scales to'
        f" {AXES[axis]} = {format_length(place - offset)}{less},"
        f" {format_length(by_how_much[worst])} {sides[worst]} the measuring volume{others_text};"
        f" {remedy}, or read it otherwise"
    )
    references.problems.add(steps, text)


def excess(points: Array, volume: Volume) -> tuple[Array, Array, list[str]]:
    """Return how far points (n, d) are outside the volume, along which axis, and on which side."""
    below, above = volume.lower - points, points - volume.upper
    by_axis = np.maximum(below, above)
    axes = np.argmax(by_axis, axis=1)
    rows = np.arange(len(points))
    sides = ["below" if is_below else "above" for is_below in below[rows, axes] > above[rows, axes]]
    return by_axis[rows, axes], axes, sides


def check_use(
    sections: Sections,
    positions: dict[int, Position],
    position_count: int,
    references: References,
    candidates: Collection[Position] | None = (),
    planning: bool = False,
) -> None:
    """Report artefacts without a position, unread balls of plates, and uncalibrated length
    standards of many balls.

    Without a certificate the length of a ball bar or a Bryan gauge is a parameter. ``candidates``
    of a pool (unknown if some are invalid) may set up an artefact; for ``planning`` they may read
    balls that no position reads.
    """
    problems = references.problems
    placed = set()
    uncertain = set()
    in_pool = (
        set(references.artefact_names)
        if candidates is None
        else {candidate.artefact for candidate in candidates}
    )
    readers = [*positions.values(), *(candidates or () if planning else ())]
    if planning:
        placed |= in_pool
        uncertain |= set(references.artefact_names) if candidates is None else set()
    for i in range(position_count):
        name = written_text(problems.root, "positions", i, "artefact")
        if name is None and len(references.artefact_names) == 1:
            name = references.artefact_names[0]
        # A position that cannot be understood may be one of any artefact, or read any ball of its
        # own.
        names = {name} if name in references.artefact_names else set(references.artefact_names)
        placed |= {str(name) for name in names}
        if i not in positions:
            uncertain |= {str(name) for name in names}
    for name in references.artefact_names:
        if not position_count and not readers:
            continue
        if name not in placed and name in in_pool:
            continue
        if name not in placed:
            problems.add(
                ("artefacts", name),
                "is never placed; add a position of it, or remove it",
                of_key=True,
            )
        elif name in references.layouts and name not in uncertain:
            _check_balls_read(
                name, [reader for reader in readers if reader.artefact == name], references
            )
    calibration_count = len(sections.entries("calibration"))
    for name, settings in references.artefacts.items():
        with_one_length = isinstance(settings, TwoSpheresSettings | BryanGaugeSettings)
        if (
            settings.role == "length_standard"
            and not with_one_length
            and not problems.has_below(("calibration",))
        ):
            kinds = (
                [
                    calibration.kind
                    for calibration in sections.entries("calibration").values()
                    if getattr(calibration, "artefact", "") in (name, None)
                ]
                if calibration_count
                else []
            )
            if "distances" not in kinds and "coordinates" not in kinds:
                text = (
                    "is a length standard without calibrated distances; add a calibration of kind:"
                    " distances"
                )
                problems.add(("artefacts", name), text, of_key=True)


def check_calibration_read(
    calibration: Calibration,
    steps: Steps,
    positions: dict[int, Position],
    position_count: int,
    references: References,
) -> None:
    """Report calibrated balls of a length standard that no position reads; of plates, all are
    reported.
    """
    if not isinstance(calibration, DistanceCalibration):
        return
    if references.artefacts[calibration.artefact].role != "length_standard":
        return
    if len(positions) < position_count:
        return
    artefact_positions = [
        position for position in positions.values() if position.artefact == calibration.artefact
    ]
    layout = references.layouts[calibration.artefact]
    unread = np.setdiff1d(calibration.pairs, read_balls(artefact_positions))
    if artefact_positions and len(unread):
        names = listing(layout.names[i] for i in unread)
        references.problems.add(
            (*steps, "pairs"),
            f"no position reads {_balls(len(unread))} {names}; read them, or leave them out",
        )


def check_radii(calibrations: Mapping[int, Calibration], problems: Problems) -> None:
    """Report a gauge whose radius is calibrated twice."""
    first: dict[str, int] = {}
    for i, calibration in calibrations.items():
        if not isinstance(calibration, RadiusCalibration):
            continue
        if calibration.artefact in first:
            text = (
                f'the radius of "{calibration.artefact}" is already in'
                f" calibration[{first[calibration.artefact]}]"
            )
            problems.add(("calibration", i), f"{text}; remove one of the two")
        first.setdefault(calibration.artefact, i)


def check_size(
    sections: Sections,
    machine: Machine | None,
    positions: Mapping[int, Position],
    calibrations: Mapping[int, Calibration],
    probes: Mapping[str, Probe],
    evaluation: Evaluation | None,
    references: References,
) -> None:
    """Report what would take more memory than a computer usually has, or hours."""
    problems, settings = references.problems, sections.get("error_model")
    if settings is None or machine is None or problems.has_below(("error_model",)):
        return
    d = machine.dimension
    plates = [
        position
        for position in positions.values()
        if references.artefacts[position.artefact].role == "plate"
    ]
    pivots = _pivots(positions.values(), references)
    errors = len(build_error_model(settings, *machine.volume.corners).parameters)
    offsets = sum(probe.is_estimated for probe in probes.values())
    shared = errors + pose_size(d) * len(plates) + d * (len(pivots) + offsets)
    if shared > MOST_SHARED:
        text = (
            f"{len(plates) + len(pivots)} poses, {errors} machine errors and {offsets} probe"
            f" offsets make {shared} parameters in addition to the balls; at most {MOST_SHARED} are"
            " possible: leave positions out, or give the machine fewer coefficients"
        )
        problems.add(("positions",), text, of_key=True)
    points = 0 if evaluation is None else len(evaluation.points)
    if points * d * errors > MOST_DERIVATIVES:
        text = (
            f"{points} points with {errors} machine errors have {points * d * errors} derivatives;"
            f" at most {MOST_DERIVATIVES // (d * errors)} points are possible with these errors"
        )
        problems.add(("evaluation", "points"), text)
    check_lengths(
        {("calibration", i): calibration for i, calibration in calibrations.items()},
        positions.values(),
        references,
    )


def _pivots(positions: Iterable[Position], references: References) -> list[Position]:
    """Positions of Bryan gauges."""
    kinds = references.artefacts
    return [
        position
        for position in positions
        if isinstance(kinds[position.artefact], BryanGaugeSettings)
    ]


def check_lengths(
    calibrations: Mapping[Steps, Calibration],
    positions: Collection[Position],
    references: References,
) -> None:
    """Report length standards and gauges that are read too often, and standards with too many
    lengths that have balls in common.
    """
    problems = references.problems
    rows = sum(pivot.count for pivot in _pivots(positions, references))
    if rows > MOST_LENGTHS:
        text = f"Bryan gauges are read {rows} times; at most {MOST_LENGTHS} lengths are possible"
        problems.add(("positions",), text, of_key=True)
    joint: dict[str, list[Indices]] = {}
    for steps, calibration in calibrations.items():
        name, place = calibration.artefact, (*steps, "pairs")
        if not isinstance(calibration, DistanceCalibration):
            continue
        if references.artefacts[name].role != "length_standard":
            continue
        times = sum(len(position.probes) for position in positions if position.artefact == name)
        if len(calibration.pairs) * times > MOST_LENGTHS:
            text = (
                f'{len(calibration.pairs)} distances of "{name}", read {times} times, are too'
                f" many; at most {MOST_LENGTHS} lengths are possible"
            )
            problems.add(place, text)
        elif calibration.repeatability == "included":
            joint.setdefault(name, []).append(calibration.pairs.ravel())
            ends = np.concatenate(joint[name])
            if len(ends) > 2 * MOST_JOINT_LENGTHS and np.bincount(ends).max() > 1:
                text = (
                    f'{len(ends) // 2} distances of "{name}" have balls in common; at most'
                    f" {MOST_JOINT_LENGTHS} such are possible: calibrate fewer of them"
                )
                problems.add(place, text)


def check_points(
    points: Array,
    steps: Steps,
    volume: Volume,
    problems: Problems,
    marks: Sequence[Mark] | None = None,
    of_one: bool = False,
) -> None:
    """Report points outside the volume: listed ones one by one, of a table (with ``marks``) the
    first.

    ``of_one``: the path is that of a single point, not of a list.
    """
    by_how_much, axes, sides = excess(points, volume)
    outside = np.flatnonzero(by_how_much > TOLERANCE)
    for i in outside if marks is None else outside[:1]:
        axis = int(axes[i])
        others_text = (
            f", as {len(outside) - 1} further points are"
            if marks is not None and len(outside) > 1
            else ""
        )
        text = (
            f"{AXES[axis]} = {format_length(points[i, axis])} is {format_length(by_how_much[i])}"
            f" {sides[i]} the measuring volume{others_text}; move the point inside"
        )
        if marks is None:
            problems.add(steps if of_one else (*steps, int(i)), text)
        else:
            problems.add_at(marks[int(i)], steps, text)


def read_balls(positions: Iterable[Position]) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Return the indices of the balls that are read in any of the positions of one artefact, in
    order.
    """
    return np.unique(
        np.concatenate([np.zeros(0, np.intp), *(position.balls for position in positions)])
    )


def _check_balls_read(name: str, positions: list[Position], references: References) -> None:
    layout = references.layouts[name]
    enabled = [position for position in positions if position.enabled]
    if not enabled:
        # An artefact whose positions are all switched off is left out with them.
        return
    unread = np.setdiff1d(np.arange(len(layout.names)), read_balls(enabled))
    if references.artefacts[name].role == "plate" and len(unread):
        names = listing(layout.names[i] for i in unread)
        text = (
            f"no position reads {_balls(len(unread))} {names}; read them, or leave them out of the"
            " artefact"
        )
        references.problems.add(("artefacts", name), text, of_key=True)


def _balls(count: int) -> str:
    return "ball" if count == 1 else "balls"
