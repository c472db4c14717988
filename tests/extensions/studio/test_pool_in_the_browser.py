"""A pool that a person makes, limits and plans from in the studio, in a real browser."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from ballplate.designs import shipped

from tests.extensions.studio.chromium import IN_BROWSER, Studio, opened, settled, tab, until

pytestmark = [*IN_BROWSER, pytest.mark.slow]

DRAWN = "['outlines', 'boxes'].map((name) => window.studio.view[name].length)"


@pytest.fixture
def page(tmp_path: Path) -> Iterator:
    path = tmp_path / "plate.yaml"
    path.write_bytes(Path(shipped("quickstart.yaml")).read_bytes())
    with Studio(path) as studio, tab() as page:
        opened(page, studio)
        yield page
        assert page.errors == []


def fields(page, field: str, text: str) -> None:
    page.fill(field, text)
    page.press(field, "Tab")


def test_a_pool_is_filled_limited_and_planned_from(page):
    before = page.evaluate("window.studio.state().text")
    page.click("#pool summary")
    page.wait_for_selector("#pool-said >> text=No candidates yet")
    for plane in ("x", "y"):
        page.uncheck(f"[aria-label='fill planes across {plane}']")
    fields(page, "#turns", "0")
    fields(page, "#count", "4")
    page.click("#fill")
    page.wait_for_selector("#pool-said >> text=64 candidates")
    until(page, f"{DRAWN}.join() === '64,0'")
    for axis in "xyz":
        page.select_option(f"#forbidding [name={axis}]", "high")
    page.click("#forbid")
    page.wait_for_selector("#pool-said >> text=in a forbidden box")
    until(page, f"{DRAWN}[1] === 1")
    # All of it is in a form, where the box is changed and removed.
    page.click("#forms [data-section=pool] > summary")
    fields(page, """[data-path='["pool","limits","forbidden",0,"z"]']""", "[0 mm, 400 mm]")
    text = settled(page, 3)["text"]
    assert text.count("z: [0 mm, 400 mm]") == 1, text
    page.wait_for_selector("#pool-said >> text=9 in a forbidden box")
    page.click("#forms [data-section=pool] [aria-label^='remove forbidden 1']")
    page.wait_for_selector("#pool-said >> text=64 candidates")
    # Stopped, the plan is the best so far; applied, it is one step.
    fields(page, "#hours", "8")
    page.click("#plan")
    page.wait_for_selector("#jobs .step >> text=best U6", timeout=200_000)
    page.click("#jobs button >> text=stop")
    page.wait_for_selector("#suggestions li >> text=the plan", timeout=200_000)
    filled = page.evaluate("window.studio.state().text")
    page.click("#suggestions [data-apply]")
    assert "enabled: false" in settled(page, 5)["text"]
    page.click("#undo")
    assert settled(page, 6)["text"] == filled
    for revision in range(7, 11):
        page.click("#undo")
        last = settled(page, revision)["text"]
    assert last == before
