"""Influence quantities that a file may state; extensions have them all."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from ballplate.simulator.inputs.open_kinds import OpenKinds

from .protocol import InfluenceSettings

if TYPE_CHECKING:
    AnyInfluence = InfluenceSettings
else:
    AnyInfluence = Annotated[InfluenceSettings, OpenKinds("influences", InfluenceSettings)]
