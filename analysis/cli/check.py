"""`ballplate check`: does the design determine what it asks for?"""

from __future__ import annotations

import os
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .common import add_file, add_formats, percentage
from .outputs import UsageError
from .telling import warn

if TYPE_CHECKING:
    from .check_files import CheckedDesign

AS_EXPECTED, NOT_AS_EXPECTED, BAD_FILE = 0, 1, 3


HELP = "judge whether designs determine all their parameters"
DESCRIPTION = (
    "Judge the rank of each design, and tell which share of lengths is within its target"
    " and what carries its scale. The exit status is 0 if every deficiency is the one that"
    " the file expects (none, where it says nothing), every --goal is met and, with"
    " --fail-weak, nothing is weakly determined, otherwise 1; it is 3 if a file cannot be"
    " used, and the others are then checked nevertheless."
)


def add_options(parser: ArgumentParser) -> None:
    add_file(parser, several=True)
    parser.epilog = (
        "FILE may be a pattern such as designs/**/*.yaml, in which ** stands for any folders; files"
        " in folders named sweeps or machines are then left out."
    )
    add_formats(
        parser,
        ("text", "github", "junit", "json"),
        "text (default); github: workflow commands of GitHub Actions, which mark lines of a"
        " pull request; junit: an XML report for build servers; json: an object, or an array of"
        " them for several experiments, in metres and radians",
    )
    parser.add_argument(
        "--suggest",
        action="store_true",
        help=(
            "tell the cheapest changes after which nothing is undetermined or weakly determined,"
            " each verified"
        ),
    )
    parser.add_argument(
        "--goal",
        action="append",
        default=[],
        help=(
            "what a design must reach, too, as in ballplate reach: lengths (U6 within"
            " target_uncertainty), tasks, or a quantity such as "
            '"U6 average 0.5 um"; may be repeated'
        ),
    )
    parser.add_argument(
        "--share",
        metavar="95%",
        type=percentage,
        help="of the lengths that are to be within, with --goal lengths",
    )
    parser.add_argument(
        "--fail-weak",
        action="store_true",
        help="let a design with a weakly determined direction fail, too",
    )
    parser.add_argument(
        "--no-modules",
        action="store_true",
        help="refuse files with an error model in Python, which is code that loading them runs",
    )


def run(options: Namespace) -> int:
    """Check all designs; 1 if one of them is not as expected, 3 if a file cannot be used."""
    from ..planning.requirements.goals import GoalError, parse_goal
    from .check_files import Wanted, check_files
    from .common import print_json, print_lines
    from .excerpts import print_errors
    from .file_patterns import matching_files
    from .github import advice_lines, annotation_lines
    from .junit import junit_report

    workspace = Path(os.environ["GITHUB_WORKSPACE"]) if os.environ.get("GITHUB_WORKSPACE") else None
    try:
        with_share = {"lengths": options.share}
        goals = tuple(parse_goal(text, with_share.get(text)) for text in options.goal)
    except GoalError as error:
        raise UsageError(error) from None
    if options.share is not None and "lengths" not in options.goal:
        raise UsageError("--share goes with --goal lengths; add it")
    files = []
    wanted = Wanted(goals, options.fail_weak, options.suggest, not options.no_modules)
    for checked in check_files(matching_files(options.files), options.variant, wanted):
        files.append(checked)
        warn(checked.doubts)
        if options.format == "github":
            for line in annotation_lines(checked, workspace):
                print(line, flush=True)
        elif options.format == "text":
            for design in checked.designs:
                print_lines([*design.plan.lines(), *advice_lines(design)])
        if options.format in ("text", "json"):
            print_errors(checked.messages, options)
    if options.format == "junit":
        print(junit_report(files), end="")
    designs = [design for checked in files for design in checked.designs]
    if options.format == "json" and designs:
        print_json([one.plan.to_dict() | _asked(one, options.suggest) for one in designs])
    if any(checked.messages for checked in files):
        return BAD_FILE
    return AS_EXPECTED if all(checked.as_expected for checked in files) else NOT_AS_EXPECTED


def _asked(design: CheckedDesign, with_suggestions: bool) -> dict[str, Any]:
    """What was asked for besides the rank, as plain data."""
    from ..planning.repair.repair_tables import certificate_data, repair_data

    told: dict[str, Any] = {"goals": list(design.goals), "missed": list(design.missed)}
    if with_suggestions:
        told |= {
            "repairs": repair_data(design.repairs),
            "scale_certificate": certificate_data(design.certificate),
        }
    return told
