# Public names of this package, each loaded from its module when it is first used.
from .constraints import Constraint as Constraint, straight as straight
from .knots import at_every as at_every, with_boundaries as with_boundaries
from .polynomial_pieces import pieces as pieces
from .space import Side as Side, SplineSpace as SplineSpace
from .spline_fit import SplineFit as SplineFit, fit as fit
from .spline_problems import SplineError as SplineError, SplineProblem as SplineProblem
