"""The wording that the tests of judgement expect: a rewording is entered here alone."""

CANNOT_BE_ESTIMATED = "cannot be estimated: too little redundancy"
CANNOT_BE_TOLD_FROM_READINGS = "confounded with readings"
DID_NOT_CONVERGE = "2 did not converge"
APPLY_TO_TRIALS_ONLY = "apply to trials only"
GROUPS_OF_OBSERVATIONS_OF_PARAMETERS = "4 groups of observations of 90 parameters"
IS_NOT_DETERMINED_BY_THIS_DESIGN = "is not determined by this design"
LARGER_THAN_STATED = "larger than stated: readings along z"
NOTHING_SHOWS_THAT_IT_IS_RICH = "its sufficiency is untested"
SIGMA_GOES_WITH_READINGS = "--sigma applies to readings"
SIGMA_TIMES_THE_STATED_UNCERTAINTIES = (
    "sigma = 1 times the stated uncertainties (those of groups as estimated below)"
)
SOURCES_BY_THEIR_PART = "sources by their part of U6, the largest first"
TRIALS_APPLIES_TO_THE_ESTIMATOR_FULL = "trials applies to the estimator full"
UNDETERMINED_AND_ARE_LEFT_OUT = "undetermined, and are left out"
