"""Derivatives of corrected points by the shared parameters: the rows behind U4, U6 and measuring
tasks.
"""

from __future__ import annotations

import numpy as np
from ballplate.simulator.design.arrays import Design, State
from ballplate.simulator.design.observations.readings import offset_sensitivity
from ballplate.simulator.design.parameters import SharedLayout
from ballplate.simulator.machines.protocol import Array, Integers


def corrected_points(design: Design, state: State, points: Array, probes: Integers) -> Array:
    """Corrected points x + e(x, a, p) (m, d) for scale readings `points` (m, d) with probes of
    indices (m,), metres.
    """
    return points + design.model.error(points, state.a, state.probes[probes])


def correction_rows(
    design: Design, layout: SharedLayout, state: State, points: Array, probes: Integers
) -> Array:
    """Derivative (m, d, s) of the corrected points by the shared parameters, estimated probe
    offsets included.

    `points` (m, d) are scale readings with probes of indices `probes` (m,).
    """
    offsets = state.probes[probes]
    jacobian = design.model.jacobian(points, state.a, offsets)
    rows = np.zeros((*jacobian.shape[:2], len(layout)))
    rows[:, :, layout.model] = jacobian
    if not design.probes.free.any():
        return rows
    by_offset = offset_sensitivity(design.model, points, state.a, offsets)
    for probe in np.unique(probes):
        estimated = layout.offset_columns[probe] >= 0
        members = np.flatnonzero(probes == probe)
        columns = layout.offset_columns[probe][estimated]
        rows[members[:, None, None], np.arange(rows.shape[1])[:, None], columns] = by_offset[
            members
        ][:, :, estimated]
    return rows
