"""Conversion of the settings of a calibration into ball indices, values and uncertainties."""

from __future__ import annotations

from ..design.lookup import References
from ..design.observations.calibration import Calibration
from ..design.observations.kinds import CALIBRATIONS
from ..design.observations.radius import RadiusSettings
from ..geometry.artefacts import BryanGaugeSettings
from ..inputs.messages import Steps
from ..inputs.settings import Settings


def resolve_calibration(
    settings: Settings, name: str | None, steps: Steps, references: References
) -> Calibration | None:
    """Return a calibration of the artefact named with its indices and values, or None after saying
    what is wrong.
    """
    artefact = references.artefact(name, steps)
    if artefact is None or artefact not in references.layouts:
        return None
    is_gauge = isinstance(references.artefacts[artefact], BryanGaugeSettings)
    if is_gauge and not isinstance(settings, RadiusSettings):
        text = f'"{artefact}" is a Bryan gauge and has a radius only; use kind: radius'
        references.problems.add((*steps, "kind"), text)
        return None
    read = next(read for kind, read in CALIBRATIONS.items() if isinstance(settings, kind))
    return read(settings, artefact, steps, references)
