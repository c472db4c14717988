"""Information of each error of a machine that goes with each position.

The design is evaluated again without the readings of each position, from their elimination on:
what is undetermined then has no uncertainty that an update could start from.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from ballplate.presentation import Data, MainTable, Result, number, picked, shown_unit, table_lines
from ballplate.rank import Direction, moved_positions
from ballplate.results import Prediction, estimated_curves
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.design import Design, Flags, Lengths
from ballplate.simulator.estimation import Linearisation, linearise
from ballplate.simulator.experiment import Experiment, lay_out, with_pool
from ballplate.simulator.inputs import ExperimentError
from ballplate.simulator.machines import Array, ErrorModel, Unit
from ballplate.uncertainty import Quantity, uncertainties

# Part of an error's uncertainty from which a weak direction is one that hides it.
HIDING = 1.0 / 3.0

# Positions side by side in a table of text.
SIDE_BY_SIDE = 6


@dataclass(frozen=True)
class InformingPosition:
    """A position with its number of readings and its own minutes, None if the file has no times.

    `average` is U6 without its readings or, if it `is_added`, with them, in metres: NaN if any
    distance is then undetermined.
    """

    name: str
    readings: int
    minutes: float | None
    average: float
    is_added: bool = False


@dataclass(frozen=True)
class InformedError:
    """An error with its `standard_uncertainty` in `unit`, the root mean square along its curves;
    NaN if it is undetermined anywhere on them.

    `hidden_by` are indices of directions, undetermined ones before weak ones, that make the error
    undetermined or uncertain.
    """

    name: str
    meaning: str
    unit: Unit
    standard_uncertainty: float
    hidden_by: tuple[int, ...]


@dataclass(frozen=True, repr=False, eq=False)
class PositionInformation(Result):
    """Errors by positions, arrays (errors, positions).

    `average` is U6 with all positions except added ones, in metres, NaN if any distance is
    undetermined. `others` are the errors' standard uncertainties without each position or, if that
    is added, with it. `information` is 1 - u²(with a position)/u²(without it): 1 where the error is
    `undetermined_without` the position, NaN where it is undetermined with it. `directions` are
    motions of positions along undetermined and weak directions, as text.
    """

    label: str
    title: str
    average: float
    positions: tuple[InformingPosition, ...]
    errors: tuple[InformedError, ...]
    others: Array
    information: Array
    undetermined_without: Flags
    directions: tuple[str, ...]

    def headline(self) -> str:
        worst = max(self.positions, key=lambda one: np.nan_to_num(one.average, nan=np.inf))
        average, without = (number(1e6 * value, 3) for value in (self.average, worst.average))
        return f"U6 {average} µm, without {worst.name} {without} µm"

    @property
    def hidden(self) -> list[Data]:
        """The undetermined and the weak errors with the directions that hide them, alike ones
        together.
        """
        groups: dict[tuple[int, ...], list[str]] = {}
        for error in self.errors:
            if error.hidden_by:
                groups.setdefault(error.hidden_by, []).append(error.name)
        return [
            {"errors": names, "directions": [self.directions[k] for k in hidden_by]}
            for hidden_by, names in groups.items()
        ]

    def lines(self) -> list[str]:
        lines = [
            self.heading,
            "percent of each error's information that goes with each position:"
            " 1 - u²/u²(without it)",
            "all: the error is undetermined without it; -: it is undetermined with all positions",
        ]
        # What has no number is shown by its word.
        shown = np.where(self.undetermined_without, np.inf, 100.0 * self.information)
        for start in range(0, len(self.positions), SIDE_BY_SIDE):
            columns: Data = {
                "error": "name",
                "u": (lambda error: 1e6 * error.standard_uncertainty, 3),
                "": lambda error: shown_unit(error.unit),
            }
            for k in range(len(self.positions))[start : start + SIDE_BY_SIDE]:
                columns[self.positions[k].name] = shown[:, k].tolist(), _percent
            lines += ["", *table_lines(columns, self.errors)]
        columns = {"position": _mark, "readings": "readings", "minutes": ("minutes", 2)}
        columns["U6 without, µm"] = "average", 3
        lines += ["", *table_lines(columns, self.positions)]
        for group in self.hidden:
            lines += ["", f"{', '.join(group['errors'])}:"]
            lines += [f"  {direction}" for direction in group["directions"]]
        return lines

    def columns(self) -> MainTable:
        """Columns with one row per error: the information that goes with each position."""
        names = [position.name for position in self.positions]
        of_positions = zip(names, self.information.T.tolist(), strict=True)
        return {"error": "name", **dict(of_positions)}, self.errors

    def data(self) -> Data:
        of_positions = ("information", "undetermined_without", "directions", "hidden")
        names = ("average", "positions", "errors", *of_positions)
        return {**self.named, "unit": "m", **picked(self, *names)}


def _mark(position: InformingPosition) -> str:
    return f"+ {position.name}" if position.is_added else position.name


def _percent(value: float) -> str:
    return "all" if np.isinf(value) else "-" if np.isnan(value) else f"{value:.1f}"


@single_threaded
def position_information(
    prediction: Prediction, added: Sequence[Experiment] = ()
) -> PositionInformation:
    """Return the information of each error that goes with each position of a prediction's design,
    and with the last position of each experiment `added`.
    """
    design, experiment = prediction.design, prediction.experiment
    assert experiment is not None
    minutes, names = _minutes(experiment), design.positions.names
    counts = np.bincount(design.readings.position, design.readings.repeats, len(names)).astype(int)
    cases = [
        *(
            (name, count, False, _unread(design, k))
            for k, (name, count) in enumerate(zip(names, counts.tolist(), strict=True))
        ),
        *(
            (more.positions[-1].name, more.positions[-1].count, True, lay_out(more))
            for more in added
        ),
    ]
    positions, variances = [], []
    for name, count, is_added, changed in cases:
        at = linearise(changed)
        average = _average(uncertainties(at, symbols=("U6",)).get("U6"))
        positions.append(InformingPosition(name, count, minutes.get(name), average, is_added))
        variances.append(list(_variances(at).values()))
    whole = _variances(linearise(design))
    others = np.array(variances).reshape(-1, len(whole)).T
    with_all = np.broadcast_to(np.array([*whole.values()])[:, None], others.shape)
    are_added = [position.is_added for position in positions]
    more_known, less_known = np.where(are_added, (others, with_all), (with_all, others))
    ratio = np.divide(more_known, less_known, out=np.ones(others.shape), where=less_known > 0.0)
    information = np.where(np.isnan(less_known), 1.0, np.maximum(1.0 - ratio, 0.0))
    directions = (*prediction.verdict.null, *prediction.verdict.weak)
    return PositionInformation(
        prediction.label,
        prediction.title,
        _average(prediction.lengths),
        tuple(positions),
        tuple(_errors(design.model, whole, directions)),
        np.sqrt(others),
        np.where(np.isnan(more_known), np.nan, information),
        np.isnan(less_known) & ~np.isnan(more_known),
        tuple(map(_motions, directions)),
    )


def _motions(direction: Direction) -> str:
    word = "undetermined" if np.isinf(direction.standard_deviation) else "weak"
    motions = moved_positions(direction)
    return f"{word} with motions of {motions}" if motions else f"{word}: {direction}"


def _errors(
    model: ErrorModel, variances: Mapping[str, float], directions: Sequence[Direction]
) -> Iterator[InformedError]:
    """Yield the errors of a model, each with the directions that hide it: undetermined ones hide
    undetermined errors.
    """
    first = {parameter.function: parameter for parameter in reversed(model.parameters)}
    for name, u in zip(variances, np.sqrt([*variances.values()]).tolist(), strict=True):
        limit = 0.0 if np.isnan(u) else HIDING * u
        hidden_by = tuple(
            k
            for k, direction in enumerate(directions)
            if np.isinf(direction.standard_deviation) == np.isnan(u)
            and any(part.name == name and abs(part.peak) > limit for part in direction.functions)
        )
        yield InformedError(name, first[name].meaning, first[name].unit, u, hidden_by)


def _unread(design: Design, position: int) -> Design:
    """Return a design without the readings of a position, whose pose stays a parameter."""
    readings, lengths = design.readings, design.of(Lengths)
    is_kept = readings.position != position
    place = np.cumsum(is_kept) - 1
    fewer = replace(design, readings=readings.select(np.flatnonzero(is_kept)))
    left = design.observed(lengths.select(is_kept[lengths.first]))
    return fewer.observed(*(kind.reread(design, place) for kind in left.observations))


def _variances(at: Linearisation) -> dict[str, float]:
    """Return the mean variance of each error along its curves, or of its parameters without any;
    NaN if it is undetermined.
    """
    squares: dict[str, list[Array]] = {}
    for curve in estimated_curves(at):
        squares.setdefault(curve.name, []).append(curve.standard_uncertainties**2)
    if not squares:
        values = at.of_shared(np.eye(len(at.layout))[at.layout.model])
        for parameter, u in zip(at.design.model.parameters, values, strict=True):
            squares.setdefault(parameter.function, []).append(u[None] ** 2)
    return {name: float(np.concatenate(parts).mean()) for name, parts in squares.items()}


def _average(lengths: Quantity | None) -> float:
    return np.nan if lengths is None else lengths.average


def _minutes(experiment: Experiment) -> dict[str, float]:
    """Return the durations of positions and of candidates; empty without a valid pool."""
    with suppress(ExperimentError):
        if pool := with_pool(experiment).pool:
            return {one.name: one.seconds / 60.0 for one in pool.candidates}
    return {}
