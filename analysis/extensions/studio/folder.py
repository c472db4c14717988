"""Files of the folder of the file that the studio was started with, the only ones that it opens or
writes.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from ballplate.simulator.inputs import OPENED, UNKNOWN, refused

from .document import DesignDocument, opened
from .recovery import kept_in, name_of_kept

ENDINGS = (".yaml", ".yml")
# Bytes of the name of a file, of which systems allow 255.
MOST_IN_NAME = 200


class RefusedError(Exception):
    """A request is not permitted, or not possible now; the text states why."""


class DesignFolder:
    """The folder of a first file, and an example that new files begin with.

    Error models in Python run only from the first file, which the command itself has named.
    """

    def __init__(self, first: Path, example: str) -> None:
        """Open the folder.

        :raises ExperimentError: there is none.
        """
        self._first, self._example = first.resolve(), example
        if not self._first.parent.is_dir():
            raise refused(first, "there is no such folder; make it, or name another")

    def document(self, path: Path, variant: str | None = None, new: bool = True) -> DesignDocument:
        """Return the document of a file, or of a `new` one that begins with the example.

        :raises ExperimentError: the file cannot be read.
        """
        trust = OPENED if path.resolve() == self._first else UNKNOWN
        if path.exists() or not new:
            return opened(path, variant, trust)
        return DesignDocument(path, variant, self._example, None, trust)

    def inside(self, name: str) -> Path:
        """Return the path of a design in the folder.

        :raises RefusedError: it would be outside, or is not the name of a design.
        """
        folder = self._first.parent
        path = folder / name
        is_plain = name == Path(name).name and name.isprintable() and _is_design(name)
        # What is kept of unsaved changes has a longer one.
        is_plain = is_plain and len(name.encode()) <= MOST_IN_NAME
        if not is_plain or path.resolve().parent != folder:
            raise RefusedError(f'"{name}" is not the name of a design in the folder {folder.name}')
        return path

    def free(self, name: str, present: str) -> Path:
        """Return the path of a design that may be begun, while one is `present`.

        :raises RefusedError: as for `inside`, or there is one already, saved or not.
        """
        path = self.inside(name)
        if path.exists():
            raise RefusedError(f"{path.name} is there already; choose another name")
        if kept_in(path).exists() and path.name != present:
            raise RefusedError(f"{path.name} has changes that are not saved; open it")
        return path

    def names(self) -> list[str]:
        """Return the names of designs, those of unsaved new ones too; none of a folder that is
        gone.
        """
        files: list[Path] = []
        with suppress(OSError):
            files += (file for file in self._first.parent.iterdir() if file.is_file())
        return sorted(filter(_is_design, {name_of_kept(file) or file.name for file in files}))


def _is_design(name: str) -> bool:
    return name.lower().endswith(ENDINGS) and not name.startswith(".")
