"""All calibrations that a file may state.

A further one of the kernel is a file here, with its settings, its reader and its observations, and
one line in `CALIBRATIONS`; extensions have their own.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, Union, get_args

from ballplate.simulator.inputs.extensions import provided
from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.settings import Settings
from ballplate.simulator.inputs.validation import OpenKinds

from ..lookup import References
from .calibration import Calibration
from .coordinates import CoordinatesSettings, read_coordinates
from .distances import DistancesSettings, read_distances
from .radius import RadiusSettings, read_radius

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
