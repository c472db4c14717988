"""From `Resolved` to an `Experiment`: defaults are filled in, what is switched off is left out."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from ballplate.simulator.inputs.yamltree import Node, mark_of
from ballplate.simulator.machines.settings import with_defaults
from ballplate.simulator.machines.truth import with_model_defaults

from .machine import target_of
from .model import Evaluation, Experiment
from .own_sections import needed_extensions
from .pool import enabled_only, placed_only
from .readings_section import no_settings
from .resolution import Resolved


def construct(
    resolved: Resolved,
    root: Node,
    source: Path,
    name: str | None,
    builder: Callable[[Node], Experiment],
    planning: bool,
) -> Experiment:
    """Return the experiment of a file or of the variant with a `name`, with all its positions, for
    ``planning`` with its pool; its machine must be there.
    """
    sections, machine, references = resolved.sections, resolved.machine, resolved.references
    dimension, problems = references.dimension, references.problems
    assert machine is not None and dimension is not None
    nowhere = Evaluation(np.zeros((0, dimension)), "")
    return Experiment(
        title=sections.title,
        description=sections.description or "",
        name=name,
        source=source,
        machine=machine,
        error_model=sections.error_model and with_defaults(sections.error_model, dimension),
        true_machine=with_model_defaults(sections.true_machine, dimension),
        probes=resolved.probes,
        artefacts=references.artefacts,
        layouts=references.layouts,
        positions=tuple(resolved.positions.values()),
        calibration=tuple(resolved.calibrations.values()),
        evaluation=resolved.evaluation or nowhere,
        target_uncertainty=target_of(sections),
        sigma=sections.sigma,
        expected_rank_deficiency=sections.expected_rank_deficiency,
        seed=sections.seed,
        tree=root,
        mark=mark_of(root, ("positions",), of_key=True),
        builder=builder,
        coverage_factor=sections.coverage_factor,
        priors=resolved.priors,
        influences=resolved.influences,
        noise=resolved.noise,
        trust=references.trust,
        stars=resolved.stars,
        pool=resolved.pool if planning else None,
        doubts=tuple(str(doubt) for doubt in problems.doubts),
        readings=sections.readings or no_settings(),
        notes=tuple(str(note) for note in problems.notes),
        sections=resolved.own_sections,
        extensions=needed_extensions(sections),
    )


def evaluable(experiment: Experiment, resolved: Resolved, planning: bool) -> Experiment:
    """Return the experiment without what is switched off, and without artefacts that a pool alone
    places unless it is for ``planning``.
    """
    experiment = enabled_only(experiment)
    return experiment if planning or resolved.pool is None else placed_only(experiment)
