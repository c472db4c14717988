"""All kinds of influence quantities that a file may state.

A further kind is a file beside these, with its settings and what these come to in a design, and one
line in `INFLUENCES`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Union

from pydantic import Field

from .drift import DriftSettings
from .position_scale import PositionScaleSettings
from .probing import ProbingSettings
from .protocol import InfluenceSettings
from .reindexing import ReindexingSettings
from .reproducibility import ReproducibilitySettings
from .sag import SagSettings
from .temperature import TemperaturesSettings

INFLUENCES: tuple[type[InfluenceSettings], ...] = (
    # In the order of the documentation.
    TemperaturesSettings,
    ProbingSettings,
    PositionScaleSettings,
    ReproducibilitySettings,
    ReindexingSettings,
    DriftSettings,
    SagSettings,
)
"""Settings class of every kind of influence quantity."""

if TYPE_CHECKING:
    AnyInfluence = InfluenceSettings
elif len(INFLUENCES) == 1:
    AnyInfluence = INFLUENCES[0]
else:
    AnyInfluence = Annotated[Union[INFLUENCES], Field(discriminator="kind")]  # noqa: UP007
