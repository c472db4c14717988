"""What a file says of the room that the machine is in."""

from __future__ import annotations

from typing import Annotated

from ballplate.simulator.inputs import Settings
from pydantic import Field


class ClimateSettings(Settings):
    """The room that the machine is in; `experiment.sections["climate"]`."""

    room: str = Field(description="name of the room")
    air_changes: Annotated[float, Field(gt=0)] = Field(8.0, description="per hour; default 8")


SETTINGS = ClimateSettings
