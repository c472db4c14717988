"""Classes for a user's own error model; see the how-to page on error models.

>>> Parameter("scale x", "1", "EXX", "scale of x", 0.5).unit
'1'
"""

from __future__ import annotations

from .simulator.machines.protocol import Array, ErrorModel, Parameter, Reported, Unit

__all__ = ["Array", "ErrorModel", "Parameter", "Reported", "Unit"]
