"""Stores that several tests read."""

from __future__ import annotations

from pathlib import Path

import pytest
from ballplate.cli import main


@pytest.fixture(scope="session")
def plate_sizes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The store of the sweep that is shipped."""
    store = tmp_path_factory.mktemp("sweep") / "plate.sqlite"
    assert (
        main(["sweep", "designs/sweeps/plate-size.yaml", "--store", str(store), "--workers", "2"])
        == 0
    )
    return store


@pytest.fixture(scope="session")
def plate_sizes_page(plate_sizes: Path) -> Path:
    """Its page."""
    page = plate_sizes.with_suffix(".html")
    assert main(["sweep", "--report", str(plate_sizes), "-o", str(page)]) == 0
    return page
