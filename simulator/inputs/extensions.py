"""Extensions of ballplate, and what each of them provides by name.

The kernel imports no extension. It asks here for a command, a function, a service, a kind in a file
or a quantity by its name, and what provides it is loaded then. Extensions that are shipped stand in
the table `ballplate.extensions.SHIPPED`; those that are installed besides register an `Extension`
by the entry point `ballplate.extensions`. They are looked up for names that neither the table nor
the kernel has, and where all names are needed, as by `--help`, `schema` and tables of quantities.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from .unusable import UnusableError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

ENTRY_POINT = "ballplate.extensions"
OF_FILES = ("artefacts", "calibrations", "error_models", "influences", "sections")
KINDS = ("commands", "functions", "services", "schemas", *OF_FILES, "quantities")

# Where the kernel's own names of a kind are; it has no services.
_OWN = {
    "commands": ("cli", "COMMANDS"),
    "functions": ("", "__all__"),
    "schemas": ("cli.schema", "SCHEMAS"),
    "artefacts": ("simulator.geometry.artefacts", "ARTEFACTS"),
    "calibrations": ("simulator.design.observations.kinds", "KINDS"),
    "error_models": ("simulator.machines.settings", "KINDS"),
    "influences": ("simulator.design.influences.kinds", "KINDS"),
    "sections": ("simulator.experiment.structure", "KEYS"),
    "quantities": ("uncertainty.kernel_quantities", "KERNEL_QUANTITIES"),
}


class MissingExtensionError(UnusableError):
    """An extension that is needed is not installed."""


class MissingNameError(MissingExtensionError, AttributeError):
    """A name of `import ballplate` is of an extension that is not installed."""


@dataclass(frozen=True)
class Command:
    """A command, by its `module`, which has DESCRIPTION, add_options and run; `help` is its line of
    the help, in a `group` of that.

    The name of a command may be that of another with an option, such as "run --lengths": the option
    makes another command of it.
    """

    module: str
    help: str
    group: str = "more"


@dataclass(frozen=True)
class Extension:
    """What a `package` provides, each name with the module below the package that has it.

    `functions` are those of `import ballplate`, `services` what the kernel asks for, and `schemas`
    kinds of files whose module has a function `schema`.

    `artefacts`, `calibrations`, `error_models` and `influences` are kinds that a file names by
    `kind`, and `sections` further keys of an experiment; their modules have SETTINGS, the class of
    what is written there. Those of calibrations and, where they need one, sections have a function
    `read`, and those of error models an ERROR_MODEL. A module of `quantities` has a QUANTITY.
    """

    name: str
    package: str
    commands: Mapping[str, Command] = field(default_factory=dict)
    functions: Mapping[str, str] = field(default_factory=dict)
    services: Mapping[str, str] = field(default_factory=dict)
    schemas: Mapping[str, str] = field(default_factory=dict)
    artefacts: Mapping[str, str] = field(default_factory=dict)
    calibrations: Mapping[str, str] = field(default_factory=dict)
    error_models: Mapping[str, str] = field(default_factory=dict)
    influences: Mapping[str, str] = field(default_factory=dict)
    sections: Mapping[str, str] = field(default_factory=dict)
    quantities: Mapping[str, str] = field(default_factory=dict)

    @property
    def is_installed(self) -> bool:
        """Whether its package is there."""
        try:
            return find_spec(self.package) is not None
        except ModuleNotFoundError:
            return False

    def load(self, module: str) -> ModuleType:
        """A module of the extension.

        :raises MissingExtensionError: the extension, or one that it builds on, is not installed.
        :raises UnusableError: a module of an extension that is not shipped cannot be loaded.
        """
        try:
            return import_module(f"{self.package}.{module}")
        except Exception as error:
            if (gone := missing(error)) is not None:
                raise gone from None
            if self in shipped():
                raise
            text = f"module {module} cannot be loaded ({_in_words(error)}); mend or uninstall it"
            raise UnusableError(f"extension {self.name}: {text}") from error


def missing(error: BaseException) -> MissingExtensionError | None:
    """What to say of an error that comes of a shipped extension's absence; None of any other."""
    if not isinstance(error, ModuleNotFoundError) or error.name is None:
        return None
    for extension in shipped():
        if f"{error.name}.".startswith(f"{extension.package}."):
            text = f"the extension {extension.name} is not installed; install ballplate anew"
            return MissingExtensionError(f"{text}, with it")
    return None


def _in_words(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"


@dataclass(frozen=True)
class Registered:
    """Extensions that are installed besides those shipped, and what is wrong with others."""

    extensions: tuple[Extension, ...]
    complaints: tuple[str, ...]


@cache
def registered() -> Registered:
    """Extensions of other packages. What cannot be loaded, or provides a name that ballplate or
    another extension has, is left out.
    """
    found, complaints = list[Extension](), list[str]()
    for point in _entry_points():
        package = point.dist.name if point.dist is not None else point.value
        try:
            extension = _checked(point.load(), found)
        except Exception as error:
            words = str(error) if isinstance(error, UnusableError) else _in_words(error)
            complaints.append(f"entry point {point.name} of {package} is not used: {words}")
        else:
            found.append(extension)
    return Registered(tuple(found), tuple(complaints))


def _checked(extension: object, before: Sequence[Extension]) -> Extension:
    """An extension that may be used beside those before it.

    :raises UnusableError: it is none, or provides what is there already.
    """
    if not isinstance(extension, Extension):
        raise UnusableError(f"{extension!r} is no Extension")
    if extension.name in {other.name for other in (*shipped(), *before)}:
        raise UnusableError(f"another extension has the name {extension.name} already")
    for kind in KINDS:
        modules = getattr(extension, kind)
        if not isinstance(modules, Mapping):
            raise UnusableError(f"its {kind} are no mapping of names to modules")
        for name, module in modules.items():
            if not isinstance(module, Command if kind == "commands" else str):
                what = "Command" if kind == "commands" else "name of a module"
                raise UnusableError(f"{name} ({kind}) is {module!r}, and no {what}")
            first = "ballplate" if name in _own(kind) else None
            for other in (*shipped(), *before):
                first = other.name if name in getattr(other, kind) else first
            if first is not None:
                raise UnusableError(f"{name} ({kind}) is provided by {first} already")
    return extension


def _own(kind: str) -> Collection[str]:
    """Names of a kind that the kernel has itself."""
    if kind not in _OWN:
        return ()
    module, table = _OWN[kind]
    return tuple(getattr(import_module(f"ballplate.{module}".rstrip(".")), table))


def _entry_points() -> Iterator[EntryPoint]:
    """Entry points of extensions. Most often there are none, which reading the files of installed
    packages tells in a twentieth of the time that it takes to parse all of them.
    """
    folders = list(filter(_has_extensions, sys.path))
    if folders:
        from importlib.metadata import distributions

        for distribution in distributions(path=folders):
            yield from distribution.entry_points.select(group=ENTRY_POINT)


def _has_extensions(folder: str) -> bool:
    """Whether packages that are installed in a folder, not the current one, register extensions."""
    group = f"[{ENTRY_POINT}]".encode()
    with suppress(OSError):
        if os.path.samefile(folder or ".", "."):
            return False
        for name in os.listdir(folder):
            if name.endswith((".dist-info", ".egg-info")):
                with suppress(OSError):
                    if group in Path(folder, name, "entry_points.txt").read_bytes():
                        return True
    return False


def shipped() -> tuple[Extension, ...]:
    """Extensions that come with ballplate, whether or not their folders are there."""
    return tuple(import_module(ENTRY_POINT).SHIPPED)


def _shipped_and_registered() -> tuple[Extension, ...]:
    return (*shipped(), *registered().extensions)


def names(kind: str, with_registered: bool = False) -> tuple[str, ...]:
    """Names that extensions provide of a kind, in the order of the table."""
    extensions = _shipped_and_registered() if with_registered else shipped()
    return tuple(name for one in extensions for name in getattr(one, kind))


def installed_functions() -> tuple[str, ...]:
    """Functions of extensions that are there, shipped or installed besides."""
    there = (*(one for one in shipped() if one.is_installed), *registered().extensions)
    return tuple(name for one in there for name in one.functions)


def provider(kind: str, name: str) -> Extension | None:
    """The extension that provides a name; None where none does."""
    for one in shipped():
        if name in getattr(one, kind):
            return one
    for one in registered().extensions:
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
    provided = getattr(extension, kind)[name]
    return extension.load(provided.module if isinstance(provided, Command) else provided)


def provided(kind: str, name: str, attribute: str) -> Any | None:
    """An attribute of the module that has what a name stands for; None where no extension
    provides it.

    :raises UnusableError: the module cannot be loaded, or lacks it.
    """
    extension = provider(kind, name)
    if extension is None:
        return None
    module = getattr(extension, kind)[name]
    found = getattr(extension.load(module), attribute, None)
    if found is None:
        text = f"module {module} has no {attribute}, which {kind} need"
        raise UnusableError(f"extension {extension.name}: {text}")
    return found


def fault_of(error: Exception) -> str | None:
    """Where code of an extension that is not shipped raised an error, and which; None of others."""
    packages = {extension.package: extension.name for extension in registered().extensions}
    fault, trace = None, error.__traceback__
    while trace is not None:
        module = f"{trace.tb_frame.f_globals.get('__name__')}."
        for package, name in packages.items():
            if module.startswith(f"{package}."):
                where = f"{trace.tb_frame.f_code.co_filename}:{trace.tb_lineno}"
                fault = f"{where}: extension {name}: {_in_words(error)}; mend or uninstall it"
        trace = trace.tb_next
    return fault


def owner(class_: type) -> str | None:
    """The name of the extension that a class is of; None of one of the kernel."""
    module = f"{class_.__module__}."
    if module.startswith("ballplate.") and not module.startswith(f"{ENTRY_POINT}."):
        return None
    extensions = _shipped_and_registered()
    return next((one.name for one in extensions if module.startswith(f"{one.package}.")), None)


def is_installed(name: str) -> bool:
    """Whether an extension is, by its name."""
    return any(one.name == name for one in _shipped_and_registered())


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
