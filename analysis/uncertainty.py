"""The uncertainties U1 to U6 of NPL Report CISE 15/98, section 6, and those of measuring tasks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from ballplate.simulator.design import Design
from ballplate.simulator.estimation.covariance import blank
from ballplate.simulator.estimation.linearisation import Linearisation
from ballplate.simulator.machines.protocol import Array
from ballplate.simulator.quantities import LengthFunction, Target
from ballplate.simulator.rounding import comparable
from ballplate.simulator.threads import single_threaded

from .corrections import corrected_points, correction_rows
from .pairs import PairSummary, all_pairs
from .tasks import share_within, task_uncertainties

DESCRIPTIONS = {
    "U1": "ball co-ordinates",
    "U2": "pose parameters",
    "U2 lengths": "pose parameters: origins",
    "U2 angles": "pose parameters: rotations",
    "U2 offsets": "probe offsets",
    "U3": "model parameters",
    "U3 lengths": "model parameters: positional errors",
    "U3 angles": "model parameters: rotational errors",
    "U3 ratios": "model parameters: ratios",
    "U4": "error function at the evaluation points",
    "U5": "distances between balls",
    "U6": "distances between corrected points",
    "tasks": "lengths of measuring tasks",
}


@dataclass(frozen=True)
class Quantity:
    """Standard uncertainties of one kind: the largest and the mean of those that are determined.

    `count` of them there are, `undetermined` of which the observations leave open; the maximum and the
    average are NaN when nothing is left, and `largest` then is empty, otherwise it names where the maximum stands.
    `within_target` is the share of distances whose uncertainty, `coverage_factor` times the standard one, is within the
    target accuracy, those undetermined counted as not; None where no target is compared with. `places` tell where in
    the volume the evaluation points are that `largest` names.
    """

    symbol: str
    maximum: float
    average: float
    unit: str
    count: int
    undetermined: int = 0
    largest: str = ""
    within_target: float | None = None
    coverage_factor: float = 1.0
    places: tuple[str, ...] = ()

    @property
    def description(self) -> str:
        return DESCRIPTIONS[self.symbol]


@single_threaded
def uncertainties(at: Linearisation, sigma: float = 1.0, target: Target | None = None) -> dict[str, Quantity]:
    """U1 to U6 of a linearised design and those of its tasks, with U2 and U3 also split into lengths and angles.

    `sigma` multiplies all stated uncertainties: 1 for planning, the residuals' estimate after a fit. U3 is quoted for
    the model's reported parameters, monomials on [0, 1] for a kinematic model, less those that are zero in any
    machine of the model. U5 runs over all pairs of balls of an artefact, U6 over all pairs of evaluation points,
    compared with the `target` accuracy if there is one; measuring tasks are compared with their own.
    """
    design, layout = at.design, at.layout
    result: dict[str, Quantity] = {}

    def add(symbol: str, values: Array, unit: str, names: list[str] | tuple[str, ...]) -> None:
        if len(values):
            result[symbol] = summarise(symbol, sigma * values, unit, names)

    balls = design.plate_balls
    axes = ("x", "y", "z")[: design.dimension]
    of_balls = at.of_balls()[balls]
    labels = [f"ball {design.ball_label(b)} {axis}" for b in balls for axis in axes]
    add("U1", of_balls.ravel(), "m", labels)

    poses = layout.poses
    names = [p.name for p in layout.parameters[poses]]
    of_poses = at.of_shared(np.eye(len(layout))[poses])
    angle = layout.is_angle[poses]
    add("U2", of_poses, "m, rad", names)
    add("U2 lengths", of_poses[~angle], "m", [n for n, a in zip(names, angle, strict=True) if not a])
    add("U2 angles", of_poses[angle], "rad", [n for n, a in zip(names, angle, strict=True) if a])

    offsets = layout.offsets
    names = [p.name for p in layout.parameters[offsets]]
    add("U2 offsets", at.of_shared(np.eye(len(layout))[offsets]), "m", names)

    reported = design.model.reported()
    quoted = np.flatnonzero(reported.matrix.any(axis=1))
    matrix = np.zeros((len(quoted), len(layout)))
    matrix[:, layout.model] = reported.matrix[quoted]
    of_model = at.of_shared(matrix)
    units = np.array(reported.units)[quoted]
    quoted_names = [reported.names[i] for i in quoted]
    present = [u for u in ("m", "rad", "1") if (units == u).any()]
    add("U3", of_model, ", ".join(present), quoted_names)
    for unit, word in (("m", "lengths"), ("rad", "angles"), ("1", "ratios")):
        chosen = np.flatnonzero(units == unit)
        add(f"U3 {word}", of_model[chosen], unit, [quoted_names[i] for i in chosen])

    pairs = ball_pairs(at)
    if pairs.count:
        result["U5"] = _of_pairs("U5", pairs, sigma, lambda i: f"ball {design.ball_label(i)}")

    if len(design.points):
        of_points, lengths = _of_points(at, sigma, target)
        point_names = [f"point {i + 1} {axis}" for i in range(len(design.points)) for axis in axes]
        add("U4", of_points.ravel(), "m", point_names)
        if (top := result["U4"].largest) != "":
            i = point_names.index(top) // len(axes)
            result["U4"] = replace(result["U4"], places=(_point(design, i),))
        if lengths is not None:
            result["U6"] = lengths
    tasks = task_uncertainties(at, sigma)
    if tasks:
        values = np.array([task.standard_uncertainty for task in tasks])
        quantity = summarise("tasks", values, "m", design.task_names)
        result["tasks"] = replace(quantity, within_target=share_within(tasks), coverage_factor=tasks[0].coverage_factor)
    order = list(DESCRIPTIONS)
    return dict(sorted(result.items(), key=lambda item: order.index(item[0])))


@single_threaded
def length_uncertainties(at: Linearisation, target: Target | None = None) -> Quantity | None:
    """U6 alone, as `uncertainties` has it; None where there are no two evaluation points."""
    return _of_points(at, 1.0, target)[1] if len(at.design.points) else None


def _of_points(at: Linearisation, sigma: float, target: Target | None) -> tuple[Array, Quantity | None]:
    """U4 (points, d), not multiplied by sigma, and U6."""
    # Compared before sigma multiplies the uncertainties, so that the limit is divided by it.
    limit = None if target is None else Target(target.standard, sigma).standard
    of_points, pairs = point_pairs(at, limit)
    if not pairs.count:
        return of_points, None
    share = None if target is None else pairs.within / pairs.count
    lengths = _of_pairs("U6", pairs, sigma, lambda i: f"point {i + 1}", share)
    if lengths.largest:
        lengths = replace(lengths, places=tuple(_point(at.design, i) for i in pairs.where))
    return of_points, lengths if target is None else replace(lengths, coverage_factor=target.coverage_factor)


def _point(design: Design, i: int) -> str:
    """An evaluation point by its number from 1, as in the file, and its place."""
    place = ", ".join(f"{round(1e3 * value, 1) + 0.0:.9g}" for value in design.points[i])
    return f"point {i + 1} at ({place}) mm"


def summarise(symbol: str, values: Array, unit: str, names: list[str] | tuple[str, ...]) -> Quantity:
    """Maximum and average of the standard uncertainties `values` (m,) that are not NaN."""
    open_ = np.isnan(values)
    if open_.all():
        return Quantity(symbol, np.nan, np.nan, unit, len(values), len(values))
    top = int(np.nanargmax(comparable(values)))
    return Quantity(
        symbol, float(np.nanmax(values)), float(np.nanmean(values)), unit, len(values), int(open_.sum()), names[top]
    )


def _of_pairs(
    symbol: str, pairs: PairSummary, sigma: float, name: Callable[[int], str], within_target: float | None = None
) -> Quantity:
    """A summary of pairs as a quantity, `name(index)` naming the two ends of the least certain distance."""
    determined = pairs.count - pairs.undetermined
    if not determined:
        return Quantity(symbol, np.nan, np.nan, "m", pairs.count, pairs.undetermined, "", within_target)
    where = f"{name(pairs.where[0])} to {name(pairs.where[1])}"
    average = sigma * pairs.total / determined
    return Quantity(symbol, sigma * pairs.maximum, average, "m", pairs.count, pairs.undetermined, where, within_target)


def ball_pairs(at: Linearisation) -> PairSummary:
    """U5: distances between all pairs of balls of each artefact, in tiles of bounded size."""
    summary = PairSummary()
    for artefact in np.flatnonzero(at.design.is_plate):
        balls = np.flatnonzero(at.design.ball_artefact == artefact)
        summary = summary + all_pairs(
            at.state.balls[balls],
            at.balls.common[balls],
            at.balls.own[balls],
            at.ball_null[balls],
            balls,
            drawn=at.as_drawn.state.balls[balls],
        )
    return summary


def point_pairs(at: Linearisation, limit: LengthFunction | None = None) -> tuple[Array, PairSummary]:
    """U4 (points, d) and U6 at the design's evaluation points."""
    design = at.design
    probes = np.full(len(design.points), design.point_probe)
    of_shared = correction_rows(design, at.layout, at.state, design.points, probes)
    spread = of_shared @ at.shared
    values = np.sqrt((spread**2).sum(axis=2))
    drawn = None
    if at.drawn is not None:
        of_shared = correction_rows(design, at.layout, at.drawn.state, design.points, probes)
        drawn = corrected_points(design, at.drawn.state, design.points, probes)
    null = of_shared @ at.shared_null
    size = np.sqrt(((of_shared * at.spectrum.scale) ** 2).sum(axis=2))
    corrected = corrected_points(design, at.state, design.points, probes)
    n, d = design.points.shape
    pairs = all_pairs(corrected, spread, np.zeros((n, d, d)), null, np.arange(n), limit, drawn)
    return blank(values, null, size), pairs
