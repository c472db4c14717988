"""What U6 becomes where an assumption of a prediction does not hold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from ballplate.presentation import Data, Result, aligned, given, number, picked
from ballplate.simulator.computing import evenly_spread, single_threaded
from ballplate.simulator.design import Design, State, shared_layout
from ballplate.simulator.estimation import holding, linearise, moved, newton_step
from ballplate.simulator.experiment import Experiment, lay_out, placed_only
from ballplate.simulator.inputs import ExperimentError, MissingExtensionError
from ballplate.simulator.machines import Array, ErrorModel
from ballplate.simulator.readings import joined, simulated_readings
from ballplate.uncertainty import Quantity, evaluation_points, uncertainties

if TYPE_CHECKING:
    from ballplate.presentation import MainTable

from .assumed import PredictionAssumption, assumptions_of

# Rows that a prediction shows, and the ratio of U6 from which its headline names the first.
SHOWN_ROWS = 3
LARGE = 2.0

# Points between which systematic errors of lengths are computed.
MOST_POINTS = 100


@dataclass(frozen=True)
class AssumptionEffect:
    """An assumption with the average and the maximum of U6 without it, standard uncertainties in
    metres, and the number of distances that are then `undetermined`.

    `bias` of a systematic one is the root mean square and the largest error of lengths in metres,
    with which `average` and `maximum` are combined. `ratio` is that of the average to the present
    one, infinite if a distance is undetermined.
    """

    assumption: PredictionAssumption
    average: float
    maximum: float
    undetermined: int
    ratio: float
    bias: tuple[float, float] | None = None

    @property
    def words(self) -> str:
        """The assumption with its effect, as a line of text."""
        times = f"{number(self.ratio, 2)} times as large"
        then = "undetermined" if self.undetermined else times
        return f"assumed: {self.assumption.assumed}; otherwise U6 is {then}"

    @property
    def entries(self) -> str:
        """The entries of the file that state it, as YAML; each replaces that of its key."""
        from ballplate.simulator.inputs import yaml_text

        return yaml_text(dict(self.assumption.changes), None, 100)


@dataclass(frozen=True, repr=False)
class Assumptions(Result):
    """Assumptions of a prediction with their effects on U6, largest first.

    `average` and `maximum` are those of the prediction in metres; `left_out` are names of
    assumptions without a result and the reasons.
    """

    label: str
    title: str
    average: float
    maximum: float
    effects: tuple[AssumptionEffect, ...]
    left_out: tuple[tuple[str, str], ...] = ()

    def headline(self) -> str:
        if not self.effects:
            return "no assumptions"
        return self.effects[0].words

    @property
    def doubling(self) -> tuple[tuple[str, str], ...]:
        """The assumptions that more than double U6, each with a line of text."""
        return tuple(
            (effect.assumption.assumed, effect.words)
            for effect in self.effects
            if effect.ratio > LARGE
        )

    def words_of(self, name: str) -> str:
        """Return the line of an assumption by its name; empty if it has no result."""
        found = (effect.words for effect in self.effects if effect.assumption.name == name)
        return next(found, "")

    def summary(self) -> list[str]:
        """Return the first rows as lines of text."""
        more = len(self.effects) - SHOWN_ROWS
        further = [f"{more} further: --assumptions"] if more > 0 else []
        return [*self._table(self.effects[:SHOWN_ROWS]), *further]

    def lines(self) -> list[str]:
        lines = [self.heading, *self._table(self.effects)]
        for name, reason in self.left_out:
            lines.append(f"{name}: not computed; {reason}")
        for effect in self.effects:
            assumption = effect.assumption
            lines += ["", f"{assumption.name}: {assumption.instead} ({assumption.source})"]
            lines += [f"  {line}" for line in effect.entries.splitlines()]
        return lines

    def _table(self, effects: Sequence[AssumptionEffect]) -> list[str]:
        rows = [["assumed", "U6 in µm if instead", "average", "maximum", "times"]]
        rows.append(["as the file states", "", *_micrometres(self.average, self.maximum), "1"])
        for effect in effects:
            assumption = effect.assumption
            values = _micrometres(effect.average, effect.maximum)
            rows.append([assumption.assumed, assumption.instead, *values, number(effect.ratio, 3)])
        return aligned(rows, [False, False, True, True, True])

    def columns(self) -> MainTable:
        """Columns with one row per assumption."""
        columns = {
            "assumption": "assumption.name",
            "assumed": "assumption.assumed",
            "instead": "assumption.instead",
            "U6 average, µm": "average",
            "U6 maximum, µm": "maximum",
            "undetermined": "undetermined",
            "ratio": "ratio",
            "entries": "entries",
            "unit": ["m"] * len(self.effects),
        }

        return columns, self.effects

    def data(self) -> Data:
        return {
            **self.named,
            **picked(self, "average", "maximum"),
            "unit": "m",
            "assumptions": [_data(effect) for effect in self.effects],
            "left_out": [{"assumption": name, "reason": why} for name, why in self.left_out],
        }


def _data(effect: AssumptionEffect) -> Data:
    bias = None
    if effect.bias is not None:
        bias = dict(zip(("average", "maximum"), effect.bias, strict=True))
    return {
        "assumption": effect.assumption.name,
        **picked(effect.assumption, "assumed", "instead", "source", "changes"),
        **picked(effect, "average", "maximum", "undetermined", "ratio"),
        **given(bias=bias),
    }


def _micrometres(*values: float) -> list[str]:
    return ["undetermined" if np.isnan(value) else number(1e6 * value, 3) for value in values]


def predicted_assumptions(experiment: Experiment) -> Assumptions:
    """Return the effects of all assumptions of an experiment on the U6 of its design.

    :raises ValueError: U6 is undetermined or zero, or has no two evaluation points.
    """
    lengths = uncertainties(linearise(lay_out(experiment)), symbols=("U6",)).get("U6")
    if lengths is None or not lengths.average > 0.0:
        raise ValueError(
            "U6 is undetermined or zero, or has no two evaluation points; mend the design"
        )
    return assumption_effects(experiment, lengths)


@single_threaded
def assumption_effects(experiment: Experiment, lengths: Quantity) -> Assumptions:
    """Return the effects of all assumptions of a prediction on its U6, `lengths`."""
    assumptions = assumptions_of(experiment)
    together = _together(experiment, [each for each in assumptions if not each.is_systematic])
    found = {} if together is None else _with_parameters(experiment, together, assumptions)
    effects, left_out = [], []
    for assumption in assumptions:
        try:
            quantity = found.get(assumption.name)
            effects.append(_effect(experiment, assumption, lengths, together, quantity))
        except ExperimentError as error:
            left_out.append((assumption.name, error.messages[0].text_with_path))
        except MissingExtensionError as error:
            left_out.append((assumption.name, str(error)))
    # Undetermined distances cost more than any uncertainty.
    effects.sort(key=lambda effect: (effect.undetermined, effect.ratio), reverse=True)
    return Assumptions(
        experiment.label,
        experiment.title,
        lengths.average,
        lengths.maximum,
        tuple(effects),
        tuple(left_out),
    )


def _together(
    experiment: Experiment, assumptions: Sequence[PredictionAssumption]
) -> Experiment | None:
    """Return the experiment without all assumptions at once; None if no file can state that."""
    stated, entries = len(experiment.influences), dict[str, Any]()
    for assumption in assumptions:
        for key, value in assumption.changes.items():
            # Influence quantities are added to those of the file, other entries replaced.
            entries[key] = [*entries[key], *value[stated:]] if key in entries else value
    try:
        return _with_choice(experiment, experiment.with_(entries))
    except (ExperimentError, MissingExtensionError):
        return None


def _with_parameters(
    experiment: Experiment, together: Experiment, assumptions: Sequence[PredictionAssumption]
) -> dict[str, Quantity]:
    """Return U6 without each assumption that further parameters drop, by name: from one
    linearisation with the parameters of all, in which those of the others are held.
    """
    added = [each for each in assumptions if each.adds_parameters]
    try:
        at = linearise(lay_out(_entries_of(together, experiment, added)))
    except ExperimentError:
        return {}
    layout, stated = at.layout, len(experiment.influences)
    present = {parameter.name for parameter in lay_out(experiment).once(shared_layout).parameters}
    further = {p.name: k for k, p in enumerate(layout.parameters) if p.name not in present}
    influences, found = iter(at.design.influences[stated:]), {}
    for assumption in added:
        kinds = assumption.changes.get("influences", ())[stated:]
        names = {
            p.name
            for _, influence in zip(kinds, influences, strict=False)
            for p in influence.parameters
        }
        part = layout.offsets if "probes" in assumption.changes else layout.model
        held = [
            column
            for name, column in further.items()
            if (name not in names if kinds else not part.start <= column < part.stop)
        ]
        without = holding(at, np.array(held, np.int64))
        found[assumption.name] = uncertainties(without, symbols=("U6",))["U6"]
    return found


def _entries_of(
    together: Experiment, experiment: Experiment, assumptions: Sequence[PredictionAssumption]
) -> Experiment:
    """Return the experiment with the entries that some assumptions change.

    Priors have a coefficient for each parameter of the error model, so they change with it.
    """
    keys = {key for assumption in assumptions for key in assumption.changes}
    keys |= {"priors"} if "error_model" in keys else set()
    return replace(experiment, **{key: getattr(together, key) for key in keys})


def _effect(
    experiment: Experiment,
    assumption: PredictionAssumption,
    lengths: Quantity,
    together: Experiment | None,
    found: Quantity | None,
) -> AssumptionEffect:
    """Return the effect of an assumption, without which U6 is `found` if that is computed.

    :raises ExperimentError: the experiment cannot be changed so.
    """
    bias = None
    if assumption.is_systematic:
        changed = _with_choice(experiment, experiment.with_(assumption.changes))
        bias, found = _bias(experiment, changed), lengths
    elif found is None:
        if together is None:
            changed = _with_choice(experiment, experiment.with_(assumption.changes))
        else:
            changed = _entries_of(together, experiment, [assumption])
        found = uncertainties(linearise(lay_out(changed)), symbols=("U6",))["U6"]
    average, maximum = np.hypot((found.average, found.maximum), bias or (0.0, 0.0)).tolist()
    ratio = np.inf if found.undetermined else average / lengths.average
    return AssumptionEffect(assumption, average, maximum, found.undetermined, ratio, bias)


def _with_choice(experiment: Experiment, changed: Experiment) -> Experiment:
    """Return a changed experiment with the positions, the probes and the calibration that a plan
    or a repair chose.
    """
    probes = {**experiment.probes, **changed.probes}
    placed = placed_only(replace(changed, positions=experiment.positions, probes=probes))
    bought = experiment.calibration[len(placed.calibration) :]
    return replace(placed, calibration=(*placed.calibration, *bought))


def _bias(experiment: Experiment, changed: Experiment) -> tuple[float, float]:
    """Return the root mean square and the largest error of lengths between corrected points where
    error-free readings of the `changed` experiment's machine are evaluated.
    """
    read, design = simulated_readings(changed, exact=True), lay_out(experiment)
    # One step is enough: errors of micrometres are linear to their last millionth part.
    at = linearise(design, x=joined(design, read.design, read.readings, read.x))
    shared, balls = newton_step(design, at.factor, at.spectrum)
    state = moved(at.state, at.layout, shared, balls)
    errors = _lengths(design, design.model, state) - _lengths(design, read.model, read.truth)
    return float(np.sqrt((errors**2).mean())), float(np.abs(errors).max())


def _lengths(design: Design, model: ErrorModel, state: State) -> Array:
    """Return the distances between evaluation points that a model corrects, evenly chosen ones of
    many.
    """
    places = evaluation_points(design)
    some = evenly_spread(len(places.points), MOST_POINTS)
    points = places.points[some]
    points = points + model.error(points, state.a, state.probes[places.probes[some]])
    first, second = np.triu_indices(len(points), 1)
    return np.asarray(np.linalg.norm(points[first] - points[second], axis=1))
