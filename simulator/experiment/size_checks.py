"""Checks that an experiment is not too large."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

import numpy as np
from ballplate.simulator.design.objects import Machine
from ballplate.simulator.design.observations.calibration import Calibration
from ballplate.simulator.design.observations.distances import DistanceCalibration
from ballplate.simulator.geometry.artefacts import BryanGaugeSettings
from ballplate.simulator.geometry.motions import pose_size
from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.number_arrays import Indices
from ballplate.simulator.machines.settings import build_error_model

from .model import Evaluation, Position, Probe
from .references import References
from .validation import Sections

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
    problems, settings = references.problems, sections.error_model
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
