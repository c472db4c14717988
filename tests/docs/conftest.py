"""The built documentation: one build for all tests of a session, also where processes share them."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The pages, built with the network out of reach."""
    folder = tmp_path_factory.getbasetemp()
    # Processes of one session have folders next to one another.
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent
    pages, complaint = folder / "docs-built", folder / "docs-built.txt"
    try:
        pages.mkdir()
    except FileExistsError:
        while not complaint.exists():
            time.sleep(0.2)
    else:
        unfinished, text = complaint.with_suffix(".part"), "the build did not end"
        try:
            text = build(Path("docs"), pages)
        finally:
            unfinished.write_text(text, encoding="utf-8")
            unfinished.rename(complaint)
    assert complaint.read_text(encoding="utf-8") == ""
    return pages


def build(source: Path, pages: Path) -> str:
    """Build pages as CONTRIBUTING says, and return what is wrong with them, empty where nothing."""
    nowhere = dict.fromkeys(("http_proxy", "https_proxy", "all_proxy"), "http://127.0.0.1:9")
    found = subprocess.run(
        [sys.executable, "-m", "sphinx", "-W", "-n", "-q", source, pages],
        env={**os.environ, **nowhere},
        capture_output=True,
        text=True,
    )
    return found.stderr if found.returncode == 0 else f"{found.returncode}: {found.stderr}"
