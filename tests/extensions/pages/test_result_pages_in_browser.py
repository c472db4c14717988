"""Pages of a fit and of a design in a browser: no error, no request, no part outside, and pictures
that turn and move as the keyboard, buttons and the person's settings say.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.pages.design_contents import page_of_design

from tests.extensions.pages.browser import Browser, assert_quiet, browser, program
from tests.extensions.pages.test_page_in_browser import CUT, OUTSIDE
from tests.extensions.pages.test_page_pictures import numbers
from tests.extensions.pages.test_result_pages import CHANGED, small

CHROMIUM = program()

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(
        CHROMIUM is None,
        reason="no Chromium on this machine; install it, or name it in BALLPLATE_CHROMIUM",
    ),
]

# All paths of a picture, and whether it is one that moves.
PATHS = "[...document.querySelectorAll('#{} svg [data-layer]')].map(one => one.getAttribute('d'))"


def paths(tab: Browser, name: str) -> list[str]:
    found: list[str] = tab.value(PATHS.format(name))
    return [one for one in found if one]


def press(tab: Browser, key: str) -> None:
    tab.ask("Input.dispatchKeyEvent", type="keyDown", key=key, code=key)


def click(tab: Browser, name: str, button: str) -> Any:
    return tab.value(f"document.querySelector('#{name} [{button}]').click()")


def prefer(tab: Browser, motion: str) -> None:
    features = [{"name": "prefers-reduced-motion", "value": motion}]
    tab.ask("Emulation.setEmulatedMedia", media="", features=features)


def test_pages_open_alone_and_pictures_turn(tmp_path: Path) -> None:
    assert CHROMIUM is not None
    experiment = small(**CHANGED["deficient"])
    design, fit = tmp_path / "design.html", tmp_path / "fit.html"
    design.write_text(page_of_design(experiment, bp.run(experiment)), encoding="utf-8")
    bp.fit(small(), bp.simulate(small(), seed=1)).report(fit)
    with browser(CHROMIUM, tmp_path) as tab:
        prefer(tab, "reduce")
        for page in (fit, design):
            for width in (400, 900, 1400):
                tab.resize(width)
                tab.open(page)
                assert tab.value(OUTSIDE) == [] and tab.value(CUT) == []
        drawn = paths(tab, "volume-view")
        press(tab, "Tab")
        tab.value("document.querySelector('#volume-view svg').focus()")
        press(tab, "ArrowRight")
        turned = paths(tab, "volume-view")
        assert turned != drawn
        press(tab, "Home")
        # The script draws what stood in the file, to its last digit.
        for name in ("volume-view", "point-view", "ball-view-0"):
            click(tab, name, "data-view=above")
            assert paths(tab, name) != drawn
            click(tab, name, "data-view=oblique")
        _assert_alike(paths(tab, "volume-view"), drawn)
        _assert_still_or_moving(tab, design)
        assert_quiet(tab)


def _assert_alike(after: list[str], before: list[str]) -> None:
    """Paths are the same but for the last digit."""
    for one, other in zip(after, before, strict=True):
        np.testing.assert_allclose(numbers(one), numbers(other), atol=0.15)


def _assert_still_or_moving(tab: Browser, design: Path) -> None:
    """A picture of a motion stands still where a person prefers that, until asked to move."""
    name = tab.value("document.querySelector('.moving').id")
    tab.value(f"document.getElementById('{name}').scrollIntoView()")
    wait = "new Promise(done => setTimeout(done, 150))"
    still = paths(tab, name)
    tab.ask("Runtime.evaluate", expression=wait, awaitPromise=True)
    assert paths(tab, name) == still
    click(tab, name, "data-play")
    tab.ask("Runtime.evaluate", expression=wait, awaitPromise=True)
    assert paths(tab, name) != still
    click(tab, name, "data-play")
    _assert_alike(paths(tab, name), still)
    prefer(tab, "no-preference")
    tab.open(design)
    pressed = f"document.querySelector('#{name} [data-play]').getAttribute('aria-pressed')"
    assert tab.value(pressed) == "true"
    tab.value("window.dispatchEvent(new Event('beforeprint'))")
    _assert_alike(paths(tab, name), still)
