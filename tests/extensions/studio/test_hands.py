"""Mouse and fingers in the view of the studio: what is begun can be left, and a plate stops at the
volume's walls.
"""

from __future__ import annotations

import pytest

from tests.extensions.pages.browser import IN_BROWSER
from tests.extensions.studio.chromium import settled, spot, until

pytestmark = [*IN_BROWSER, pytest.mark.slow]

CALLS = """(() => { const { handlers } = window.studio.view; window.calls = [];
for (const name of ['onDrag', 'onDrop', 'onPlace']) { const before = handlers[name];
handlers[name] = (...sent) => { window.calls.push([name, ...sent]); return before(...sent); }; } })()"""
# Where a plate is drawn, and how.
PLACE = "(() => { const { view } = window.studio;"
PLACE += " return [view.hands.offset('z low'), view.named('z low').look]; })()"
EYE = "(() => { const { zoom, turn, rise, shift } = window.studio.view;"
EYE += " return [zoom, [turn, rise, ...shift]]; })()"


@pytest.fixture
def page(page):
    """The plate `z low`, 700 mm in a cube of 1000 mm, is chosen."""
    page.click("#positions button.name >> nth=0")
    page.evaluate(CALLS)
    page.wait_for_timeout(200)
    return page


def calls(page, name: str) -> list:
    return [sent for called, *sent in page.evaluate("window.calls") if called == name]


def middle(page) -> list[float]:
    found: list[float] = page.evaluate("window.studio.view.named('z low').middle")
    return found


def pulled(page, by: tuple[float, float, float]) -> None:
    """Drag the plate with the mouse, which stays down."""
    start = middle(page)
    page.mouse.move(*spot(page, start))
    page.mouse.down()
    end = [a + b for a, b in zip(start, by, strict=True)]
    page.mouse.move(*spot(page, end), steps=6)


# Half a second becomes two and a half.
LONGER = "() => { const o = setTimeout; window.setTimeout = (f, t) => o(f, t === 500 ? 2500 : t) }"


class Fingers:
    """Fingers on the screen, each at a point."""

    def __init__(self, page) -> None:
        self.session = page.context.new_cdp_session(page)
        self.session.send("Emulation.setTouchEmulationEnabled", {"enabled": True})

    def __call__(self, kind: str, *points: tuple[float, float]) -> None:
        touches = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(points)]
        self.session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": touches})


def test_escape_takes_a_drag_back(page) -> None:
    before = page.evaluate("window.studio.state().text")
    pulled(page, (0.1, 0.05, 0.0))
    assert page.evaluate(PLACE)[0] != [0, 0, 0]
    page.keyboard.press("Escape")
    assert page.evaluate(PLACE) == [[0, 0, 0], "chosen"]
    # The figures are asked for once more, of the plate as it stands.
    assert calls(page, "onDrag")[-1] == ["z low", [0, 0, 0]]
    eye = page.evaluate(EYE)
    page.mouse.move(300, 400)
    page.mouse.up()
    assert calls(page, "onDrop") == [] and page.evaluate(EYE) == eye
    assert page.evaluate("window.studio.state().text") == before


def test_a_plate_stops_at_the_wall_and_is_red_beyond_it(page) -> None:
    # Its balls are from 0 to 700 mm along y and from 0 along x, less the probe's offset.
    extent = page.evaluate(
        "(() => { const { min, max } = window.studio.view.named('z low').extent;"
        " return [min, max]; })()"
    )
    room = round(1.0 - extent[1][0], 6)
    pulled(page, (room + 0.2, 0.0, 0.0))
    place, look = page.evaluate(PLACE)
    assert look == "chosen" and place == pytest.approx([room, 0, 0], abs=1e-6)
    page.keyboard.down("Alt")
    page.mouse.move(
        *spot(page, [a + b for a, b in zip(middle(page), (room + 0.15, 0, 0), strict=True)])
    )
    place, look = page.evaluate(PLACE)
    assert look == "wrong" and place[0] > room + 0.05
    page.mouse.up()
    page.keyboard.up("Alt")
    state = settled(page, 1)
    assert state["design"]["scene"]["positions"][0]["problem"]
    until(page, "window.studio.view.named('z low').look === 'wrong'")
    # What is outside can be dragged back.
    pulled(page, (-0.3, 0.0, 0.0))
    assert page.evaluate(PLACE)[1] == "chosen"
    page.mouse.up()
    assert settled(page, 2)["design"]["scene"]["positions"][0]["problem"] is None
    assert [name for name, _ in calls(page, "onDrop")] == ["z low"] * 2


def test_one_finger_drags_a_plate_and_a_second_one_leaves_it(page) -> None:
    fingers = Fingers(page)
    x, y = spot(page, middle(page))
    fingers("touchStart", (x, y))
    fingers("touchMove", (x + 20, y + 8))
    fingers("touchMove", (x + 40, y + 12))
    assert page.evaluate(PLACE)[0] != [0, 0, 0]
    fingers("touchEnd")
    settled(page, 1)
    assert [name for name, _ in calls(page, "onDrop")] == ["z low"]
    eye = page.evaluate(EYE)
    x, y = spot(page, middle(page))
    fingers("touchStart", (x, y))
    fingers("touchMove", (x + 20, y + 8))
    fingers("touchMove", (x + 40, y + 12))
    assert page.evaluate(EYE) == eye
    # Two fingers move apart: the view grows, and the plate is where it was.
    fingers("touchStart", (x + 40, y + 12), (x + 80, y + 12))
    assert page.evaluate(PLACE) == [[0, 0, 0], "chosen"]
    for k in range(1, 6):
        fingers("touchMove", (x + 40 - 10 * k, y + 12), (x + 80 + 10 * k, y + 12))
    fingers("touchEnd")
    assert page.evaluate(EYE)[0] > 1.5 * eye[0]
    assert len(calls(page, "onDrop")) == 1
    # One finger beside the plates turns it.
    page.click("#home")
    eye = page.evaluate(EYE)
    x, y = spot(page, [0.95, 0.05, 0.0])
    fingers("touchStart", (x, y + 20))
    for k in range(1, 6):
        fingers("touchMove", (x + 10 * k, y + 20))
    fingers("touchEnd")
    assert page.evaluate(EYE)[1] != eye[1]


def test_a_place_is_asked_for_on_the_floor(page) -> None:
    at = [0.95, 0.1, 0.0]
    page.mouse.dblclick(*spot(page, at))
    (sent,) = calls(page, "onPlace")[0]
    assert sent == pytest.approx(at, abs=0.0051)
    count = len(settled(page, 1)["design"]["scene"]["positions"])
    assert count == 7
    # On a plate it chooses that.
    page.mouse.dblclick(*spot(page, middle(page)))
    assert len(calls(page, "onPlace")) == 1
    page.click("#undo")
    settled(page, 2)
    fingers = Fingers(page)
    fingers("touchStart", spot(page, at))
    until(page, "window.calls.filter(([called]) => called === 'onPlace').length === 2")
    fingers("touchEnd")
    settled(page, 3)
    page.click("#undo")
    settled(page, 4)
    # A finger that moves turns the view instead; on a busy machine moves come late.
    page.evaluate(LONGER)
    x, y = spot(page, at)
    fingers("touchStart", (x, y))
    fingers("touchMove", (x + 15, y))
    fingers("touchMove", (x + 30, y))
    page.wait_for_timeout(2700)
    fingers("touchEnd")
    assert len(calls(page, "onPlace")) == 2


def test_a_drop_stays_until_it_is_answered_and_goes_back_if_it_is_refused(page) -> None:
    held: list = []
    page.route("**/api/do", lambda route: route.continue_() if held else held.append(route))
    pulled(page, (0.1, 0.0, 0.0))
    page.mouse.up()
    first = page.evaluate(PLACE)[0]
    assert first[0] == pytest.approx(0.1, abs=0.011)
    # It is taken again where it is drawn, before the answer.
    once, twice = ([middle(page)[0] + k * first[0], *middle(page)[1:]] for k in (1, 2))
    page.mouse.move(*spot(page, once))
    page.mouse.down()
    page.mouse.move(*spot(page, twice), steps=3)
    page.mouse.up()
    assert page.evaluate(PLACE)[0][0] == pytest.approx(2 * first[0], abs=0.011)
    held[0].continue_()
    origin = settled(page, 2)["design"]["scene"]["positions"][0]["origin"]
    assert origin[0] == pytest.approx(2 * first[0], abs=0.011)
    assert page.evaluate(PLACE)[0] == [0, 0, 0]
    page.unroute("**/api/do")
    page.route("**/api/do", lambda route: route.fulfill(json={"error": "refused"}))
    pulled(page, (-0.1, 0.0, 0.0))
    assert page.evaluate(PLACE)[0] != [0, 0, 0]
    page.mouse.up()
    until(page, "window.studio.view.hands.offset('z low').every((one) => one === 0)")


def test_the_mouse_turns_moves_and_enlarges_the_view(page) -> None:
    corner = [1.0, 0.0, 0.0]
    x, y = spot(page, corner)
    page.mouse.move(x, y + 4)
    page.mouse.down()
    page.mouse.move(x + 40, y + 14, steps=3)
    page.mouse.up()
    (zoom, [turn, rise, *shift]) = page.evaluate(EYE)
    assert (zoom, shift) == (1, [0, 0]) and turn > -35 and rise > 24
    # What is below the pointer stays there when the wheel turns.
    x, y = spot(page, corner)
    page.mouse.move(x, y)
    page.mouse.wheel(0, -400)
    until(page, "window.studio.view.zoom > 1.3")
    assert spot(page, corner) == pytest.approx((x, y), abs=0.5)
    page.mouse.down(button="right")
    page.mouse.move(x + 30, y - 20, steps=3)
    page.mouse.up(button="right")
    assert spot(page, corner) == pytest.approx((x + 30, y - 20), abs=0.5)
    page.click("#home")
    assert page.evaluate(EYE) == [1, [-35, 24, 0, 0]]
