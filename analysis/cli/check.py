"""`ballplate check`: rank of designs against the expected rank and goals."""

from __future__ import annotations

import os
import shlex
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ballplate.simulator.inputs.extensions import service

from .common import add_file, add_formats, matching_files, percentage, print_json, print_lines
from .notes import note, note_singular_values, print_errors, progress, tell_notes, warn
from .outputs import UsageError

if TYPE_CHECKING:
    from ballplate.results.checked_files import CheckedFile

AS_EXPECTED, NOT_AS_EXPECTED, BAD_FILE = 0, 1, 3


DESCRIPTION = (
    "Determine the rank of each design, the share of lengths within its target, and"
    " its sources of scale. The exit status is 0 if every rank deficiency is the one"
    " that the file expects (default: 0), every --goal is met and, with --fail-"
    "weak, no direction is weakly determined; otherwise it is 1. It is 3 if a file cannot be"
    " used; the other files are still checked."
)


# In one piece: one option after the other, with its help.
def add_options(parser: ArgumentParser) -> None:
    add_file(parser, several=True)
    parser.epilog = (
        "FILE may be a pattern such as designs/**/*.yaml, where ** matches any number of"
        " folders; files in folders named sweeps or machines are then left out."
    )
    add_formats(
        parser,
        ("text", "github", "junit", "json"),
        "text (default); github: workflow commands of GitHub Actions, which mark lines of a"
        " pull request; junit: an XML report for build servers; json: an object, or an array"
        " for several experiments, in metres and radians",
    )
    parser.add_argument(
        "--suggest",
        action="store_true",
        help=(
            "suggest changes that remove all undetermined and weakly determined directions and meet"
            " the target, each verified: first moves, then readings, then certificates"
        ),
    )
    parser.add_argument(
        "--goal",
        action="append",
        default=[],
        help=(
            "goal that a design must also meet, as for ballplate reach: lengths (U6 within"
            ' target_uncertainty), tasks, or a quantity such as "U6 average 0.5 um"; may be'
            " repeated"
        ),
    )
    parser.add_argument(
        "--share",
        metavar="95%",
        type=percentage,
        help="share of the lengths that must be within the target, with --goal lengths",
    )
    parser.add_argument(
        "--fail-weak",
        action="store_true",
        help="also fail a design with a weakly determined direction",
    )
    parser.add_argument(
        "--no-modules",
        action="store_true",
        help=(
            "run no code: refuse files with an error model or a calibration in Python, and files"
            " that name others outside this folder"
        ),
    )


def run(options: Namespace) -> int:
    """Check all designs; return 1 unless all are as expected, 3 if a file cannot be used."""
    from ballplate.results.checked_files import Wanted, check_files

    goals = _goals(options)
    wanted = Wanted(goals, options.fail_weak, options.suggest, not options.no_modules)
    paths = matching_files(options.files)
    if options.format == "junit":
        # Refused before the work where its extension is missing.
        service("junit_report")
    files = []
    with progress(options) as shown:
        for checked in check_files(paths, options.variant, wanted, shown.show):
            shown.step_aside()
            files.append(checked)
            _print(checked, options)
            if not wanted.repairs and options.format == "text":
                _name_suggestions(checked, options)
    if options.format == "junit":
        print(service("junit_report")(files), end="")
    designs = [design for checked in files for design in checked.designs]
    if options.format == "json" and designs:
        print_json([checked_design.prediction.to_dict() for checked_design in designs])
    if any(checked.messages for checked in files):
        return BAD_FILE
    return AS_EXPECTED if all(checked.as_expected for checked in files) else NOT_AS_EXPECTED


def _name_suggestions(checked: CheckedFile, options: Namespace) -> None:
    """Name the command that suggests repairs of a design that determines less than it should."""
    verdicts = [design.prediction.verdict for design in checked.designs]
    if any(verdict.deficiency and not verdict.as_expected for verdict in verdicts):
        variants = [word for name in options.variant or () for word in ("--variant", name)]
        words = ["ballplate", "check", str(checked.file), *variants, "--suggest"]
        note(options, f"next: {shlex.join(words)}")


def _goals(options: Namespace) -> tuple[Any, ...]:
    if options.share is not None and "lengths" not in options.goal:
        raise UsageError("--share needs --goal lengths; add it")
    if not options.goal:
        return ()
    parse_goal = service("parse_goal")
    with_share = {"lengths": options.share}
    try:
        return tuple(parse_goal(text, with_share.get(text)) for text in options.goal)
    except ValueError as error:
        raise UsageError(str(error)) from None


def _print(checked: CheckedFile, options: Namespace) -> None:
    tell_notes(checked.notes)
    warn(checked.doubts)
    if options.format == "github":
        workspace = os.environ.get("GITHUB_WORKSPACE")
        for line in service("annotation_lines")(checked, Path(workspace) if workspace else None):
            print(line, flush=True)
    elif options.format == "text":
        for design in checked.designs:
            print_lines(design.prediction.lines())
            note_singular_values(options, design.prediction.verdict)
    if options.format in ("text", "json"):
        print_errors(checked.messages, options)
