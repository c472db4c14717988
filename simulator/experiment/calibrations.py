"""All calibrations that a file may state: their kinds, and what is wrong with their values.

A further one of the kernel has its settings and its reader in a file beside this one (the radius of
a gauge, which is short, has them here), its `Calibration` and `Observations` in
`design.observations`, and a line in `CALIBRATIONS`; extensions have their own. Settings with
`artefact` make observations of its balls, `BallObservations`; those without state values of the
machine, which cannot be correlated.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args

import numpy as np
from ballplate.simulator.design.observations.balls import BallObservations
from ballplate.simulator.design.observations.calibration import (
    FAR_FROM_DRAWING,
    Calibration,
    far_from_drawing,
)
from ballplate.simulator.design.observations.distances import RadiusCalibration
from ballplate.simulator.geometry.artefacts import BallLayout, BryanGaugeSettings
from ballplate.simulator.inputs.extensions import provided
from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.number_arrays import Array
from ballplate.simulator.inputs.quantity_types import LengthUncertainty, PositiveLength
from ballplate.simulator.inputs.settings import Name, Settings, listing
from ballplate.simulator.inputs.validation import OpenKinds
from pydantic import Field

from ._calibrated_distances import DistancesSettings, read_distances
from .calibrated_coordinates import CoordinatesSettings, read_coordinates
from .references import References


class RadiusSettings(Settings):
    """The calibrated radius of a Bryan gauge."""

    kind: Literal["radius"] = Field(description="calibrated radius of a Bryan gauge")
    artefact: Name | None = Field(
        None, description="name of the gauge; optional if there is exactly one artefact"
    )
    value: PositiveLength | None = Field(
        None, description="calibrated radius; default: nominal radius"
    )
    standard_uncertainty: LengthUncertainty = Field(
        description="of the radius, the same in all positions of the gauge; 0 um if it is exact"
    )


def read_radius(
    settings: RadiusSettings, artefact: str, steps: Steps, references: References
) -> RadiusCalibration | None:
    gauge = references.artefacts[artefact]
    if not isinstance(gauge, BryanGaugeSettings):
        text = f'only a Bryan gauge has a radius, and "{artefact}" is not one; use kind: distances'
        references.problems.add((*steps, "kind"), text)
        return None
    value = gauge.radius if settings.value is None else settings.value
    text = f"{far_from_drawing(value, gauge.radius)}; correct one of the two"
    if not references.require(
        abs(value - gauge.radius) <= FAR_FROM_DRAWING * gauge.radius, (*steps, "value"), text
    ):
        return None
    return RadiusCalibration(artefact, value, settings.standard_uncertainty)


CALIBRATIONS: dict[type[Settings], Callable[[Any, str, Steps, References], Calibration | None]] = {
    DistancesSettings: read_distances,
    CoordinatesSettings: read_coordinates,
    RadiusSettings: read_radius,
}
"""Settings class of every kind of calibration, with what reads it for an artefact: the item, or
None after saying what is wrong.
"""

KINDS = tuple(
    kind for one in CALIBRATIONS for kind in get_args(one.model_fields["kind"].annotation)
)

if TYPE_CHECKING:
    CalibrationSettings = Settings
else:
    CalibrationSettings = Annotated[
        Union[tuple(CALIBRATIONS)],  # noqa: UP007
        OpenKinds("calibrations"),
    ]


def read_calibration(
    settings: Any, artefact: str, steps: Steps, references: References
) -> Calibration | None:
    """Return the item of an artefact that the entry describes, or report faults."""
    # Settings of a pool's calibrations, which have a price, are of subclasses.
    reader = next(
        (
            reader
            for settings_class, reader in CALIBRATIONS.items()
            if isinstance(settings, settings_class)
        ),
        None,
    )
    reader = reader or provided("calibrations", settings.kind, "read")
    assert reader is not None
    return reader(settings, artefact, steps, references)


def resolve_calibration(settings: Any, steps: Steps, references: References) -> Calibration | None:
    """Return a calibration of an artefact or the machine, or ``None`` after reporting its
    faults.
    """
    if "artefact" not in type(settings).model_fields:
        of_machine = read_calibration(settings, "", steps, references)
        layout = next(iter(references.layouts.values()), None)
        if of_machine is None or layout is None:
            return None
        text = _fault_of_names(of_machine.names(layout))
        return of_machine if references.require(not text, steps, text) else None
    artefact = references.artefact(settings.artefact, steps)
    if artefact is None or artefact not in references.layouts:
        return None
    is_gauge = isinstance(references.artefacts[artefact], BryanGaugeSettings)
    if is_gauge and not isinstance(settings, RadiusSettings):
        text = f'"{artefact}" is a Bryan gauge and has a radius only; use kind: radius'
        references.problems.add((*steps, "kind"), text)
        return None
    is_standard = references.artefacts[artefact].role == "length_standard"
    if is_standard and not isinstance(settings, DistancesSettings | RadiusSettings):
        text = (
            "a length standard carries distances only; use kind: distances, or remove its role:"
            " length_standard"
        )
        references.problems.add((*steps, "kind"), text)
        return None
    # What a kind makes of balls that do not suit it is told below.
    with np.errstate(all="ignore"):
        calibration = read_calibration(settings, artefact, steps, references)
        text = (
            ""
            if calibration is None or is_gauge
            else _unsuitable(calibration, references.layouts[artefact])
        )
    return calibration if references.require(not text, steps, text) else None


def _fault_of_names(pairs: list[tuple[str, str]]) -> str:
    """Return the fault in the names of an item's values, or an empty text."""
    names = [", ".join(pair) for pair in pairs]
    if not names:
        return "states no value; name at least one ball, or remove the item"
    repeated = [name for name, times in Counter(names).items() if times > 1]
    return f"states {listing(repeated)} more than once; keep only one" if repeated else ""


def _unsuitable(item: Calibration, layout: BallLayout) -> str:
    """Return the fault of values that nominal ball positions do not define, or an empty text."""
    if text := _fault_of_names(item.names(layout)):
        return text
    names = [", ".join(name) for name in item.names(layout)]
    observed, extent = item.observed(0), float(np.ptp(layout.coordinates, axis=0).max())
    assert isinstance(observed, BallObservations)
    values, slopes = _values_at(observed, layout.coordinates)
    # Each ball is moved otherwise, by what rounding may do.
    way = np.sin(np.arange(1.0, layout.coordinates.size + 1.0)).reshape(layout.coordinates.shape)
    beside = _values_at(observed, layout.coordinates + 1e-12 * extent * way)[1]
    # A slope that changes by half of itself with displacements of the size of rounding is that of a
    # function without a derivative there.
    size, change = (np.abs(slope).max(axis=(1, 2)) for slope in (slopes, beside - slopes))
    # A change that is no number is no small one.
    is_smooth = np.isfinite(values) & (change <= 0.5 * size)
    if not is_smooth.all():
        names_listed = listing(np.array(names)[~is_smooth].tolist())
        return (
            f"{names_listed} cannot be determined at the nominal locations of the balls, for"
            " example because balls are in one line or coincide; choose other balls"
        )
    # A ball that is named twice moves with both.
    is_same = observed.balls[:, :, None] == observed.balls[:, None, :]
    moved = np.abs(np.einsum("mij,mjd->mid", is_same, slopes)).max(axis=(1, 2))
    is_fixed = ~(moved > 1e-9 * size)
    if is_fixed.any():
        names_listed = listing(np.array(names)[is_fixed].tolist())
        return (
            f"{names_listed} is the same wherever balls are; name each ball once, or choose others"
        )
    return ""


def _values_at(observations: BallObservations, balls: Array) -> tuple[Array, Array]:
    """Return values (m,) and slopes (m, k, d) at `balls`, NaN if the computation fails."""
    try:
        return observations.values(balls)
    except np.linalg.LinAlgError:
        shape = (*observations.balls.shape, balls.shape[1])
        return np.full(len(observations), np.nan), np.full(shape, np.nan)
