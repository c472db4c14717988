"""Where modules of the user's own code are found: by that code alone, in the folders of its files.

On Python's path, these folders would also be searched by libraries for what is not installed.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from importlib.machinery import ModuleSpec, PathFinder


@dataclass(frozen=True)
class OwnModules:
    """Finder of modules in `folders`: of those named by files, and of all that modules in `found`
    import.
    """

    folders: list[str]
    found: set[str]

    def add(self, folder: str, name: str) -> None:
        """Look for a module in a folder first."""
        self.folders[:] = [folder, *(other for other in self.folders if other != folder)]
        self.found.add(name.partition(".")[0])

    def find_spec(self, name: str, path: object = None, _: object = None) -> ModuleSpec | None:
        """Return the specification of a module, as `importlib` asks for it."""
        if path is not None or not {name, _importer()} & self.found:
            return None
        spec = PathFinder.find_spec(name, self.folders)
        if spec is not None:
            self.found.add(name)
        return spec


def _importer() -> object:
    """Return the package of the code that imports."""
    frame = sys._getframe(2)
    while (name := frame.f_globals["__name__"].partition(".")[0]) == "importlib":
        assert frame.f_back is not None
        frame = frame.f_back
    return name


def own_modules() -> OwnModules:
    """Return the finder of this process."""
    for finder in sys.meta_path:
        if isinstance(finder, OwnModules):
            return finder
    sys.meta_path.append(made := OwnModules([], set()))
    return made
