"""`ballplate next`: after each position, whether the target is met, and what to read next."""

from __future__ import annotations

import json
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ballplate.cli import (
    UsageError,
    add_file,
    add_goal,
    add_json,
    add_readings_argument,
    add_tables,
    number,
    refuse_wrong_order,
    show,
    single,
)

if TYPE_CHECKING:
    from ballplate.extensions.requirements.goals import Goal
    from ballplate.simulator.experiment import Experiment

    from .next_result import NextStep

DESCRIPTION = (
    "Judge the readings taken so far: standard deviation from the residuals, flagged gross errors"
    " and the uncertainty U6 reached. Report whether the target is met and which position of the"
    " file or its pool to read next, with its expected effect. If a position was read again, its"
    " last readings count. The exit status is 0 if the target is met, otherwise 1."
)


def add_options(parser: ArgumentParser) -> None:
    add_file(parser)
    add_readings_argument(
        parser,
        "readings so far: one table or several in the order in which they were taken; default:"
        " those that the experiment file names",
    )
    parser.add_argument(
        "--watch",
        metavar="FOLDER",
        type=Path,
        help=(
            "wait for tables of readings in a folder, and print the answer whenever one has been"
            " written; ends when the target is met, or with Ctrl-C"
        ),
    )
    parser.add_argument(
        "--interval",
        metavar="SECONDS",
        type=_seconds,
        help="with --watch: time between two looks at the folder; default 2",
    )
    add_goal(parser, '"U6 average 0.3 um"')
    add_tables(parser)
    add_json(parser)


def _seconds(text: str) -> float:
    value = number(text, "s")
    if not 0.0 < value < 1e5:
        raise ArgumentTypeError(f'expected seconds above zero, such as 2, not "{text}"')
    return value


def run(options: Namespace) -> int:
    """Print the answer, or one each time in a folder; 0 once the target is met, otherwise 1."""
    from dataclasses import replace

    from ballplate.cli import named_sources, with_options
    from ballplate.extensions.requirements.goals import GoalError, parse_goal
    from ballplate.simulator.inputs import QuantityError, Target, parse_length_function

    if options.interval is not None and options.watch is None:
        raise UsageError("--interval needs --watch; leave it out")
    if options.watch is not None and not options.watch.is_dir():
        raise UsageError(f"--watch {options.watch}: no such folder")
    refuse_wrong_order(options)
    try:
        goal = parse_goal(options.goal, options.share)
        experiment = with_options(options, single(options, planning=True))
        if options.target is not None:
            length_function = parse_length_function(options.target)
            target = Target(length_function, experiment.coverage_factor)
            experiment = replace(experiment, target_uncertainty=target)
        if options.watch is not None:
            return _watch(options, experiment, goal)
        sources = options.readings or named_sources(experiment)
        step = _judged(options, experiment, goal, sources)
    except (GoalError, QuantityError) as error:
        raise UsageError(error) from None
    show(options, step)
    return 0 if step.is_met else 1


def _judged(
    options: Namespace, experiment: Experiment, goal: Goal, sources: Sequence[Path]
) -> NextStep:
    from ballplate.cli import complain, progress

    from .next_position import next_step

    with progress(options) as shown:
        step = next_step(experiment, sources, goal, shown.show)
    for note in step.notes:
        complain(note)
    return step


def _watch(options: Namespace, experiment: Experiment, goal: Goal) -> int:
    """Judge at each change of files in the folder, until the target is met or an interrupt."""
    import time

    from ballplate.cli import note, print_errors, print_lines
    from ballplate.simulator.inputs import ExperimentError

    from .watching_command import settled

    def wait() -> None:
        time.sleep(options.interval or 2.0)

    note(options, f"waiting for readings in {options.watch}; Ctrl-C ends this")
    try:
        for files in settled(options.watch, wait):
            try:
                step = _judged(options, experiment, goal, [*options.readings, *files])
            except ExperimentError as error:
                # It may be mended, or not yet be whole.
                print_errors(error.messages, options)
                continue
            if options.json:
                print(json.dumps(step.to_dict(), allow_nan=False, ensure_ascii=False), flush=True)
            else:
                print_lines(step.lines())
            if step.is_met:
                return 0
    except KeyboardInterrupt:
        note(options, "stopped before the target was met")
    return 1
