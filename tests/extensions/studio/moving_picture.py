"""The first picture of the README, which moves for eight seconds: an error that no reading
determines, the suggestion, and full rank. `python -m tests.extensions.studio.moving_picture
docs/pictures/studio.webp` makes it, in a minute.
"""

from __future__ import annotations

import io
import sys
import tempfile
from itertools import pairwise
from math import pi, sin
from pathlib import Path

from ballplate.designs import shipped
from PIL import Image

from tests.extensions.pages.browser import tab
from tests.extensions.studio.chromium import Studio, settled, until

RATE = 8  # pictures in a second
PERIOD = 2.4  # seconds of one swing
# Seconds of the error alone, with the suggestion beside it, and of full rank.
PARTS = (3.6, 2.4, 2.0)
SHARE = 0.06  # of the volume's size: the largest displacement
QUALITY = 45

LEFT_OUT = ("y low", "y high")


def main(file: Path) -> None:
    with tempfile.TemporaryDirectory() as temporary:
        design = Path(temporary) / "plate.yaml"
        lines = Path(shipped("quickstart.yaml")).read_text("utf-8").splitlines(keepends=True)
        kept = [line for line in lines if not any(f"name: {name}," in line for name in LEFT_OUT)]
        design.write_text("".join(kept).replace("in six positions", "in four positions"), "utf-8")
        with Studio(design) as studio, tab(1200, 790) as page:
            # Nothing moves by itself: each picture is that of its time.
            page.emulate_media(reduced_motion="reduce")
            page.goto(studio.address)
            until(page, "!!window.studio?.state()?.design")
            written(pictures(page), file)
            assert page.errors == []


def pictures(page) -> list[Image.Image]:
    """Return the pictures in their order."""
    page.mouse.move(560, 3)
    settled(page, 0)
    page.wait_for_timeout(2000)
    found = [swung(page, k / RATE) for k in range(round(PARTS[0] * RATE))]
    page.click("[data-job=suggest]")
    page.wait_for_selector("#suggestions [data-apply]")
    page.mouse.move(560, 3)
    page.wait_for_timeout(500)
    found += [swung(page, k / RATE) for k in range(round(PARTS[1] * RATE))]
    page.click("#suggestions [data-apply] >> nth=0")
    settled(page, 1)
    page.mouse.move(560, 3)
    page.wait_for_timeout(2500)
    return [*found, *[shot(page)] * round(PARTS[2] * RATE)]


def swung(page, seconds: float) -> Image.Image:
    share = SHARE * sin(2.0 * pi * seconds / PERIOD)
    page.evaluate(
        f"() => {{ const {{ view }} = window.studio; view.set({{ amplitude: {share} * view.size }}); }}"
    )
    page.wait_for_timeout(60)
    return shot(page)


def shot(page) -> Image.Image:
    return Image.open(io.BytesIO(page.screenshot())).convert("RGB")


def written(images: list[Image.Image], file: Path) -> None:
    """Write the pictures as an animated WebP; those that are alike are one that lasts longer."""
    kept, durations = [images[0]], [1000 // RATE]
    for before, image in pairwise(images):
        if image.tobytes() == before.tobytes():
            durations[-1] += 1000 // RATE
        else:
            kept.append(image)
            durations.append(1000 // RATE)
    options = {"quality": QUALITY, "method": 4, "loop": 0, "duration": durations}
    kept[0].save(file, save_all=True, append_images=kept[1:], **options)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
