"""`ballplate diff`: the difference of two maps of a machine."""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError, Namespace
from pathlib import Path

from ballplate.cli import (
    UsageError,
    add_force,
    add_json,
    add_output,
    complain,
    coverage_factor,
    day,
    show,
    whole,
    write,
)

DESCRIPTION = (
    "Compare two campaigns, or a campaign with an expected map: lengths, errors at points of the"
    " volume after the free motion between the frames is taken out, error functions, and balls if"
    " both are experiments with readings. A normalised error E_n is a difference over its expanded"
    " uncertainty. The exit status is 0; with --fail it is 1 if the joint test of the map shows a"
    " change."
)

# Points along each axis: all pairs of points are lengths.
LEAST, MOST = 2, 5


# In one piece: one option after the other, with its help.
def add_options(parser: ArgumentParser) -> None:
    parser.add_argument(
        "files",
        metavar="MAP",
        nargs=2,
        type=Path,
        help=(
            "map file that fit -o wrote, machine file (an expected map), or experiment file whose"
            " section readings names its files; the second is compared with the first"
        ),
    )
    parser.add_argument(
        "--readings",
        metavar=("FIRST", "SECOND"),
        nargs=2,
        type=Path,
        help="tables of readings of two experiment files, instead of the named ones",
    )
    parser.add_argument(
        "--grid",
        metavar="N",
        type=_grid,
        default=4,
        help=f"points along each axis, {LEAST} to {MOST}; default 4",
    )
    parser.add_argument(
        "--probe", metavar="NAME", help="probe that is compared with; default: that of the maps"
    )
    parser.add_argument(
        "--coverage-factor",
        metavar="K",
        type=coverage_factor,
        default=2.0,
        help="coverage factor of expanded uncertainties; default 2",
    )
    parser.add_argument(
        "--shared",
        choices=("certificate",),
        help=(
            "both campaigns rest on the same certificate, whose errors cancel; for experiment files"
            " with readings"
        ),
    )
    parser.add_argument(
        "--stated",
        metavar="LENGTH",
        help=(
            "expanded uncertainty of lengths by a machine file, such as"
            ' "0.5 um + L/1000000"; default: as exactly known as the file says'
        ),
    )
    parser.add_argument(
        "--dates",
        metavar="DAY",
        nargs=2,
        type=day,
        default=(None, None),
        help="days of the two campaigns, such as 2025-11-22 2026-11-22; default: those of the maps",
    )
    parser.add_argument(
        "--fail", action="store_true", help="end with exit status 1 if a change is shown"
    )
    add_output(parser, "-o", "--output", metavar="FILE", help="write one row per value")
    add_force(parser)
    add_json(parser)


def _grid(text: str) -> int:
    points = whole(text, LEAST)
    if points > MOST:
        raise ArgumentTypeError(f"a grid has {LEAST} to {MOST} points along an axis, not {points}")
    return points


def run(options: Namespace) -> int:
    """Compare, write and print; 1 with --fail if a change is shown."""
    from ballplate.simulator.inputs import QuantityError, Target, parse_length_function

    from .compared_maps import NotComparableError
    from .fit_files import fit_of_file
    from .sources import map_difference

    k = options.coverage_factor
    try:
        standard = None
        if options.stated is not None:
            standard = Target(parse_length_function(options.stated), k).standard
        first, second = (
            options.files
            if options.readings is None
            else map(fit_of_file, options.files, options.readings)
        )
        difference = map_difference(
            (first, second),
            coverage_factor=k,
            grid=options.grid,
            probe=options.probe,
            shared=options.shared is not None,
            stated=standard,
            dates=(options.dates[0], options.dates[1]),
        )
    except (NotComparableError, QuantityError) as error:
        raise UsageError(error) from None
    write(options, {options.output: difference.to_csv})
    show(options, difference)
    for note in difference.notes:
        complain(note)
    return 1 if options.fail and difference.is_changed is not False else 0
