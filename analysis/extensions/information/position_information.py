"""Information of each error of a machine that goes with each position.

The design is evaluated again without the readings of each position, from their elimination on:
what is undetermined then has no uncertainty that an update could start from.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from ballplate.presentation import Data, MainTable, Result, aligned, number, picked, shown_unit
from ballplate.rank import Verdict, moved_positions, null_changes, weak_changes
from ballplate.results import Prediction
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.design import Design, Lengths, Priors
from ballplate.simulator.estimation import Linearisation, linearise
from ballplate.simulator.experiment import Experiment, lay_out, with_pool
from ballplate.simulator.inputs import ExperimentError, Target
from ballplate.simulator.machines import Array, ErrorModel, HasLines, Integers, Unit
from ballplate.uncertainty import Quantity, uncertainties

if TYPE_CHECKING:
    import pandas

# Points on each line along which an error is averaged.
POINTS = 21

# Share of an error's variance, or of the largest change of it, from which a direction is named.
NAMED = 0.1

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
    """An error with its `standard_uncertainty` in `unit`, the root mean square along its lines;
    NaN if it is undetermined anywhere on them.

    `others` are the same without each position or, if that is added, with it; `information` is
    1 - u²(with a position)/u²(without it). It is 1 of a position without which the error is
    undetermined, NaN if the error is undetermined with it. `hidden_by` are indices of directions,
    undetermined ones before weak ones, that make the error undetermined or uncertain.
    """

    name: str
    meaning: str
    unit: Unit
    standard_uncertainty: float
    others: tuple[float, ...]
    information: tuple[float, ...]
    hidden_by: tuple[int, ...] = ()

    @property
    def is_undetermined(self) -> bool:
        return bool(np.isnan(self.standard_uncertainty))

    def is_lost(self, k: int) -> bool:
        """Return whether the error is determined with a position, and not without it."""
        return self.information[k] == 1.0 and bool(
            np.isnan((self.standard_uncertainty, self.others[k])).any()
        )


@dataclass(frozen=True, repr=False)
class PositionInformation(Result):
    """Errors by positions. `average` is U6 with all positions except added ones, in metres, NaN if
    any distance is undetermined; `directions` are motions of positions that hide errors, as text.
    """

    label: str
    title: str
    average: float
    positions: tuple[InformingPosition, ...]
    errors: tuple[InformedError, ...]
    directions: tuple[str, ...]

    def headline(self) -> str:
        own = [position for position in self.positions if not position.is_added]
        if np.isnan(self.average) or not own:
            return f"{len(self.errors)} errors, {len(own)} positions"
        worst = max(own, key=lambda position: np.nan_to_num(position.average, nan=np.inf))
        if np.isnan(worst.average):
            return f"without {worst.name} distances are undetermined"
        values = (number(1e6 * value, 3) for value in (worst.average, self.average))
        return "without {} U6 is {} µm on average, with all positions {} µm".format(
            worst.name, *values
        )

    def frame(self) -> pandas.DataFrame:
        """Return the information as a data frame, a row for each error and a column for each
        position.
        """
        import pandas

        return pandas.DataFrame(
            [error.information for error in self.errors],
            pandas.Index([error.name for error in self.errors], name="error"),
            [position.name for position in self.positions],
        )

    def lines(self) -> list[str]:
        lines = [
            self.heading,
            "part of each error's information that goes with each position, in percent:"
            " 100 (1 - u²/u²(without it))",
            "u is the root mean square along the error's axis, or along lines through the volume",
        ]
        for start in range(0, len(self.positions), SIDE_BY_SIDE):
            stop = min(start + SIDE_BY_SIDE, len(self.positions))
            lines += ["", *self._table(range(start, stop))]
        cells, legend = range(len(self.positions)), list(self._hidden())
        if any(error.is_lost(k) for error in self.errors for k in cells):
            legend.insert(0, "all: without the position, the error is undetermined")
        if any(error.is_undetermined for error in self.errors):
            legend.insert(0, "-: the error is undetermined with all positions")
        return [*lines, *([""] if legend else []), *legend]

    def _table(self, chosen: range) -> list[str]:
        positions = [self.positions[k] for k in chosen]
        marks = ["+" if position.is_added else "" for position in positions]
        names = [f"{mark}{p.name}" for mark, p in zip(marks, positions, strict=True)]
        rows = [["error", "u", "", *names]]
        for error in self.errors:
            u = number(1e6 * error.standard_uncertainty, 3)
            cells = ("all" if error.is_lost(k) else _percent(error.information[k]) for k in chosen)
            rows.append([error.name, u, shown_unit(error.unit), *cells])
        lengths = [number(1e6 * position.average, 3) for position in positions]
        rows += [
            ["readings", "", "", *(str(position.readings) for position in positions)],
            ["U6 without", number(1e6 * self.average, 3), "µm", *lengths],
        ]
        minutes = [position.minutes for position in positions]
        if any(value is not None for value in minutes):
            cells = ("-" if value is None else f"{value:.0f}" for value in minutes)
            rows.insert(-1, ["minutes", "", "", *cells])
        return aligned(rows, [False, True, False, *(True for _ in positions)])

    def _hidden(self) -> Iterator[str]:
        """Yield the undetermined and the weak errors with what hides them, alike ones together."""
        groups: dict[tuple[bool, tuple[int, ...]], list[str]] = {}
        for error in self.errors:
            if error.hidden_by:
                groups.setdefault((error.is_undetermined, error.hidden_by), []).append(error.name)
        for (is_undetermined, hidden_by), names in groups.items():
            word = "undetermined" if is_undetermined else "weak"
            yield f"{', '.join(names)}: {word}, hidden by motions of"
            yield from (f"  {self.directions[k]}" for k in hidden_by)

    def columns(self) -> MainTable:
        """Columns with one row per error and position."""
        pairs = [(error, k) for error in self.errors for k in range(len(self.positions))]
        columns = {
            "error": [error.name for error, _ in pairs],
            "position": [self.positions[k].name for _, k in pairs],
            "information": [error.information[k] for error, k in pairs],
            "undetermined without": [error.is_lost(k) for error, k in pairs],
        }
        return columns, ()

    def data(self) -> Data:
        names = [position.name for position in self.positions]
        keys = ("name", "meaning", "unit", "standard_uncertainty", "hidden_by")
        return {
            **self.named,
            **picked(self, "average"),
            "unit": "m",
            "positions": list(self.positions),
            "directions": self.directions,
            "errors": [
                {
                    **picked(error, *keys),
                    "information": dict(zip(names, error.information, strict=True)),
                    "undetermined_without": [
                        name for k, name in enumerate(names) if error.is_lost(k)
                    ],
                }
                for error in self.errors
            ],
        }


def _percent(share: float) -> str:
    return "-" if np.isnan(share) else f"{100.0 * share:.1f}"


@dataclass(frozen=True, eq=False)
class _Function:
    """An error function: values `basis` (m, k) times its k parameters of the model, `columns`."""

    name: str
    meaning: str
    unit: Unit
    columns: Integers
    basis: Array


def _functions(model: ErrorModel) -> list[_Function]:
    """Return the functions of a model along their lines; parameters one by one without lines."""
    t, functions = np.linspace(0.0, 1.0, POINTS), []
    for name in dict.fromkeys(parameter.function for parameter in model.parameters):
        columns = [k for k, p in enumerate(model.parameters) if p.function == name]
        lines = model.lines(name, t) if isinstance(model, HasLines) else ()
        basis = [line.basis for line in lines] or [np.eye(len(columns))]
        first = model.parameters[columns[0]]
        values = np.concatenate(basis)
        functions.append(_Function(name, first.meaning, first.unit, np.array(columns), values))
    return functions


@single_threaded
def position_information(
    prediction: Prediction, added: Sequence[Experiment] = ()
) -> PositionInformation:
    """Return the information of each error that goes with each position of a prediction's design,
    and with the last position of each experiment `added`.
    """
    design, experiment = prediction.design, prediction.experiment
    at, functions = linearise(design), _functions(design.model)
    u = _mean_squares(at, functions)
    counts = design.readings.repeats
    minutes = {} if experiment is None else _minutes(experiment)
    positions, others, shares = [], [], []
    for k, name in enumerate(design.positions.names):
        without = linearise(_unread(design, k))
        readings = int(counts[design.readings.position == k].sum())
        positions.append(_position(name, readings, minutes, without))
        others.append(_mean_squares(without, functions))
        shares.append(_shares(u, others[-1]))
    for more in added:
        candidate, design_with = more.positions[-1], linearise(lay_out(more))
        column = _position(candidate.name, candidate.count, minutes, design_with)
        positions.append(replace(column, is_added=True))
        others.append(_mean_squares(design_with, functions))
        shares.append(_shares(others[-1], u))
    target = None if experiment is None else experiment.target_uncertainty
    hidden_by = _hidden_by(at, functions, u, target)
    errors = (
        InformedError(
            function.name,
            function.meaning,
            function.unit,
            float(np.sqrt(u[row])),
            tuple(float(np.sqrt(other[row])) for other in others),
            tuple(float(share[row]) for share in shares),
            hidden_by[row],
        )
        for row, function in enumerate(functions)
    )
    return PositionInformation(
        prediction.label,
        prediction.title,
        _average(prediction.lengths),
        tuple(positions),
        tuple(errors),
        _motions(prediction.verdict),
    )


def _motions(judged: Verdict) -> tuple[str, ...]:
    """Return motions of positions along undetermined and weak directions, as text."""
    return tuple(
        moved_positions(direction) or str(direction) for direction in (*judged.null, *judged.weak)
    )


def _unread(design: Design, position: int) -> Design:
    """Return a design without the readings of a position.

    Its pose is held, which nothing depends on any more, so that no direction is undetermined by it.
    """
    readings, lengths, priors = design.readings, design.of(Lengths), design.of(Priors)
    is_kept = readings.position != position
    place = np.where(is_kept, np.cumsum(is_kept) - 1, -1)
    held = design.positions.held.copy()
    held[position] = True
    fewer = replace(
        design,
        readings=readings.select(np.flatnonzero(is_kept)),
        positions=replace(design.positions, held=held),
    )
    return fewer.observed(
        lengths.select(is_kept[lengths.first]).reread(design, place),
        priors.select(priors.position != position),
    )


def _mean_squares(at: Linearisation, functions: Sequence[_Function]) -> Array:
    """Return the mean variance of each function along its lines; NaN if it is undetermined."""
    variances = []
    for function in functions:
        rows = np.zeros((len(function.basis), len(at.layout)))
        rows[:, at.layout.model.start + function.columns] = function.basis
        variances.append(np.mean(at.of_shared(rows) ** 2))
    return np.array(variances)


def _hidden_by(
    at: Linearisation, functions: Sequence[_Function], variances: Array, target: Target | None
) -> list[tuple[int, ...]]:
    """Return the directions that hide each function, with its variances (errors,)."""
    null = [shared for shared, _ in null_changes(at)]
    weak = weak_changes(at, target)
    hidden = []
    for function, variance in zip(functions, variances.tolist(), strict=True):
        changes = np.array(
            [
                np.mean((function.basis @ shared[at.layout.model][function.columns]) ** 2)
                for shared in (*null, *weak)
            ]
        )
        is_null = np.arange(len(changes)) < len(null)
        if np.isnan(variance):
            limit, chosen = NAMED * changes[is_null].max(initial=0.0), is_null
        else:
            limit, chosen = NAMED * variance, ~is_null
        hidden.append(tuple(np.flatnonzero(chosen & (changes > limit)).tolist()))
    return hidden


def _shares(more: Array, fewer: Array) -> Array:
    """Return the information (errors,) that more observations add, from variances with and without
    them.
    """
    lost = 1.0 - more / np.where(fewer > 0.0, fewer, np.inf)
    share = np.where(np.isnan(fewer), 1.0, np.maximum(np.where(fewer > 0.0, lost, 0.0), 0.0))
    return np.where(np.isnan(more), np.nan, share)


def _position(
    name: str, readings: int, minutes: dict[str, float], at: Linearisation
) -> InformingPosition:
    lengths = uncertainties(at, symbols=("U6",)).get("U6")
    return InformingPosition(name, readings, minutes.get(name), _average(lengths))


def _average(lengths: Quantity | None) -> float:
    return np.nan if lengths is None or lengths.undetermined else lengths.average


def _minutes(experiment: Experiment) -> dict[str, float]:
    """Return the durations of positions and of candidates; empty without a valid pool."""
    pool = experiment.pool
    with suppress(ExperimentError):
        pool = pool or with_pool(experiment).pool
    candidates = () if pool is None else pool.candidates
    return {candidate.name: candidate.seconds / 60.0 for candidate in candidates}
