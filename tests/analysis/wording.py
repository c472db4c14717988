"""The wording that the tests of analysis expect: a rewording is entered here alone."""

BENDS_OUT_OF_ITS_PLANE = "bends out of its plane"
CHANGE_TOGETHER_WITHOUT_CHANGING_ANY_OBSERVATION = (
    ": change together without changing any observation"
)
GOAL_NOT_MET = "goal not met: average U6"
LENGTHS_OF_THE_BODY_DIAGONALS = "lengths of the body diagonals"
PROBE_OFFSETS_WITH_A_STANDARD = "probe offsets with a standard uncertainty"
STRETCHES_ALONG_ITS_BENDS = "stretches along its x, bends out of its plane"
THE_FILE_STATES_NO_TARGET_UNCERTAINTY = "the file states no target_uncertainty"
THE_SCALE_RESTS_ON_PROBE_OFFSETS = "warning: the scale rests on probe offsets that are held exact"
