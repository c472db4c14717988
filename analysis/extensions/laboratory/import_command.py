"""`ballplate import`: readings out of reports of measuring programs."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

from ballplate.cli import add_force, add_output, complain, note, rule, single, text_writer, write

DESCRIPTION = (
    "Read the centres of spheres out of reports that measuring programs write (DMIS output,"
    " PC-DMIS, Calypso, QIF), and write them as a table for fit. Positions, balls and probes are"
    " found in the names of features. Lists features imported and skipped."
)
FORMATS = ("dmis", "pcdmis", "calypso", "qif")
UNITS = ("mm", "cm", "m", "in")


def add_options(parser: ArgumentParser) -> None:
    parser.add_argument("reports", metavar="REPORT", nargs="+", type=Path, help="report to read")
    add_output(
        parser,
        "-o",
        "--output",
        metavar="CSV",
        required=True,
        takes_screen=True,
        help="table to write, or - for standard output",
    )
    parser.add_argument(
        "--for",
        dest="files",
        metavar="FILE",
        nargs=1,
        type=Path,
        help="experiment file (YAML) whose positions, balls and probes the names are matched with",
    )
    parser.add_argument(
        "--variant",
        metavar="NAME",
        action="append",
        default=[],
        help="with --for: use only this variant",
    )
    parser.add_argument(
        "--name",
        metavar="RULE",
        type=rule,
        help=(
            'how features are named, such as "{position}_{ball}_{probe}"; default: detected and'
            " reported"
        ),
    )
    parser.add_argument(
        "--from",
        dest="form",
        choices=FORMATS,
        help="format of the reports; default: recognised",
    )
    parser.add_argument(
        "--unit",
        choices=UNITS,
        help="unit of reports without a unit; a stated unit takes precedence",
    )
    parser.add_argument(
        "--circles", action="store_true", help="take centres of circles, too, as of a hole plate"
    )
    parser.add_argument(
        "--uncertainty",
        action="store_true",
        help=(
            "write the standard uncertainty of centres computed from points on the surface, which"
            " fit then uses instead of the machine's repeatability"
        ),
    )
    add_force(parser)


def run(options: Namespace) -> int:
    """Write the table of readings in the reports."""

    from .interface import read_report

    experiment = single(options) if options.files else None
    report = read_report(
        options.reports, experiment, options.name, options.form, options.unit, options.circles
    )
    if str(options.output) == "-":
        report.write(sys.stdout, options.uncertainty)
    else:
        print_to = text_writer(lambda stream: report.write(stream, options.uncertainty))
        if not write(options, {options.output: print_to}):
            return 0
    for line in report.told:
        note(options, line)
    for line in report.remarks:
        complain(line)
    note(options, f"{len(report.readings)} readings written to {options.output}; {report.key}")
    return 0
