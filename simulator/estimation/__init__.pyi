# Public names of this package, each loaded from its module when it is first used.
from .covariance import MICROMETRE as MICROMETRE, RANK_TOLERANCE as RANK_TOLERANCE
from .elimination import ALIKE as ALIKE, ROWS_AT_ONCE as ROWS_AT_ONCE
from .functions import (
    BallPlaces as BallPlaces,
    Combinations as Combinations,
    Coordinates as Coordinates,
    Displacements as Displacements,
    Distances as Distances,
    Functions as Functions,
    MeasuredPoints as MeasuredPoints,
    Parameters as Parameters,
    Places as Places,
    corrected_points as corrected_points,
    correction_rows as correction_rows,
    displacements as displacements,
    linear_functions as linear_functions,
    point_rows as point_rows,
)
from .gauss_newton import (
    GaussNewtonSettings as GaussNewtonSettings,
    Iteration as Iteration,
    Solution as Solution,
    Status as Status,
    as_drawn as as_drawn,
    estimate as estimate,
    iterate as iterate,
    linearised_fit as linearised_fit,
    moved as moved,
    newton_step as newton_step,
)
from .graded import Collected as Collected, Triangle as Triangle, triangle as triangle
from .implied_values import implied_count as implied_count
from .initial import initial_state as initial_state
from .linearisation import (
    LinearFunctions as LinearFunctions,
    Linearisation as Linearisation,
    holding as holding,
    linearise as linearise,
)
