"""Forms of tables and pictures in which results are shown."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs.faces import lazily

# Public names of this package: extensions import these alone, and its modules are private.
if TYPE_CHECKING:
    from .files import write_file, write_files
    from .formatting import (
        SHOWN,
        Data,
        aligned,
        amount_of,
        as_data,
        ascii_units,
        by_name,
        chance_words,
        finite,
        given,
        number,
        percent,
        picked,
        records,
        shown_unit,
        to_uncertainty,
        uncertainty_words,
    )
    from .paper import escaped, on_paper
    from .pictures import draw_box
    from .result import FitResult, Result
    from .scenes import (
        MOST_BALLS,
        box,
        box_edges,
        hull,
        names_fit,
        projection,
        scene,
    )
    from .svg import (
        DASHES,
        INK,
        MARKERS,
        MUTED,
        PAPER,
        SERIES,
        blank_axes,
        common_legend,
        drawing,
        legend_above,
        placed_axes,
        round_number,
        save,
        scale_bar,
        sticks,
    )
    from .table_columns import ROUNDING, MainTable, by_axis, table_csv, table_lines, table_rows
    from .vectors import Vectors, draw_vectors

__getattr__, __dir__ = lazily(__name__, __file__)
