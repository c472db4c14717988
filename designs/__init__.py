"""Experiment files that come with ballplate: those of published documents, a first one, and what
they name.
"""

from __future__ import annotations

from pathlib import Path


def shipped(*names: str) -> Path:
    """The path of a shipped file or folder.

    >>> shipped("quickstart.yaml").is_file(), shipped("npl").is_dir()
    (True, True)
    """
    return Path(__file__).parent.joinpath(*names)
