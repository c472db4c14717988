"""From a tree of nodes to `Sections`: each validated by itself, so that no error hides another."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Annotated, Any

from ballplate.simulator.geometry.artefacts import AnyArtefactSettings
from ballplate.simulator.geometry.ball_layouts import ArtefactSettings
from ballplate.simulator.inputs.extensions import UnusableError, names, provided
from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.problems import Problems
from ballplate.simulator.inputs.quantities import LengthFunction
from ballplate.simulator.inputs.settings import LACKING, Settings, describe, hint, nearest
from ballplate.simulator.inputs.validation import validated_parts
from ballplate.simulator.inputs.yamltree import (
    Mapping as MappingNode,
    Node,
    Scalar,
    Sequence,
    to_python,
)

from .calibrations import CalibrationSettings
from .pool_sections import (
    GroupSettings,
    LimitsSettings,
    ListedSettings,
    PoolSettings,
    PricedSettings,
    TimesSettings,
    is_group,
)
from .position_sections import AnyProbe, HeadSettings, PositionSettings, StarSettings
from .readings_section import ReadingsSettings
from .sections import (
    AnyInfluence,
    AnyPrior,
    EvaluationSettings,
    ExperimentSettings,
    InfluenceSettings,
    MachineSettings,
)

# A part to be validated: its path, its type and its node.
Part = tuple[Steps, Any, Node]

# Sections whose entries are validated one by one: form of the section and type of an entry.
ENTRIES: dict[str, tuple[type[MappingNode] | type[Sequence], Any]] = {
    "probes": (MappingNode, AnyProbe),
    "artefacts": (MappingNode, AnyArtefactSettings),
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
class PoolSections:
    """Valid parts of a pool: its times and limits, and the entries of its lists by index."""

    times: TimesSettings
    limits: LimitsSettings
    candidates: Mapping[int, Any]
    calibration: Mapping[int, Any]


@dataclass(frozen=True)
class Sections:
    """Valid sections of a file, None where one is missing or invalid, and valid entries of those
    whose entries are validated one by one, by name or index, in the order of the file.

    `invalid`: paths of the other entries. `own`: sections that extensions provide, by key.
    """

    title: Any = None
    description: str | None = None
    machine: MachineSettings | None = None
    error_model: Any = None
    true_machine: Any = None
    probes: Mapping[str, Any] = field(default_factory=dict)
    head: HeadSettings | None = None
    stars: Mapping[int, StarSettings] = field(default_factory=dict)
    artefacts: Mapping[str, ArtefactSettings] = field(default_factory=dict)
    positions: Mapping[int, PositionSettings] = field(default_factory=dict)
    calibration: Mapping[int, Any] = field(default_factory=dict)
    pool: PoolSections | None = None
    priors: Mapping[int, Any] = field(default_factory=dict)
    readings: ReadingsSettings | None = None
    influences: Mapping[int, InfluenceSettings] = field(default_factory=dict)
    evaluation: EvaluationSettings | None = None
    target_uncertainty: LengthFunction | None = None
    coverage_factor: Any = None
    sigma: Any = None
    expected_rank_deficiency: int | None = None
    noise: Any = None
    seed: Any = None
    extensions: tuple[str, ...] | None = None
    own: Mapping[str, Any] = field(default_factory=dict)
    invalid: tuple[Steps, ...] = ()

    @property
    def position_count(self) -> int:
        """Number of positions, valid or not."""
        return len(self.positions) + sum(steps[0] == "positions" for steps in self.invalid)

    @property
    def parts(self) -> Iterator[Any]:
        """All valid sections and entries, those of the pool and of lists one by one; None where one
        is missing.
        """
        pool = vars(self.pool) if self.pool else {}
        for value in (*vars(replace(self, invalid=(), pool=None)).values(), *pool.values()):
            if isinstance(value, dict):
                yield from value.values()
            else:
                yield from value if isinstance(value, tuple) else (value,)


def validate_sections(root: Node, problems: Problems, planning: bool = False) -> Sections:
    """Validate each section separately; faults go to ``problems``.

    For ``planning`` positions may be missing if there is a pool to choose them from.
    """
    if not isinstance(root, MappingNode):
        text = f"expected a mapping that begins with title: …, found {describe(to_python(root))}"
        problems.add((), text)
        return Sections()
    other_kind = next((text for key, text in OTHER_FILES.items() if key in root.items), None)
    if other_kind is not None and "machine" not in root.items:
        problems.add((), other_kind)
        return Sections()
    problems.add_empty()
    # A key that is misspelt is not reported as missing, too, and gets no default.
    misspelt = {
        nearest(key, _absent(root))
        for key in root.items
        if key not in ExperimentSettings.model_fields and not _is_provided(key)
    }
    parts = [
        *_parts_of_extensions(root, problems),
        *_parts_of_kernel(root, misspelt, problems, planning),
    ]
    values = validated_parts(parts, problems)
    # Only keys that are not written get their defaults. A section that is written and invalid stays
    # None, so that nothing is computed with a default in its place.
    sections: dict[str, Any] = {
        key: section.get_default(call_default_factory=True)  # type: ignore[call-arg,unused-ignore]
        for key, section in ExperimentSettings.model_fields.items()
        if key not in (*ENTRIES, "pool", "variants", *root.items, *misspelt)
        and not section.is_required()
    }
    sections |= {key: {} for key in (*ENTRIES, "own")}
    for steps, value in values.items():
        key = str(steps[0])
        if key in ENTRIES:
            sections[key][steps[1]] = value
        elif key in KEYS and key != "pool":
            sections[key] = value
        elif key != "pool":
            sections["own"][key] = value
    # A path of two steps is an entry of a section that is validated entry by entry.
    invalid = tuple(steps for steps, _, _ in parts if len(steps) == 2 and steps not in values)
    return Sections(**sections, pool=_pool(root, values), invalid=invalid)


def _parts_of_extensions(root: MappingNode, problems: Problems) -> Iterator[Part]:
    """Sections whose keys extensions provide; unknown keys are reported."""
    absent = _absent(root)
    for key, node in root.items.items():
        if key in ExperimentSettings.model_fields:
            continue
        settings = None if key in KEYS else provided("sections", key, "SETTINGS")
        if settings is None:
            problems.add((key,), f"unknown key; {_known_key(key, absent)}", True)
        elif not (isinstance(settings, type) and issubclass(settings, Settings)):
            raise UnusableError(f"SETTINGS of the section {key} is no Settings")
        else:
            yield (key,), settings, node


def _parts_of_kernel(
    root: MappingNode, misspelt: Collection[str | None], problems: Problems, planning: bool
) -> Iterator[Part]:
    """Sections, and entries of those that are validated one by one; missing ones are reported."""
    for key, section in ExperimentSettings.model_fields.items():
        node = root.items.get(key)
        if node is None and key in misspelt:
            continue
        is_empty = isinstance(node, Sequence) and not node.items
        if key == "positions" and "pool" in root.items and (node is None or is_empty):
            if not planning:
                missing = "empty" if is_empty else "missing"
                cure = "add positions, or choose some from the pool with: ballplate plan FILE"
                problems.add((key,), f"{missing}; {cure}")
        elif node is None and section.is_required():
            problems.add((key,), f'missing; add "{key}" ({section.description})')
        elif node is None or key == "variants":
            continue
        elif key in ENTRIES:
            yield from _entries(key, node, problems)
        elif key == "pool":
            yield from _parts_of_pool(node, problems)
        else:
            yield (key,), _form(key), node


def _absent(root: MappingNode) -> list[str]:
    return [name for name in ExperimentSettings.model_fields if name not in root.items]


def _is_provided(key: str) -> bool:
    return key not in KEYS and provided("sections", key, "SETTINGS") is not None


def _known_key(key: str, absent: Iterable[str]) -> str:
    """Return the probable key, those of extensions included."""
    meant = hint(key, (*absent, *names("sections", with_registered=True)))
    return f"{meant}; {LACKING}" if meant.startswith("known") else meant


def _entries(key: str, node: Node, problems: Problems) -> Iterator[Part]:
    form, kind = ENTRIES[key]
    description = ExperimentSettings.model_fields[key].description
    if isinstance(node, Scalar) and node.value is None:
        return
    if not isinstance(node, form):
        expected = (
            "a mapping, name: …"
            if form is MappingNode
            else "a list, each entry beginning with “- ”"
        )
        text = f"expected {expected}, found {_described(node)} ({description})"
        problems.add((key,), text)
        return
    if not node.items and key != "calibration":
        problems.add((key,), f"empty; give at least one entry ({description})")
    entries = node.items.items() if isinstance(node, MappingNode) else enumerate(node.items)
    for step, item in entries:
        yield (key, step), kind, item


def _parts_of_pool(node: Node, problems: Problems) -> Iterator[Part]:
    """The pool's times and limits as one part, and each of its entries."""
    if not isinstance(node, MappingNode):
        yield ("pool",), _form("pool"), node
        return
    further = {key: item for key, item in node.items.items() if key not in POOL_ENTRIES}
    yield ("pool",), _form("pool"), replace(node, items=further)
    for key, kind_of in POOL_ENTRIES.items():
        entries = node.items.get(key)
        if isinstance(entries, Sequence):
            for i, item in enumerate(entries.items):
                yield ("pool", key, i), kind_of(item), item
        elif entries is not None and not (isinstance(entries, Scalar) and entries.value is None):
            description = PoolSettings.model_fields[key].description
            text = (
                "expected a list, each entry beginning with “- ”, found"
                f" {_described(entries)} ({description})"
            )
            problems.add(("pool", key), text)


def _pool(root: MappingNode, values: Mapping[Steps, Any]) -> PoolSections | None:
    if not isinstance(root.items.get("pool"), MappingNode):
        return None
    whole = values.get(("pool",)) or PoolSettings.model_validate({})
    entries: dict[str, dict[int, Any]] = {key: {} for key in POOL_ENTRIES}
    for steps, value in values.items():
        if len(steps) == 3 and steps[0] == "pool":
            entries[str(steps[1])][int(steps[2])] = value
    return PoolSections(whole.times, whole.limits, entries["candidates"], entries["calibration"])


def _described(node: Node) -> str:
    """Return what a node is, without its content."""
    if isinstance(node, Scalar):
        return describe(node.value)
    return describe({} if isinstance(node, MappingNode) else ())


def _kind_of_candidate(node: Node) -> Any:
    # Of one form only, so that a slip is not answered with keys of the other.
    return (
        GroupSettings
        if is_group(node.items if isinstance(node, MappingNode) else None)
        else ListedSettings
    )


POOL_ENTRIES: dict[str, Callable[[Node], Any]] = {
    "candidates": _kind_of_candidate,
    "calibration": lambda _: PricedSettings,
}


@cache
def _form(key: str) -> Any:
    section = ExperimentSettings.model_fields[key]
    # A type together with the constraints of its field: by itself a section is validated as it
    # would be within the whole.
    return Annotated[section.annotation, section]
