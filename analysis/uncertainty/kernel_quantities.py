"""The quantities whose uncertainties are reported: U1 to U6 of NPL Report CISE 15/98, section 6,
and measuring tasks.

Extensions have further ones; `QUANTITIES` has all of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.parameters import SharedLayout
from ballplate.simulator.estimation.functions import (
    BallPlaces,
    Coordinates,
    Distances,
    Functions,
    MeasuredPoints,
    Parameters,
)
from ballplate.simulator.machines.error_names import SQUARENESS_ERRORS
from ballplate.simulator.machines.protocol import Unit


@dataclass(frozen=True)
class QuantityKind:
    """A kind of quantity: what its standard uncertainties are of, and the function that makes its
    functions.

    Functions in several groups are of the same kind, such as distances of several artefacts; a
    design without any has none of this quantity. `parts` split it by unit, each with a word and a
    description of its own; `unit` is that of the whole. `are_lengths` tells that it is about
    distances only, which a plan can make small, and `about_balls` that these are between balls.
    `effect` says in a few words what reliability looks at changes of, and is empty where it does
    not. `has_target` states whether it is compared with the target uncertainty of the file,
    `in_replicates` whether Monte Carlo follows it, and `is_recorded` whether a sweep records it
    by default. `one_by_one` tells each of its `Parameters` besides the largest. `needs` is what a
    design without it lacks.

    :raises ValueError: it is between balls, or has a target, and is not about distances.
    """

    description: str
    functions: Callable[[Design, SharedLayout], tuple[Functions, ...]]
    parts: dict[Unit, tuple[str, str]] = field(default_factory=dict)
    unit: str = ""
    are_lengths: bool = False
    about_balls: bool = False
    effect: str = ""
    has_target: bool = False
    in_replicates: bool = True
    is_recorded: bool = True
    one_by_one: bool = False
    needs: str = ""

    def __post_init__(self) -> None:
        if not self.are_lengths and (self.about_balls or self.has_target):
            raise ValueError(
                f'"{self.description}" has about_balls or has_target, which go with are_lengths;'
                " add that, or remove them"
            )


def evaluation_points(design: Design) -> MeasuredPoints:
    """The evaluation points as places, with the probe that they are evaluated with."""
    given = design.evaluation
    return MeasuredPoints(given.points, np.full(len(given.points), given.probe))


def task_distances(design: Design) -> Distances:
    """The lengths of the measuring tasks."""
    given = design.tasks
    ends = MeasuredPoints(given.points.reshape(-1, design.dimension), given.probes.ravel())
    pairs = np.arange(2 * len(given.names)).reshape(-1, 2)
    return Distances(ends, pairs, given.names, given.targets)


def _shared(layout: SharedLayout, columns: slice) -> tuple[Functions, ...]:
    """Some of the shared parameters themselves."""
    own = layout.parameters[columns]
    rows = np.eye(len(layout))[columns]
    return (
        (Parameters(rows, tuple(p.name for p in own), tuple(p.unit for p in own)),) if own else ()
    )


def _reported(design: Design, layout: SharedLayout) -> tuple[Functions, ...]:
    """The model's parameters as it reports them, less those that are zero in any machine of the
    model.
    """
    reported = design.model.reported()
    quoted = np.flatnonzero(reported.matrix.any(axis=1)).tolist()
    rows = np.zeros((len(quoted), len(layout)))
    rows[:, layout.model] = reported.matrix[quoted]
    names, units = (
        tuple(reported.names[i] for i in quoted),
        tuple(reported.units[i] for i in quoted),
    )
    return (Parameters(rows, names, units),) if quoted else ()


def _squareness(design: Design, layout: SharedLayout) -> tuple[Functions, ...]:
    """The squareness errors among the model's parameters, as angles."""
    own = [k for k, one in enumerate(design.model.parameters) if one.function in SQUARENESS_ERRORS]
    rows = np.zeros((len(own), len(layout)))
    rows[np.arange(len(own)), layout.model.start + np.array(own, int)] = 1.0
    parameters = [design.model.parameters[k] for k in own]
    names, units = tuple(one.name for one in parameters), tuple(one.unit for one in parameters)
    return (Parameters(rows, names, units),) if own else ()


def _plates(design: Design) -> tuple[BallPlaces, ...]:
    """The balls of each plate."""
    return tuple(BallPlaces(design.balls.of(plate)) for plate in design.artefacts.plates)


KERNEL_QUANTITIES: dict[str, QuantityKind] = {
    "U1": QuantityKind(
        "ball co-ordinates",
        lambda design, layout: (
            (Coordinates(BallPlaces(design.plate_balls)),) if len(design.plate_balls) else ()
        ),
    ),
    "U2": QuantityKind(
        "pose parameters",
        lambda design, layout: _shared(layout, layout.poses),
        parts={
            "m": ("lengths", "pose parameters: origins"),
            "rad": ("angles", "pose parameters: rotations"),
        },
        unit="m, rad",
    ),
    "U2 offsets": QuantityKind(
        "probe offsets",
        lambda design, layout: _shared(layout, layout.offsets),
        unit="m",
        in_replicates=False,
    ),
    # Quoted for monomials on [0, 1] of a kinematic model.
    "U3": QuantityKind(
        "model parameters",
        _reported,
        parts={
            "m": ("lengths", "model parameters: positional errors"),
            "rad": ("angles", "model parameters: rotational errors"),
            "1": ("ratios", "model parameters: ratios"),
        },
    ),
    "squareness": QuantityKind(
        "squareness errors",
        _squareness,
        unit="rad",
        is_recorded=False,
        one_by_one=True,
    ),
    "U4": QuantityKind(
        "error function at the evaluation points",
        lambda design, layout: (
            (Coordinates(evaluation_points(design)),) if len(design.evaluation.points) else ()
        ),
        effect="error function",
    ),
    "U5": QuantityKind(
        "distances between balls",
        lambda design, layout: tuple(
            Distances(balls) for balls in _plates(design) if len(balls.index) > 1
        ),
        are_lengths=True,
        about_balls=True,
        effect="distances between balls",
        needs="plates of two balls",
    ),
    "U6": QuantityKind(
        "distances between corrected points",
        lambda design, layout: (
            (Distances(evaluation_points(design)),) if len(design.evaluation.points) > 1 else ()
        ),
        are_lengths=True,
        effect="distances between corrected points",
        has_target=True,
        needs="two evaluation points",
    ),
    "tasks": QuantityKind(
        "lengths of measuring tasks",
        lambda design, layout: (task_distances(design),) if design.tasks.names else (),
        are_lengths=True,
        effect="lengths of measuring tasks",
        in_replicates=False,
        is_recorded=False,
        needs="evaluation.tasks",
    ),
}
