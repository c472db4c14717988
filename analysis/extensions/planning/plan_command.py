"""`ballplate plan`: positions and certificates chosen from a pool."""

from __future__ import annotations

from argparse import Action, ArgumentParser, ArgumentTypeError, Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ballplate.cli import (
    add_file,
    add_force,
    add_json,
    add_output,
    add_workers,
    count,
    note,
    number,
    page_path,
    print_errors,
    progress,
    show,
    single,
    whole,
    write,
)
from ballplate.simulator.inputs import service

if TYPE_CHECKING:
    from ballplate.presentation import Writer

    from .selection import Campaign

DESCRIPTION = (
    "Choose the positions and certificates from the pool of an experiment file that minimise a"
    " criterion within a budget, and compute a lower bound of the criterion for any choice."
    " Without a budget, the choice may cost as much as the positions in the file. The exit status"
    " is 0 if the choice leaves no direction undetermined except those that the file expects,"
    " otherwise 1."
)


# In one piece: one option after the other, with its help.
def add_options(parser: ArgumentParser) -> None:
    add_file(parser)
    parser.add_argument(
        "--criterion",
        metavar="NAME",
        type=_criterion,
        default="U6",
        action=_Criterion,
    )
    budget = parser.add_argument_group("budget")
    budget.add_argument(
        "--hours",
        metavar="H",
        type=_hours,
        help="laboratory time, including changes between positions",
    )
    budget.add_argument("--positions", metavar="N", type=count, help="largest number of positions")
    budget.add_argument("--readings", metavar="N", type=count, help="largest number of readings")
    again = parser.add_argument_group("a campaign that has begun")
    again.add_argument(
        "--done",
        metavar="CSV",
        type=Path,
        help=(
            "readings already taken; their positions are kept, and the budget is for the"
            " remaining ones"
        ),
    )
    again.add_argument(
        "--moved",
        action="store_true",
        help=(
            "the artefact has moved since it was last read; an interrupted position has"
            " to be set up again"
        ),
    )
    again.add_argument(
        "--from",
        dest="earlier",
        metavar="FILE",
        type=Path,
        help=(
            "design chosen earlier from this pool, to compare with and to continue from;"
            " default: the positions in the file"
        ),
    )
    output = parser.add_argument_group("output")
    add_output(
        output, "-o", "--output", metavar="YAML", help="write the choice as an experiment file"
    )
    add_output(
        output,
        "--sheet",
        metavar="FILE",
        type=page_path,
        help="write the run sheet as a page to print (.html)",
    )
    output.add_argument(
        "--curve", action="store_true", help="plan for smaller and larger budgets as well"
    )
    add_force(output)
    add_json(parser)
    parser.add_argument(
        "--seed", type=whole, default=1, help="seed of the random starts of the search; default 1"
    )
    add_workers(parser)


class _Criterion(Action):
    """Loads the names of all criteria only where help is printed."""

    def __call__(
        self, parser: ArgumentParser, options: Namespace, value: Any, option: str | None = None
    ) -> None:
        setattr(options, self.dest, value)

    @property
    def help(self) -> str:
        from .criteria import NAMES

        return f"{NAMES[0]} (default: average), {', '.join(NAMES[1:-1])} or {NAMES[-1]}"

    @help.setter
    def help(self, text: str | None) -> None:
        pass


def _criterion(text: str) -> str:
    from .criteria import NAMES

    if text not in NAMES:
        raise ArgumentTypeError(f'choose from {", ".join(NAMES)}, not "{text}"')
    return text


def _hours(text: str) -> float:
    value = number(text, "h")
    if not 0.0 < value < 1e5:
        raise ArgumentTypeError(f'expected hours above zero, such as 7.5, not "{text}"')
    return value


def run(options: Namespace) -> int:
    """Choose, print and write; 1 if the choice leaves something undetermined."""
    from ballplate.simulator.computing import processors
    from ballplate.simulator.inputs import ExperimentError

    from .campaign_choice import Request, campaign
    from .constraints import HOUR, Budget

    experiment = single(options, planning=True)
    offered, earlier = None, None
    if options.done or options.earlier or options.moved:
        begun = service("begun")
        offered, earlier = begun(experiment, options.done, options.moved, options.earlier)
    asked = (options.hours, options.readings, options.positions)
    budget = None
    if any(value is not None for value in asked):
        seconds = None if options.hours is None else HOUR * options.hours
        budget = Budget(seconds, options.readings, options.positions)
    request = Request(options.criterion, budget, options.curve, options.seed)
    with progress(options) as shown:
        planned = campaign(
            experiment, request, offered, earlier, options.workers or processors(), shown.show
        )
    try:
        _write(planned, options)
    except ExperimentError as error:
        # What took so long to find is told nevertheless.
        print_errors(error.messages, options)
        options.is_written = False
    show(options, planned)
    return 0 if planned.is_determined and planned.prediction.verdict.as_expected else 1


def _write(campaign: Campaign, options: Namespace) -> None:
    """Write the requested files."""
    contents: dict[Path | None, Writer | str] = {}
    if options.output is not None:
        contents[options.output] = campaign.to_yaml(options.output.parent)
    if options.sheet is not None:
        contents[options.sheet] = campaign.sheet_page()
    if write(options, contents):
        for path in filter(None, (options.output, options.sheet)):
            note(options, f"{path} written")
