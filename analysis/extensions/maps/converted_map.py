"""Fitted map in another error model, with the conversion residuals."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from ballplate.presentation import Data, MainTable, Result, number, table_lines
from ballplate.results import ESTIMATE_COLUMNS, FRAMES, ParameterEstimate
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.maps import CONVERSION, FittedMap, LeftOut, verdict_data, verdict_line

from .corrected_points import corrected_with_root
from .largest_differences import (
    Differences,
    LargestDifference,
    largest_at_points,
    largest_of_lengths,
)
from .map_conversion import MapConversion, converted
from .stated_models import stated_model

# Points between which lengths have the uncertainty that is stated beside their difference.
POINTS = 60

# Residuals in metres below which the new model can do all that the old one did.
EXACT = 1e-12


@dataclass(frozen=True, repr=False)
class ConvertedMap(Result):
    """A map in another error model: parameters with their uncertainties, and residuals.

    `points_searched` and `lengths_searched` have the largest differences between both maps,
    `length_uncertainty` the root mean square standard uncertainty of lengths by the old map, None
    if undetermined; all in metres.
    """

    label: str
    old: FittedMap
    conversion: MapConversion
    points_searched: LargestDifference
    lengths_searched: LargestDifference
    length_uncertainty: float | None

    @property
    def title(self) -> str:
        return self.old.title

    @property
    def map(self) -> FittedMap:
        """The new map, with a record of its source."""
        converted = self.conversion.converted
        name = f"conversion from {self.old.settings['kind']}"
        residual = 0.0 if self.is_exact else self.residual[0]
        conversion_residual = LeftOut(name, CONVERSION, "m", residual, None)
        earlier = (
            earlier_residual
            for earlier_residual in converted.left_out
            if earlier_residual.kind != CONVERSION
        )
        return replace(converted, left_out=(*earlier, conversion_residual))

    @property
    def residual(self) -> tuple[float, float]:
        """Largest and root mean square residual of a corrected point, in metres."""
        return self.points_searched.largest, self.points_searched.rms

    @property
    def lengths(self) -> tuple[float, float]:
        """Largest and root mean square difference of a length by both maps, in metres."""
        return self.lengths_searched.largest, self.lengths_searched.rms

    @property
    def is_exact(self) -> bool:
        """True if the new model reproduces the old one."""
        return self.residual[0] < EXACT + 1e-6 * self._largest

    @property
    def _largest(self) -> float:
        """The largest error there is."""
        x, p = self.conversion.places, self.conversion.offsets
        return float(np.abs(self.old.model.error(x, self.old.values, p) - p).max())

    @property
    def warnings(self) -> tuple[str, ...]:
        caution = self.old.lack_of_fit.caution
        return (caution,) if caution else ()

    def headline(self) -> str:
        kind = self.map.settings["kind"]
        if self.is_exact:
            return f"{kind}, {len(self.map.values)} parameters, the same corrections"
        return (
            f"{kind}, {len(self.map.values)} parameters, residual {1e6 * self.residual[1]:.3g} µm"
            " rms"
        )

    def lines(self) -> list[str]:
        old, new, k = self.old, self.map, self.old.coverage_factor
        lines = [
            self.heading,
            verdict_line(old.lack_of_fit),
            (
                f"from {old.settings['kind']}, {len(old.values)} parameters, to"
                f" {new.settings['kind']}, {len(new.values)} parameters"
            ),
        ]
        if self.is_exact:
            lines.append("the new error model does all that the old one did")
        else:
            largest, rms = (number(1e6 * length, 3) for length in self.residual)
            places = self.points_searched.places
            lines.append(
                "the new error model cannot follow the old one exactly: corrected points differ by"
                f" {largest} µm at most and {rms} µm rms, by a search from {places}"
                " points on a grid with corners and edges and at random, with the probes of the map"
                " and tips along each axis; uncertainties do not contain that"
            )
        largest, rms = (number(1e6 * length, 3) for length in self.lengths)
        beside = (
            "lengths are undetermined"
            if self.length_uncertainty is None
            else f"U (k = {k:g}) of these lengths is {number(1e6 * k * self.length_uncertainty, 3)}"
            " µm rms"
        )
        lines.append(
            f"lengths differ by {largest} µm at most and {rms} µm rms, by a search from"
            f" {self.lengths_searched.places} pairs of points, with one of the map's probes each;"
            f" {beside}"
        )
        if np.abs(self.conversion.motion).max() > EXACT:
            d = old.dimension
            shift, turn = (np.abs(part).max() for part in np.split(self.conversion.motion, [d]))
            lines.append(
                "between the frames of the two models lies a rigid motion, which changes no length:"
                f" a shift of {number(1e6 * shift, 3)} µm and a turn of"
                f" {number(1e6 * turn, 3)} µrad about one axis at most"
            )
        return [*lines, "", *table_lines(COLUMNS, self._parameters)]

    def data(self) -> Data:
        return {
            "map": self.label,
            "title": self.title,
            "error_model": self.map.settings,
            "lack_of_fit": verdict_data(self.old.lack_of_fit),
            "exact": self.is_exact,
            "residual": {**vars(self.points_searched), "unit": "m"},
            "lengths": {
                **vars(self.lengths_searched),
                "standard_uncertainty": self.length_uncertainty,
                "unit": "m",
            },
            "motion": self.conversion.motion,
            "parameters": self.rows(),
        }

    def columns(self) -> MainTable:
        """One row for each parameter of the new map."""
        return COLUMNS, self._parameters

    @property
    def _parameters(self) -> list[ParameterEstimate]:
        new, u = self.map, self.map.standard_uncertainties()
        values = np.where(np.isnan(u), np.nan, new.estimates).tolist()
        return [
            ParameterEstimate(parameter.name, value, uncertainty, parameter.unit)
            for parameter, value, uncertainty in zip(
                new.parameters, values, u.tolist(), strict=True
            )
        ]


COLUMNS = {name: column for name, column in ESTIMATE_COLUMNS.items() if name != "kind"}


def _corrections(fitted: FittedMap) -> Differences:
    """Corrected points of a map by scale readings and probe offsets."""
    return lambda x, p: x + fitted.model.error(x, fitted.values, p)


@single_threaded
def convert(fitted: FittedMap, to: str, label: str) -> ConvertedMap:
    """Return a map in the error model of a text, see `stated_model`.

    :raises ExperimentError: it states none.
    """
    target = stated_model(to, fitted.volume, "--to")
    conversion = converted(fitted, target.model, target.settings, FRAMES[target.kind])
    generator = np.random.default_rng(np.random.SeedSequence(1))
    points = fitted.volume.lower + fitted.volume.size * generator.random((POINTS, fitted.dimension))
    old, root = corrected_with_root(fitted, points)
    first, second = np.triu_indices(POINTS, 1)
    unit = old[first] - old[second]
    unit /= np.linalg.norm(unit, axis=1)[:, None]
    u = np.linalg.norm(np.einsum("md,mdr->mr", unit, root[first] - root[second]), axis=1)
    is_determined = bool(np.isfinite(u).all())
    probes = np.unique(fitted.probes.offsets, axis=0)
    return ConvertedMap(
        label,
        fitted,
        conversion,
        largest_at_points(conversion.differences, fitted.volume, conversion.tips),
        largest_of_lengths(
            _corrections(fitted), _corrections(conversion.converted), fitted.volume, probes
        ),
        float(np.sqrt((u**2).mean())) if is_determined else None,
    )
