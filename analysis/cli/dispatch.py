"""The command `ballplate`, from its arguments to its exit status."""

from __future__ import annotations

import argparse
import os
import signal
import sys
import threading
from collections.abc import Sequence

from ballplate.simulator.computing.signals import ANSWERS
from ballplate.simulator.inputs.extensions import fault_of, registered
from ballplate.simulator.inputs.unusable import UnusableError

from .commands import tell_of_extensions
from .notes import told
from .outputs import UsageError, check_outputs
from .parsers import grammar, parser, with_command
from .streams import Interruption, StandardOutputError, lasting_streams

USAGE, BAD_FILE, INTERNAL = 2, 3, 70


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status; without arguments, that of the process itself."""
    interruption = Interruption()
    before = {}
    if threading.current_thread() is threading.main_thread():
        numbers = [getattr(signal, name) for name in ANSWERS if hasattr(signal, name)]
        # Shells start processes in the background with signals ignored.
        heard = [number for number in numbers if signal.getsignal(number) is not signal.SIG_IGN]
        before = {number: signal.signal(number, interruption.handle) for number in heard}
    try:
        status = _main(arguments, interruption)
    except (KeyboardInterrupt, Exception) as error:
        # What fails after a signal does so because of it.
        if not interruption.came and isinstance(error, Exception):
            raise
        interruption.tell()
        status = interruption.status
    if arguments is None and interruption.came:
        # The interpreter's own end would wait for running work. Workers end with their parent.
        os._exit(status)
    for number, handler in before.items():
        signal.signal(number, handler)
    return status


def _main(arguments: Sequence[str] | None, interruption: Interruption) -> int:
    with lasting_streams():
        try:
            words = sys.argv[1:] if arguments is None else arguments
            # The grammar of all commands is needed only where none is named.
            if not words:
                parser(with_options=False).print_help(sys.stderr)
                return USAGE
            words = with_command(words)
            try:
                options = grammar(words[0]).parse_args(words)
            except UnusableError as error:
                print(f"ballplate {words[0]}: {error}", file=sys.stderr)
                return USAGE
            except SystemExit:
                # Help is data, too.
                sys.stdout.flush()
                raise
            options.interruption = interruption
            status = _run(options)
            if registered.cache_info().currsize:
                tell_of_extensions()
            sys.stdout.flush()
            return status
        except StandardOutputError as error:
            print(f"standard output: cannot be written ({error}); give it room", file=sys.stderr)
            return BAD_FILE


def _run(options: argparse.Namespace) -> int:
    # Loaded only now, so that --help and wrong usage answer at once.
    from concurrent.futures import BrokenExecutor

    from ballplate.simulator.computing.failures import InternalError, want_of_memory
    from ballplate.simulator.inputs.messages import ExperimentError, in_one_line

    try:
        check_outputs(options)
        options.is_written = True
        with told(options):
            status = int(options.run(options))
        return status if options.is_written else BAD_FILE
    except UsageError as error:
        print(in_one_line(f"ballplate {options.command}: {error}"), file=sys.stderr)
        return USAGE
    except ExperimentError as error:
        from .notes import print_errors

        print_errors(error.messages, options)
        return BAD_FILE
    except UnusableError as error:
        print(error, file=sys.stderr)
        return BAD_FILE
    except InternalError as error:
        return internal_error(error)
    except Exception as error:
        from ballplate.simulator.inputs.extensions import missing

        if (gone := missing(error)) is not None:
            print(f"ballplate {options.command}: {gone}", file=sys.stderr)
            return BAD_FILE
        if isinstance(error, BrokenExecutor):
            text = "a worker process was ended from outside, as a rule because memory ran short"
            print(f"ballplate {options.command}: {text}; use fewer --workers", file=sys.stderr)
            return BAD_FILE
        if (want := want_of_memory(error)) is not None:
            text = f"ballplate {options.command} {want}; make the design smaller, or use fewer"
            print(f"{text} --workers", file=sys.stderr)
            return BAD_FILE
        if isinstance(error, RuntimeError) and "Symlink loop" in str(error):
            print(f"{in_one_line(str(error))}; name a file", file=sys.stderr)
            return BAD_FILE
        if isinstance(error, OSError):
            print(in_one_line(_told(error, options)), file=sys.stderr)
            return BAD_FILE
        if (fault := fault_of(error)) is not None:
            print(in_one_line(fault), file=sys.stderr)
            return BAD_FILE
        raise


def internal_error(error: object) -> int:
    """Report an error of the program itself; return the exit status."""
    text = f"internal error: {error}. Please report it with the file and the command."
    print(text, file=sys.stderr)
    return INTERNAL


def _told(error: OSError, options: argparse.Namespace) -> str:
    """Return the system's refusal, with its file if known."""
    try:
        os.getcwd()
    except FileNotFoundError:
        return (
            f"ballplate {options.command}: the current folder no longer exists; change to another"
        )
    where = error.filename or f"ballplate {options.command}"
    return (
        f"{where}: cannot be used ({error.strerror or error}); check the name, the permissions and"
        " the room there"
    )
