"""Assumptions of results, by name and as text."""

from __future__ import annotations

from ballplate.extensions.diagnosis.remainders import too_many_entries
from ballplate.extensions.maps.length_map import target_words
from ballplate.presentation import uncertainty_words
from ballplate.simulator.design import Design
from ballplate.simulator.experiment import Experiment
from ballplate.simulator.inputs import listing

# Readings of plates beyond which judging every bias takes longer than a page should.
MOST_JUDGED = 1500


def target_in_words(experiment: Experiment) -> str:
    """Return the target of lengths; empty without one."""
    target = experiment.target_uncertainty
    return "" if target is None else target_words(target.stated)


def assumptions(experiment: Experiment, parameters: int) -> list[tuple[str, str]]:
    """Return file, error model with its number of `parameters`, repeatability, certificates,
    probes, influence quantities and target.

    >>> import ballplate as bp
    >>> experiment = bp.load("designs/hurt_foss/bar-bell.yaml", "length known")
    >>> for name, words in assumptions(experiment, 9)[1:6]:
    ...     print(f"{name}: {words}")
    Variant: length known
    Volume: 1000 x 800 x 600 mm
    Error model: metric, 9 parameters
    Repeatability: 1 µm (standard uncertainty)
    Certificates: distances of bar (1)
    """
    sides = zip(*experiment.machine.volume.corners, strict=True)
    volume = " x ".join(f"{1e3 * (high - low):.6g}" for low, high in sides)
    repeatability = [f"{1e6 * u:.4g}" for u in experiment.machine.repeatability.tolist()]
    model = experiment.error_model
    facts = {
        "File": str(experiment.source),
        "Variant": experiment.name or "",
        "Description": " ".join(experiment.description.split()),
        "Volume": f"{volume} mm",
        "Error model": f"{model.kind}, {parameters} parameters",
        "Repeatability": f"{', '.join(dict.fromkeys(repeatability))} µm (standard uncertainty)",
        "Certificates": _certificates(experiment),
        "Probe offsets": _offsets(experiment),
        "Influence quantities": _influences(experiment),
    }
    target = experiment.target_uncertainty
    if target is None:
        facts["Target"] = "none is stated"
    else:
        by = uncertainty_words(target.coverage_factor)
        facts["Target"] = f"{target_in_words(experiment)}, compared with the {by}"
    return [(name, words) for name, words in facts.items() if words]


def _certificates(experiment: Experiment) -> str:
    descriptions = [
        f"{certificate.kind} of {certificate.subject} ({certificate.size})"
        for certificate in experiment.calibration
    ]
    descriptions += [f"prior of {prior.name}" for prior in experiment.priors]
    return listing(descriptions) or "no certificate: readings are the only information on artefacts"


def _offsets(experiment: Experiment) -> str:
    estimated = [probe.name for probe in experiment.probes.values() if probe.is_estimated]
    exact = [probe.name for probe in experiment.probes.values() if not probe.is_estimated]
    parts = [f"estimated: {listing(estimated)}"] if estimated else []
    return "; ".join([*parts, *([f"exact as stated: {listing(exact)}"] if exact else [])])


def _influences(experiment: Experiment) -> str:
    kinds = [
        str(getattr(influence, "kind", type(influence).__name__))
        for influence in experiment.influences
    ]
    absent = [kind for kind in ("temperature", "drift") if kind not in kinds]
    without = f"no effect of {' and '.join(absent)} is assumed" if absent else ""
    return "; ".join(filter(None, [listing(kinds), without]))


def unjudged(design: Design) -> str:
    """Return why a page does not evaluate every bias; possibly empty."""
    count = len(design.plate_readings)
    if count <= MOST_JUDGED:
        return too_many_entries(design)
    return (
        f"{count} readings are too many to be judged one by one here; ballplate run --reliability"
        " does it"
    )
