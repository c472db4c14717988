"""Conversion of a fitted map to another error model, with its covariance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from ballplate.simulator.computing import pinv, single_threaded
from ballplate.simulator.design import rotation_sensitivity
from ballplate.simulator.machines import USUAL_OFFSET, Array, ErrorModel
from ballplate.simulator.maps import FittedMap, determined_only

# Random places for each parameter of the richer model, and the least number of them.
PLACES_EACH, LEAST_PLACES = 2, 200

# Part of a motion that the target model can do by itself, to rounding, and singular values below
# which its parameters have no effect.
OWN_MOTION, NOTHING = 1e-9, 1e-12


@dataclass(frozen=True, eq=False)
class MapConversion:
    """The nearest map in another error model by least squares.

    The fit uses `places` (n, d), scale readings with probe offsets (n, d). Between the frames of
    the two models lies a rigid `motion` (d shifts and turns), which changes no length. `tips` (k,
    d) are the offsets of the map's probes and one along each axis.
    """

    old: FittedMap
    converted: FittedMap
    places: Array
    offsets: Array
    motion: Array
    tips: Array

    def differences(self, x: Array, p: Array) -> Array:
        """Return corrections (n, d) of the new map less those of the old one at scale readings (n,
        d) with probe offsets (n, d), in metres, after the motion.
        """
        old, new = self.old, self.converted
        arm = x + p - (self.places + self.offsets).mean(axis=0)
        shift, turn = np.split(self.motion, [old.dimension])
        moved = shift + rotation_sensitivity(arm) @ turn
        return new.model.error(x, new.values, p) - old.model.error(x, old.values, p) + moved


@single_threaded
def converted(
    fitted: FittedMap, model: ErrorModel, settings: Mapping[str, Any], frame: str
) -> MapConversion:
    """Return the map in an error `model` of the same volume, with `settings` as in a file.

    The fit compares corrections at random locations throughout the volume and at its corners, with
    the probes of the map and with tips along each axis. To first order new parameters are linear in
    the old ones; the covariance and the undetermined directions follow. The residuals of the new
    model are excluded.
    """
    x, p, tips = _places(fitted, model)
    zero, d = np.zeros(len(model.parameters)), fitted.dimension
    own_columns = model.jacobian(x, zero, p).reshape(x.size, -1)
    wanted = (fitted.model.error(x, fitted.values, p) - p).ravel()
    by_old = fitted.model.jacobian(x, fitted.values, p).reshape(x.size, -1)
    size = np.array([1.0 / parameter.effect for parameter in model.parameters])
    inverse = pinv(own_columns * size, rcond=NOTHING)
    arm = x + p - (x + p).mean(axis=0)
    shifts = np.broadcast_to(np.eye(d), (len(x), d, d))
    motions = np.concatenate([shifts, rotation_sensitivity(arm)], axis=2).reshape(x.size, -1)

    def residual(columns: Array) -> Array:
        return columns - own_columns @ (size[:, None] * (inverse @ columns))

    # What the model can move by itself is no motion between frames.
    beyond = residual(motions)
    used = np.linalg.norm(beyond, axis=0) > OWN_MOTION * np.linalg.norm(motions, axis=0)
    moving = pinv(beyond[:, used], rcond=OWN_MOTION)
    sides = np.column_stack([wanted, by_old])
    moved = moving @ residual(sides)
    by_both = size[:, None] * (inverse @ (sides - motions[:, used] @ moved))
    values, matrix = by_both[:, 0], by_both[:, 1:]
    motion = np.zeros(motions.shape[1])
    motion[used] = moved[:, 0]
    offsets = len(fitted.scale) - len(fitted.values)
    whole = np.zeros((len(values) + offsets, len(fitted.scale)))
    whole[: len(values), : len(fitted.values)] = matrix
    whole[len(values) :, len(fitted.values) :] = np.eye(offsets)
    scale = np.concatenate([size, fitted.scale[len(fitted.values) :]])
    root = whole @ fitted.root
    new = replace(
        fitted,
        model=model,
        settings=settings,
        values=values,
        covariance=root @ root.T,
        undetermined=determined_only(whole @ fitted.undetermined, scale),
        frame=frame,
    )
    return MapConversion(fitted, new, x, p, motion, tips)


def _places(fitted: FittedMap, model: ErrorModel) -> tuple[Array, Array, Array]:
    """Return scale readings (n, d) and probe offsets (n, d) of the fit, and the distinct offsets
    (k, d).
    """
    volume, d = fitted.volume, fitted.dimension
    generator = np.random.default_rng(np.random.SeedSequence(1))
    richer = max(len(model.parameters), len(fitted.values))
    count = max(PLACES_EACH * richer, LEAST_PLACES)
    corners = np.array(list(product((0.0, 1.0), repeat=d)))
    fractions = np.concatenate([corners, generator.random((count, d))])
    x = volume.lower + volume.size * fractions
    arms = USUAL_OFFSET * float(volume.size.max()) * np.eye(d)
    tips = np.concatenate([fitted.probes.offsets, arms])
    tip_indices = np.arange(len(x)) % len(tips)
    x, tip_indices = (
        np.concatenate([x, np.repeat(x[: len(corners)], len(tips), axis=0)]),
        np.append(tip_indices, np.tile(np.arange(len(tips)), len(corners))),
    )
    return x, tips[tip_indices], np.unique(tips, axis=0)
