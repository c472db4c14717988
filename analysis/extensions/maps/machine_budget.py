"""Error budget of a machine file: what each error contributes at points and to lengths.

Errors of points, and of lengths to first order, are sums over the parametric errors; random parts
are independent, and add in squares (Park, Burdekin and Peggs, section 5.2).
"""

from __future__ import annotations

import numpy as np
from ballplate.presentation import Data

from .map_places import MapPlaces
from .volumetric_errors import Volumetric

PROBING = "probing"
NOTE = (
    "budget: rms of resultants at the points, and largest error of the lengths, by each error"
    " alone; errors add with their signs, random parts (standard deviations) in squares"
)


def machine_budget(built: Volumetric, places: MapPlaces) -> Data:
    """Return columns of the budget, a row for each error and one for all together, in metres: root
    mean squares at the points and the largest of the lengths, errors alone and random parts.
    """
    model, a = built.truth.model, built.truth.a
    approach, lasting = built.approach[0].parameters, built.lasting[0].parameters
    meanings = {one.function: one.meaning for one in (*model.parameters, *approach, *lasting)}
    random = [one.function for one in approach] + [PROBING] * 3 + [one.function for one in lasting]
    meanings |= {PROBING: "probing, in each co-ordinate"} if built.machine.probing else {}
    stated = np.array([one.function for one in model.parameters])
    masks = [*(stated == name for name in meanings), np.full(len(a), True)]
    members = [*([one == name for one in random] for name in meanings), [True] * len(random)]
    nominal = places.ends - places.starts
    along = nominal / np.linalg.norm(nominal, axis=1)[:, None]

    alone, lengths = [], []
    for mask in masks:
        at, start, end = (
            built.systematic(points, np.where(mask, a, 0.0))
            for points in (places.points, places.starts, places.ends)
        )
        alone.append(np.sqrt((at**2).sum() / len(at)))
        lengths.append(abs(((end - start) * along).sum(axis=1)).max())
    roots = np.concatenate(built.random_roots(places.points), axis=2)
    (first, steady), (last, moved) = map(built.random_roots, (places.starts, places.ends))
    first, last, changed = (
        np.einsum("pd,pdk->pk", along, part) ** 2 for part in (first, last, moved - steady)
    )
    of_points = (roots**2).sum(axis=(0, 1)) / len(roots)
    of_lengths = np.concatenate([first + last, changed], axis=1)
    chosen = np.array(members, float).T
    return {
        "error": [*meanings, "all"],
        "": [*meanings.values(), ""],
        "error alone, µm": np.array(alone),
        "random, µm": np.sqrt(of_points @ chosen),
        "length error alone, µm": np.array(lengths),
        "random length error, µm": np.sqrt((of_lengths @ chosen).max(axis=0)),
    }
