"""A studio and a Chromium that Playwright drives, for the tests."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.extensions.pages.browser import program

pytest.importorskip("starlette", reason="the studio is an extra")
INSTALL = "python -m pip install 'ballplate[test,browser]', and a Chromium"
pytest.importorskip("playwright", reason=f"no browser is driven without it: {INSTALL}")

# A picture in three dimensions without a graphics card.
FLAGS = (
    "--no-sandbox",
    "--no-first-run",
    "--disable-quic",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--enable-unsafe-swiftshader",
    "--use-angle=swiftshader",
)


class Studio:
    """A studio in a process of its own; `address` has its token."""

    def __init__(self, design: Path, port: int = 0) -> None:
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


def chromium() -> str | None:
    """The Chromium of this machine, or the one that Playwright has fetched."""
    from playwright.sync_api import sync_playwright

    if found := program():
        return found
    with sync_playwright() as playwright:
        fetched = playwright.chromium.executable_path
    return fetched if Path(fetched).exists() else None


IN_BROWSER = (
    pytest.mark.browser,
    pytest.mark.skipif(chromium() is None, reason=f"no Chromium on this machine: {INSTALL}"),
)
"""Marks of tests that need a browser."""


@contextmanager
def tab(width: int = 1400, height: int = 900, touches: bool = False) -> Iterator:
    """A tab of a browser, on a touch screen or not, with `errors`, what went wrong in it, and
    `asked`, all requests.
    """
    from playwright.sync_api import sync_playwright

    path = chromium()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=list(FLAGS))
        size = {"width": width, "height": height}
        page = browser.new_context(viewport=size, has_touch=touches).new_page()
        page.errors, page.asked = [], []
        page.on("pageerror", lambda error: page.errors.append(str(error)))
        page.on(
            "console",
            lambda said: page.errors.append(said.text) if said.type == "error" else None,
        )
        page.on("request", lambda request: page.asked.append(request.url))
        page.set_default_timeout(60_000)
        yield page
        browser.close()


def opened(page, studio: Studio) -> None:
    """Open a studio's page, and wait for its design with its figures."""
    page.goto(studio.address)
    until(page, "!!window.studio?.state()?.design && !window.studio.state().pending")


def until(page, expression: str, seconds: float = 60.0) -> None:
    """Wait until an expression is true; the page's policy lets nobody evaluate texts in it."""
    end = time.monotonic() + seconds
    while not page.evaluate(expression):
        assert time.monotonic() < end, f"{expression}: {page.inner_text('#notice')}"
        page.wait_for_timeout(10)


def settled(page, revision: int) -> dict:
    """The state when the design has reached a revision, with its figures."""
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
