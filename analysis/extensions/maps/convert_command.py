"""`ballplate convert`: the map of a fit in another error model."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from ballplate.cli import FITTED, add_force, add_json, add_output, map_path, write

GROUP = "more"
HELP = "convert the map of a fit to another error model, with its covariance"
DESCRIPTION = (
    "Convert a map that fit -o has written to another error model of the same volume: the nearest"
    " corrections by least squares, their covariance, and what the new model cannot follow in the"
    " whole volume. The exit status is 0 if it follows the old one exactly, otherwise 1."
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
        help="write the converted map (.yaml, or .npz)",
    )
    add_force(parser)
    add_json(parser)


def run(options: Namespace) -> int:
    """Convert a map; 1 if the new model cannot follow the old one."""
    from ballplate.cli import complain, fitted_map, show
    from ballplate.simulator.experiment import write_map

    from .converted_map import convert

    found = convert(fitted_map(options.map), options.to, options.map.stem)
    if options.output:
        write(options, {options.output: lambda path: write_map(found.map, path)})
    show(options, found)
    for note in found.notes:
        complain(note)
    if not found.is_exact:
        complain("the new error model cannot follow the old one exactly; see the residuals")
    return 0 if found.is_exact else 1
