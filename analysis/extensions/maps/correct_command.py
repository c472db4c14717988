"""`ballplate correct`: points corrected by the map of a fit."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from ballplate.cli import (
    FITTED,
    UsageError,
    Writer,
    add_force,
    add_json,
    add_output,
    coverage_factor,
    fitted_map,
    show,
    text_writer,
    warn,
    write,
)

if TYPE_CHECKING:
    from ballplate.simulator.design import Tasks
    from ballplate.simulator.maps import FittedMap
    from ballplate.simulator.readings import GivenPoints

GROUP = "use"
HELP = "correct points by the map of a fit, with their uncertainty"
DESCRIPTION = (
    "Correct the scale readings of a CSV file by a map that fit -o has written: corrected"
    " co-ordinates, the correction that was added, and expanded uncertainties; lengths between"
    " named points, and measuring tasks. The exit status is 0 if everything asked for is"
    " determined, otherwise 1."
)
READ, CENTRES = "scale readings", "ball centres"


def add_options(parser: ArgumentParser) -> None:
    parser.add_argument("map", metavar="MAP", type=Path, help=FITTED)
    parser.add_argument(
        "points",
        metavar="POINTS",
        type=Path,
        help=(
            "points: a CSV file with the columns x_mm, y_mm, z_mm (or another unit) and if need be"
            " name, or position and ball, and probe"
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
        help="include the scatter of the readings that are corrected",
    )
    add_output(parser, "-o", "--output", metavar="CSV", help="write a line for each point")
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
        "--lengths",
        metavar="CSV",
        type=Path,
        help="also correct lengths between points named in the columns first and second",
    )
    parser.add_argument(
        "--tasks",
        metavar="FILE",
        type=Path,
        help="also correct the measuring tasks of an experiment file",
    )


def run(options: Namespace) -> int:
    """Print points and lengths, and write what was asked for; 1 if something is undetermined."""
    from ballplate.simulator.inputs import hint
    from ballplate.simulator.readings import read_points

    from .correction import MOST_CO_ORDINATES, correction

    fitted = fitted_map(options.map)
    names, probe = fitted.probes.names, options.probe or fitted.probe
    if probe not in names:
        raise UsageError(f'--probe: no probe "{probe}" in the map; {hint(probe, names)}')
    offsets = fitted.drawn_offsets if options.coordinates == CENTRES else None
    given = read_points(options.points, names, probe, fitted.volume, offsets)
    if options.covariance and given.points.size > MOST_CO_ORDINATES:
        text = f"--covariance of {given.points.size} co-ordinates is too large; at most"
        raise UsageError(f"{text} {MOST_CO_ORDINATES} are possible: correct fewer points at once")
    try:
        found = correction(
            fitted,
            given,
            _wanted(options, fitted, given),
            options.coverage_factor,
            options.with_repeatability,
        )
    except ValueError as error:
        raise UsageError(error) from None
    contents: dict[Path | None, Writer] = {options.output: text_writer(found.write_points)}
    contents[options.covariance] = text_writer(found.write_covariance)
    write(options, contents)
    show(options, found)
    warn(found.warnings)
    return 1 if found.is_open else 0


def _wanted(options: Namespace, fitted: FittedMap, given: GivenPoints) -> Tasks:
    """The lengths that the options ask for."""
    from ballplate.simulator.experiment import load

    from .wanted_lengths import between_listed, between_named, tasks_of_experiment

    found = between_named(given, [(first, second) for first, second in options.length])
    if options.lengths:
        found = found.beside(between_listed(given, options.lengths))
    if options.tasks:
        for experiment in load(options.tasks):
            found = found.beside(tasks_of_experiment(fitted, experiment))
    return found
