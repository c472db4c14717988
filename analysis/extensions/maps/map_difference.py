"""Difference of two maps as a result: changes, and the verdict of the joint tests."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from functools import cached_property
from typing import Any

import numpy as np
from ballplate.presentation import Data, Result, aligned, number, picked, records, table_lines
from ballplate.results import FEW, verdict_data, verdict_line
from ballplate.simulator.computing import comparable
from ballplate.simulator.inputs import listing
from ballplate.simulator.machines import Array

from ..machine_files import InCommon, readings_in_common
from .campaign_tests import TOO_ALIKE, TOO_RARE, JointDifference
from .compared_maps import ComparedMap, positions_in_common
from .comparison import MapComparison
from .normalised_errors import FigureGroup

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
        return readings_in_common(self.first.data, self.second.data)

    @property
    def is_too_alike(self) -> bool:
        """True if two measured maps differ by less than independent ones, except with a small
        probability.
        """
        test = self.comparison.test
        if test is None or self.first.is_expected or self.second.is_expected:
            return False
        return 1.0 - test.p < TOO_RARE

    @property
    def tests(self) -> tuple[JointDifference, ...]:
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

    def _verdict(self, test: JointDifference) -> str:
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
                f"difference = {self.second.label} − {self.first.label}, at the same scale"
                f" readings{probe}; U = {k:g} u, E_n = difference / U"
            ),
            self._assumption(),
            *(
                verdict_line(side.lack_of_fit, side.label)
                for side in (self.first, self.second)
                if side.lack_of_fit is not None
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
            cautions.append(
                f"warning: readings are the same in both campaigns in {listing(once)}: the"
                " campaigns are less different than two that are independent, and a change may be"
                " missed"
            )
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
        motion = self.comparison.motion
        u = motion.standard_uncertainties
        columns = [
            ("free motion of the frame", list(motion.names)),
            ("", (np.where(np.isnan(u), np.nan, motion.values), _determined)),
            ("U", 1e6 * self.coverage_factor * u),
            ("", ["µm" if name.startswith("shift") else "µrad" for name in motion.names]),
        ]
        return table_lines(columns)

    def _shown_groups(self) -> tuple[FigureGroup, ...]:
        """Return the groups of values, with all error functions as one."""
        comparison = self.comparison
        joined = (_joined(comparison.functions),) if comparison.functions else ()
        return *comparison.lengths, comparison.places, *joined, *comparison.plates

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
        if not any(test.p < LEVEL for test in self.tests):
            lines.append(
                "a single |E_n| > 1 among many values shows no change: about the stated number"
                " exceeds 1 without one; joint tests count, each at the significance level"
                f" {LEVEL:g}"
            )
        return [*lines, ""]

    def _length_table(self) -> list[str]:
        years, k = self.years, self.coverage_factor
        columns: dict[str, Any] = {
            "length": lambda row: f"{row['kind']}: {row['figure']}",
            "difference, µm": ("difference", _determined),
            "U, µm": lambda row: k * row["standard uncertainty"],
            "E_n": ("E_n", 3),
        }
        if years:
            columns["µm per year"] = lambda row: 1e6 * row["difference"] / years
            columns["U, µm per year"] = lambda row: (
                1e6 * k * row["standard uncertainty"] / abs(years)
            )
        shown = ((group, place) for group in self.comparison.lengths for place in _places(group))
        return table_lines(columns, [_row(group, place) for group, place in shown])

    def _function_table(self) -> list[str]:
        columns = {
            "error function": lambda function: f"{function.kind} {function.meaning}",
            "largest |E_n|": ("largest_size", 3),
            "at": lambda function: function.largest_name.partition(" at ")[2],
            "chi-squared": "test.statistic",
            "of": "test.dimensions",
            "p": ("test.p", _chance),
        }
        table = table_lines(columns, self.comparison.functions, unknown="undetermined")
        count = sum(function.test is not None for function in self.comparison.functions)
        remark = (
            f"({count} tests: the smallest p of as many is below {LEVEL / max(count, 1):.2g} once"
            f" in {round(1 / LEVEL)} without a change)"
        )
        return [*table, remark]

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
        rows = [
            _row(group, place)
            for group in self.comparison.groups
            for place in np.flatnonzero(group.is_compared | group.is_undetermined).tolist()
        ]
        if self.years:
            rows = [row | {"per year": row["difference"] / self.years} for row in rows]
        return rows


def _chance(p: float) -> str:
    return "below 1e-6" if p < 1e-6 else number(p, 2)


def _determined(difference: float) -> str:
    return "undetermined" if math.isnan(difference) else number(1e6 * difference)


def _share(share: float) -> str:
    return f"{100.0 * share:.1f} %"


def _row(group: FigureGroup, place: int) -> Data:
    u = float(group.standard_uncertainties[place])
    return {
        "kind": group.kind,
        "figure": group.names[place],
        "difference": math.nan if math.isnan(u) else float(group.differences[place]),
        "standard uncertainty": u,
        "unit": group.unit,
        "E_n": float(group.normalised[place]),
    }


def _places(group: FigureGroup) -> list[int]:
    """Return indices of the lengths of a group that are printed singly."""
    if len(group.names) <= TOLD:
        return list(range(len(group.names)))
    sizes = comparable(np.nan_to_num(np.abs(group.normalised)))
    largest: list[int] = np.argsort(-sizes, kind="stable")[:LARGEST].tolist()
    return largest


def _joined(groups: Sequence[FigureGroup]) -> FigureGroup:
    """Groups of several units as one, of differences in their own standard uncertainties."""
    chosen = [group.is_compared | group.is_undetermined for group in groups]

    def joined(name: str) -> Array:
        return np.concatenate(
            [getattr(group, name)[part] for group, part in zip(groups, chosen, strict=True)]
        )

    k = groups[0].coverage_factor
    names = (np.array(group.names)[part] for group, part in zip(groups, chosen, strict=True))
    return FigureGroup(
        "error functions",
        "1",
        tuple(np.concatenate(list(names)).tolist()),
        k * joined("normalised"),
        np.where(joined("is_undetermined"), np.nan, 1.0),
        joined("chances"),
        k,
    )


def _group_table(groups: Sequence[FigureGroup]) -> list[str]:
    rows = [["figures", "compared", "|E_n| > 1", "by chance", "largest |E_n|", "at"]]
    for group in groups:
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
                number(group.largest_size, 3) if group.count else "",
                group.largest_name,
            ]
        )
    return aligned(rows, [False, True, True, True, True, False])


def _map_data(side: ComparedMap) -> Data:
    return {
        **picked(side, "label", "title", "date"),
        "expected": side.is_expected,
        "degrees_of_freedom": side.degrees_of_freedom,
        **({} if side.lack_of_fit is None else {"lack_of_fit": verdict_data(side.lack_of_fit)}),
    }


def _test_data(test: JointDifference) -> Data:
    return {
        "what": test.what,
        "chi_squared": test.statistic,
        **picked(test, "dimensions", "fixed", "degrees_of_freedom", "p"),
    }
