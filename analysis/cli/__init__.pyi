# Public names of this package, each loaded from its module when it is first used.
from .common import (
    add_file as add_file,
    add_formats as add_formats,
    add_goal as add_goal,
    add_json as add_json,
    add_picture as add_picture,
    add_workers as add_workers,
    argument_type as argument_type,
    at_most as at_most,
    count as count,
    coverage_factor as coverage_factor,
    day as day,
    experiments as experiments,
    grid as grid,
    number as number,
    page_path as page_path,
    print_json as print_json,
    print_lines as print_lines,
    show as show,
    single as single,
    trial_count as trial_count,
    whole as whole,
    write_noted as write_noted,
    write_picture as write_picture,
)
from .dispatch import main as main
from .excerpts import print_errors as print_errors
from .notes import complain as complain, note as note, warn as warn
from .outputs import (
    PARQUET as PARQUET,
    Needed as Needed,
    Output as Output,
    OutputAction as OutputAction,
    UsageError as UsageError,
    Writer as Writer,
    add_force as add_force,
    add_output as add_output,
    check_overwritten as check_overwritten,
    text_writer as text_writer,
    write as write,
    write_outputs as write_outputs,
)
from .progress_bars import duration as duration, progress as progress
from .reading_options import (
    add_pairs as add_pairs,
    add_readings as add_readings,
    add_readings_argument as add_readings_argument,
    observed_readings as observed_readings,
    refuse_wrong_order as refuse_wrong_order,
    warn_of as warn_of,
)
from .table_options import (
    KEYS as KEYS,
    add_tables as add_tables,
    named_sources as named_sources,
    rule as rule,
    with_options as with_options,
)
