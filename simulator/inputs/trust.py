"""Trust in a file: whether code that it names is run, and where the files that it names may lie."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from .messages import refused


@dataclass(frozen=True)
class Trust:
    """What reading a file may do for it: import the `modules` that it names, and read files
    `within` a folder, or anywhere. `remedy` is what to do where modules are refused.
    """

    modules: bool = False
    within: Path | None = None
    remedy: str = "allow them if you trust the file"

    def file(self, folder: Path, name: object) -> Path:
        """The file that a name means in a folder.

        :raises ExperimentError: it lies elsewhere than it may, links followed.
        """
        path = folder / str(name)
        if self.within is not None and not path.resolve().is_relative_to(self.within.resolve()):
            text = "is outside the folder that files are read from here; put a copy of it there"
            raise refused(path, text)
        return path


# Of a file that somebody opened by its name, and of one that came with something else.
OPENED, UNKNOWN = Trust(modules=True), Trust()
