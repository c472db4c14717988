"""Dimensions of a part by fits to the centres of tips that touch it."""

from __future__ import annotations

import numpy as np
from ballplate.simulator.inputs import Array

from .fitting import GeometricElement, fit, fit_zone, offset
from .part_values import LaidPart
from .values import combine, members


def evaluated(laid: LaidPart, centres: Array, with_form: bool = False) -> Array:
    """Return the deviations (v, b) from nominal of all dimensions, NaN of open ones, from centres
    of tips (b, n, 3) in the frame of the part; lengths in metres.

    Elements are fitted to the centres, and then moved by the radius of the tip. `with_form` adds
    the deviations that forms are expected to have.
    """
    part, fits = laid.part, dict[tuple[str, str, str], tuple[GeometricElement, Array]]()
    values = []
    for one in laid.dimensions:
        dimension = one.dimension
        if dimension.name in part.undetermined:
            values.append(np.full(len(centres), np.nan))
            continue
        used = {}
        for name in dimension.used:
            is_judged = name in dimension.features
            bent = with_form and is_judged and dimension.form > 0.0
            zone = dimension.zone and is_judged
            key = one.place.name, name, f"{zone}{dimension.name if bent else ''}"
            if key not in fits:
                rows, feature = laid.points.rows[one.place.name, name], part.features[name]
                there = centres[:, rows]
                if bent:
                    there = there + (dimension.form * one.bow)[:, None] * feature.normals
                radius = float(laid.points.radii[rows.start])
                start = offset(feature.nominal, radius)
                element, residuals = (fit_zone if zone else fit)(start, there)
                fits[key] = offset(element, -radius), residuals
            used[name] = fits[key]
        values.append(combine(dimension, members(part, dimension, used)))
    return np.stack(values)
