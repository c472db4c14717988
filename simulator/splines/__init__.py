"""Least-squares splines with prescribed values and slopes: spaces, constraints, fits, pieces for a
controller.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs.faces import lazily

# Public names of this package: extensions import these alone, and its modules are private.
if TYPE_CHECKING:
    from .constraints import Constraint, straight
    from .knots import at_every, with_boundaries
    from .polynomial_pieces import pieces
    from .space import Side, SplineSpace
    from .spline_fit import SplineFit, fit
    from .spline_problems import SplineError, SplineProblem

__getattr__, __dir__ = lazily(__name__, __file__)
