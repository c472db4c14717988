"""A reversal and the full estimate beside it, as text for people and as plain data for programs."""

from __future__ import annotations

from typing import Any

import numpy as np
from ballplate.simulator.geometry.axes import axes_words

from ..presentation.formatting import SHOWN, aligned, as_data, number, picked, to_uncertainty
from ..results.parts import MOST_BALLS
from .reversal_fits import ReversalFit


def reversal_lines(fit: ReversalFit) -> list[str]:
    """A reversal as lines of text: parameters and co-ordinates, those of multiple redundancy beside
    them.
    """
    found, full = fit.found, fit.full
    turn = number(float(np.degrees(fit.turn)), 8)
    count = "five parameters" if fit.offsets else "three parameters, no offsets"
    scale = "none (fitted, but not applied)" if fit.scale == "none" else fit.scale
    lines = [
        f"{fit.label}: {fit.title}",
        f"reversal, {count}, scale difference: {scale}",
        (
            f'{len(fit.names)} balls; "{fit.second}" is turned by {turn} degrees, clockwise, from'
            f' "{fit.first}"'
        ),
        (
            f"sigma = {number(1e6 * found.sigma)} um with {found.degrees_of_freedom} degrees of"
            " freedom, of the difference of two readings; of a single one"
            f" {number(1e6 * found.single)} um"
        ),
        (
            "what the first-order equations neglect changes no result by more than"
            f" {number(found.bias, 2)} standard uncertainties"
        ),
        (
            f"multiple redundancy: {full.solution.status}; sigma = {number(full.sigma)} times the"
            " stated uncertainties"
            f" ({'estimated from the residuals' if full.sigma_is_estimated else 'as given'})"
        ),
        "",
    ]
    redundant = {e.name: e for e in fit.redundant}
    rows = [["parameter", "reversal", "multiple redundancy", "its standard uncertainty", "unit"]]
    for one in fit.estimates:
        other = redundant.get(one.name)
        u = np.nan if other is None else 1e6 * other.standard_uncertainty
        digits = 1e6 * found.sigma if np.isnan(u) else u
        beside = (
            ["-", "-"] if other is None else [to_uncertainty(1e6 * other.value, u), number(u, 3)]
        )
        rows.append([one.name, to_uncertainty(1e6 * one.value, digits), *beside, SHOWN[one.unit]])
    lines += aligned(rows, [False, True, True, True, False])
    return [*lines, "", *_ball_lines(fit)]


def _ball_lines(fit: ReversalFit) -> list[str]:
    rows = [
        [
            "ball",
            "x, mm",
            "y, mm",
            "multiple redundancy: x, mm",
            "y, mm",
            "standard uncertainty of x, um",
            "of y, um",
        ]
    ]
    plate = fit.full.plates[0] if fit.full.plates else None
    nothing = np.full_like(fit.coordinates, np.nan)
    others, us = (plate.coordinates, plate.standard_uncertainties) if plate else (nothing, nothing)
    for name, here, there, u in zip(fit.names, fit.coordinates, others, us, strict=True):
        cells = [
            to_uncertainty(1e3 * value, 1e3 * size)
            for values in (here, there)
            for value, size in zip(values, u, strict=True)
        ]
        rows.append([name, *cells, *(number(1e6 * size, 3) for size in u)])
    lines = [
        f"co-ordinates of the balls in the plate's own axes ({axes_words(fit.axes, fit.names)})"
    ]
    lines += aligned(rows[: MOST_BALLS + 1], [False] + [True] * 6)
    return lines + (
        [f"({len(rows) - 1 - MOST_BALLS} balls more in --json)"]
        if len(rows) - 1 > MOST_BALLS
        else []
    )


def reversal_data(fit: ReversalFit) -> dict[str, Any]:
    """A reversal as plain data in metres and radians; `multiple_redundancy` has the full fit."""
    found = fit.found
    return {
        "experiment": fit.label,
        "estimator": "reversal",
        **picked(fit, "title", "scale", "offsets"),
        "positions": picked(fit, "first", "second"),
        "sigma": found.sigma if found.degrees_of_freedom > 0 else None,
        "degrees_of_freedom": found.degrees_of_freedom,
        "neglected_standard_uncertainties": found.bias,
        "neglected_coordinates": fit.distortion,
        "neglected_offset": float(np.abs(found.offset - found.exact_offset).max()),
        "estimates": {e.name: picked(e, "value", "unit") for e in fit.estimates},
        "axes": {
            "origin": fit.names[fit.axes.origin],
            "xy"[fit.axes.axis]: fit.names[fit.axes.ball],
        },
        "balls": _by_ball(fit.names, fit.coordinates),
        "residuals": _by_ball(fit.names, found.residuals),
        "multiple_redundancy": {
            "relation": {
                e.name: as_data(picked(e, "value", "standard_uncertainty", "unit"))
                for e in fit.redundant
            },
            **fit.full.to_dict(),
        },
    }


def _by_ball(names: tuple[str, ...], values: Any) -> dict[str, dict[str, Any]]:
    return {
        name: {axis: {"value": value, "unit": "m"} for axis, value in zip("xy", row, strict=True)}
        for name, row in zip(names, values.tolist(), strict=True)
    }
