"""A studio and a Chromium that Playwright drives, for the tests."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.extensions.pages.browser import program

if TYPE_CHECKING:
    from playwright.sync_api import Browser

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
def chrome() -> Iterator[Browser]:
    """A browser without a tab."""
    from playwright.sync_api import sync_playwright

    path = chromium()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=list(FLAGS))
        yield browser
        browser.close()


@contextmanager
def new_tab(browser: Browser, width: int = 1400, height: int = 900) -> Iterator:
    """A tab of a browser with `errors`, what went wrong in it, and `asked`, all requests."""
    context = browser.new_context(viewport={"width": width, "height": height})
    page = context.new_page()
    page.errors, page.asked, page.before = [], [], 0
    page.on("pageerror", lambda error: page.errors.append(str(error)))
    page.on(
        "console",
        lambda said: page.errors.append(said.text) if said.type == "error" else None,
    )
    page.on("request", lambda request: page.asked.append(request.url))
    page.set_default_timeout(60_000)
    yield page
    context.close()


@contextmanager
def tab(width: int = 1400, height: int = 900) -> Iterator:
    """A tab of a browser of its own."""
    with chrome() as browser, new_tab(browser, width, height) as page:
        yield page


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
    revision += page.before
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
