"""Conversion of the settings of a calibration into ball indices, values and uncertainties."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
from ballplate.simulator.design.observations.balls import BallObservations
from ballplate.simulator.design.observations.calibration import Calibration
from ballplate.simulator.geometry.artefacts import BallLayout, BryanGaugeSettings
from ballplate.simulator.inputs.messages import Steps
from ballplate.simulator.inputs.settings import listing
from ballplate.simulator.machines.protocol import Array

from .calibrated_distances import DistancesSettings
from .calibration_kinds import RadiusSettings, read_calibration
from .references import References


def resolve_calibration(settings: Any, steps: Steps, references: References) -> Calibration | None:
    """Return a calibration of an artefact or the machine, or ``None`` after reporting its
    faults.
    """
    if "artefact" not in type(settings).model_fields:
        of_machine = read_calibration(settings, "", steps, references)
        layout = next(iter(references.layouts.values()), None)
        if of_machine is None or layout is None:
            return None
        text = _unnamed(of_machine.names(layout))
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


def _unnamed(pairs: list[tuple[str, str]]) -> str:
    """Return the fault in the names of an item's values, or an empty text."""
    names = [", ".join(pair) for pair in pairs]
    if not names:
        return "states no value; name at least one ball, or remove the item"
    repeated = [name for name, times in Counter(names).items() if times > 1]
    return f"states {listing(repeated)} more than once; keep only one" if repeated else ""


def _unsuitable(item: Calibration, layout: BallLayout) -> str:
    """Return the fault of values that nominal ball positions do not define, or an empty text."""
    if text := _unnamed(item.names(layout)):
        return text
    names = [", ".join(name) for name in item.names(layout)]
    observed, extent = item.observed(0), float(np.ptp(layout.coordinates, axis=0).max())
    assert isinstance(observed, BallObservations)
    values, slopes = _values_at(observed, layout.coordinates)
    # Each ball is moved otherwise, by what rounding may do.
    way = np.sin(np.arange(1.0, layout.coordinates.size + 1.0)).reshape(layout.coordinates.shape)
    beside = _values_at(observed, layout.coordinates + 1e-12 * extent * way)[1]
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
