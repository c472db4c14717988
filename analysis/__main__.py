"""`python -m ballplate`, the same as the command `ballplate`.

Signals are answered from the first line on, while what answers them later is loaded.
"""

from __future__ import annotations

import gc
import os
import signal
import sys

from ballplate.simulator.computing.signals import ANSWERS, SAFE_PATH

# Objects made between two searches for garbage. What a command loads stays, some hundred thousand
# objects, and to search all of it again and again takes a tenth of a short command's time.
OBJECTS_BETWEEN_SEARCHES = 150_000


def _leave(number: int, _: object) -> None:
    status, word = ANSWERS[signal.Signals(number).name]
    os.write(2, f"{word}\n".encode())
    os._exit(status)


def main() -> int:
    """Run the command and return its exit status."""
    # For every process that the command or a library starts, by whatever method.
    os.environ[SAFE_PATH] = "1"
    gc.set_threshold(OBJECTS_BETWEEN_SEARCHES)
    for name in ANSWERS:
        number = getattr(signal, name, None)
        if number and signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
            signal.signal(number, _leave)
    from .cli.dispatch import internal_error, main as command

    try:
        return command()
    except Exception as error:
        # Status 1, which Python gives, is that of a design that is not as expected.
        import traceback

        traceback.print_exc()
        return internal_error(f"{type(error).__name__}: {error}")
    finally:
        # Python searches all objects for garbage at its end, when all of them go anyway.
        gc.freeze()


if __name__ == "__main__":
    sys.exit(main())
