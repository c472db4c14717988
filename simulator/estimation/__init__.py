"""Estimation from a design and its readings: blocks, elimination, Gauss-Newton, starting values."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs.faces import lazily

# Public names of this package: extensions import these alone, and its modules are private.
if TYPE_CHECKING:
    from .corrections import corrected_points, correction_rows
    from .covariance import EXACT, MICROMETRE
    from .elimination import ALIKE, ROWS_AT_ONCE
    from .functions import (
        BallPlaces,
        Coordinates,
        Displacements,
        Distances,
        Functions,
        MeasuredPoints,
        Parameters,
        Places,
        displacements,
        function_name,
        linear_functions,
        point_rows,
    )
    from .gauss_newton import (
        GaussNewtonSettings,
        Iteration,
        Solution,
        Status,
        as_drawn,
        estimate,
        iterate,
        linearised_fit,
        moved,
        newton_step,
    )
    from .graded import Collected, Triangle, triangle
    from .held import holding
    from .implied_values import implied_count
    from .initial import initial_state
    from .linearisation import LinearFunctions, Linearisation, linearise
    from .spheres import FLAT, fit_sphere

__getattr__, __dir__ = lazily(__name__, __file__)
