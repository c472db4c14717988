"""The wording that the tests of splines expect: a rewording is entered here alone."""

AND_ARE_NOT = (
    'data.csv:2:7: "0" and "0" are not a direction; give its components, such as 0.6 and 0.8'
)
A_PICTURES_NAME_ENDS = "a picture's name ends in .svg, .png, .pdf"
A_SECOND_POINT_AS_IN_LINE = 'data.csv:3:1: a second point "1", as in line 2; rename one'
CANNOT_BE_WRITTEN = "a.svg: cannot be written (No such file or directory)"
COEFFICIENTS_ARE_TOO_MANY = (
    "1603 coefficients are too many; at most 500 are possible, leave out knots"
)
COLUMNS_INSTEAD_OF_IF_A_COMMA = (
    "data.csv:3:1: 3 columns instead of 2; if a comma is meant as the decimal point, "
    "write a point, as in 4.11"
)
COLUMNS_INSTEAD_OF_SEPARATE_THEM = "data.csv:5:1: 1 columns instead of 2; separate them by commas"
COLUMNS_INSTEAD_OF_WRITE_ONE_LINE = (
    "data.csv:5:1: 2 columns instead of 4; write one line per row, its columns separated by commas"
)
FEATURES_MEET_AT_A_CORNER = "features meet at a corner at 20 mm, with errors 10 µm and 4 µm"
FEATURES_SHARE_VALUE_AND_SLOPE = (
    "features share value and slope at 150 mm; point 16 there belongs to both"
)
FREE_COEFFICIENTS_DEGREES_OF_FREEDOM = "7 free coefficients, 14 degrees of freedom"
IS_BEYOND_WHAT_CAN_BE_COMPUTED = (
    'data.csv:7:7: "1e30" is beyond what can be computed with; write 0, or a length of '
    "1e-18 m to 1e+06 m"
)
IS_NOT_A = 'data.csv:6:4: "7;8" is not a number; separate all columns by the same sign'
IS_NOT_A_NUMBER = 'data.csv:3:5: "x" is not a number; write for example "500.0003"'
IS_NOT_A_NUMBER_WRITE = 'data.csv:3:7: "a" is not a number; write for example "500.0003"'
IS_NOT_A_STANDARD = 'data.csv:6:7: "0" is not a standard uncertainty; give one above zero'
IS_NOT_ON_THE_PROFILE = "is not on the profile"
NOMINAL_IS_FOR_COMPENSATED = "--nominal is for --compensated"
NO_DEGREES_OF_FREEDOM_ARE_LEFT = "no degrees of freedom are left to estimate sigma from"
NO_ERROR_WRITE = "data.csv:4:5: no error; write a number, or remove the line"
NO_POINT_DID_YOU_MEAN = 'no point "enf"; did you mean "end"?'
POINTS_MAGNIFIED_TIMES = "32 points, magnified 200 times; the largest is 94.17 µm"
SEMI_FINISH_ERROR_AGAINST_ARC_LENGTH = (
    "table-1.csv: semi finish error against arc length, 21 points"
)
SEVERAL_COLUMNS_MAY_BE_THE_ERROR = (
    "data.csv:1:1: several columns may be the error: first, second; choose one with --y"
)
THIS_IS_YAML = "this is YAML, not a table; give a CSV file that begins with"
TWO_NEIGHBOURING_POINTS_ARE_AT_MM = "two neighbouring points are at (9 mm, 1 mm); remove one"
