"""Dimensions by fits to the points of drawn machines: the check of linear uncertainties."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.estimation import Linearisation
from ballplate.simulator.inputs import Array
from ballplate.simulator.machines import ErrorModel
from ballplate.uncertainty import FRACTIONS, NamedUncertainty

from ..machine_files import FittedMap
from ..maps.realisations import drawn_machines
from .evaluated import evaluated
from .part_result import PartUncertainty

# Machines whose points are fitted at once.
AT_ONCE = 250

# An error model, its parameters (n,) and offsets (l, 3), and those of drawn machines (b, n) and
# (b, l, 3).
Machines = tuple[ErrorModel, Array, Array, Array, Array]


def machines_of_map(fitted: FittedMap, draws: int, seed: int) -> Machines:
    """Return machines that a map leaves possible; undetermined directions keep their estimates."""
    drawn = drawn_machines(fitted, draws, seed)
    return (fitted.model, fitted.values, fitted.probes.offsets, *drawn)


def machines_of_design(at: Linearisation, draws: int, seed: int) -> Machines:
    """Return machines that a campaign leaves possible of a machine without errors."""
    generator = np.random.default_rng(np.random.SeedSequence(seed))
    moved = generator.standard_normal((draws, at.shared.shape[1])) @ at.shared.T
    columns = at.layout.offset_columns
    offsets = np.tile(at.state.probes, (draws, 1, 1))
    offsets[:, columns >= 0] += moved[:, columns[columns >= 0]]
    return at.design.model, at.state.a, at.state.probes, moved[:, at.layout.model], offsets


@single_threaded
def with_draws(found: PartUncertainty, machines: Machines, seed: int) -> PartUncertainty:
    """Return uncertainties with those by fits to the points of drawn machines, which are drawn
    together with all sources beside the map.
    """
    model, a, offsets, drawn_a, drawn_offsets = machines
    laid, errors = found.laid, []
    points = laid.points
    x, probes = points.readings, points.probes
    before = model.error(x, a, offsets[probes])
    start = evaluated(laid, points.centres[None], True)
    generator = np.random.default_rng(np.random.SeedSequence((seed, 1)))
    for first in range(0, len(drawn_a), AT_ONCE):
        some = range(first, min(first + AT_ONCE, len(drawn_a)))
        moved = np.stack([model.error(x, drawn_a[k], drawn_offsets[k][probes]) for k in some])
        beside = generator.standard_normal((laid.outside.shape[1], len(some)))
        moved += (laid.outside @ beside).T[:, :, None] * points.normals - before
        centres = points.centres + np.einsum("bni,nij->bnj", moved, points.rotations)
        errors.append(evaluated(laid, centres, True) - start)
    every = np.concatenate(errors, axis=1)
    dimensions = tuple(
        one if one.value is None else replace(one, drawn=_drawn(one.value, every[one.row]))
        for one in found.dimensions
    )
    return replace(found, dimensions=dimensions)


def _drawn(value: NamedUncertainty, errors: Array) -> NamedUncertainty:
    return replace(
        value,
        standard_uncertainty=float(errors.std()),
        shift=float(errors.mean()),
        quantiles=(tuple(np.quantile(errors, FRACTIONS).tolist()),),
    )
