"""Three machines planned from an empty folder, with the mouse, with the keyboard alone and by
touch: nothing is refused, and nothing is lost when the studio is killed.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ballplate as bp
import pytest

from tests.extensions.studio.chromium import IN_BROWSER, Studio, settled, spot, tab, until

pytestmark = [*IN_BROWSER, pytest.mark.long]

STATE = "window.studio.state()"


class Mouse:
    """What a person does; `page` is in a tab of its own."""

    touches = False
    moves = 1

    def __init__(self, page: Any) -> None:
        self.page = page

    def press(self, selector: str) -> None:
        self.page.click(selector)

    def write(self, selector: str, text: str) -> None:
        self.page.fill(selector, text)
        self.page.press(selector, "Enter")

    def move(self, name: str) -> None:
        """Move the plate that is chosen along its plane."""
        x, y = spot(self.page, name)
        self.page.mouse.move(x, y)
        self.page.mouse.down()
        for k in range(1, 6):
            self.page.mouse.move(x + 6 * k, y - 4 * k)
            self.page.wait_for_timeout(20)
        self.page.mouse.up()


class Keyboard(Mouse):
    moves = 3

    def reach(self, selector: str) -> None:
        matches = "([s]) => document.activeElement === document.querySelector(s)"
        for _ in range(400):
            if self.page.evaluate(matches, [selector]):
                return
            self.page.keyboard.press("Tab")
        raise AssertionError(f"no {selector} by the Tab key")

    def press(self, selector: str) -> None:
        self.reach(selector)
        is_box = self.page.get_attribute(selector, "type") in ("checkbox", "radio")
        self.page.keyboard.press("Space" if is_box else "Enter")

    def write(self, selector: str, text: str) -> None:
        self.reach(selector)
        self.page.keyboard.press("Control+a")
        self.page.keyboard.type(text)
        self.page.keyboard.press("Tab" if self.is_area(selector) else "Enter")

    def is_area(self, selector: str) -> bool:
        return (
            self.page.evaluate("([s]) => document.querySelector(s).tagName", [selector]) != "INPUT"
        )

    def move(self, name: str) -> None:
        self.reach("#view")
        for _ in range(self.moves):
            self.page.keyboard.press("ArrowRight")


class Touch(Mouse):
    touches = True

    def press(self, selector: str) -> None:
        found = self.page.locator(selector).first
        found.scroll_into_view_if_needed()
        found.tap()

    def move(self, name: str) -> None:
        self.page.locator("#view").scroll_into_view_if_needed()
        x, y = spot(self.page, name)
        session = self.page.context.new_cdp_session(self.page)

        def touch(kind: str, *points: tuple[float, float]) -> None:
            at = [{"x": px, "y": py} for px, py in points]
            session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": at})
            self.page.wait_for_timeout(30)

        touch("touchStart", (x, y))
        for k in range(1, 6):
            touch("touchMove", (x + 6 * k, y - 4 * k))
        touch("touchEnd")


def begin_with_questions(hands: Mouse, kind: str, volume: tuple[int, ...]) -> None:
    hands.page.wait_for_selector("#draft dl")
    box = f"#questions input[value='{kind}']"
    if isinstance(hands, Keyboard):
        # One stop of the Tab key for all kinds, and the arrow keys among them.
        while not hands.page.is_checked(box):
            hands.page.keyboard.press("ArrowDown")
    else:
        hands.press(box)
    for k, edge in enumerate(volume):
        field = f"#answer-volume-{k}"
        if isinstance(hands, Keyboard):
            hands.reach(field)
            hands.page.keyboard.type(str(edge))
        else:
            hands.page.fill(field, str(edge))
    if kind == "cantilever":
        for k, value in enumerate(("4", "4", "200")):
            hands.page.fill(f"#answer-plate-{k}", value)
    hands.page.wait_for_timeout(500)
    hands.press("#begin-form button:not([type=button])")
    hands.page.wait_for_selector("#begin", state="hidden")


def begin_in_two_dimensions(hands: Mouse) -> None:
    hands.page.wait_for_selector("#draft dl")
    hands.press("#begin-flat")
    hands.page.wait_for_selector("#begin", state="hidden")


@pytest.mark.parametrize("hands_of", [Mouse, Keyboard, Touch])
@pytest.mark.parametrize("machine", ["moving bridge", "cantilever", "two dimensions"])
def test_from_an_empty_folder(tmp_path: Path, machine: str, hands_of: type[Mouse]) -> None:
    port, is_flat = 0, machine == "two dimensions"
    volume = {"moving bridge": (1200, 900, 700), "cantilever": (500, 400, 300)}.get(machine, ())
    text = ""

    def done(page: Any, revision: int) -> dict:
        state = settled(page, revision)
        bad = page.query_selector("#notice.bad")
        assert bad is None, bad.inner_text()
        return state

    for part in range(3):
        with Studio(tmp_path, port) as studio, tab(1440, 1000, hands_of.touches) as page:
            port = studio.port
            page.goto(studio.address)
            until(page, f"!!window.studio && !!{STATE}")
            hands = hands_of(page)
            if part == 0:
                if is_flat:
                    begin_in_two_dimensions(hands)
                else:
                    begin_with_questions(hands, machine, volume)
            state = done(page, 1 if part == 0 else 0)
            if part:
                assert state["text"] == text
            revision = state["revision"]
            names = [place["name"] for place in state["design"]["scene"]["positions"]]
            first = f"[aria-label='choose {names[0]}']"
            if part == 0:
                hands.press(first)
                hands.move(names[0])
                moved = done(page, revision + hands.moves)["design"]["scene"]["positions"][0]
                assert moved["origin"] != state["design"]["scene"]["positions"][0]["origin"]
                # Another is taken out of the volume, and the others go on.
                revision = page.evaluate(f"{STATE}.revision")
                hands.press("#forms [data-section=positions] > summary")
                steps = '"corner","x"' if is_flat else '"level"'
                hands.write(f"#forms [data-path='[\"positions\",1,{steps}]']", "5 m")
                state = done(page, revision + 1)
                assert state["design"]["scene"]["positions"][1]["problem"] and not state["stale"]
                hands.press(f"[aria-label='read {names[2]}']")
                state = done(page, revision + 2)
                assert not state["design"]["scene"]["positions"][2]["enabled"]
            elif part == 1:
                hands.press("#fit")
                state = done(page, revision + 1)
                assert not any(one["problem"] for one in state["design"]["scene"]["positions"])
                hands.press(f"[aria-label='read {names[2]}']")
                state = done(page, revision + 2)
                hands.press("[data-job=next]")
                page.wait_for_selector("#suggestions [data-apply]", timeout=200_000)
                hands.press("#suggestions [data-apply]")
                state = done(page, revision + 3)
                assert len(state["design"]["scene"]["positions"]) == len(names) + 1
            else:
                hands.press("#save")
                until(page, f"{STATE}.saved")
                state = page.evaluate(STATE)
            text = state["text"]
            assert page.errors == []
            if part < 2:
                studio.end(9)
    (design,) = tmp_path.glob("*.yaml")
    assert design.read_text() == text
    lengths = next(row for row in state["design"]["quantities"] if row["symbol"] == "U6")
    predicted = bp.run(design).quantities["U6"].average
    assert lengths["average"] == (predicted if predicted == predicted else None)
