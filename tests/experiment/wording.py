"""The wording that the tests of experiment expect: a rewording is entered here alone."""

A_DISTANCE_MUST_BE_ABOVE = (
    "d.csv:3:1: calibration[0].values: a distance must be above zero; correct it"
)
BEYOND_WHAT_CAN_BE_COMPUTED = "beyond what can be computed with; write 0, or a length of"
BRYAN_GAUGES_ARE_READ_TIMES = (
    "8:1: positions: Bryan gauges are read 25000 times; at most 20000 lengths are possible"
)
DISTANCES_OF_HAVE_BALLS_IN_COMMON = (
    '12:45: calibration[0].pairs: 3160 distances of "bar" have balls in common; at most '
    "3000 such are possible: calibrate fewer of them"
)
DISTANCES_OF_READ_TIMES = (
    '12:45: calibration[0].pairs: 79800 distances of "bar", read 1 times, are too many; '
    "at most 20000 lengths are possible"
)
EXPECTED_A_MAPPING = (
    "e.yaml:9:15: variants.A: expected a mapping, path: new value, found the number 5"
)
EXPECTED_A_MAPPING_NAME = (
    "e.yaml:9:11: variants: expected a mapping, name: {path: new value}, found the number 5"
)
EXPECTED_A_MAPPING_THAT_BEGINS = "e.yaml:1:1: expected a mapping that begins with title: …, found "
EXPECTED_A_TEXT_FOUND_THE_NUMBER = (
    "e.yaml:1:8: title: expected a text, found the number 1; quote it (one-line "
    "description of the experiment)"
)
EXPECTED_A_WHOLE = (
    'e.yaml:13:11: seed: expected a whole number, found the text "x" (seed of simulated '
    "readings; default 1) (in variant B)"
)
HAS_NO_UNIT = (
    'e.yaml:12:27: positions[0].level: "5" has no unit; write for example "5 mm" or "5 '
    'um" (in variant B)'
)
HAS_NO_UNIT_WRITE = '"5e-6" has no unit; write "5e-6 m/m" if it is in m/m'
HAS_THE_UNKNOWN_UNIT = 'e.yaml:2:51: machine.repeatability: "1 mu" has the unknown unit "mu"'
IS_NOT_A = 'd.csv:2:11: "five" is not a number; write for example "500.0003"'
IS_PART_OF_THE_SAME_2 = "e.yaml:12:5: variants.A[positions[0].level]: overlaps the path"
IS_PART_OF_THE_SAME_PLACE = "e.yaml:15:5: variants.B[positions[0].level]: overlaps the path"
MISSING_ADD_POSITIONS = (
    "1:1: positions: missing; add positions, or choose some from the pool with: ballplate plan FILE"
)
MM_IS_FAR_FROM_THE_MM = (
    "d.csv:4:1: calibration[0].values: 5 mm is far from the 500 mm of the artefact's "
    "drawing; correct one of the two"
)
MM_IS_MM_BELOW_THE_MEASURING = (
    "p.csv:3:1: evaluation.points.file: y = -1 mm is 1 mm below the measuring volume, as "
    "1 further points are; move the point inside"
)
MORE_THAN_ERRORS = "balls.csv:502:1: more than 1000 errors; mend these first"
MORE_THAN_ERRORS_MEND = ": more than 1000 errors; mend these first"
MORE_THAN_VALUES = (
    "more than 500000 values, aliases counted in full; move long lists into a CSV file"
)
MOST_OF_ALL = 'most of all "down";'
NESTED_MORE_THAN_DEEP = "f:3:49: nested more than 50 deep by this alias; write less of it"
NO_CANDIDATE_IS_LEFT = (
    "6:3: pool.candidates: no candidate is left: 4 outside the volume; widen the pool"
)
NO_CO_ORDINATES_FOR_ADD_THEM = (
    "e.yaml:14:94: calibration[0].values: no co-ordinates for r3c1, r3c3; add them, or "
    "leave them out of balls"
)
NO_POSITION_READS_BALLS = "6:3: artefacts.plate: no position reads balls r1c2"
PER_METRE_OF_LENGTH = "um/m; give less than 100 um/m"
POINTS_ARE_TOO_MANY = "eyx.csv:5:1: 3 points are too many; at most 2 are possible"
THERE_ARE_READINGS_UP_TO_HERE = (
    "16:7: pool.candidates[0]: there are 6440000 readings up to here, repeats counted; at most"
)
THERE_IS_NO_CANDIDATE = "5:1: pool.candidates: there is no candidate; add some, or positions"
THE_DISTANCE_OF_AND_IS_GIVEN = (
    'd.csv:4:1: calibration[0].values: the distance of "r1c3" and "r1c1" is given twice; '
    "remove one of the two"
)
YAML_STATES_NO_ERROR_THAT_COULD = (
    "e.yaml:3:36: error_model.file: m.yaml states no error that could be"
)
NOT_A_PLACE = (
    'e.yaml:10:49: positions[0].{}: "{}" is not a place ({}); write low, middle, high, a part of the'
    ' free room such as "30 %", or a length such as "750 mm"'
)
BEYOND_THE_FREE_ROOM = (
    'e.yaml:10:49: positions[0].level: "{}" is beyond the free room; give 0 % to 100 %'
)
RATIO_FOR_A_LENGTH = (
    'e.yaml:10:49: positions[0].level: "5 ppm" is a ratio; a length is expected, for example "750'
    ' mm"'
)
PLACE_WITHOUT_UNIT = (
    'e.yaml:10:49: positions[0].level: "0.3" has no unit; write for example "0.3 mm" or "0.3 um"'
)
TWO_LENGTHS_OR_TWO_PARTS = (
    "pool.candidates[1].levels: has a length at one end and a part of the free room at the other;"
    " give two lengths or two parts"
)
NO_ROOM = (
    'e.yaml:10:5: positions[0]: reading ball "r1c1" with probe "down" moves the scales to y = -15'
    " mm, 15 mm below the measuring volume, and 5 more readings; there is no room along y: take a"
    " smaller artefact, or read it otherwise"
)
NO_ROOM_FOR_THE_EDGE = (
    "e.yaml:10:5: positions[0]: with its edge of 13 mm the plate is 8 mm outside the volume; move"
    " it, or correct pool.limits.edge"
)
