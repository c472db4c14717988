"""`ballplate map --convert`: the map of a fit in another error model."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from ballplate.cli import add_force, add_json, add_output, map_path, write

from .fitted_argument import FITTED, fitted_map

DESCRIPTION = (
    "Convert a map that fit -o has written to another error model of the same volume: the nearest"
    " corrections by least squares, their covariance, and the largest residuals in the whole"
    " volume. The exit status is 0 if it follows the old one exactly, otherwise 1."
)


def add_options(parser: ArgumentParser) -> None:
    parser.add_argument("map", metavar="MAP", type=Path, help=FITTED)
    parser.add_argument(
        "--to",
        metavar="MODEL",
        required=True,
        help=(
            "error model: a kind such as empirical, settings such as '{kind: kinematic,"
            " position_coefficients: 3}', or an experiment file whose error_model is taken"
        ),
    )
    add_output(
        parser,
        "-o",
        "--output",
        metavar="MAP",
        type=map_path,
        help="write the converted map (.yaml)",
    )
    add_force(parser)
    add_json(parser)


def run(options: Namespace) -> int:
    """Convert a map; 1 if the new model cannot follow the old one."""
    from ballplate.cli import complain, show
    from ballplate.simulator.experiment import write_map

    from .converted_map import convert

    conversion = convert(fitted_map(options.map), options.to, options.map.stem)
    if options.output:
        write(options, {options.output: lambda path: write_map(conversion.map, path)})
    show(options, conversion)
    for note in conversion.notes:
        complain(note)
    if not conversion.is_exact:
        complain("the new error model cannot follow the old one exactly; see the residuals")
    return 0 if conversion.is_exact else 1
