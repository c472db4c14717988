"""The studio's answer and forms as a newcomer meets them, in a real browser."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.extensions.pages.browser import IN_BROWSER, new_tab
from tests.extensions.studio.chromium import Studio, settled, until
from tests.extensions.studio.small import SMALL

pytestmark = [*IN_BROWSER, pytest.mark.slow]


def act(page, **action: object) -> dict:
    revision = page.evaluate("window.studio.state().revision") - page.before
    page.evaluate("(action) => window.studio.act(action)", action)
    return settled(page, revision + 1)


def test_targets_are_met_or_missed_in_words(page) -> None:
    answer = page.locator("#verdict")
    assert "Target met" in answer.inner_text()
    act(page, do="set", path=["target_uncertainty"], value="0.2 um")
    assert "Target missed" in answer.inner_text()
    act(page, do="set", path=["target_uncertainty"], value="")
    assert "No target" in answer.inner_text() and "met" not in answer.inner_text().split()
    act(page, do="set", path=["target_uncertainty"], value="1.5 um")
    assert "Target met" in answer.inner_text()
    # Of a part, it is said of what; figures of an earlier text judge nothing now.
    act(page, do="move", position="z high", by=[0, 0, 2])
    assert "Target met" in answer.inner_text() and "by the rest: " in answer.inner_text()
    assert "without z high" in answer.inner_text()
    act(page, do="undo")
    act(page, do="set", path=["machine", "repeatability"], value="0.2 furlongs")
    assert "Before: met" in answer.inner_text() and "Target" not in answer.inner_text()
    act(page, do="undo")
    for name in ("z high", "x low", "x high", "y high"):
        act(page, do="off", position=name)
    assert "Target missed" in answer.inner_text() and "Undetermined" in answer.inner_text()


def test_what_an_answer_rests_on_leads_to_where_it_is_stated(page) -> None:
    until(page, "document.querySelector('#rests').innerText.includes('chain of axes')")
    page.click("#rests button")
    assert page.evaluate("document.activeElement.closest('details').dataset.section") == (
        "error_model"
    )
    page.click("#assumptions summary")
    page.click("[aria-label='state it: temperatures exactly known']")
    state = settled(page, 1)
    assert state["data"]["influences"][0]["kind"] == "temperature"
    assert state["messages"] == [] and state["design"]["rank"]["deficiency"] == 0
    path = '["influences",0,"scale_temperature","standard_uncertainty"]'
    until(page, f"document.activeElement.dataset.path === {path!r}")
    page.keyboard.press("Control+a")
    page.keyboard.type("0.03 K")
    page.keyboard.press("Enter")
    stated = settled(page, 2)["data"]["influences"][0]["scale_temperature"]
    assert stated["standard_uncertainty"] == "0.03 K"
    # Every kind of influence can be chosen, and is one that the file may have.
    kinds = page.locator("[aria-label='kind of another entry of influences']")
    names = kinds.locator("option").all_inner_texts()
    assert len(names) >= 7
    revision = 2
    for name in [one for one in names if one != "temperature"]:
        kinds.select_option(name)
        page.click("[aria-label='add to influences']")
        revision += 1
        state = settled(page, revision)
        assert state["data"]["influences"][-1]["kind"] == name
        if name != "re-indexing":
            assert [one["text"] for one in state["messages"]] == [], name
        page.click(f"[aria-label^='remove {name}']")
        revision += 1
        settled(page, revision)


def test_the_hours_of_the_first_page_are_those_of_the_plan(browser, tmp_path: Path) -> None:
    with Studio(tmp_path) as studio, new_tab(browser) as page:
        page.goto(studio.address)
        page.wait_for_selector("#draft dl")
        page.fill("#answer-hours-0", "4,5")
        page.check("#questions input[value=MB2]")
        page.wait_for_selector("#draft dd >> text=x carries y carries z (MB2)")
        page.click("#begin-form button:not([type=button])")
        page.wait_for_selector("#begin", state="hidden")
        settled(page, 1)
        assert page.input_value("#hours") == "4.5"
        until(page, "/^as now: [1-9.]+$/.test(document.querySelector('#hours').placeholder)")
        assert "h\nof measuring" in page.inner_text("#late")
        page.reload()
        until(page, "document.querySelector('#hours').value === '4.5'")
        page.fill("#hours", "0")
        page.click("#plan")
        assert page.evaluate("document.activeElement.matches('#hours:invalid')")
        assert page.inner_text("#jobs") == ""
        assert page.errors == []


def test_nothing_of_one_file_stays_over_another(page, studio) -> None:
    other = studio.design.with_name("other.yaml")
    other.write_text(SMALL.replace("0.2 um", "0.3 um"), encoding="utf-8")
    page.reload()
    until(page, "!!window.studio?.state()?.design")
    page.click("[data-job=next]")
    page.wait_for_selector("#suggestions li")
    page.click("#plan")
    page.wait_for_selector("#jobs li[data-state=failed]")
    page.click("#toggle-text")
    page.fill("#text", "title: nothing else")
    page.once("dialog", lambda dialog: dialog.accept())
    page.select_option("#files", "other.yaml")
    until(page, "window.studio.state().file === 'other.yaml'")
    assert page.input_value("#text").startswith("# yaml-language-server")
    assert page.inner_text("#jobs") == "" and page.inner_text("#suggestions") == ""
    assert page.inner_text("#notice") == ""
    page.select_option("#files", "plate.yaml")
    page.wait_for_selector("#suggestions li")
    # What failed of an earlier text is no message of the next one.
    page.wait_for_selector("#jobs li[data-state=failed]")
    act(page, do="turn", position="x low")
    assert page.locator("#jobs li[data-state=failed]").count() == 0
