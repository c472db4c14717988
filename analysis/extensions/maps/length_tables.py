"""Lengths throughout the volume as text for people, as CSV and as plain data for programs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from ballplate.presentation import (
    Data,
    MainTable,
    Result,
    number,
    percent,
    picked,
    records,
    table_lines,
    uncertainty_words,
)
from ballplate.simulator.computing import comparable
from ballplate.simulator.machines import Array

from .length_groups import GroupedLengths, LengthGroups, target_words

if TYPE_CHECKING:
    pass

# What of a group says of which lengths it is.
HEADS = ("from", "to", "direction", "point")


@dataclass(frozen=True, eq=False, repr=False)
class LengthMap(GroupedLengths, Result):
    """Grouped lengths that show themselves."""

    @property
    def as_expected(self) -> bool:
        """True if the rank equals that of the file."""
        return self.deficiency == (self.expected or 0)

    def headline(self) -> str:
        factor = self.settings.target_factor
        u = "u" if factor == 1.0 else f"{factor:g} u"
        share = float(self.whole.within_target[0] / self.whole.count[0])
        return f"{u} within {target_words(self.settings.target)} for {percent(share)} of lengths"

    def lines(self) -> list[str]:
        """The share of lengths that meet the target, and where, how long and in which direction
        they are.
        """
        settings, whole = self.settings, self.whole
        k = f"{settings.coverage_factor:g}"
        rank = f"rank deficiency {self.deficiency}; " if self.deficiency else ""
        scatter = (
            ", the repeatability of two readings included" if settings.with_repeatability else ""
        )
        count, n = int(whole.count[0]), len(self.points)
        lines = [
            self.heading,
            (
                f"{rank}{count} lengths between {n} points of a grid, with the probe"
                f" {settings.probe}{scatter}"
            ),
            (
                f"target {target_words(settings.target)}: met by the standard uncertainty u of"
                f" {_share(whole, False)}, by the expanded uncertainty {k} u of"
                f" {_share(whole, True)} lengths"
            ),
            f"the target is meant for the {uncertainty_words(settings.target_factor)}",
        ]
        if whole.undetermined[0]:
            some = ", ".join(
                f"{_place(self.points[i])} to {_place(self.points[j])}" for i, j in self.open_pairs
            )
            lines.append(
                f"{whole.undetermined[0]} lengths are undetermined and meet no target, such as"
                f" {some}"
            )
        elif self.deficiency:
            lines.append(
                "undetermined directions leave these lengths unchanged, but may change those of"
                " another --grid"
            )
        if self.worst is not None:
            i, j = self.worst
            ratio = settings.target_factor * float(whole.maximum_ratio[0])
            summary = f"largest ratio of {_compared(self)} to the target: {number(ratio)}"
            lines.append(f"{summary}, from {_place(self.points[i])} to {_place(self.points[j])}")
        return [
            *lines,
            "",
            *_table(
                "length",
                _class_names(self.edges),
                self.by_length,
                self,
                _class_targets(self),
            ),
            "",
            *_table("direction", list(self.directions), self.by_direction, self, None),
            "",
            *_table("point, mm", *_extremes(self), self, None),
            (
                f"(points in the order of their largest ratio of {_compared(self)} to the target;"
                " lengths are those that start or end there)"
            ),
        ]

    def data(self) -> Data:
        """Plain data in metres; None where undetermined."""
        settings, edges = self.settings, self.edges.tolist()
        classes = [{"from": low, "to": high} for low, high in zip(edges, edges[1:], strict=False)]
        directions = [{"direction": name} for name in self.directions]
        return {
            **self.named,
            "rank_deficiency": self.deficiency,
            **picked(settings, "grid", "probe", "coverage_factor", "with_repeatability"),
            "target": picked(settings.target, "constant", "slope"),
            "target_coverage_factor": settings.target_factor,
            "all": _group_data([{}], self.whole)[0],
            "worst": self.worst and [self.points[k] for k in self.worst],
            "by_length": _group_data(classes, self.by_length),
            "by_direction": _group_data(directions, self.by_direction),
            "by_point": _group_data([{"point": point} for point in self.points], self.by_point),
        }

    def columns(self) -> MainTable:
        """One row for each class of length, direction and point of the grid."""
        data = self.to_dict()
        rows = []
        for group, name in (
            ("by_length", lambda row: f"{1e3 * row['from']:g} to {1e3 * row['to']:g} mm"),
            ("by_direction", lambda row: row["direction"]),
            ("by_point", lambda row: _place(row["point"])),
        ):
            for row in data[group]:
                cells = {k.replace("_", " "): v for k, v in row.items() if k not in HEADS}
                rows.append({"group": group.replace("_", " "), "of": name(row), **cells})
        lengths = {"average": "average, µm", "maximum": "maximum, µm"}
        return {lengths.get(name, name): name for name in rows[0]}, rows


def _share(groups: LengthGroups, expanded: bool) -> str:
    share = percent(float(groups.share(expanded)[0]))
    return f"{share} of" if expanded else share


def _place(point: Iterable[float]) -> str:
    return f"({', '.join(f'{1e3 * v + 0.0:.6g}' for v in point)}) mm"


def _class_names(edges: Array) -> list[str]:
    return [
        f"{1e3 * low:g} to {1e3 * high:g} mm" for low, high in zip(edges, edges[1:], strict=False)
    ]


def _class_targets(lengths: LengthMap) -> list[str] | None:
    if not lengths.settings.target.slope:
        return None
    ends = 1e6 * lengths.settings.target.at(lengths.edges)
    return [f"{number(a, 3)} to {number(b, 3)}" for a, b in zip(ends, ends[1:], strict=False)]


# Of the points, this many with the largest ratios, and as many with the smallest.
SHOWN_POINTS = 3


def _extremes(lengths: LengthMap) -> tuple[list[str], LengthGroups]:
    ratio = np.where(
        np.isnan(lengths.by_point.maximum_ratio), np.inf, lengths.by_point.maximum_ratio
    )
    order = np.argsort(-comparable(ratio), kind="stable")
    chosen = (
        order
        if len(order) <= 2 * SHOWN_POINTS
        else np.concatenate([order[:SHOWN_POINTS], order[-SHOWN_POINTS:]])
    )
    names = [_place(lengths.points[i]).removesuffix(" mm") for i in chosen]
    return names, LengthGroups(
        **{name: values[chosen] for name, values in vars(lengths.by_point).items()}
    )


def _compared(lengths: LengthMap) -> str:
    """The uncertainty that the target is meant for, as a symbol."""
    factor = lengths.settings.target_factor
    return "u" if factor == 1.0 else f"{factor:g} u"


def _table(
    head: str, names: list[str], groups: LengthGroups, lengths: LengthMap, targets: list[str] | None
) -> list[str]:
    factor = lengths.settings.coverage_factor
    k = f"{factor:g}"
    shown = np.flatnonzero(groups.count)
    maximum = groups.maximum[shown]
    ratios = lengths.settings.target_factor * groups.maximum_ratio[shown]
    columns = {
        head: [names[i] for i in shown],
        "lengths": groups.count[shown],
        "undetermined": groups.undetermined[shown],
        "u average, µm": groups.average[shown],
        "maximum": 1e6 * maximum,
        f"{k} u maximum": 1e6 * factor * maximum,
        "target": (shown, lambda i: targets[i] if targets else ""),
        f"{_compared(lengths)} / target, maximum": ratios,
        "u within": (groups.share()[shown], percent),
        f"{k} u within": (groups.share(True)[shown], percent),
    }
    without = [] if targets else ["target"]
    without += [] if groups.undetermined.any() else ["undetermined"]
    return table_lines({k: v for k, v in columns.items() if k not in without})


def _group_data(heads: list[dict[str, Any]], groups: LengthGroups) -> list[Data]:
    rows = records(
        lengths=groups.count,
        **picked(groups, "undetermined", "average", "maximum", "average_ratio", "maximum_ratio"),
        share_within=groups.share(),
        share_expanded_within=groups.share(True),
        share_missed=groups.missed,
    )
    return [head | row for head, row in zip(heads, rows, strict=True)]
