"""The wording that the tests of repair expect: a rewording is entered here alone."""

ADD_OF_THE_POOL = 'add "aside" of the pool (10 min)'
A_COMMENT_HERE_WOULD = "a comment here would be lost"
A_PLAN_CANNOT_WEIGH = "which a plan cannot weigh"
CANNOT_BE_WRITTEN_AS_IT_WAS = "cannot be written in this form"
NO_CHANGES_WERE_FOUND = "no changes were found"
INCLUDES_THIS = r"changes positions\[0\].corner, which includes this"
REPAIR_IN_THE_FILE = "repair 1, in the file: positions[straight]: "
SCALE_RESTS_ON_PROBE_OFFSETS = "exact probe offsets as scale"
THE_EXISTING_FILE_IS_UNCHANGED = "the existing file is unchanged"
THE_FILE_HAS_CHANGED_MEANWHILE = "the file has changed meanwhile and is not overwritten"
NOT_WRITTEN = "not written, a certificate or a probe that the file does not state"
