"""Pages of a fit and of a design in a browser: no error, no request, no part outside."""

from __future__ import annotations

from pathlib import Path

import ballplate as bp
import pytest
from ballplate.extensions.pages.design_contents import page_of_design

from tests.extensions.pages.browser import assert_quiet, browser, program
from tests.extensions.pages.test_page_in_browser import CUT, OUTSIDE
from tests.extensions.pages.test_result_pages import CHANGED, small

CHROMIUM = program()

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(
        CHROMIUM is None,
        reason="no Chromium on this machine; install it, or name it in BALLPLATE_CHROMIUM",
    ),
]


def test_pages_open_alone(tmp_path: Path) -> None:
    assert CHROMIUM is not None
    experiment = small(**CHANGED["deficient"])
    design, fit = tmp_path / "design.html", tmp_path / "fit.html"
    design.write_text(page_of_design(experiment, bp.run(experiment)), encoding="utf-8")
    bp.fit(small(), bp.simulate(small(), seed=1)).report(fit)
    with browser(CHROMIUM, tmp_path) as tab:
        for page in (fit, design):
            for width in (400, 900, 1400):
                tab.resize(width)
                tab.open(page)
                assert tab.value(OUTSIDE) == [] and tab.value(CUT) == []
        assert_quiet(tab)
