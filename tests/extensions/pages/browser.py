"""A Chromium that Playwright drives, for the tests."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser

INSTALL = "python -m pip install 'ballplate[test,browser]', and a Chromium"
pytest.importorskip("playwright", reason=f"no browser is driven without it: {INSTALL}")

PROGRAMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")

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


@cache
def chromium() -> str | None:
    """The Chromium of this machine, which BALLPLATE_CHROMIUM may name, or the one that Playwright
    has fetched.
    """
    from playwright.sync_api import sync_playwright

    named = os.environ.get("BALLPLATE_CHROMIUM")
    if found := named or next(filter(None, map(shutil.which, PROGRAMS)), None):
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
    page.errors, page.asked = [], []
    page.on("pageerror", lambda error: page.errors.append(str(error)))
    page.on("console", lambda said: page.errors.append(said.text) if said.type == "error" else None)
    page.on("request", lambda request: page.asked.append(request.url))
    page.set_default_timeout(60_000)
    yield page
    context.close()


@contextmanager
def tab(width: int = 1400, height: int = 900) -> Iterator:
    """A tab of a browser of its own."""
    with chrome() as browser, new_tab(browser, width, height) as page:
        yield page
