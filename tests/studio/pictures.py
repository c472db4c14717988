"""The documentation's pictures of the studio: `python -m tests.studio.pictures docs/pictures`."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from ballplate.designs import shipped

from tests.studio.chromium import Studio, tab, until


def main(folder: Path) -> None:
    with tempfile.TemporaryDirectory() as temporary:
        design = Path(temporary) / "quickstart.yaml"
        design.write_bytes(Path(shipped("quickstart.yaml")).read_bytes())
        with Studio(design) as studio, tab(1400, 860) as page:
            page.goto(studio.address)
            until(page, "!!window.studio?.state()?.design")
            page.click("#positions button.name >> nth=1")
            page.click("#forms summary >> text=/^machine$/")
            page.wait_for_timeout(500)
            page.screenshot(path=str(folder / "studio.png"))
            for name in ("z high", "x low", "x high", "y high"):
                page.click(f"[aria-label='read {name}']")
                until(page, f"!window.studio.state().text.includes('name: {name},')")
            page.wait_for_timeout(700)
            page.screenshot(path=str(folder / "studio-undetermined.png"))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
