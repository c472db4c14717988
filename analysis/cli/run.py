"""`ballplate run`: uncertainty tables of a design, optionally with Monte Carlo."""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError, Namespace
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ballplate.presentation.formatting import Data
from ballplate.simulator.inputs.extensions import function, optional_service, service

from .common import (
    add_file,
    add_json,
    add_page,
    add_workers,
    experiments,
    percentage,
    print_json,
    print_lines,
    trial_count,
    whole,
)
from .notes import complain, note_singular_values, progress
from .outputs import XLSX, UsageError, add_force, add_output, write

if TYPE_CHECKING:
    from ballplate.montecarlo.experiments import Trials
    from ballplate.simulator.computing.steps import ProgressStep
    from ballplate.simulator.experiment.model import Experiment

# Endings of files of joint tables.
TABLES = (".csv", ".xlsx", ".tex", ".md", ".txt")
MORE = "(for everything about one design, run its file alone, or with --variant NAME)"

DESCRIPTION = (
    "Compute the rank and the standard uncertainties U1 to U6 of a design at zero"
    " machine error, those of several designs in one table. With --trials, synthetic data"
    " sets of the file's true machine are estimated as well, and their bias, spread and"
    " coverage are printed with the linearised uncertainties. The exit status is 0 if the"
    " rank is as expected, otherwise 1."
)


def add_options(parser: ArgumentParser) -> None:
    add_file(parser, several=True)
    group = parser.add_argument_group("Monte Carlo")
    group.add_argument(
        "--trials", metavar="N", type=_trial_count, help="largest number of data sets"
    )
    group.add_argument(
        "--until",
        metavar="1%",
        type=percentage,
        help="stop when the ratios of spread to U are known this accurately",
    )
    group.add_argument("--seed", type=whole, help="seed of the data sets, instead of the file's")
    add_workers(group)
    parser.add_argument(
        "--assumptions",
        action="store_true",
        help="print all that is taken for granted, U6 without it, and the entries that state it",
    )
    add_output(
        parser,
        "--table",
        metavar="FILE",
        needed=lambda path: XLSX if path.suffix.lower() == ".xlsx" else None,
        help="write the joint table of all designs: .csv, .xlsx, .tex, .md or .txt",
    )
    add_page(parser, "write the design as a page of HTML that needs no other file and no network")
    add_force(parser)
    add_json(parser)


def _trial_count(text: str) -> int:
    count = trial_count(text)
    if count < 2:
        raise ArgumentTypeError(
            f'one data set has no standard deviation; give at least 2, not "{text}"'
        )
    return count


def run(options: Namespace) -> int:
    """Plan all experiments of the files; 1 if the rank of one is not as expected."""
    from ballplate.results.prediction import predict
    from ballplate.simulator.computing.steps import counted

    results: list[Data] = []
    interrupted = False
    with_trials = options.trials is not None or options.until is not None
    if not with_trials and (options.seed is not None or options.workers is not None):
        raise UsageError("--seed and --workers apply to --trials or --until only; leave them out")
    if options.assumptions:
        service("assumption_effects")
    if options.table and options.table.suffix.lower() not in TABLES:
        raise UsageError(f"{options.table} should end in {', '.join(TABLES)}")
    joint: Any = (service if options.table else optional_service)("JointTable")
    chosen = experiments(options)
    if options.report and len(chosen) > 1:
        names = ", ".join(str(experiment.name or experiment.label) for experiment in chosen)
        raise UsageError(f"--report is the page of one design; choose one with --variant: {names}")
    with progress(options) as shown:
        plans = [*map(predict, counted(chosen, "designs", len(chosen), shown.show))]
    if options.table:
        write(options, {options.table: joint(tuple(plans)).write_to})
    is_joint = joint is not None and len(plans) > 1
    if is_joint and not options.json:
        print_lines([*str(joint(tuple(plans))).splitlines(), MORE])
    for experiment, plan in zip(chosen, plans, strict=True):
        heading = ["", plan.heading] if is_joint else [""]
        if options.report:
            with progress(options) as shown:
                text = function("page")(plan, report=shown.show)
            write(options, {options.report: text})
        if not options.json:
            if not is_joint:
                print_lines([*([""] if results else []), *plan.lines()])
            note_singular_values(options, plan.verdict)
            if options.assumptions:
                assumed = plan.assumptions
                none = ["assumptions: not evaluated; U6 is undetermined, zero or not computed"]
                print_lines([*heading, *(none if assumed is None else assumed.lines())])
        if with_trials:
            from ballplate.montecarlo.comparison_tables import trials_lines

            done = _trials(experiment, options)
            plan = replace(plan, monte_carlo=done)
            if not options.json:
                print_lines([*heading, *trials_lines(done)])
            interrupted = done.outcome is not None and done.outcome.interrupted
        results.append(plan.to_dict())
        if interrupted:
            complain(
                f"{options.interruption.word}: the results are those of the data sets done so far"
            )
            break
    if options.json:
        print_json(results)
    if interrupted:
        return int(options.interruption.status)
    return 0 if all(p.verdict.as_expected for p in plans) else 1


def _trials(experiment: Experiment, options: Namespace) -> Trials:
    from ballplate.montecarlo.experiments import MOST_TRIALS, trials
    from ballplate.simulator.computing.processes import processors

    with progress(options) as shown:

        def report(step: ProgressStep) -> None:
            options.interruption.answer()
            shown.show(step)

        return trials(
            experiment,
            options.trials or MOST_TRIALS,
            options.seed,
            options.until,
            options.workers or processors(),
            report,
        )
