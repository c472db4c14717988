"""The wording that the tests of cli expect: a rewording is entered here alone."""

ALPHA_DEPARTURE_OF_THE_AXES = "alpha (departure of the axes from squareness)"
AN_ELEVATION_IS_OUTSIDE_DEG = (
    "9:57: artefacts.high.directions: an elevation is outside -90 deg to 90 deg; give "
    "one of that range"
)
ARGUMENT_FORMAT_INVALID_CHOICE = (
    "argument --format: invalid choice: 'juint'; did you mean \"junit\"?"
)
A_BRYAN_GAUGE_ONLY_CARRIES = (
    "6:9: artefacts.role: a Bryan gauge is a length standard, not a plate; remove its role"
)
A_PLATE_IN_TWO = "design: a plate in two positions"
A_TURN_OF_DEGREES_LIES_BETWEEN = (
    'a turn of 180 degrees lies between "straight" and "turned by 180"; turn the plate by about 90'
)
BALLS_AND_ARE_AT_THE_SAME = (
    '8:57: artefacts.same.directions: balls "1" and "2" have the same location; correct one of them'
)
BALL_IN_POSITION_FIRST = "4:1: ball 3 in position first is "
BALL_IN_POSITION_LOW_IS_WHERE = (
    "ball r1c1 in position z low is where ball r4c4 should be; correct its name"
)
BALL_IN_POSITION_LOW_IS_WHERE_BALL = (
    "17:1: ball r4c2 in position z low is where ball r4c1 should be; swap the names of "
    "the balls in lines 17 and 18"
)
BALL_IN_POSITION_TURNED = "9:1: ball 3 in position turned is "
BALL_IS_REPEATED_IN_POSITION = (
    '252:1: ball "r1c3" is repeated in position "z low" with probe "down" (first in line '
    "4); remove the line, or state repeats: 2 for that position in the experiment"
)
CANNOT_BE_WRITTEN = (
    "new.yaml: cannot be written (No such file or directory); check the folder, its "
    "permissions and its room, and whether another program has the file open"
)
CANNOT_FOLLOW_AN_UNKNOWN_LENGTH = "cannot follow an unknown length (bar: length)"
CELLS_DONE_FAILED_OF_THEM_BEFORE = "6 cases, 4 done, 2 failed (2 of them before)"
CORRECT_OR_REMOVE = "correct or remove it"
CORRECT_THE_NAMES_OF_THE_BALLS = "correct the names of the balls"
DID_YOU_MEAN = 'did you mean "position"?'
DID_YOU_MEAN_3 = '--trails=5; did you mean "--trials"?'
DIRECTIONS_ARE_TOO_MANY = (
    "10:57: artefacts.many.directions: 5040 directions are too many; at most 5000 are possible"
)
DISTANCES_AGAINST_THE_TRUE_MACHINES = "distances against the true machine's"
ESTIMATORS_OF_DISTANCES_ALONE_CANNOT_FOLLOW = (
    "artefacts: estimators of distances alone cannot follow a Bryan gauge's pivot; use --estimator"
)
ESTIMATOR_DISTANCES_LENGTHS_OF_STANDARDS_AGAINST = (
    "estimator distances (12 lengths of standards) against"
)
FINISHED_CELLS_ARE_IN_NEW_SQLITE = "finished cases are in new.sqlite"
FITS_THE_PROBE_LEFT = "fits the probe left, not right; correct the name of the probe"
FROM_DEGREES_OF_FREEDOM_IS_ITSELF = "from 6 degrees of freedom is itself uncertain by 29 %; "
GAMMA_DIFFERENCE_OF_THE_SCALES = "gamma (difference of the scales of x and y)"
GOAL_NOT_MET = "goal not met: average U6"
HAS_NO_BALL_BAR_OR_BRYAN = "has no ball bar or Bryan gauge whose lengths are read"
HAS_NO_BALL_BAR_OR_BRYAN_GAUGE = "has no ball bar or Bryan gauge"
HAS_NO_UNIT = (
    '6:37: artefacts.unit.radius: "300" has no unit; write for example "300 mm" or "300 um"'
)
INTERRUPTED_FINISHED_CELLS = "interrupted; finished cases are in"
IN_POSITION_TURNED = "in position turned, line 9; correct or"
IS_A_BRYAN_GAUGE_AND_HAS = (
    '19:12: calibration[0].kind: "over" is a Bryan gauge and has a radius only; use kind: radius'
)
IS_A_PLATE_BUT_LENGTH_EQUATIONS = (
    "artefacts.bar: is a plate, but length-equations needs length standards"
)
IS_MM_FROM_WHERE_IT_SHOULD = "is 10 mm from its expected location"
IS_TURNED_BY_DEGREES = '"turned" is turned by 89.992480 degrees, clockwise, from "first"'
LEAVES_OUT_WHAT_IS_NOT_READ = "omits balls that are not read in both positions: r2c2, r3c1"
MM_IS_FAR_FROM_THE_MM = (
    "21:71: calibration[2].value: 600 mm is far from the 500 mm of the artefact's "
    "drawing; correct one of the two"
)
MODULES_ARE_NOT_ALLOWED_HERE = "modules are not allowed here"
MODULES_ARE_NOT_ALLOWED_HERE_LEAVE = "modules are not allowed here; leave --no-modules out"
OF_THE_STATED_ONES = "of the stated ones"
ONLY_A_BRYAN_GAUGE_HAS = (
    '20:12: calibration[1].kind: only a Bryan gauge has a radius, and "bar" is not one; '
    "use kind: distances"
)
ONLY_THE_ARM_OF_DROOPS = "only the arm of MH1, MH2 droops"
ORIGIN_BALL_AXIS_THROUGH_BALL = "(origin: ball 1, x axis through ball 2)"
PLANNED_BUT_NOT_READ_LOW = "planned but not read (1): z low: ball r1c1 with down"
POSITION_LOW_THE_READINGS_FIT = (
    ": position y low: the readings fit the plate turned over; correct the names"
)
PRIORS_REFER_TO_THE_FILES_ERROR = (
    "priors: priors refer to the file's error model; write scale: none there instead of --scale"
)
RADIUS_CHANGE_TOGETHER_WITHOUT_CHANGING_ANY = (
    "gauge: radius (0.3 µm): change together without changing any observation"
)
READING_BALL_WITH_PROBE_PUTS = (
    '16:5: positions[0]: reading ball "2" with probe "magnet" moves the scales to y = 900 mm,'
    " 100 mm above the measuring volume, and 1 more reading; move the artefact, or read it"
    " otherwise"
)
READ_BUT_NOT_PLANNED_LOW = "read but not planned (1): z low: ball r1c2 with right"
STANDARD_OUTPUT_CANNOT_BE_WRITTEN_NO_SPACE = (
    "standard output: cannot be written (No space left on device); give it room"
)
SWAP_THE_NAMES_OF_THE_BALLS = "swap the names of the balls in lines 60 and 71"
SWAP_THE_NAMES_OF_THE_BALLS_IN_LINES = "swap the names of the balls in lines 5 and 9"
THE_DESIGN_LEAVES_ERRORS_UNDETERMINED = "the design leaves errors undetermined"
THE_ESTIMATE_HAS_DIVERGED = "the estimate has diverged; no results are reported"
THE_EXISTING_FILE_IS_UNCHANGED = "the existing file is unchanged"
THE_PIVOT_IS_THE_CENTRE = (
    "warning: the pivot is the centre of a sphere, as if the machine had no errors"
)
THE_RADIUS_OF_IS_ALREADY = (
    '23:5: calibration[4]: the radius of "over" is already in calibration[3]; remove one of the two'
)
THE_RESULTS_ARE_THOSE = "interrupted: the results are those of the data sets done so far"
THE_REVERSAL_NEEDS_TWO_DIMENSIONS = "the reversal needs two dimensions, not three"
THE_SCALE_RESTS_ON_PROBE_OFFSETS = "warning: the scale rests on probe offsets"
THREE_PARAMETERS_NO_OFFSETS = (
    "three parameters, no offsets, scale difference: none (fitted, but not applied)"
)
UNKNOWN_PARAMETER_DID_YOU_MEAN = (
    '25:17: priors[0].parameter: unknown parameter "a: rotation z"; did you mean "a: origin z"?'
)
WHATEVER_THE_FILES_ERROR_MODEL = "regardless of the file's error model"
