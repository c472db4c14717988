"""The wording that the tests of reliability expect: a rewording is entered here alone."""

CANNOT_BE_DETECTED = (
    "cannot be detected, harmless: offset x of probe down, offset y of probe down, offset "
    "z of probe down"
)
CHOOSE_ONE_WITH_VARIANT = "choose one with --variant: length known, "
ESTIMATED_FROM_THE_OTHER_RESIDUALS = "estimated from the other residuals: 4.152 standard deviations"
FIT_THE_MEANS_OF_REPEATED = "fit the means of repeated"
IS_STATED_AS_EXACT_AND_WOULD = "is stated as exact and would have to be"
OFFSET_OF_PROBE_DOWN = "harmless: offset x of probe down"
OFFSET_OF_PROBE_DOWN_IT_CHANGES = (
    "offset y of probe down; it changes distances between points of tasks' probes"
)
SCALE_OF_THE_CERTIFICATE_OF_PLATE = "scale of the certificate of plate"
SCATTER_OF_THE_READINGS_IN_POSITION = "scatter of the readings in position x high"
SEE_WHAT_IS_SUSPECTED = "see what is suspected"
THE_ARRANGEMENT_OF_THE_AXES = "the arrangement of the axes is MB1"
THE_BEST_EXPLANATION_IS_AN_ERROR = "the best explanation is an error in x that depends on x"
