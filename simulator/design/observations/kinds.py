"""All kinds of calibration that a file may state.

A further kind is a file beside these, with its settings, what reads them and its observations, and
one line in `CALIBRATIONS`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, Union

from pydantic import Field

from ...inputs.messages import Steps
from ...inputs.settings import Settings
from ..lookup import References
from .calibration import Calibration
from .coordinates import CoordinatesSettings, read_coordinates
from .distances import DistancesSettings, read_distances
from .python_values import PythonValuesSettings, read_python_values
from .radius import RadiusSettings, read_radius

CALIBRATIONS: dict[type[Settings], Callable[[Any, str, Steps, References], Calibration | None]] = {
    DistancesSettings: read_distances,
    CoordinatesSettings: read_coordinates,
    RadiusSettings: read_radius,
    PythonValuesSettings: read_python_values,
}
"""Settings class of every kind of calibration, with what reads it for an artefact: the item, or
None after saying what is wrong.
"""

if TYPE_CHECKING:
    CalibrationSettings = Settings
else:
    CalibrationSettings = Annotated[Union[tuple(CALIBRATIONS)], Field(discriminator="kind")]  # noqa: UP007
