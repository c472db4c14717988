"""The wording that the tests of laboratory expect: a rewording is entered here alone."""

ARE_NOT_AMONG_THE_POINTS = '"2 7" are not among the 6 points of the set'
ARE_NOT_IN_THE_EXPERIMENT = "are not in the experiment"
ARE_SAID_TO_BE_IN = 'lengths of "X'
A_DOCUMENT_TYPE_DOCTYPE = "a document type (<!DOCTYPE …>) is not read, nor any entity of it"
A_LINE_WITHOUT_CO_ORDINATES_AMONG = "a line without co-ordinates among the rows"
A_TABLE_BESIDE_REPORTS_STATE_WHAT = "a table beside reports .* state what all"
BALLS_MATCHED_BY_NUMBER_IN_READING = "balls matched by number in reading order"
CENTRES_ARE_IN_A_PARTS_CO = "2 centres are in a part's co-ordinate system (PART)"
CENTRES_IN_THE_MACHINES = "warning: centres in the machine's and in a part's system"
CENTRE_IS_OF_POINTS = "1 centre is of points on the surface"
COLUMNS_FOUND_MISSING = '"Taster", "X [mm]", "Y [mm]", "Z [mm]"; missing: ball; name them'
COLUMNS_INSTEAD_OF = "9 columns instead of 6"
CORRECT_THE_NAMES_OF_THE_BALLS = "correct the names of the balls"
COULD_ALL_BE = "could all be x; say which"
CO_ORDINATES_ARE_TAKEN_FOR_BALL = "co-ordinates are interpreted as ball centres, as in reports"
CO_ORDINATES_WHICH_IS_NO_MULTIPLE = "19 co-ordinates, which is no multiple of 3"
DATES_WITHOUT_A = "dates without a zone, and others are times of a day"
DIMENSION_FLATNESS_OF_PLANE = "left: 1 dimension (flatness of plane), 1 sphere (no row Z)"
DIMENSION_POSITION_OF_SPHERE = "1 dimension (position of sphere), 1 dimension (location of plane)"
DIVIDED_BY_ITS_COVERAGE_FACTOR = "divided by its coverage factor"
DOES_NOT_SAY_WHICH_UNCERTAINTY = "does not say which uncertainty it is"
FITS_THE_PROBE_RIGHT = "fits the probe right, not left; correct the name of the probe"
GIVE_THEM_WITH_CERTIFICATE = "give them with --certificate"
HAS_A_DECIMAL = '3:1: "2.25" has a decimal point, and others have decimal commas'
HAS_MORE_THAN_MB = "f: has more than 0 MB; leave some of it out"
HAS_SIGNS_BETWEEN_THOUSANDS = "has signs between thousands"
IS_DAMAGED_OR_NO_WORKBOOK = "is no workbook, damaged or too large"
IS_NOT_IN_THE_ENCODING = "is not in the encoding utf-8"
IS_NO_AXIS = '"w" is no axis; write x, y, z'
IS_NO_TIME = "is no time of a clock"
IS_NO_TIME_OF_A_CLOCK = '"12.5" is no time of a clock; write 10:05:30 or'
IS_NO_WORKBOOK = "is no workbook and has no sheets"
IS_UM_IN_ALL_ROWS = "u is 0.35 um in all rows"
IS_WHERE_BALL_SHOULD = "is where ball .* should be; correct its name"
ITS_NUMBERS_ARE_NOT_BELOW = "report:4:1: its numbers are not below the 6 headings"
ITS_NUMBERS_ARE_NOT_BELOW_THE_HEADINGS = "its numbers are not below the 6 headings"
LEAVE_THE_COLUMN_OUT = "leave the column out"
LENGTHS_ARE_IN = "lengths are in in, the experiment file mm"
LOW_THE_READINGS_FIT_THE_PLATE = "z low: the readings fit the plate turned by 180"
MAY_HAVE_BEEN_CUT_OFF = "may have been cut off"
MISSING_BALL_AND_AXES = '"A", "B", "C"; missing: ball, x, y, z (and position, probe, unless'
MISSING_BALL_AND_POSITION = "missing: ball (and position, unless stated elsewhere)"
MORE_THAN_ELEMENTS = "f:1:12: more than 3 elements; leave some out"
NOTHING_IS_FILLED = "x, y, z are empty in all"
NOR_ONE_ABOVE_IT = 'merged-en.csv:2:1: no "Position", nor one above it'
NOT_RECOGNISED_AS_QIF_RESULTS = "state its format with --from (qif, dmis, pcdmis, calypso)"
NO_CLOCK_TIMES = "no clock times, which 0.csv has"
NO_MEASUREMENT_RESULTS = "no measurement results; is it a plan, or a model?"
NO_NAMES_OF_THE_EXPERIMENT = "its positions are z low, z high, x low and 3 more, its balls r1c1"
NO_POINTS_WITH_THE_ID = 'no points with the id "13" in clear'
NO_POSITION_OR_PROBE = (
    'merged-en.csv:3:1: no "Position" or "Probe" in line 3 and 83 more; if it is the name above, as'
    " below merged cells, give --fill-down"
)
NO_POSITION_OR_PROBE_2 = 'no "Position" or "Probe" in line 2 and 84 more'
NO_RULE_PARTS_THE_NAMES_INTO = "no rule parts the names P_1, P_1_2_3 into position"
NO_SHEET = 'no sheet "Friday"; tables: "Monday", "Tuesday"'
NO_TIME_AND_OTHER_ROWS_HAVE = "no time, and other rows have one"
NO_UNITS_OF_THIS_DIMENSION = "no UNITS= of this dimension"
NO_UNIT_IS_STATED = 'no unit is stated for the columns "x", "y", "z"'
NO_UNIT_IS_STATED_2 = 'no unit is stated for the columns "X", "Y", "Z"'
NO_UNIT_IS_STATED_FOR_THE_ISTWERT = (
    'no unit is stated for the columns "X-Istwert", "Y-Istwert", "Z-Istwert"'
)
NOR_NUMBERS_THAT_FIT = "nor numbers in reading order that fit; write the names"
NO_WRITE_A = "lab.csv:6:1: no x; write a number, or remove the line"
NO_Y_WRITE = "2:1: no y; write a number"
PLACED_BY_THE_NOMINAL_POSES = "placed by the nominal poses"
PLANNED_BUT_NOT_READ_2 = "planned but not read"
POSITIONS_MATCHED_BY_NAME_BUT = "positions matched by name, ignoring case and signs: "
POSITIONS_MATCHED_BY_NUMBER = "positions matched by number and location"
POSITION_ABOVE_THE_HEADINGS = 'position "z low" above the headings'
POSITION_BY_THE_NAME = 'position "Z_HIGH" by the name of the file'
POSITION_BY_THE_NAME_OF_THE_FILE = 'position "z low" by the name of the file'
PTMEAS_OF_A_PROGRAM_ARE_WHERE = "PTMEAS of a program are points to probe, not measured points"
PUT_IT_INTO_THE_FILES_NAME = "add it to the file's name"
QIFDOCUMENT_IS_NO_DOCUMENT_OF_QIF = "<QIFDocument> is no document of QIF 2 or 3"
RUN_BALLPLATE_IMPORT_FIRST = "run ballplate import first"
SCALE_READINGS_ARE_STATED = "scale readings are stated; state ball centres"
SPHERE_HAS_POINTS_ABOUT = "1 sphere (has points about in a plane)"
STATE_THE_RULE_WITH_NAME = "state the rule with --name"
SWAP_THE_NAMES_OF_THE_BALLS = "swap the names of the balls in lines 54 and 55"
TABLE_OF_THE_NOMINAL_CENTRES = "table of the nominal centres of balls"
THERE_IS_NO_COLUMN = 'there is no column "F"'
THE_DEVIATION_IS_NOT_MEASURED_MINUS = "report:14:1: X: the deviation is not measured minus nominal"
THE_ERRORS_THAT_IT_LEAVES = "the errors that it leaves"
THE_FILE_IS_NAMED_TWICE = "the file is named twice"
THE_FILE_STATES_NO_UNIT = "the file states no unit of length; state it with --unit mm"
THE_NAMES_CAN_BE_READ = "as {position}_{ball}_{probe} and {position}_{probe}_{ball}; state"
THE_NAMES_OF_BALLS = (
    "the names of balls r2c2 and r2c1 in position P3 were swapped (lines 54 and 55)"
)
THE_NAME_CAN_BE_PARTED = 'the name "z_low_r1c1" can be parted as {position}_{ball} in several ways'
THE_NAME_OF_THE_FILE = 'position "t" by the name of the file'
THE_PROBES_ARE_NOT_IN_THE_EXPERIMENT = '"T1", "T2", "T3", "T4", "T5" are not in the experiment'
THE_SHEETS_HAVE_TABLES = 'the sheets "Monday", "Tuesday" have tables; give --sheet'
THIS_IS_A_DMIS = "this is a DMIS program, not a report"
THIS_IS_A_REPORT = "this is a report of a measuring program (DMIS output), and no table"
TOO_FEW_BALLS_WERE_READ = "too few balls were read in z high"
WORKBOOKS_NEED_OPENPYXL = "install it with: python -m pip install 'ballplate[xlsx]'"
X_AGAIN = "3:1: x again, in the reading of line 2, which lacks others"
