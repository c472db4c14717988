"""Keys of an experiment file that extensions provide, and the extensions that a file needs."""

from __future__ import annotations

from typing import Any

from ballplate.simulator.inputs.extensions import (
    MissingExtensionError,
    is_installed,
    module_with,
    owner,
    registered,
    service,
    shipped,
)
from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.problems import Problems

from .references import References
from .validation import Sections


def resolve_own_sections(sections: Sections, references: References) -> dict[str, Any]:
    """Return the entries under keys that extensions provide, converted by their `read` if they
    have one; faults go to the problems.
    """
    check_installed(sections.extensions, references.problems)
    resolved = {}
    for key, settings in sections.own.items():
        reader = getattr(module_with("sections", key), "read", None)
        resolved[key] = settings if reader is None else reader(settings, (key,), references)
    return resolved


def check_installed(names: Any, problems: Problems) -> None:
    """Add a problem for each of the extensions under the key `extensions` that is missing."""
    for i, name in enumerate(names or ()):
        if not is_installed(name):
            text = f'the extension "{name}", which this file needs, is not installed; install it'
            # One that is installed and cannot be loaded has no name.
            problems.add(("extensions", i), "; ".join((text, *registered()[1])))


def needed_extensions(sections: Sections) -> tuple[str, ...]:
    """Names of the extensions that a file states, or has kinds or keys of and are not shipped."""
    classes = {type(part) for part in sections.parts}
    used = {name for settings_class in classes if (name := owner(settings_class)) is not None}
    used -= {extension.name for extension in shipped()}
    return tuple(dict.fromkeys((*(sections.extensions or ()), *sorted(used))))


def needed_service(name: str, steps: Steps, problems: Problems) -> Any | None:
    """Return a service that what is written at `steps` needs, or report its absence."""
    try:
        return service(name)
    except MissingExtensionError as error:
        problems.add(steps, str(error))
        return None
