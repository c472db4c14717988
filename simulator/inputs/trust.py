"""Trust in a file: whether its code is run, and which folder its files must be in."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from .messages import refused


@dataclass(frozen=True)
class Trust:
    """Permissions of a file: to import its `modules`, and to read files `within` a folder, or
    anywhere.

    `remedy` is the advice when modules are refused.
    """

    modules: bool = False
    within: Path | None = None
    remedy: str = "allow them if you trust the file"

    def file(self, folder: Path, name: object) -> Path:
        """Return the path of a name in a folder.

        :raises ExperimentError: it is outside the permitted folder, links followed.
        """
        path = folder / str(name)
        if self.within is not None and not path.resolve().is_relative_to(self.within.resolve()):
            text = "is outside the folder that files are read from here; copy it there"
            raise refused(path, text)
        return path


# Of a file that the user opened by its name, and of one that came with another.
OPENED, UNKNOWN = Trust(modules=True), Trust()
