"""Reliability of a design as text, plain data, and a table for spreadsheets."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from ballplate.presentation import SHOWN, Data, Result, aligned, number, picked, table_lines
from ballplate.simulator.computing import comparable
from ballplate.simulator.design import Design
from ballplate.simulator.estimation import Coordinates, Distances, Functions
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.inputs import listed
from ballplate.simulator.machines import Array, Integers
from ballplate.uncertainty import QUANTITIES

from .bias_patterns import DRIFTS, Patterns, single_kinds
from .effects import MOST_PLACES, across_probes
from .names import name

# Effects below this share of the bias, in metres per unit, are neglected.
NO_EFFECT = 1e-6
# Below this share they are rounding.
NOTHING = 1e-9

# Rows of a table of single observations.
MOST = 5

EVENTS = (
    "ball",
    "moved",
    "shift",
    "turn",
    "probe",
    "length value",
    "scale",
    "expansion",
    *DRIFTS,
)


@dataclass(frozen=True)
class Effects:
    """Largest changes `change` (k,) of `functions` of one kind by a unit of each pattern's bias.

    `first` and `second` (k,) are the points of the function that changes most, -1 if none is
    determined; `uncertainty` (k,) is its standard uncertainty.
    """

    functions: tuple[Functions, ...]
    change: Array
    first: Integers
    second: Integers
    uncertainty: Array


@dataclass(frozen=True, repr=False)
class Reliability(Result):
    """Reliability of a design: redundancies, minimal detectable biases and effects, by pattern.

    `redundancy` (rows,) are the redundancy numbers of the observations; a reading of a plate is the
    mean of its repeats, which have `among_repeats` further degrees of freedom. `left` (k,) is the
    redundancy number of a single observation, otherwise the share of a pattern's square in the
    residuals. `information` (k,) is a pattern's square in the residuals per unit of the bias
    squared, 0 if negligible. `effects` are by symbol; `across` (k,) is the largest change of a
    distance between points measured with any of the tasks' probes. `noncentrality` belongs to one
    test with `false_alarm` and `power`, sigma being known or estimated from the other observations;
    `fit_noncentrality` to each of the tests of a fit.
    """

    label: str
    title: str
    design: Design
    patterns: Patterns
    redundancy: Array
    left: Array
    among_repeats: int
    information: Array
    effects: dict[str, Effects]
    across: Array
    degrees_of_freedom: int
    deficiency: int
    sigma_is_estimated: bool
    false_alarm: float
    power: float
    noncentrality: float
    fit_noncentrality: float

    def headline(self) -> str:
        observations = self.design.observation_count
        mean = (float(self.redundancy.sum()) + self.among_repeats) / observations
        return (
            f"redundancy {mean:.3g} per observation on average; {len(self.patterns)} biases judged"
        )

    def lines(self) -> list[str]:
        """Return lines of text, with the worst event of each position or probe."""
        lines = [*_heading(self), "", *_positions(self)]
        readings = self.patterns.of_kind("reading")
        items = self.patterns.of_kind(*single_kinds(self.design)[1:])
        for title, chosen in (("worst readings", readings), ("worst items", items)):
            if len(chosen):
                lines += [
                    "",
                    *_table(self, title, _worst_first(self, chosen)[:MOST], with_redundancy=True),
                ]
        events: list[int] = []
        for kind in EVENTS:
            events += _worst_of_each(self, self.patterns.of_kind(kind))
        if events:
            lines += ["", *_table(self, "events", events, with_redundancy=False)]
        return lines + _closing(self)

    def data(self) -> Data:
        """Return plain data in metres, radians and ratios; None if undetectable or undetermined."""
        is_single = np.isin(self.patterns.kind, single_kinds(self.design))
        return {
            "experiment": self.label,
            "title": self.title,
            "parameters": self.design.parameter_count,
            "observations": self.design.observation_count,
            "rank_deficiency": self.deficiency,
            **picked(self, "degrees_of_freedom", "sigma_is_estimated", "false_alarm", "power"),
            "noncentrality": self.noncentrality,
            "fit_noncentrality": self.fit_noncentrality,
            "redundancy": float(self.redundancy.sum()) + self.among_repeats,
            "redundancy_among_repeats": self.among_repeats,
            "observations_by_name": [
                {**_pattern_data(self, k), "redundancy": self.left[k]}
                for k in np.flatnonzero(is_single).tolist()
            ],
            "events": [_pattern_data(self, k) for k in np.flatnonzero(~is_single).tolist()],
        }

    def rows(self) -> list[Data]:
        """Return one row per bias: of an observation, a probe, a position, a certificate."""
        data = self.to_dict()
        rows = []
        for bias in (*data["observations_by_name"], *data["events"]):
            changes = {symbol: effect.get("change") for symbol, effect in bias["effects"].items()}
            names = ("name", "kind", "redundancy", "minimal_detectable", "found_by_fit", "unit")
            rows.append({name.replace("_", " "): bias.get(name) for name in names} | changes)
        return rows

    @cached_property
    def found_by_fit(self) -> Array:
        """Minimal detectable biases (k,) of all tests of `fit` together; NaN for drifts, its
        smooth errors.
        """
        as_smooth = np.isin(self.patterns.kind, DRIFTS)
        return np.where(as_smooth, np.nan, self._biases(self.fit_noncentrality))

    @cached_property
    def minimal_detectable(self) -> Array:
        """Minimal detectable biases (k,) in metres, radians or ratios; infinite if undetectable."""
        return self._biases(self.noncentrality)

    def _biases(self, noncentrality: float) -> Array:
        with np.errstate(divide="ignore"):
            return np.where(
                self.information > 0.0, noncentrality / np.sqrt(self.information), np.inf
            )

    def is_harmless(self, k: int) -> bool:
        """Return whether a bias changes no length: between balls, between corrected points, or
        of a task.
        """
        changes = [self.across, *(self.effects[symbol].change for symbol in self.lengths)]
        return all(change[k] <= NO_EFFECT * self.sizes[k] for change in changes)

    @property
    def lengths(self) -> list[str]:
        """Symbols of effects on lengths."""
        return [symbol for symbol in self.effects if QUANTITIES[symbol].are_lengths]

    @cached_property
    def sizes(self) -> Array:
        """Approximate displacements (k,), in metres, by a unit of each bias."""
        extent = max(float(np.ptp(self.design.balls.places, axis=0).max(initial=0.0)), 1e-3)
        units = map(self.patterns.unit, range(len(self.patterns)))
        return np.array([1.0 if unit == "m" else extent for unit in units])


def _heading(result: Reliability) -> list[str]:
    design, count = result.design, result.design.observation_count
    rank = f"rank deficiency {result.deficiency}" if result.deficiency else "full rank"
    sigma = "estimated from the other residuals" if result.sigma_is_estimated else "as given"
    total = result.redundancy.sum() + result.among_repeats
    effects = [f"{symbol} ({QUANTITIES[symbol].effect})" for symbol in result.effects]
    lines = [
        f"{result.label}: {result.title}",
        (
            f"{rank}; {design.parameter_count} parameters, {count} observations; redundancy"
            f" {number(total)} in total, {number(total / count, 3)} per observation on average"
        ),
        (
            "MDB: minimal detectable bias, found with a power of"
            f" {_percent(result.power)} by a test with a false"
            f" alarm of {_percent(result.false_alarm)}, sigma {sigma}:"
            f" {number(result.noncentrality)} standard deviations"
        ),
        (
            "by fit: found with that power by `fit`, which makes all its tests together: "
            f"{number(result.fit_noncentrality)} standard deviations"
        ),
        (
            f"effects: the largest change that a bias of the size of the MDB causes in"
            f" {listed(effects)}, with the standard uncertainty there in brackets"
        ),
    ]
    if result.among_repeats:
        lines.append("a reading is the mean of its repeats")
    if math.isinf(result.noncentrality):
        lines.append(
            "too few degrees of freedom to estimate sigma without the tested observation: no bias"
            " is detectable"
        )
    return lines


def _positions(result: Reliability) -> list[str]:
    """Return a summary of the readings of plates by position."""
    design, biases = result.design, result.patterns
    readings = biases.of_kind("reading")
    head = [
        "position",
        "readings",
        "redundancy: smallest",
        "average",
        "MDB, µm",
        "by fit, µm",
        "largest at",
    ]
    rows = [[*head, "effect on U6, µm", "largest at"]]
    position = design.readings.position[biases.subject[readings]]
    of_u6 = _effect(result, "U6")
    for k in np.unique(position):
        readings_there = readings[position == k]
        by_bias = readings_there[comparable(result.minimal_detectable[readings_there]).argmax()]
        by_effect = readings_there[comparable(_finite_or_zero(of_u6[readings_there])).argmax()]
        is_determined = bool(np.isfinite(of_u6[by_effect]))
        u = (
            f"{number(1e6 * of_u6[by_effect], 3)}"
            f" ({number(1e6 * result.effects['U6'].uncertainty[by_effect], 3)})"
        )
        rows.append(
            [
                design.positions.names[k],
                str(len(np.unique(biases.subject[readings_there]))),
                number(result.left[readings_there].min(), 3),
                number(result.left[readings_there].mean(), 3),
                _shown(result.minimal_detectable[by_bias]),
                _shown(result.found_by_fit[by_bias]),
                name(biases, int(by_bias), with_position=False),
                u if is_determined else "-",
                name(biases, int(by_effect), with_position=False) if is_determined else "",
            ]
        )
    if len(rows) == 1:
        return ["no readings of plates"]
    return aligned(rows, [False, True, True, True, True, True, False, True, False])


def _table(
    result: Reliability, title: str, chosen: Sequence[int], with_redundancy: bool
) -> list[str]:
    def effect_words(symbol: str) -> Callable[[int], str]:
        def words(k: int) -> str:
            if math.isnan(effects[symbol][k]):
                return "-"
            uncertainty = number(1e6 * result.effects[symbol].uncertainty[k], 3)
            change = number(1e6 * effects[symbol][k], 3)
            # Where none changes, no length is meant and no uncertainty of one.
            return f"{change} ({uncertainty})" if effects[symbol][k] else "0"

        return words

    hidden = np.isinf(result.minimal_detectable)
    effects = {symbol: _effect(result, symbol) for symbol in result.effects}
    columns = {
        title: lambda k: name(result.patterns, k),
        "redundancy": (result.left[chosen], 3),
        "MDB": (result.minimal_detectable[chosen], _shown),
        "by fit": (result.found_by_fit[chosen], _shown),
        "unit": lambda k: SHOWN[result.patterns.unit(k)],
        **{f"{symbol}, µm": (chosen, effect_words(symbol)) for symbol in effects},
        "U6 at": lambda k: "" if hidden[k] else _location(result, "U6", k),
    }
    return table_lines(columns, chosen, None if with_redundancy else "redundancy")


def _effect(result: Reliability, symbol: str) -> np.ndarray:
    """Return effects (k,) of biases of the size of the MDB, 0 if they are rounding; NaN if
    undetectable or undetermined.
    """
    effects = result.effects[symbol]
    is_defined = np.isfinite(result.minimal_detectable) & (effects.first >= 0)
    change = np.where(_has_effect(result, symbol), effects.change, 0.0)
    with np.errstate(invalid="ignore"):
        return np.where(is_defined, result.minimal_detectable * change, np.nan)


def _has_effect(result: Reliability, symbol: str, k: int | slice = slice(None)) -> np.ndarray:
    """Return which of the chosen biases have an effect that is more than rounding."""
    return result.effects[symbol].change[k] > NOTHING * result.sizes[k]


def _finite_or_zero(values: np.ndarray) -> np.ndarray:
    return np.nan_to_num(values, nan=0.0, posinf=0.0)


def _worst_first(result: Reliability, chosen: Integers) -> list[int]:
    """Return patterns sorted by their effect on U6, then on U5, undetectable harmful ones first."""
    keys = [comparable(_finite_or_zero(_effect(result, symbol)[chosen])) for symbol in ("U5", "U6")]
    hidden = np.array([_is_dangerous(result, k) for k in chosen.tolist()], bool)
    return [int(chosen[i]) for i in np.lexsort((chosen, -keys[0], -keys[1], ~hidden))]


def _is_dangerous(result: Reliability, k: int) -> bool:
    return math.isinf(result.minimal_detectable[k]) and not result.is_harmless(k)


def _worst_of_each(result: Reliability, chosen: Integers) -> list[int]:
    """Return the worst pattern of each subject, of balls in each position, in the order of the
    design.
    """
    if not len(chosen):
        return []
    of_balls = result.patterns.kind[chosen[0]] in ("ball", "moved")
    worst: dict[int, int] = {}
    for k in _worst_first(result, chosen):
        subject = int(result.patterns.subject[k])
        worst.setdefault(int(result.design.readings.position[subject]) if of_balls else subject, k)
    return [worst[key] for key in sorted(worst)]


def _closing(result: Reliability) -> list[str]:
    """Return notes on undetectable biases and on omissions."""
    lines = []
    hidden = np.flatnonzero(result.information <= 0.0).tolist()
    harmless = [k for k in hidden if result.is_harmless(k)]
    dangerous = sorted(set(hidden).difference(harmless))
    if harmless:
        text = _listed(name(result.patterns, k) for k in harmless)
        which = "it changes no determined distance" if result.deficiency else "no distance changes"
        lines.append(
            f"cannot be detected, harmless: {text}: {which}, between balls or corrected points"
            f"{_probes_of_points(result.design)}"
        )
    for k in dangerous[: 4 * MOST]:
        unit = result.patterns.unit(k)
        parts = [
            f"{symbol} by up to {number(result.effects[symbol].change[k], 3)} µm per {SHOWN[unit]}"
            for symbol in result.lengths
            if result.effects[symbol].change[k] > NO_EFFECT * result.sizes[k]
        ]
        if result.across[k] > NO_EFFECT * result.sizes[k]:
            text = f"{number(result.across[k], 3)} µm per {SHOWN[unit]}"
            parts.append(f"distances between points of tasks' probes by up to {text}")
        lines.append(
            f"cannot be detected, DANGEROUS: {name(result.patterns, k)}; it changes"
            f" {', '.join(parts)}"
        )
    omitted = len(hidden) - len(harmless) - 4 * MOST
    if omitted > 0:
        lines.append(f"({omitted} more that cannot be detected are in --json)")
    if len(result.patterns.of_kind("reading")) and not len(result.patterns.of_kind("ball")):
        lines.append(
            "(no ball is read twice in one position: dirt on it is the same as a bias of its"
            " reading)"
        )
    lines.append(
        "(the worst ball of each position, and the worst direction of each event; -o and --json"
        " have the others)"
    )
    if result.deficiency:
        lines.append("(functions that the observations leave undetermined are left out)")
    count = len(result.design.evaluation.points)
    if count > MOST_PLACES:
        lines.append(f"(effects on U6 are those on {MOST_PLACES} of {count} evaluation points)")
    return ["", *lines]


def _probes_of_points(design: Design) -> str:
    """Return the probes of the corrected points if there are several."""
    names = design.probes.names
    if len(names) == 1:
        return ""
    across = across_probes(design)
    if across is None:
        return f" of probe {names[design.evaluation.probe]}"
    used = listed([names[k] for k in np.unique(design.tasks.probes)])
    return f" of probe {names[design.evaluation.probe]}, nor between those of {used}"


def _listed(names: Iterable[str]) -> str:
    every = list(names)
    more = f" and {len(every) - 4 * MOST} more" if len(every) > 4 * MOST else ""
    return ", ".join(every[: 4 * MOST]) + more


def _shown(value: float) -> str:
    return "never" if math.isinf(value) else number(1e6 * value, 3)


def _percent(value: float) -> str:
    return f"{100 * value:.4g} %"


def _location(result: Reliability, symbol: str, k: int) -> str:
    """Return the points of the largest effect."""
    effects, design = result.effects[symbol], result.design
    first, second = int(effects.first[k]), int(effects.second[k])
    if first < 0 or not _has_effect(result, symbol, k):
        return ""
    return function_name(design, effects.functions[0], first, second)


def _effect_data(result: Reliability, symbol: str, k: int) -> Data:
    hidden, effects = math.isinf(result.minimal_detectable[k]), result.effects[symbol]
    size = effects.change[k] * (1.0 if hidden else result.minimal_detectable[k])
    has_effect = _has_effect(result, symbol, k)
    return {
        "per_unit" if hidden else "change": float(size) if has_effect else 0.0,
        # That of the function with the largest change, which rounding would choose.
        "standard_uncertainty": effects.uncertainty[k] if has_effect else None,
        "at": _location(result, symbol, k),
    }


def _pattern_data(result: Reliability, k: int) -> Data:
    return {
        "name": name(result.patterns, k),
        "kind": str(result.patterns.kind[k]),
        "unit": result.patterns.unit(k),
        "minimal_detectable": result.minimal_detectable[k],
        "found_by_fit": result.found_by_fit[k],
        **({"harmless": result.is_harmless(k)} if result.information[k] <= 0.0 else {}),
        "effects": {
            symbol: _effect_data(result, symbol, k)
            for symbol in result.effects
            if result.effects[symbol].first[k] >= 0
        },
    }


def function_name(design: Design, functions: Functions, first: int, second: int) -> str:
    """Return the name of a co-ordinate from its point's label and its axis, or of a distance from
    both labels.
    """
    assert isinstance(functions, Coordinates | Distances)
    places = functions.places
    if isinstance(functions, Coordinates):
        return f"{places.name(design, first)} {AXIS_NAMES[second]}"
    if functions.pairs is None:
        return f"{places.name(design, first)} to {places.name(design, second)}"
    is_pair = (places.labels[functions.pairs] == (first, second)).all(axis=1)
    return functions.names[int(is_pair.argmax())]
