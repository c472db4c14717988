"""Readings out of reports of measuring programs: which features they are, and what is left."""

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

from .feature_names import LONGEST_NAME, Named, fold, named, position_of_file, without_point
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
    """A ball's centre (3,) in metres, with the names that its feature has; `uncertainty` is that of
    a centre from points on the surface, of its least certain axis. Its co-ordinate along the axis
    `across` is not read, -1 where all are.
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
    """Readings of reports, and everything that is to be known about how they were read.

    `told` says per file what was taken and what was left, `remarks` what of it may matter, and
    `coordinates` what `readings: {coordinates: …}` should say in the experiment.
    """

    readings: tuple[ImportedReading, ...]
    told: tuple[str, ...]
    remarks: tuple[str, ...]
    coordinates: Coordinate
    dimension: int = 3

    def columns(self, uncertainties: bool = False) -> dict[str, list[str] | list[float]]:
        """The columns of a table of readings, in millimetres, NaN where a co-ordinate is not read;
        without one of probes where no report names any.
        """
        rows = self.readings
        columns: dict[str, list[str] | list[float]] = {
            "position": [one.position for one in rows],
            "ball": [one.ball for one in rows],
        }
        if any(one.probe for one in rows):
            columns["probe"] = [one.probe for one in rows]
        for i, axis in enumerate("xyz"[: self.dimension]):
            columns[f"{axis}_mm"] = [
                math.nan if one.across == i else round(1e3 * one.centre[i], DECIMALS)
                for one in rows
            ]
        if uncertainties and all(one.uncertainty is not None for one in rows):
            columns["u_um"] = [1e6 * (one.uncertainty or 0.0) for one in rows]
        return columns

    def write(self, stream: TextIO, uncertainties: bool = False) -> None:
        """Write a table of readings, below comments that say where they are from."""
        for line in (*self.told, self.key):
            stream.write(f"# {line}\n")
        writer = CsvWriter(stream)
        columns = self.columns(uncertainties)
        writer.writerow(list(columns))
        for row in zip(*columns.values(), strict=True):
            writer.writerow(["" if cell != cell else cell for cell in row])

    @property
    def key(self) -> str:
        """What the experiment has to say about the co-ordinates."""
        return (
            "these are centres of balls; say so in the experiment, readings: {coordinates:"
            f' {self.coordinates}}}, or with fit --coordinates "{self.coordinates}"'
        )


@dataclass(frozen=True)
class ImportSettings:
    """How reports are read: the experiment whose names features have, the rule of the names, the
    name of the files' format, metres per unit of files that state none, and whether centres of
    circles are readings, too.
    """

    design: Design | None = None
    rule: str | None = None
    form: str | None = None
    unit: Fraction | None = None
    circles: bool = False

    @property
    def kinds(self) -> set[str]:
        """Kinds of features that may be readings."""
        of_points = self.rule is not None and "{point}" in self.rule
        more = [CIRCLE] * self.circles + [POINT] * of_points
        return {POINT} if of_points else {SPHERE, UNSTATED, *more}


@dataclass
class _Taken:
    """What of a report are readings, with the parts of their names, and what is left."""

    report: Report
    features: list[tuple[Feature, dict[str, str], SphereFit | None]] = field(default_factory=list)
    left: Counter[str] = field(default_factory=Counter)
    remarks: list[str] = field(default_factory=list)

    def leave(self, features: Sequence[Feature], why: str) -> None:
        """Leave features for a reason, which is told with their names."""
        if features:
            self.left.update(f"{one.kind} ({why})" for one in features)
            names = listing((f'"{shorten(one.name, 30)}"' for one in features), 5)
            self.remarks.append(f"{self.report.file}: {len(features)} left, {why}: {names}")

    def centred(self, one: Feature) -> tuple[Feature, SphereFit | None] | None:
        """A feature with its centre, and the closest sphere where that is of points; None, and
        left, where there is none.
        """
        if one.lacks or one.points is None:
            return None if one.lacks else (one, None)
        fit = closest_sphere(one.points)
        if fit is None:
            few = len(one.points) < FEWEST_POINTS
            why = f"has {len(one.points)} points, of which a sphere needs {FEWEST_POINTS}"
            self.leave([one], why if few else "has points about in a plane")
            return None
        x, y, z = fit.centre.tolist()
        return replace(one, centre=(x, y, z)), fit


def report_readings(
    paths: Sequence[Path | GivenText], settings: ImportSettings
) -> ImportedReadings:
    """Readings of reports whose features have names by a rule (see `feature_names`).

    :raises ExperimentError: a file cannot be read, is of no known format or wrong, or has no
        reading.
    """
    found = [
        _taken(read_report(path, settings.form, settings.unit), path, settings) for path in paths
    ]
    fits = [fit for one in found for _, _, fit in one.features if fit is not None]
    freedom = sum(fit.degrees_of_freedom for fit in fits)
    squares = sum(float((fit.residuals**2).sum()) for fit in fits)
    variance = squares / freedom if freedom else 0.0
    readings = [
        reading
        for one, path in zip(found, paths, strict=True)
        for reading in _readings(one, path, variance, settings.design)
    ]
    told = [_told(one) for one in found]
    if fits:
        worst = max(one.uncertainty or 0.0 for one in readings)
        told.append(
            f"{len(fits)} {'centre is' if len(fits) == 1 else 'centres are'} of points on the"
            " surface, which leave"
            f" {1e6 * variance**0.5:.3g} µm ({freedom} degrees of freedom):"
            f" standard uncertainty of a co-ordinate of a centre up to {1e6 * worst:.3g} µm"
        )
    left_out = sum(one.across >= 0 for one in readings)
    if left_out:
        told.append(
            f"the co-ordinates across plates that are read in their plane, {left_out}, are left out"
        )
    remarks = [remark for one in found for remark in (*one.report.remarks, *one.remarks)]
    systems = {feature.system for one in found for feature, _, _ in one.features}
    if {"machine", "part"} <= systems:
        remarks.append(
            "warning: centres in the machine's and in a part's system; import each apart"
        )
    coordinates: Coordinate = "part" if systems == {"part"} else "ball centres"
    dimension = 3 if settings.design is None else settings.design.dimension
    return ImportedReadings(
        tuple(readings), tuple(told), tuple(dict.fromkeys(remarks)), coordinates, dimension
    )


def _taken(report: Report, path: Path | GivenText, settings: ImportSettings) -> _Taken:
    """The features of a report that are readings."""
    found, kinds = _Taken(report), settings.kinds
    found.left.update(one.kind for one in report.features if one.kind not in kinds)
    found.left.update(report.others)
    rule, apart = without_point(settings.rule or "")
    candidates = [one for one in report.features if one.kind in kinds]
    if apart is not None:
        candidates = _grouped(candidates, apart, found)
    else:
        candidates = _with_points(candidates, report, found)
    for why in dict.fromkeys(one.lacks for one in candidates if one.lacks):
        found.leave([one for one in candidates if one.lacks == why], why)
    complete = [one for one in map(found.centred, candidates) if one is not None]
    if not complete:
        told = ", ".join(_counted(found.left)) or "nothing"
        text = (
            f"no measured centre of a sphere in this {report.title}, which holds {told}; give a"
            " report of measured spheres"
        )
        raise refused(report.file, text)
    features = [one for one, _ in complete]
    names, whose = _named(features, rule or None, settings.design, report.file)
    is_of_file = "{position}" not in names.rule
    position = (
        position_of_file(Path(str(path)).stem, settings.design, str(path)) if is_of_file else ""
    )
    others = [one for one, own in zip(features, names.parts, strict=True) if own is None]
    found.leave(others, f"the name is not of {names.rule}")
    known: set[tuple[object, ...]] = set()
    for (one, fit), own in zip(complete, names.parts, strict=True):
        if own is None:
            continue
        if (one.name, one.centre) in known:
            found.left[f"{one.kind} (printed again)"] += 1
            continue
        known.add((one.name, one.centre))
        found.features.append((one, {"position": position, "probe": "", **own}, fit))
    source = f'; position "{position}" by the name of the file' if is_of_file else ""
    if names.strange:
        source += "; they are not the experiment's, and fit matches them by number and place"
    for place in names.numbered:
        source += f"; {place}s by their numbers, from 1 in the experiment's order"
    found.remarks.append(f"{report.file}: names{whose} are read as {names.rule}{source}")
    found.remarks += _about_systems(report.file, [one for one, _, _ in found.features])
    return found


def _about_systems(file: str, features: Sequence[Feature]) -> list[str]:
    """What co-ordinates are in, where that is not the machine's system throughout."""
    remarks = []
    systems = Counter(one.system for one in features)
    for system, count in systems.items():
        names = dict.fromkeys(one.of for one in features if one.system == system and one.of)
        of = f" ({listing(names, 5)})" if names else ""
        if system != "machine":
            remarks.append(f"{file}: {count} centres are in {IN_WORDS[system]}{of}")
    return remarks


def _named(
    features: Sequence[Feature], rule: str | None, design: Design | None, file: str
) -> tuple[Named, str]:
    """The parts of features' names, or of those of the dimensions that tell them, and whose names
    it is in the latter case.
    """
    try:
        return named([one.name for one in features], rule, design, file), ""
    except ExperimentError:
        others = [one.dimension for one in features]
        if all(others):
            with suppress(ExperimentError):
                return named(others, rule, design, file), " of dimensions"
        raise


def _with_points(candidates: list[Feature], report: Report, found: _Taken) -> list[Feature]:
    """Spheres that were not measured, with the points that have their names and a number; without
    any sphere, all points that have the same name except their number.
    """
    lacking = {one.name: one for one in candidates if one.lacks}
    points: dict[str, list[Feature]] = {}
    for one in report.features:
        match = NUMBERED.fullmatch(one.name[:LONGEST_NAME]) if one.kind == POINT else None
        if match is not None and one.centre is not None and (match[1] in lacking or not candidates):
            points.setdefault(match[1], []).append(one)
    found.left[POINT] -= sum(map(len, points.values()))
    found.left += Counter()
    made = [one for one in candidates if not (one.lacks and one.name in points)]
    return [*made, *(_of_points(name, several) for name, several in points.items())]


def _of_points(name: str, points: Sequence[Feature]) -> Feature:
    places = np.array([one.centre for one in points])
    return replace(points[0], name=name, kind=SPHERE, centre=None, points=places)


def _grouped(candidates: list[Feature], apart: re.Pattern[str], found: _Taken) -> list[Feature]:
    """Spheres of points that have the same name except the number of the point."""
    groups: dict[str, list[Feature]] = {}
    others = []
    for one in candidates:
        match = apart.fullmatch(one.name[:LONGEST_NAME])
        if match is None or one.centre is None:
            others.append(one)
        else:
            groups.setdefault(match[1], []).append(one)
    found.leave(others, "the name has no number of a point")
    return [_of_points(name, points) for name, points in groups.items()]


def _readings(
    one: _Taken, path: Path | GivenText, variance: float, design: Design | None
) -> list[ImportedReading]:
    """The readings of a report, with the probe that its names, its sensors or the plan tell."""
    readings = []
    for feature, parts, fit in one.features:
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
    """The probe of a feature whose name tells none.

    :raises ExperimentError: it may be one of several.
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
    told = f'the sensor "{shorten(feature.probe, 30)}"' if feature.probe else "no sensor"
    text = (
        f"{told} tells which probe read"
        f' "{shorten(feature.name, 30)}": {listing(sorted(possible))}; name features or sensors'
        " by the experiment's probes, or state the rule with --name"
    )
    if feature.probe:
        text = text.replace("tells which", "does not tell which", 1)
    raise feature.mark.refused(text)


def _counted(counts: Counter[str]) -> list[str]:
    """Kinds with how many there are of each, the most first; why they are left is in brackets."""
    words = []
    for kind, count in counts.most_common():
        noun, bracket, why = kind.partition(" (")
        words.append(f"{number_of(count, noun)}{bracket}{why}")
    return words


def _told(one: _Taken) -> str:
    """What was taken of a file and what was left, counted by kind."""
    taken = Counter(
        "centre" if feature.kind == UNSTATED else f"{feature.kind} centre"
        for feature, _, _ in one.features
    )
    counts = ", ".join(number_of(count, kind) for kind, count in taken.items())
    left = ", ".join(_counted(one.left)) or "nothing"
    return f"{one.report.file}: {one.report.title}; taken: {counts or 'nothing'}; left: {left}"
