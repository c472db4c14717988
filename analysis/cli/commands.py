"""Commands by name: those of the kernel, and those that extensions provide."""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType

from ballplate.simulator.inputs.extensions import (
    Command,
    module_with,
    names,
    provider,
    registered,
)
from ballplate.simulator.inputs.unusable import UnusableError

# Modules of this package, in the order of the help.
COMMANDS = {
    "init": Command("init", "write a commented experiment or machine file to start from", "plan"),
    "check": Command("check", "check whether designs determine all their parameters", "plan"),
    "run": Command("run", "predict the uncertainties U1 to U6 that a design will achieve", "plan"),
    "simulate": Command("simulate", "write synthetic readings of a design", "measure"),
    "fit": Command("fit", "estimate machine errors, balls and poses from readings", "evaluate"),
    "schema": Command("schema", "print the JSON Schema of experiment, sweep, machine or map files"),
}
# Groups of commands in the help, with their titles.
GROUPS = {
    "plan": "plan an experiment",
    "measure": "measure",
    "evaluate": "evaluate readings",
    "use": "use the machine's map",
    "more": "more",
}


def commands_of_all() -> tuple[str, ...]:
    """The commands of the kernel, then those of extensions."""
    return (*COMMANDS, *names("commands", with_registered=True))


def tell_of_extensions() -> None:
    """Say which extensions that are registered are not used."""
    for complaint in registered()[1]:
        print(f"warning: {complaint}", file=sys.stderr)


def module_of(name: str) -> ModuleType:
    """The module of a command.

    :raises KeyError: there is no such command.
    :raises UnusableError: the extension that has it is not installed, or cannot be used.
    """
    if name in COMMANDS:
        return import_module(f".{name}", __package__)
    module = module_with("commands", name)
    if lacking := [
        needed for needed in ("DESCRIPTION", "add_options", "run") if not hasattr(module, needed)
    ]:
        raise UnusableError(f"its module lacks {', '.join(lacking)}")
    return module


def command_of(name: str) -> Command | None:
    """Return the listing of a command, unless its extension is not installed.

    :raises KeyError: there is no such command.
    """
    if name in COMMANDS:
        return COMMANDS[name]
    extension = provider("commands", name)
    if extension is None:
        raise KeyError(name)
    return extension.commands[name] if extension.is_installed else None
