"""The wording that the tests of repair expect: a rewording is entered here alone."""

ADD_OF_THE_POOL = 'add "aside" of the pool (10 min)'
A_COMMENT_HERE_WOULD = "a comment here would be lost"
A_PLAN_CANNOT_WEIGH = "which a plan cannot weigh"
INCLUDES_THIS = r"concerns positions\[0\].corner, which includes this"
SCALE_RESTS_ON_PROBE_OFFSETS = "exact probe offsets as scale"
