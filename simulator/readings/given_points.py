"""Points, and the probes that measure them, as a user gives them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..design.objects import Volume
from ..inputs.arguments import ensure_type
from ..inputs.settings import hint, shorten
from ..machines.protocol import Array, Integers

AXES = ("x", "y", "z")


def ensure_points(points: object, volume: Volume) -> Array:
    """Points (n, d) in metres that a user gives as arrays.

    :raises ValueError: they are of another shape, or far outside the volume.

    >>> ensure_points([[1.0, 2.0, 3.0]], Volume(np.zeros(2), np.ones(2)))
    Traceback (most recent call last):
    ValueError: points of shape (1, 3); expected (n, 2)
    """
    d = len(volume.lower)
    try:
        given = np.asarray(points, float)
    except (TypeError, ValueError):
        words = f"numbers in metres, {d} for each point"
        raise ValueError(f"points={shorten(repr(points))}; give {words}") from None
    if given.ndim != 2 or given.shape[1] != d:
        raise ValueError(f"points of shape {given.shape}; expected (n, {d})")
    if not np.isfinite(given).all():
        raise ValueError("points have co-ordinates that are no finite numbers; leave these out")
    for i, axis in np.argwhere(volume.far_outside(given)).tolist():
        told = f"{AXES[axis]} = {given[i, axis]:.6g} m of points[{i}] is far outside the volume"
        raise ValueError(f"{told}; give points in metres")
    return given


def probe_places(probe: object, known: tuple[str, ...], count: int) -> Integers:
    """Indices (count,) of probes by the name of one, or of one for each point.

    :raises TypeError: no name, and no names.
    :raises ValueError: an unknown name, or another number of them.
    """
    ensure_type(Iterable, "the name of a probe, or one for each point", probe=probe)
    asked = [probe] if isinstance(probe, str) else list(probe)  # type: ignore[call-overload]
    for name in asked:
        if name not in known:
            raise ValueError(f'no probe "{name}"; {hint(name, known)}')
    if len(asked) not in (1, count):
        raise ValueError(f"{len(asked)} probes for {count} points")
    return np.broadcast_to(np.array([known.index(name) for name in asked], np.int64), count)
