# Public names of this package, each loaded from its module when it is first used.
from .files import Writer as Writer, write_file as write_file, write_files as write_files
from .formatting import (
    SHOWN as SHOWN,
    Data as Data,
    aligned as aligned,
    amount_of as amount_of,
    as_data as as_data,
    ascii_units as ascii_units,
    by_name as by_name,
    chance_words as chance_words,
    finite as finite,
    given as given,
    number as number,
    percent as percent,
    picked as picked,
    records as records,
    shown_unit as shown_unit,
    to_uncertainty as to_uncertainty,
    uncertainty_words as uncertainty_words,
)
from .pictures import draw_box as draw_box
from .result import FitResult as FitResult, Result as Result
from .scenes import (
    MOST_BALLS as MOST_BALLS,
    Vectors as Vectors,
    box as box,
    box_edges as box_edges,
    draw_vectors as draw_vectors,
    hull as hull,
    names_fit as names_fit,
    projection as projection,
)
from .svg import (
    DASHES as DASHES,
    INK as INK,
    MARKERS as MARKERS,
    MUTED as MUTED,
    PAPER as PAPER,
    SERIES as SERIES,
    blank_axes as blank_axes,
    common_legend as common_legend,
    drawing as drawing,
    escaped as escaped,
    legend_above as legend_above,
    placed_axes as placed_axes,
    round_number as round_number,
    save as save,
)
from .table_columns import (
    ROUNDING as ROUNDING,
    MainTable as MainTable,
    by_axis as by_axis,
    table_csv as table_csv,
    table_lines as table_lines,
    table_rows as table_rows,
    table_texts as table_texts,
)
