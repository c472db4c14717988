"""Error budget of a machine file: what each error contributes at points and to lengths."""

from __future__ import annotations

import numpy as np
from ballplate.presentation import Data

from .map_places import MapPlaces
from .volumetric_errors import Volumetric

NOTE = (
    "budget: rms of resultants at the points, and largest error of the lengths, by each error"
    " alone; errors add with their signs, random parts (standard deviations) in squares"
)


def machine_budget(built: Volumetric, places: MapPlaces) -> Data:
    """Return columns of the budget, a row for each error alone and one for all, in metres: root
    mean squares at the points and the largest of the lengths, of errors and random parts.
    """
    meanings = built.errors_by_name
    figures = []
    for name in (*meanings, ""):
        alone = Volumetric(built.machine, name)
        points = alone.errors(places.points)
        lengths = alone.lengths(places.starts, places.ends)
        mean_squares = [
            (values**2).sum(axis=1).mean() for values in (points.errors, points.uncertainties)
        ]
        largest = abs(lengths.errors).max(), lengths.uncertainties.max()
        figures.append([*np.sqrt(mean_squares), *largest])
    heads = ("error alone, µm", "random, µm", "length error alone, µm", "random length error, µm")
    names = {"error": [*meanings, "all"], "": [*meanings.values(), ""]}
    return names | dict(zip(heads, np.array(figures).T, strict=True))
