"""The uncertainty of each dimension of a part, compared with its tolerance."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TextIO

from ballplate.presentation import (
    Data,
    MainTable,
    Result,
    aligned,
    number,
    percent,
    picked,
    shown_unit,
    table_texts,
)
from ballplate.simulator.inputs import CsvWriter, number_of, service
from ballplate.uncertainty import NamedUncertainty

from .part import Dimension, ShortWaves, Workpiece
from .part_values import LaidPart, tolerance_width, widest

# Standard uncertainties of a guard band, for a conformance probability of 95 % at one limit.
GUARD = 1.6449
# Share of the uncertainty from which a perfect map leaves a dimension as it is.
AS_IT_IS = 0.95

Interval = tuple[float | None, float | None]


@dataclass(frozen=True)
class DimensionUncertainty:
    """A dimension in a place with its uncertainty, None if its points or the map leave it open,
    with the `reason`.

    Its `name` has that of its place if there are several. `row` is its number, `drawn` its
    uncertainty by fits to points of drawn machines, and `measured` its deviation from nominal by
    readings.
    """

    name: str
    dimension: Dimension
    place: str
    value: NamedUncertainty | None
    reason: str = ""
    row: int = 0
    drawn: NamedUncertainty | None = None
    measured: float | None = None

    @property
    def share_of_tolerance(self) -> float | None:
        """U as a share of the tolerance, twice U of one with two limits; None without either."""
        width = widest(self.dimension)
        if width is None or self.value is None:
            return None
        # Places that differ by rounding are equal, and the first of them is named.
        return round(self.value.expanded_uncertainty / width, 9)

    @property
    def accepted(self) -> Interval:
        """Measured deviations between which the dimension conforms with a probability of at least
        95 % (ISO 14253-1), in m or rad; None where there is no limit.
        """
        return self._between(1.0)

    @property
    def rejected(self) -> Interval:
        """Measured deviations beyond which it does not conform with a probability of at least
        95 %.
        """
        return self._between(-1.0)

    def _between(self, sign: float) -> Interval:
        lower, upper = self.dimension.tolerance or (None, None)
        if self.value is None:
            return None, None
        if self.value.quantiles:
            ends = [row[1 if sign > 0 else 2] for row in self.value.quantiles[1:]]
            return None, None if upper is None else upper + sign * min(
                0.0, *(sign * end for end in ends)
            )
        guard = sign * GUARD * self.value.standard_uncertainty
        return None if lower is None else lower + guard, None if upper is None else upper - guard

    @property
    def verdict(self) -> str:
        """Whether the measured deviation is accepted, rejected or neither; empty without any."""
        if self.measured is None or self.value is None or self.dimension.tolerance is None:
            return ""
        if _is_between(self.measured, self.accepted):
            return "accepted"
        return "undecided" if _is_between(self.measured, self.rejected) else "rejected"

    @property
    def undecided(self) -> float | None:
        """Share of the tolerance in which a measured value is not accepted."""
        width, (lower, upper) = tolerance_width(self.dimension), self.accepted
        if width is None or upper is None:
            return None
        return 1.0 - max(upper - (lower or 0.0), 0.0) / width

    @property
    def outside(self) -> float:
        """Share of the uncertainty that remains with a perfect map."""
        value = self.value
        return 0.0 if value is None else value.outside / (value.standard_uncertainty or 1.0)


@dataclass(frozen=True, eq=False, repr=False)
class PartUncertainty(Result):
    """Dimensions of a part in its places: the part on its machine is `laid`.

    `residual_waves` is the standard deviation of errors between those of the map that the residuals
    of a fit allow, in metres. `qualified` states what the figures take for granted.
    """

    label: str
    laid: LaidPart
    dimensions: tuple[DimensionUncertainty, ...]
    residual_waves: float | None = None
    qualified: tuple[str, ...] = ()

    @property
    def part(self) -> Workpiece:
        """The part."""
        return self.laid.part

    def page_text(self) -> str:
        """Return its page as a file that needs no other."""
        text: str = service("part_page")(self)
        return text

    @property
    def title(self) -> str:
        return self.part.title

    @property
    def judged(self) -> list[DimensionUncertainty]:
        """The determined dimensions that have a tolerance."""
        return [one for one in self.dimensions if one.share_of_tolerance is not None]

    @property
    def is_held(self) -> bool:
        """Whether every dimension is determined, every tolerance is held by its uncertainty, and
        no measured deviation is rejected.
        """
        return all(
            one.value and one.value.is_within is not False and one.verdict != "rejected"
            for one in self.dimensions
        )

    def write_points(self, stream: TextIO) -> None:
        """Write the points to be touched as CSV, the form of readings: nominal scale readings."""
        points, names = self.laid.points, self.laid.machine.names
        writer = CsvWriter(stream)
        writer.writerow(["place", "feature", "point", "probe", "x_mm", "y_mm", "z_mm"])
        for (place, feature), rows in points.rows.items():
            for k, i in enumerate(range(rows.start, rows.stop), start=1):
                x = [f"{1e3 * value:.6f}" for value in points.readings[i]]
                writer.writerow([place, feature, k, names[points.probes[i]], *x])

    def headline(self) -> str:
        places, judged = len(self.part.places), self.judged
        words = number_of(len(self.part.dimensions), "dimension")
        words += f" in {number_of(places, 'place')}" if places > 1 else ""
        open_ = sum(one.value is None for one in self.dimensions)
        words += f", {open_} undetermined" if open_ else ""
        counts = Counter(one.verdict for one in self.dimensions if one.verdict)
        measured = ", ".join(f"{n} {verdict}" for verdict, n in sorted(counts.items()))
        words += f"; measured: {measured}" if measured else ""
        if not judged:
            return words
        worst = max(judged, key=lambda one: one.share_of_tolerance or 0.0)
        within = sum(bool(one.value and one.value.is_within) for one in judged)
        return (
            f"{words}; {within} of {len(judged)} within {percent(self.part.share_of_tolerance)} of"
            f" the tolerance, U/T at most {share_words(worst.share_of_tolerance)} ({worst.name})"
        )

    def lines(self) -> list[str]:
        heading = f"{self.title}: {self.headline()}"
        return [heading, *self.qualified, "", *aligned(*self.texts()), *self.explained]

    def texts(self) -> tuple[list[tuple[str, ...]], list[bool]]:
        """Return the headings, without units, and the cells of its table, and which columns are
        numbers; columns without any entry are left out.
        """
        (heads, *rows), are_numbers = table_texts(*self.columns())
        used = [k for k in range(len(heads)) if any(row[k] for row in rows)]
        shown = [tuple(row[k].partition(", µ")[0] for k in used) for row in (heads, *rows)]
        return shown, [are_numbers[k] for k in used]

    @property
    def explained(self) -> list[str]:
        """What the columns are, and what is left out, as lines of text."""
        determined = [one for one in self.dimensions if one.value is not None]
        as_they_are = sum(one.outside >= AS_IT_IS for one in determined)
        undetermined = {
            f"{one.dimension.name}: undetermined; {one.reason}": None
            for one in self.dimensions
            if one.value is None
        }
        return [
            *undetermined,
            "U is 2 u, and of forms and zones the larger end of 95 % of their errors; U/T is 2 U/T"
            " of two limits",
            "accepted: measured deviations that conform with 95 % probability (ISO 14253-1); the"
            " undecided part of the tolerance is outside them",
            f"map: its share of the variance; a perfect map would leave {as_they_are} of"
            f" {len(determined)} as they are",
            self._probes(),
            f"one touched point repeats to {_micro(self.part.probing.point_repeatability)} µm, as"
            " the part file states; that of a ball's centre is not this",
            f"errors shorter than the plate shows: {self._short_waves()}",
        ]

    def _probes(self) -> str:
        points, names = self.laid.points, self.laid.machine.names
        touched: dict[str, dict[str, None]] = {}
        for (_, feature), rows in points.rows.items():
            touched.setdefault(names[points.probes[rows.start]], {})[feature] = None
        return "touched: " + "; ".join(f"{k} {', '.join(v)}" for k, v in touched.items())

    def _short_waves(self) -> str:
        waves, residual = self.part.short_waves, self.residual_waves
        if isinstance(waves, ShortWaves):
            return (
                f"{_micro(waves.amplitude)} µm over {1e3 * waves.correlation_length:g} mm, as the"
                " part file states"
            )
        if waves == "none":
            return "none, as the part file states"
        allowed = (
            ""
            if residual is None
            else f" (the residuals of the fit allow up to {_micro(residual)} µm)"
        )
        return (
            f"left out{allowed}; state short_waves, such as {{amplitude: 0.3 um,"
            " correlation_length: 10 mm}, or none"
        )

    def data(self) -> Data:
        waves = self.part.short_waves
        stated = ("amplitude", "correlation_length")
        return {
            **self.named,
            "share_of_tolerance": self.part.share_of_tolerance,
            "point_repeatability": self.part.probing.point_repeatability,
            "short_waves": picked(waves, *stated) if isinstance(waves, ShortWaves) else waves,
            "residual_waves": self.residual_waves,
            "dimensions": [_data(one) for one in self.dimensions],
            "qualifications": list(self.qualified),
        }

    def columns(self) -> MainTable:
        """One row for each dimension in each place."""
        units = [one.dimension.unit for one in self.dimensions]
        return {
            "dimension": "dimension.name",
            "place": "place",
            "nominal, mm (mrad)": ("dimension.nominal", lambda value: f"{1e3 * value:.9g}"),
            **_numbers("lower", lambda one: _end(one.dimension.tolerance, 0)),
            **_numbers("upper", lambda one: _end(one.dimension.tolerance, 1)),
            **_numbers("shift", lambda one: one.value and (one.value.shift or None), 2),
            **_numbers("u", lambda one: one.value and one.value.standard_uncertainty, 3),
            "map": (lambda one: one.value and one.value.share, share_words),
            **_numbers("U", lambda one: one.value and one.value.expanded_uncertainty, 3),
            "U/T": ("share_of_tolerance", share_words),
            **_numbers("accepted from", lambda one: one.accepted[0]),
            **_numbers("to", lambda one: one.accepted[1]),
            "undecided": ("undecided", share_words),
            **_numbers("shift drawn", lambda one: one.drawn and one.drawn.shift, 2),
            **_numbers("u drawn", lambda one: one.drawn and one.drawn.standard_uncertainty, 3),
            **_numbers("measured", lambda one: one.measured, lambda value: f"{1e6 * value:.3f}"),
            "verdict": "verdict",
            "unit": (units, shown_unit),
        }, self.dimensions


def dimension_uncertainties(
    part: Workpiece, named: Sequence[NamedUncertainty], open_words: str
) -> tuple[DimensionUncertainty, ...]:
    """Return all dimensions of a part in all places, with their named uncertainties; `open_words`
    are the reason why a map or design leaves some open.
    """
    found = []
    for row, value in enumerate(named):
        k, j = divmod(row, len(part.places))
        is_open = math.isnan(value.standard_uncertainty)
        reason = part.undetermined.get(part.dimensions[k].name, open_words) if is_open else ""
        place = part.places[j].name if len(part.places) > 1 else ""
        known = None if is_open else value
        found.append(
            DimensionUncertainty(value.name, part.dimensions[k], place, known, reason, row)
        )
    return tuple(found)


def share_words(share: float | None) -> str:
    """Return a share in percent, empty without any."""
    if share is None:
        return ""
    if 0.0 < share < 0.001:
        return "<0.1 %"
    return f"{100 * share:.2g} %" if share < 0.1 else f"{100 * share:.0f} %"


def _numbers(name: str, values: Any, form: Any = 4) -> dict[str, Any]:
    return {f"{name}, µm (µrad)": (values, form)}


def _end(ends: Interval | None, k: int) -> float | None:
    return None if ends is None else ends[k]


def _is_between(value: float, ends: Interval) -> bool:
    lower, upper = ends
    return (lower is None or lower <= value) and (upper is None or value <= upper)


def _micro(value: float) -> str:
    return number(1e6 * value, 3)


def _data(one: DimensionUncertainty) -> Data:
    value = one.value
    data = {
        "name": one.dimension.name,
        **picked(one.dimension, "kind", "nominal", "tolerance", "unit"),
        **picked(one, "place", "reason", "measured", "verdict"),
    }
    if value is None:
        return data
    return {
        **data,
        **picked(value, "shift", "standard_uncertainty", "expanded_uncertainty", "quantiles"),
        "share_of_map": value.share,
        **picked(one, "share_of_tolerance", "accepted", "rejected", "undecided"),
        "within_target": value.is_within,
        "drawn": one.drawn and picked(one.drawn, "shift", "standard_uncertainty", "quantiles"),
    }
