"""The command `ballplate`. Data goes to standard output, everything else to standard error."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence

from . import check, compare, fit, init, run, schema, simulate

AS_EXPECTED, NOT_AS_EXPECTED, USAGE, BAD_FILE = 0, 1, 2, 3


def parser() -> argparse.ArgumentParser:
    """The command line's grammar."""
    top = argparse.ArgumentParser(
        prog="ballplate",
        description="Plan and evaluate ball-plate experiments for co-ordinate measuring machines.",
        epilog="Exit status: 0 as expected, 1 not as expected, 2 wrong usage, 3 a file that cannot be used.",
    )
    top.add_argument("--version", action="version", version=_version())
    commands = top.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for module in (check, run, simulate, fit, compare, schema, init):
        module.add_parser(commands)
    return top


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status."""
    options = parser().parse_args(arguments)
    # Loaded only now, so that --help and wrong usage answer at once.
    from simulator.experiment.messages import ExperimentError

    try:
        status = int(options.run(options))
        sys.stdout.flush()
        return status
    except ExperimentError as error:
        print(error, file=sys.stderr)
        return BAD_FILE
    except BrokenPipeError:
        # The reader has gone; say nothing, and keep the interpreter from flushing into the closed pipe.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return AS_EXPECTED
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130


def _version() -> str:
    """Version of the distribution, looked up only when asked for."""

    class Lazy(str):
        def __str__(self) -> str:
            from importlib.metadata import version

            return f"ballplate {version('ballplate')}"

        def __mod__(self, other: object) -> str:
            return str(self)

    return Lazy("ballplate")
