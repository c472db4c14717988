"""Ctrl-C while an answer is under way ends the studio with its own words."""

from __future__ import annotations

import signal
import subprocess
import sys
import urllib.request
from contextlib import suppress
from http.cookiejar import CookieJar
from pathlib import Path
from threading import Thread

import pytest

SLOW = """
import sys, time
from ballplate.extensions.studio.session import Session

state = Session.state


def slow(session, *given):
    print("asked", file=sys.stderr, flush=True)
    time.sleep(2)
    return state(session, *given)


Session.state = slow
from ballplate.__main__ import main

if __name__ == "__main__":
    sys.exit(main())
"""


@pytest.mark.skipif(sys.platform == "win32", reason="sends a signal of POSIX")
def test_no_traceback_of_an_answer_that_is_interrupted(tmp_path: Path) -> None:
    (tmp_path / "slow.py").write_text(SLOW)
    words = [sys.executable, "slow.py", "studio", "new.yaml", "--no-browser"]
    with subprocess.Popen(
        words,
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # A shell starts what runs in the background with this signal ignored.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as process:
        assert process.stdout is not None and process.stderr is not None
        address = process.stdout.readline().strip()
        opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(CookieJar()))
        opener.open(address).read()

        def ask() -> None:
            with suppress(OSError):
                opener.open(f"{address.partition('?')[0]}api/state").read()

        Thread(target=ask, daemon=True).start()
        while process.stderr.readline() != "asked\n":
            assert process.poll() is None
        process.send_signal(signal.SIGINT)
        told = process.communicate(timeout=60)[1]
    assert process.returncode == 130
    assert "interrupted" in told and "Traceback" not in told and "Error" not in told
