"""Pages of a sweep, a fit and a design in a browser: they open without errors, ask no network for
anything, and fit small screens.
"""

from __future__ import annotations

from pathlib import Path

import ballplate as bp
import pytest
from ballplate.extensions.pages.design_contents import page_of_design

from tests.extensions.pages import wording
from tests.extensions.pages.browser import assert_quiet, browser, program
from tests.extensions.pages.test_result_pages import CHANGED, small

CHROMIUM = program()

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(
        CHROMIUM is None,
        reason="no Chromium on this machine; install it, or name it in BALLPLATE_CHROMIUM",
    ),
]

# Elements that stick out of the page, other than inside parts that scroll by themselves.
OUTSIDE = """[...document.querySelectorAll('body *')].filter(one => !one.closest('.scroll, svg, .skip') &&
one.getBoundingClientRect().right > document.documentElement.clientWidth + 1).map(one => one.outerHTML.slice(0, 80))"""

# Labels of pictures that stand out of these.
CUT = """[...document.querySelectorAll('svg')].flatMap(svg => {
  const box = svg.getBoundingClientRect();
  return [...svg.querySelectorAll('text')].filter(text => {
    const one = text.getBoundingClientRect();
    return one.width && (one.left < box.left - 1 || one.right > box.right + 1
      || one.top < box.top - 1 || one.bottom > box.bottom + 1);
  }).map(text => text.textContent);
})"""


def test_pages_open_alone(plate_sizes_page: Path, tmp_path: Path) -> None:
    assert CHROMIUM is not None
    experiment = small(**CHANGED["deficient"])
    design, fit = tmp_path / "design.html", tmp_path / "fit.html"
    design.write_text(page_of_design(experiment, bp.run(experiment)), encoding="utf-8")
    bp.fit(small(), bp.simulate(small(), seed=1)).report(fit)
    with browser(CHROMIUM, tmp_path) as tab:
        for page in (fit, design, plate_sizes_page):
            tab.open(page)
            for width in (360, 900, 1400):
                tab.resize(width)
                assert tab.value(OUTSIDE) == [] and tab.value(CUT) == [], (page, width)
        assert tab.value("document.title") == wording.SIZE_OF_THE_PLATE_AND_NUMBER
        assert tab.value("document.querySelectorAll('figure').length") == 2
        assert (
            tab.value("getComputedStyle(document.querySelector('svg.chart path.line')).stroke")
            != "none"
        )
        colours = []
        for scheme in ("light", "dark"):
            tab.ask(
                "Emulation.setEmulatedMedia",
                features=[{"name": "prefers-color-scheme", "value": scheme}],
            )
            colours.append(tab.value("getComputedStyle(document.body).backgroundColor"))
        assert colours[0] == "rgb(255, 255, 255)" and colours[1] != colours[0]
        # The skip link is the first thing that the keyboard reaches, and shows itself then.
        tab.value("document.querySelector('.skip').focus()")
        assert tab.value("document.querySelector('.skip').getBoundingClientRect().left") >= 0
        tab.ask("Emulation.setEmulatedMedia", media="print", features=[])
        assert (
            tab.value("getComputedStyle(document.querySelector('.scroll')).overflowX") == "visible"
        )
        assert_quiet(tab)
