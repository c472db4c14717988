"""All calibrations that a file may state.

A further one of the kernel is a file here, with its settings, its reader and its observations, and
one line in `CALIBRATIONS`; extensions have their own.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args

from ballplate.simulator.design.observations.calibration import (
    FAR_FROM_DRAWING,
    Calibration,
    far_from_drawing,
)
from ballplate.simulator.design.observations.radius import RadiusCalibration
from ballplate.simulator.geometry.artefacts import BryanGaugeSettings
from ballplate.simulator.inputs.extensions import provided
from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.quantity_types import LengthUncertainty, PositiveLength
from ballplate.simulator.inputs.settings import Name, Settings
from ballplate.simulator.inputs.validation import OpenKinds
from pydantic import Field

from .calibrated_coordinates import CoordinatesSettings, read_coordinates
from .calibrated_distances import DistancesSettings, read_distances
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


def is_of_machine(kind: str) -> bool:
    """True if items of a kind are of no artefact."""
    settings = None if kind in KINDS else provided("calibrations", kind, "SETTINGS")
    return settings is not None and "artefact" not in settings.model_fields


def read_calibration(
    settings: Any, artefact: str, steps: Steps, references: References
) -> Calibration | None:
    """Return the item of an artefact that the entry describes, or report faults."""
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
