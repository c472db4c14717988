"""Tables whose commas and points may separate decimals, thousands or columns."""

from __future__ import annotations

import re

from .table_forms import DECIMALS, Form

# What could be thousands just as well as three decimals.
EITHER = re.compile(r"[+-]?[1-9][0-9]{0,2}[.,][0-9]{3}")


def doubtful_decimals(form: Form) -> str:
    """A number of a table all of whose numbers could have thousands as well as three decimals;
    empty where one number tells.
    """
    sign = DECIMALS[form.decimal]
    doubtful = ""
    for _, cells in form.rows:
        for cell in (cells[i] for i in form.headings.axes):
            if sign not in cell:
                if len(cell.lstrip("+-")) > 3:
                    return ""
            elif not EITHER.fullmatch(cell):
                return ""
            else:
                doubtful = doubtful or cell
    return doubtful


def commas_of_both_kinds(form: Form) -> bool:
    """True if commas may separate decimals as well as columns: all co-ordinates are whole numbers,
    and as many numbers as these stand in columns that nothing is taken from.
    """
    if form.separator != "comma" or not form.headings.unused:
        return False
    used = form.headings.axes
    spare = [i for i in range(len(form.headings.cells)) if i not in form.headings.used]
    if not all(re.fullmatch(r"[+-]?[0-9]*", row[i]) for _, row in form.rows for i in used):
        return False
    whole = [i for i in spare if all(re.fullmatch("[0-9]+", row[i]) for _, row in form.rows)]
    return len(whole) >= len(form.headings.groups[0].axes)
