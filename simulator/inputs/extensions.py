"""Extensions of ballplate, and the names that each provides.

The kernel imports no extension. It asks here by name for a command, function, service, kind in a
file or quantity, and then loads the module that provides it. Shipped extensions are listed in
`ballplate.extensions.SHIPPED`; others register an `Extension` by the entry point
`ballplate.extensions`. Entry points are read for names that neither that list nor the kernel has,
and for complete lists of names (`--help`, `schema`, tables of quantities).
"""

from __future__ import annotations

import os
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache, wraps
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import FunctionType, ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


class UnusableError(Exception):
    """An object cannot be used; the text has fact, reason and remedy."""


ENTRY_POINT = "ballplate.extensions"
OF_FILES = (
    "artefacts",
    "calibrations",
    "error_models",
    "true_machines",
    "influences",
    "sections",
)
KINDS = ("commands", "functions", "services", "schemas", *OF_FILES, "quantities")

# Modules and tables of the kernel's names; the kernel has no services and no influence quantities.
_KERNEL_TABLES = {
    "commands": ("cli._parsers", "COMMANDS"),
    "functions": ("", "__all__"),
    "schemas": ("cli.schema", "SCHEMAS"),
    "artefacts": ("simulator.geometry.artefacts", "ARTEFACTS"),
    "calibrations": ("simulator.experiment.calibrations", "KINDS"),
    "error_models": ("simulator.machines.settings", "KINDS"),
    "true_machines": ("simulator.machines.truth", "KINDS"),
    "sections": ("simulator.experiment.validation", "KEYS"),
    "quantities": ("uncertainty.quantities", "KERNEL_QUANTITIES"),
}


class MissingExtensionError(UnusableError):
    """A needed extension is not installed."""


class MissingNameError(MissingExtensionError, AttributeError):
    """A name of `import ballplate` belongs to an extension that is not installed."""


@dataclass(frozen=True)
class Command:
    """A command: its `module`, which has DESCRIPTION, add_options and run, its line `help` and its
    `group` in the help.

    A name such as "run --errors" makes a separate command of another command's option.
    """

    module: str
    help: str
    group: str = "more"


@dataclass(frozen=True)
class Extension:
    """Names that a `package` provides, each with its module below the package.

    `functions` are those of `import ballplate`, `services` those that the kernel uses, or another
    extension that can do without, and `schemas` types of files whose module has a function
    `schema`.

    `artefacts`, `calibrations`, `error_models`, `true_machines` and `influences` are values of
    `kind` in a file, and `sections` further keys of an experiment; their modules have SETTINGS, the
    class of their values. Modules of calibrations and true machines, and of sections that need one,
    have a function `read`, those of error models an ERROR_MODEL, those of `quantities` a QUANTITY.
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
    true_machines: Mapping[str, str] = field(default_factory=dict)
    influences: Mapping[str, str] = field(default_factory=dict)
    sections: Mapping[str, str] = field(default_factory=dict)
    quantities: Mapping[str, str] = field(default_factory=dict)

    @property
    def is_installed(self) -> bool:
        """Return whether the package is there."""
        try:
            return find_spec(self.package) is not None
        except ModuleNotFoundError:
            return False

    def load(self, module: str) -> ModuleType:
        """Return a module of the extension.

        :raises MissingExtensionError: the extension, or one that it uses, is not installed.
        :raises UnusableError: a module of an extension that is not shipped cannot be loaded.
        """
        try:
            return import_module(f"{self.package}.{module}")
        except Exception as error:
            if (gone := missing(error)) is not None:
                raise gone from None
            if self in shipped():
                raise
            text = f"module {module} cannot be loaded ({_described(error)}); mend or uninstall it"
            raise UnusableError(f"extension {self.name}: {text}") from error


def missing(error: BaseException) -> MissingExtensionError | None:
    """Return the error that names a shipped extension whose absence caused an error, or None."""
    if not isinstance(error, ModuleNotFoundError) or error.name is None:
        return None
    for extension in shipped():
        if f"{error.name}.".startswith(f"{extension.package}."):
            text = f"the extension {extension.name} is not installed; install ballplate again"
            return MissingExtensionError(f"{text}, with it")
    return None


def _described(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"


@cache
def registered() -> tuple[tuple[Extension, ...], tuple[str, ...]]:
    """Return extensions of other packages, and why others, which cannot be loaded or provide a name
    that ballplate or another extension has, are refused.
    """
    extensions, complaints = list[Extension](), list[str]()
    for point in _entry_points():
        package = point.dist.name if point.dist is not None else point.value
        try:
            extension = _checked(point.load(), extensions)
        except Exception as error:
            reason = str(error) if isinstance(error, UnusableError) else _described(error)
            complaints.append(f"entry point {point.name} of {package} is not used: {reason}")
        else:
            extensions.append(extension)
    return tuple(extensions), tuple(complaints)


def _checked(extension: object, before: Sequence[Extension]) -> Extension:
    """Return an extension that is compatible with those before it.

    :raises UnusableError: it is no extension, or provides a name that exists already.
    """
    if not isinstance(extension, Extension):
        raise UnusableError(f"{extension!r} is no Extension")
    if extension.name in {earlier.name for earlier in (*shipped(), *before)}:
        raise UnusableError(f"another extension has the name {extension.name} already")
    for kind in KINDS:
        modules = getattr(extension, kind)
        if not isinstance(modules, Mapping):
            raise UnusableError(f"its {kind} are no mapping of names to modules")
        for name, module in modules.items():
            if not isinstance(module, Command if kind == "commands" else str):
                expected = "Command" if kind == "commands" else "name of a module"
                raise UnusableError(f"{name} ({kind}) is {module!r}, and no {expected}")
            first = "ballplate" if name in _kernel_names(kind) else None
            for earlier in (*shipped(), *before):
                first = earlier.name if name in getattr(earlier, kind) else first
            if first is not None:
                raise UnusableError(f"{name} ({kind}) is provided by {first} already")
    return extension


def _kernel_names(kind: str) -> Collection[str]:
    if kind not in _KERNEL_TABLES:
        return ()
    module, table = _KERNEL_TABLES[kind]
    return tuple(getattr(import_module(f"ballplate.{module}".rstrip(".")), table))


def _entry_points() -> Iterator[EntryPoint]:
    # Searching the files for the group takes a twentieth of the time that parsing all of them does,
    # and most often finds none.
    folders = list(filter(_has_extensions, sys.path))
    if folders:
        from importlib.metadata import distributions

        for distribution in distributions(path=folders):
            yield from distribution.entry_points.select(group=ENTRY_POINT)


def _has_extensions(folder: str) -> bool:
    """Return whether packages installed in a folder, not the current one, register extensions."""
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
    """Return the extensions that come with ballplate, whether or not their folders are there."""
    return tuple(import_module(ENTRY_POINT).SHIPPED)


def _shipped_and_registered() -> tuple[Extension, ...]:
    return (*shipped(), *registered()[0])


def names(kind: str, with_registered: bool = False) -> tuple[str, ...]:
    """Return names of a kind that extensions provide, in the order of the table."""
    extensions = _shipped_and_registered() if with_registered else shipped()
    return tuple(name for extension in extensions for name in getattr(extension, kind))


def installed_functions() -> tuple[str, ...]:
    """Return functions of installed extensions."""
    there = (extension for extension in shipped() if extension.is_installed)
    extensions = (*there, *registered()[0])
    return tuple(name for extension in extensions for name in extension.functions)


def provider(kind: str, name: str) -> Extension | None:
    """Return the extension that provides a name, or None."""
    # Entry points are read only for a name that is not shipped.
    for extensions in (shipped, lambda: registered()[0]):
        for extension in extensions():
            if name in getattr(extension, kind):
                return extension
    return None


def module_with(kind: str, name: str) -> ModuleType:
    """Return the module that has a name's object.

    :raises KeyError: no extension provides it.
    :raises MissingExtensionError: its extension is not installed.
    """
    extension = provider(kind, name)
    if extension is None:
        raise KeyError(name)
    provided = getattr(extension, kind)[name]
    return extension.load(provided.module if isinstance(provided, Command) else provided)


def provided(kind: str, name: str, attribute: str) -> Any | None:
    """Return an attribute of the module that has a name's object; None if no extension provides it.

    :raises UnusableError: the module cannot be loaded, or lacks it.
    """
    extension = provider(kind, name)
    if extension is None:
        return None
    module = getattr(extension, kind)[name]
    value = getattr(extension.load(module), attribute, None)
    if value is None:
        text = f"module {module} has no {attribute}, which {kind} need"
        raise UnusableError(f"extension {extension.name}: {text}")
    return value


def fault_of(error: Exception) -> str | None:
    """Return file, line and name of the extension, not shipped, whose code raised an error, or
    None.
    """
    # The innermost frame of such an extension is named: it is nearest to the cause.
    packages = {extension.package: extension.name for extension in registered()[0]}
    fault, trace = None, error.__traceback__
    while trace is not None:
        module = f"{trace.tb_frame.f_globals.get('__name__')}."
        for package, name in packages.items():
            if module.startswith(f"{package}."):
                line = f"{trace.tb_frame.f_code.co_filename}:{trace.tb_lineno}"
                fault = f"{line}: extension {name}: {_described(error)}; mend or uninstall it"
        trace = trace.tb_next
    return fault


def owner(class_: type) -> str | None:
    """Return the name of the extension that has a class; None for the kernel."""
    module = f"{class_.__module__}."
    if module.startswith("ballplate.") and not module.startswith(f"{ENTRY_POINT}."):
        return None
    extensions = _shipped_and_registered()
    return next(
        (extension.name for extension in extensions if module.startswith(f"{extension.package}.")),
        None,
    )


def is_installed(name: str) -> bool:
    """Return whether an extension of this name is there."""
    return any(extension.name == name for extension in _shipped_and_registered())


def service(name: str) -> Any:
    """Return a function or class of an extension that the kernel uses.

    :raises MissingExtensionError: the extension is not installed.
    """
    return getattr(module_with("services", name), name)


def optional_service(name: str) -> Any | None:
    """Return a service, or None if its extension is not installed."""
    try:
        return service(name)
    except MissingExtensionError:
        return None


def function(name: str) -> Any:
    """Return a function of `import ballplate` that an extension provides.

    :raises KeyError: no extension provides it.
    :raises MissingExtensionError: its extension is not installed.
    """
    value = getattr(module_with("functions", name), name)
    # A function of an installed extension may need a missing one when it is called. If none is
    # missing, the function itself is returned.
    are_all_there = all(extension.is_installed for extension in shipped())
    return value if are_all_there or not isinstance(value, FunctionType) else _naming(value)


def _naming(function: FunctionType) -> Any:
    """Return a function that names the extension that it lacks when it is called."""

    @wraps(function)
    def named(*arguments: Any, **settings: Any) -> Any:
        try:
            return function(*arguments, **settings)
        except ModuleNotFoundError as error:
            if (gone := missing(error)) is not None:
                raise gone from None
            raise

    return named
