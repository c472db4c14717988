"""The wording that the tests of planning expect: a rewording is entered here alone."""

AS_IT_STANDS = "as it stands: flat, across z"
CANDIDATES_WITH_PARAMETERS_EACH_TAKE = "pool: 13 candidates with [0-9]+ parameters each take"
HAS_TO_BE_CHOSEN = '"low" has to be chosen, but was interrupted'
INCLUDES_THE_DISTANCES = (
    'U5 includes the distances of ".*", but no position of this artefact can be read'
)
LOW_AS_IT_STANDS = "as it stands: flat"
LOW_WAS_INTERRUPTED_AFTER_READINGS = "low was interrupted after 5 readings; 4 more complete it"
NO_CHOICE_WAS_FOUND_THAT_DETERMINES = "no choice was found that determines every parameter"
NO_MORE_THAN_OF_THEM = "at most 1 may be chosen"
NO_POSITION_CAN_BE_READ_AS_LIMITS = "limits: no position can be read, as limits exclude"
NO_POSITION_CAN_BE_READ_WITH_ALLOW = "no position can be read with 0.01 h; allow more"
NO_POSITION_DID_YOU_MEAN = 'other.csv:2:1: no position "lo".*did you mean "low"'
NO_SELECTION_DETERMINES_ANY = "no selection determines any"
OF_THE_CHOICE = "U6 of the choice, 9.9.*e-07, is below 1e-06"
SMALL_LOW_IS_LEFT_OUT = "small low is left out: no affordable position"
THE_BOUND_OF_ANY_CHOICE = "the bound of any choice"
WAS_BEGUN_BUT_NO_POSITION = '"plate" was begun, but no position of its other balls can be read'
WHAT_HAS_TO_BE_CHOSEN_TAKES = "what has to be chosen takes .* more than 1 position; allow more"
WHICH_A_PLAN_CANNOT = "which a plan cannot weigh"
WHICH_IS_READ = "which is read; name another file"
