"""A studio in a process of its own and its page in a browser, for the tests."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytest.importorskip("starlette", reason="the studio is an extra")


class Studio:
    """A studio in a process of its own; `address` has its token."""

    def __init__(self, design: Path, port: int = 0) -> None:
        self.design = design
        command = [sys.executable, "-m", "ballplate", "studio", str(design), "--no-browser"]
        self.process = subprocess.Popen(
            [*command, "--port", str(port)],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        assert self.process.stdout is not None
        self.address = self.process.stdout.readline().strip()
        assert self.address.startswith("http://127.0.0.1:")

    @property
    def port(self) -> int:
        return int(self.address.split(":")[2].split("/")[0])

    def __enter__(self) -> Studio:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def end(self, number: int = signal.SIGTERM) -> None:
        if self.process.poll() is None:
            self.process.send_signal(number)
        self.process.wait(30)
        self.process.stdout.close()


def opened(page, studio: Studio) -> None:
    """Open a studio's page, and wait for its design with its figures."""
    page.goto(studio.address)
    until(page, "!!window.studio?.state()?.design && !window.studio.state().pending")


def opened_anew(page, studio: Studio) -> None:
    """Open a studio's page with the text of its file and no computation, whatever an earlier test
    has done; revisions that are waited for count from here.
    """
    home, asks = studio.address.partition("?")[0], page.request
    asks.get(studio.address)
    for job in asks.get(f"{home}api/jobs").json():
        asks.post(f"{home}api/stop", data={"id": job["id"]})
    text = studio.design.read_text("utf-8")
    if asks.get(f"{home}api/state").json()["text"] != text:
        asks.post(f"{home}api/do", data={"do": "text", "text": text})
    opened(page, studio)
    page.before = page.evaluate("window.studio.state().revision")


def until(page, expression: str, seconds: float = 60.0) -> None:
    """Wait until an expression is true; the page's policy lets nobody evaluate texts in it."""
    end = time.monotonic() + seconds
    while not page.evaluate(expression):
        assert time.monotonic() < end, f"{expression}: {page.inner_text('#notice')}"
        page.wait_for_timeout(10)


def settled(page, revision: int) -> dict:
    """The state when the design has been changed so many times, with its figures."""
    revision += getattr(page, "before", 0)
    until(page, f"window.studio?.state()?.revision >= {revision} && !window.studio.state().pending")
    return page.evaluate("window.studio.state()")


# Where a plate, or a point in metres, is on the screen.
SPOT = """(what) => { const { view } = window.studio;
const { left, top } = view.svg.getBoundingClientRect();
const [x, y] = view.pixel(typeof what === 'string' ? view.named(what).middle : what);
return [left + x, top + y]; }"""


def spot(page, what: list[float] | str) -> tuple[float, float]:
    """The pixels of a plate by its name, or of a point in metres."""
    x, y = page.evaluate(SPOT, what)
    return x, y
