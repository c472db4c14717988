"""Calibrated co-ordinates in a file: their keys, and how they are read."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np
from ballplate.simulator.design.observations.calibration import MOST_TIED_BALLS
from ballplate.simulator.design.observations.coordinates import CoordinateCalibration, far_spread
from ballplate.simulator.geometry.ball_layouts import BallLayout, BallNames, frozen
from ballplate.simulator.geometry.motions import AXIS_NAMES
from ballplate.simulator.geometry.poses import Axis
from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.quantity_types import LengthUncertainty
from ballplate.simulator.inputs.settings import Forms, Name, Text, hint, listing
from numpy.typing import NDArray
from pydantic import Field

from .references import References
from .stated_values import (
    CommonPartSettings,
    check_keys,
    is_digital,
    joint_key,
    read_digital,
    uncertainties_of,
)

CalibratedBalls = Forms[Literal["all", "corners"], BallNames, BallNames]


class CoordinatesSettings(CommonPartSettings):
    """Calibrated co-ordinates of balls in their artefact's frame."""

    kind: Literal["coordinates"] = Field(description="calibrated co-ordinates of balls")
    artefact: Name | None = Field(
        None, description="name of the artefact; optional if there is exactly one"
    )
    balls: CalibratedBalls = Field("all", description="all (default), corners, or a list of balls")
    standard_uncertainty: (
        Forms[LengthUncertainty, LengthUncertainty, dict[Axis, LengthUncertainty]] | None
    ) = Field(
        None,
        description=(
            "of every co-ordinate, or per calibrated axis of the artefact: {x: …, y: …}; 0 um if"
            " they are exact; left out if values or covariance state it"
        ),
    )
    axes: tuple[Axis, ...] | None = Field(
        None,
        min_length=1,
        description=(
            "calibrated axes if values or covariance state the uncertainties; default: all"
        ),
    )
    values: Text | None = Field(
        None,
        description=(
            "CSV file with columns ball, x_mm, y_mm, z_mm, and standard_uncertainty_um (of all"
            " axes, or x_standard_uncertainty_um, …), or expanded_uncertainty_um and k; or a DCC"
            " (XML); default: nominal co-ordinates"
        ),
    )


def read_coordinates(
    settings: CoordinatesSettings, artefact: str, steps: Steps, references: References
) -> CoordinateCalibration | None:
    layout, dimension = references.layouts[artefact], references.dimension
    axes = _axes(settings, steps, references)
    balls = references.balls(settings.balls, layout, (*steps, "balls"))
    is_right = check_keys(settings, steps, references)
    if balls is None or axes is None or not is_right or dimension is None:
        return None
    coordinates = _certified_coordinates(settings, balls, axes, layout, steps, references)
    if coordinates is None:
        return None
    values, in_file, covariance = coordinates
    uncertainty = settings.standard_uncertainty
    of_axes = None
    if isinstance(uncertainty, float):
        of_axes = np.full(len(axes), uncertainty)
    elif uncertainty is not None:
        of_axes = np.array([uncertainty[axis] for axis in sorted(uncertainty)])
    names = [(layout.names[ball], axis) for ball in balls for axis in axes]
    of_item = None if of_axes is None else np.tile(of_axes, len(balls))
    uncertainties = uncertainties_of(
        settings,
        names,
        False,
        of_item,
        in_file.ravel(),
        covariance,
        values.ravel(),
        steps,
        references,
    )
    if uncertainties is None:
        return None
    standard, root = uncertainties
    of_balls = len(np.unique(balls))
    text = (
        f"co-ordinates tie {of_balls} balls together, at most {MOST_TIED_BALLS} are possible; leave"
        f" {joint_key(settings)} out"
    )
    if root is not None and not references.require(
        of_balls <= MOST_TIED_BALLS, (*steps, joint_key(settings)), text
    ):
        return None
    is_common = of_axes is not None and root is None
    return CoordinateCalibration(
        artefact,
        balls,
        tuple(AXIS_NAMES.index(axis) for axis in axes),
        frozen(values),
        settings.values is not None,
        frozen(of_axes if is_common else standard.reshape(values.shape)),
        root=root,
    )


def _axes(settings: CoordinatesSettings, steps: Steps, references: References) -> list[str] | None:
    """Return the calibrated axes, or report faults."""
    dimension, uncertainty = references.dimension, settings.standard_uncertainty
    place = (*steps, "standard_uncertainty")
    if uncertainty is None or isinstance(uncertainty, float):
        axes: list[str] = list(settings.axes or get_args(Axis)[:dimension])
        place = (*steps, "axes")
        is_once = references.require(
            len(set(axes)) == len(axes), place, "names an axis twice; name each once"
        )
        text = "has no meaning in two dimensions; remove it"
        in_plane = references.require(dimension != 2 or "z" not in axes, place, text)
        return sorted(axes) if is_once and in_plane else None
    axes = sorted(uncertainty)
    if settings.axes is not None:
        text = (
            "belong to the uncertainties of a file; standard_uncertainty names the axes; remove it"
        )
        references.problems.add((*steps, "axes"), text, of_key=True)
        return None
    is_right = references.require(
        bool(axes), place, "calibrates no axis; give at least one, such as {x: 0.2 um}"
    )
    text = "has no meaning in two dimensions; remove it"
    is_right &= references.require(dimension != 2 or "z" not in axes, (*place, "z"), text)
    return axes if is_right else None


def _certified_coordinates(
    settings: CoordinatesSettings,
    balls: NDArray[np.intp],
    axes: Sequence[str],
    layout: BallLayout,
    steps: Steps,
    references: References,
) -> tuple[Array, Array, tuple[Array, Array] | None] | None:
    """Values (k, a), their standard uncertainties in the file, NaN without any, and covariance."""
    problems = references.problems
    drawn = layout.coordinates[balls][:, [AXIS_NAMES.index(axis) for axis in axes]]
    if settings.values is None:
        return drawn, np.full(drawn.shape, np.nan), None
    covariance = None
    if is_digital(settings.values):
        wanted = [(layout.names[ball], axis) for ball in balls for axis in axes]
        digital = read_digital(settings, wanted, False, steps, references)
        if digital is None:
            return None
        covariance = digital.covariance
        coordinates = np.array([entry.value for entry in digital.entries]).reshape(drawn.shape)
        uncertainty = np.array([entry.uncertainty for entry in digital.entries]).reshape(
            drawn.shape
        )
    else:
        of_table = _table_of_coordinates(settings, balls, axes, layout, steps, references)
        if of_table is None:
            return None
        coordinates, uncertainty = of_table
    if text := far_spread(coordinates, drawn):
        problems.add((*steps, "values"), text)
        return None
    return coordinates, uncertainty, covariance


def _table_of_coordinates(
    settings: CoordinatesSettings,
    balls: NDArray[np.intp],
    axes: Sequence[str],
    layout: BallLayout,
    steps: Steps,
    references: References,
) -> tuple[Array, Array] | None:
    from .certificate_tables import read_rows

    problems, steps = references.problems, (*steps, "values")
    forbidden = [axis for axis in AXIS_NAMES if axis not in axes]
    rows_read = read_rows(settings, ["ball"], axes, forbidden, steps, references)
    if rows_read is None:
        return None
    before, names_known = len(problems.messages), set(layout.names)
    by_ball = {}
    for row, uncertainty in zip(*rows_read, strict=True):
        name = row.texts[0]
        if name not in names_known:
            problems.add_at(row.mark, steps, f'unknown ball "{name}"; {hint(name, layout.names)}')
        if name in by_ball:
            problems.add_at(
                row.mark, steps, f'ball "{name}" is listed twice; remove one of the two lines'
            )
        by_ball[name] = np.array(row.lengths[: len(axes)]), uncertainty
    missing = [layout.names[i] for i in balls if layout.names[i] not in by_ball]
    if missing and len(problems.messages) == before:
        problems.add(
            steps, f"no co-ordinates for {listing(missing)}; add them, or leave them out of balls"
        )
    if len(problems.messages) > before:
        return None
    chosen = [by_ball[layout.names[i]] for i in balls]
    return np.array([name for name, _ in chosen]), np.array([u for _, u in chosen])
