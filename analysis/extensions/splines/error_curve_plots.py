"""Drawings of an error curve: points and spline, and errors as bars normal to a part's profile."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from ballplate.presentation import (
    INK,
    MUTED,
    PAPER,
    SERIES,
    common_legend,
    drawing,
    micro,
    placed_axes,
    round_number,
    save,
    scale_bar,
    sticks,
)
from ballplate.simulator.computing import comparable

from .curve_tables import derivative_unit, shown
from .error_curve import ErrorCurve, whole_profile
from .read_points import CurvePoints

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Points: of the drawings.
WIDTH, HEIGHT = 460.0, 300.0
# The longest bar, about, as a part of the profile's extent.
LONGEST = 0.18


def draw_curve(curve: ErrorCurve, path: str | Path | None = None) -> Figure:
    """Points, curve, its expanded uncertainty, knots and boundaries as a picture, which is written
    to the path if there is one.

    :raises OSError: the file cannot be written.
    """
    fitted, x, y = curve.fit, curve.points.x_column, curve.points.y_column
    lower, upper = fitted.space.lower, fitted.space.upper
    places = np.unique(
        np.concatenate([np.linspace(lower, upper, 501), fitted.x, fitted.space.breaks])
    )
    values, spread = (
        fitted.values(places),
        curve.coverage_factor * curve.standard_uncertainty(places),
    )
    with drawing(HEIGHT, WIDTH) as figure:
        axes = placed_axes(figure, 54.0, 42.0, WIDTH - 68.0, HEIGHT - 92.0)
        axes.grid(True)
        if np.isfinite(spread).all():
            axes.fill_between(
                places / x.factor,
                (values - spread) / y.factor,
                (values + spread) / y.factor,
                color=SERIES[0],
                alpha=0.2,
                linewidth=0,
                label="expanded uncertainty, 95 %",
            )
        axes.plot(places / x.factor, values / y.factor, color=SERIES[0], label="spline")
        bars = fitted.uncertainties * curve.sigma / y.factor if curve.has_uncertainties else None
        axes.errorbar(
            fitted.x / x.factor,
            fitted.y / y.factor,
            bars,
            color=INK,
            marker="o",
            markersize=4.0,
            linestyle="none",
            markerfacecolor=PAPER,
            elinewidth=1.0,
            label="measured",
        )
        knots = np.array(
            [knot for knot in fitted.space.knots if knot not in (*curve.boundaries, *curve.corners)]
        )
        if len(knots):
            axes.plot(
                knots / x.factor,
                fitted.values(knots) / y.factor,
                color=SERIES[1],
                marker="|",
                markersize=14.0,
                linestyle="none",
                label="knots",
            )
        for k, boundary in enumerate((*curve.boundaries, *curve.corners)):
            label = "boundary of features" if k == 0 else None
            axes.axvline(
                boundary / x.factor, color=SERIES[1], linestyle="--", linewidth=1.0, label=label
            )
        axes.set_xlabel(f"{x.words}, {micro(x.unit)}")
        axes.set_ylabel(f"{y.words}, {micro(y.unit)}")
        common_legend(figure, axes, loc="upper center", ncols=3, borderaxespad=0.3)
        return save(figure, path, words(curve))


def words(curve: ErrorCurve) -> str:
    """The plot for those who do not see it."""
    fitted, x, y = curve.fit, curve.points.x_column, curve.points.y_column
    places = np.linspace(fitted.space.lower, fitted.space.upper, 501)
    values = fitted.values(places)
    high, low = int(np.argmax(values)), int(np.argmin(values))
    slope = fitted.values(places[:1], 1)[0] / y.factor * x.factor
    return (
        f"{y.words} against {x.words}: {len(fitted.x)} points and a spline from"
        f" {shown(values[low], y, 3)} at {shown(places[low], x, 3)} to {shown(values[high], y, 3)}"
        f" at {shown(places[high], x, 3)}; slope at the start {slope:.2g}"
        f" {derivative_unit(curve, 1)}"
    )


def draw_whiskers(curve: ErrorCurve, points: CurvePoints, path: str | Path | None = None) -> Figure:
    """The errors of all points of the file as bars normal to the profile, those of the fit in
    front; the picture is written to the path, if there is one.

    :raises SplineError: neighbouring points that stand at the same place.
    :raises OSError: the file cannot be written.
    """
    profile, whole = whole_profile(points, curve.profile_boundaries, len(curve.settings.corners))
    assert points.places is not None
    # Axial co-ordinate to the right, radius upwards, as a turning centre is looked at.
    line, start = profile.places[:, ::-1], points.places[:, ::-1]
    normals = profile.normals[whole][:, ::-1]
    factor = points.x_column.factor if points.x is None else 1e-3
    unit = points.x_column.unit if points.x is None else "mm"
    extent = np.ptp(line, axis=0)
    largest = float(np.abs(points.y).max())
    magnification = round_number(LONGEST * float(extent.max()) / largest) if largest else 1.0
    tips = start + magnification * points.y[:, None] * normals
    everything = np.concatenate([line, tips])
    low, high = everything.min(axis=0), everything.max(axis=0)
    # A bar as long as a round error stands beside the profile as a scale.
    scale = round_number(0.7 * largest) if largest else 1e-6
    margin = 0.04 * float((high - low).max())
    size = high - low + 2 * margin
    width = WIDTH - 68.0
    height = float(np.clip(width * size[1] / size[0], 90.0, 900.0))
    with drawing(height + 90.0, WIDTH) as figure:
        axes = placed_axes(figure, 54.0, 42.0, width, height)
        axes.set_aspect("equal")
        axes.set_xlim((low[0] - margin) / factor, (high[0] + margin) / factor)
        axes.set_ylim((low[1] - margin) / factor, (high[1] + margin) / factor)
        axes.plot(
            *(_outline(profile.places, profile.features).T / factor),
            color=MUTED,
            linewidth=1.2,
            label="profile",
        )
        fitted = set(curve.points.names)
        inside = np.array([name in fitted for name in points.names])
        for chosen, colour, label in ((inside, SERIES[0], "fitted"), (~inside, INK, "not fitted")):
            if chosen.any():
                sticks(
                    axes,
                    start[chosen] / factor,
                    tips[chosen] / factor,
                    color=colour,
                    linewidth=1.2,
                    marker="o",
                    markersize=2.5,
                    label=label if not inside.all() else "error",
                )
        scale_bar(axes, scale * magnification / factor, 0.08, f"{scale * 1e6:g} µm")
        axes.set_xlabel(f"axial co-ordinate, {unit}")
        axes.set_ylabel(f"radius, {unit}")
        title = f"{points.y_column.words}, magnified {magnification:g} times"
        common_legend(figure, axes, loc="upper center", ncols=3, borderaxespad=0.3, title=title)
        worst = int(np.argmax(comparable(np.abs(points.y))))
        heading = f"{points.y_column.words} as bars normal to a profile of {len(points.y)} points"
        largest_told = f"the largest is {shown(points.y[worst], points.y_column, 4)}"
        return save(figure, path, f"{heading}, magnified {magnification:g} times; {largest_told}")


def _outline(places: np.ndarray, features: tuple[tuple[int, int], ...]) -> np.ndarray:
    """Axial co-ordinate and radius of the profile's line, with gaps between features that share no
    place.
    """
    parts = []
    for first, last in features:
        parts += [places[first : last + 1, ::-1], np.full((1, 2), np.nan)]
    return np.concatenate(parts)
