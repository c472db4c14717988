"""Names, units and indices of the parameters that all balls share: poses, machine errors, probe
offsets, and what observations add.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.geometry.motions import AXIS_NAMES, pose_parameter_names, pose_size
from ballplate.simulator.inputs.number_arrays import Array, Integers
from ballplate.simulator.machines.protocol import Parameter

from .arrays import Design


@dataclass(frozen=True)
class SharedLayout:
    """Columns of the shared parameters: the free ones of poses, machine errors, free probe
    offsets, unknown lengths, influence quantities.

    `pose_columns` (k, pose size) holds a column for each pose parameter, -1 if it is held or
    belongs to a length standard, and `offset_columns` (l, d) the same for probe offsets; `lengths`
    are the columns of unknown lengths and `influences` those of influence quantities. `scale`
    (columns,) is the size of each parameter, in its own unit, that moves a point by about one
    metre.
    """

    parameters: tuple[Parameter, ...]
    pose_columns: Integers
    model: slice
    scale: Array
    offset_columns: Integers
    lengths: slice
    influences: slice

    def __len__(self) -> int:
        return len(self.parameters)

    @property
    def poses(self) -> slice:
        return slice(0, self.model.start)

    @property
    def offsets(self) -> slice:
        return slice(self.model.stop, self.lengths.start)


def shared_layout(design: Design) -> SharedLayout:
    """Lay out the shared parameters of a design."""
    q, d = pose_size(design.dimension), design.dimension
    names = pose_parameter_names(d)
    columns = np.full((len(design.positions.names), q), -1, np.int64)
    parameters: list[Parameter] = []
    for k in design.posed_positions:
        own_places = design.balls.places[design.balls.artefact == design.positions.artefact[k]]
        # A turn moves the artefact's balls by up to its extent. A single ball has none, and a
        # millimetre keeps the scale of its turn finite.
        arm = max(float(np.ptp(own_places, axis=0).max(initial=0.0)), 1e-3)
        for j in np.flatnonzero(~design.positions.held[k]):
            columns[k, j] = len(parameters)
            turning = j >= d
            parameters.append(
                Parameter(
                    f"{design.positions.names[k]}: {names[j]}",
                    "rad" if turning else "m",
                    "pose",
                    f"{names[j]} of position {design.positions.names[k]}",
                    arm if turning else 1.0,
                )
            )
    start = len(parameters)
    parameters += design.model.parameters
    model = slice(start, len(parameters))
    offsets = np.full(design.probes.offsets.shape, -1, np.int64)
    for probe, axis in np.argwhere(design.probes.free):
        offsets[probe, axis] = len(parameters)
        name, letter = design.probes.names[probe], AXIS_NAMES[axis]
        meaning = f"offset {letter} of probe {name}"
        parameters.append(Parameter(f"probe {name}: offset {letter}", "m", "offset", meaning))
    lengths = slice(len(parameters), len(parameters) + len(design.unknown_lengths.names))
    parameters += [Parameter(name, "m", "length", name) for name in design.unknown_lengths.names]
    influences = slice(lengths.stop, lengths.stop + len(design.influence_parameters))
    parameters += [
        Parameter(parameter.name, parameter.unit, "influence", parameter.name, parameter.effect)
        for parameter in design.influence_parameters
    ]
    scale = np.array([1.0 / p.effect for p in parameters])
    return SharedLayout(tuple(parameters), columns, model, scale, offsets, lengths, influences)
