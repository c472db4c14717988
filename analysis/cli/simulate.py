"""`ballplate simulate`: synthetic readings of the stated true machine."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from pathlib import Path
from typing import TextIO

from .common import add_file, single, whole
from .notes import note
from .outputs import add_force, add_output, text_writer, write

DESCRIPTION = (
    "Write the readings that the file's true machine would give, of artefacts that"
    " differ from their certificates within the stated uncertainties, with noise of the"
    " stated repeatability. The same seed gives the same readings, with and without"
    " --certificate."
)


def add_options(parser: ArgumentParser) -> None:
    add_file(parser)
    add_output(
        parser,
        "-o",
        "--output",
        metavar="CSV",
        required=True,
        takes_screen=True,
        help="file to write, or - for standard output",
    )
    add_output(
        parser,
        "--certificate",
        metavar="CSV",
        takes_screen=True,
        help=(
            "also write values of certificates, priors and probe offsets, drawn about the true"
            " values, for fit --certificate"
        ),
    )
    parser.add_argument("--seed", type=whole, help="seed of the noise, instead of the file's")
    parser.add_argument(
        "--exact",
        action="store_true",
        help="leave out all noise; artefacts are as stated in the file",
    )
    add_force(parser)


def run(options: Namespace) -> int:
    """Write one set of readings."""
    from ballplate.simulator.inputs.extensions import service
    from ballplate.simulator.readings.reading_files import write_readings
    from ballplate.simulator.readings.simulated import simulated_readings

    experiment = single(options)
    certificates = service("CertificateFiles") if options.certificate else None
    if certificates is not None:
        certificates.ensure_certified(experiment)
    simulated = simulated_readings(experiment, options.seed, options.exact)
    texts: dict[Path, Callable[[TextIO], None]] = {
        options.output: lambda stream: write_readings(
            stream, simulated.design, simulated.readings, simulated.x
        )
    }
    lines = [f"{len(simulated.readings)} readings written to {options.output}"]
    if certificates is not None:
        drawn = certificates.with_drawn_values(experiment, simulated)
        how = "exact" if options.exact else f"drawn with seed {simulated.seed}"
        comment = f"certificate values of {experiment.label}, {how}, for fit --certificate"
        texts[options.certificate] = lambda stream: certificates.write(stream, drawn, comment)
        count = len(certificates.certified_values(drawn))
        lines.append(f"{count} certificate values written to {options.certificate}")
    writers = {path: text_writer(print_to) for path, print_to in texts.items() if str(path) != "-"}
    is_written = write(options, writers)
    for line, path in zip(lines, texts, strict=True) if is_written else ():
        if path in writers:
            note(options, line)
        else:
            texts[path](sys.stdout)
    return 0
