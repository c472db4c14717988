"""The JSON Schema of sweep files."""

from __future__ import annotations

from typing import Any

from ballplate.simulator.experiment import DRAFT, tidied

from .sweep_settings import SweepSettings


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a sweep file."""
    properties: dict[str, Any] = tidied(SweepSettings.model_json_schema())
    return {"$schema": DRAFT, **properties, "title": "ballplate sweep"}
