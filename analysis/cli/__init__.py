"""The command `ballplate`. Data goes to standard output, everything else to standard error."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Sequence

from .interruption import interruptions

AS_EXPECTED, NOT_AS_EXPECTED, USAGE, BAD_FILE, INTERNAL, INTERRUPTED = 0, 1, 2, 3, 70, 130


def parser() -> argparse.ArgumentParser:
    """The command line's grammar."""
    # Loaded only now, so that hardly anything is when an interruption begins to be answered.
    from . import (
        check,
        compare,
        export,
        fit,
        init,
        lengths,
        map,
        plan,
        reach,
        reliability,
        report,
        reproduce,
        run,
        schema,
        simulate,
        spline,
        sweep,
    )

    top = argparse.ArgumentParser(
        prog="ballplate",
        description="Plan and evaluate ball-plate experiments for co-ordinate measuring machines.",
        epilog="Exit status: 0 as expected, 1 not as expected, 2 wrong usage, 3 a file that cannot be used.",
    )
    top.add_argument("--version", action=_Version, nargs=0, help="print the version and leave")
    commands = top.add_subparsers(title="commands", metavar="COMMAND", required=True)
    experiments = (check, run, plan, reach, lengths, reliability, simulate, fit, compare, sweep, export, report)
    for module in (*experiments, map, spline, reproduce, schema, init):
        module.add_parser(commands)
    return top


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status."""
    try:
        with interruptions() as answer:
            return _main(arguments, answer)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return INTERRUPTED


def _main(arguments: Sequence[str] | None, answer_interruption: Callable[[], None]) -> int:
    if sys.stdout is None:
        sys.stdout = open(os.devnull, "w")  # noqa: SIM115
    options = parser().parse_args(arguments)
    options.answer_interruption = answer_interruption
    # Loaded only now, so that --help and wrong usage answer at once.
    from ballplate.simulator.experiment.messages import ExperimentError

    from ..internal_error import InternalError

    try:
        status = int(options.run(options))
        sys.stdout.flush()
        return status
    except ExperimentError as error:
        print(error, file=sys.stderr)
        return BAD_FILE
    except InternalError as error:
        print(f"internal error: {error}. Please report it with the file and the command.", file=sys.stderr)
        return INTERNAL
    except BrokenPipeError:
        # The reader has gone; say nothing, and keep the interpreter from flushing into the closed pipe.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return AS_EXPECTED
    except OSError as error:
        print(f"standard output: cannot be written ({error.strerror}); give it room", file=sys.stderr)
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BAD_FILE


class _Version(argparse.Action):
    """Looks the version up only when asked for it."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from importlib.metadata import version

        print(f"ballplate {version('ballplate')}")
        parser.exit()
