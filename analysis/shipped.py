"""Where the experiment files that come with ballplate are."""

from __future__ import annotations

from pathlib import Path

import ballplate.designs


def shipped(*names: str) -> Path:
    """The path of a shipped file or folder.

    >>> shipped("quickstart.yaml").is_file(), shipped("npl").is_dir()
    (True, True)
    """
    return Path(ballplate.designs.__file__).parent.joinpath(*names)
