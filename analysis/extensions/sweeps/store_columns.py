"""Names of the columns of a sweep's table."""

from __future__ import annotations

import re

from ballplate.uncertainty import RECORDED

# In addition to columns of quantities, versions and sums of squares.
NAMES = (
    "cell",
    "status",
    "reason",
    "given",
    "unspanned",
    "data_set_seed",
    "fingerprint",
    "duration_s",
    "parameters",
    "observations",
    "positions",
    "readings",
    "hours",
    "bound_m",
    "bound_ratio",
    "criterion_m",
    "criterion_ratio",
    "chosen",
    "drawing",
    "rank_deficiency",
    "as_expected",
    "weakly_determined",
    "smallest_singular_value_per_um",
    "gap",
    "trials",
    "distance_error_rms_m",
    "distance_error_bias_m",
    "distance_error_rms_m_standard_error",
    "not_converged",
    "degrees_of_freedom",
)


# Mark of a further artefact's symbols in Monte Carlo.
MORE = "'"


def is_reserved(column: str) -> bool:
    """Return whether results may have a column of this name, so that no axis can.

    >>> is_reserved("U4_average_m"), is_reserved("size_m")
    (True, False)
    """
    symbols = "|".join(RECORDED)
    return (
        column in NAMES
        or re.fullmatch(rf"({symbols})([ _].*)?|.*_version|sum_of_squares.*", column) is not None
    )


def symbol_column(symbol: str) -> str:
    """Return a quantity's symbol in the form for names of columns.

    >>> symbol_column("U2 lengths"), symbol_column("U5'")
    ('U2_lengths', 'U5_more')
    """
    return symbol.replace(" ", "_").replace(MORE, "_more")


def unit_suffix(unit: str) -> str:
    """Return a unit in the form for the end of a column's name.

    >>> unit_suffix("m, rad"), unit_suffix("1")
    ('m_or_rad', 'ratio')
    """
    return unit.replace(", ", "_or_").replace("1", "ratio")
