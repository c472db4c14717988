"""Loading of a sweep file: its axes and cells, or all errors in it."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

from ballplate.simulator.experiment import (
    Experiment,
    build,
    is_same_place,
    node_at,
    override,
    variant_trees,
    with_present_keys,
)
from ballplate.simulator.inputs import (
    OPENED,
    ExperimentError,
    Mapping,
    Mark,
    Message,
    Node,
    Problems,
    Scalar,
    Sequence,
    Trust,
    hint,
    listing,
    read_tree,
    validated,
    walk,
)

from .axes import read_axis
from .bundle import bundle_of, code_digest, has_code
from .conditions import holds
from .model import Sweep, SweepAxis
from .store_columns import is_reserved
from .sweep_settings import SweepSettings
from .values import entry_names

MOST_CELLS = 1_000_000


def load_sweep(
    path: str | os.PathLike[str],
    base: Path | None = None,
    folders: tuple[Path, ...] = (),
    trust: Trust = OPENED,
) -> Sweep:
    """Load a sweep file and the experiment file that it starts from, or `base` in its place.

    Files that it names must be below its folder, that of its base, or one of `folders`.

    :raises ExperimentError: one of the two is wrong; holds everything that was found.
    """
    source = Path(path)
    root = read_tree(source)
    problems = Problems(root)
    if isinstance(root, Mapping) and "axes" not in root.items and "machine" in root.items:
        text = (
            "this is an experiment file; use it with ballplate run, or name it as base: of a sweep"
        )
        raise root.mark.refused(text)
    settings = _settings(root, problems)
    if settings is None:
        raise ExperimentError(sorted(problems.messages))
    base = source.parent / settings.base if base is None else base
    try:
        trees = _trees(base)
    except ExperimentError as error:
        problems.take(error, ("base",))
        raise ExperimentError(sorted(problems.messages)) from None
    _check_variant(settings, trees, problems)
    axes: list[SweepAxis] = []
    for name, one in settings.axes.items():
        found = read_axis(name, one, root, trees, settings.variant, problems)
        axes += [found] if found is not None else []
    if not problems.messages:
        _check_apart(axes, next(iter(trees.values())), problems)
    _check_names(axes, problems)
    _check_conditions(settings, axes, problems)
    if problems.messages:
        raise ExperimentError(sorted(problems.messages))
    total = math.prod(len(axis.choices) for axis in axes)
    if total > MOST_CELLS:
        problems.add(
            ("axes",),
            f"{total} combinations of values; {MOST_CELLS} are the limit, so take fewer values",
        )
        raise ExperimentError(problems.messages)
    cells = tuple(_kept(settings, axes))
    if not cells:
        problems.add(
            ("skip",) if settings.skip else ("only",), "leaves no cell; relax the conditions"
        )
        raise ExperimentError(problems.messages)
    sweep = Sweep(
        source,
        settings.title,
        base,
        trees,
        settings.variant,
        tuple(axes),
        cells,
        settings.trials,
        settings.seed,
        settings.record,
        folders=folders,
        trust=trust,
    )
    _check_base(sweep)
    bundle = bundle_of(sweep)
    code = code_digest(bundle) if any(map(has_code, trees.values())) else ""
    return replace(sweep, digest=bundle.digest, code=code)


def experiment_of(sweep: Sweep, number: int) -> Experiment:
    """The experiment of a cell.

    :raises ExperimentError: a cell that makes no valid experiment.
    """
    choices = sweep.choices(number)
    variant = next(
        (choice.variant for choice in choices if choice.variant is not None), sweep.variant
    )
    tree = sweep.trees[variant]
    for choice in choices:
        changes = (
            choice.changes
            if choice.kept is None
            else (*choice.changes, _subset(tree, *choice.kept))
        )
        for path, node, mark in changes:
            try:
                tree = override(tree, path, node, mark)
            except ValueError as error:
                raise mark.refused(str(error), path) from None
    experiment, messages = build(tree, sweep.base, sweep.label(number), sweep.trust)
    if experiment is None:
        raise ExperimentError(sorted(messages))
    return experiment


def _subset(tree: Node, path: str, kept: tuple[str, ...], mark: Mark) -> tuple[str, Node, Mark]:
    """The list at a path with some of its entries only.

    :raises ExperimentError: an entry that this variant does not have.
    """
    try:
        place = node_at(tree, path)
    except ValueError as error:
        raise mark.refused(str(error), path) from None
    names = (entry_names(place) if place is not None else None) or []
    absent = next((name for name in kept if name not in names), None)
    if absent is not None or not isinstance(place, Sequence):
        raise mark.refused(f'no entry "{absent}" in this variant; {hint(str(absent), names)}', path)
    return path, Sequence(place.mark, tuple(place.items[names.index(name)] for name in kept)), mark


def _settings(root: Node, problems: Problems) -> SweepSettings | None:
    for steps, node in walk(root):
        if isinstance(node, Scalar) and node.value is None:
            problems.add(steps, "empty; give a value, or leave it out")
    settings = validated(SweepSettings, root, problems)
    return None if problems.messages else settings


def _trees(base: Path) -> dict[str | None, Node]:
    """Trees of the base file by variant, or of the whole under None.

    :raises ExperimentError: the file cannot be read, or its variants cannot be made.
    """
    root = with_present_keys(read_tree(base))
    problems = Problems(root)
    variants = variant_trees(root, problems)
    if problems.messages:
        raise ExperimentError(sorted(problems.messages))
    return dict(variants.items()) if variants else {None: root}


def _check_variant(
    settings: SweepSettings, trees: dict[str | None, Node], problems: Problems
) -> None:
    names = [name for name in trees if name is not None]
    has_axis = any(axis.variants is not None for axis in settings.axes.values())
    if settings.variant is not None and settings.variant not in trees:
        text = f'no variant "{settings.variant}" in {settings.base}; '
        problems.add(
            ("variant",), text + (hint(settings.variant, names) if names else "leave it out")
        )
    elif settings.variant is not None and has_axis:
        problems.add(("variant",), "an axis chooses the variant; leave it out")
    elif settings.variant is None and names and not has_axis:
        text = (
            f"has the variants {listing(names)}; choose one with variant: NAME, or add an axis"
            " {variants: all}"
        )
        problems.add(("base",), text)


def _check_apart(axes: list[SweepAxis], tree: Node, problems: Problems) -> None:
    """Refuse axes that change the same place, told by one of the variants."""

    def clash(one: str, other: str) -> bool:
        try:
            return is_same_place(tree, one, other)
        except ValueError:
            return one == other

    paths = [(axis.name, path) for axis in axes for path in axis.choices[0].paths]
    for k, (name, path) in enumerate(paths):
        other = next((one for one in paths[:k] if clash(one[1], path)), None)
        if other is not None:
            text = (
                f'{path} is part of the same place as {other[1]} of the axis "{other[0]}"; change'
                " it once"
            )
            problems.add(("axes", name), text)


def _check_names(axes: list[SweepAxis], problems: Problems) -> None:
    """Refuse axes that would share a column with another one, or with what is recorded."""
    columns: dict[str, str] = {}
    for axis in axes:
        if is_reserved(axis.column):
            problems.add(
                ("axes", axis.name), "is a column of every table; choose another name", of_key=True
            )
        elif axis.column in columns:
            text = (
                f'would have the column "{axis.column}" of the axis "{columns[axis.column]}";'
                " choose another name"
            )
            problems.add(("axes", axis.name), text, of_key=True)
        columns[axis.column] = axis.name
    chosen = [axis.name for axis in axes if axis.choices[0].variant is not None]
    for name in chosen[1:]:
        text = f'the axis "{chosen[0]}" chooses the variant already; name all variants there'
        problems.add(("axes", name), text, of_key=True)


def _check_conditions(settings: SweepSettings, axes: list[SweepAxis], problems: Problems) -> None:
    by_name = {axis.name: axis for axis in axes}
    for key, entries in (("skip", settings.skip), ("only", settings.only)):
        for k, entry in enumerate(entries):
            for name, condition in entry.items():
                if name not in settings.axes:
                    text = f'there is no axis "{name}"; {hint(name, settings.axes)}'
                    problems.add((key, k, name), text, of_key=True)
                elif name in by_name:
                    try:
                        if not any(
                            holds(condition, by_name[name], choice)
                            for choice in by_name[name].choices
                        ):
                            values = listing(choice.label for choice in by_name[name].choices)
                            problems.add(
                                (key, k, name), f"holds for no value of the axis; it has {values}"
                            )
                    except ValueError as error:
                        problems.add((key, k, name), str(error))


def _kept(settings: SweepSettings, axes: list[SweepAxis]) -> Iterator[tuple[int, ...]]:
    """Cells that the conditions leave."""
    place = {axis.name: k for k, axis in enumerate(axes)}

    def sets(entries: tuple[dict[str, Any], ...]) -> list[list[tuple[int, frozenset[int]]]]:
        return [
            [
                (
                    place[name],
                    frozenset(
                        k
                        for k, choice in enumerate(axes[place[name]].choices)
                        if holds(condition, axes[place[name]], choice)
                    ),
                )
                for name, condition in entry.items()
            ]
            for entry in entries
        ]

    skip, only = sets(settings.skip), sets(settings.only)
    for cell in product(*(range(len(axis.choices)) for axis in axes)):
        if any(all(cell[k] in chosen for k, chosen in entry) for entry in skip):
            continue
        if only and not any(all(cell[k] in chosen for k, chosen in entry) for entry in only):
            continue
        yield cell


def _check_base(sweep: Sweep) -> None:
    """Refuse a sweep whose base file is wrong in itself, where its first cell is wrong as well.

    :raises ExperimentError: what is wrong with the base file.
    """
    try:
        experiment_of(sweep, 0)
    except ExperimentError:
        messages: set[Message] = set()
        for name, tree in sweep.trees.items():
            experiment, found = build(tree, sweep.base, name, sweep.trust)
            if experiment is not None:
                return
            messages |= set(found)
        raise ExperimentError(sorted(messages)) from None
