"""Section on error functions: curves with their bands, and what they reach."""

from __future__ import annotations

import numpy as np
from ballplate.presentation import SHOWN

from .charts import Chart, Trace, chart_svg, figure
from .elements import Html, element, joined, note, table
from .quoted import QuotedData
from .uncertainty_sections import expansion


def curves_section(fit: QuotedData) -> Html:
    """The estimated error functions, as corrections to be added to readings."""
    if "error_functions" not in fit:
        return Html()
    k = expansion(fit.at("quantities"))
    functions = list(fit.at("error_functions").each())
    curves = [one for one in functions if len(one.data["values"]) > 1]
    drawn = [figure(_name(one), _curve(one, k)) for one in curves]
    words = (
        "An error is where the tip is, less where the scales say: the correction that is to be"
        f" added to a reading. Bands are expanded uncertainties U, k = {k:g}; where there is"
        " no curve, the function is undetermined."
    )
    rows = [_row(one, k) for one in functions]
    heads = ["error", "meaning", "largest, either sign", f"U there, k = {k:g}", "unit"]
    made = table("error-functions", "Largest values of the error functions", heads, rows, (0, 1, 4))
    return joined([note(words), element("div", *drawn, class_="figures curves"), made])


def _name(one: QuotedData) -> Html:
    along = f", {one.data['along']}" if one.data["along"] else ""
    return joined([one.text("name"), f": {one.data['meaning']}{along}"])


def _row(one: QuotedData, k: float) -> list[str]:
    values = one.data["values"]
    known = [i for i, value in enumerate(values) if value is not None]
    unit = SHOWN[one.data["unit"]]
    if not known:
        return [one.text("name"), one.text("meaning"), one.at("values").number(0), "", unit]
    # The first of those that are alike but for rounding.
    top = max(known, key=lambda i: (float(f"{abs(values[i]):.9g}"), -i))
    u = one.micro("standard_uncertainties", top, factor=k, digits=3)
    along = f" {one.data['along']}" if one.data["along"] else ""
    meaning = joined([one.text("meaning"), along])
    return [one.text("name"), meaning, one.micro("values", top), u, unit]


def _curve(one: QuotedData, k: float) -> Html:
    data = one.data
    values, u = (1e6 * np.array(data[name], float) for name in ("values", "standard_uncertainties"))
    is_place = data["position_unit"] == "m"
    at = np.array(data["positions"], float) * (1e3 if is_place else 1.0)
    across = f"{data['axis']}, mm" if is_place else "part of the line"
    traces = [
        Trace("band", "s0", at, values - k * u, values + k * u),
        Trace("line", "s0", at, values),
    ]
    words = f"{data['name']} over {across}, with a band of expanded uncertainty"
    return chart_svg(Chart(traces, across, SHOWN[data["unit"]], words, height=170.0))
