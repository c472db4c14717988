"""Pages of a sweep, a fit and a design in a browser: they open without errors, ask no network for
anything, and fit small screens.
"""

from __future__ import annotations

from pathlib import Path

import ballplate as bp
from ballplate.extensions.pages.design_contents import page_of_design

from tests.extensions.pages import wording
from tests.extensions.pages.browser import IN_BROWSER, tab
from tests.extensions.pages.test_result_pages import CHANGED, small

pytestmark = list(IN_BROWSER)

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
    experiment = small(**CHANGED["deficient"])
    design, fit = tmp_path / "design.html", tmp_path / "fit.html"
    design.write_text(page_of_design(experiment, bp.run(experiment)), encoding="utf-8")
    bp.fit(small(), bp.simulate(small(), seed=1)).report(fit)
    with tab() as page:
        for file in (fit, design, plate_sizes_page):
            page.goto(file.resolve().as_uri())
            for width in (360, 900, 1400):
                page.set_viewport_size({"width": width, "height": 900})
                assert page.evaluate(OUTSIDE) == [] and page.evaluate(CUT) == [], (file, width)
        assert page.title() == wording.SIZE_OF_THE_PLATE_AND_NUMBER
        assert page.locator("figure").count() == 2
        line = "getComputedStyle(document.querySelector('svg.chart path.line')).stroke"
        assert page.evaluate(line) != "none"
        colours = []
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme)
            colours.append(page.evaluate("getComputedStyle(document.body).backgroundColor"))
        assert colours[0] == "rgb(255, 255, 255)" and colours[1] != colours[0]
        # The skip link is the first thing that the keyboard reaches, and shows itself then.
        page.keyboard.press("Tab")
        assert page.evaluate("document.activeElement.matches('.skip')")
        assert page.locator(".skip").bounding_box()["x"] >= 0
        page.emulate_media(media="print")
        overflow = "getComputedStyle(document.querySelector('.scroll')).overflowX"
        assert page.evaluate(overflow) == "visible"
        assert page.errors == []
        assert all(url.startswith(("file:", "data:")) for url in page.asked)
