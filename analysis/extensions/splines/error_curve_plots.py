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
    placed_axes,
    round_number,
    save,
    scale_bar,
    sticks,
)
from ballplate.simulator.computing import comparable

from .error_curve import ErrorCurve
from .profile import Profile

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Points: of the drawings.
WIDTH, HEIGHT = 460.0, 300.0
# The longest bar, about, as a part of the profile's extent.
LONGEST = 0.18


def draw_curve(curve: ErrorCurve, title: str, path: str | Path | None = None) -> Figure:
    """Points, curve, its expanded uncertainty, knots and boundaries as a picture, which is written
    to the path if there is one.

    :raises OSError: the file cannot be written.
    """
    fitted, space = curve.fit, curve.fit.space
    places = np.unique(
        np.concatenate([np.linspace(space.lower, space.upper, 501), fitted.x, space.breaks])
    )
    values = 1e6 * fitted.values(places)
    spread = 1e6 * curve.coverage_factor * curve.standard_uncertainty(places)
    with drawing(HEIGHT, WIDTH) as figure:
        axes = placed_axes(figure, 54.0, 42.0, WIDTH - 68.0, HEIGHT - 92.0)
        axes.grid(True)
        if np.isfinite(spread).all():
            axes.fill_between(
                1e3 * places,
                values - spread,
                values + spread,
                color=SERIES[0],
                alpha=0.2,
                linewidth=0,
                label="expanded uncertainty, 95 %",
            )
        axes.plot(1e3 * places, values, color=SERIES[0], label="spline")
        axes.plot(
            1e3 * fitted.x,
            1e6 * fitted.y,
            color=INK,
            marker="o",
            markersize=4.0,
            linestyle="none",
            markerfacecolor=PAPER,
            label="measured",
        )
        if curve.knots:
            axes.plot(
                1e3 * np.array(curve.knots),
                1e6 * fitted.values(np.array(curve.knots)),
                color=SERIES[1],
                marker="|",
                markersize=14.0,
                linestyle="none",
                label="knots",
            )
        for k, boundary in enumerate((*curve.boundaries, *curve.corners)):
            label = "boundary of features" if k == 0 else None
            axes.axvline(
                1e3 * boundary, color=SERIES[1], linestyle="--", linewidth=1.0, label=label
            )
        axes.set_xlabel(f"{curve.points.x_name.replace('_', ' ')}, mm")
        axes.set_ylabel(f"{curve.points.y_name.replace('_', ' ')}, µm")
        common_legend(figure, axes, loc="upper center", ncols=3, borderaxespad=0.3)
        low, high = places[np.argmin(values)], places[np.argmax(values)]
        return save(
            figure,
            path,
            f"{title}: {len(fitted.x)} points and a spline from {values.min():.3g} µm at"
            f" {1e3 * low:.3g} mm to {values.max():.3g} µm at {1e3 * high:.3g} mm",
        )


def draw_whiskers(curve: ErrorCurve, profile: Profile, path: str | Path | None = None) -> Figure:
    """The errors of the points as bars normal to the profile; the picture is written to the path,
    if there is one.

    :raises OSError: the file cannot be written.
    """
    points, at = curve.points, np.searchsorted(profile.lengths, curve.fit.x)
    # Axial co-ordinate to the right, radius upwards, as a turning centre is looked at.
    line, normals = profile.places[:, ::-1], profile.normals[at, ::-1]
    start = line[at]
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
        axes.set_xlim(1e3 * (low[0] - margin), 1e3 * (high[0] + margin))
        axes.set_ylim(1e3 * (low[1] - margin), 1e3 * (high[1] + margin))
        axes.plot(
            *(1e3 * _outline(profile).T),
            color=MUTED,
            linewidth=1.2,
            label="profile",
        )
        sticks(
            axes,
            1e3 * start,
            1e3 * tips,
            color=SERIES[0],
            linewidth=1.2,
            marker="o",
            markersize=2.5,
            label="error",
        )
        scale_bar(axes, 1e3 * scale * magnification, 0.08, f"{scale * 1e6:g} µm")
        axes.set_xlabel("axial co-ordinate, mm")
        axes.set_ylabel("radius, mm")
        name = points.y_name.replace("_", " ")
        title = f"{name}, magnified {magnification:g} times"
        common_legend(figure, axes, loc="upper center", ncols=3, borderaxespad=0.3, title=title)
        worst = int(np.argmax(comparable(np.abs(points.y))))
        heading = f"{name} as bars normal to a profile of {len(points.y)} points"
        told = f"the largest is {1e6 * points.y[worst]:.4g} µm"
        return save(figure, path, f"{heading}, magnified {magnification:g} times; {told}")


def _outline(profile: Profile) -> np.ndarray:
    """Axial co-ordinate and radius of the profile's line, with gaps between features that share no
    place.
    """
    parts = []
    for first, last in profile.features:
        parts += [profile.places[first : last + 1, ::-1], np.full((1, 2), np.nan)]
    return np.concatenate(parts)
