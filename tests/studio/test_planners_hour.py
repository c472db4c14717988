"""A planner's hour in the studio: what a person does with the mouse and the keyboard, in a real
browser.
"""

from __future__ import annotations

import statistics
from pathlib import Path

import ballplate as bp
import pytest
from ballplate.designs import shipped

from tests.report.browser import program
from tests.studio.chromium import Studio, settled, tab, until

pytest.importorskip("starlette", reason="the studio is an extra")
pytest.importorskip("playwright", reason="playwright drives the browser")

pytestmark = [
    pytest.mark.browser,
    pytest.mark.slow,
    pytest.mark.skipif(program() is None, reason="no Chromium on this machine; install it"),
]

# Nothing sticks out of the page, other than inside parts that scroll by themselves.
OUTSIDE = """[...document.querySelectorAll('body *')].filter(one =>
!one.closest('pre, .balls, dialog, textarea') && one.getClientRects().length &&
one.getBoundingClientRect().right > document.documentElement.clientWidth + 1)
.map(one => one.outerHTML.slice(0, 90))"""


@pytest.fixture
def design(tmp_path: Path) -> Path:
    """The quickstart's plate in too few positions."""
    path = tmp_path / "plate.yaml"
    lines = Path(shipped("quickstart.yaml")).read_text().splitlines(keepends=True)
    left_out = ("z high", "x low", "x high", "y high")
    kept = [line for line in lines if not any(f"name: {name}," in line for name in left_out)]
    path.write_text("".join(kept))
    return path


def drag(page, name: str, by: tuple[int, int], steps: int = 5) -> None:
    x, y = page.evaluate(f"window.studio.view.screen({name!r})")
    page.mouse.move(x, y)
    page.mouse.down()
    for k in range(1, steps + 1):
        page.mouse.move(x + by[0] * k / steps, y + by[1] * k / steps)
        page.wait_for_timeout(30)
    page.mouse.up()


def test_an_hour(design: Path) -> None:
    with Studio(design) as studio, tab() as page:
        page.goto(studio.address)
        until(page, "!!window.studio?.state()?.design")
        assert "rank deficiency" in page.inner_text("#verdict")
        # What is undetermined moves: the picture changes by itself.
        page.wait_for_selector("[data-motion='0'][aria-pressed='true']")
        canvas = page.locator("#view")
        pictures = set()
        for _ in range(3):
            pictures.add(canvas.screenshot())
            page.wait_for_timeout(400)
        assert len(pictures) == 3
        # A suggestion is shown where it would stand, and applied.
        page.click("[data-job=suggest]")
        page.wait_for_selector("#suggestions li")
        page.click("#suggestions [data-apply] >> nth=0")
        settled(page, 1)
        assert "full rank" in page.inner_text("#verdict")
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
        assert "text is wrong" in page.inner_text("#verdict")
        page.click("#undo")
        settled(page, 5)
        assert "full rank" in page.inner_text("#verdict")
        # Saved, the file says what the page says.
        page.keyboard.press("Control+s")
        until(page, "window.studio.state().saved")
        lengths = next(
            one
            for one in page.evaluate("window.studio.state().design.quantities")
            if one["symbol"] == "U6"
        )
        predicted = bp.run(design).quantities["U6"]
        assert lengths["average"] == predicted.average
        assert bp.check(design).verdict.deficiency == 0
        # What another program writes meanwhile is not overwritten.
        page.click("#positions button.name >> nth=0")
        page.click("#turn")
        until(page, "!window.studio.state().saved")
        written = design.read_bytes() + b"# another hand\n"
        design.write_bytes(written)
        page.click("#save")
        page.wait_for_selector("#notice.bad")
        assert "has changed on disk" in page.inner_text("#notice")
        assert design.read_bytes() == written
        latency = moves(page)
        # The server is killed: the page says so, and the studio begins again.
        studio.end(9)
        page.click("#turn")
        until(page, "document.querySelector('#notice').textContent.includes('start it')")
        assert page.errors == [] or all("ERR_CONNECTION" in one for one in page.errors)
        page.errors.clear()
        page.on("dialog", lambda dialog: dialog.accept())
        with Studio(design, studio.port) as again:
            page.goto(again.address)
            until(page, "!!window.studio?.state()?.design")
            assert "full rank" in page.inner_text("#verdict")
            assert page.evaluate("window.studio.state().text").endswith("# another hand\n")
            assert page.errors == []
            home = again.address.split("?")[0]
        assert all(url.startswith((home, "data:")) for url in page.asked)
    print(f"median of twenty moves {latency[0]:.0f} ms, engine {latency[1]:.0f} ms")


def moves(page) -> tuple[float, float]:
    """Median milliseconds of twenty moves by the keyboard, and of the engine's part."""
    page.evaluate("window.studio.latency.length = 0")
    engine = []
    revision = page.evaluate("window.studio.state().revision")
    for k in range(20):
        page.focus("#view")
        page.keyboard.press("PageUp" if k % 2 == 0 else "PageDown")
        revision += 1
        engine.append(1e3 * settled(page, revision)["design"]["engine"])
    return statistics.median(page.evaluate("window.studio.latency")), statistics.median(engine)


def test_a_machine_of_its_own_from_an_empty_folder(tmp_path: Path) -> None:
    """A machine of 1200 x 900 x 700 mm that meets 0.9 + L/400 µm (L in mm), by the browser alone."""
    design = tmp_path / "machine.yaml"
    actions = 0
    with Studio(design) as studio, tab() as page:
        page.goto(studio.address)
        until(page, "!!window.studio?.state()?.design")

        def fill(path: str, value: str) -> None:
            nonlocal actions
            field = page.locator(f"#forms [data-path='{path}']")
            revision = page.evaluate("window.studio.state().revision")
            field.fill(value)
            field.press("Enter")
            settled(page, revision + 1)
            actions += 1

        for section in ("machine", "artefacts", "positions", "target uncertainty", "title"):
            page.click(f"#forms summary >> text=/^{section}$/")
            actions += 1
        fill('["title"]', "plate in a machine of 1200 x 900 x 700 mm")
        fill('["artefacts","plate","size"]', "[500 mm, 500 mm]")
        fill('["machine","volume"]', "[1200 mm, 900 mm, 700 mm]")
        places = {
            1: {"level": "550 mm", "corner,x": "650 mm", "corner,y": "350 mm"},
            2: {"corner,y": "50 mm"},
            3: {"level": "950 mm", "corner,y": "350 mm", "corner,z": "150 mm"},
            4: {"corner,x": "50 mm"},
            5: {"level": "650 mm", "corner,z": "150 mm", "corner,x": "650 mm"},
        }
        for k, changes in places.items():
            for key, value in changes.items():
                steps = ",".join(f'"{step}"' for step in key.split(","))
                fill(f'["positions",{k},{steps}]', value)
        fill('["target_uncertainty"]', "(0.9 + L/400) um with L in mm")
        page.keyboard.press("Control+s")
        actions += 1
        until(page, "window.studio.state().saved")
        assert page.errors == []
        page.screenshot(path=str(tmp_path / "machine.png"))
    assert actions <= 60
    prediction = bp.run(design)
    assert prediction.verdict.deficiency == 0
    assert prediction.quantities["U6"].within_target == 1.0
    volume = prediction.design.machine.volume
    assert (volume.upper - volume.lower).tolist() == [1.2, 0.9, 0.7]
    print(f"{actions} actions")


@pytest.mark.parametrize("width", [400, 900, 1400])
def test_the_page_fits_small_screens(design: Path, width: int) -> None:
    with Studio(design) as studio, tab(width) as page:
        page.goto(studio.address)
        until(page, "!!window.studio?.state()?.design")
        page.click("#positions button.name >> nth=0")
        for summary in page.locator("#forms > details > summary").all():
            summary.click()
        assert page.evaluate(OUTSIDE) == []
        assert page.errors == []
