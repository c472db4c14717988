"""Experiment files: loading them, what they may say, and the messages about what is wrong with
them.
"""

from ..inputs.messages import ExperimentError, Message
from ..observations.coordinates import CoordinateCalibration
from ..observations.distances import DistanceCalibration
from .load import load
from .model import Evaluation, Experiment, Machine, Position, ReadingGroup, Volume
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
