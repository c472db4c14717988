"""`ballplate part`: uncertainty of each dimension of a part."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Any

from ballplate.cli import (
    UsageError,
    add_force,
    add_json,
    add_output,
    count,
    page_path,
    show,
    text_writer,
    whole,
    write,
)

DESCRIPTION = (
    "Compute the uncertainty of each dimension of a part on the corrected machine: of a design"
    " before anything is measured, or of the map of a fit; compared with the tolerances (ISO"
    " 14253-1), with the share that the map has in it. With readings of the part's points, the"
    " dimensions are evaluated as well. The exit status is 0 if every tolerance is held by its"
    " uncertainty, otherwise 1."
)


def add_options(parser: ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", type=Path, help="part file (YAML)")
    source = parser.add_mutually_exclusive_group()
    source.add_argument(
        "--design", metavar="FILE", type=Path, help="experiment file that is to be measured"
    )
    source.add_argument(
        "--map",
        metavar="FILE",
        type=Path,
        help="map file, as fit -o writes it, or experiment file that names its readings",
    )
    parser.add_argument(
        "--readings",
        metavar="FILE",
        type=Path,
        help="with --map: table of the part's points with the columns place, feature, point, x_mm,"
        " y_mm and z_mm",
    )
    parser.add_argument(
        "--coordinates",
        choices=("scale readings", "tip centres"),
        default="scale readings",
        help="what the readings are: of the scales, or with the stated offsets of probes",
    )
    parser.add_argument(
        "--draw", metavar="N", type=count, default=0, help="also fit the points of N drawn machines"
    )
    parser.add_argument("--seed", metavar="S", type=whole, default=1, help="seed; default 1")
    add_output(
        parser, "--report", metavar="FILE", type=page_path, help="write it as a page (.html)"
    )
    add_output(
        parser, "--points", metavar="CSV", help="write the points to be touched, with their probes"
    )
    add_force(parser)
    add_json(parser)


def run(options: Namespace) -> int:
    """Print the dimensions and write the page; 1 if a tolerance is not held."""
    from .interface import part

    try:
        found = part(
            options.file,
            options.design,
            options.map,
            readings=options.readings,
            coordinates=options.coordinates,
            draws=options.draw,
            seed=options.seed,
        )
    except ValueError as error:
        raise UsageError(error) from None
    contents: dict[Path | None, Any] = {options.points: text_writer(found.write_points)}
    if options.report:
        contents[options.report] = found.page_text()
    write(options, contents)
    show(options, found)
    return int(not found.is_held)
