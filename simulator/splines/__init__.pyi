# Public names of this package, each loaded from its module when it is first used.
from .space import (
    SplineError as SplineError,
    SplineProblem as SplineProblem,
    SplineSpace as SplineSpace,
    at_every as at_every,
)
from .spline_fit import (
    Constraint as Constraint,
    SplineFit as SplineFit,
    fit as fit,
    pieces as pieces,
)
