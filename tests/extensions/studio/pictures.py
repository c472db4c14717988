"""The documentation's pictures of the studio, as its page draws them:
`python -m tests.extensions.studio.pictures docs/pictures` makes these alone, in a minute and a half.
"""

from __future__ import annotations

import io
import sys
import tempfile
from pathlib import Path

import ballplate as bp
from ballplate.designs import shipped

from tests.extensions.pages.browser import tab
from tests.extensions.studio.chromium import Studio, settled, spot, until

# At which letters stay sharp, in a fifth of the bytes of PNG.
QUALITY = 82


def main(folder: Path) -> None:
    with tempfile.TemporaryDirectory() as temporary:
        with Studio(Path(temporary)) as studio, tab(1240, 800) as page:
            page.goto(studio.address)
            page.wait_for_selector("#draft dl")
            small(page.screenshot(), folder / "studio-begin.webp")
        design = Path(temporary) / "plate.yaml"
        design.write_bytes(Path(shipped("quickstart.yaml")).read_bytes())
        with Studio(design) as studio, tab(1240, 800) as page:
            page.goto(studio.address)
            until(page, "!!window.studio?.state()?.design")
            tour(page, folder, design)
            assert page.errors == []


# In one piece: the steps of the tour in the documentation, in its order.
def tour(page, folder: Path, design: Path) -> None:
    def picture(name: str) -> None:
        # The pointer hides nothing, and what is still asked for has come.
        page.mouse.move(620, 5)
        page.wait_for_timeout(1200)
        small(page.screenshot(), folder / f"studio-{name}.webp")

    for name in ("z high", "x low", "x high", "y high"):
        page.click(f"[aria-label='read {name}']")
        place = f"window.studio.state().design.scene.positions.find((one) => one.name === {name!r})"
        until(page, f"!{place}.enabled")
    until(page, "!!window.studio.view.motions")
    picture("undetermined")
    page.click("[data-job=suggest]")
    page.wait_for_selector("#suggestions li")
    page.locator("#suggestions").scroll_into_view_if_needed()
    picture("suggestion")
    page.click("#suggestions [data-apply] >> nth=0")
    until(page, "window.studio.state().design.rank.deficiency === 0")
    page.evaluate("window.scrollTo(0, 0)")
    page.click("#positions button.name >> nth=0")
    page.click("#keep")
    until(page, "!!window.studio.state().kept")
    x, y = spot(page, "z low")
    revision = page.evaluate("window.studio.state().revision")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x, y - 20, steps=6)
    page.mouse.up()
    settled(page, revision + 1)
    page.click("#details summary")
    picture("drag")
    page.click("#details summary")
    page.click("[data-job=next]")
    page.wait_for_selector("#suggestions li")
    page.evaluate("window.scrollTo(0, 0)")
    picture("next")
    page.click("#suggestions button >> nth=0")
    page.click("#keep")
    page.click("#sweep")
    page.fill("[data-axis=values]", "0.1 um; 0.2 um; 0.4 um")
    page.fill("[data-axis=paths] >> nth=1", "artefacts.plate.balls")
    page.fill("[data-axis=values] >> nth=1", "[5, 5]; [6, 6]; [7, 7]")
    picture("sweep")
    page.click("#compute")
    page.wait_for_selector("[data-page]")
    page.keyboard.press("Control+s")
    until(page, "window.studio.state().saved")
    table = bp.simulate(design, seed=1).to_csv(index=False).encode()
    page.set_input_files("#readings", {"name": "readings.csv", "mimeType": "", "buffer": table})
    page.wait_for_selector("#jobs li[data-state=done] >> text=fit")
    page.locator("#jobs [data-page]").scroll_into_view_if_needed()
    page.mouse.wheel(0, 250)
    picture("fit")
    page.evaluate("window.scrollTo(0, 0)")
    page.click("#turn")
    until(page, "!window.studio.state().saved")
    design.write_bytes(design.read_bytes() + b"# another hand\n")
    page.click("#toggle-text")
    page.click("#save")
    page.wait_for_selector("#notice.bad")
    picture("save")


def small(shot: bytes, file: Path) -> None:
    """Write a picture as WebP."""
    from PIL import Image

    Image.open(io.BytesIO(shot)).convert("RGB").save(file, quality=QUALITY, method=6)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
