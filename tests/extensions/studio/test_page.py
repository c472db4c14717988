"""The page of the studio for everybody: sizes of what is pressed, contrast, what is read aloud.

With `BALLPLATE_AXE`, the path of axe-core's `axe.min.js`, its rules are applied, too.
"""

from __future__ import annotations

import itertools
import os
from pathlib import Path

import pytest

from tests.extensions.pages.browser import IN_BROWSER
from tests.extensions.studio.chromium import settled, until

pytestmark = [*IN_BROWSER, pytest.mark.slow]

# What can be pressed and is smaller than 24 pixels, other than links within sentences; radio buttons
# are pressed with their labels.
SMALL = """() => [...document.querySelectorAll('button, select, input, summary, a')]
.map(one => one.type === 'radio' ? one.closest('label') : one).filter(one =>
one.checkVisibility({ visibilityProperty: true }) && !one.matches('.skip') &&
Math.min(one.getBoundingClientRect().width, one.getBoundingClientRect().height) < 23.9)
.map(one => one.outerHTML.slice(0, 90))"""

# Texts with less contrast than 4.5 with the colour behind them.
FAINT = """() => {
  const canvas = Object.assign(document.createElement('canvas'), { width: 1, height: 1 });
  const context = canvas.getContext('2d', { willReadFrequently: true });
  const over = (colours) => {
    context.clearRect(0, 0, 1, 1);
    colours.forEach((colour) => { context.fillStyle = colour; context.fillRect(0, 0, 1, 1); });
    return [...context.getImageData(0, 0, 1, 1).data];
  };
  const light = (rgb) => rgb.slice(0, 3).map((one) => one / 255)
    .map((one) => (one <= 0.04045 ? one / 12.92 : ((one + 0.055) / 1.055) ** 2.4))
    .reduce((sum, one, k) => sum + one * [0.2126, 0.7152, 0.0722][k], 0);
  return [...document.querySelectorAll('body *')].filter((one) => {
    const hasText = [...one.childNodes].some((node) => node.nodeType === 3 && node.data.trim());
    if (!hasText || !one.checkVisibility({ opacityProperty: true })) return false;
    if (one.matches(':disabled, option, .skip, .unseen, script')) return false;
    const above = [];
    for (let node = one; node; node = node.parentElement) above.unshift(node);
    const paper = above.map((node) => getComputedStyle(node).backgroundColor);
    const [ink, behind] = [over([...paper, getComputedStyle(one).color]), over(paper)].map(light);
    const ratio = (Math.max(ink, behind) + 0.05) / (Math.min(ink, behind) + 0.05);
    return ratio < 4.5 || above.some((node) => Number(getComputedStyle(node).opacity) < 1);
  }).map((one) => one.outerHTML.slice(0, 90));
}"""

CORNER = """window.studio.view.sheets[0]?.image.getContext('2d').getImageData(0, 0, 1, 1).data
.join()""".replace("\n", "")

SERIOUS = """async () => (await axe.run(document)).violations
.filter((one) => ['serious', 'critical'].includes(one.impact))
.map((one) => [one.id, one.nodes.map((node) => node.html.slice(0, 90))])"""


def act(page, **action: object) -> None:
    page.evaluate("(action) => window.studio.act(action)", action)


def states(page):
    """The page in eight states, by their names."""
    yield "full rank"
    page.click("#pool summary")
    page.wait_for_selector("#pool-said >> text=No candidates yet")
    page.click("#fill")
    page.click("#forbid")
    page.wait_for_selector("#pool-said >> text=in a forbidden box")
    yield "pool"
    page.click("#pool summary")
    for section in ("influences", "calibration", "positions"):
        page.click(f"#forms [data-section={section}] > summary")
    page.click("[aria-label='add to influences']")
    page.wait_for_selector("#forms legend >> text=temperature")
    yield "forms"
    for section in ("influences", "calibration", "positions"):
        page.click(f"#forms [data-section={section}] > summary")
    for _ in range(3):
        act(page, do="undo")
    page.click("#positions button.name >> nth=1")
    yield "chosen position"
    path = ["machine", "repeatability"]
    act(page, do="set", path=path, value="0.2 furlongs")
    page.wait_for_selector("#messages li")
    yield "wrong text"
    act(page, do="undo")
    for name in ("z high", "x low", "x high", "y high"):
        act(page, do="off", position=name)
    page.wait_for_selector("#motions li")
    yield "deficient"
    page.click("#sweep")
    yield "dialogue"


def first_page(page):
    """The page on which a design begins, and its wrong answers."""
    page.click("#sweeping button >> text=Cancel")
    page.click("#new")
    page.wait_for_selector("#draft dl")
    yield "first page"
    page.fill("#answer-volume-0", "much")
    page.keyboard.press("Enter")
    page.wait_for_selector("#error-volume:not(:empty)")
    yield "wrong answer"


def test_what_is_pressed_is_large_and_what_is_read_has_contrast(page) -> None:
    axe = os.environ.get("BALLPLATE_AXE")
    page.wait_for_selector("#assumptions:not(.stale)")
    page.wait_for_selector("#scale:not(.stale)", state="attached")
    for name in itertools.chain(states(page), first_page(page)):
        assert page.evaluate(SMALL) == [], name
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme)
            assert page.evaluate(FAINT) == [], (name, scheme)
            if axe:
                page.evaluate(Path(axe).read_text(encoding="utf-8"))
                assert page.evaluate(SERIOUS) == [], (name, scheme)


def test_the_answer_comes_first_and_is_said_once_nothing_moves(page) -> None:
    said = page.locator("#said")
    assert said.get_attribute("aria-live") == "polite"
    first = said.inner_text()
    assert "U6 on average" in first and "100 %" in first and "Full rank" in first
    # Of what is nearly always wanted, nothing needs scrolling.
    for part in ("#verdict", "#view", "#positions", "[data-job=next]"):
        box = page.locator(part).bounding_box()
        assert box["y"] + box["height"] <= 900, part
    # Nothing is undetermined.
    assert not page.is_visible("[data-job=suggest]")
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.textContent") == "Skip to the answer"
    levels = page.evaluate(
        "[...document.querySelectorAll('h1, h2, h3')].map(one => Number(one.tagName[1]))"
    )
    assert levels[0] == 1 and levels.count(1) == 1
    # A preview changes the figures, and is not read aloud.
    page.evaluate("window.studio.view.handlers.onDrag('z low', [0.1, 0.1, 0])")
    until(page, f"!document.querySelector('#verdict').innerText.startsWith({first[:5]!r})")
    assert said.inner_text() == first
    act(page, do="move", position="z low", by=[0.1, 0.1, 0])
    settled(page, 1)
    until(page, f"document.querySelector('#said').innerText !== {first!r}")
    # What is undetermined says so in large type, with what to do next.
    for name in ("z high", "x low", "x high", "y high"):
        act(page, do="off", position=name)
    settled(page, 5)
    assert page.inner_text("#verdict .big") == "Undetermined"
    background = "one => getComputedStyle(one).backgroundColor"
    looks = [page.locator(f"[data-job={job}]").evaluate(background) for job in ("suggest", "next")]
    assert looks[0] == "rgb(10, 114, 177)" != looks[1]


def test_the_map_is_of_lengths_and_of_points_on_request(page) -> None:
    until(page, "!!window.studio?.view.map")
    legend = page.inner_text("#legend")
    assert "that miss the target 0.5 µm" in legend and "here 0 % to 0 %" in legend
    bands = page.locator("#legend li")
    steps = ["0 %", *(f"to {k} %" for k in (5, 10, 25, 50, 75)), "over 75 %"]
    assert bands.all_inner_texts() == steps
    corner = page.evaluate(CORNER)
    # The same steps for another target, where the same map has other colours.
    act(page, do="set", path=["target_uncertainty"], value="0.15 um")
    until(page, "document.querySelector('#legend').innerText.includes('0.15 µm')")
    assert bands.all_inner_texts() == steps
    until(page, f"{CORNER} !== {corner!r}")
    act(page, do="undo")
    until(page, f"{CORNER} === {corner!r}")
    page.select_option("#map", "points")
    page.wait_for_selector("#legend >> text=depends on the origin")
    page.select_option("#map", "")
    until(page, "document.querySelector('#legend').innerText === ''")
    assert page.evaluate("window.studio.view.map") is None
