"""Head of a run sheet: fields to fill in by hand, and the styli."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version

import numpy as np
from ballplate.planning import RunSheet
from ballplate.simulator.experiment import Experiment, Position, Probe
from ballplate.simulator.machines import Array

# To be written in by hand: at the head of a sheet, and in each position.
BLANKS = ("machine", "operator", "date", "temperature, start", "temperature, end", "readings in")
NOTES = ("begun", "ended", "temperature", "remarks")


@dataclass(frozen=True, eq=False)
class Stylus:
    """A probe of a run sheet: its tip's offset (d,) in metres, and angles (rad) of that direction.

    `from_down` is the angle from straight down, -z; `around` that of its level part from +x towards
    +y; NaN without a direction. `angles` are A and B of an articulating head (rad), None for a
    stated offset.
    """

    name: str
    offset: Array
    from_down: float
    around: float
    angles: tuple[float, float] | None


def known_fields(experiment: Experiment) -> dict[str, str]:
    """Return the fields with known values."""
    machine, volume = experiment.machine, experiment.machine.volume
    size = " x ".join(f"{1e3 * length:.6g}" for length in volume.size)
    noise = sorted({f"{1e6 * deviation:.4g}" for deviation in machine.repeatability}, key=float)
    variant = f", {experiment.name}" if experiment.name else ""
    return {
        "file": f"{experiment.source.name}{variant}",
        "written by": f"ballplate {version('ballplate')}",
        "volume": f"{size} mm",
        "repeatability": f"{' to '.join(dict.fromkeys((noise[0], noise[-1])))} µm",
    }


def styli(sheet: RunSheet, experiment: Experiment) -> list[Stylus]:
    """The probes that a sheet uses, in the order of the experiment."""
    used = {
        probe
        for step in sheet.steps
        if isinstance(step.candidate.item, Position)
        for probe in step.probes
    }
    return [_stylus(probe) for name, probe in experiment.probes.items() if name in used]


def offsets(experiment: Experiment) -> Mapping[str, Array]:
    """The tips' offsets (d,) in metres by the names of probes."""
    return {name: probe.offset for name, probe in experiment.probes.items()}


def _stylus(probe: Probe) -> Stylus:
    offset = probe.offset
    length, level = float(np.linalg.norm(offset)), float(np.hypot(*offset[:2]))
    from_down, around = np.nan, np.nan
    if len(offset) == 3 and length > 0.0:
        from_down = float(np.arctan2(level, -offset[2]))
    if level > 1e-9 * length:
        around = float(np.arctan2(offset[1], offset[0])) % (2.0 * np.pi)
    return Stylus(probe.name, offset, from_down, around, probe.angles)


def degrees(angle: float) -> str:
    """Return an angle in degrees, or a dash."""
    return "–" if np.isnan(angle) else f"{np.degrees(angle):.4g}°"


def stylus_rows(sheet: RunSheet, experiment: Experiment) -> list[list[str]]:
    """A table of the styli with a line of headings; offsets in millimetres, and the angles of an
    articulating head if any probe has some.
    """
    table = styli(sheet, experiment)
    has_head = any(stylus.angles is not None for stylus in table)
    axes = [f"{axis}, mm" for axis in "xyz"[: experiment.dimension]]
    has_angles = experiment.dimension == 3
    heads = [*(["A", "B"] if has_head else []), *(["from -z", "from +x"] if has_angles else [])]
    rows = [["probe", *axes, *heads]]
    for stylus in table:
        lengths = [f"{1e3 * length:.6g}" for length in stylus.offset]
        angles = [degrees(angle) for angle in stylus.angles or (np.nan, np.nan)] if has_head else []
        angles += [degrees(stylus.from_down), degrees(stylus.around)] if has_angles else []
        rows.append([stylus.name, *lengths, *angles])
    return rows
