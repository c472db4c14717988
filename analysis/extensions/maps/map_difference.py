"""Difference of two maps as a result: changes, and the verdict of the joint tests."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from ballplate.presentation import Data, Result, aligned, number, picked, records
from ballplate.results import FEW
from ballplate.simulator.computing import comparable
from ballplate.simulator.maps import InCommon, verdict_data, verdict_line

from .campaign_tests import TOO_ALIKE, TOO_RARE
from .compared_maps import MOTIONS, ComparedMap, in_common, positions_in_common
from .comparison import MapComparison
from .normalised_errors import FigureGroup, JointTest
from .readings_in_common import read_once_words

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Chance below which a joint test shows a change.
LEVEL = 0.05
# Lengths that are told one by one: all of a group as small as this, of others the largest.
TOLD, LARGEST = 6, 3
DAYS_OF_A_YEAR = 365.25

INDEPENDENT = (
    "the campaigns are taken to be independent: if both rest on the same certificate, its errors"
    " cancel in the difference, U here is too large, and a change may be missed"
)

SAME_READINGS = (
    "both rest on the same readings: U and E_n, which assume independent campaigns, are"
    " meaningless here; differences come from the evaluation alone"
)

SOME_READINGS = (
    "both rest on some of the same readings: U here, which assumes independent campaigns, is too"
    " large; a change may be shown, its absence never; compare a map of new readings alone"
)


@dataclass(frozen=True, repr=False, eq=False)
class MapDifference(Result):
    """Map `second` less `first`, for the same scale readings.

    `comparison` has the values. `shared` counts certified values common to both campaigns, whose
    errors cancel; None for independent campaigns.
    """

    first: ComparedMap
    second: ComparedMap
    comparison: MapComparison
    coverage_factor: float
    shared: int | None = None

    @property
    def label(self) -> str:
        return f"{self.second.label} less {self.first.label}"

    @property
    def title(self) -> str:
        titles = dict.fromkeys([self.first.title, self.second.title])
        return "; ".join(titles)

    @property
    def years(self) -> float | None:
        """Time between the campaigns; None if a date is unknown, or both are equal."""
        if self.first.date is None or self.second.date is None:
            return None
        days = date.fromisoformat(self.second.date) - date.fromisoformat(self.first.date)
        return days.days / DAYS_OF_A_YEAR if days.days else None

    @cached_property
    def in_common(self) -> InCommon:
        """Overlap of the readings of both maps."""
        return in_common(self.first, self.second)

    @property
    def is_too_alike(self) -> bool:
        """True if two measured maps differ by less than independent ones, except with a small
        probability.
        """
        test = self.comparison.test
        if test is None or len(self._measured()) < 2:
            return False
        return 1.0 - test.p < TOO_RARE

    @property
    def tests(self) -> tuple[JointTest, ...]:
        """The joint tests that decide: of the map as a whole, and of each plate."""
        comparison = self.comparison
        every = (comparison.test, *(plate.test for plate in comparison.plates))
        return tuple(test for test in every if test is not None)

    @property
    def is_changed(self) -> bool | None:
        """True if the joint test of the map shows a change; None if untestable or hidden by common
        readings.
        """
        test = self.comparison.test
        if test is None or self.in_common == "same":
            return None
        # Common readings make the sum of both covariances too large: the difference of an
        # estimate and its update has the covariance of one less that of the other.
        is_shown = test.p < LEVEL
        return is_shown if is_shown or self.in_common == "none" else None

    def headline(self) -> str:
        test = self.comparison.test
        if self.in_common == "same":
            return "the same readings on both sides: no change can be shown"
        if test is None:
            return "no value is determined in both"
        return f"{self._verdict(test)} (p = {_chance(test.p)})"

    def _verdict(self, test: JointTest) -> str:
        if test.p < LEVEL:
            return "a change is shown"
        is_hidden = self.in_common != "none"
        return "readings in common may hide a change" if is_hidden else "no change is shown"

    def lines(self) -> list[str]:
        comparison, k = self.comparison, self.coverage_factor
        probe = f", measured with probe {comparison.probe}" if comparison.probe else ""
        lines = [
            f"{self.label}: {self.title}",
            (
                f"differences are what {self.second.label} says less what {self.first.label} says"
                f" of the same scale readings{probe}; U = {k:g} u, E_n = difference / U"
            ),
            self._assumption(),
            *(
                verdict_line(side.lack_of_fit, side.label)
                for side in (self.first, self.second)
                if not side.is_expected
            ),
            "",
            *self._motion_table(),
            "",
            *([] if self.in_common == "same" else self._tested_lines()),
            *self._length_table(),
        ]
        if self.in_common == "same":
            return lines
        if comparison.functions:
            lines += ["", *self._function_table()]
        else:
            lines += ["", f"error functions are not compared: {comparison.why_no_functions}"]
        return lines

    @property
    def notes(self) -> tuple[str, ...]:
        cautions = [
            f"warning: sigma of {side.label} comes from {side.degrees_of_freedom:g} degrees of"
            f" freedom; with so few, more than {_share(0.0455)} exceed |E_n| = 1 without a change"
            for side in (self.first, self.second)
            if side.degrees_of_freedom < FEW
        ]
        for side in (self.first, self.second):
            cautions += [
                f"warning: {side.label}: {caution}" for caution in side.cautions if caution
            ]
        if self.in_common == "same":
            cautions.append(f"warning: {SAME_READINGS}")
        elif once := positions_in_common(self.first, self.second):
            cautions.append(f"warning: {read_once_words(once)}")
        elif self.is_too_alike:
            cautions.append(f"warning: {TOO_ALIKE}")
        return tuple(cautions)

    def _assumption(self) -> str:
        if self.in_common != "none":
            return SAME_READINGS if self.in_common == "same" else SOME_READINGS
        expected = [side for side in (self.first, self.second) if side.is_expected]
        if expected:
            side = expected[0]
            knowledge = (
                "exactly known" if not side.root.size and side.stated is None else "as well known"
            )
            knowledge += "" if knowledge == "exactly known" else " as is stated"
            return f"{side.label} is no measurement, and is {knowledge}"
        if self.shared is None:
            return INDEPENDENT
        return (
            f"{self.shared} certified values are the same in both campaigns: their errors cancel"
            " to the extent that both estimates follow them; everything else is assumed"
            " independent"
        )

    def _motion_table(self) -> list[str]:
        motion, k = self.comparison.motion, self.coverage_factor
        rows = [["free motion of the frame", "", "U", ""]]
        values = zip(motion.names, motion.values, motion.standard_uncertainties, strict=True)
        for name, value, u in values:
            unit = "µm" if name.startswith("shift") else "µrad"
            value_text = "undetermined" if math.isnan(u) else number(1e6 * value)
            rows.append([name, value_text, number(1e6 * k * u), unit])
        return [*aligned(rows, [False, True, True, False]), *map(self._held_line, self._measured())]

    def _measured(self) -> tuple[ComparedMap, ...]:
        return tuple(side for side in (self.first, self.second) if not side.is_expected)

    def _held_line(self, side: ComparedMap) -> str:
        every = MOTIONS[side.dimension]
        turns = {f"{name} of the probe" for name in every[side.dimension :]}
        held_motions = set(side.held)
        parts = []
        if held_motions >= set(every):
            parts.append("every motion of the frame")
        else:
            parts += [name for name in every if name in held_motions]
        parts += (
            ["the orientation of the probe"]
            if held_motions >= turns
            else sorted(held_motions & turns)
        )
        motions = ", ".join(parts) or "nothing"
        return f"({side.label}: the conditions of its error model take out {motions})"

    def _shown_groups(self) -> tuple[FigureGroup, ...]:
        """Return the groups of values, with all error functions as one."""
        comparison = self.comparison
        lengths, plates = (
            comparison.lengths,
            tuple(compared_part.figures for compared_part in comparison.plates),
        )
        of_functions = [compared_part.figures for compared_part in comparison.functions]
        joined = (_joined(of_functions),) if of_functions else ()
        return (*lengths, comparison.places, *joined, *plates)

    def _tested_lines(self) -> list[str]:
        lines = [*_group_table(self._shown_groups()), ""]
        for test in self.tests:
            freedom = test.degrees_of_freedom
            scatter = "" if math.isinf(freedom) else f" (sigma of {freedom:.0f} degrees of freedom)"
            if test.fixed:
                scatter += (
                    f", {test.fixed} more fixed by the certificate and not tested, the same to"
                    f" {number(1e6 * test.held, 2)} µm"
                )
            lines.append(
                f"{test.what}, one joint test: chi-squared {number(test.statistic)} of"
                f" {test.dimensions} independent differences{scatter}, p = {_chance(test.p)}:"
                f" {self._verdict(test)}"
            )
        lines.append(
            "a single |E_n| > 1 among many values shows no change: about the stated number exceeds"
            f" 1 without one; joint tests count, each at the significance level {LEVEL:g}"
        )
        return [*lines, ""]

    def _length_table(self) -> list[str]:
        years = self.years
        k = self.coverage_factor
        heads = ["length", "difference, µm", "U, µm", "E_n"]
        rows = [heads + (["µm per year", "U, µm per year"] if years else [])]
        for group in self.comparison.lengths:
            for place in _shown_places(group):
                value, u = group.differences[place], group.standard_uncertainties[place]
                is_open = math.isnan(u)
                row = [
                    f"{group.kind}: {group.names[place]}",
                    "undetermined" if is_open else number(1e6 * value),
                    number(1e6 * k * u),
                    number(group.normalised[place], 3),
                ]
                if years:
                    rate = math.nan if is_open else value / years
                    row += [number(1e6 * rate), number(1e6 * k * u / abs(years))]
                rows.append(row)
        return aligned(rows, [False] + [True] * (len(rows[0]) - 1))

    def _function_table(self) -> list[str]:
        rows = [["error function", "largest |E_n|", "at", "chi-squared", "of", "p"]]
        for function in self.comparison.functions:
            place, test = function.figures.largest, function.test
            value = math.nan if place is None else abs(float(function.figures.normalised[place]))
            rows.append(
                [
                    f"{function.name} {function.axis}",
                    "undetermined" if place is None else number(value, 3),
                    "" if place is None else function.figures.names[place].partition(" at ")[2],
                    "" if test is None else number(test.statistic),
                    "" if test is None else str(test.dimensions),
                    "" if test is None else _chance(test.p),
                ]
            )
        count = sum(function.test is not None for function in self.comparison.functions)
        remark = (
            f"({count} tests: the smallest p of as many is below {LEVEL / max(count, 1):.2g} once"
            f" in {round(1 / LEVEL)} without a change)"
        )
        return [*aligned(rows, [False, True, False, True, True, True]), remark]

    def data(self) -> Data:
        comparison, motion = self.comparison, self.comparison.motion
        tested = (
            *self.tests,
            *(function.test for function in comparison.functions if function.test is not None),
        )
        return {
            "first": _map_data(self.first),
            "second": _map_data(self.second),
            "probe": comparison.probe,
            "coverage_factor": self.coverage_factor,
            "shared_values": self.shared,
            "same_readings": self.in_common == "same",
            "readings_in_common": self.in_common,
            "years": self.years,
            "changed": self.is_changed,
            "level": LEVEL,
            "motion": records(
                name=motion.names,
                value=motion.values,
                standard_uncertainty=motion.standard_uncertainties,
                unit=["m" if name.startswith("shift") else "rad" for name in motion.names],
            ),
            "tests": list(map(_test_data, tested)),
            "groups": [
                {
                    **picked(group, "kind", "count", "undetermined", "exceeding"),
                    "share_by_chance": group.by_chance,
                }
                for group in comparison.groups
            ],
            "functions_not_compared": comparison.why_no_functions or None,
            "figures": self.rows(),
        }

    def rows(self) -> list[Data]:
        """Return one row per compared or undetermined value."""
        table = []
        for group in self.comparison.groups:
            normalised, is_compared = group.normalised, group.is_compared
            for k, name in enumerate(group.names):
                u = float(group.standard_uncertainties[k])
                is_open = math.isnan(u)
                if not is_open and not is_compared[k]:
                    continue
                difference = math.nan if is_open else float(group.differences[k])
                row = {
                    "kind": group.kind,
                    "figure": name,
                    "difference": difference,
                    "standard uncertainty": u,
                    "unit": group.unit,
                    "E_n": float(normalised[k]),
                }
                if self.years:
                    row["per year"] = difference / self.years
                table.append(row)
        return table

    def plot(self, path: str | Path | None = None) -> Figure:
        """Draw differences at points of the volume as magnified vectors, and E_n of lengths and
        error functions.

        A path in .svg, .png or .pdf saves the plot.

        :raises ImportError: matplotlib is missing.
        :raises ValueError: the path ends in something else.
        """
        from .difference_plots import draw_difference

        return draw_difference(self.comparison, f"{self.label}: {self.headline()}", path)


def _chance(p: float) -> str:
    return "below 1e-6" if p < 1e-6 else number(p, 2)


def _share(share: float) -> str:
    return f"{100.0 * share:.1f} %"


def _shown_places(group: FigureGroup) -> list[int]:
    """Return indices of the lengths of a group that are printed singly."""
    if len(group.names) <= TOLD:
        return list(range(len(group.names)))
    sizes = comparable(np.nan_to_num(np.abs(group.normalised)))
    largest: list[int] = np.argsort(-sizes, kind="stable")[:LARGEST].tolist()
    return largest


def _joined(groups: Sequence[FigureGroup]) -> FigureGroup:
    """Groups of several units as one, of differences in their own standard uncertainties."""
    compared = [group.is_compared | np.isnan(group.standard_uncertainties) for group in groups]
    open_ = [
        np.isnan(group.standard_uncertainties[w]) for group, w in zip(groups, compared, strict=True)
    ]
    u = np.where(np.concatenate(open_), np.nan, 1.0)
    normalised = [
        group.normalised[is_compared] for group, is_compared in zip(groups, compared, strict=True)
    ]
    names = (
        name
        for group, is_compared in zip(groups, compared, strict=True)
        for name, is_in in zip(group.names, is_compared, strict=True)
        if is_in
    )
    chances = [
        group.chances[is_compared] for group, is_compared in zip(groups, compared, strict=True)
    ]
    k = groups[0].coverage_factor
    return FigureGroup(
        "error functions",
        "1",
        tuple(names),
        k * np.concatenate(normalised),
        u,
        np.concatenate(chances),
        k,
    )


def _group_table(groups: Sequence[FigureGroup]) -> list[str]:
    rows = [["figures", "compared", "|E_n| > 1", "by chance", "largest |E_n|", "at"]]
    for group in groups:
        place = group.largest
        count = str(group.count)
        if group.undetermined:
            count += f" ({group.undetermined} undetermined)"
        share = (
            f"{group.exceeding} ({_share(group.exceeding / group.count)})" if group.count else ""
        )
        rows.append(
            [
                group.kind,
                count,
                share,
                _share(group.by_chance) if group.count else "",
                "" if place is None else number(abs(float(group.normalised[place])), 3),
                "" if place is None else group.names[place],
            ]
        )
    return aligned(rows, [False, True, True, True, True, False])


def _map_data(side: ComparedMap) -> Data:
    return {
        **picked(side, "label", "title", "date"),
        "expected": side.is_expected,
        "degrees_of_freedom": side.degrees_of_freedom,
        **({} if side.is_expected else {"lack_of_fit": verdict_data(side.lack_of_fit)}),
        "frame_takes_out": side.held,
    }


def _test_data(test: JointTest) -> Data:
    return {
        "what": test.what,
        "chi_squared": test.statistic,
        **picked(test, "dimensions", "fixed", "degrees_of_freedom", "p"),
    }
