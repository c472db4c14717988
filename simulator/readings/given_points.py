"""Points and the probes that measure them, as a user gives them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from ballplate.simulator.design.objects import Volume
from ballplate.simulator.inputs.arguments import ensure_type
from ballplate.simulator.inputs.settings import hint, shorten
from ballplate.simulator.machines.protocol import Array, Integers

AXES = ("x", "y", "z")


def ensure_points(points: object, volume: Volume) -> Array:
    """Return a user's points as an array (n, d) in metres.

    :raises ValueError: another shape, or far outside the volume.

    >>> ensure_points([[1.0, 2.0, 3.0]], Volume(np.zeros(2), np.ones(2)))
    Traceback (most recent call last):
    ValueError: points of shape (1, 3); expected (n, 2)
    """
    d = len(volume.lower)
    try:
        array = np.asarray(points, float)
    except (TypeError, ValueError):
        expected = f"numbers in metres, {d} for each point"
        raise ValueError(f"points={shorten(repr(points))}; give {expected}") from None
    if array.ndim != 2 or array.shape[1] != d:
        raise ValueError(f"points of shape {array.shape}; expected (n, {d})")
    if not np.isfinite(array).all():
        raise ValueError("points have co-ordinates that are no finite numbers; leave these out")
    for i, axis in np.argwhere(volume.far_outside(array)).tolist():
        fact = f"{AXES[axis]} = {array[i, axis]:.6g} m of points[{i}] is far outside the volume"
        raise ValueError(f"{fact}; give points in metres")
    return array


def probe_places(probe: object, probes: tuple[str, ...], count: int) -> Integers:
    """Return the indices (count,) of probes from one name, or one for each point.

    :raises TypeError: no name, and no names.
    :raises ValueError: an unknown name, or another number of names.
    """
    ensure_type(Iterable, "the name of a probe, or one for each point", probe=probe)
    names = [probe] if isinstance(probe, str) else list(probe)  # type: ignore[call-overload]
    for name in names:
        if name not in probes:
            raise ValueError(f'no probe "{name}"; {hint(name, probes)}')
    if len(names) not in (1, count):
        raise ValueError(f"{len(names)} probes for {count} points")
    return np.broadcast_to(np.array([probes.index(name) for name in names], np.int64), count)
