"""Classes for a user's own error model, and for certified functions of balls; see the how-to pages
on error models and on certificates.

>>> Parameter("scale x", "1", "EXX", "scale of x", 0.5).unit
'1'
"""

from __future__ import annotations

from ballplate.simulator.inputs.number_arrays import Array

from .simulator.design.observations.balls import BallFunctions
from .simulator.machines.protocol import ErrorModel, Parameter, Reported, Unit

__all__ = ["Array", "BallFunctions", "ErrorModel", "Parameter", "Reported", "Unit"]
