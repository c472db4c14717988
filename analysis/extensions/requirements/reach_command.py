"""`ballplate reach`: value of one unknown of a design that meets a goal."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ballplate.cli import UsageError, add_file, add_json, percentage, progress, show, single, whole

UNKNOWNS = (
    *("repeatability", "certificate", "tips", "thermometers", "repeats", "balls", "size"),
    "hours",
)


DESCRIPTION = (
    "Solve for one unknown of a design at a time, with the others as in the file: the"
    " largest uncertainty of readings, certificates, tips or temperatures, the fewest repeats or"
    " balls, the smallest plate, or the shortest plan that meets a goal. Each answer is a value of"
    " three digits, or a whole number, for which the design was computed and meets the goal; the"
    " next value fails. The exit status is 0 if every requested unknown has such a value (without"
    " --by: one), otherwise 1; with --fail it is 0 if the design in the"
    " file meets the goal, otherwise 1."
)


def add_options(parser: ArgumentParser) -> None:
    add_file(parser)
    parser.add_argument(
        "--by",
        choices=UNKNOWNS,
        action="append",
        help="solve for this unknown only; may be repeated",
    )
    add_goal(parser, '"U6 average 0.3 um", "U6 maximum 0.4 um" or "U5 average 0.1 um"')
    parser.add_argument(
        "--artefact",
        metavar="NAME",
        help="artefact to vary: its balls, size, calibrations and repeats",
    )
    parser.add_argument(
        "--calibration",
        metavar="N",
        type=whole,
        help="index of the calibration entry to vary, from 0; default: all by the same factor",
    )
    parser.add_argument(
        "--fail",
        action="store_true",
        help="end with exit status 1 unless the design in the file meets the goal",
    )
    add_json(parser)


def run(options: Namespace) -> int:
    """Solve for the requested unknowns; return 1 if no value suffices."""
    from ballplate.simulator.inputs import QuantityError, parse_length_function

    from .goals import GoalError, parse_goal
    from .root_search import reach
    from .unknowns import NotVariableError

    try:
        goal = parse_goal(options.goal, options.share)
        if options.target is not None:
            parse_length_function(options.target)
        names = tuple(dict.fromkeys(options.by or UNKNOWNS[:-1]))
        experiment = single(options, planning="hours" in names)
        with progress(options) as shown:
            result = reach(
                experiment,
                goal,
                names,
                options.artefact,
                options.calibration,
                options.target,
                shown.show,
            )
    except (GoalError, NotVariableError, QuantityError) as error:
        raise UsageError(error) from None
    show(options, result)
    if options.fail:
        return 0 if result.present.is_met else 1
    met = [answer.is_met for answer in result.answers]
    return 0 if (all if options.by else any)(met) else 1


def add_goal(parser: ArgumentParser, quantities: str) -> None:
    """Add the goal, with examples of quantities, and the replacement of the target."""
    parser.add_argument(
        "--goal",
        default="lengths",
        help=(
            "lengths (default: distances between corrected points, U6, within target_uncertainty),"
            f" tasks, or a quantity such as {quantities}"
        ),
    )
    parser.add_argument(
        "--share",
        metavar="95%",
        type=percentage,
        help="share of the lengths that must be within the target; default: all",
    )
    parser.add_argument(
        "--target",
        metavar="LENGTH",
        help='target instead of target_uncertainty, such as "0.5 um + L/1000000"',
    )
