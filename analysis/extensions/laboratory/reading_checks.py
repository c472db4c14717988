"""Checks that the reader of plain tables requests: types of co-ordinates, and gross errors."""

from __future__ import annotations

from collections.abc import Sequence

from ballplate.simulator.design import Design
from ballplate.simulator.inputs import Mark
from ballplate.simulator.machines import Array

from .coordinate_kinds import as_scale_readings, said_of
from .gross_error_messages import (
    doubts_about_lengths,
    doubts_about_volume,
    refuse_gross_errors,
    with_names_swapped,
)
from .plate_sizes import words_of_size


def doubts_about_readings(design: Design, x: Array, marks: Sequence[Mark]) -> tuple[str, ...]:
    """Return possible but improbable properties of scale readings (readings, d): positions,
    lengths, locations.
    """
    return (
        *filter(None, (words_of_size(design, x),)),
        *doubts_about_lengths(design, x),
        *doubts_about_volume(design, x, marks),
    )


class ReadingChecks:
    """The functions by which readings are placed and judged."""

    as_scale_readings = staticmethod(as_scale_readings)
    with_names_swapped = staticmethod(with_names_swapped)
    said_of = staticmethod(said_of)
    refuse_gross_errors = staticmethod(refuse_gross_errors)
    doubts_about_readings = staticmethod(doubts_about_readings)
