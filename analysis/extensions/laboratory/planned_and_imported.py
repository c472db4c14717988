"""Comparison of readings in reports with those that an experiment plans."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ballplate.simulator.design import Design
from ballplate.simulator.inputs import listing

from .imported import ImportedReading, ImportedReadings, ImportSettings, report_readings


def import_readings(paths: Sequence[Path], settings: ImportSettings) -> ImportedReadings:
    """Readings of reports, and how they differ from those that the experiment plans.

    :raises ExperimentError: as `report_readings`.
    """
    imported = report_readings(paths, settings)
    if settings.design is None:
        return imported
    differ = against_plan(imported.readings, settings.design)
    return replace(imported, remarks=(*imported.remarks, *differ))


def against_plan(readings: Sequence[ImportedReading], design: Design) -> list[str]:
    """Return notes on planned readings that are missing, and on unplanned ones."""
    balls, positions, probes = design.balls.names, design.positions.names, design.probes.names
    planned = {
        (positions[position], balls[ball], probes[probe])
        for position, ball, probe in zip(
            *(design.readings.position, design.readings.ball, design.readings.probe), strict=True
        )
    }
    keys_read = {(reading.position, reading.ball, reading.probe) for reading in readings}
    remarks = []
    missing, more = planned - keys_read, keys_read - planned
    if missing:
        problem = f"{len(missing)} of {len(planned)} planned readings are missing"
        remarks.append(f"{problem}: {_summed_up(missing, planned, design)}")
    if more:
        verb = "reading is" if len(more) == 1 else "readings are"
        problem = f"{len(more)} {verb} not planned"
        remarks.append(f"{problem}: {_summed_up(more, set(), design)}")
    return remarks


def _summed_up(
    some: set[tuple[str, str, str]], planned: set[tuple[str, str, str]], design: Design
) -> str:
    """Return readings by position, ball and probe, abbreviated; a position with all its planned
    readings is listed as one.
    """
    words = []
    for name in design.positions.names:
        keys_of_position = [key for key in some if key[0] == name]
        if keys_of_position and len(keys_of_position) == sum(key[0] == name for key in planned):
            words.append(f"all of {name}")
        elif keys_of_position:
            several = len(design.probes.names) > 1
            order = {ball: k for k, ball in enumerate(design.balls.names)}
            keys_of_position.sort(key=lambda key: (order[key[1]], key[2]))
            balls_text = (
                f"{ball} ({probe})" if several else ball for _, ball, probe in keys_of_position
            )
            words.append(f"{listing(balls_text, 4)} in {name}")
    return listing(words)
