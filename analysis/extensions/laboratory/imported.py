"""Readings from reports of measuring programs: features used and skipped."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from typing import TextIO

import numpy as np
from ballplate.presentation import Data, Result, picked
from ballplate.simulator.design import Design
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

from .closest_sphere import FEWEST_POINTS, SphereFit, closest_sphere
from .feature_names import (
    LONGEST_NAME,
    Named,
    fold,
    known_texts,
    named,
    position_of_file,
    without_run,
)
from .formats.registered import read_report
from .formats.report import CIRCLE, POINT, SPHERE, UNSTATED, Feature, Report
from .formats.runs import runs_of

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


@dataclass(frozen=True, eq=False, repr=False)
class ReadReport(Result):
    """Readings of reports, and notes on how they were read; `to_frame` is a table that `fit`
    accepts.

    `told` lists features used and skipped in each report, `remarks` are further notes, and
    `coordinates` is the entry `readings: {coordinates: …}` of the experiment.
    """

    label: str
    readings: tuple[ImportedReading, ...]
    told: tuple[str, ...]
    remarks: tuple[str, ...]
    coordinates: Coordinate
    dimension: int = 3
    title: str = "readings of reports of measuring programs"

    def table(self, uncertainties: bool = False) -> dict[str, list[str] | list[float]]:
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
        columns = self.table(uncertainties)
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

    def headline(self) -> str:
        return f"{len(self.readings)} readings, {self.coordinates}"

    def lines(self) -> list[str]:
        return [*self.told, self.key]

    @property
    def notes(self) -> tuple[str, ...]:
        return self.remarks

    def rows(self) -> list[Data]:
        columns = self.table()
        return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]

    def data(self) -> Data:
        return {
            "experiment": self.label,
            **picked(self, "coordinates", "told", "remarks"),
            "readings": [
                {
                    **picked(reading, "position", "ball"),
                    "probe": reading.probe or None,
                    "centre": reading.centre[: self.dimension],
                    "uncertainty": reading.uncertainty,
                }
                for reading in self.readings
            ],
        }


@dataclass(frozen=True)
class ImportSettings:
    """Options for reports: the experiment that names features, the rule of the names, the format,
    metres per unit for files without a unit, a flag for centres of circles, the encoding, and the
    probes of the experiment by their names in the measuring program.
    """

    design: Design | None = None
    rule: str | None = None
    form: str | None = None
    unit: Fraction | None = None
    circles: bool = False
    encoding: str | None = None
    probes: Mapping[str, str] = field(default_factory=dict)

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


def report_readings(paths: Sequence[Path | GivenText], settings: ImportSettings) -> ReadReport:
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
        for reading in _readings(item, path, variance, settings)
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
    remarks += _repeated(readings)
    coordinates: Coordinate = "part" if systems == {"part"} else "ball centres"
    dimension = 3 if settings.design is None else settings.design.dimension
    return ReadReport(
        Path(str(paths[0])).stem,
        tuple(readings),
        tuple(notes),
        tuple(dict.fromkeys(remarks)),
        coordinates,
        dimension,
    )


def _repeated(readings: Sequence[ImportedReading]) -> list[str]:
    """Return a note on readings of which there are several of the same names, if any."""
    counts = Counter((reading.position, reading.ball, reading.probe) for reading in readings)
    several = [key for key, count in counts.items() if count > 1]
    if not several:
        return []
    (position, ball, _), count = several[0], counts[several[0]]
    return [
        f'warning: ball "{ball}" is read {count} times in position "{position}", as are'
        f" {len(several) - 1} others ({count} runs, or names that are one by the rule): repeats, if"
        " nothing moved in between; otherwise {run} in the rule, or a file for each, parts them"
    ]


# In one piece: names, runs and the file's name together say which position a feature is of.
def _taken(report: Report, path: Path | GivenText, settings: ImportSettings) -> _Taken:
    """The features of a report that are readings."""
    runs, told_by = runs_of(
        [(feature.name, feature.kind, feature.probe) for feature in report.features],
        [feature.marks for feature in report.features],
    )
    in_runs = zip(report.features, runs, strict=True)
    report = replace(report, features=tuple(replace(each, run=run) for each, run in in_runs))
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
    rule, stem, position = settings.rule or "", Path(str(path)).stem, ""
    # Of a report that tells runs apart itself, names do not have them.
    apart = "{run}" in rule
    names, whose = _named(features, without_run(rule) if told_by else rule, settings, report.file)
    is_of_file = "{position}" not in names.rule and not apart
    if is_of_file:
        try:
            position = position_of_file(stem, settings.design, str(path))
        except ExperimentError:
            design = settings.design
            apart = bool(told_by) and design is not None and design.positions.across is None
            if not apart:
                raise
    apart |= settings.design is None
    unnamed = [
        feature for feature, parts in zip(features, names.parts, strict=True) if parts is None
    ]
    taken_report.leave(unnamed, f"the name is not, or in several ways, of {names.rule}")
    keys_seen = set()
    for (feature, fit), parts in zip(complete, names.parts, strict=True):
        if parts is None:
            continue
        key = feature.run, feature.name, feature.centre
        if key in keys_seen:
            taken_report.left[f"{feature.kind} (printed again)"] += 1
            continue
        keys_seen.add(key)
        own = {"position": position, "probe": "", **parts}
        if apart and (run := own.get("run", feature.run)):
            own["position"] = _in_run(parts.get("position", ""), run, stem, settings.design)
        taken_report.features.append((feature, own, fit))
    source = f'; position "{position}" by the name of the file' if position else ""
    if names.strange:
        source += "; they are not the experiment's, and fit matches them by number and location"
    for place in names.numbered:
        source += f"; {place}s by their numbers, from 1 in the experiment's order"
    taken_report.remarks.append(f"{report.file}: names{whose} are read as {names.rule}{source}")
    if told_by:
        labels = list(dict.fromkeys(runs))
        how = "each is a position of its own" if apart else "in the same positions"
        taken_report.remarks.append(
            f"{report.file}: {len(labels)} runs by {told_by} ({listing(labels, 5)}), {how}"
        )
    taken_report.remarks += _about_systems(
        report.file, [feature for feature, _, _ in taken_report.features]
    )
    return taken_report


def _in_run(position: str, run: str, stem: str, design: Design | None) -> str:
    """Return the name of a position in a run: that of the experiment, if it has it."""
    known = () if design is None else design.positions.names
    of_run = fold(f"{position} {run}")
    return next((name for name in known if fold(name) == of_run), f"{position or stem} {run}")


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
    features: Sequence[Feature], rule: str, settings: ImportSettings, file: str
) -> tuple[Named, str]:
    """Return the parts of features' names, or of the names of their dimensions, and whose names
    they are in the latter case.
    """
    how = rule or None, settings.design, file, settings.probes
    try:
        return named([feature.name for feature in features], *how), ""
    except ExperimentError:
        other_dimensions = [feature.dimension for feature in features]
        if all(other_dimensions):
            with suppress(ExperimentError):
                return named(other_dimensions, *how), " of dimensions"
        raise


def _with_points(candidates: list[Feature], report: Report, taken_report: _Taken) -> list[Feature]:
    """Spheres that were not measured, with the points that have their names and a number; without
    any sphere, all points that have the same name except their number.
    """
    lacking = {(candidate.run, candidate.name) for candidate in candidates if candidate.lacks}
    points: dict[tuple[str, str], list[Feature]] = {}
    for feature in report.features:
        match = NUMBERED.fullmatch(feature.name[:LONGEST_NAME]) if feature.kind == POINT else None
        if (
            match is not None
            and feature.centre is not None
            and ((feature.run, match[1]) in lacking or not candidates)
        ):
            points.setdefault((feature.run, match[1]), []).append(feature)
    taken_report.left[POINT] -= sum(map(len, points.values()))
    taken_report.left += Counter()
    made = [
        candidate
        for candidate in candidates
        if not (candidate.lacks and (candidate.run, candidate.name) in points)
    ]
    return [*made, *(_of_points(name, several) for (_, name), several in points.items())]


def _of_points(name: str, points: Sequence[Feature]) -> Feature:
    places = np.array([point.centre for point in points])
    return replace(points[0], name=name, kind=SPHERE, centre=None, points=places)


def _readings(
    taken_report: _Taken, path: Path | GivenText, variance: float, settings: ImportSettings
) -> list[ImportedReading]:
    """Return the readings of a report, with the probe from its names, its sensors or the plan."""
    readings, design = [], settings.design
    for feature, parts, fit in taken_report.features:
        uncertainty = None
        if fit is not None:
            uncertainty = float(np.sqrt(variance * np.diag(fit.cofactor).max()))
        probe = parts["probe"]
        if not probe:
            probe = _probe(feature, parts["position"], settings, str(path))
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


def _probe(feature: Feature, position: str, settings: ImportSettings, file: str) -> str:
    """Return the probe of a feature whose name contains none.

    :raises ExperimentError: several are possible.
    """
    design = settings.design
    if design is None:
        return feature.probe
    names, positions = design.probes.names, design.positions.names
    if same := known_texts("probe", design, settings.probes).get(fold(feature.probe)):
        return same
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
