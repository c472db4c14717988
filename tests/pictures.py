"""The documentation's pictures of pages and of the studio, which need Playwright and a Chromium:
`python -m tests.pictures docs/pictures`.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import ballplate as bp
from ballplate.extensions.pages.design_contents import page_of_design
from PIL import Image

from tests.extensions.pages.browser import tab
from tests.extensions.studio import pictures as of_studio

# Height of each picture of a page, and the element that it begins with.
SHOWN = {"design-page": (880, "h1"), "fit-page": (820, "#curves"), "sweep-page": (1010, "h1")}
WIDTH = 1100


def main(folder: Path) -> None:
    with tempfile.TemporaryDirectory() as temporary:
        pages = _pages(Path(temporary))
        with tab(WIDTH, 900) as page:
            page.emulate_media(reduced_motion="reduce")
            for name, (height, start) in SHOWN.items():
                page.goto(pages[name].as_uri())
                top = page.evaluate(
                    f"document.querySelector('{start}').getBoundingClientRect().top"
                )
                clip = {"x": 0, "y": max(top - 16, 0), "width": WIDTH, "height": height}
                path = folder / f"{name}.png"
                page.screenshot(path=str(path), clip=clip, full_page=True)
    for name in SHOWN:
        # As many colours as can be told apart, in a file that loads at once.
        path = folder / f"{name}.png"
        small = Image.open(path).convert("RGB").quantize(256, dither=Image.Dither.NONE)
        small.save(path, optimize=True)
    of_studio.main(folder)


def _pages(folder: Path) -> dict[str, Path]:
    """Pages of the quickstart, of a fit, and of the shipped sweep."""
    experiment = bp.load("designs/quickstart.yaml")
    fit = bp.fit(experiment, bp.simulate(experiment, seed=1))
    store = folder / "plates.sqlite"
    bp.sweep("designs/sweeps/plate-size.yaml", store=store)
    texts = {
        "design-page": page_of_design(experiment, bp.run(experiment)),
        "fit-page": fit.page(),
        "sweep-page": bp.page(bp.stored(store)),
    }
    found = {}
    for name, text in texts.items():
        found[name] = folder / f"{name}.html"
        found[name].write_text(text, encoding="utf-8")
    return found


if __name__ == "__main__":
    main(Path(sys.argv[1]))
