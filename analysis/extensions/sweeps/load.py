"""Loading of a sweep file into axes and cells."""

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
    node_at,
    overlap,
    override,
    place_of,
    python_models,
    variant_trees,
)
from ballplate.simulator.inputs import (
    OPENED,
    ExperimentError,
    Mapping,
    Mark,
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
from .bundle import bundle_of, code_digest
from .conditions import holds
from .limits import read_limits
from .model import Choice, Sweep, SweepAxis, Trees
from .store_columns import is_reserved
from .sweep_settings import SweepSettings
from .values import entry_names

MOST_CELLS = 1_000_000


def load_sweep(
    path: str | os.PathLike[str],
    folders: tuple[Path, ...] = (),
    trust: Trust = OPENED,
) -> Sweep:
    """Load a sweep file and the experiment file that it starts from.

    Files that it names must be below its folder, that of its base, or one of `folders`.

    :raises ExperimentError: all errors in the two files.
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
    base = source.parent / settings.base
    try:
        trees = _trees(base)
    except ExperimentError as error:
        problems.take(error, ("base",))
        raise ExperimentError(sorted(problems.messages)) from None
    _check_variant(settings, trees, problems)
    planning, limits = read_limits(settings.plan, root, problems)
    axes = _axes(settings, limits, root, trees, problems)
    cells = tuple(_selected_cells(settings, axes))
    if not cells:
        problems.add(
            ("skip",) if settings.skip else ("only",), "leaves no case; relax the conditions"
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
        planning=planning,
    )
    _check_base(sweep)
    bundle = bundle_of(sweep)
    has_code = any(True for tree in trees.values() for _ in python_models(tree))
    code = code_digest(bundle) if has_code else ""
    return replace(sweep, digest=bundle.digest, code=code)


def _axes(
    settings: SweepSettings,
    limits: list[SweepAxis],
    root: Node,
    trees: Trees,
    problems: Problems,
) -> list[SweepAxis]:
    read_axes = [
        read_axis(name, axis_settings, root, trees, settings.variant, problems)
        for name, axis_settings in settings.axes.items()
    ]
    axes = [*(axis for axis in read_axes if axis is not None), *limits]
    if settings.estimator:
        names = dict.fromkeys(settings.estimator)
        chosen = tuple(Choice(name, (), estimator=name) for name in names)
        axes.append(SweepAxis("estimator", chosen, ""))
        if settings.trials is None:
            problems.add(("estimator",), "needs data sets; add trials: 100")
    if not axes and not problems.messages:
        problems.add((), "nothing varies; give axes, or several values of a limit in plan")
    if not problems.messages:
        _check_apart(axes, next(iter(trees.values())), problems)
    _check_names(axes, problems)
    _check_conditions(settings, axes, problems)
    total = math.prod(len(axis.choices) for axis in axes)
    if not problems.messages and total > MOST_CELLS:
        problems.add(
            ("axes",),
            f"{total} combinations of values; {MOST_CELLS} are the limit; give fewer values",
        )
    if problems.messages:
        raise ExperimentError(sorted(problems.messages))
    return axes


def base_tree(sweep: Sweep, number: int) -> Node:
    """Return the content of the base file, or of its variant, that a cell changes."""
    variants = (choice.variant for choice in sweep.choices(number) if choice.variant is not None)
    return sweep.trees[next(variants, sweep.variant)]


def experiment_of(sweep: Sweep, number: int) -> Experiment:
    """Return the experiment of a cell.

    :raises ExperimentError: the cell makes no valid experiment.
    """
    tree = base_tree(sweep, number)
    for choice in sweep.choices(number):
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
    planning = sweep.planning is not None
    experiment, messages = build(tree, sweep.base, sweep.label(number), sweep.trust, planning)
    if experiment is None:
        raise ExperimentError(sorted(messages))
    return experiment


def _subset(
    tree: Node, path: str, names_kept: tuple[str, ...], mark: Mark
) -> tuple[str, Node, Mark]:
    """Return the list at a path with only some entries.

    :raises ExperimentError: the variant lacks an entry.
    """
    try:
        place = node_at(tree, path)
    except ValueError as error:
        raise mark.refused(str(error), path) from None
    names = (entry_names(place) if place is not None else None) or []
    absent = next((name for name in names_kept if name not in names), None)
    if absent is not None or not isinstance(place, Sequence):
        raise mark.refused(f'no entry "{absent}" in this variant; {hint(str(absent), names)}', path)
    return (
        path,
        Sequence(place.mark, tuple(place.items[names.index(name)] for name in names_kept)),
        mark,
    )


def _settings(root: Node, problems: Problems) -> SweepSettings | None:
    for steps, node in walk(root):
        if isinstance(node, Scalar) and node.value is None:
            problems.add(steps, "empty; give a value, or leave it out")
    settings = validated(SweepSettings, root, problems)
    return None if problems.messages else settings


def _trees(base: Path) -> Trees:
    """Return the trees of the base file by variant, or the whole file under None.

    :raises ExperimentError: the file cannot be read, or a variant is invalid.
    """
    root = read_tree(base)
    problems = Problems(root)
    variants = variant_trees(root, problems)
    if problems.messages:
        raise ExperimentError(sorted(problems.messages))
    return dict(variants.items()) if variants else {None: root}


def _check_variant(settings: SweepSettings, trees: Trees, problems: Problems) -> None:
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
    """Refuse axes that change the same node."""

    def is_clash(earlier: str, path: str) -> bool:
        try:
            return is_same_place(tree, earlier, path)
        except ValueError:
            # Only another variant has the path.
            return earlier == path

    paths = [(axis.name, path) for axis in axes for path in axis.choices[0].paths]
    for k, (name, path) in enumerate(paths):
        for earlier_name, earlier in paths[:k]:
            if is_clash(earlier, path):
                text = f'{path} overlaps {earlier} of the axis "{earlier_name}"; change it once'
                problems.add(("axes", name), text)
                break


def _check_names(axes: list[SweepAxis], problems: Problems) -> None:
    """Refuse axes with the same column, or with the name of a recorded column."""
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
    # An axis with errors of its own is in the file but not in `axes`.
    for key, entries in (("skip", settings.skip), ("only", settings.only)):
        for k, entry in enumerate(entries):
            for name, condition in entry.items():
                if name not in (*settings.axes, *by_name):
                    text = f'there is no axis "{name}"; {hint(name, [*settings.axes, *by_name])}'
                    problems.add((key, k, name), text, of_key=True)
                elif name in by_name:
                    axis = by_name[name]
                    try:
                        if not any(holds(condition, axis, choice) for choice in axis.choices):
                            values = listing(choice.label for choice in axis.choices)
                            problems.add(
                                (key, k, name), f"holds for no value of the axis; it has {values}"
                            )
                    except ValueError as error:
                        problems.add((key, k, name), str(error))


def _selected_cells(settings: SweepSettings, axes: list[SweepAxis]) -> Iterator[tuple[int, ...]]:
    """Return the cells that the conditions select."""

    # Each condition is evaluated once for each value of its axis, not for each cell.
    def allowed(entry: dict[str, Any]) -> list[set[int]]:
        return [
            {
                k
                for k, choice in enumerate(axis.choices)
                if axis.name not in entry or holds(entry[axis.name], axis, choice)
            }
            for axis in axes
        ]

    def is_in(cell: tuple[int, ...], entries: list[list[set[int]]]) -> bool:
        return any(all(map(set.__contains__, entry, cell)) for entry in entries)

    skip, only = list(map(allowed, settings.skip)), list(map(allowed, settings.only))
    for cell in product(*(range(len(axis.choices)) for axis in axes)):
        if not is_in(cell, skip) and (not only or is_in(cell, only)):
            yield cell


def _check_base(sweep: Sweep) -> None:
    """Refuse a sweep with an invalid base file if its first cell is invalid, too.

    :raises ExperimentError: the errors in the base file.
    """
    try:
        experiment_of(sweep, 0)
    except ExperimentError:
        messages = set()
        for name, tree in sweep.trees.items():
            experiment, errors = build(
                tree, sweep.base, name, sweep.trust, sweep.planning is not None
            )
            if experiment is not None:
                return
            messages |= set(errors)
        raise ExperimentError(sorted(messages)) from None


def is_same_place(root: Node, path: str, second: str) -> bool:
    """True if one of two paths leads to the other's node, or into it.

    :raises ValueError: as ``node_at``.
    """
    return overlap(place_of(root, path), place_of(root, second))
