"""Readings of a design: where the balls are that are read, how noisy and how disturbed."""

from __future__ import annotations

import traceback
from dataclasses import replace

import numpy as np
from ballplate.simulator.inputs.extensions import UnusableError
from ballplate.simulator.inputs.number_arrays import Array

from .arrays import Design
from .influence_quantities import Disturbed, Influence
from .objects import Readings
from .state import State


def reading_uncertainties(design: Design, readings: Readings) -> Array:
    """Standard uncertainties (m, d) of each co-ordinate of a single one of each reading's repeats,
    in metres.
    """
    if readings.uncertainty is not None:
        return readings.uncertainty
    return np.broadcast_to(design.machine.repeatability, (len(readings), design.dimension))


def reading_noise(design: Design, readings: Readings) -> Array:
    """Standard uncertainties (m, d) of the mean of each reading's repeats, in metres."""
    times = np.sqrt(readings.repeats)[:, None]
    return reading_uncertainties(design, readings) / times


def nominal_state(design: Design) -> State:
    """The design nominal, on a machine without errors."""
    return State(
        design.balls.places,
        design.positions.rotations,
        design.positions.origins,
        np.zeros(len(design.model.parameters)),
        design.probes.offsets,
        design.unknown_lengths.drawn,
        design.influence_values,
    )


def locations(design: Design, state: State, readings: Readings) -> Array:
    """True positions (m, d) of the balls that are read, T(y, t) in metres."""
    turned = np.einsum("mij,mj->mi", state.rotations[readings.position], state.balls[readings.ball])
    return turned + state.origins[readings.position]


class UnmatchedReadingsError(ValueError):
    """Scale readings that are not those of the readings they are joined to."""


def ensure_rows(design: Design, readings: Readings, x: Array) -> None:
    """Refuse scale readings without one row (d,) for each reading, and readings of balls that are
    not in their positions.

    :raises UnmatchedReadingsError: there are some.
    """
    if x.shape != (len(readings), design.dimension):
        raise UnmatchedReadingsError("there is not one scale reading for each reading")
    of_ball, of_position = design.balls.artefact, design.positions.artefact
    if (of_ball[readings.ball] != of_position[readings.position]).any():
        raise UnmatchedReadingsError("readings of balls that are not in their positions")


def in_sequence(readings: Readings, influences: tuple[Influence, ...]) -> Readings:
    """Return all readings in the order of reading, with the further columns that influence
    quantities need.
    """
    if not influences:
        return readings
    order = np.arange(len(readings), dtype=float)
    ordered = replace(readings, beside={**(readings.beside or {}), "order": order})
    for influence in influences:
        ordered = replace(
            ordered, beside={**(ordered.beside or {}), **influence.in_sequence(ordered)}
        )
    return ordered


def disturbed_readings(state: State, readings: Readings, x: Array) -> Disturbed:
    """Readings where the scales say `x` (m, d), in metres, as influence quantities see them."""
    return Disturbed(
        readings.ball,
        readings.position,
        readings.probe,
        x,
        state.balls[readings.ball],
        state.rotations[readings.position],
        state.probes[readings.probe],
        readings.beside or {},
    )


def influence_shifts(
    design: Design, state: State, readings: Readings, x: Array
) -> tuple[Array, Array]:
    """Return the effect of influence quantities on the locations of readings (m, d), and its
    derivative by their parameters (m, d, p), at scale readings `x` (m, d); metres.
    """
    disturbed = disturbed_readings(state, readings, x)
    shift, parts = np.zeros(x.shape), [np.zeros((*x.shape, 0))]
    for influence in design.influences:
        try:
            shifts, derivative = influence.shifts(disturbed)
        except MemoryError:
            raise
        except Exception as error:
            from ballplate.simulator.inputs.own_code import error_text, own_frame

            frames = traceback.extract_tb(error.__traceback__)
            user_frame = own_frame(error) or next(
                (f for f in frames[::-1] if f.name == "shifts"), None
            )
            text = (
                f"shifts of {type(influence).__name__} has failed: {error_text(error, user_frame)}"
            )
            raise UnusableError(text) from error
        shift += shifts
        # Constants act on the readings but have no column: they are no parameters.
        varies = np.array(
            [parameter.uncertainty != 0.0 for parameter in influence.parameters], bool
        )
        parts.append(derivative[:, :, varies])
    by_parameter = np.concatenate(parts, axis=2)
    return shift + by_parameter @ (state.influences - design.influence_values), by_parameter
