"""What readings may contradict of an experiment: causes that its design takes to be absent."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from ballplate.simulator.design import (
    Clock,
    Design,
    Disturbed,
    Drift,
    Influence,
    InfluenceParameter,
    Lengths,
    PositionScale,
    Priors,
    Sag,
    SagSettings,
    SharedDisplacements,
    disturbed_readings,
    even_clock,
    nominal_state,
)
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.machines import Array, ErrorModel, Integers, Unit

from .refits import other_chains

# Balls of a position that extend by less than this, in metres, tell nothing of a scale there.
LEAST_EXTENT = 1e-3

# What is assumed of the order of axes.
CHAIN = "chain of axes"

# What is assumed of further terms, and of single observations.
MODEL, GROSS = "error model", "gross errors"


@dataclass(frozen=True)
class PossibleCause:
    """A cause, in `words`, that contradicts what is `assumed`, and its `cure`.

    `displaced` gives the displacements (m, d, k) of readings by a unit of each of its parameters,
    and is None for further terms of a model. `design` is the one that does not assume its absence,
    None if there is no such. `parameters` are the names of those that the design has in addition,
    in `unit`: influence quantities, or the offset of a `probe` that is not -1.
    """

    assumed: str
    words: str
    cure: str
    displaced: Callable[[Disturbed], Array] | None = None
    design: Design | None = None
    parameters: tuple[str, ...] = ()
    unit: Unit = "m"
    probe: int = -1


def possible_causes(design: Design) -> Iterator[PossibleCause]:
    """Return all causes that a design takes to be absent, except further terms of the model."""
    for build in (_tips, _certificates, _temperatures, _sag, _drifts, _displacements, _chains):
        yield from build(design)


def _added(
    design: Design, assumed: str, words: str, cure: str, influence: Influence
) -> PossibleCause:
    """Return the cause of an influence quantity of which nothing is known.

    Designs have influence quantities of plates only: none has one that displaces length standards.
    """
    of_standards = np.setdiff1d(np.arange(len(design.readings)), design.plate_readings)
    at = disturbed_readings(
        nominal_state(design),
        design.readings.select(of_standards),
        np.ones((len(of_standards), design.dimension)),
    )
    is_of_plates = not influence.shifts(at)[1].any()
    return PossibleCause(
        assumed,
        words,
        cure,
        lambda at: influence.shifts(at)[1],
        replace(design, influences=(*design.influences, influence)) if is_of_plates else None,
        tuple(parameter.name for parameter in influence.parameters),
        influence.parameters[0].unit,
    )


def _unknown(names: list[str], unit: Unit, effect: float) -> tuple[InfluenceParameter, ...]:
    return tuple(InfluenceParameter(name, unit, 0.0, np.inf, effect) for name in names)


def _letters(design: Design) -> list[str]:
    return list(AXIS_NAMES[: design.dimension])


def _tips(design: Design) -> Iterator[PossibleCause]:
    priors = design.of(Priors)
    for probe in np.unique(design.readings.probe).tolist():
        place = np.full(len(design.probes.names), -1)
        place[probe] = 0
        influence = SharedDisplacements(
            ("probe",), place, _unknown(_letters(design), "m", 1.0), of_tips=True
        )
        words = f"offset of probe {design.probes.names[probe]}"
        of_others = np.arange(len(design.probes.names))[:, None] != probe
        unknown = replace(design.probes, free=design.probes.free | ~of_others)
        without = priors.select(np.flatnonzero(priors.probe != probe))
        yield replace(
            _added(design, "tips", words, "qualify the probe again", influence),
            design=replace(design, probes=unknown).observed(without),
            probe=probe,
        )


def _certificates(design: Design) -> Iterator[PossibleCause]:
    for artefact, name in enumerate(design.artefacts.names):
        positions = np.flatnonzero(design.positions.artefact == artefact)
        if _is_certified(design, artefact):
            words = f"scale of the certificate of {name}, or its temperature in all positions"
            cure = "check the certificate, and the temperatures of artefact and scales"
            influence = _scale(design, positions)
            yield _added(design, "certificates", words, cure, influence)


def _is_certified(design: Design, artefact: int) -> bool:
    lengths = design.of(Lengths)
    of_length = design.balls.artefact[design.readings.ball[lengths.first]]
    return bool((lengths.is_known & (of_length == artefact)).any()) or any(
        bool((design.balls.artefact[values.balls[:, 0]] == artefact).any())
        for values in design.observations
        if values.scales and len(values)
    )


def _temperatures(design: Design) -> Iterator[PossibleCause]:
    """Scales of single positions: of the artefact there, or of each axis of the machine."""
    cure = "check the temperatures there"
    for by_axis, assumed, words in (
        (False, "temperature of artefacts", "size of {} in position {}"),
        (True, "temperature of scales", "scales of the machine, not {}, in position {}"),
    ):
        for k in np.unique(design.readings.position).tolist():
            artefact = design.artefacts.names[design.positions.artefact[k]]
            influence = _scale(design, np.array([k]), by_axis)
            if influence.parameters:
                where = words.format(artefact, design.positions.names[k])
                yield _added(design, assumed, where, cure, influence)


def _scale(design: Design, positions: Integers, by_axis: bool = False) -> PositionScale:
    """Return one scale of all lengths in some positions, or one along each axis."""
    place = np.full((len(design.positions.names), design.dimension), -1)
    here = design.readings.select(np.flatnonzero(np.isin(design.readings.position, positions)))
    turned = design.positions.rotations[here.position]
    arms = np.einsum("mij,mj->mi", turned, design.balls.places[here.ball])
    reach = float(np.abs(arms).max(initial=LEAST_EXTENT))
    if not by_axis:
        place[positions] = 0
        return PositionScale(place, _unknown(["scale"], "1", reach))
    axes = np.flatnonzero(np.abs(arms).max(axis=0, initial=0.0) > LEAST_EXTENT)
    for column, axis in enumerate(axes.tolist()):
        place[positions, axis] = column
    return PositionScale(place, _unknown([AXIS_NAMES[axis] for axis in axes], "1", reach))


def _sag(design: Design) -> Iterator[PossibleCause]:
    known = {one.parameter.name for one in design.influences if isinstance(one, Sag)}
    parts = design.parts(Path())
    for artefact in np.unique(design.positions.artefact[design.plate_positions]).tolist():
        name = design.artefacts.names[artefact]
        if design.dimension < 3 or len(design.balls.of(artefact)) < 3:
            continue
        # Balls at the outermost places only do not sag.
        with np.errstate(invalid="ignore"):
            influence = SagSettings.model_construct(kind="sag", artefact=name).influence(parts)
        if influence.parameter.name not in known and np.isfinite(influence.shape).all():
            cure = "support the plate at other points, or state its sag"
            yield _added(design, "sag", f"sag of {name}", cure, influence)


def _drifts(design: Design) -> Iterator[PossibleCause]:
    if any(isinstance(influence, Drift) for influence in design.influences):
        return
    clock, d = even_clock(len(design.positions.names)), design.dimension
    if not np.ptp(clock.hours(design.readings)) > 0.0:
        return
    reach = float(np.abs(design.machine.volume.corners).max())
    yield _drift(design, clock, [(axis, False) for axis in range(d)], "readings", 1.0)
    yield _drift(design, clock, [(-1, True)], "scales", reach)


def _drift(
    design: Design, clock: Clock, parts: list[tuple[int, bool]], of: str, effect: float
) -> PossibleCause:
    """Return a drift by one unit in the whole campaign, whatever time it takes."""
    unit: Unit = "1" if parts[0][1] else "m"
    names = ["scale"] if parts[0][1] else _letters(design)
    influence = Drift(clock, tuple(parts), _unknown(names, unit, effect))
    hours = clock.hours(design.readings)
    beside = {influence.column: hours / np.ptp(hours)}
    readings = replace(design.readings, beside={**(design.readings.beside or {}), **beside})
    words = f"drift of the {of} from the first one to the last"
    cure = "read in an order that separates a drift, or state one under influences"
    cause = _added(replace(design, readings=readings), "drift", words, cure, influence)
    return replace(cause, displaced=lambda at: influence.shifts(replace(at, beside=beside))[1])


def _displacements(design: Design) -> Iterator[PossibleCause]:
    """Displacements of each probe in each position, as of a head that indexes badly."""
    readings = design.readings
    probes = len(design.probes.names)
    pairs = np.unique(readings.position * probes + readings.probe)
    is_known = any(isinstance(one, SharedDisplacements) for one in design.influences)
    if is_known or len(pairs) == len(np.unique(readings.position)):
        return
    place = np.full(len(design.positions.names) * probes, -1)
    place[pairs] = np.arange(len(pairs))
    names = [
        f"{design.positions.names[pair // probes]}, {design.probes.names[pair % probes]}: {letter}"
        for pair in pairs.tolist()
        for letter in _letters(design)
    ]
    influence = SharedDisplacements(
        ("position", "probe"),
        place.reshape(-1, probes),
        _unknown(names, "m", 1.0),
    )
    words = "displacements of each probe in each position"
    cure = "check how tips return after re-indexing or a change, or state reproducibility"
    yield _added(design, "reproducibility", words, cure, influence)


def _chains(design: Design) -> Iterator[PossibleCause]:
    model, zeros = design.model, np.zeros(len(design.model.parameters))
    for words, changed in other_chains(design):

        def displaced(at: Disturbed, other: ErrorModel = changed.model) -> Array:
            changes = other.jacobian(at.x, zeros, at.offsets) - model.jacobian(
                at.x, zeros, at.offsets
            )
            return np.asarray(changes[:, :, np.abs(changes).max(axis=(0, 1)) > 0.0])

        yield PossibleCause(
            CHAIN, words, "correct arrangement under error_model", displaced, changed
        )
