"""From `Sections` to `Resolved`: names are looked up, files read, places and values computed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ballplate.simulator.design.objects import Machine, Noise
from ballplate.simulator.design.observations.calibration import Calibration
from ballplate.simulator.inputs.extensions import service
from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.problems import Problems
from ballplate.simulator.inputs.trust import Trust
from ballplate.simulator.inputs.yamltree import written

from ._artefacts import resolve_references
from ._checks import check_calibration_read, check_names, check_radii, check_readings, check_use
from ._error_models import with_machines
from ._influences import resolve_influences
from ._probes import resolve_probes, resolve_stars
from .bounds import Bounds, check_inside, resolve_bounds
from .calibrations import resolve_calibration
from .machine import resolve_evaluation, resolve_machine, resolve_noise
from .model import Evaluation, Pool, Position, Prior, Probe
from .own_sections import needed_service, resolve_own_sections
from .position_sections import PositionSettings
from .positions import resolve_positions
from .references import References
from .sections import InfluenceSettings
from .size_checks import check_size
from .validation import Sections

if TYPE_CHECKING:
    from ballplate.simulator.design.observations.star import Star


@dataclass(frozen=True)
class Resolved:
    """What a file states, with all names looked up; what is wrong is missing, and reported.

    `sections` have the error model only if it can be used. `positions` and `calibrations` are by
    their index in the file, positions that are switched off among them.
    """

    sections: Sections
    references: References
    machine: Machine | None
    probes: Mapping[str, Probe]
    positions: Mapping[int, Position]
    calibrations: Mapping[int, Calibration]
    pool: Pool | None
    priors: tuple[Prior, ...]
    influences: tuple[InfluenceSettings, ...]
    noise: Noise
    evaluation: Evaluation | None
    stars: tuple[Star, ...]
    own_sections: Mapping[str, Any]


# In one piece: the order in which sections are resolved, each from those before it, stands in one
# place.
def resolve(
    sections: Sections, folder: Path, problems: Problems, trust: Trust, planning: bool
) -> Resolved:
    """Return the sections resolved; faults go to the problems. Files are named from ``folder``.

    For ``planning`` what may be chosen from a pool counts as placed and read.
    """
    references = resolve_references(sections, folder, problems, trust)
    machine = resolve_machine(sections.machine, problems) if sections.machine else None
    if machine is not None:
        references = replace(references, volume=machine.volume)
    probes = resolve_probes(sections, references)
    bounds = resolve_bounds(sections, machine, probes, references)
    sections = with_machines(sections, machine, references)
    # An entry that is invalid otherwise may have wrong names too, which would be reported only
    # after its repair.
    for steps in sections.invalid:
        if steps[0] in ("positions", "calibration"):
            references.check_written(steps)
    check_names(problems)
    positions = _positions(sections, machine, probes, bounds, references)
    candidates = None
    has_pool = written(problems.root, "pool") is not None
    if has_pool and (choose := needed_service("resolve_candidates", ("pool",), problems)):
        candidates = choose(sections, positions, bounds, references)
    is_complete = not has_pool if candidates is None else candidates.complete
    choices: tuple[Position, ...] = () if candidates is None else candidates.positions
    check_use(sections, positions, references, choices if is_complete else None, planning)
    # Positions that may read calibrated balls, and have priors. In a plan those are the choices.
    # `reader_count` counts invalid ones, too: what they read is not known, and not reported unread.
    off = [position for position in positions.values() if not position.enabled]
    enabled = {i: position for i, position in positions.items() if position.enabled}
    offered = tuple(choices or enabled.values())
    all_positions = dict(enumerate((*offered, *off)))
    may_read, reader_count = enabled, sections.position_count - len(off)
    if planning:
        may_read = dict(enumerate(offered))
        reader_count = len(may_read) + (not is_complete)
    calibrations = {}
    for i, settings in sections.calibration.items():
        calibration = resolve_calibration(settings, ("calibration", i), references)
        if calibration is not None:
            calibrations[i] = calibration
            check_calibration_read(
                calibration, ("calibration", i), may_read, reader_count, references
            )
    check_radii(calibrations, problems)
    pool = None
    if candidates is not None:
        pool = service("resolve_pool")(sections, candidates, calibrations, references)
    priors: tuple[Prior, ...] = ()
    if sections.priors:
        from ._priors import resolve_priors

        priors = resolve_priors(sections, machine, all_positions, probes, references)
    influences = resolve_influences(sections, all_positions, references)
    noise = resolve_noise(sections.noise, problems)
    evaluation = resolve_evaluation(sections, machine, probes, references)
    check_size(sections, machine, enabled, calibrations, probes, evaluation, references)
    check_readings(sections, references)
    return Resolved(
        sections=sections,
        references=references,
        machine=machine,
        probes=probes,
        positions=positions,
        calibrations=calibrations,
        pool=pool,
        priors=priors,
        influences=influences,
        noise=noise,
        evaluation=evaluation,
        stars=resolve_stars(sections, probes, references),
        own_sections=resolve_own_sections(sections, references),
    )


def _positions(
    sections: Sections,
    machine: Machine | None,
    probes: Mapping[str, Probe],
    bounds: Bounds | None,
    references: References,
) -> dict[int, Position]:
    """Return the positions by index; enabled ones whose readings leave the volume are reported."""
    by_steps: dict[Steps, PositionSettings] = {
        ("positions", i): settings for i, settings in sections.positions.items()
    }
    positions = resolve_positions(by_steps, bounds, references)
    if machine is not None and len(machine.volume.lower) == references.dimension:
        enabled = {steps: place for steps, place in positions.items() if place.enabled}
        check_inside(enabled, machine.volume, probes, references)
    return {int(steps[1]): position for steps, position in positions.items()}
