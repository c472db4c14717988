"""`ballplate run --lengths`: lengths throughout the volume against a target."""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError, Namespace

from ballplate.cli import (
    UsageError,
    add_file,
    add_force,
    add_json,
    add_output,
    coverage_factor,
    grid,
    show,
    single,
    write,
)

DESCRIPTION = (
    "Compute the standard uncertainty u of the length between every two points of a"
    " grid over the volume, measured on the corrected machine, and compare it and the"
    " expanded uncertainty k u with the target by length, direction and location. The"
    " target applies to u, or to U = k u where the file states a coverage_factor. The"
    " repeatability of the readings that will measure a length is not part of u unless"
    " requested. The exit status is 0 if the rank is as expected and, with --fail, all"
    " lengths are within the target, otherwise 1."
)


def add_options(parser: ArgumentParser) -> None:
    add_file(parser)
    parser.add_argument(
        "--target",
        metavar="LENGTH",
        help='target instead of target_uncertainty, such as "0.5 um + L/1000000"',
    )
    parser.add_argument(
        "--grid",
        metavar="N",
        type=_grid,
        default=(6,),
        help="points along each axis, or a number for each such as 6,5,4; default 6",
    )
    parser.add_argument(
        "--probe",
        metavar="NAME",
        help="probe that measures the lengths; default: evaluation.probe",
    )
    parser.add_argument(
        "--coverage-factor",
        metavar="K",
        type=coverage_factor,
        help="coverage factor of the expanded uncertainty; default: that of the file, or 2",
    )
    parser.add_argument(
        "--fail",
        action="store_true",
        help="end with exit status 1 unless all lengths are within the target",
    )
    parser.add_argument(
        "--with-repeatability",
        action="store_true",
        help="include the repeatability of both readings of a length",
    )
    add_output(
        parser,
        "-o",
        "--output",
        metavar="FILE",
        help="write a row per length, direction and point",
    )
    add_force(parser)
    add_json(parser)


def _grid(text: str) -> tuple[int, ...]:
    counts = grid(text)
    if counts is None or len(counts) > 3:
        raise ArgumentTypeError(
            f'expected a whole number, 2 or above, or one for each axis such as 6,5,4, not "{text}"'
        )
    return counts


def run(options: Namespace) -> int:
    """Print the tables, write and draw the files; return 1 if the rank is unexpected."""
    from ballplate.cli import progress

    from .length_map import length_map, length_settings

    experiment = single(options)
    try:
        settings = length_settings(
            experiment,
            options.target,
            options.grid,
            options.probe,
            options.coverage_factor,
            options.with_repeatability,
        )
    except ValueError as error:
        raise UsageError(error) from None
    with progress(options) as shown:
        lengths = length_map(experiment, settings, shown.show)
    write(options, {options.output: lengths.to_csv})
    show(options, lengths)
    is_missed = options.fail and not lengths.is_met
    return 0 if lengths.as_expected and not is_missed else 1
