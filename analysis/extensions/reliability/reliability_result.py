"""Reliability of a design, as text for people, plain data for programs, and a table for
spreadsheets.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import numpy as np
from ballplate.presentation.formatting import (
    SHOWN,
    aligned,
    ascii_units,
    finite,
    number,
    picked,
)
from ballplate.presentation.result import Result
from ballplate.simulator.computing.rounding import comparable
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.estimation.functions import Functions, function_name
from ballplate.simulator.geometry.motions import AXIS_NAMES
from ballplate.simulator.inputs.settings import listed
from ballplate.simulator.inputs.spreadsheets import CsvWriter
from ballplate.simulator.machines.protocol import Array, Integers
from ballplate.uncertainty.quantities import QUANTITIES

from .effects import MOST_PLACES, across_probes
from .names import name
from .patterns import DRIFTS, Patterns, single_kinds
from .rows_of_points import RowOfPoints, draw_rows

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# An effect below this share of the bias, in metres per unit, counts as none.
NO_EFFECT = 1e-6

# Observations of a kind that a table names.
MOST = 5

EVENTS: tuple[tuple[str, ...], ...] = (
    ("ball",),
    ("moved",),
    ("shift",),
    ("turn",),
    ("probe",),
    ("length value",),
    ("scale",),
    ("expansion",),
    ("drift",),
    ("scale drift",),
)


@dataclass(frozen=True)
class Effects:
    """Largest changes `change` (k,) of `functions` of one kind by a unit of each pattern's bias,
    and where.

    `first` and `second` (k,) are the places of the function that changes most, -1 where none is
    determined; `uncertainty` (k,) is its standard uncertainty.
    """

    functions: tuple[Functions, ...]
    change: Array
    first: Integers
    second: Integers
    uncertainty: Array


@dataclass(frozen=True, repr=False)
class Reliability(Result):
    """What a design notices of biases, for each of its patterns.

    `redundancy` (rows,) are the redundancy numbers of the observations; a reading of a plate stands
    for the mean of its repeats, which have `among_repeats` degrees of freedom more among
    themselves. `left` (k,) is that of each pattern: of a single observation its redundancy number,
    otherwise the share of its square that is left in the residuals. `information` (k,) is what is
    left of a pattern in the residuals, per unit of the bias squared, and 0 where that is nil.
    `effects` are by symbol, and `across` (k,) is the largest change of a distance between points
    measured with any of the probes that measuring tasks use. `noncentrality` belongs to the test
    with `false_alarm` and `power`, sigma being known or estimated from the observations, less the
    one suspected, and `fit_noncentrality` to each of all those tests that a fit makes.
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

    def lines(self, with_all: bool = False) -> list[str]:
        """As lines of text; `with_all` lists every event, not only the worst of each position or
        probe.
        """
        return _lines(self, with_all)

    def to_dict(self) -> dict[str, Any]:
        return _data(self)

    def rows(self) -> list[dict[str, Any]]:
        """One row for each bias: of an observation, a probe, a position, a certificate."""
        data = self.to_dict()
        rows = []
        for one in (*data["observations_by_name"], *data["events"]):
            changes = {symbol: effect.get("change") for symbol, effect in one["effects"].items()}
            names = ("name", "kind", "redundancy", "minimal_detectable", "found_by_fit", "unit")
            rows.append({name.replace("_", " "): one.get(name) for name in names} | changes)
        return rows

    def plot(self, path: str | Path | None = None) -> Figure:
        """The smallest biases of readings that a test finds, and what those just too small for it
        change in U6, by position.

        With a path, which ends in .svg, .png or .pdf, the picture is written as well.

        :raises ImportError: matplotlib is missing.
        :raises ValueError: the path ends in something else, or there are no readings of plates.
        """
        readings = self.patterns.of_kind("reading")
        if not len(readings):
            raise ValueError("no readings of plates are tested, so that there is nothing to draw")
        design = self.design
        position = design.readings.position[self.patterns.subject[readings]]
        panels = [
            (
                name,
                [
                    RowOfPoints(design.positions.names[k], own[np.isfinite(own)])
                    for k in np.unique(position)
                    for own in [1e6 * values[readings[position == k]]]
                ],
            )
            for name, values in (
                ("minimal detectable bias of a reading, µm", self.minimal_detectable),
                ("what it changes in U6 at most, µm", _effect(self, "U6")),
            )
        ]
        words = f"{self.title}: minimal detectable biases of readings, and their effects on U6"
        return draw_rows(panels, words, path)

    @cached_property
    def found_by_fit(self) -> Array:
        """The same of the tests that `fit` makes, which are many together; NaN for drifts, which it
        looks for as smooth errors.
        """
        as_smooth = np.isin(self.patterns.kind, DRIFTS)
        return np.where(as_smooth, np.nan, self._biases(self.fit_noncentrality))

    @cached_property
    def minimal_detectable(self) -> Array:
        """Minimal detectable biases (k,) in metres, radians or ratios; infinite where nothing can
        be detected.
        """
        return self._biases(self.noncentrality)

    def _biases(self, noncentrality: float) -> Array:
        with np.errstate(divide="ignore"):
            return np.asarray(
                np.where(self.information > 0.0, noncentrality / np.sqrt(self.information), np.inf)
            )

    def is_harmless(self, k: int) -> bool:
        """Whether a bias changes no distance: between balls, between corrected points with the
        probe of the evaluation or those of measuring tasks, nor any other length that is judged.
        """
        changes = [self.across, *(self.effects[symbol].change for symbol in self.lengths)]
        return all(change[k] <= NO_EFFECT * self.size(k) for change in changes)

    @property
    def lengths(self) -> list[str]:
        """Symbols of the effects that are on lengths."""
        return [symbol for symbol in self.effects if QUANTITIES[symbol].are_lengths]

    def size(self, k: int) -> float:
        """About how far, in metres, a unit of a bias moves what it is about."""
        return 1.0 if self.patterns.unit(k) == "m" else self._extent

    @cached_property
    def _extent(self) -> float:
        return max(float(np.ptp(self.design.balls.places, axis=0).max(initial=0.0)), 1e-3)


def _lines(result: Reliability, with_all: bool) -> list[str]:
    """Reliability as lines of text; `with_all` lists every event, not only the worst of each
    position or probe.
    """
    lines = [*_heading(result), "", *_positions(result)]
    readings = result.patterns.of_kind("reading")
    items = result.patterns.of_kind(*single_kinds(result.design)[1:])
    for title, chosen in (("worst readings", readings), ("worst items", items)):
        if len(chosen):
            lines += [
                "",
                *_table(result, title, _worst_first(result, chosen)[:MOST], with_redundancy=True),
            ]
    events: list[int] = []
    for kinds in EVENTS:
        found = result.patterns.of_kind(*kinds)
        events += found.tolist() if with_all else _worst_of_each(result, found)
    if events:
        lines += ["", *_table(result, "events", events, with_redundancy=False)]
    return lines + _closing(result, with_all)


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
        lines.append("a reading stands for the mean of its repeats")
    if math.isinf(result.noncentrality):
        lines.append(
            "too few degrees of freedom to estimate sigma without what is tested; nothing is"
            " detectable"
        )
    return lines


def _positions(result: Reliability) -> list[str]:
    """A summary of the readings of plates by position."""
    design, given = result.design, result.patterns
    readings = given.of_kind("reading")
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
    position = design.readings.position[given.subject[readings]]
    of_u6 = _effect(result, "U6")
    for k in np.unique(position):
        own = readings[position == k]
        by_bias = own[comparable(result.minimal_detectable[own]).argmax()]
        by_effect = own[comparable(_finite_or_zero(of_u6[own])).argmax()]
        known = bool(np.isfinite(of_u6[by_effect]))
        u = (
            f"{number(1e6 * of_u6[by_effect], 3)}"
            f" ({number(1e6 * result.effects['U6'].uncertainty[by_effect], 3)})"
        )
        rows.append(
            [
                design.positions.names[k],
                str(len(np.unique(given.subject[own]))),
                number(result.left[own].min(), 3),
                number(result.left[own].mean(), 3),
                _shown(result.minimal_detectable[by_bias]),
                _shown(result.found_by_fit[by_bias]),
                name(given, int(by_bias), with_position=False),
                u if known else "-",
                name(given, int(by_effect), with_position=False) if known else "",
            ]
        )
    if len(rows) == 1:
        return ["no readings of plates"]
    return aligned(rows, [False, True, True, True, True, True, False, True, False])


def _table(
    result: Reliability, title: str, chosen: Sequence[int], with_redundancy: bool
) -> list[str]:
    rows = [
        [
            title,
            *(["redundancy"] if with_redundancy else []),
            "MDB",
            "by fit",
            "unit",
            *(f"{s}, µm" for s in result.effects),
        ]
    ]
    rows[0].append("U6 at")
    effects = {symbol: _effect(result, symbol) for symbol in result.effects}
    for k in chosen:
        unit = result.patterns.unit(k)
        cells = [name(result.patterns, k)]
        if with_redundancy:
            cells.append(number(result.left[k], 3))
        cells += [_shown(result.minimal_detectable[k]), _shown(result.found_by_fit[k]), SHOWN[unit]]
        for symbol, effect in effects.items():
            change = _effect_number(result, symbol, k, effect[k])
            uncertainty = number(1e6 * result.effects[symbol].uncertainty[k], 3)
            cells.append("-" if math.isnan(effect[k]) else f"{change} ({uncertainty})")
        cells.append("" if math.isinf(result.minimal_detectable[k]) else _where(result, "U6", k))
        rows.append(cells)
    right = [
        False,
        *([True] if with_redundancy else []),
        True,
        True,
        False,
        *(True for _ in result.effects),
        False,
    ]
    return aligned(rows, right)


def _effect_number(result: Reliability, symbol: str, k: int, effect: float) -> str:
    """An effect in micrometres, 0 where there is none but rounding."""
    if result.effects[symbol].change[k] <= 1e-9 * result.size(k):
        return "0"
    return number(1e6 * effect, 3)


def _effect(result: Reliability, symbol: str) -> np.ndarray:
    """Effects (k,) of biases of the size of the MDB; NaN where nothing can be detected or nothing
    is determined.
    """
    effects = result.effects[symbol]
    known = np.isfinite(result.minimal_detectable) & (effects.first >= 0)
    with np.errstate(invalid="ignore"):
        return np.where(known, result.minimal_detectable * effects.change, np.nan)


def _finite_or_zero(values: np.ndarray) -> np.ndarray:
    return np.nan_to_num(values, nan=0.0, posinf=0.0)


def _worst_first(result: Reliability, chosen: Integers) -> list[int]:
    """Patterns by their effect on U6, then on U5, those that cannot be detected but do harm
    first.
    """
    keys = [comparable(_finite_or_zero(_effect(result, symbol)[chosen])) for symbol in ("U5", "U6")]
    hidden = np.array([_is_dangerous(result, k) for k in chosen.tolist()], bool)
    return [int(chosen[i]) for i in np.lexsort((chosen, -keys[0], -keys[1], ~hidden))]


def _is_dangerous(result: Reliability, k: int) -> bool:
    return math.isinf(result.minimal_detectable[k]) and not result.is_harmless(k)


def _worst_of_each(result: Reliability, chosen: Integers) -> list[int]:
    """The worst pattern of each subject, or of each position for balls, in the order of the
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


def _closing(result: Reliability, with_all: bool) -> list[str]:
    """What cannot be detected, in words, and what was left out."""
    lines = []
    hidden = np.flatnonzero(result.information <= 0.0).tolist()
    harmless = [k for k in hidden if result.is_harmless(k)]
    dangerous = sorted(set(hidden).difference(harmless))
    if harmless:
        told = _listed(name(result.patterns, k) for k in harmless)
        which = "it changes no determined distance" if result.deficiency else "no distance changes"
        lines.append(
            f"cannot be detected, harmless: {told}: {which}, between balls or corrected points"
            f"{_of_probes(result.design)}"
        )
    for k in dangerous[: 4 * MOST]:
        unit = result.patterns.unit(k)
        parts = [
            f"{symbol} by up to {number(result.effects[symbol].change[k], 3)} µm per {SHOWN[unit]}"
            for symbol in result.lengths
            if result.effects[symbol].change[k] > NO_EFFECT * result.size(k)
        ]
        if result.across[k] > NO_EFFECT * result.size(k):
            told = f"{number(result.across[k], 3)} µm per {SHOWN[unit]}"
            parts.append(f"distances between points of tasks' probes by up to {told}")
        lines.append(
            f"cannot be detected, DANGEROUS: {name(result.patterns, k)}; it changes"
            f" {', '.join(parts)}"
        )
    left = len(hidden) - len(harmless) - 4 * MOST
    if left > 0:
        lines.append(f"({left} more that cannot be detected are in --json)")
    if len(result.patterns.of_kind("reading")) and not len(result.patterns.of_kind("ball")):
        lines.append(
            "(no ball is read twice in one position: dirt on it is the same as a bias of its"
            " reading)"
        )
    if not with_all:
        lines.append(
            "(the worst ball of each position, and the worst direction of each event; --all lists"
            " the others)"
        )
    if result.deficiency:
        lines.append("(functions that the observations leave undetermined are left out)")
    count = len(result.design.evaluation.points)
    if count > MOST_PLACES:
        lines.append(f"(effects on U6 are those on {MOST_PLACES} of {count} evaluation points)")
    return ["", *lines] if lines else []


def _of_probes(design: Design) -> str:
    """Which probes measure the corrected points whose distances were looked at, if there are
    several.
    """
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


def _where(result: Reliability, symbol: str, k: int) -> str:
    """Where the largest effect is."""
    effects, design = result.effects[symbol], result.design
    first, second = int(effects.first[k]), int(effects.second[k])
    if first < 0 or result.effects[symbol].change[k] <= 1e-9 * result.size(k):
        return ""
    return function_name(design, effects.functions[0], first, second)


def _data(result: Reliability) -> dict[str, Any]:
    """Reliability as plain data in metres, radians and ratios; None where nothing can be detected
    or determined.
    """
    is_single = np.isin(result.patterns.kind, single_kinds(result.design))
    return {
        "experiment": result.label,
        "title": result.title,
        "parameters": result.design.parameter_count,
        "observations": result.design.observation_count,
        "rank_deficiency": result.deficiency,
        **picked(result, "degrees_of_freedom", "sigma_is_estimated", "false_alarm", "power"),
        "noncentrality": finite(result.noncentrality),
        "fit_noncentrality": finite(result.fit_noncentrality),
        "redundancy": float(result.redundancy.sum()) + result.among_repeats,
        "redundancy_among_repeats": result.among_repeats,
        "observations_by_name": [
            {**_pattern_data(result, k), "redundancy": float(result.left[k])}
            for k in np.flatnonzero(is_single).tolist()
        ],
        "events": [_pattern_data(result, k) for k in np.flatnonzero(~is_single).tolist()],
    }


def _pattern_data(result: Reliability, k: int) -> dict[str, Any]:
    hidden = math.isinf(result.minimal_detectable[k])
    return {
        "name": name(result.patterns, k),
        "kind": str(result.patterns.kind[k]),
        "unit": result.patterns.unit(k),
        "minimal_detectable": finite(float(result.minimal_detectable[k])),
        "found_by_fit": finite(float(result.found_by_fit[k])),
        **({"harmless": result.is_harmless(k)} if result.information[k] <= 0.0 else {}),
        "effects": {
            symbol: {
                "per_unit" if hidden else "change": float(
                    result.effects[symbol].change[k]
                    * (1.0 if hidden else result.minimal_detectable[k])
                ),
                "standard_uncertainty": finite(float(result.effects[symbol].uncertainty[k])),
                "at": _where(result, symbol, k),
            }
            for symbol in result.effects
            if result.effects[symbol].first[k] >= 0
        },
    }


def write_observations(stream: TextIO, result: Reliability) -> None:
    """Write a row for every observation: each co-ordinate of each reading, and each item."""
    writer = CsvWriter(stream)
    writer.writerow(
        [
            "kind",
            "position",
            "ball",
            "probe",
            "axis",
            "name",
            "redundancy",
            "unit",
            "minimal_detectable",
            "found_by_fit",
        ]
        + [
            f"{symbol}_{what}"
            for symbol in result.effects
            for what in ("effect_um", "standard_uncertainty_um", "at")
        ]
    )
    design, given = result.design, result.patterns
    effects = {symbol: _effect(result, symbol) for symbol in result.effects}
    for k in np.flatnonzero(np.isin(given.kind, single_kinds(given.design))).tolist():
        names = ["", "", "", ""]
        if given.kind[k] in ("reading", "end"):
            i = int(given.subject[k])
            readings = design.readings
            position, probe = (
                design.positions.names[readings.position[i]],
                design.probes.names[readings.probe[i]],
            )
            names = [
                position,
                design.ball_label(int(readings.ball[i])),
                probe,
                AXIS_NAMES[given.axis[k]],
            ]
        unit = given.unit(k)
        cells: list[Any] = [
            given.kind[k],
            *names,
            name(given, k),
            repr(float(result.left[k])),
            ascii_units(SHOWN[unit]),
        ]
        cells += [_cell(result.minimal_detectable[k]), _cell(result.found_by_fit[k])]
        for symbol in result.effects:
            cells += [
                _cell(effects[symbol][k]),
                _cell(result.effects[symbol].uncertainty[k]),
                _where(result, symbol, k),
            ]
        writer.writerow(cells)


def _cell(value: float) -> str:
    """A small number in micro-units with all its digits, empty where there is none."""
    return repr(float(1e6 * value)) if math.isfinite(value) else ""
