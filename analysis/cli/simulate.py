"""`ballplate simulate`: synthetic readings of the stated true machine."""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path

from .common import add_file, seed


def add_parser(commands) -> None:  # type: ignore[no-untyped-def]
    parser = commands.add_parser(
        "simulate",
        help="write synthetic readings of a design",
        description="Write readings that the file's true machine would give of artefacts that differ from their "
        "certificates by the stated uncertainties, with noise of the stated repeatability. The same seed gives the "
        "same readings, with and without --certificate.",
    )
    add_file(parser)
    parser.add_argument(
        "-o", "--output", metavar="CSV", required=True, type=Path, help="file to write, or - for standard output"
    )
    parser.add_argument(
        "--certificate",
        metavar="CSV",
        type=Path,
        help="also write values of certificates, priors and probe offsets, drawn about what is read, for "
        "fit --certificate",
    )
    parser.add_argument("--seed", type=seed, help="seed of the noise, instead of the file's")
    parser.add_argument("--exact", action="store_true", help="leave all noise out; artefacts are as drawn")
    parser.add_argument("--force", action="store_true", help="overwrite the output file if there is one")
    parser.set_defaults(run=run)


def run(options: Namespace) -> int:
    """Write one set of readings."""
    from dataclasses import replace

    import numpy as np
    from ballplate.simulator.certificates import certified_values, drawn_values, with_values, write_certificate
    from ballplate.simulator.experiment.messages import ExperimentError, Message
    from ballplate.simulator.generate import (
        NoReadingError,
        exact_readings,
        noisy_readings,
        on_true_machine,
        true_artefacts,
    )
    from ballplate.simulator.layout import lay_out
    from ballplate.simulator.machines.truth import true_machine
    from ballplate.simulator.readings import write_readings

    from .common import single, write_all

    experiment = single(options)
    if options.certificate and not certified_values(experiment):
        text = "there is no certificate, prior or probe offset with an uncertainty; leave --certificate out"
        raise ExperimentError([Message(str(experiment.source), 0, 0, "", text)])
    design = lay_out(experiment)
    corners = tuple(design.lower.tolist()), tuple(design.upper.tolist())
    on_truth, truth = on_true_machine(design, true_machine(experiment.true_machine, design.model, *corners))
    chosen = experiment.seed if options.seed is None else options.seed
    generator = None if options.exact else np.random.default_rng(np.random.SeedSequence(chosen))
    try:
        if generator is None:
            readings, x = exact_readings(on_truth, truth)
        else:
            truth = replace(truth, balls=true_artefacts(design, generator))
            readings, x = noisy_readings(on_truth, truth, generator)
    except NoReadingError as error:
        text = f"{error}; state smaller ones"
        raise ExperimentError([experiment.message(("true_machine",), text)]) from None
    writers = {options.output: lambda stream: write_readings(stream, design, readings, x)}
    told = [f"{len(readings)} readings written to {options.output}"]
    if options.certificate:
        if options.certificate == options.output:
            text = "is to have both readings and certificate; name two files"
            raise ExperimentError([Message(str(options.certificate), 0, 0, "", text)])
        values = drawn_values(experiment, design, truth, on_truth.model, generator)
        how = "exact" if options.exact else f"drawn with seed {chosen}"
        comment = f"certificate values of {experiment.label}, {how}, for fit --certificate"
        writers[options.certificate] = lambda stream: write_certificate(
            stream, with_values(experiment, values), comment
        )
        told.append(f"{len(values)} certificate values written to {options.certificate}")
    write_all(writers, options.force)
    for line, path in zip(told, writers, strict=True):
        if str(path) != "-":
            print(line, file=sys.stderr)
    return 0
