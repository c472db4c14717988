"""Loading of an experiment file: from YAML to experiments, or to all errors in it."""

from __future__ import annotations

import os
from collections.abc import Mapping as AnyMapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from ballplate.simulator.inputs.decoding import refuse_long_lines
from ballplate.simulator.inputs.extensions import service
from ballplate.simulator.inputs.messages import ExperimentError, Message
from ballplate.simulator.inputs.own_code import OPENED, Trust
from ballplate.simulator.inputs.problems import Problems, in_order, written_count
from ballplate.simulator.inputs.yamltree import (
    Mapping,
    Mark,
    Node,
    mark_of,
    parse_tree,
    read_text,
    written,
)
from ballplate.simulator.machines.settings import with_defaults
from ballplate.simulator.machines.truth import with_model_defaults

from .artefacts import resolve_references
from .bounds import check_inside, resolve_bounds
from .calibrations import resolve_calibration
from .changes import node_of
from .checks import check_calibration_read, check_names, check_radii, check_use
from .error_model_checks import check_true_machine, with_usable_error_model
from .influences import resolve_influences
from .machine import resolve_evaluation, resolve_machine, resolve_noise, target_of
from .model import Evaluation, Experiment, Position
from .own_sections import needed_extensions, needed_service, resolve_own_sections
from .placements import resolve_position
from .pool import enabled_only, placed_only
from .priors import resolve_priors
from .probes import resolve_probes, resolve_stars
from .readings_checks import check_readings
from .readings_section import no_settings
from .size_checks import check_size
from .spans import unspanned
from .structure import validate_sections
from .variants import MOST_OF_ALL, in_variants, variant_trees


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
    refused: list[Message] = []
    if text is not None:
        refuse_long_lines(text, source)
    written = read_text(source) if text is None else text
    root, trees, base_problems = trees_of(written, source, refused)
    if not trees:
        tree = _without_variants(root)
        experiment, messages = build(tree, source, None, trust, planning, tolerant)
        all_faults = in_order([*base_problems.messages, *messages], refused, source)
        if experiment is None or (all_faults and not tolerant):
            raise ExperimentError(all_faults)
        return (replace(experiment, faults=tuple(all_faults) if tolerant else None),)
    experiments = []
    variants_of: dict[Message, list[str]] = {}
    size = 0
    for name, tree in trees.items():
        experiment, messages = build(tree, source, name, trust, planning, tolerant)
        if experiment is not None:
            faults = tuple(in_order(messages, refused, source)) if tolerant else None
            mark = mark_of(root, ("variants", name), of_key=True)
            experiment = replace(experiment, mark=mark, faults=faults)
            lost = unspanned(_without_variants(root), experiment)
            notes = (str(experiment.message(("variants", name), lost)),) if lost else ()
            experiments.append(replace(experiment, notes=(*experiment.notes, *notes)))
            size += experiment.size
        if size > MOST_OF_ALL and len(experiments) > 1:
            text = (
                f"the variants up to here have {size} balls, balls read, calibrated values, priors"
                " and evaluation "
            )
            text += (
                f"points; at most {MOST_OF_ALL} are possible: move some of the variants to a file"
                " of their own"
            )
            base_problems.add(("variants", name), text)
            break
        for message in messages:
            variants_of.setdefault(message, []).append(name)
    found = base_problems.messages + [
        replace(message, text=message.text + in_variants(names, list(trees)))
        for message, names in variants_of.items()
    ]
    all_faults = in_order(found, refused, source)
    if all_faults and not (tolerant and experiments):
        raise ExperimentError(all_faults)
    return tuple(experiments)


def trees_of(
    text: str, source: Path, refused: list[Message]
) -> tuple[Node, dict[str, Node], Problems]:
    """Return the content of a file with this text, its variants by name, and the faults of these;
    faults of the YAML go to ``refused``.

    :raises ExperimentError: the YAML has no tree.
    """
    root = parse_tree(text, str(source), refused)
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
    try:
        return _build(root, source, name, trust, planning, tolerant)
    except ExperimentError as too_many:
        return None, list(too_many.messages)


# In one piece: the order in which sections are resolved, each from those before it, stands in one
# place.
def _build(
    root: Node, source: Path, name: str | None, trust: Trust, planning: bool, tolerant: bool
) -> tuple[Experiment | None, list[Message]]:
    problems = Problems(root)
    sections = validate_sections(root, problems, planning)
    references = resolve_references(sections, source.parent, problems, trust)
    machine = (
        resolve_machine(sections.get("machine"), problems) if sections.get("machine") else None
    )
    if machine is not None:
        references = replace(references, volume=machine.volume)
    probes = resolve_probes(sections, references)
    bounds = resolve_bounds(sections, machine, probes, references)
    sections = with_usable_error_model(sections, machine, references)
    check_true_machine(sections, machine, references)
    for section in ("positions", "calibration"):
        for i in range(written_count(root, section)):
            if sections.get(section, i) is None:
                references.check_written((section, i))
    position_count = written_count(root, "positions")
    check_names(position_count, problems)
    positions = {}
    for key, settings in sections.entries("positions").items():
        i = int(key)
        position = resolve_position(settings, ("positions", i), bounds, references)
        if position is not None:
            positions[i] = position
            volume = machine.volume if machine is not None and position.enabled else None
            if volume is not None and len(volume.lower) == references.dimension:
                check_inside(position, ("positions", i), volume, probes, references)
    candidates = None
    has_pool = written(root, "pool") is not None
    if has_pool and (choose := needed_service("resolve_candidates", ("pool",), problems)):
        candidates = choose(sections, positions, bounds, references)
    is_complete = not has_pool if candidates is None else candidates.complete
    choices: tuple[Position, ...] = () if candidates is None else candidates.positions
    possible = choices if is_complete else None
    check_use(sections, positions, position_count, references, possible, planning)
    # What may read calibrated balls, and have priors; more than there is of it where some is wrong.
    off = [position for position in positions.values() if not position.enabled]
    enabled = {i: position for i, position in positions.items() if position.enabled}
    offered = tuple(choices or enabled.values())
    named = dict(enumerate((*offered, *off)))
    readers, reader_count = enabled, position_count - len(off)
    if planning:
        readers = dict(enumerate(offered))
        reader_count = len(readers) + (not is_complete)
    calibrations = {}
    for key, settings in sections.entries("calibration").items():
        i = int(key)
        calibration = resolve_calibration(settings, ("calibration", i), references)
        if calibration is not None:
            calibrations[i] = calibration
            check_calibration_read(
                calibration, ("calibration", i), readers, reader_count, references
            )
    check_radii(calibrations, problems)
    pool = None
    if candidates is not None:
        pool = service("resolve_pool")(sections, candidates, calibrations, references)
    priors = resolve_priors(sections, machine, named, probes, references)
    influences = resolve_influences(sections, named, references)
    noise = resolve_noise(sections.get("noise"), problems)
    evaluation = resolve_evaluation(sections, machine, probes, references)
    check_size(sections, machine, enabled, calibrations, probes, evaluation, references)
    check_readings(sections, references)
    stars = resolve_stars(sections, probes, references)
    own_sections = resolve_own_sections(sections, references)
    if problems.messages and not tolerant or machine is None:
        return None, problems.messages
    if evaluation is None:
        evaluation = Evaluation(np.zeros((0, machine.dimension)), "")
    error_model = sections.get("error_model")
    experiment = Experiment(
        title=sections.get("title"),
        description=sections.get("description") or "",
        name=name,
        source=source,
        machine=machine,
        error_model=error_model and with_defaults(error_model, machine.dimension),
        true_machine=with_model_defaults(sections.get("true_machine"), machine.dimension),
        probes=probes,
        artefacts=references.artefacts,
        layouts=references.layouts,
        positions=tuple(positions.values()),
        calibration=tuple(calibrations.values()),
        evaluation=evaluation,
        target_uncertainty=target_of(sections),
        sigma=sections.get("sigma"),
        expected_rank_deficiency=sections.get("expected_rank_deficiency"),
        seed=sections.get("seed"),
        tree=root,
        mark=mark_of(root, ("positions",), of_key=True),
        builder=partial(_built, source=source, name=name, trust=trust, planning=planning),
        coverage_factor=sections.get("coverage_factor"),
        priors=priors,
        influences=influences,
        noise=noise,
        trust=trust,
        stars=stars,
        pool=pool if planning else None,
        doubts=tuple(str(doubt) for doubt in problems.doubts),
        readings=sections.get("readings") or no_settings(),
        notes=tuple(str(note) for note in problems.notes),
        sections=own_sections,
        extensions=needed_extensions(sections),
    )
    if tolerant and (problems.messages or off):
        return experiment, problems.messages
    experiment = enabled_only(experiment)
    return experiment if planning or pool is None else placed_only(experiment), []


def _without_variants(root: Node) -> Node:
    if not isinstance(root, Mapping):
        return root
    items = {key: node for key, node in root.items.items() if key != "variants"}
    return Mapping(root.mark, items, {key: root.key_marks[key] for key in items})
