"""The wording that the tests of drafting expect: a rewording is entered here alone."""

UNKNOWN_MACHINE = (
    'unknown type of machine "bridge"; choose from moving bridge, fixed bridge, gantry, cantilever,'
    " horizontal arm, column, MB1, MB2, FB1, FB2, FH1, FH2, MH1, MH2, CX1, CY1"
)
UNKNOWN_TIPS = 'unknown tips "two"; choose from one, star, head'
FOUR_LENGTHS = '"900 1200 700 500 mm" has 4 lengths, not 3; write for example "900 1200 700 mm"'
NOTHING_HIGH = '"0 mm" must be above zero'
NO_UNIT_OF_MPE = '"0.9" has no unit'
DIVIDES_BY_ZERO = "divides by zero"
NO_COVERAGE_FACTOR = '"0.4 um + 0.5 um/m" needs one coverage factor of 1 to 10; write "…, k=2"'
NO_COVERAGE_FACTOR_OF_AN_ANSWER = '"0.4 um" needs one coverage factor of 1 to 10'
SMALL_EDGE = '"900 1200 1 mm" has an edge of 1 mm; give 10 mm to 100 m'
NO_CONSTANT_PART = '"0 um + L/400" has no constant part'
SINGLE_LINE = '"1 x 6, 420 mm" is no plate of 2 x 2 balls or more'
ONE_SIZE = '"6 x 4, 420 mm" has one size for two sides; give both, such as 420 x 252 mm'
TOO_SHORT = "1 h is too short: three positions with a change of plane take 2 h; give more"
NO_UNCERTAINTY_OF_TEMPERATURE = '"20 degC" is no uncertainty of a temperature'
COARSE_REPEATABILITY = (
    "repeatability 2 µm is above the constant part of the MPE, 0.9 µm; correct one of them"
)
TWO_UNCERTAINTIES = '"star, 2 um, 3 um" states a length or an uncertainty twice; write'
NO_TIME = '"0" leaves no time for measuring'
LARGER_THAN_THE_VOLUME = (
    "the plate of 1300 mm x 1300 mm is larger than the volume, 900 mm x 1200 mm x 700 mm"
)
OUT_OF_REACH = (
    "the plate of 650 mm x 650 mm does not fit across x within the reach of the tips right, left,"
    " 780 mm x 1200 mm x 640 mm"
)
NO_ANSWER = "no answer for --machine-type; nothing is written"
HALF_THE_MPE = "lengths of the corrected machine: half the MPE."
TIPS_IN_TWO_DIMENSIONS = "tips star are not for a volume of two lengths"
