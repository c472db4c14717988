"""`ballplate correct`: points corrected by the map of a fit."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from ballplate.cli import (
    UsageError,
    add_force,
    add_json,
    add_output,
    coverage_factor,
    show,
    text_writer,
    warn,
    write,
)

from .fitted_argument import FITTED, fitted_map

if TYPE_CHECKING:
    from ballplate.presentation import Writer
    from ballplate.simulator.design import Tasks

    from ..machine_files import FittedMap
    from .point_files import GivenPoints

DESCRIPTION = (
    "Correct the scale readings of a CSV file by a map that fit -o has written: corrected"
    " co-ordinates, the correction that was added, and expanded uncertainties; lengths between"
    " named points, and measuring tasks. The exit status is 0 if all results are determined,"
    " otherwise 1."
)
READ, CENTRES = "scale readings", "ball centres"


def add_options(parser: ArgumentParser) -> None:
    parser.add_argument("map", metavar="MAP", type=Path, help=FITTED)
    parser.add_argument(
        "points",
        metavar="POINTS",
        type=Path,
        help=(
            "points: a CSV file with the columns x_mm, y_mm, z_mm (or another unit) and"
            " optionally name, or position and ball, and probe"
        ),
    )
    parser.add_argument(
        "--probe", metavar="NAME", help="probe of points without one; default: that of the map"
    )
    parser.add_argument(
        "--coordinates",
        choices=(READ, CENTRES),
        default=READ,
        help=(
            "what the points are: positions of the scales, to which the offset of the probe is"
            " added, or centres of balls, to which the stated offset has been; default: scale"
            " readings"
        ),
    )
    _add_lengths(parser)
    parser.add_argument(
        "--coverage-factor",
        metavar="K",
        type=coverage_factor,
        help="coverage factor of the expanded uncertainty; default: that of the map",
    )
    parser.add_argument(
        "--with-repeatability",
        action="store_true",
        help="include the repeatability of the corrected readings",
    )
    add_output(parser, "-o", "--output", metavar="CSV", help="write one row per point")
    add_output(
        parser,
        "--covariance",
        metavar="CSV",
        help="write the covariance of all co-ordinates together",
    )
    add_force(parser)
    add_json(parser)


def _add_lengths(parser: ArgumentParser) -> None:
    parser.add_argument(
        "--length",
        metavar=("FIRST", "SECOND"),
        nargs=2,
        action="append",
        default=[],
        help="also correct the length between two points by their names; may be repeated",
    )
    parser.add_argument(
        "--tasks",
        metavar="FILE",
        type=Path,
        help="also correct the measuring tasks of an experiment file",
    )


def run(options: Namespace) -> int:
    """Print points and lengths and write the files; return 1 if a result is undetermined."""
    from ballplate.simulator.inputs import hint

    from .correction import MOST_CO_ORDINATES, correction
    from .point_files import read_points

    fitted = fitted_map(options.map)
    names, probe = fitted.probes.names, options.probe or fitted.probe
    if probe not in names:
        raise UsageError(f'--probe: no probe "{probe}" in the map; {hint(probe, names)}')
    offsets = fitted.drawn_offsets if options.coordinates == CENTRES else None
    scales = read_points(options.points, names, probe, fitted.volume, offsets)
    if options.covariance and scales.points.size > MOST_CO_ORDINATES:
        text = f"--covariance of {scales.points.size} co-ordinates is too large; at most"
        raise UsageError(f"{text} {MOST_CO_ORDINATES} are possible: correct fewer points at once")
    try:
        corrected = correction(
            fitted,
            scales,
            _wanted(options, fitted, scales),
            options.coverage_factor,
            options.with_repeatability,
        )
    except ValueError as error:
        raise UsageError(error) from None
    contents: dict[Path | None, Writer] = {options.output: text_writer(corrected.write_points)}
    contents[options.covariance] = text_writer(corrected.write_covariance)
    write(options, contents)
    show(options, corrected)
    warn(corrected.warnings)
    return 1 if corrected.is_open else 0


def _wanted(options: Namespace, fitted: FittedMap, scale_points: GivenPoints) -> Tasks:
    from ballplate.simulator.experiment import load

    from .selected_lengths import between_named, tasks_of_experiment

    tasks = between_named(scale_points, [(first, second) for first, second in options.length])
    if options.tasks:
        for experiment in load(options.tasks):
            tasks = tasks.beside(tasks_of_experiment(fitted, experiment))
    return tasks
