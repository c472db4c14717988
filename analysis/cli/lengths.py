"""`ballplate lengths`: lengths throughout the volume against a target."""

from __future__ import annotations

import math
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from . import common
from .common import add_file, add_json, add_picture, number, print_json, print_lines, single
from .outputs import UsageError, Writer, add_force, add_output, text_writer, write

if TYPE_CHECKING:
    from ballplate.simulator.experiment.model import Experiment

    from ..error_maps.length_map import LengthMapSettings


# Lines of a table of all lengths.
MOST_PAIRS = 500_000


HELP = "map the uncertainty of lengths over the volume against a target"
DESCRIPTION = (
    "Compute the standard uncertainty u of the length between every two points of a"
    " grid over the volume, measured on the corrected machine, and compare it and the"
    " expanded uncertainty k u with the target by length, direction and place. The"
    " target applies to u, or to U = k u where the file states a coverage_factor. The"
    " scatter of the readings that will measure a length is not part of u unless"
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
        type=_factor,
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
        help="include the scatter of the two readings that measure a length",
    )
    add_output(parser, "--csv", metavar="FILE", help="write a line for each point of the grid")
    add_output(parser, "--pairs", metavar="FILE", help="write a line for each length")
    add_picture(parser, "--plot", help="draw slices through the volume, and u against the length")
    add_force(parser)
    add_json(parser)


def _grid(text: str) -> tuple[int, ...]:
    counts = common.grid(text)
    if counts is None or len(counts) > 3:
        raise ArgumentTypeError(
            f'expected a whole number, 2 or above, or one for each axis such as 6,5,4, not "{text}"'
        )
    return counts


def _factor(text: str) -> float:
    value = number(text)
    if not 0.0 < value <= 100.0:
        raise ArgumentTypeError(f'expected a number above 0, such as 2, not "{text}"')
    return value


def run(options: Namespace) -> int:
    """Print the tables, and write and draw what was asked for; 1 if the rank is not as expected."""
    from ..error_maps.length_map import length_map
    from ..error_maps.length_tables import length_data, length_lines, pair_csv, point_csv
    from .progress import progress

    experiment = single(options)
    settings = _settings(experiment, options)
    count = math.comb(math.prod(settings.grid), 2)
    if options.pairs is not None and count > MOST_PAIRS:
        raise UsageError(
            f"{count} lengths are too many for --pairs; at most {MOST_PAIRS} are possible: make"
            " --grid coarser"
        )
    with progress(options) as shown:
        found = length_map(experiment, settings, shown.show)
    writers: dict[Path, Writer] = {}
    if options.csv is not None:
        writers[options.csv] = _of_lines(point_csv(found))
    if options.pairs is not None:
        writers[options.pairs] = _of_lines(pair_csv(experiment, settings))
    if options.plot is not None:
        from ..report.length_plots import draw_lengths

        writers[options.plot] = partial(draw_lengths, found)
    write(options, writers)
    if options.json:
        print_json([length_data(experiment.label, experiment.title, found)])
    else:
        print_lines(length_lines(f"{experiment.label}: {experiment.title}", found))
    is_missed = options.fail and not found.is_met
    is_expected = found.deficiency == (experiment.expected_rank_deficiency or 0)
    return 0 if is_expected and not is_missed else 1


def _settings(experiment: Experiment, options: Namespace) -> LengthMapSettings:
    """What was asked for.

    :raises UsageError: it cannot be had of this experiment.
    """
    from ballplate.simulator.inputs.quantities import QuantityError, parse_length_function
    from ballplate.simulator.inputs.settings import hint

    from ..error_maps.length_map import MOST_POINTS, LengthMapSettings
    from ..uncertainty.tasks import expansion

    try:
        stated = (
            None if experiment.target_uncertainty is None else experiment.target_uncertainty.stated
        )
        target = stated if options.target is None else parse_length_function(options.target)
    except QuantityError as error:
        raise UsageError(f"--target: {error}") from None
    if target is None:
        raise UsageError(
            'the file states no target_uncertainty; add it, or give --target, such as "0.5 um +'
            ' L/1000000"'
        )
    d = experiment.dimension
    grid = options.grid * d if len(options.grid) == 1 else options.grid
    if len(grid) != d:
        raise UsageError(
            f"--grid has {len(grid)} numbers, but the experiment has {d} dimensions; give one,"
            f" or {d}"
        )
    if math.prod(grid) > MOST_POINTS:
        raise UsageError(
            f"a grid of {math.prod(grid)} points is too fine; at most {MOST_POINTS} are possible"
        )
    probe = options.probe or experiment.evaluation.probe
    if probe not in experiment.probes:
        raise UsageError(f'unknown probe "{probe}"; {hint(probe, experiment.probes)}')
    factor = experiment.coverage_factor
    expanded = options.coverage_factor or expansion(factor)
    return LengthMapSettings(grid, probe, target, expanded, options.with_repeatability, factor)


def _of_lines(lines: Iterable[str]) -> Writer:
    return text_writer(lambda stream: stream.writelines(f"{line}\n" for line in lines))
