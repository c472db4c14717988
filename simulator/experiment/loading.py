"""From the path of a file to its experiments, one for each variant, or to all errors in it.

The file goes down four steps: `parse_tree` makes a tree of nodes of its text, `validate_sections`
valid sections of the tree, `resolve` objects of these, whose names are looked up, and `construct`
the experiment. Each returns what it makes and leaves what it got as it was; faults are collected in
`Problems`, so that all are reported at once.
"""

from __future__ import annotations

import os
from collections.abc import Mapping as AnyMapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from ballplate.simulator.inputs.decoding import refuse_long_lines
from ballplate.simulator.inputs.messages import ExperimentError, Message
from ballplate.simulator.inputs.problems import Problems, in_order
from ballplate.simulator.inputs.trust import OPENED, Trust
from ballplate.simulator.inputs.yamltree import Mapping, Mark, Node, mark_of, parse_tree, read_text

from ._resolution import resolve
from .changes import MOST_OF_ALL, in_variants, node_of, variant_trees
from .construction import construct, evaluable
from .model import Experiment
from .validation import validate_sections


def load(
    path: str | os.PathLike[str],
    planning: bool = False,
    trust: Trust = OPENED,
    text: str | None = None,
    tolerant: bool = False,
) -> tuple[Experiment, ...]:
    """Load an experiment file.

    Returns the experiment, or one per variant in the order of the file. Tables that the file names
    are read from its folder. For ``planning`` an experiment has its pool, and positions may be
    missing if it has one; otherwise artefacts of the pool alone are omitted. Error models in
    Python are code that loading runs, if ``trust`` allows it. A ``text`` is read as the content of
    the file. A ``tolerant`` reader gets experiments with their ``faults``, and positions that are
    switched off or cannot be read, to be changed and not to be evaluated.

    :raises ExperimentError: the file, or a table it names, is invalid; holds all faults found. For
        a ``tolerant`` reader: its machine, or the YAML, cannot be understood.
    """
    source = Path(path)
    substituted: list[Message] = []
    if text is not None:
        refuse_long_lines(text, source)
    written = read_text(source) if text is None else text
    root, trees, base_problems = trees_of(written, source, substituted)
    if not trees:
        tree = _without_variants(root)
        experiment, messages = build(tree, source, None, trust, planning, tolerant)
        all_faults = in_order([*base_problems.messages, *messages], substituted, source)
        if experiment is None or (all_faults and not tolerant):
            raise ExperimentError(all_faults)
        return (replace(experiment, faults=tuple(all_faults) if tolerant else None),)
    from .spans import unspanned

    experiments = []
    variants_of: dict[Message, list[str]] = {}
    size = 0
    for name, tree in trees.items():
        experiment, messages = build(tree, source, name, trust, planning, tolerant)
        if experiment is not None:
            faults = tuple(in_order(messages, substituted, source)) if tolerant else None
            mark = mark_of(root, ("variants", name), of_key=True)
            experiment = replace(experiment, mark=mark, faults=faults)
            lost = unspanned(_without_variants(root), experiment)
            notes = (str(experiment.message(("variants", name), lost)),) if lost else ()
            experiments.append(replace(experiment, notes=(*experiment.notes, *notes)))
            size += experiment.size
        if size > MOST_OF_ALL and len(experiments) > 1:
            too_many = (
                f"the variants up to here have {size} balls, balls read, calibrated values, priors"
                f" and evaluation points; at most {MOST_OF_ALL} are possible: move some of the"
                " variants to a file of their own"
            )
            base_problems.add(("variants", name), too_many)
            break
        for message in messages:
            # A fault of the common part is in every variant, and is reported once, with the
            # variants in which it holds.
            variants_of.setdefault(message, []).append(name)
    found = base_problems.messages + [
        replace(message, text=message.text + in_variants(names, list(trees)))
        for message, names in variants_of.items()
    ]
    all_faults = in_order(found, substituted, source)
    if all_faults and not (tolerant and experiments):
        raise ExperimentError(all_faults)
    return tuple(experiments)


def trees_of(
    text: str, source: Path, substituted: list[Message]
) -> tuple[Node, dict[str, Node], Problems]:
    """Return the content of a file with this text, its variants by name, and the faults of these;
    faults of the YAML go to ``substituted``.

    :raises ExperimentError: the YAML has no tree.
    """
    root = parse_tree(text, str(source), substituted)
    problems = Problems(root)
    return root, variant_trees(root, problems), problems


def with_pool(experiment: Experiment) -> Experiment:
    """Return the same experiment with its pool.

    :raises ExperimentError: the pool is invalid.
    """
    rebuilt = experiment.builder(experiment.tree, planning=True)
    return replace(rebuilt, mark=experiment.mark)


def written_in_python(sections: AnyMapping[str, Any], folder: Path) -> Experiment:
    """Return the experiment of a mapping with the content of a file, with paths relative to a
    folder.

    :raises ExperimentError: it is invalid; holds all faults found.
    """
    mark = Mark("experiment", 0, 0)
    if "variants" in sections:
        text = "are for files; change an experiment with its method with_()"
        raise mark.refused(text, "variants")
    try:
        tree = node_of(sections, mark)
    except ValueError as error:
        raise mark.refused(str(error)) from None
    return _built(tree, folder / "experiment", None, OPENED, False)


def _built(root: Node, source: Path, name: str | None, trust: Trust, planning: bool) -> Experiment:
    """The experiment of a tree.

    :raises ExperimentError: it is invalid.
    """
    experiment, messages = build(root, source, name, trust, planning)
    if experiment is None:
        raise ExperimentError(sorted(messages))
    return experiment


def build(
    root: Node,
    source: Path,
    name: str | None,
    trust: Trust,
    planning: bool = False,
    tolerant: bool = False,
) -> tuple[Experiment | None, list[Message]]:
    """Return the experiment of a tree without variants, or None, with its faults."""
    problems = Problems(root)
    builder = partial(_built, source=source, name=name, trust=trust, planning=planning)
    try:
        sections = validate_sections(root, problems, planning)
        resolved = resolve(sections, source.parent, problems, trust, planning)
    # Collected faults are no exceptions, except when they become too many to be worded.
    except ExperimentError as too_many:
        return None, list(too_many.messages)
    faults = problems.messages
    if faults and not tolerant or resolved.machine is None:
        return None, faults
    experiment = construct(resolved, root, source, name, builder, planning)
    if tolerant and (faults or not all(place.enabled for place in experiment.positions)):
        return experiment, faults
    return evaluable(experiment, resolved, planning), []


def _without_variants(root: Node) -> Node:
    if not isinstance(root, Mapping):
        return root
    items = {key: node for key, node in root.items.items() if key != "variants"}
    return Mapping(root.mark, items, {key: root.key_marks[key] for key in items})
