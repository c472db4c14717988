"""Probes of an experiment: their offsets, as stated or by the angles of a head, their
uncertainties, and stars.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from ballplate.simulator.geometry.ball_layouts import frozen
from ballplate.simulator.geometry.motions import rotation_matrix
from ballplate.simulator.inputs.messages import ExperimentError, Steps
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.settings import hint, listing
from ballplate.simulator.inputs.yamltree import written

from ._artefacts import DEFAULT_PROBE
from .model import Probe
from .position_sections import HeadSettings, ProbeSettings, StarSettings
from .references import References, lengths_per_axis
from .validation import Sections

if TYPE_CHECKING:
    from ballplate.simulator.design.observations.star import Star

# Stated offsets are nominal, and wrong by this much in metres before anybody need be told.
NOMINAL = 3e-3
# So many standard uncertainties of a tip are possible.
POSSIBLE = 5.0


def doubt_of_table(star: Star, offsets: Array) -> str:
    """Return an improbable feature of a star's table compared with the stated offsets (l, d) of
    its probes, in metres; possibly empty.
    """
    misfit = _misfit(star, offsets)
    worst, possible = float(misfit.max()), POSSIBLE * star.standard_uncertainty
    if worst <= max(NOMINAL, possible):
        return ""
    far = [
        f'"{name}"'
        for name, misfit_of_probe in zip(star.probes, misfit, strict=True)
        if misfit_of_probe > 0.5 * worst
    ]
    return (
        f"its tips are up to {_length(worst)} from the stated offsets, however it is turned, most"
        f" of all {listing(far)}; check which tip is which, in the table and among the probes"
    )


def _misfit(star: Star, offsets: Array) -> Array:
    """Distances (..., l) between offsets (..., l, d) and the table, turned to be nearest."""
    placed = star.coordinates @ star.rotation(offsets).swapaxes(-1, -2)
    difference = offsets - placed
    if not star.has_place:
        difference = difference - difference.mean(axis=-2, keepdims=True)
    return np.asarray(np.linalg.norm(difference, axis=-1))


def _length(value: float) -> str:
    return f"{1e3 * value:.1f} mm"


def resolve_probes(sections: Sections, references: References) -> dict[str, Probe]:
    """Return the probes that are right, by name."""
    problems, dimension = references.problems, references.dimension
    if written(problems.root, "probes") is None:
        if dimension == 3:
            text = (
                'missing; add "probes", such as {down: [0 mm, 0 mm, -50 mm]}: offsets from the'
                " reference point"
            )
            problems.add(("probes",), text)
            return {}
        at_reference = Probe(DEFAULT_PROBE, np.zeros(dimension or 0))
        return {DEFAULT_PROBE: at_reference} if dimension == 2 else {}
    tilts = [getattr(entry, "a", None) for entry in sections.probes.values()]
    if sections.head is not None and set(tilts) <= {None}:
        problems.doubt(("head",), "no probe states an angle A; the head has no effect")
    members = _star_members(sections, references)
    reference = _reference_probe(sections, references)
    probes = {}
    for name, settings in sections.probes.items():
        steps = ("probes", name)
        offset, uncertainty, angles = settings, None, None
        if isinstance(settings, ProbeSettings):
            offset = _offset(settings, sections.head, steps, references)
            angles = None if settings.a is None else (settings.a, settings.b or 0.0)
            uncertainty = _offset_uncertainty(settings, steps, references)
            if name in members and (settings.unknown or settings.standard_uncertainty):
                key = "unknown" if settings.unknown else "standard_uncertainty"
                text = "its star states the uncertainty of this probe; remove it"
                problems.add((*steps, key), text, True)
        if name in members:
            # Offsets of a star's tips are free one by one. What is known of them is the shape of
            # the star.
            uncertainty = np.full(dimension or 0, np.inf)
        if offset is not None and references.has_dimension(offset, steps):
            offset_uncertainty = None if name == reference else uncertainty
            probes[name] = Probe(name, np.array(offset, float), offset_uncertainty, angles)
    return probes


def _offset(
    settings: ProbeSettings, head: HeadSettings | None, steps: Steps, references: References
) -> tuple[float, ...] | None:
    """Return the offset (d,) as stated or by the head's angles, or report faults."""
    if settings.a is None:
        return settings.offset
    tip = settings.tip or (head.tip if head is not None else None)
    text = "has no centre to turn about; add head: {tip: [0 mm, 0 mm, -120 mm]}"
    if not references.require(head is not None, (*steps, "A"), text) or head is None:
        return None
    if not references.require(references.dimension != 2, (*steps, "A"), "has no meaning in 2-D"):
        return None
    text = "has no tip; add tip to head, or to the probe"
    if not references.require(tip is not None, (*steps, "A"), text) or tip is None:
        return None
    centre = head.centre or (0.0, 0.0, 0.0)
    for where, point in ((("head", "tip"), tip), (("head", "centre"), centre)):
        if not references.has_dimension(point, where):
            return None
    # A positive angle A tilts a stylus that points down towards -y.
    turn = rotation_matrix([-settings.a, 0.0, settings.b or 0.0])
    return tuple((np.array(centre) + turn @ np.array(tip)).tolist())


def _star_members(sections: Sections, references: References) -> list[str]:
    """Return probes of stars, and report faults of their names."""
    members = []
    for i, settings in sections.stars.items():
        steps = ("stars", int(i), "probes")
        names = settings.probes or references.probes
        if settings.probes is not None and not references.are_probes(names, steps):
            continue
        references.require(len(names) > 1, ("stars", int(i)), "has one probe only; remove the star")
        for name in names:
            text = f'probe "{name}" is in another star already; a probe is in one star'
            references.require(name not in members, steps, text)
        members += [name for name in names if name not in members]
    return members


def _in_place(sections: Sections, references: References) -> list[str]:
    """Probes of stars that turn about the machine's reference point."""
    return [
        name
        for settings in sections.stars.values()
        if settings.place == "stated"
        for name in settings.probes or references.probes
    ]


def resolve_stars(
    sections: Sections, probes: Mapping[str, Probe], references: References
) -> tuple[Star, ...]:
    """Return the stars that are right."""
    if not sections.stars:
        return ()
    from ballplate.simulator.design.observations.star import Star

    stars = []
    for i, settings in sections.stars.items():
        names = tuple(settings.probes or references.probes)
        if not set(names) <= set(probes):
            continue
        steps = ("stars", int(i))
        coordinates = np.array([probes[name].offset for name in names])
        if settings.values is not None:
            values = _star_values(settings, names, (*steps, "values"), references)
            if values is None:
                continue
            coordinates = values
        has_place = settings.place == "stated"
        star = Star(names, frozen(coordinates), settings.standard_uncertainty, has_place)
        if settings.values is not None:
            offsets = np.array([probes[name].offset for name in names])
            if text := doubt_of_table(star, offsets):
                references.problems.doubt((*steps, "values"), text)
        stars.append(star)
    return tuple(stars)


def _star_values(
    settings: StarSettings, names: tuple[str, ...], steps: Steps, references: References
) -> Array | None:
    """Return co-ordinates (l, d) of a star's tips from its table, or report faults."""
    from ballplate.simulator.inputs.tables import read_table

    letters = list("xyz"[: references.dimension])
    try:
        rows = read_table(references.file(settings.values), ["probe"], letters, [])
    except ExperimentError as error:
        references.problems.take(error, steps)
        return None
    before, values = len(references.problems.messages), dict[str, tuple[float, ...]]()
    for row in rows:
        name = row.texts[0]
        if name not in names:
            text = f'unknown probe "{name}"; {hint(name, names)}'
            references.problems.add_at(row.mark, steps, text)
        elif name in values:
            text = f'probe "{name}" is listed twice; remove one of the two lines'
            references.problems.add_at(row.mark, steps, text)
        values[name] = row.lengths
    missing = [name for name in names if name not in values]
    if missing and len(references.problems.messages) == before:
        text = f"no co-ordinates for {listing(missing)}; add them, or leave them out of probes"
        references.problems.add(steps, text)
    if len(references.problems.messages) > before:
        return None
    return np.array([values[name] for name in names])


def _reference_probe(sections: Sections, references: References) -> str:
    """Return the name of the probe whose offset is held, if any is held, and report faults; stars
    that turn about a stated point need none.
    """
    problems = references.problems
    listed = {str(name): s for name, s in sections.probes.items() if isinstance(s, ProbeSettings)}
    named = [name for name, settings in listed.items() if settings.reference]
    for name in named[1:]:
        problems.add(
            ("probes", name, "reference"),
            f'"{named[0]}" is the reference already; remove one of the two',
        )
    # A shift of all offsets cannot be distinguished from a shift of all poses, so that one offset
    # has to be held.
    in_place = _in_place(sections, references)
    if named:
        text = (
            "its star turns about a stated place, which is the reference; remove it, or write"
            " place: unknown for the star"
        )
        references.require(named[0] not in in_place, ("probes", named[0], "reference"), text)
        return named[0]
    if in_place:
        return ""
    first = references.probes[0] if references.probes else ""
    if first in listed and (listed[first].unknown or listed[first].standard_uncertainty):
        text = (
            "its offset is held as stated, as the first probe is the reference if none has"
            " reference: true"
        )
        problems.doubt(("probes", first), f"{text}; its stated uncertainty is ignored")
    return first


def _offset_uncertainty(
    settings: ProbeSettings, steps: Steps, references: References
) -> Array | None:
    """Return standard uncertainties (d,) of an estimated offset, infinite for an unknown one, if
    stated and valid.
    """
    problems, dimension = references.problems, references.dimension
    stated = settings.standard_uncertainty
    if settings.unknown and stated is not None:
        problems.add(
            (*steps, "unknown"),
            'cannot be combined with "standard_uncertainty"; give only one of the two',
            True,
        )
    if settings.reference and (settings.unknown or stated is not None):
        key = "unknown" if settings.unknown else "standard_uncertainty"
        problems.add(
            (*steps, key), "the offset of the reference is held as stated; remove it", True
        )
    uncertainty, is_right = lengths_per_axis(stated, (*steps, "standard_uncertainty"), references)
    if settings.unknown and dimension is not None:
        return frozen([np.inf] * dimension)
    return uncertainty if is_right else None
