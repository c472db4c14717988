"""Section on lengths throughout the volume: against the target, by point, length and direction."""

from __future__ import annotations

import numpy as np
from ballplate.presentation import number

from .charts import Chart, Trace, chart_svg, figure, figures, legend
from .elements import Html, element, joined, note, table
from .quoted import QuotedData

SHADES = 8
# Of a map: width of a cell, its height, and the room around.
CELL, ROW, LEFT, BELOW, ABOVE = 46.0, 26.0, 46.0, 32.0, 18.0


def lengths_section(lengths: QuotedData, target: str) -> Html:
    """Section with maps of the largest uncertainty of lengths from each point, by level, and by
    length; relative to the `target`, if there is one.
    """
    data = lengths.data
    k = data["target_coverage_factor"] if target else data["coverage_factor"]
    points = np.array([point["point"] for point in data["by_point"]])
    levels = np.unique(points[:, 2]) if points.shape[1] == 3 else np.zeros(1)
    u = "u" if k == 1.0 else f"{k:g} u"
    title = f"Largest ratio of {u} to the target" if target else f"Largest {k:g} u, µm,"
    maps = []
    for level in levels.tolist():
        chosen = (
            np.flatnonzero(points[:, 2] == level)
            if points.shape[1] == 3
            else np.arange(len(points))
        )
        level_words = f", z = {1e3 * level:.6g} mm" if points.shape[1] == 3 else ""
        words = f"{title} of the lengths from each point{level_words}"
        maps.append(figure(f"{words}.", _map(lengths, chosen.tolist(), k, bool(target), words)))
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
    meaning = "Darker is larger."
    if target:
        meaning = "Up to 1 (blue) the target is met, above 1 (orange) it is missed; in either"
        meaning += " colour darker is larger."
    legends = note(f"{meaning} Some lengths from points with – are undetermined.")
    return joined(
        [
            element("p", *head, "."),
            figures(*maps),
            legends,
            _by_length(lengths, target),
            _by_direction(lengths, bool(target)),
        ]
    )


def _map(lengths: QuotedData, chosen: list[int], k: float, of_target: bool, words: str) -> Html:
    """Return the map of a level, with a value per point."""
    name, factor = ("maximum_ratio", k) if of_target else ("maximum", 1e6 * k)
    every = [point[name] for point in lengths.data["by_point"]]
    finite = [factor * point for point in every if point is not None]
    low, high = (min(finite), max(finite)) if finite else (0.0, 1.0)
    places = np.array([lengths.data["by_point"][i]["point"][:2] for i in chosen])
    x, y = np.unique(places[:, 0]), np.unique(places[:, 1])
    parts = []
    for i, place in zip(chosen, places, strict=True):
        column, row = np.searchsorted(x, place[0]), len(y) - 1 - np.searchsorted(y, place[1])
        left_edge, top = LEFT + CELL * column, ABOVE + ROW * row
        # What is known of some of its lengths would hide that others are unknown.
        value = None if lengths.data["by_point"][i]["undetermined"] else every[i]
        kind = "open"
        if value is not None:
            kind = _shade(factor * value, low, high, 1.0 if of_target else np.inf)
        parts.append(
            Html(
                f'<rect class="{kind}" x="{left_edge:g}" y="{top:g}" width="{CELL:g}"'
                f' height="{ROW:g}"/>'
            )
        )
        shown = "–" if value is None else number(factor * value, 3)
        parts.append(
            element(
                "text",
                shown,
                class_="place" if value is not None else None,
                x=f"{left_edge + CELL / 2:g}",
                y=f"{top + ROW / 2 + 3.5:g}",
                text_anchor="middle",
                data_path=None if value is None else lengths.at("by_point", i, name).path,
                data_value=None if value is None else repr(value),
                data_factor=None if value is None else repr(factor),
            )
        )
    bottom = ABOVE + ROW * len(y)
    for j, value in enumerate(x.tolist()):
        parts.append(_label(LEFT + CELL * (j + 0.5), bottom + 12, f"{1e3 * value:.5g}", "middle"))
    for j, value in enumerate(y.tolist()):
        parts.append(_label(LEFT - 5, bottom - ROW * (j + 0.5) + 3.5, f"{1e3 * value:.5g}", "end"))
    parts.append(_label(LEFT + CELL * len(x) / 2, bottom + 26, "x, mm", "middle"))
    parts.append(_label(LEFT - 5, ABOVE - 6, "y, mm", "end"))
    return element(
        "svg",
        joined(parts),
        class_="map",
        viewBox=f"0 0 {LEFT + CELL * len(x) + 6:g} {bottom + BELOW:g}",
        role="img",
        aria_label=words,
    )


def _shade(value: float, low: float, high: float, limit: float) -> str:
    """A step of colour among values from `low` to `high`; above a limit, one of another colour.

    >>> [_shade(value, 0.2, 3.0, 1.0) for value in (0.2, 1.0, 1.1, 3.0)]
    ['heat-0', 'heat-7', 'over-0', 'over-7']
    """
    is_over = value > limit
    first, last = (max(low, limit), high) if is_over else (low, min(high, limit))
    # Equal values but for rounding have no order to show.
    share = (value - first) / (last - first) if last - first > 1e-9 * last else 0.0
    name = "over" if is_over else "heat"
    return f"{name}-{min(int(SHADES * (share + 1e-9)), SHADES - 1)}"


def _label(x: float, y: float, text: str, anchor: str) -> Html:
    return element("text", text, x=f"{x:g}", y=f"{y:g}", text_anchor=anchor)


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
