"""Section on lengths throughout the volume: against the target, by their ends."""

from __future__ import annotations

import numpy as np

from .charts import figure, figures
from .elements import Html, element, joined, note
from .level_maps import MISSED, MapPoint, even_bounds, level_legend, level_map
from .quoted import QuotedData


def lengths_section(lengths: QuotedData, target: str) -> Html:
    """Section with maps of the share of lengths from each point that miss the `target`, by level,
    or of their largest uncertainty without one.
    """
    data = lengths.data
    k = data["coverage_factor"]
    points = np.array([point["point"] for point in data["by_point"]])
    levels = np.unique(points[:, 2]) if points.shape[1] == 3 else np.zeros(1)
    u = "u" if k == 1.0 else f"{k:g} u"
    title = f"Share, %, with {u} above the target," if target else f"Largest {u}, µm,"
    bounds, maps = _bounds(lengths, k, bool(target)), []
    for level in levels.tolist():
        chosen = (
            np.flatnonzero(points[:, 2] == level)
            if points.shape[1] == 3
            else np.arange(len(points))
        )
        level_words = f", z = {1e3 * level:.6g} mm" if points.shape[1] == 3 else ""
        words = f"{title} of the lengths from each point{level_words}"
        points_of_level = _points(lengths, chosen.tolist(), k, bool(target))
        drawn = level_map(points_of_level, bounds, words, 2 if target else 3)
        maps.append(figure(f"{words}.", drawn))
    head = [
        lengths.number("lengths"),
        " lengths between the points of a grid, with the probe ",
        lengths.text("probe"),
    ]
    if data["undetermined"]:
        head += [", ", lengths.number("undetermined"), " of them undetermined"]
    if data["undetermined"] == data["lengths"]:
        return element("p", *head, ".")
    return joined(
        [
            element("p", *head, "."),
            figures(*maps),
            level_legend(bounds, lambda bound: f"{bound:.3g} {'%' if target else 'µm'}"),
            note("Some lengths from points with – are undetermined.")
            if data["undetermined"]
            else "",
        ]
    )


def _bounds(lengths: QuotedData, k: float, of_target: bool) -> tuple[float, ...]:
    """Return the bounds of the maps' bands, the same at all levels."""
    if of_target:
        return tuple(100.0 * share for share in MISSED)
    values = [point["maximum"] for point in lengths.data["by_point"] if point["maximum"]]
    return even_bounds(1e6 * k * min(values), 1e6 * k * max(values)) if values else (0.0,)


def _points(lengths: QuotedData, chosen: list[int], k: float, of_target: bool) -> list[MapPoint]:
    """Return the points of a level with their values."""
    name, factor = ("share_missed", 100.0) if of_target else ("maximum", 1e6 * k)
    points = []
    for i in chosen:
        point = lengths.data["by_point"][i]
        x, y = point["point"][:2]
        # What is known of some of its lengths would hide that others are unknown.
        if point["undetermined"] or point[name] is None:
            points.append(MapPoint(x, y, None))
            continue
        attributes = {
            "data_path": lengths.at("by_point", i, name).path,
            "data_value": repr(point[name]),
            "data_factor": repr(factor),
        }
        points.append(MapPoint(x, y, factor * point[name], attributes))
    return points
