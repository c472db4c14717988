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
        "same readings.",
    )
    add_file(parser)
    parser.add_argument(
        "-o", "--output", metavar="CSV", required=True, type=Path, help="file to write, or - for standard output"
    )
    parser.add_argument("--seed", type=seed, help="seed of the noise, instead of the file's")
    parser.add_argument("--exact", action="store_true", help="leave all noise out; artefacts are as drawn")
    parser.add_argument("--force", action="store_true", help="overwrite the output file if there is one")
    parser.set_defaults(run=run)


def run(options: Namespace) -> int:
    """Write one set of readings."""
    from dataclasses import replace

    import numpy as np

    from simulator.experiment.load import message_at
    from simulator.experiment.messages import ExperimentError, Message
    from simulator.generate import (
        NoReadingError,
        exact_readings,
        noisy_readings,
        on_true_machine,
        true_artefacts,
    )
    from simulator.layout import lay_out
    from simulator.machines.truth import true_machine
    from simulator.readings import write_readings

    from .common import single

    experiment = single(options)
    design = lay_out(experiment)
    corners = tuple(design.lower.tolist()), tuple(design.upper.tolist())
    on_truth, truth = on_true_machine(design, true_machine(experiment.true_machine, design.model, *corners))
    chosen = experiment.seed if options.seed is None else options.seed
    try:
        if options.exact:
            readings, x = exact_readings(on_truth, truth)
        else:
            generator = np.random.default_rng(np.random.SeedSequence(chosen))
            truth = replace(truth, balls=true_artefacts(design, generator))
            readings, x = noisy_readings(on_truth, truth, generator)
    except NoReadingError as error:
        text = f"{error}; state smaller ones"
        raise ExperimentError([message_at(experiment.source, ("true_machine",), text)]) from None
    if str(options.output) == "-":
        write_readings(sys.stdout, design, readings, x)
        return 0
    try:
        with options.output.open("w" if options.force else "x", encoding="utf-8", newline="") as stream:
            write_readings(stream, design, readings, x)
    except FileExistsError:
        text = "exists already; name a new file, or overwrite it with --force"
        raise ExperimentError([Message(str(options.output), 0, 0, "", text)]) from None
    except OSError as error:
        raise ExperimentError(
            [Message(str(options.output), 0, 0, "", f"cannot be written ({error.strerror}); name another file")]
        ) from None
    print(f"{len(readings)} readings written to {options.output}", file=sys.stderr)
    return 0
