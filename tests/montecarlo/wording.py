"""The wording that the tests of montecarlo expect: a rewording is entered here alone."""

NONE_IS_ABOVE_BY_MORE = "no ratio is above 1 by more than 4 standard errors"
THE_FITTED_MODEL_CANNOT_FOLLOW = "The fitted model cannot follow the true machine exactly."
THE_FITTED_ONE_FOLLOWS_EXACTLY = "the fitted one follows exactly"
TOO_OPTIMISTIC_THE_FITTED_MODEL_CANNOT = (
    "Too optimistic? The fitted model cannot follow the true machine exactly."
)
TO_TAKE_THE_NOISE_OF_ALL = "U1 to U6 assume independent noise in all readings"
