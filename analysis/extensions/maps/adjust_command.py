"""`ballplate adjust`: a machine after adjustments, as predicted and as inspected again."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from ballplate.cli import (
    UsageError,
    add_force,
    add_json,
    add_output,
    add_readings,
    map_path,
    observed_readings,
    percentage,
    show,
    warn,
    warn_of,
    write_noted,
)

if TYPE_CHECKING:
    from ballplate.simulator.maps import FittedMap

DESCRIPTION = (
    "Apply stated changes of scales and turns of guideways to a fitted machine: of a map file, or"
    " of an experiment with its readings. Predict the remaining scale errors, angles between the"
    " axes and errors along the diagonals of the volume, with U, and compare them with a second"
    " campaign, as diff does. The exit status is 1 if the comparison shows a change or is"
    " impossible, or a fit is not as expected, otherwise 0."
)


def add_options(parser: ArgumentParser) -> None:
    add_readings(parser)
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
        metavar="FILE",
        nargs="+",
        type=Path,
        default=[],
        help="second campaign: its map file, or its readings of the same experiment",
    )
    add_output(
        parser,
        "-o",
        "--output",
        metavar="FILE",
        type=map_path,
        help="write the predicted machine as a map file: .yaml, or .npz for a large one",
    )
    add_force(parser)
    add_json(parser)


def run(options: Namespace) -> int:
    """Print the prediction and the comparison; 1 if something is not as expected."""
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
    first, complaint = _fitted(options, options.files[0], options.readings)
    if first is None:
        return 1
    second = None
    if options.after:
        second, second_map = _second(options)
        if second is None:
            return 1
        complaint |= second_map
    try:
        adjusted = adjusted_machine(first.title, first, changes, second, options.uncertainty)
    except ValueError as error:
        raise UsageError(error) from None
    if options.output:
        predicted = adjusted.predicted_map
        write_noted(options, {options.output: lambda path: write_map(predicted, path)})
    show(options, adjusted)
    warn(adjusted.notes)
    return 1 if complaint or (adjusted.difference is not None and not adjusted.is_within) else 0


def _second(options: Namespace) -> tuple[FittedMap | None, bool]:
    """The map of the second campaign, and whether there is something to complain of."""
    from ballplate.simulator.experiment import is_map_file

    # A table of readings is named for what it is, whether it is there or not.
    if options.after[0].suffix.lower() != ".csv" and is_map_file(options.after[0]):
        return _fitted(options, options.after[0], options.after[1:])
    if is_map_file(options.files[0]):
        raise UsageError(
            f"{options.after[0]} is no map file; for readings, name the experiment file instead of"
            f" {options.files[0]}, or fit them first with fit -o"
        )
    return _fitted(options, options.files[0], options.after)


def _fitted(options: Namespace, file: Path, readings: list[Path]) -> tuple[FittedMap | None, bool]:
    """Return a map, of a file or of a fit, and whether it has a failure reason; None if a fit
    failed.
    """
    from ballplate.simulator.experiment import is_map_file, read_map

    if is_map_file(file):
        if readings:
            raise UsageError(f"{file} is a map, which needs no readings; leave {readings[0]} out")
        return read_map(file), False
    from ballplate.results import fit

    chosen = Namespace(**{**vars(options), "files": [file], "readings": readings})
    experiment, observed = observed_readings(chosen)
    result = fit(experiment, observed, options.sigma)
    warn_of(result)
    return (result.to_map() if result.converged else None), bool(result.complaint)
