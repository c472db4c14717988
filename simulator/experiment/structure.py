"""Validation of the sections of an experiment file one by one, so that no error hides another."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cache
from typing import Annotated, Any

from ballplate.simulator.geometry.artefacts import AnyArtefactSettings
from ballplate.simulator.inputs.extensions import MissingExtensionError, names, provided
from ballplate.simulator.inputs.messages import Steps, UnusableError
from ballplate.simulator.inputs.problems import Problems
from ballplate.simulator.inputs.settings import Settings, describe, hint, nearest
from ballplate.simulator.inputs.validation import explain_in, type_adapter
from ballplate.simulator.inputs.wording import LACKING
from ballplate.simulator.inputs.yamltree import Mapping, Node, Scalar, Sequence, to_python
from pydantic import TypeAdapter, ValidationError

from .calibration_kinds import CalibrationSettings
from .influence_settings import AnyInfluence
from .pool_sections import GroupSettings, ListedSettings, PoolSettings, PricedSettings, is_group
from .position_sections import AnyProbe, PositionSettings, StarSettings
from .sections import AnyPrior, ExperimentSettings

# Sections whose entries are validated one by one: form of the section and type of an entry.
ENTRIES: dict[str, tuple[type[Mapping] | type[Sequence], Any]] = {
    "probes": (Mapping, AnyProbe),
    "artefacts": (Mapping, AnyArtefactSettings),
    "positions": (Sequence, PositionSettings),
    "calibration": (Sequence, CalibrationSettings),
    "priors": (Sequence, AnyPrior),
    "stars": (Sequence, StarSettings),
    "influences": (Sequence, AnyInfluence),
}

# Other files of this program, by a key that an experiment has not, and what they are for.
OTHER_FILES = {
    "axes": "this is a sweep of experiments; use it with ballplate sweep",
    "arrangement": (
        "this describes a machine; use it with ballplate map, or name it with kind: machine in an"
        " experiment"
    ),
    "map": (
        "this is the error map of a fit; use it with ballplate correct, map or diff, or name it"
        " as a prior or true machine with kind: map in an experiment"
    ),
}

# Keys that are no extension's.
KEYS = (*ExperimentSettings.model_fields, *OTHER_FILES)


@dataclass(frozen=True)
class Sections:
    """Valid values of a file by path, such as ("machine",) and ("positions", 0)."""

    values: dict[Steps, Any]

    def get(self, *steps: str | int) -> Any:
        """Return the value of a path, or None if it is missing or invalid."""
        return self.values.get(steps)

    def without(self, section: str) -> Sections:
        """Return the sections but for one, as if it were missing or invalid."""
        kept = {steps: value for steps, value in self.values.items() if steps != (section,)}
        return replace(self, values=kept)

    def entries(self, section: str) -> dict[str | int, Any]:
        """Return the right entries of a section by key or index, in the order of the file."""
        return {
            steps[1]: value
            for steps, value in self.values.items()
            if len(steps) == 2 and steps[0] == section
        }


def validate_sections(root: Node, problems: Problems, planning: bool = False) -> Sections:
    """Validate each section separately; faults go to ``problems``.

    For ``planning`` positions may be missing if there is a pool to choose them from.
    """
    fields = ExperimentSettings.model_fields
    values: dict[Steps, Any] = {}
    if not isinstance(root, Mapping):
        text = f"expected a mapping that begins with title: …, found {describe(to_python(root))}"
        problems.add((), text)
        return Sections(values)
    other_kind = next((text for key, text in OTHER_FILES.items() if key in root.items), None)
    if other_kind is not None and "machine" not in root.items:
        problems.add((), other_kind)
        return Sections(values)
    problems.add_empty()
    absent = [name for name in fields if name not in root.items]
    misspelt = set()
    for key, node in root.items.items():
        if key in fields:
            continue
        settings = None if key in KEYS else provided("sections", key, "SETTINGS")
        if settings is not None:
            if not (isinstance(settings, type) and issubclass(settings, Settings)):
                raise UnusableError(f"SETTINGS of the section {key} is no Settings")
            values |= _validate(type_adapter(settings), node, (key,), problems)
            continue
        problems.add((key,), f"unknown key; {_known_key(key, absent)}", True)
        misspelt.add(nearest(key, absent))
    for key, field in fields.items():
        node_or_none = root.items.get(key)
        if node_or_none is None and key in misspelt:
            continue
        is_empty = isinstance(node_or_none, Sequence) and not node_or_none.items
        if key == "positions" and "pool" in root.items and (node_or_none is None or is_empty):
            if not planning:
                missing = "empty" if is_empty else "missing"
                cure = "add positions, or choose some from the pool with: ballplate plan FILE"
                problems.add((key,), f"{missing}; {cure}")
            continue
        if node_or_none is None and field.is_required():
            problems.add((key,), f'missing; add "{key}" ({field.description})')
        elif node_or_none is None:
            values[key,] = field.get_default(call_default_factory=True)  # type: ignore[call-arg,unused-ignore]
        elif key in ENTRIES:
            values |= _validate_entries(key, node_or_none, problems)
        elif key == "pool":
            values |= _validate_pool(node_or_none, problems)
        elif key != "variants":
            values |= _validate(_adapter(key), node_or_none, (key,), problems)
    return Sections(values)


def _known_key(key: str, absent: Iterable[str]) -> str:
    """Return the probable key, those of extensions included."""
    meant = hint(key, (*absent, *names("sections", with_registered=True)))
    return f"{meant}; {LACKING}" if meant.startswith("known") else meant


def _validate_entries(key: str, node: Node, problems: Problems) -> dict[Steps, Any]:
    form, _ = ENTRIES[key]
    description = ExperimentSettings.model_fields[key].description
    if isinstance(node, Scalar) and node.value is None:
        return {}
    if not isinstance(node, form):
        expected = (
            "a mapping, name: …" if form is Mapping else "a list, each entry beginning with “- ”"
        )
        found = describe(
            to_python(node) if isinstance(node, Scalar) else {} if isinstance(node, Mapping) else ()
        )
        problems.add((key,), f"expected {expected}, found {found} ({description})")
        return {}
    if not node.items and key != "calibration":
        problems.add((key,), f"empty; give at least one entry ({description})")
    entries = node.items.items() if isinstance(node, Mapping) else enumerate(node.items)
    values: dict[Steps, Any] = {}
    for step, item in entries:
        values |= _validate(_adapter(key), item, (key, step), problems)
    return values


def _validate_pool(node: Node, problems: Problems) -> dict[Steps, Any]:
    """Values of the pool's times and limits, and of each of its entries."""
    if not isinstance(node, Mapping):
        return _validate(_adapter("pool"), node, ("pool",), problems)
    values: dict[Steps, Any] = {("pool",): None}
    further = {key: item for key, item in node.items.items() if key not in POOL_ENTRIES}
    whole = _validate(_adapter("pool"), replace(node, items=further), ("pool",), problems).get(
        ("pool",)
    )
    whole = whole or PoolSettings.model_validate({})
    values |= {("pool", "times"): whole.times, ("pool", "limits"): whole.limits}
    for key, kind_of in POOL_ENTRIES.items():
        entries = node.items.get(key)
        if isinstance(entries, Sequence):
            for i, item in enumerate(entries.items):
                adapter = type_adapter(kind_of(item))
                values |= _validate(adapter, item, ("pool", key, i), problems)
        elif entries is not None and not (isinstance(entries, Scalar) and entries.value is None):
            form = describe(to_python(entries) if isinstance(entries, Scalar) else {})
            description = PoolSettings.model_fields[key].description
            text = f"expected a list, each entry beginning with “- ”, found {form} ({description})"
            problems.add(("pool", key), text)
    return values


def _kind_of_candidate(node: Node) -> Any:
    # Of one form only, so that a slip is not answered with keys of the other.
    return (
        GroupSettings
        if is_group(node.items if isinstance(node, Mapping) else None)
        else ListedSettings
    )


POOL_ENTRIES: dict[str, Callable[[Node], Any]] = {
    "candidates": _kind_of_candidate,
    "calibration": lambda _: PricedSettings,
}


def _validate(
    adapter: TypeAdapter[Any], node: Node, steps: Steps, problems: Problems
) -> dict[Steps, Any]:
    """Return the value of a node, or report its faults."""
    try:
        return {steps: adapter.validate_python(to_python(node))}
    except ValidationError as error:
        explain_in(problems, error, adapter, node, steps)
    except MissingExtensionError as error:
        problems.add(steps, str(error))
    return {}


@cache
def _adapter(key: str) -> TypeAdapter[Any]:
    return type_adapter(_form(key))


def _form(key: str) -> Any:
    if key in ENTRIES:
        return ENTRIES[key][1]
    field = ExperimentSettings.model_fields[key]
    return Annotated[field.annotation, field]
