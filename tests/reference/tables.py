"""Tables as they are written, to the last digit."""

from __future__ import annotations

from typing import Any

import pandas

# Before version 3 pandas reads most numbers with an error in their last digits, unless it is told
# not to.
EXACTLY: dict[str, Any] = (
    {} if int(pandas.__version__.partition(".")[0]) >= 3 else {"float_precision": "round_trip"}
)


def read_table(file: Any) -> pandas.DataFrame:
    """The table of a CSV file."""
    return pandas.read_csv(file, **EXACTLY)
