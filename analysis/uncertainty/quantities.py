"""All quantities whose uncertainties are reported: those of the kernel, and of extensions.

`run`, Monte Carlo, sweeps, plans, reliability, goals and reports read `QUANTITIES`. A further one
of the kernel is an entry of `KERNEL_QUANTITIES`; extensions provide a `QUANTITY`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.parameters import SharedLayout
from ballplate.simulator.estimation.functions import (
    BallPlaces,
    Combinations,
    Coordinates,
    Distances,
    Functions,
    MeasuredPoints,
    Parameters,
)
from ballplate.simulator.inputs.extensions import UnusableError, names, provided, provider
from ballplate.simulator.inputs.settings import shorten
from ballplate.simulator.machines.arrangement import SQUARENESS_ERRORS
from ballplate.simulator.machines.protocol import Unit


@dataclass(frozen=True)
class QuantityKind:
    """A type of quantity, with the function that returns its functions.

    Several groups of functions belong to one quantity, such as distances of several artefacts; no
    group means that the design lacks the quantity. `parts` split it by unit, each with a word and a
    description; `unit` is that of the whole. `are_lengths` marks quantities that a plan
    can minimise, distances or combinations, `about_balls` those between balls, `by_limits` those
    that it minimises as shares of limits. `effect` names the changes in
    reliability, if any. `has_target`: compared with the file's target uncertainty; `in_replicates`:
    followed by Monte Carlo; `is_recorded`: recorded by sweeps by default; `one_by_one`: printed for
    each of its `Parameters`. `needs` is missing in a design without it.

    :raises ValueError: it is between balls, or has a target, and is not about distances.
    """

    description: str
    functions: Callable[[Design, SharedLayout], tuple[Functions, ...]]
    parts: dict[Unit, tuple[str, str]] = field(default_factory=dict)
    unit: str = ""
    are_lengths: bool = False
    about_balls: bool = False
    by_limits: bool = False
    effect: str = ""
    has_target: bool = False
    in_replicates: bool = True
    is_recorded: bool = True
    one_by_one: bool = False
    needs: str = ""

    def __post_init__(self) -> None:
        if not self.are_lengths and (self.about_balls or self.has_target):
            raise ValueError(
                f'"{self.description}" has about_balls or has_target, which need are_lengths;'
                " add that, or remove them"
            )


def evaluation_points(design: Design) -> MeasuredPoints:
    """Return the evaluation points with their probe."""
    evaluation = design.evaluation
    return MeasuredPoints(evaluation.points, np.full(len(evaluation.points), evaluation.probe))


def task_distances(design: Design) -> Distances:
    """Return the lengths of the measuring tasks."""
    tasks = design.tasks
    ends = MeasuredPoints(tasks.points.reshape(-1, design.dimension), tasks.probes.ravel())
    pairs = np.arange(2 * len(tasks.names)).reshape(-1, 2)
    return Distances(ends, pairs, tasks.names, tasks.targets)


def _shared(layout: SharedLayout, columns: slice) -> tuple[Functions, ...]:
    parameters = layout.parameters[columns]
    names, units = tuple(p.name for p in parameters), tuple(p.unit for p in parameters)
    return (Parameters(np.eye(len(layout))[columns], names, units),) if parameters else ()


def _reported(design: Design, layout: SharedLayout) -> tuple[Functions, ...]:
    """Return the model's reported parameters, except those that are zero in any machine."""
    reported = design.model.reported()
    quoted = np.flatnonzero(reported.matrix.any(axis=1)).tolist()
    rows = np.zeros((len(quoted), len(layout)))
    rows[:, layout.model] = reported.matrix[quoted]
    names = tuple(reported.names[i] for i in quoted)
    units = tuple(reported.units[i] for i in quoted)
    return (Parameters(rows, names, units),) if quoted else ()


def _squareness(design: Design, layout: SharedLayout) -> tuple[Functions, ...]:
    every = enumerate(design.model.parameters, start=layout.model.start)
    chosen = [(column, p) for column, p in every if p.function in SQUARENESS_ERRORS]
    rows = np.eye(len(layout))[[column for column, _ in chosen]]
    names, units = tuple(p.name for _, p in chosen), tuple(p.unit for _, p in chosen)
    return (Parameters(rows, names, units),) if chosen else ()


def _plates(design: Design) -> tuple[BallPlaces, ...]:
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


def _of_extension(symbol: str) -> QuantityKind:
    kind = provided("quantities", symbol, "QUANTITY")
    if not isinstance(kind, QuantityKind):
        raise UnusableError(f"quantity {symbol}: {shorten(repr(kind))} is no QuantityKind")
    if " " in symbol:
        raise UnusableError(f"quantity {symbol}: write its symbol without spaces")
    return kind


QUANTITIES: dict[str, QuantityKind] = KERNEL_QUANTITIES | {
    symbol: _of_extension(symbol)
    for symbol in names("quantities", with_registered=True)
    if (found := provider("quantities", symbol)) is not None and found.is_installed
}


def functions_of(symbol: str, design: Design, layout: SharedLayout) -> tuple[Functions, ...]:
    """Return the functions of a quantity, empty in a design without it.

    :raises UnusableError: the entry is inconsistent, or what its function returns.
    """
    kind = QUANTITIES[symbol]
    try:
        functions = kind.functions(design, layout)
    except ValueError as error:
        raise UnusableError(f"quantity {symbol}: {error}") from error
    fault = _fault_of(kind, functions)
    if fault:
        raise UnusableError(f"quantity {symbol}: {fault}")
    return functions


def _fault_of(kind: QuantityKind, groups: object) -> str:
    """Return a contradiction between a quantity and its functions, or an empty text."""
    if not isinstance(groups, tuple) or not all(isinstance(group, Functions) for group in groups):
        known = "Parameters, Coordinates, Distances or Combinations"
        return f"give a tuple of {known}, not {shorten(repr(groups))}"
    types = {type(group) for group in groups}
    if kind.are_lengths and types - {Distances, Combinations}:
        return "are_lengths applies to Distances and Combinations only; remove it"
    if kind.effect and types - {Distances, Coordinates}:
        return "effect applies to Distances and Coordinates only; remove it"
    # Only one group of names is shown.
    if len(groups) > 1 and not all(
        isinstance(group, Distances) and not group.names for group in groups
    ):
        return "only Distances without names can be in several groups; combine all in one"
    return ""


# Descriptions of quantities and of their parts by unit.
DESCRIPTIONS: dict[str, str] = {}
for _symbol, _kind in QUANTITIES.items():
    if _symbol.partition(" ")[0] not in QUANTITIES:
        raise ValueError(f'"{_symbol}" is no symbol of a quantity; write it without spaces')
    DESCRIPTIONS[_symbol] = _kind.description
    DESCRIPTIONS |= {f"{_symbol} {word}": description for word, description in _kind.parts.values()}

# Quantities that a sweep records by default, with their parts.
RECORDED = tuple(
    symbol for symbol, kind in QUANTITIES.items() if kind.is_recorded and " " not in symbol
)
# Quantities that a sweep records on request.
RECORDED_IF_TOLD = tuple(symbol for symbol, kind in QUANTITIES.items() if not kind.is_recorded)
