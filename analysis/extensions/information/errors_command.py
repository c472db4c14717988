"""`ballplate run --errors`: information of each error that goes with each position."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ballplate.cli import add_file, add_json, show, single

DESCRIPTION = (
    "Compute how much of the information on each error of the machine goes with each position:"
    " 1 - u²(with all positions)/u²(without this one), where u is the error's uncertainty along"
    " its axis. Undetermined and weak errors are listed with the motions of positions that hide"
    " them. The exit status is 0 if the rank is as expected, otherwise 1."
)


def add_options(parser: ArgumentParser) -> None:
    add_file(parser)
    add_json(parser)


def run(options: Namespace) -> int:
    """Print the errors by positions; 1 if the rank is not as expected."""
    from ballplate.results import check

    from .position_information import position_information

    prediction = check(single(options))
    show(options, position_information(prediction))
    return int(not prediction.verdict.as_expected)
