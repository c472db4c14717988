"""`ballplate next`: after each position, whether the target is met, and what to read next."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ballplate.cli import (
    UsageError,
    add_file,
    add_json,
    add_readings_argument,
    add_tables,
    complain,
    named_sources,
    progress,
    refuse_wrong_order,
    show,
    single,
    with_options,
)

from ..requirements.reach_command import add_goal

DESCRIPTION = (
    "Judge the readings taken so far: standard deviation from the residuals, flagged gross errors"
    " and the uncertainty U6 reached. Report whether the target is met and which position of the"
    " file or its pool to read next, with its expected effect. The exit status is 0 if the target"
    " is met, otherwise 1."
)


def add_options(parser: ArgumentParser) -> None:
    add_file(parser)
    add_readings_argument(
        parser,
        "readings so far: one table or several in the order in which they were taken; default:"
        " those that the experiment file names",
    )
    add_goal(parser, '"U6 average 0.3 um"')
    add_tables(parser)
    add_json(parser)


def run(options: Namespace) -> int:
    """Print the answer; 0 if the target is met, otherwise 1."""
    from dataclasses import replace

    from ballplate.extensions.requirements.goals import GoalError, parse_goal
    from ballplate.simulator.inputs import QuantityError, Target, parse_length_function

    from .next_position import next_step

    refuse_wrong_order(options)
    try:
        goal = parse_goal(options.goal, options.share)
        experiment = with_options(options, single(options, planning=True))
        if options.target is not None:
            length_function = parse_length_function(options.target)
            target = Target(length_function, experiment.coverage_factor)
            experiment = replace(experiment, target_uncertainty=target)
        sources = options.readings or named_sources(experiment)
        with progress(options) as shown:
            step = next_step(experiment, sources, goal, shown.show)
    except (GoalError, QuantityError) as error:
        raise UsageError(error) from None
    for note in step.notes:
        if not options.quiet or note.startswith("warning: "):
            complain(note)
    show(options, step)
    return 0 if step.is_met else 1
