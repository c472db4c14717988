"""Section on lengths throughout the volume: against the target, by point, length and direction."""

from __future__ import annotations

import numpy as np

from .charts import Chart, Trace, chart_svg, figure, figures, legend
from .elements import Html, element, joined, note, table
from .level_maps import MISSED, MapPoint, even_bounds, level_legend, level_map
from .quoted import QuotedData


def lengths_section(lengths: QuotedData, target: str) -> Html:
    """Section with maps of the share of lengths from each point that miss the `target`, by level,
    or of their largest uncertainty without one, and uncertainties by length.
    """
    data = lengths.data
    k = data["target_coverage_factor"] if target else data["coverage_factor"]
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
    whole = lengths.at("all")
    is_open = whole.data["undetermined"] == whole.data["lengths"]
    head = [
        whole.number("lengths"),
        " lengths between the points of a grid, with the probe ",
        lengths.text("probe"),
    ]
    if whole.data["undetermined"]:
        head += [", ", whole.number("undetermined"), " of them undetermined"]
    if target and not is_open:
        head += [
            ": the standard uncertainty u is within the target ",
            target,
            " for ",
            whole.share("share_within"),
        ]
        head += [
            ", the expanded uncertainty U for ",
            whole.share("share_expanded_within"),
            f" (k = {data['coverage_factor']:g})",
        ]
    if is_open:
        return element("p", *head, ".")
    return joined(
        [
            element("p", *head, "."),
            figures(*maps),
            level_legend(bounds, lambda bound: f"{bound:.3g} {'%' if target else 'µm'}"),
            note("Some lengths from points with – are undetermined.")
            if whole.data["undetermined"]
            else "",
            _by_length(lengths, target),
            _by_direction(lengths, bool(target)),
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


def _by_length(lengths: QuotedData, target: str) -> Html:
    """Uncertainties over the length, with the target."""
    data = lengths.data
    k = data["target_coverage_factor"] if target else data["coverage_factor"]
    groups = [group for group in data["by_length"] if group["lengths"]]
    middle = np.array([500.0 * (group["from"] + group["to"]) for group in groups])
    most, average = (
        1e6 * k * np.array([group[name] for group in groups], float)
        for name in ("maximum", "average")
    )
    u = "u" if k == 1.0 else f"{k:g} u"
    traces = [Trace("line", "s0", middle, most), Trace("dots", "s0", middle, most)]
    traces += [Trace("line", "s2", middle, average), Trace("dots", "s2", middle, average)]
    left_out = "; undetermined ones are left out" if data["all"]["undetermined"] else ""
    entries = [("line", "s0", f"largest {u}"), ("line", "s2", f"average {u}")]
    if target:
        ends = np.array([0.0, 1e3 * groups[-1]["to"]])
        limit = 1e6 * data["target"]["constant"] + 1e3 * data["target"]["slope"] * ends
        traces.append(Trace("line", "alert dashed", ends, limit))
        entries.append(("line", "alert dashed", "target"))
    chart = Chart(traces, "length, mm", "µm", f"{u} over the length", from_zero=True)
    return joined(
        [
            legend(*entries),
            figures(figure(f"{u} of lengths over the length{left_out}.", chart_svg(chart))),
        ]
    )


def _by_direction(lengths: QuotedData, of_target: bool) -> Html:
    k = lengths.data["coverage_factor"]
    rows = []
    for direction in lengths.at("by_direction").each():
        if not direction.data["lengths"]:
            continue
        row: list[str] = [
            direction.text("direction"),
            direction.number("lengths"),
            direction.number("undetermined"),
        ]
        row += [
            direction.micro("average"),
            direction.micro("maximum"),
            direction.micro("maximum", factor=k),
        ]
        if of_target:
            row += [direction.share("share_within"), direction.share("share_expanded_within")]
        rows.append(row)
    heads = ["direction", "lengths", "undetermined", "u average, µm", "u maximum"]
    heads += [f"U maximum, k = {k:g}"]
    heads += ["u within target", f"U within target, k = {k:g}"] if of_target else []
    return table("directions", "Lengths by direction", heads, rows)
