"""Ctrl-C while an answer is computed or sent ends the studio with its own words."""

from __future__ import annotations

import asyncio
import logging
import sys
from contextlib import suppress
from pathlib import Path
from threading import Thread

import pytest
from ballplate.extensions.studio.serving import _is_error

from tests.extensions.studio.test_judging import begun

# A signal comes in the server's own thread while another one waits, or while it sends an answer.
SCRIPT = """
import os, signal, sys, time
from ballplate.__main__ import main
from ballplate.extensions.studio import server
from ballplate.extensions.studio.session import Session


def after(function):
    def done(*given):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(SECONDS)
        return function(*given)
    return done


PLACE = after(PLACE)
if __name__ == "__main__":
    sys.exit(main())
"""


@pytest.mark.skipif(sys.platform == "win32", reason="sends a signal of POSIX")
@pytest.mark.parametrize(("place", "seconds"), [("Session.state", 2), ("server._json", 0)])
def test_no_traceback_of_an_answer_that_is_interrupted(
    tmp_path: Path, place: str, seconds: int
) -> None:
    script = SCRIPT.replace("PLACE", place).replace("SECONDS", str(seconds))
    (tmp_path / "slow.py").write_text(script)
    process, home, opener = begun(str(tmp_path / "slow.py"), "studio", str(tmp_path / "new.yaml"))

    def ask() -> None:
        with suppress(OSError):
            opener.open(f"{home}api/state").read()

    with process:
        Thread(target=ask, daemon=True).start()
        try:
            told = process.communicate(timeout=60)[1]
        finally:
            process.kill()
    assert process.returncode == 130
    assert "interrupted" in told and "Traceback" not in told and "Error" not in told


def test_an_answer_that_ends_with_the_studio_is_no_error() -> None:
    for error in (None, ValueError(), KeyboardInterrupt(), asyncio.CancelledError()):
        record = logging.makeLogRecord({"exc_info": error and (type(error), error, None)})
        assert _is_error(record) == isinstance(error, ValueError | None)
