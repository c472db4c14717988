"""The wording that the tests of repair expect: a rewording is entered here alone."""

ADD_OF_THE_POOL = 'add "turned" of the pool (1.5 h)'
ADD_OF_THE_POOL_MIN = 'add "aside" of the pool (30 min)'
A_COMMENT_HERE_WOULD = "a comment here would be lost"
A_PLAN_CANNOT_WEIGH = "which a plan cannot weigh"
A_NEW_PROBE = "a new probe too"
CANNOT_BE_WRITTEN_AS_IT_WAS = "cannot be written in this form"
ADD_CANDIDATES = "add candidates that determine them"
EMPTY_ADD_POSITIONS = "positions: empty; add positions, or choose some from the pool"
EVEN_ALL_CANDIDATES_TOGETHER_LEAVE_DIRECTIONS = (
    "even all 8 candidates together leave 2 directions undetermined (EAZ, ECZ, EYZ)"
)
EVERY_BAR_LIES_PARALLEL = "every bar lies parallel to the xy plane"
EVERY_BAR_LIES_PARALLEL_TO_THE_PLANE = (
    "every bar lies parallel to the plane perpendicular to (0.707, -0.707, 0)"
)
EVERY_BAR_LIES_PARALLEL_TO_THE_XZ = "every bar lies parallel to the xz plane"
FULL_RANK_AND_NOTHING_IS_WEAKLY = "full rank, and no weak direction; average U6 0.2"
NO_CHANGES_WERE_FOUND = "no changes were found"
NO_CHANGES_WERE_FOUND_THAT_DETERMINE = "repair: no changes were found that determine everything"
NO_SELECTION_DETERMINES_ANY = "no selection determines any of it"
REPAIR_IN_THE_FILE = "repair 1, in the file: positions[straight]: "
REPAIR_IN_THE_FILE_POSITIONS = (
    "repair 1, in the file: positions[z low]: {name: z low, plane: z, level: 100 mm, corner: "
)
REPAIR_TURN_POSITION_BY_ONE_QUARTER = (
    'repair 1: turn position "z low" by one quarter-turn; and calibrate the dist'
)
SCALE_RESTS_ON_PROBE_OFFSETS = "exact probe offsets as scale"
SMALLEST_SINGULAR_VALUE = "smallest singular value 0.0"
THE_EXISTING_FILE_IS_UNCHANGED = "the existing file is unchanged"
THE_FILE_EXPECTS = "the file expects that"
THE_FILE_HAS_CHANGED_MEANWHILE = "the file has changed meanwhile and is not overwritten"
THE_SCALE_RESTS_ON_PROBE_2 = "warning: the scale rests on probe offsets"
THE_SCALE_RESTS_ON_PROBE_OFFSETS = "the scale rests on probe offsets"
NOT_WRITTEN = "not written, a certificate or a probe that the file does not state"
