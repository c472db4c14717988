"""The wording that the tests of campaign expect: a rewording is entered here alone."""

AS_BALLPLATE_SHEET_POINTS_WRITES = "as ballplate sheet --points writes it, and has no readings"
CALIBRATION_BETTER_SIDES = "calibration better sides: 1 h"
NOTHING_CAN_BE_ESTIMATED_YET = "no estimate is possible yet (balls not read yet: "
POSITION_DONE_BEFORE = "1 position done before"
TARGET_MET_BUT_FOR_WHAT = "target met, but readings are flagged: inspect them first"
TURNED_DEG_COUNTER_CLOCKWISE_SEEN = "turned 90 deg counter-clockwise seen from +z"
WITH_SO_FEW_DEGREES_OF_FREEDOM = "with so few degrees of freedom it may be"
