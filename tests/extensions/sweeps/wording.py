"""The wording that the tests of sweeps expect: a rewording is entered here alone."""

ANOTHER_PROCESS_IS_COMPUTING_INTO = "another process is computing into it"
ARE_THE_LIMIT_OF_A_STORE = "are the limit of a sweep"
UNREADABLE_CELL_ITS_CONTENT = (
    "1 unreadable case, from 1 (its content has changed since it was stored); restore a copy"
)
DIFFERS_IN_CASE_ONLY = "differs in case only"
HAS_THE_VARIANTS_FEW = (
    "s.yaml:2:7: base: has the variants few, many; choose one with variant: NAME, or add "
    "an axis {variants: all}"
)
IS_NOT_RECORDED = "U6 is not recorded"
ITS_FOLDER_CANNOT_BE_WRITTEN = "its folder cannot be written; name another with --store"
MADE_IN_THE_STUDIO = "in Python or the studio"
OF_CELLS_DONE = "0 of 4 cases done"
NO_MORE_THAN_THIRTY = "ValueError: no more than thirty"
NO_TARGET_TO_BE_COMPARED = "no target to be compared with"
NO_VARIANT_IN_QUICKSTART_YAML = (
    's.yaml:3:10: variant: no variant "mny" in quickstart.yaml; did you mean "many"?'
)
WITHIN_TARGET = "U6 within target 25.00 %"
OUTSIDE_THE_FOLDERS_OF_THE_SWEEP = "outside the folders of the sweep"
OUTSIDE_THE_FOLDERS_OF_THE_SWEEP_AND_ITS_BASE = "outside the folders of the sweep and its base"
NAME_A_NEW_FILE = "name a new file with ballplate sweep --store to recompute"
THERE_IS_NO_SUCH_STORE = "there is no such store"
THERE_IS_NO_SUCH_SWEEP = "there is no such sweep; it has 1"
THE_AXIS_CHOOSES_THE_VARIANT_ALREADY = (
    's.yaml:5:3: axes.b: the axis "a" chooses the variant already; name all variants there'
)
THE_CLUSTER_HAS_NO_WORKERS = "the cluster has no workers; start some with: dask worker"
FEWEST = "ewest observations of the cases that meet the target"
FORTY_LINES = "Lines: 40 of 400 combinations"
THE_ONLY_SETTING_DOES_NOT_MEET = "The only case does not meet"
THE_PROCESS_THAT_COMPUTED_IT_WAS = "the process that computed it was ended"
THE_SAME_COMMAND_CONTINUES_FROM_THERE = "the same command continues from there"
HAVE_CHANGED_WHILE_IT_RAN = "have changed while it ran"
WHILE_THE_SWEEP_RAN = "while the sweep ran"
THE_PLACES_ARE_LENGTHS = "the places are lengths: state `corner: {{{}}}` to follow"
CASES_NOT_SHOWN = "Cases not shown here: 7800."
THE_BEST_CASES = "The best cases of 250; --export has all:"
IS_DAMAGED = (
    "is damaged (its content has changed since it was stored); ballplate sweep --export reads"
)
IT_HAS_NONE = "there is no such sweep; it has none"
AN_EARLIER_VERSION = (
    "was computed by an earlier version of ballplate; ballplate sweep --export reads"
)
