"""Effect of further observations on null directions, without a factorisation of the changed
design.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from ballplate.simulator.computing import svd
from ballplate.simulator.design import (
    Design,
    DistanceCalibration,
    at_least_exact,
    nominal_state,
    reading_blocks,
)
from ballplate.simulator.experiment import Position, lay_out, placed_only
from ballplate.simulator.machines import Array

from .changes import Change
from .judging import Examined
from .moves import new_tips

# Rows on null directions, in standard deviations per micrometre, that count for more than rounding.
SEEN = 1e-6


def seen_by(base: Examined, changes: Sequence[Change]) -> dict[Change, Array]:
    """Return the null directions that added observations see: a triangle (deficiency, deficiency)
    per change.

    The pose of an added position is eliminated. Only changes that add readings or distances of
    plates already read are included. A set of changes removes as many directions as the rank of
    its triangles together.
    """
    effects: dict[Change, Array] = {}
    if not base.at.deficiency:
        return effects
    experiment = base.experiment
    plates = {
        place.artefact
        for place in experiment.positions
        if experiment.artefacts[place.artefact].role == "plate"
    }
    added: dict[Change, Position] = {}
    for change in changes:
        item = change.adds
        if item is None or item.artefact not in plates:
            continue
        if isinstance(item, DistanceCalibration):
            effects[change] = _by_distances(base, item)
        elif isinstance(item, Position):
            added[change] = replace(item, name=f"candidate {len(added)}")
    return effects | _by_readings(base, added)


def _by_distances(base: Examined, item: DistanceCalibration) -> Array:
    design = base.at.design
    pairs = np.flatnonzero(design.balls.artefact == design.artefacts.names.index(item.artefact))[
        item.pairs
    ]
    along = design.balls.places[pairs[:, 0]] - design.balls.places[pairs[:, 1]]
    along[:, item.dimensions :] = 0.0
    along /= (
        np.linalg.norm(along, axis=1)[:, None]
        * at_least_exact(item.standard_uncertainties)[:, None]
    )
    moved = base.at.ball_null[pairs]
    return _triangle(np.einsum("md,mdk->mk", along, moved[:, 0] - moved[:, 1]))


def _by_readings(base: Examined, added: dict[Change, Position]) -> dict[Change, Array]:
    if not added:
        return {}
    experiment, null, layout = base.experiment, base.at.shared_null, base.at.layout
    of_new = len(experiment.positions)
    together = replace(
        experiment,
        positions=(*experiment.positions, *added.values()),
        probes={**experiment.probes, **new_tips(experiment)},
    )
    # As a pool: they are never solved for together.
    extended = lay_out(placed_only(together), is_pool=True)
    state = nominal_state(extended)
    order = np.argsort(extended.readings.position, kind="stable")
    first = np.searchsorted(extended.readings.position[order], np.arange(of_new + len(added) + 1))
    names = [place.name for place in experiment.positions]
    # What is held does not move.
    with_held = np.concatenate([null, np.zeros((1, null.shape[1]))])
    effects = {}
    for k, change in enumerate(added, start=of_new):
        readings = extended.readings.select(order[first[k] : first[k + 1]])
        blocks = reading_blocks(extended, state, readings, None)
        rows = (
            blocks.by_model @ null[layout.model] + blocks.by_ball @ base.at.ball_null[readings.ball]
        )
        if blocks.by_offset is not None:
            rows = rows + blocks.by_offset @ with_held[layout.offset_columns[readings.probe]]
        if blocks.by_influence is not None:
            rows = rows + blocks.by_influence @ _of_influences(base, extended, null)
        if change.of is None:
            rows = _without(rows, blocks.by_pose)
        else:
            rows = rows + blocks.by_pose @ with_held[layout.pose_columns[names.index(change.of)]]
        effects[change] = _triangle(rows.reshape(-1, rows.shape[2]))
    return effects


def _of_influences(base: Examined, extended: Design, null: Array) -> Array:
    """Return the effect of null directions (s, k) on influence quantities (p, k) of a design with
    more positions; only those of the latter remain.
    """
    rows = null[base.at.layout.influences]
    names = [parameter.name for parameter in base.at.design.influence_parameters]
    effects = np.zeros((len(extended.influence_parameters), null.shape[1]))
    for k, parameter in enumerate(extended.influence_parameters):
        if parameter.name in names:
            effects[k] = rows[names.index(parameter.name)]
    return effects


def _without(rows: Array, by_pose: Array) -> Array:
    """Return rows (m, d, k) after elimination of their own pose, with derivatives (m, d, pose
    size).
    """
    u, sizes, _ = svd(by_pose.reshape(-1, by_pose.shape[2]), full_matrices=False)
    u = u[:, sizes > 1e-10 * sizes[0]]
    flat = rows.reshape(len(u), -1)
    return (flat - u @ (u.T @ flat)).reshape(rows.shape)


def _triangle(rows: Array) -> Array:
    """A square factor with the same product R' R."""
    k = rows.shape[1]
    triangle = np.linalg.qr(np.concatenate([rows, np.zeros((k, k))]), mode="r")
    return np.asarray(triangle)


def rank_of(triangles: Sequence[Array]) -> int:
    """Return the number of directions that the triangles remove together."""
    if not triangles:
        return 0
    return int((svd(np.concatenate(list(triangles)), compute_uv=False) > SEEN).sum())
