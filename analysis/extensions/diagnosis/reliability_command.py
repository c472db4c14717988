"""`ballplate run --reliability`: print minimal detectable biases of a design, and their effects."""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError, Namespace

from ballplate.cli import (
    UsageError,
    add_file,
    add_force,
    add_json,
    add_output,
    experiments,
    number,
    print_json,
    print_lines,
    progress,
    write,
)

DESCRIPTION = (
    "Compute the redundancy of every observation of a design, the smallest biases of"
    " readings, certificates, probes and positions that a test of the residuals finds,"
    " and the effect of a bias just too small to be found on the error function (U4) and"
    " on distances between balls (U5) and between corrected points (U6)."
)


def add_options(parser: ArgumentParser) -> None:
    add_file(parser, several=True)
    parser.add_argument(
        "--false-alarm",
        metavar="0.1%",
        type=_share,
        default=0.001,
        help="significance level of the test of one bias; default 0.1%%",
    )
    parser.add_argument(
        "--power",
        metavar="80%",
        type=_share,
        default=0.8,
        help="probability of detecting a bias of the size of the MDB; default 80%%",
    )
    parser.add_argument(
        "--sigma",
        choices=("estimated", "given"),
        help=(
            "test against sigma estimated from the residuals, or the stated uncertainties; default:"
            " the file's choice"
        ),
    )
    add_output(
        parser,
        "-o",
        "--output",
        metavar="FILE",
        help="write a row for every bias",
    )
    add_force(parser)
    add_json(parser)


def _share(text: str) -> float:
    from .power import LEAST_CHANCE, MOST_CHANCE

    value = number(text, "%") / 100.0
    if not text.endswith("%") or not LEAST_CHANCE <= value <= MOST_CHANCE:
        raise ArgumentTypeError(
            f'expected a percentage between 0% and 100%, such as 0.1%, not "{text}"'
        )
    return value


def run(options: Namespace) -> int:
    """Print the reliability of all experiments of the files."""

    from .redundancy import reliability

    if options.power <= options.false_alarm:
        raise UsageError("--power must be above --false-alarm; any test has at least that power")
    chosen = experiments(options)
    if options.output is not None and len(chosen) > 1:
        names = ", ".join(str(experiment.name or experiment.label) for experiment in chosen)
        raise UsageError(
            f"-o writes the table of one experiment; choose one with --variant: {names}"
        )
    results = []
    for k, experiment in enumerate(chosen):
        with progress(options) as shown:
            result = reliability(
                experiment, options.false_alarm, options.power, options.sigma, shown.show
            )
        if options.output is not None:
            write(options, {options.output: result.to_csv})
        if options.json:
            results.append(result.to_dict())
        else:
            print_lines([*([""] if k else []), *result.lines()])
    if options.json:
        print_json(results)
    return 0
