"""`ballplate adjust`: a machine after adjustments, as predicted and as inspected again."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from ballplate.cli import (
    UsageError,
    add_force,
    add_json,
    add_output,
    map_path,
    percentage,
    show,
    warn,
    write_noted,
)

from .fitted_argument import FITTED, fitted_map

DESCRIPTION = (
    "Apply stated changes of scales and turns of guideways to a fitted machine. Predict the"
    " remaining scale errors, angles between the axes and errors along the diagonals of the volume,"
    " with U, and compare them with a second campaign, as diff does. The exit status is 1 if the"
    " comparison shows a change or is impossible, otherwise 0."
)


def add_options(parser: ArgumentParser) -> None:
    parser.add_argument("map", metavar="MAP", type=Path, help=FITTED)
    parser.add_argument(
        "--scale",
        metavar="AXIS=RATIO",
        action="append",
        default=[],
        help='a changed scale: x="22 um/m" for X that reads that much more; may be repeated',
    )
    parser.add_argument(
        "--turn",
        metavar="GUIDEWAY=ANGLE",
        action="append",
        default=[],
        help=(
            'a guideway that was turned: y-x="12 arcsec" for that of Y towards -X, or by its screw,'
            ' y-x="0.25 turns of 1 mm at 400 mm"; may be repeated'
        ),
    )
    parser.add_argument(
        "--uncertainty",
        metavar="SHARE",
        type=percentage,
        default=0.0,
        help="standard uncertainty of each change, such as 2%% of it; default: made as stated",
    )
    parser.add_argument(
        "--after",
        metavar="MAP",
        type=Path,
        help="second campaign: its map file, or experiment file that names its readings",
    )
    add_output(
        parser,
        "-o",
        "--output",
        metavar="FILE",
        type=map_path,
        help="write the predicted machine as a map file (.yaml)",
    )
    add_force(parser)
    add_json(parser)


def run(options: Namespace) -> int:
    """Print the prediction and the comparison; 1 if the latter shows a change."""
    from ballplate.simulator.experiment import write_map

    from .adjusted_machine import adjusted_machine
    from .machine_changes import guideway_turn, scale_change

    if not options.scale and not options.turn:
        raise UsageError("state the changes, with --scale or --turn")
    try:
        changes = [scale_change(text) for text in options.scale]
        changes += [guideway_turn(text) for text in options.turn]
    except ValueError as error:
        raise UsageError(error) from None
    first = fitted_map(options.map)
    second = None if options.after is None else fitted_map(options.after)
    try:
        adjusted = adjusted_machine(first.title, first, changes, second, options.uncertainty)
    except ValueError as error:
        raise UsageError(error) from None
    if options.output:
        predicted = adjusted.predicted_map
        write_noted(options, {options.output: lambda path: write_map(predicted, path)})
    show(options, adjusted)
    warn(adjusted.notes)
    return 0 if adjusted.difference is None or adjusted.is_within else 1
