"""`ballplate check`: does the design determine what it asks for?"""

from __future__ import annotations

import os
import sys
from argparse import Namespace
from pathlib import Path

from .common import add_file

FORMATS = ("text", "github", "junit", "json")
AS_EXPECTED, NOT_AS_EXPECTED, BAD_FILE = 0, 1, 3


def add_parser(commands) -> None:  # type: ignore[no-untyped-def]
    parser = commands.add_parser(
        "check",
        help="judge whether designs determine all their parameters",
        description="Judge the rank of each design. The exit status is 0 if every deficiency is the one that the "
        "file expects (none, where it says nothing), otherwise 1; it is 3 if a file cannot be used, and the others "
        "are then checked nevertheless.",
    )
    add_file(parser, several=True)
    parser.add_argument(
        "--format",
        choices=FORMATS,
        default="text",
        help="text (default); github: workflow commands of GitHub Actions, which mark lines of a pull request; junit: "
        "an XML report for build servers; json: an object, or an array of them for several experiments, in metres and "
        "radians",
    )
    parser.add_argument("--json", action="store_const", dest="format", const="json", help="the same as --format json")
    parser.add_argument(
        "--suggest",
        action="store_true",
        help="tell the cheapest changes after which nothing is undetermined or weakly determined, each verified",
    )
    parser.set_defaults(run=run)


def run(options: Namespace) -> int:
    """Check all designs; 1 if one of them is not as expected, 3 if a file cannot be used."""
    from ..annotations import annotation_lines
    from ..checking import check_files
    from ..junit import junit_report
    from ..planning.repair.tables import repair_data, repair_lines
    from ..tables import plan_data, plan_lines
    from .common import print_json, print_lines

    workspace = Path(os.environ["GITHUB_WORKSPACE"]) if os.environ.get("GITHUB_WORKSPACE") else None
    files = []
    for checked in check_files(options.files, options.variant, options.suggest):
        files.append(checked)
        for doubt in checked.doubts:
            print(f"warning: {doubt}", file=sys.stderr)
        if options.format == "github":
            for line in annotation_lines(checked, workspace):
                print(line, flush=True)
        elif options.format == "text":
            for design in checked.designs:
                print_lines([*plan_lines(design.plan), *repair_lines(design.repairs, design.plan.verdict)])
        if options.format in ("text", "json"):
            for message in checked.messages:
                print(message, file=sys.stderr)
    if options.format == "junit":
        print(junit_report(files), end="")
    designs = [design for checked in files for design in checked.designs]
    if options.format == "json" and designs:
        suggested = [{"repairs": repair_data(design.repairs)} if options.suggest else {} for design in designs]
        print_json([plan_data(one.plan) | more for one, more in zip(designs, suggested, strict=True)])
    if any(checked.messages for checked in files):
        return BAD_FILE
    return AS_EXPECTED if all(checked.as_expected for checked in files) else NOT_AS_EXPECTED
