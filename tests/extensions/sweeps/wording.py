"""The wording that the tests of sweeps expect: a rewording is entered here alone."""

ABOVE_THE_MEASURING_VOLUME = "above the measuring volume"
ALL_AVERAGES_ARE_THE_SAME = "All averages are the same."
AMOUNTS_OF_CELL = "values of case 0"
ANOTHER_PROCESS_IS_COMPUTING_INTO = "another process is computing into it"
ARE_THE_LIMIT_OF_A_STORE = "are the limit of a store"
AVERAGE_IS_THE_SAME = "1 average is the same."
CELLS_MORE_ARE_NOT_SHOWN_HERE = "Cases not shown here: 7800; ballplate sweep --export gives all."
CELLS_MORE_ARE_NOT_SHOWN_HERE_BALLPLATE = (
    "Cases not shown here: 50; ballplate sweep --export gives all."
)
UNREADABLE_CELL = "1 unreadable case"
UNREADABLE_CELL_ITS_CONTENT = (
    "1 unreadable case: 1 (its content has changed since it was stored); run ballplate sweep"
)
COMPARE_APPLIES_TO_PAGES = "compare applies to pages only"
UNREADABLE = "1 unreadable in the damaged store"
DIFFERS_IN_CASE_ONLY = "differs in case only"
EYY_POSITIONING_ERROR = "EYY (positioning error of Y"
WAS_DELETED = "was deleted, moved or replaced"
HAS_THE_VARIANTS_FEW = (
    "s.yaml:2:7: base: has the variants few, many; choose one with variant: NAME, or add "
    "an axis {variants: all}"
)
INTERRUPTED_FINISHED_CELLS = "interrupted; finished cases are in"
SETTING_IS_NOT_COMPARED = "1 case is not compared: some of U6 is undetermined."
IS_NOT_RECORDED = "U6 is not recorded"
ITS_FOLDER_CANNOT_BE_WRITTEN = "its folder cannot be written; name another with --store"
LEADS_OUT_OF_THE_FOLDER = "leads out of the folder"
MADE_IN_THE_STUDIO = "made in the studio"
MAP_OF_STANDARD_UNCERTAINTIES = "Map of standard uncertainties"
MODEL_METRIC_AS_IN_THE_BEST = "model metric, as in the best case"
MODULES_ARE_NOT_ALLOWED_HERE = "modules are not allowed here; add --run-modules"
OF_CELLS_DONE = "0 of 4 cases done"
NONE_OF_THE_SETTINGS_MEETS = "None of the 12 cases meets"
NO_MORE_THAN_THIRTY = "ValueError: no more than thirty"
NO_TARGET_TO_BE_COMPARED = "no target to be compared with"
NO_VARIANT_IN_QUICKSTART_YAML = (
    's.yaml:3:10: variant: no variant "mny" in quickstart.yaml; did you mean "many"?'
)
OF_SETTINGS_LEAVES_SOMETHING_UNDETERMINED = "1 of 12 cases leaves something undetermined."
OF_THEM_BEFORE = "(3 of them before)"
OF_THE_LENGTHS = "25 % of the lengths"
OUTSIDE_THE_FOLDERS_OF_THE_SWEEP = "outside the folders of the sweep"
OUTSIDE_THE_FOLDERS_OF_THE_SWEEP_AND_ITS_BASE = "outside the folders of the sweep and its base"
SETTINGS_ARE_DONE_IN_BOTH = "12 cases are done in both; 0 in this store alone, 0"
SETTINGS_ARE_DONE_IN_BOTH_IN_THIS_STORE = "12 cases are done in both; 0 in this store alone"
SETTINGS_ARE_RANK_DEFICIENT_ONLY = (
    "0 cases are rank-deficient only in this store, 1 only in b.sqlite."
)
SMALLER_THAN_IN_SQLITE = "smaller than in b.sqlite in 11 cases, by a factor of 0.800."
SMALLEST_AVERAGE_OF = "Smallest average of U6, 0.117 µm: case 11, size 750 mm, balls 7"
NAME_A_NEW_FILE = "name a new file with ballplate sweep --store to recompute"
SWEPT_OVER_BALLS = "swept over balls, edge, model and"
THERE_IS_NO_SUCH_STORE = "there is no such store"
THERE_IS_NO_SUCH_SWEEP = "there is no such sweep; it has 1"
THE_AXIS_CHOOSES_THE_VARIANT_ALREADY = (
    's.yaml:5:3: axes.b: the axis "a" chooses the variant already; name all variants there'
)
THE_CLUSTER_HAS_NO_WORKERS = "the cluster has no workers; start some with: dask worker"
THE_EXPERIMENT_IS = "the experiment is a list; write its sections"
THE_ONE_WITH_THE_FEWEST = "The one with the fewest"
THE_ONLY_SETTING_DOES_NOT_MEET = "The only case does not meet"
THE_PROCESS_THAT_COMPUTED_IT_WAS = "the process that computed it was ended"
THE_SAME_COMMAND_CONTINUES_FROM_THERE = "the same command continues from there"
THE_SETTING_OF_THE_BEST_CELL = "c 1, as in the best case; 6 of 20 values of b"
THE_STORE_CANNOT_BE_TRUSTED = "the store cannot be trusted"
THE_WORKER_HAS_NO_BALLPLATE = (
    "the worker b has no ballplate, and this is ballplate 1, and 1 more differ;"
)
HAVE_CHANGED_WHILE_IT_RAN = "have changed while it ran"
WHILE_THE_SWEEP_RAN = "while the sweep ran"
THE_PLACES_ARE_LENGTHS = "the places are lengths: state `corner: {{{}}}` to follow"
