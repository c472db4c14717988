"""Causes of many directions that an experiment takes to be absent, as biases of its readings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from ballplate.extensions.influences import Drift, Sag, SagSettings, SharedDisplacements, even_clock
from ballplate.simulator.design import Design, State, disturbed_readings, expected_readings
from ballplate.simulator.geometry import AXIS_NAMES
from ballplate.simulator.machines import (
    ARRANGEMENTS,
    Array,
    ErrorModel,
    KinematicModel,
    PlaneModel,
    Unit,
)

from .bias_patterns import LinearisedDesign
from .smooth import smooth_errors

# Balls of a position that extend by less than this, in metres, show no scale there.
LEAST_EXTENT = 1e-3

# What is assumed of the order of axes, and of further terms.
CHAIN, MODEL = "chain of axes", "error model"


@dataclass(frozen=True)
class PossibleCause:
    """A cause, in `words`, against what is `assumed`, and its `cure`: `biases` (n, k) by a unit of
    each of its parameters.

    `parameters` are the names of a few, in `unit`; without them it explains nearly any residuals of
    its kind. `design` has another chain of axes.
    """

    assumed: str
    words: str
    cure: str
    biases: Array
    parameters: tuple[str, ...] = ()
    unit: Unit = "m"
    design: Design | None = None


def hypotheses(design: Design, state: State) -> Iterator[PossibleCause]:
    """Return all causes of several directions, at a state."""
    linearised = LinearisedDesign(design, state, None)
    for build in (_scales, _sag, _drift, _displacements, _chains):
        for hypothesis in build(design, state):
            yield replace(hypothesis, biases=linearised.biases(hypothesis.biases))
    for words, displacement, is_drift in smooth_errors(design, state):
        assumed, cure = MODEL, "compare error models (ballplate models)"
        if is_drift:
            assumed, cure = "drift", "read in an order that separates a drift, or state one"
        yield PossibleCause(assumed, words, cure, linearised.biases(displacement))


def _scales(design: Design, state: State) -> Iterator[PossibleCause]:
    """Scales of the machine along each axis, in one position."""
    readings, positions = design.readings, design.positions
    turned = positions.rotations[readings.position]
    arms = np.einsum("mij,mj->mi", turned, design.balls.places[readings.ball])
    for k in np.unique(readings.position).tolist():
        here = np.where((readings.position == k)[:, None], arms, 0.0)
        axes = np.flatnonzero(np.abs(here).max(axis=0) > LEAST_EXTENT)
        name = design.artefacts.names[positions.artefact[k]]
        words = f"scales of the machine, not {name}, in position {positions.names[k]}"
        letters = tuple(AXIS_NAMES[axis] for axis in axes)
        if letters:
            biases = (here[:, :, None] * np.eye(design.dimension))[:, :, axes]
            cure = "check the temperatures there"
            yield PossibleCause("temperature of scales", words, cure, biases, letters, "1")


def _sag(design: Design, state: State) -> Iterator[PossibleCause]:
    known = {one.parameter.name for one in design.influences if isinstance(one, Sag)}
    parts, readings = design.parts(Path()), design.readings
    at = disturbed_readings(state, readings, expected_readings(design, state, readings))
    for artefact in np.unique(design.positions.artefact[design.plate_positions]).tolist():
        name = design.artefacts.names[artefact]
        if design.dimension < 3 or len(design.balls.of(artefact)) < 3:
            continue
        # Balls at the outermost places only do not sag.
        with np.errstate(invalid="ignore"):
            influence = SagSettings.model_construct(kind="sag", artefact=name).influence(parts)
        if influence.parameter.name not in known and np.isfinite(influence.shape).all():
            cure = "support the plate at other points, or state its sag"
            biases = influence.shifts(at)[1]
            yield PossibleCause("sag", f"sag of {name}", cure, biases, ("sag",))


def _drift(design: Design, state: State) -> Iterator[PossibleCause]:
    """A drift of the scales; drifts of the readings are smooth errors."""
    hours = even_clock(len(design.positions.names)).hours(design.readings)
    if np.ptp(hours) > 0.0 and not any(isinstance(one, Drift) for one in design.influences):
        x = expected_readings(design, state, design.readings)
        biases = (x * (hours / np.ptp(hours))[:, None])[:, :, None]
        words = "drift of the scales from the first reading to the last"
        cure = "read in an order that separates a drift, or state one under influences"
        yield PossibleCause("drift", words, cure, biases, ("scale",), "1")


def _displacements(design: Design, state: State) -> Iterator[PossibleCause]:
    """Displacements of each probe in each position, as of a head that indexes badly."""
    position, probe = design.readings.position, design.readings.probe
    pairs, group = np.unique(position * len(design.probes.names) + probe, return_inverse=True)
    is_known = any(isinstance(one, SharedDisplacements) for one in design.influences)
    if not is_known and len(pairs) > len(np.unique(position)):
        by_group = np.eye(len(pairs))[group][:, None, :, None]
        d = design.dimension
        biases = (by_group * np.eye(d)[:, None, :]).reshape(len(position), d, -1)
        words = "displacements of each probe in each position"
        cure = "check how tips return after re-indexing or a change, or state reproducibility"
        yield PossibleCause("reproducibility", words, cure, biases)


def _chains(design: Design, state: State) -> Iterator[PossibleCause]:
    """Other arrangements of the axes, by what they change of errors to first order."""
    model, zeros = design.model, np.zeros(len(design.model.parameters))
    spatial = model.spatial if isinstance(model, PlaneModel) else model
    if not isinstance(spatial, KinematicModel):
        return
    x = expected_readings(design, state, design.readings)
    offsets = state.probes[design.readings.probe]
    names: dict[object, list[str]] = {}
    for name, arrangement in ARRANGEMENTS.items():
        if arrangement != spatial.arrangement:
            names.setdefault(arrangement, []).append(name)
    for of_it in names.values():
        other: ErrorModel = replace(spatial, arrangement=ARRANGEMENTS[of_it[0]])
        if isinstance(model, PlaneModel):
            other = replace(model, spatial=other)
        changes = other.jacobian(x, zeros, offsets) - model.jacobian(x, zeros, offsets)
        biases = np.asarray(changes[:, :, np.abs(changes).max(axis=(0, 1)) > 0.0])
        words = f"the arrangement of the axes is {' or '.join(of_it)}"
        cure = "correct arrangement under error_model"
        yield PossibleCause(CHAIN, words, cure, biases, design=replace(design, model=other))
