"""Axes of a sweep file: the paths that they change and their values."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from math import isnan

from ballplate.simulator.experiment import node_at, override
from ballplate.simulator.inputs import (
    Mapping,
    Mark,
    Node,
    Problems,
    Scalar,
    Sequence,
    Steps,
    hint,
    listing,
    mark_of,
    number_of,
    to_python,
    written,
)

from .model import Choice, SweepAxis, Trees
from .sweep_settings import AxisSettings
from .values import entry_names, label, numeric, of_range, subset_count, subsets

MOST_VALUES = 100_000

# Sources of an axis's values.
SOURCES = ("values", "start", "together", "subsets", "variants")


def read_axis(
    name: str,
    settings: AxisSettings,
    root: Node,
    trees: Trees,
    variant: str | None,
    problems: Problems,
) -> SweepAxis | None:
    """Return an axis of the sweep file `root`; errors go to `problems`."""
    here = ("axes", name)
    sources = [key for key in SOURCES if getattr(settings, key) is not None]
    if len(sources) != 1:
        fact = "has several sources of values" if sources else "has no values"
        problems.add(
            here, f"{fact}; give one of values, from … to …, together, subsets or variants"
        )
        return None
    needless = _needless(settings, sources[0])
    if needless:
        problems.add(
            (*here, needless), f"does not apply to {_key(sources[0])}; remove it", of_key=True
        )
        return None
    before = len(problems.messages)
    choices = _choices(here, sources[0], settings, root, trees, variant, problems)
    if len(problems.messages) > before:
        return None
    axis = _with_numbers(name, choices, sources[0] in ("values", "start"))
    check_labels(here, axis.choices, problems)
    if len(problems.messages) > before:
        return None
    _check_paths(here, choices, trees, problems)
    return axis


def check_labels(here: Steps, choices: Iterable[Choice], problems: Problems) -> None:
    """Refuse an axis that has a value twice."""
    labels = Counter(choice.label for choice in choices)
    values = Counter(choice.value for choice in choices if not isnan(choice.value))
    repeated = next(
        (each.label for each in choices if max(labels[each.label], values[each.value]) > 1), None
    )
    if repeated is not None:
        problems.add(
            here, f'has the value "{repeated}" twice; remove one, or name the values differently'
        )


def _with_numbers(name: str, choices: list[Choice], is_simple: bool) -> SweepAxis:
    """Return the axis, with numbers if all choices are quantities in one unit."""
    values = []
    if is_simple:
        values = [numeric(to_python(choice.changes[0][1])) for choice in choices]
    if len({unit for _, unit in values}) != 1 or not values[0][1]:
        return SweepAxis(name, tuple(choices), "")
    numbers = [
        replace(choice, value=value) for choice, (value, _) in zip(choices, values, strict=True)
    ]
    return SweepAxis(name, tuple(numbers), values[0][1])


def _key(source: str) -> str:
    return "from" if source == "start" else source


def _needless(settings: AxisSettings, source: str) -> str | None:
    """Return a key that the source of the values does not use."""
    goes_with = {
        "values": {"path", "paths"},
        "start": {"path", "paths", "to", "count", "step", "spacing"},
        "together": {"names"},
        "subsets": {"path"},
        "variants": set(),
    }[source]
    written_keys = {key for key in settings.model_fields_set if key != source}
    return next((_key(key) for key in sorted(written_keys) if key not in goes_with), None)


def _choices(
    here: Steps,
    source: str,
    settings: AxisSettings,
    root: Node,
    trees: Trees,
    variant: str | None,
    problems: Problems,
) -> list[Choice]:
    if source == "variants":
        return _variant_choices(here, settings, trees, problems)
    if source == "together":
        return _choices_together(here, settings, root, problems)
    paths = settings.paths or ((settings.path,) if settings.path is not None else ())
    if not paths or (settings.path is not None and settings.paths is not None):
        problems.add(here, "has no path, or both path and paths; give one")
        return []
    if source == "subsets":
        return _subset_choices(here, settings, root, trees, variant, problems)
    if source == "start":
        mark = mark_of(root, (*here, "from"))
        try:
            values = of_range(
                settings.start,
                settings.to,
                settings.count,
                settings.step,
                settings.spacing == "logarithmic",
                MOST_VALUES,
            )
        except ValueError as error:
            problems.add(here, str(error))
            return []
        nodes: list[tuple[str, Node]] = [(str(value), Scalar(mark, value)) for value in values]
    else:
        nodes = _nodes(root, (*here, "values"), problems)
    return [Choice(text, tuple((path, node, node.mark) for path in paths)) for text, node in nodes]


def _nodes(root: Node, steps: Steps, problems: Problems) -> list[tuple[str, Node]]:
    """Return values of an axis as nodes with their labels."""
    node = written(root, *steps)
    if isinstance(node, Sequence):
        return [(label(item), item) for item in node.items]
    if isinstance(node, Mapping):
        return list(node.items.items())
    problems.add(steps, "expected a list of values, or name: value; write [a, b]")
    return []


def _variant_choices(
    here: Steps, settings: AxisSettings, trees: Trees, problems: Problems
) -> list[Choice]:
    names = [name for name in trees if name is not None]
    chosen = list(settings.variants or ()) if settings.variants != "all" else names
    if not names:
        problems.add((*here, "variants"), "the base file has no variants; remove this axis")
        return []
    for k, name in enumerate(chosen):
        if name not in names:
            problems.add(
                (*here, "variants", k), f'no variant "{name}" in the base file; {hint(name, names)}'
            )
    return [Choice(name, (), variant=name) for name in chosen]


def _choices_together(
    here: Steps, settings: AxisSettings, root: Node, problems: Problems
) -> list[Choice]:
    columns = {
        path: _nodes(root, (*here, "together", path), problems) for path in settings.together or {}
    }
    lengths = {len(column) for column in columns.values()}
    if len(lengths) > 1:
        counts = listing(f"{path}: {len(column)}" for path, column in columns.items())
        problems.add(
            (*here, "together"),
            f"lists of different lengths ({counts}); give each path as many values",
        )
        return []
    count = lengths.pop() if lengths else 0
    names = list(settings.names or ())
    if names and len(names) != count:
        problems.add(
            (*here, "names"),
            f"{number_of(len(names), 'name')} for {number_of(count, 'value')}; give one for each",
        )
        return []
    choices = []
    for k in range(count):
        row = [column[k] for column in columns.values()]
        text = names[k] if names else " / ".join(labelled[0] for labelled in row)
        choices.append(
            Choice(
                text,
                tuple(
                    (path, labelled[1], labelled[1].mark)
                    for path, labelled in zip(columns, row, strict=True)
                ),
            )
        )
    return choices


def _subset_choices(
    here: Steps,
    settings: AxisSettings,
    root: Node,
    trees: Trees,
    variant: str | None,
    problems: Problems,
) -> list[Choice]:
    path, wanted = settings.path or "", settings.subsets
    assert wanted is not None
    tree = trees.get(variant, next(iter(trees.values())))
    try:
        place = node_at(tree, path)
    except ValueError as error:
        problems.add((*here, "path"), str(error))
        return []
    names = entry_names(place) if place is not None else None
    if names is None or not isinstance(place, Sequence):
        problems.add(
            (*here, "path"), "is not a list of entries with names; write for example positions"
        )
        return []
    before = len(problems.messages)
    for key, some in (("always", wanted.always), ("among", wanted.among or ())):
        for k, name in enumerate(some):
            if name not in names:
                problems.add(
                    (*here, "subsets", key, k), f'no entry "{name}" in {path}; {hint(name, names)}'
                )
    among = wanted.among if wanted.among is not None else tuple(names)
    fixed = len(set(wanted.always))
    total = len(set(among) | set(wanted.always))
    for k, size in enumerate(wanted.sizes):
        if not max(fixed, 1) <= size <= total:
            text = f"no subset has {size} entries; give {max(fixed, 1)} to {total}"
            problems.add((*here, "subsets", "sizes", k), text)
    if len(problems.messages) > before:
        return []
    count = subset_count(total, fixed, wanted.sizes)
    if count > MOST_VALUES:
        problems.add(
            (*here, "subsets"),
            f"{count} subsets; {MOST_VALUES} are the limit; reduce sizes or among",
        )
        return []
    mark = mark_of(root, (*here, "subsets"))
    labelled = subsets(names, wanted.always, among, wanted.sizes)
    return [Choice(text, (), kept=(path, names_kept, mark)) for text, names_kept in labelled]


def _check_paths(here: Steps, choices: list[Choice], trees: Trees, problems: Problems) -> None:
    """Refuse a path that no variant has."""
    for path in dict.fromkeys(path for choice in choices[:1] for path, _, _ in choice.changes):
        errors = []
        for tree in trees.values():
            try:
                override(tree, path, Scalar(Mark("", 0, 0), 0), Mark("", 0, 0))
            except ValueError as error:
                errors.append(str(error))
        if len(errors) == len(trees):
            problems.add(here, f"{path}: {errors[0]}")
