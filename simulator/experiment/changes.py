"""Experiments that are changed: variants of a file, and changes in Python."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping as AnyMapping, Sequence as AnySequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from ballplate.simulator.inputs.extensions import provider
from ballplate.simulator.inputs.messages import ExperimentError, Message, format_path
from ballplate.simulator.inputs.problems import Problems
from ballplate.simulator.inputs.settings import describe, hint, listing
from ballplate.simulator.inputs.yamltree import (
    Mapping,
    Mark,
    Node,
    Scalar,
    Sequence,
    child,
    to_python,
)

from .sections import ExperimentSettings

MOST_VARIANTS = 1000
# Balls, balls read, calibrated values, priors and evaluation points of all variants of a file,
# which are loaded together.
MOST_OF_ALL = 2_000_000
STEP = re.compile(r"(?:(?:^|\.)([^.\[\]]+)|\[([^\]]*)\])")


def variant_trees(root: Node, problems: Problems) -> dict[str, Node]:
    """Return the tree of every variant by name; those that cannot be made go to ``problems``."""
    section = child(root, "variants")
    trees: dict[str, Node] = {}
    if section is None or not isinstance(root, Mapping):
        return trees
    if not isinstance(section, Mapping) or not section.items:
        form = "nothing" if isinstance(section, Mapping) else describe(_shallow(section))
        problems.add(("variants",), f"expected a mapping, name: {{path: new value}}, found {form}")
        return trees
    if len(section.items) > MOST_VARIANTS:
        text = f"{len(section.items)} variants are too many; at most {MOST_VARIANTS} are possible"
        problems.add(("variants",), text)
        return trees
    base = replace(
        root,
        items={key: node for key, node in root.items.items() if key != "variants"},
        key_marks={key: mark for key, mark in root.key_marks.items() if key != "variants"},
    )
    for name, overrides in section.items.items():
        if not isinstance(overrides, Mapping):
            problems.add(
                ("variants", name),
                f"expected a mapping, path: new value, found {describe(_shallow(overrides))}",
            )
            continue
        tree: Node = base
        before = len(problems.messages)
        places: dict[str, tuple[str, ...]] = {}
        for path, node in overrides.items.items():
            try:
                # Paths name entries of the file as it stands. Two paths of which one contains the
                # other would depend on their order.
                place = place_of(base, path)
                overlapping = next(
                    (p for p, steps in places.items() if overlap(steps, place)), None
                )
                if overlapping is not None:
                    raise ValueError(f'overlaps the path "{overlapping}"; replace it once')
                places[path] = place
                tree = override(tree, path, node, overrides.key_marks[path])
            except ValueError as error:
                problems.add(("variants", name, path), str(error), of_key=True)
        if len(problems.messages) == before:
            trees[name] = tree
    return trees


def node_at(root: Node, path: str) -> Node | None:
    """Return the value at a path, or None if it is missing.

    :raises ValueError: the path is malformed, or an entry of a list does not exist.
    """
    node: Node | None = root
    for step in place_of(root, path):
        node = child(node, int(step) if isinstance(node, Sequence) else step)
    return node


def override(root: Node, path: str, value: Node, mark: Mark) -> Node:
    """Return the tree with the node at a path replaced; ``mark`` is the location of the override.

    :raises ValueError: the path is malformed, or passes through a missing entry.
    """
    steps = steps_of(path)
    if (
        len(steps) == 1
        and steps[0] not in ExperimentSettings.model_fields
        and provider("sections", str(steps[0])) is None
        or steps[0] == "variants"
    ):
        section_names = [key for key in ExperimentSettings.model_fields if key != "variants"]
        raise ValueError(
            f'"{steps[0]}" cannot be replaced in a variant; {hint(steps[0], section_names)}'
        )
    return _replaced(root, steps, value, mark, ())


def removed(root: Node, path: str) -> Node:
    """Return the tree without the entry of a mapping or a list at a path.

    :raises ValueError: the path is malformed, or there is no value.
    """
    return _replaced(root, steps_of(path), None, root.mark, ())


def steps_of(path: str) -> list[str]:
    """Steps of a path.

    :raises ValueError: the path is malformed.
    """
    steps = [match[1] or match[2] or "" for match in STEP.finditer(path)]
    if not path or "".join(match[0] for match in STEP.finditer(path)) != path or "" in steps:
        raise ValueError(
            f'"{path}" is not a path; write for example positions[1].level or artefacts.plate.size'
        )
    return steps


def place_of(root: Node, path: str) -> tuple[str, ...]:
    """Return the steps of a path with entries of lists by index, so that each node has one name.

    :raises ValueError: the path is malformed, or an entry of a list does not exist.
    """
    node: Node | None = root
    parts: list[str] = []
    for step in steps_of(path):
        if isinstance(node, Sequence):
            i = _index(node, step, tuple(parts))
            node, step = node.items[i], str(i)
        else:
            node = child(node, step) if node is not None else None
        parts.append(step)
    return tuple(parts)


def overlap(first: tuple[str, ...], second: tuple[str, ...]) -> bool:
    shorter = min(len(first), len(second))
    return first[:shorter] == second[:shorter]


def _replaced(
    node: Node, steps: list[str], value: Node | None, mark: Mark, above: tuple[str, ...]
) -> Node:
    """Return a tree with the value at some steps, or without the entry there."""
    step, deeper, here = steps[0], steps[1:], (*above, steps[0])
    if isinstance(node, Mapping):
        if step not in node.items and (deeper or value is None):
            raise ValueError(f"there is no {format_path(here)}; {hint(step, node.items)}")
        below = _replaced(node.items[step], deeper, value, mark, here) if deeper else value
        if below is None:
            return replace(node, items={key: node.items[key] for key in node.items if key != step})
        # Nodes beside the path are those of the first tree. Whether a part has changed is then a
        # comparison by identity, and messages about it have one location for all variants.
        marks = node.key_marks if deeper else {**node.key_marks, step: mark}
        return replace(node, items={**node.items, step: below}, key_marks=marks)
    if isinstance(node, Sequence):
        i = _index(node, step, above)
        below = _replaced(node.items[i], deeper, value, mark, here) if deeper else value
        kept = () if below is None else (below,)
        return replace(node, items=(*node.items[:i], *kept, *node.items[i + 1 :]))
    named = format_path(above) or "the experiment"
    raise ValueError(f"{named} is {describe(node.value)} and has no entries; replace it as a whole")


def _index(node: Sequence, step: str, above: tuple[str, ...]) -> int:
    # No more digits, since conversion of thousands of them takes long or is refused.
    if re.fullmatch(r"[0-9]{1,9}", step):
        if int(step) < len(node.items):
            return int(step)
        last = len(node.items) - 1
        indices = f"the indices are 0 to {last}" if node.items else "the list is empty"
        raise ValueError(f"there is no {format_path(above)}[{step}]; {indices}")
    if not above:
        raise ValueError("the experiment is a list; write its sections, such as machine, as keys")
    names = [_name(item) for item in node.items]
    if names.count(step) == 1:
        return names.index(step)
    if step in names:
        raise ValueError(
            f'several entries of {format_path(above)} are named "{step}"; use an index'
        )
    known_names = [name for name in names if name is not None]
    advice = hint(step, known_names) if known_names else f"use an index, 0 to {len(names) - 1}"
    raise ValueError(f'there is no "{step}" in {format_path(above)}; {advice}')


def _name(node: Node) -> str | None:
    name = child(node, "name")
    return str(name.value) if isinstance(name, Scalar) else None


def _shallow(node: Node) -> object:
    return to_python(node) if isinstance(node, Scalar) else ()


def in_variants(names: list[str], all_names: list[str]) -> str:
    """Return the variants in which a message holds; empty for all.

    >>> in_variants(["A"], ["A", "B"])
    ' (in variant A)'
    """
    if len(names) == len(all_names):
        return ""
    return f" (in variant{'s' if len(names) > 1 else ''} {listing(names, 4)})"


def unknown_variants(
    files: AnySequence[Path], wanted: AnySequence[str], variant_names: Collection[str | None]
) -> tuple[Message, ...]:
    """Return messages about variants that are in no file; `variant_names` are the existing
    ones.
    """
    every, known_variants = (
        ", ".join(map(str, files)),
        sorted(name for name in variant_names if name is not None),
    )
    texts = [
        f'no variant "{name}"; {hint(name, known_variants)}'
        for name in wanted
        if name not in known_variants
    ]
    return tuple(Message(every, 0, 0, "", text) for text in texts)


def changed_tree(tree: Node, file: str, changes: AnyMapping[str, Any]) -> Node:
    """Return the tree of a file with new values at some paths; ``None`` removes an entry.

    :raises ExperimentError: a path that does not exist, or a value that no file can hold.
    """
    mark = Mark(f"{file} as changed", 0, 0)
    messages = []
    written: dict[tuple[str, ...], str] = {}
    for path, value in changes.items():
        try:
            earlier = written.setdefault(tuple(steps_of(path)), path)
            if earlier != path:
                raise ValueError(f'is the same entry as "{earlier}"; replace it once')
            tree = (
                removed(tree, path)
                if value is None
                else override(tree, path, node_of(value, mark), mark)
            )
        except ValueError as error:
            messages.append(mark.message(path, str(error)))
    if messages:
        raise ExperimentError(messages)
    return tree


def node_of(value: object, mark: Mark) -> Node:
    """Return the node of a text, number, list, mapping, array or path.

    :raises ValueError: a value of another type.
    """
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Path):
        value = str(value)
    if value is None or isinstance(value, str | bool | int | float):
        return Scalar(mark, value)
    if isinstance(value, AnyMapping):
        items = {str(key): node_of(item, mark) for key, item in value.items()}
        return Mapping(mark, items, dict.fromkeys(items, mark))
    if isinstance(value, AnySequence) and not isinstance(value, bytes):
        return Sequence(mark, tuple(node_of(item, mark) for item in value))
    raise ValueError(
        f"a {type(value).__name__} cannot be written; give text, a number, a list or a mapping"
    )
