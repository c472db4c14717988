"""Extensions of ballplate, and what each of them provides by name.

The kernel imports no extension. It asks here for a command, a function or a service by its name,
and what provides it is loaded then. Extensions that are shipped stand in the table
`ballplate.extensions.SHIPPED`; those that are installed besides register an `Extension` by the
entry point `ballplate.extensions`, and are looked up only for names that the table does not have.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from .unusable import UnusableError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

ENTRY_POINT = "ballplate.extensions"
KINDS = ("commands", "functions", "services", "schemas")


class MissingExtensionError(UnusableError):
    """An extension that is needed is not installed."""


@dataclass(frozen=True)
class Extension:
    """What a `package` provides, each name with the module below the package that has it.

    A module of `commands` has HELP, DESCRIPTION, add_options and run, and may have the GROUP of the
    help that it is listed in. `functions` are those of `import ballplate`, `services` what the
    kernel asks for, and `schemas` kinds of files whose module has a function `schema`.
    """

    name: str
    package: str
    commands: Mapping[str, str] = field(default_factory=dict)
    functions: Mapping[str, str] = field(default_factory=dict)
    services: Mapping[str, str] = field(default_factory=dict)
    schemas: Mapping[str, str] = field(default_factory=dict)

    def load(self, module: str) -> ModuleType:
        """A module of the extension.

        :raises MissingExtensionError: the extension is not installed.
        """
        try:
            return import_module(f"{self.package}.{module}")
        except ModuleNotFoundError as error:
            if error.name is None or not f"{self.package}.".startswith(f"{error.name}."):
                raise
            text = f"the extension {self.name} is not installed; install ballplate anew, with it"
            raise MissingExtensionError(text) from None


@cache
def registered() -> tuple[Extension, ...]:
    """Extensions that are installed besides those shipped.

    :raises UnusableError: one of them provides what another one does already.
    """
    found = tuple(point.load() for point in _entry_points())
    known = list(shipped())
    for extension in found:
        if not isinstance(extension, Extension):
            raise UnusableError(f"entry point {ENTRY_POINT}: {extension!r} is no Extension")
        for kind in KINDS:
            for other in known:
                twice = getattr(extension, kind).keys() & getattr(other, kind).keys()
                if twice:
                    raise UnusableError(
                        f"the extensions {other.name} and {extension.name} both provide"
                        f" {min(twice)} ({kind}); uninstall one of them"
                    )
        known.append(extension)
    return found


def _entry_points() -> Iterable[EntryPoint]:
    """Entry points of extensions. Most often there are none, which reading the files of installed
    packages tells in a twentieth of the time that it takes to parse all of them.
    """
    group = f"[{ENTRY_POINT}]".encode()
    if not any(group in path.read_bytes() for path in _files_of_entry_points()):
        return ()
    from importlib.metadata import entry_points

    return entry_points(group=ENTRY_POINT)


def _files_of_entry_points() -> Iterator[Path]:
    for folder in sys.path:
        try:
            names = os.listdir(folder or ".")
        except OSError:
            continue
        for name in names:
            path = Path(folder, name, "entry_points.txt")
            if name.endswith((".dist-info", ".egg-info")) and path.is_file():
                yield path


def shipped() -> tuple[Extension, ...]:
    """Extensions that come with ballplate, whether or not their folders are there."""
    return tuple(import_module(ENTRY_POINT).SHIPPED)


def names(kind: str, with_registered: bool = False) -> tuple[str, ...]:
    """Names that extensions provide of a kind, in the order of the table."""
    extensions = (*shipped(), *(registered() if with_registered else ()))
    return tuple(name for one in extensions for name in getattr(one, kind))


def provider(kind: str, name: str) -> Extension | None:
    """The extension that provides a name; None where none does."""
    for extensions in (shipped, registered):
        for one in extensions():
            if name in getattr(one, kind):
                return one
    return None


def module_with(kind: str, name: str) -> ModuleType:
    """The module that has what a name stands for.

    :raises KeyError: no extension provides it.
    :raises MissingExtensionError: the extension that does is not installed.
    """
    extension = provider(kind, name)
    if extension is None:
        raise KeyError(name)
    return extension.load(getattr(extension, kind)[name])


def service(name: str) -> Any:
    """A function or a class that the kernel asks an extension for.

    :raises MissingExtensionError: the extension is not installed.
    """
    return getattr(module_with("services", name), name)


def optional_service(name: str) -> Any | None:
    """A service, or None where the extension that provides it is not installed."""
    try:
        return service(name)
    except MissingExtensionError:
        return None


def function(name: str) -> Any:
    """A function of `import ballplate` that an extension provides.

    :raises KeyError: no extension provides it.
    :raises MissingExtensionError: the extension that does is not installed.
    """
    return getattr(module_with("functions", name), name)


def optional_function(name: str) -> Any | None:
    """The same, or None where the extension is not installed."""
    try:
        return function(name)
    except MissingExtensionError:
        return None
