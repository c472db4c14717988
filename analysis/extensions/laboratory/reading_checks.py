"""Checks that the reader of plain tables requests: types of co-ordinates, and gross errors in
readings.
"""

from __future__ import annotations

from collections.abc import Sequence

from ballplate.simulator.design import Design, Readings
from ballplate.simulator.experiment import ReadingsSettings
from ballplate.simulator.inputs import Mark
from ballplate.simulator.machines import Array

from .common_causes import doubts_about_poses
from .coordinate_kinds import as_scale_readings, doubts_about_copies
from .digits import doubts_about_digits, doubts_about_units
from .gross_error_messages import (
    doubts_about_lengths,
    doubts_about_volume,
    refuse_gross_errors,
    with_names_swapped,
)
from .implausible_temperatures import doubts_about_temperatures
from .offsets_applied import doubt_about_offsets, said_of
from .plate_sizes import words_of_size


def doubts_about_table(
    design: Design,
    readings: Readings,
    values: Array,
    uncertainties: Array | None,
    settings: ReadingsSettings,
    mark: Mark,
) -> tuple[str, ...]:
    """Return doubts about co-ordinates (m, d) in a table, and about its uncertainties (m,); `mark`
    is its location.

    :raises ExperimentError: they clearly differ from the stated or assumed type.
    """
    doubts = doubt_about_offsets(design, readings, values, settings, mark)
    doubts += doubts_about_digits(design, values, readings.uncertainty)
    if uncertainties is not None:
        doubts += doubts_about_units(design, uncertainties)
    if settings.coordinates == "part":
        doubts += doubts_about_copies(design, readings, values)
    return doubts


def doubts_about_readings(design: Design, x: Array, marks: Sequence[Mark]) -> tuple[str, ...]:
    """Return possible but improbable properties of scale readings (readings, d): locations,
    lengths, temperatures.
    """
    of_volume = doubts_about_volume(design, x, marks)
    return (
        *doubts_about_poses(design, x),
        *doubts_about_lengths(design, x),
        *filter(None, (words_of_size(design, x),)),
        *of_volume,
        *doubts_about_temperatures(design, marks),
    )


class ReadingChecks:
    """The functions by which readings are placed and judged."""

    as_scale_readings = staticmethod(as_scale_readings)
    with_names_swapped = staticmethod(with_names_swapped)
    said_of = staticmethod(said_of)
    doubts_about_table = staticmethod(doubts_about_table)
    refuse_gross_errors = staticmethod(refuse_gross_errors)
    doubts_about_readings = staticmethod(doubts_about_readings)
