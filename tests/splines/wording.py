"""The wording that the tests of splines expect: a rewording is entered here alone."""

IS_OUTSIDE_THE_CURVE = "1.1 is outside the curve, from 0 to 1; it is not extrapolated"
LACKS_POINT_BETWEEN_AND_WHERE = "lacks 1 point between 0.5 and 1, where it has 1"
THE_CURVE_LACKS_POINTS_BETWEEN_MM = (
    "the curve lacks 3 points between 350 mm and 1000 mm, where it has 2; leave out knots "
    "or prescribe more"
)
THE_SECOND_DERIVATIVE_AT_IS_ZERO = "the second derivative at 0 contradicts what else is prescribed"
THE_SLOPE_AT_IS_PRESCRIBED_TWICE = (
    "^the slope at 0 contradicts what else is prescribed; leave it out, or add a knot$"
)
