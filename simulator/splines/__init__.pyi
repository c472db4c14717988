# Public names of this package, each loaded from its module when it is first used.
from .space import (
    Side as Side,
    SplineError as SplineError,
    SplineProblem as SplineProblem,
    SplineSpace as SplineSpace,
    at_every as at_every,
    with_boundaries as with_boundaries,
)
from .spline_fit import (
    Constraint as Constraint,
    SplineFit as SplineFit,
    fit as fit,
    pieces as pieces,
    straight as straight,
)
