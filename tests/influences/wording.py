"""The wording that the tests of influences expect: a rewording is entered here alone."""

AGAIN_HAS_THE_KIND = 'Again has the kind "sag", as SagSettings has'
AS_BALL_CENTRES = "as ball centres, but only to 50 mm"
A_PROBE_WITHOUT_AN_OFFSET_HAS = "a probe without an offset has no direction"
DISPLACEMENT_OF_BALL = "displacement of ball two/r1c1: x"
DOES_NOT_KNOW_INFLUENCE_QUANTITIES = "does not know influence quantities"
DRIFT_OF_SCALE = "drift of scale z"
DRIFT_OF_SCALE_2 = "drift of scale y"
DRIFT_OF_SCALE_3 = "drift of scale x"
DRIFT_OF_THE_SCALES = "drift of the scales"
EXPANSION_OF_THE_SCALES = "expansion of the scales"
LEAVE_POSITIONS_OR_CANDIDATES_OUT = "leave positions or candidates out"
OF_THE_TEMPERATURES = "temperature_artefact: 2 of the temperatures"
PRIOR_OF_RATIO_OF_THE_STYLI = "prior of ratio of the styli"
RATIO_OF_THE_STYLI = "ratio of the styli"
SENSOR_ERROR_OF_PLATE = "sensor error of plate"
SENSOR_ERROR_OF_THE_SCALES = "sensor error of the scales"
THE_DERIVATIVE_OF_SHIFTS = 'the derivative of shifts by "more" is'
