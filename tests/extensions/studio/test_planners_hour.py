"""A planner's hour in the studio: what a person does with the mouse and the keyboard, in a real
browser.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import ballplate as bp
import pytest

from tests.extensions.pages.browser import IN_BROWSER, new_tab
from tests.extensions.studio import wording
from tests.extensions.studio.chromium import Studio, settled, spot, until
from tests.extensions.studio.small import SMALL

pytestmark = [*IN_BROWSER, pytest.mark.slow]

# Nothing sticks out of the page, other than inside parts that scroll by themselves.
OUTSIDE = """[...document.querySelectorAll('body *')].filter(one =>
!one.closest('pre, .balls, .scrolled, dialog, textarea') && one.getClientRects().length &&
one.getBoundingClientRect().right > document.documentElement.clientWidth + 1)
.map(one => one.outerHTML.slice(0, 90))"""


FEW = "".join(
    line
    for line in SMALL.splitlines(keepends=True)
    if not any(f"name: {name}," in line for name in ("z high", "x low", "x high", "y high"))
)
"""The quickstart's plate in too few positions."""


@pytest.fixture
def few(tmp_path: Path) -> Path:
    path = tmp_path / "plate.yaml"
    path.write_text(FEW)
    return path


def drag(page, name: str, by: tuple[int, int], steps: int = 5) -> None:
    x, y = spot(page, name)
    page.mouse.move(x, y)
    page.mouse.down()
    for k in range(1, steps + 1):
        page.mouse.move(x + by[0] * k / steps, y + by[1] * k / steps)
        page.wait_for_timeout(30)
    page.mouse.up()


# In one piece: an hour in its order.
def test_an_hour(browser, few: Path) -> None:
    with Studio(few) as studio, new_tab(browser) as page:
        page.goto(studio.address)
        until(page, "!!window.studio?.state()?.design")
        assert "Rank deficiency" in page.inner_text("#verdict")
        assert "All distances are undetermined." in page.inner_text("#verdict")
        # What is undetermined moves: the picture changes by itself.
        page.wait_for_selector("[data-motion='0'][aria-pressed='true']")
        until(page, "!!window.studio.view.motions")
        drawn = "document.querySelector('#view').innerHTML"
        page.evaluate("window.drawn = " + drawn)
        until(page, f"window.drawn !== {drawn}")
        # And rests when it is stopped.
        page.click("[data-motion='0']")
        until(page, "!window.studio.view.motions && !window.studio.view.next")
        page.wait_for_timeout(300)
        still = page.evaluate(drawn)
        page.wait_for_timeout(400)
        assert page.evaluate(drawn) == still
        # A row of errors by positions that is pointed at swings with what hides it.
        page.click("#errors summary")
        page.hover("#matrix tr.hidden-error >> nth=-1")
        until(page, "!!window.studio.view.motions")
        assert page.locator("#matrix thead th button").count() == 2
        named = page.locator("#matrix tbody button").first
        assert ": undetermined" in named.get_attribute("aria-label")
        page.click("#matrix thead th button >> nth=1")
        assert page.evaluate("window.studio.view.selected") == "y low"
        # A suggestion is shown where it would stand, and applied.
        page.click("[data-job=suggest]")
        page.wait_for_selector("#suggestions li")
        page.click("#suggestions [data-apply] >> nth=0")
        settled(page, 1)
        assert "Full rank" in page.inner_text("#verdict")
        # The map of lengths comes after the figures, on three levels of the volume.
        until(page, "window.studio.view.sheets.length === 3")
        # A plate is dragged, and one is added.
        before = page.evaluate("window.studio.state().design.scene.positions[0].origin")
        page.click("#positions button.name >> nth=0")
        drag(page, "z low", (20, -45))
        after = settled(page, 2)["design"]["scene"]["positions"][0]["origin"]
        assert after != before and after[2] == before[2]
        count = len(page.evaluate("window.studio.state().design.scene.positions"))
        page.click("[data-job=next]")
        page.wait_for_selector("#suggestions li")
        page.click("#suggestions [data-apply] >> nth=0")
        state = settled(page, 3)
        assert len(state["design"]["scene"]["positions"]) == count + 1
        # A wrong value in a form is told beside it; undo takes it back.
        page.click("#forms summary >> text=machine")
        field = page.locator('#forms input[data-path=\'["machine","repeatability"]\']')
        field.fill("0.2 furlongs")
        field.press("Enter")
        settled(page, 4)
        page.wait_for_selector("#forms .field-error")
        assert page.locator("#forms .field-error").count() == 1
        assert "text cannot be evaluated" in page.inner_text("#verdict")
        page.click("#undo")
        settled(page, 5)
        assert "Full rank" in page.inner_text("#verdict")
        # What is assumed is folded.
        page.wait_for_selector("#assumptions:not(.stale)")
        assert "times as large" in page.inner_text("#rests")
        page.click("#assumptions summary")
        rows = page.locator("#assumptions tbody tr")
        assert rows.count() > 1 + 3
        # Saved, the file says what the page says.
        page.keyboard.press("Control+s")
        until(page, "window.studio.state().saved")
        lengths = next(
            one
            for one in page.evaluate("window.studio.state().design.quantities")
            if one["symbol"] == "U6"
        )
        predicted = bp.run(few).quantities["U6"]
        assert lengths["average"] == predicted.average
        command = [sys.executable, "-m", "ballplate", "check", str(few)]
        checked = subprocess.run(command, capture_output=True, text=True)
        assert checked.returncode == 0 and "full rank" in checked.stdout, checked
        # What another program writes meanwhile is not overwritten.
        page.click("#positions button.name >> nth=0")
        page.click("#turn")
        until(page, "!window.studio.state().saved")
        written = few.read_bytes() + b"# another hand\n"
        few.write_bytes(written)
        page.click("#save")
        page.wait_for_selector("#notice.bad")
        assert wording.HAS_CHANGED_ON_DISK in page.inner_text("#notice")
        assert few.read_bytes() == written
        # Nor is the other window's design: this one shows it, and asks again.
        with page.context.new_page() as other:
            other.goto(f"http://127.0.0.1:{studio.port}/")
            until(other, "!!window.studio?.state()?.design")
            seen = other.evaluate("window.studio.state().revision")
            other.click("#positions button.name >> nth=1")
            other.click("#turn")
            theirs = settled(other, seen + 1)
        page.evaluate("window.studio.act({do: 'turn', position: 'z low'})")
        assert "another window" in page.inner_text("#notice")
        assert page.evaluate("window.studio.state()")["text"] == theirs["text"]
        page.reload()
        until(page, "!!window.studio?.state()?.design")
        page.click("#undo")
        unsaved = settled(page, theirs["revision"] + 1)["text"]
        assert unsaved != theirs["text"]
        # The server is killed: the page says so, and nothing that was done is lost.
        studio.end(9)
        page.click("#positions button.name >> nth=0")
        page.click("#turn")
        until(page, "document.querySelector('#notice').textContent.includes('Start it again')")
        assert all("ERR_CONNECTION" in one for one in page.errors)
        with Studio(few, studio.port) as again:
            page.wait_for_timeout(2500)
            # It is another studio, which knows this page no more until its address is opened.
            assert "with its token" in page.inner_text("#notice")
            page.errors.clear()
            page.goto(again.address)
            until(page, "!!window.studio?.state()?.design")
            assert "Full rank" in page.inner_text("#verdict")
            assert wording.NOT_SAVED_IN_AN_EARLIER_SESSION in page.inner_text("#notice")
            assert page.evaluate("window.studio.state().text") == unsaved
            page.click("#save")
            page.wait_for_selector("#notice.bad")
            assert wording.HAS_CHANGED_ON_DISK in page.inner_text("#notice")
            page.click("#toggle-text")
            page.click("#reopen")
            until(page, "window.studio.state().saved")
            assert page.evaluate("window.studio.state().text").endswith("# another hand\n")
            assert page.errors == [] and "token" not in page.url
            home = again.address.split("?")[0]
        assert all(url.startswith((home, "data:")) for url in page.asked)


@pytest.mark.long
def test_the_keyboard_is_enough(page) -> None:
    """Who works without a mouse stays where he was, though parts of the page are made anew."""

    def reach(selector: str) -> None:
        for _ in range(150):
            page.keyboard.press("Tab")
            if page.evaluate("([s]) => document.activeElement.matches(s)", [selector]):
                return
        raise AssertionError(f"no {selector} by the Tab key")

    def press(key: str) -> dict:
        revision = page.evaluate("window.studio.state().revision") - page.before
        page.keyboard.press(key)
        return settled(page, revision + 1)

    at = "document.activeElement.getAttribute('aria-label') || document.activeElement.id"
    reach("#positions button.name")
    page.keyboard.press("Enter")
    assert page.evaluate(at) == "choose z low"
    reach("#turn")
    turned = press("Enter")["text"]
    assert page.evaluate(at) == "turn"
    assert press("Enter")["text"] != turned and page.evaluate(at) == "turn"
    reach("#position .balls button")
    press("Space")
    assert page.evaluate(at) == "r1c1"
    reach("[data-section=machine] > summary")
    page.keyboard.press("Enter")
    path = '["machine","repeatability"]'
    reach(f"#forms [data-path='{path}']")
    page.keyboard.press("Control+a")
    page.keyboard.type("0.3 um")
    assert press("Enter")["data"]["machine"]["repeatability"] == "0.3 um"
    assert page.evaluate("document.activeElement.dataset.path") == path
    reach("#view")
    before = page.evaluate("window.studio.state().design.scene.positions[0].origin")
    after = press("PageUp")["design"]["scene"]["positions"][0]["origin"]
    assert sum(a != b for a, b in zip(before, after, strict=True)) == 1
    assert page.evaluate(at).startswith("The volume")
    state = press("Control+s")
    assert state["saved"]


def test_pages_fit_small_screens(browser, page, tmp_path: Path) -> None:
    """That of a design, and the one on which designs begin."""
    page.click("#positions button.name >> nth=0")
    for summary in page.locator("#forms > details > summary").all():
        summary.click()
    for width in (400, 900):
        page.set_viewport_size({"width": width, "height": 900})
        until(page, f"({OUTSIDE}).length === 0")
    (tmp_path / "a file of a rather long name for a button of the first page.yaml").touch()
    with Studio(tmp_path / "new.yaml") as studio, new_tab(browser) as first:
        first.goto(studio.address)
        first.wait_for_selector("#draft dl")
        for width in (390, 1024):
            first.set_viewport_size({"width": width, "height": 900})
            until(first, f"({OUTSIDE}).length === 0")
        assert first.errors == []


def test_results_of_an_earlier_design_are_marked_and_a_refused_sweep_says_where(page) -> None:
    page.click("#sweep")
    page.fill("[data-axis=paths] >> nth=1", "artefacts.plate.size[0]")
    page.fill("[data-axis=values] >> nth=1", "750 mm; 400")
    page.click("#compute")
    page.wait_for_selector("#sweep-error >> text=/^artefacts.plate.size.* has no unit/")
    # What was typed is there still.
    page.fill("[data-axis=values] >> nth=1", "750 mm; 400 mm")
    page.click("#compute")
    page.wait_for_selector("#jobs li[data-state=done]", timeout=200_000)
    heads = page.locator("#jobs th").all_inner_texts()
    assert heads[:2] == ["repeatability", "size[0]"] and "U6 max. µm" in heads
    assert page.locator("#jobs li >> text=of an earlier design").count() == 0
    page.click("#positions button.name >> nth=0")
    page.click("#turn")
    page.wait_for_selector("#jobs li >> text=of an earlier design")
    page.click("#undo")
    until(page, "!document.querySelector('#jobs').innerText.includes('of an earlier')")


DRAWN = "['outlines', 'boxes'].map((name) => window.studio.view[name].length)"


def fields(page, field: str, text: str) -> None:
    page.fill(field, text)
    page.press(field, "Tab")


def test_a_pool_is_filled_limited_and_planned_from(page) -> None:
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
