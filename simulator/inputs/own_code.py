"""Where an error arose in code of a user's own, neither the program's nor that of its libraries."""

from __future__ import annotations

import sys
import sysconfig
import traceback
from pathlib import Path

from .settings import shorten

# Packages that the program uses, by their folders.
LIBRARIES = frozenset(
    ("distributed", "filelock", "jinja2", "joblib", "matplotlib", "numpy", "pandas", "pyarrow")
    + ("pydantic", "pydantic_core", "scipy", "threadpoolctl", "tqdm", "yaml", "dask", "tornado")
)
# Folders of the standard library.
STANDARD = (Path(traceback.__file__).parent, Path(sysconfig.get_path("platstdlib")))


def own_frame(error: BaseException) -> traceback.FrameSummary | None:
    """The innermost place in a user's own code that an error came through; None without any."""
    program = {
        getattr(module, "__file__", None)
        for name, module in list(sys.modules.items())
        if name.partition(".")[0] == "ballplate"
    }
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        file = frame.filename
        if not file.startswith("<") and file not in program and not _is_library(file):
            return frame
    return None


def _is_library(file: str) -> bool:
    parts = Path(file).parts
    for folder in ("site-packages", "dist-packages"):
        if folder in parts[:-1]:
            # By the innermost one: virtual environments may be inside each other.
            inner = len(parts) - 1 - parts[::-1].index(folder)
            return parts[inner + 1].removesuffix(".py") in LIBRARIES
    return any(Path(file).is_relative_to(folder) for folder in STANDARD)


def told(error: BaseException, frame: traceback.FrameSummary | None) -> str:
    """An error with the place where it arose, in a line."""
    at = "" if frame is None else f" ({Path(frame.filename).name}, line {frame.lineno})"
    return f"{shorten(f'{type(error).__name__}: {error}', 200)}{at}"
