"""Readings from reports of measuring programs: features used and skipped."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from typing import TextIO

import numpy as np
from ballplate.simulator.design import Design
from ballplate.simulator.estimation import FEWEST_POINTS, SphereFit, closest_sphere
from ballplate.simulator.experiment import Coordinate
from ballplate.simulator.inputs import (
    CsvWriter,
    ExperimentError,
    GivenText,
    Mark,
    listing,
    number_of,
    refused,
    shorten,
)

from .feature_names import LONGEST_NAME, Named, fold, named, position_of_file
from .formats.registered import read_report
from .formats.report import CIRCLE, POINT, SPHERE, UNSTATED, Feature, Report

# How programs number the points of a sphere behind its name.
NUMBERED = re.compile(r"(.+)[-_.:# ](?:P|PT|PNT)?([0-9]{1,6})", re.IGNORECASE)
# Decimals of a millimetre that are written: a picometre, below every digit of a report.
DECIMALS = 9
IN_WORDS = {
    "machine": "the machine's co-ordinate system",
    "part": "a part's co-ordinate system",
    "unstated": "a co-ordinate system that the report does not state",
}


@dataclass(frozen=True, eq=False)
class ImportedReading:
    """A ball's centre (3,) in metres, with the names in its feature; `uncertainty` is that of a
    centre from points on the surface, of its least certain axis. The axis `across` is not read, -1
    if all are.
    """

    mark: Mark
    position: str
    ball: str
    probe: str
    centre: tuple[float, float, float]
    uncertainty: float | None = None
    across: int = -1


@dataclass(frozen=True)
class ImportedReadings:
    """Readings of reports, and notes on how they were read.

    `told` lists per file features used and skipped, `remarks` are further notes, and `coordinates`
    is the entry `readings: {coordinates: …}` of the experiment.
    """

    readings: tuple[ImportedReading, ...]
    told: tuple[str, ...]
    remarks: tuple[str, ...]
    coordinates: Coordinate
    dimension: int = 3

    def columns(self, uncertainties: bool = False) -> dict[str, list[str] | list[float]]:
        """Columns of a table of readings, in millimetres, NaN for a co-ordinate that is not read;
        without probes if no report names any.
        """
        rows = self.readings
        columns: dict[str, list[str] | list[float]] = {
            "position": [row.position for row in rows],
            "ball": [row.ball for row in rows],
        }
        if any(row.probe for row in rows):
            columns["probe"] = [row.probe for row in rows]
        for i, axis in enumerate("xyz"[: self.dimension]):
            columns[f"{axis}_mm"] = [
                math.nan if row.across == i else round(1e3 * row.centre[i], DECIMALS)
                for row in rows
            ]
        if uncertainties and all(row.uncertainty is not None for row in rows):
            columns["u_um"] = [1e6 * (row.uncertainty or 0.0) for row in rows]
        return columns

    def write(self, stream: TextIO, uncertainties: bool = False) -> None:
        """Write a table of readings, below comments on their sources."""
        for line in (*self.told, self.key):
            stream.write(f"# {line}\n")
        writer = CsvWriter(stream)
        columns = self.columns(uncertainties)
        writer.writerow(list(columns))
        for row in zip(*columns.values(), strict=True):
            writer.writerow(["" if cell != cell else cell for cell in row])

    @property
    def key(self) -> str:
        """Entry of the experiment on the co-ordinates."""
        return (
            "these are centres of balls; say so in the experiment, readings: {coordinates:"
            f' {self.coordinates}}}, or with fit --coordinates "{self.coordinates}"'
        )


@dataclass(frozen=True)
class ImportSettings:
    """Options for reports: the experiment that names features, the rule of the names, the format,
    metres per unit for files without a unit, a flag for centres of circles, and the encoding.
    """

    design: Design | None = None
    rule: str | None = None
    form: str | None = None
    unit: Fraction | None = None
    circles: bool = False
    encoding: str | None = None

    @property
    def kinds(self) -> set[str]:
        """Types of features that may be readings."""
        return {SPHERE, UNSTATED, *([CIRCLE] * self.circles)}


@dataclass
class _Taken:
    """Readings of a report, with the parts of their names, and skipped features."""

    report: Report
    features: list[tuple[Feature, dict[str, str], SphereFit | None]] = field(default_factory=list)
    left: Counter[str] = field(default_factory=Counter)
    remarks: list[str] = field(default_factory=list)

    def leave(self, features: Sequence[Feature], why: str) -> None:
        """Skip features for a reason, reported with their names."""
        if features:
            self.left.update(f"{feature.kind} ({why})" for feature in features)
            names = listing((f'"{shorten(feature.name, 30)}"' for feature in features), 5)
            self.remarks.append(f"{self.report.file}: {len(features)} left, {why}: {names}")

    def centred(self, feature: Feature) -> tuple[Feature, SphereFit | None] | None:
        """Return a feature with its centre, and the closest sphere of points; a feature without a
        centre is skipped.
        """
        if feature.lacks or feature.points is None:
            return None if feature.lacks else (feature, None)
        fit = closest_sphere(feature.points)
        if fit is None:
            few = len(feature.points) < FEWEST_POINTS
            why = f"has {len(feature.points)} points; a sphere needs {FEWEST_POINTS}"
            self.leave([feature], why if few else "has points about in a plane")
            return None
        x, y, z = fit.centre.tolist()
        return replace(feature, centre=(x, y, z)), fit


def report_readings(
    paths: Sequence[Path | GivenText], settings: ImportSettings
) -> ImportedReadings:
    """Return readings of reports whose features have names by a rule (see `feature_names`).

    :raises ExperimentError: a file cannot be read, is of unknown format or invalid, or has no
        reading.
    """
    taken_reports = [
        _taken(read_report(path, settings.form, settings.unit, settings.encoding), path, settings)
        for path in paths
    ]
    fits = [fit for taken in taken_reports for _, _, fit in taken.features if fit is not None]
    freedom = sum(fit.degrees_of_freedom for fit in fits)
    squares = sum(float((fit.residuals**2).sum()) for fit in fits)
    variance = squares / freedom if freedom else 0.0
    readings = [
        reading
        for item, path in zip(taken_reports, paths, strict=True)
        for reading in _readings(item, path, variance, settings.design)
    ]
    notes = [_told(taken) for taken in taken_reports]
    if fits:
        worst = max(reading.uncertainty or 0.0 for reading in readings)
        notes.append(
            f"{len(fits)} {'centre is' if len(fits) == 1 else 'centres are'} of points on the"
            " surface, which leave"
            f" {1e6 * variance**0.5:.3g} µm ({freedom} degrees of freedom):"
            f" standard uncertainty of a co-ordinate of a centre up to {1e6 * worst:.3g} µm"
        )
    left_out = sum(reading.across >= 0 for reading in readings)
    if left_out:
        notes.append(
            f"the co-ordinates across plates that are read in their plane, {left_out}, are left out"
        )
    remarks = [
        remark for taken in taken_reports for remark in (*taken.report.remarks, *taken.remarks)
    ]
    systems = {feature.system for taken in taken_reports for feature, _, _ in taken.features}
    if {"machine", "part"} <= systems:
        remarks.append(
            "warning: centres in the machine's and in a part's system; import them separately"
        )
    coordinates: Coordinate = "part" if systems == {"part"} else "ball centres"
    dimension = 3 if settings.design is None else settings.design.dimension
    return ImportedReadings(
        tuple(readings), tuple(notes), tuple(dict.fromkeys(remarks)), coordinates, dimension
    )


def _taken(report: Report, path: Path | GivenText, settings: ImportSettings) -> _Taken:
    """The features of a report that are readings."""
    taken_report, kinds = _Taken(report), settings.kinds
    taken_report.left.update(
        feature.kind for feature in report.features if feature.kind not in kinds
    )
    taken_report.left.update(report.others)
    candidates = [feature for feature in report.features if feature.kind in kinds]
    candidates = _with_points(candidates, report, taken_report)
    for why in dict.fromkeys(candidate.lacks for candidate in candidates if candidate.lacks):
        taken_report.leave([candidate for candidate in candidates if candidate.lacks == why], why)
    complete = [
        candidate for candidate in map(taken_report.centred, candidates) if candidate is not None
    ]
    if not complete:
        left_text = ", ".join(_counted(taken_report.left)) or "nothing"
        text = (
            f"no measured centre of a sphere in this {report.title}, which holds {left_text}; give"
            " a"
            " report of measured spheres"
        )
        raise refused(report.file, text)
    features = [feature for feature, _ in complete]
    names, whose = _named(features, settings.rule, settings.design, report.file)
    is_of_file = "{position}" not in names.rule
    position = (
        position_of_file(Path(str(path)).stem, settings.design, str(path)) if is_of_file else ""
    )
    unnamed = [
        feature for feature, parts in zip(features, names.parts, strict=True) if parts is None
    ]
    taken_report.leave(unnamed, f"the name is not of {names.rule}")
    keys_seen = set()
    for (feature, fit), parts in zip(complete, names.parts, strict=True):
        if parts is None:
            continue
        if (feature.name, feature.centre) in keys_seen:
            taken_report.left[f"{feature.kind} (printed again)"] += 1
            continue
        keys_seen.add((feature.name, feature.centre))
        taken_report.features.append((feature, {"position": position, "probe": "", **parts}, fit))
    source = f'; position "{position}" by the name of the file' if is_of_file else ""
    if names.strange:
        source += "; they are not the experiment's, and fit matches them by number and location"
    for place in names.numbered:
        source += f"; {place}s by their numbers, from 1 in the experiment's order"
    taken_report.remarks.append(f"{report.file}: names{whose} are read as {names.rule}{source}")
    taken_report.remarks += _about_systems(
        report.file, [feature for feature, _, _ in taken_report.features]
    )
    return taken_report


def _about_systems(file: str, features: Sequence[Feature]) -> list[str]:
    """Return a note on co-ordinate systems other than the machine's."""
    remarks = []
    systems = Counter(feature.system for feature in features)
    for system, count in systems.items():
        names = dict.fromkeys(
            feature.of for feature in features if feature.system == system and feature.of
        )
        names_text = f" ({listing(names, 5)})" if names else ""
        if system != "machine":
            remarks.append(f"{file}: {count} centres are in {IN_WORDS[system]}{names_text}")
    return remarks


def _named(
    features: Sequence[Feature], rule: str | None, design: Design | None, file: str
) -> tuple[Named, str]:
    """Return the parts of features' names, or of the names of their dimensions, and whose names
    they are in the latter case.
    """
    try:
        return named([feature.name for feature in features], rule, design, file), ""
    except ExperimentError:
        other_dimensions = [feature.dimension for feature in features]
        if all(other_dimensions):
            with suppress(ExperimentError):
                return named(other_dimensions, rule, design, file), " of dimensions"
        raise


def _with_points(candidates: list[Feature], report: Report, taken_report: _Taken) -> list[Feature]:
    """Spheres that were not measured, with the points that have their names and a number; without
    any sphere, all points that have the same name except their number.
    """
    lacking = {candidate.name: candidate for candidate in candidates if candidate.lacks}
    points: dict[str, list[Feature]] = {}
    for feature in report.features:
        match = NUMBERED.fullmatch(feature.name[:LONGEST_NAME]) if feature.kind == POINT else None
        if (
            match is not None
            and feature.centre is not None
            and (match[1] in lacking or not candidates)
        ):
            points.setdefault(match[1], []).append(feature)
    taken_report.left[POINT] -= sum(map(len, points.values()))
    taken_report.left += Counter()
    made = [
        candidate for candidate in candidates if not (candidate.lacks and candidate.name in points)
    ]
    return [*made, *(_of_points(name, several) for name, several in points.items())]


def _of_points(name: str, points: Sequence[Feature]) -> Feature:
    places = np.array([point.centre for point in points])
    return replace(points[0], name=name, kind=SPHERE, centre=None, points=places)


def _readings(
    taken_report: _Taken, path: Path | GivenText, variance: float, design: Design | None
) -> list[ImportedReading]:
    """Return the readings of a report, with the probe from its names, its sensors or the plan."""
    readings = []
    for feature, parts, fit in taken_report.features:
        uncertainty = None
        if fit is not None:
            uncertainty = float(np.sqrt(variance * np.diag(fit.cofactor).max()))
        probe = parts["probe"]
        if not probe:
            probe = _probe(feature, parts["position"], design, str(path))
        assert feature.centre is not None
        name, across = parts["position"], -1
        if design is not None and design.positions.across is not None:
            positions = design.positions.names
            across = design.positions.across[positions.index(name)] if name in positions else -1
        readings.append(
            ImportedReading(
                feature.mark, name, parts["ball"], probe, feature.centre, uncertainty, int(across)
            )
        )
    return readings


def _probe(feature: Feature, position: str, design: Design | None, file: str) -> str:
    """Return the probe of a feature whose name contains none.

    :raises ExperimentError: several are possible.
    """
    if design is None:
        return feature.probe
    names, positions = design.probes.names, design.positions.names
    same = [name for name in names if fold(name) == fold(feature.probe)]
    if len(same) == 1:
        return same[0]
    if position not in positions:
        # Which probe was planned there is known when the position is.
        return ""
    place = positions.index(position)
    planned = {names[i] for i in design.readings.probe[design.readings.position == place]}
    possible = planned or set(names)
    if len(possible) == 1:
        return possible.pop()
    sensor = f'the sensor "{shorten(feature.probe, 30)}" does not state' if feature.probe else ""
    text = (
        f"{sensor or 'no sensor states'} which probe read"
        f' "{shorten(feature.name, 30)}": {listing(sorted(possible))}; name features or sensors'
        " by the experiment's probes, or state the rule with --name"
    )
    raise feature.mark.refused(text)


def _counted(counts: Counter[str]) -> list[str]:
    """Kinds with how many there are of each, the most first; why they are left is in brackets."""
    words = []
    for kind, count in counts.most_common():
        noun, bracket, why = kind.partition(" (")
        words.append(f"{number_of(count, noun)}{bracket}{why}")
    return words


def _told(taken: _Taken) -> str:
    """Return a line on features used and skipped, counted by type."""
    kinds_taken = Counter(
        "centre" if feature.kind == UNSTATED else f"{feature.kind} centre"
        for feature, _, _ in taken.features
    )
    counts = ", ".join(number_of(count, kind) for kind, count in kinds_taken.items())
    left_text = ", ".join(_counted(taken.left)) or "nothing"
    head = f"{taken.report.file}: {taken.report.title}"
    return f"{head}; taken: {counts or 'nothing'}; left: {left_text}"
