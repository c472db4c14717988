"""Section on error functions: curves with their bands, and their ranges."""

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
    curves = [function for function in functions if len(function.data["values"]) > 1]
    drawn = [figure(_name(curve), _curve(curve, k)) for curve in curves]
    words = (
        "An error is the actual position of the tip minus the indicated position: the correction to"
        f" add to a reading. Bands are expanded uncertainties U, k = {k:g}; gaps mark"
        " undetermined values."
    )
    rows = [_row(function, k) for function in functions]
    heads = ["error", "meaning", "largest, either sign", f"U there, k = {k:g}", "unit"]
    made = table("error-functions", "Largest values of the error functions", heads, rows, (0, 1, 4))
    return joined([note(words), element("div", *drawn, class_="figures curves"), made])


def _name(function: QuotedData) -> Html:
    along = f", {function.data['along']}" if function.data["along"] else ""
    return joined([function.text("name"), f": {function.data['meaning']}{along}"])


def _row(function: QuotedData, k: float) -> list[str]:
    values = function.data["values"]
    shown = [i for i, value in enumerate(values) if value is not None]
    unit = SHOWN[function.data["unit"]]
    if not shown:
        return [
            function.text("name"),
            function.text("meaning"),
            function.at("values").number(0),
            "",
            unit,
        ]
    # The first of those that are alike but for rounding.
    top = max(shown, key=lambda i: (float(f"{abs(values[i]):.9g}"), -i))
    u = function.micro("standard_uncertainties", top, factor=k, digits=3)
    along = f" {function.data['along']}" if function.data["along"] else ""
    meaning = joined([function.text("meaning"), along])
    return [function.text("name"), meaning, function.micro("values", top), u, unit]


def _curve(function: QuotedData, k: float) -> Html:
    data = function.data
    values, u = (1e6 * np.array(data[name], float) for name in ("values", "standard_uncertainties"))
    is_place = data["position_unit"] == "m"
    x = np.array(data["positions"], float) * (1e3 if is_place else 1.0)
    across = f"{data['axis']}, mm" if is_place else "part of the line"
    traces = [
        Trace("band", "s0", x, values - k * u, values + k * u),
        Trace("line", "s0", x, values),
    ]
    words = f"{data['name']} over {across}, with a band of expanded uncertainty"
    return chart_svg(Chart(traces, across, SHOWN[data["unit"]], words, height=170.0))
