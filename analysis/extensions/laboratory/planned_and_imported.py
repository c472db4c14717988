"""Readings that reports have beside those that an experiment plans."""

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
    found = report_readings(paths, settings)
    if settings.design is None:
        return found
    differ = against_plan(found.readings, settings.design)
    return replace(found, remarks=(*found.remarks, *differ))


def against_plan(readings: Sequence[ImportedReading], design: Design) -> list[str]:
    """Which planned readings the reports do not have, and which they have that are not planned."""
    balls, positions, probes = design.balls.names, design.positions.names, design.probes.names
    planned = {
        (positions[position], balls[ball], probes[probe])
        for position, ball, probe in zip(
            *(design.readings.position, design.readings.ball, design.readings.probe), strict=True
        )
    }
    read = {(one.position, one.ball, one.probe) for one in readings}
    remarks = []
    missing, more = planned - read, read - planned
    if missing:
        told = f"{len(missing)} of {len(planned)} planned readings are missing"
        remarks.append(f"{told}: {_summed_up(missing, planned, design)}")
    if more:
        verb = "reading is" if len(more) == 1 else "readings are"
        told = f"{len(more)} {verb} not planned"
        remarks.append(f"{told}: {_summed_up(more, set(), design)}")
    return remarks


def _summed_up(
    some: set[tuple[str, str, str]], planned: set[tuple[str, str, str]], design: Design
) -> str:
    """Readings by position, ball and probe, abbreviated; a position all of whose planned readings
    are among them is told as one.
    """
    words = []
    for name in design.positions.names:
        own = [one for one in some if one[0] == name]
        if own and len(own) == sum(one[0] == name for one in planned):
            words.append(f"all of {name}")
        elif own:
            several = len(design.probes.names) > 1
            order = {ball: k for k, ball in enumerate(design.balls.names)}
            own.sort(key=lambda one: (order[one[1]], one[2]))
            told = (f"{ball} ({probe})" if several else ball for _, ball, probe in own)
            words.append(f"{listing(told, 4)} in {name}")
    return listing(words)
