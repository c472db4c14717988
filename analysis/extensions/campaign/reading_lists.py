"""Readings of a run sheet one by one, in the order in which they are taken: a table to fill in, and
points for the program of a machine.

The program's points are written in DMIS, as ISO 22093 names it, or as a plain table.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from ballplate.simulator.experiment import Experiment, lay_out
from ballplate.simulator.geometry import AXIS_NAMES, ball_coordinates
from ballplate.simulator.inputs import DURATION_UNITS, CsvWriter, in_one_line, refused
from ballplate.simulator.machines import Array

from ..planning import RunSheet, Step, position_of

# What names of features keep; anything else becomes a hyphen.
UNUSUAL = re.compile(r"[^A-Za-z0-9.]+")

# Points on a ball besides the one opposite the stylus, and how far towards its pole they are.
AROUND, RAISED = 4, np.radians(25.0)


@dataclass(frozen=True, eq=False)
class PlannedReading:
    """One reading: where the ball's centre is expected (d,) in machine co-ordinates, in metres.

    `feature` is a name for the program of a machine, position_ball_probe, the same for all repeats.
    """

    position: str
    ball: str
    probe: str
    feature: str
    centre: Array


def sequence(step: Step) -> Iterator[tuple[str, list[tuple[str, int, int]]]]:
    """Each probe of a step in order, with its balls: their names, indices and repeats."""
    item = position_of(step.candidate)
    for probe in step.probes:
        balls = [
            (name, int(k), group.repeats)
            for group in item.readings
            if probe in group.probes
            for name, k in zip(group.balls, group.ball_indices, strict=True)
        ]
        if balls:
            yield probe, balls


def planned_readings(sheet: RunSheet, experiment: Experiment) -> list[PlannedReading]:
    """Return every planned reading, in order.

    :raises ExperimentError: two readings would have the same feature name.
    """
    planned = []
    meant: dict[str, tuple[str, str, str]] = {}
    for step in sheet.steps:
        item = position_of(step.candidate)
        centres = ball_coordinates(item.pose, experiment.layouts[item.artefact])
        for probe, balls in () if step.done else sequence(step):
            for ball, k, repeats in balls:
                key = step.name, ball, probe
                name = feature_name(*key)
                first_key = meant.setdefault(name.casefold(), key)
                if first_key != key:
                    names = " and ".join(
                        f'"{", ".join(key_names)}"' for key_names in (first_key, key)
                    )
                    text = f"{names} would both be the feature {name}; rename one"
                    raise refused(experiment.source, text, "positions")
                planned += [
                    PlannedReading(*key, name, centres[k, : experiment.dimension])
                ] * repeats
    return planned


def feature_name(position: str, ball: str, probe: str) -> str:
    """The name of a reading's feature.

    >>> feature_name("P1", "r1c2", "down"), feature_name("flat low", "3", "A0_B90")
    ('P1_r1c2_down', 'flat-low_3_A0-B90')
    """
    return "_".join(UNUSUAL.sub("-", part) for part in (position, ball, probe))


def template_csv(readings: Sequence[PlannedReading], experiment: Experiment) -> str:
    """Return the table of readings as `fit` reads it, with empty cells for co-ordinates and
    influence quantities.
    """
    out = io.StringIO()
    writer = CsvWriter(out)
    blank = [f"{axis}_mm" for axis in AXIS_NAMES[: experiment.dimension]]
    for kind in lay_out(experiment).influences if experiment.influences else ():
        # Times are those of a clock.
        named = (
            name if units == DURATION_UNITS else f"{name}_{next(iter(units))}"
            for name, units in kind.columns.items()
        )
        blank += [name for name in named if name not in blank]
    writer.writerow(["position", "ball", "probe", *blank])
    for reading in readings:
        writer.writerow([reading.position, reading.ball, reading.probe, *[""] * len(blank)])
    return out.getvalue()


def points_csv(readings: Sequence[PlannedReading], dimension: int) -> str:
    """The centres as a plain table; its columns are no readings, so that `fit` refuses it."""
    out = io.StringIO()
    writer = CsvWriter(out)
    nominal = [f"nominal_{axis}_mm" for axis in AXIS_NAMES[:dimension]]
    writer.writerow(["feature", "position", "ball", "probe", *nominal])
    for reading in readings:
        numbers = [f"{1e3 * value:.4f}" for value in reading.centre]
        writer.writerow([reading.feature, reading.position, reading.ball, reading.probe, *numbers])
    return out.getvalue()


def points_dmis(
    readings: Sequence[PlannedReading], title: str, diameter: float, styli: dict[str, Array]
) -> str:
    """Return spheres of a `diameter` (m) in DMIS, with points to probe on the side of each stylus.

    `styli` are the probes' offsets (3,) by name. The machine's programmer adds moves between balls.
    """
    title_text = re.sub(r"[^ -~]|'", "-", in_one_line(title))
    lines = [
        f"DMISMN/'{title_text}',05.2",
        "UNITS/MM,ANGDEC",
        "D(MCS)=DATSET/MCS",
        "MODE/PROG,MAN",
        "$$ Centres and points in machine co-ordinates, where the plan has the artefacts.",
        "$$ No moves between balls and no alignment: add both before this runs anywhere.",
    ]
    selected, defined = "", set[str]()
    for reading in readings:
        if reading.probe != selected:
            selected = reading.probe
            lines.append(f"SNSLCT/SA({UNUSUAL.sub('-', selected)})")
        if reading.feature not in defined:
            defined.add(reading.feature)
            sphere = f"{_numbers(1e3 * reading.centre)},{1e3 * diameter:.4f}"
            lines.append(f"F({reading.feature})=FEAT/SPHERE,OUTER,CART,{sphere}")
        normals = _normals(styli[reading.probe])
        lines.append(f"MEAS/SPHERE,F({reading.feature}),{len(normals)}")
        for normal in normals:
            place = _numbers(1e3 * (reading.centre + 0.5 * diameter * normal))
            lines.append(f"PTMEAS/CART,{place},{_numbers(normal, 6)}")
        lines.append("ENDMES")
    return "\n".join([*lines, "ENDFIL", ""])


def _numbers(values: Array, digits: int = 4) -> str:
    # Adding zero takes the sign from what is rounded to nothing.
    return ",".join(f"{value + 0.0:.{digits}f}" for value in np.round(values, digits))


def _normals(offset: Array) -> Array:
    """Outward normals (5, 3) of a ball's points: towards the head, and around that direction."""
    length = float(np.linalg.norm(offset))
    pole = -offset / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    aside = np.cross(pole, np.eye(3)[int(np.abs(pole).argmin())])
    aside /= np.linalg.norm(aside)
    angles = 2.0 * np.pi * np.arange(AROUND) / AROUND
    around = np.cos(angles)[:, None] * aside + np.sin(angles)[:, None] * np.cross(pole, aside)
    return np.concatenate([pole[None], np.cos(RAISED) * around + np.sin(RAISED) * pole])
