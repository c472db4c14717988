"""Where errors of a machine come from: a file that states them, or the map of a fit."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ballplate.presentation import Data, picked
from ballplate.results import few_degrees_of_freedom, verdict_data, verdict_line
from ballplate.simulator.design import Volume
from ballplate.simulator.inputs import Message, number_of
from ballplate.simulator.machines import Arrangement

from ..machine_files import FittedMap, left_out_words, load_machine, read_map
from .volumetric_errors import Volumetric

CONVENTION = (
    "errors are the tip's position less that of the scales: corrections, to be added to readings"
)
# Of a machine file, whose errors are exact but for their random parts.
STANDARD_DEVIATION = 1.0


@dataclass(frozen=True, eq=False)
class ErrorSource:
    """A machine whose errors are shown: `lines` of text about it with the same as `data`, cautions
    on all values, its volume, and the `coverage_factor` of expanded uncertainties.
    """

    label: str
    title: str
    lines: tuple[str, ...]
    data: Data
    cautions: tuple[str, ...]
    volume: Volume
    coverage_factor: float


def source_of_machine(file: Path) -> tuple[Volumetric, ErrorSource]:
    """Return the machine of a file as a source of errors, with their random parts as uncertainties.

    :raises ExperimentError: the file is wrong.
    """
    doubts: list[Message] = []
    built = Volumetric(load_machine(file, doubts))
    machine = built.machine
    name = f"{machine.arrangement_name}: " if machine.arrangement_name else ""
    lines = (
        f"{file.stem}: {machine.title}",
        name + _chain(machine.arrangement),
        CONVENTION,
        "U: one standard deviation (k = 1) of the random parts, those of each approach and lasting"
        " ones in quadrature",
    )
    data = {
        "label": file.stem,
        "title": machine.title,
        "arrangement": machine.arrangement_name or None,
        **picked(machine.arrangement, "probe_side", "workpiece_side"),
        "convention": CONVENTION,
        "coverage_factor": STANDARD_DEVIATION,
    }
    cautions = tuple(map(str, doubts))
    return built, ErrorSource(
        *(file.stem, machine.title, lines, data, cautions, built.volume, STANDARD_DEVIATION)
    )


def source_of_map(fitted: FittedMap, label: str, probe: int | None = None) -> ErrorSource:
    """Return a map as a source of errors, with the probe of an index."""
    lines = [f"{label}: {fitted.title}", CONVENTION]
    data: Data = {
        "label": label,
        "title": fitted.title,
        "convention": CONVENTION,
        "frame": fitted.frame or None,
        **picked(fitted, "coverage_factor", "sigma", "sigma_is_estimated", "degrees_of_freedom"),
        "lack_of_fit": verdict_data(fitted.lack_of_fit),
    }
    if probe is not None:
        name, offset = fitted.probes.names[probe], fitted.probes.offsets[probe]
        co_ordinates = ", ".join(f"{1e3 * value + 0.0:.6g}" for value in offset)
        lines.append(f"probe {name}, offset ({co_ordinates}) mm")
        data["probe"] = {"name": name, "offset": offset}
    if fitted.frame:
        lines.append(f"frame: {fitted.frame}")
    lines += [
        verdict_line(fitted.lack_of_fit),
        f"U: expanded uncertainty, k = {fitted.coverage_factor:g}",
    ]
    return ErrorSource(
        label,
        fitted.title,
        tuple(lines),
        data,
        _cautions(fitted),
        fitted.volume,
        fitted.coverage_factor,
    )


def map_of_source(source: Path | FittedMap) -> tuple[FittedMap, str]:
    """Return a map, read from its file if needed, with its label.

    :raises ExperimentError: the file is wrong.
    """
    return (read_map(source), source.stem) if isinstance(source, Path) else (source, "map")


def _chain(arrangement: Arrangement) -> str:
    sides = []
    for side, load in (
        (arrangement.probe_side, "the probe"),
        (arrangement.workpiece_side, "the workpiece"),
    ):
        if side:
            sides.append(" carries ".join([*side, load]))
    return ", ".join(sides)


def _cautions(fitted: FittedMap) -> tuple[str, ...]:
    """Cautions on all uncertainties of a map."""
    cautions = [fitted.lack_of_fit.caution]
    if fitted.sigma_is_estimated:
        remedy = "with few, take a larger coverage factor"
        cautions.append(few_degrees_of_freedom(fitted.degrees_of_freedom, "sigma", remedy))
    if fitted.left_out:
        cautions.append(left_out_words(fitted))
    count = fitted.undetermined.shape[1]
    if count:
        words = f"{number_of(count, 'direction')} of the parameters"
        cautions.append(f"the readings left {words} undetermined; what these change is not stated")
    return tuple(filter(None, cautions))
