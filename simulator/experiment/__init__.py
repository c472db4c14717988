"""Experiment files: their keys, loading, and messages about errors in them."""

from ..inputs.messages import ExperimentError, Message
from .load import load
from .model import (
    CoordinateCalibration,
    DistanceCalibration,
    Evaluation,
    Experiment,
    Machine,
    Position,
    ReadingGroup,
    Volume,
)
from .schema import schema

__all__ = [
    "CoordinateCalibration",
    "DistanceCalibration",
    "Evaluation",
    "Experiment",
    "ExperimentError",
    "Machine",
    "Message",
    "Position",
    "ReadingGroup",
    "Volume",
    "load",
    "schema",
]
