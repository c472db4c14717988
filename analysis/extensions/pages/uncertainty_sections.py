"""Sections on uncertainties: U1 to U6, measuring tasks, and the source of scale."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ballplate.presentation import shown_unit, uncertainty_words

from .elements import Html, folded, joined, note, sentence, table
from .quoted import UNDETERMINED, QuotedData


def expansion(quantities: QuotedData) -> float:
    """The factor of expanded uncertainties on a page: that of the target, or 2."""
    factors = [quantity.data.get("target_coverage_factor") for quantity in quantities.each()]
    return next((factor for factor in factors if factor is not None and factor != 1.0), 2.0)


def uncertainty_table(result: QuotedData, caveat: str = "") -> Html:
    """U1 to U6 with their expanded uncertainties."""
    quantities = result.at("quantities")
    k = expansion(quantities)
    rows, notes = [], []
    for quantity in quantities.each():
        if ", " in quantity.data["unit"]:
            # Lengths and angles have no common unit; each has a row of its own.
            continue
        symbol = quantity.path.rpartition("/")[2].partition(" ")[0]
        count: Html = quantity.number("count")
        if quantity.data["undetermined"]:
            count = joined([count, " (", quantity.number("undetermined"), f" {UNDETERMINED})"])
        figures = [quantity.micro(name) for name in ("maximum", "average")]
        expanded = [quantity.micro(name, factor=k) for name in ("maximum", "average")]
        unit = shown_unit(quantity.data["unit"])
        rows.append(
            [
                symbol,
                quantity.text("description"),
                *figures,
                *expanded,
                unit,
                count,
                quantity.text("largest_at"),
            ]
        )
        if quantity.data.get("within_target") is not None:
            by = uncertainty_words(quantity.data["target_coverage_factor"])
            within = quantity.share("within_target")
            notes.append(note(f"Within the target ({by}): ", within, f" of {symbol}{caveat}."))
        if quantity.data.get("parameters"):
            values = (
                joined([f"{name} ", quantity.micro("parameters", name)])
                for name in quantity.data["parameters"]
            )
            notes.append(
                note(f"{quantity.data['description']}, {unit}: ", joined(values, ", "), ".")
            )
    if not rows:
        return Html()
    heads = ["", "uncertainty of", "u maximum", "u average", f"U maximum, k = {k:g}"]
    heads += [f"U average, k = {k:g}", "unit", "count", "largest at"]
    caption = f"Standard uncertainties u and expanded uncertainties U = {k:g} u"
    return joined([table("quantities", caption, heads, rows, (0, 1, 6, 8)), *notes])


def task_table(result: QuotedData, caveat: str = "") -> Html:
    """Return the table of measuring tasks; a `caveat` is added to statements on the target."""
    if "tasks" not in result:
        return Html()
    rows = []
    for name, task in zip(result.data["tasks"], result.at("tasks").each(), strict=True):
        judged = {True: "yes", False: "no", None: ""}[task.data["within_target"]]
        target = "" if task.data["target"] is None else task.micro("target")
        rows.append(
            [
                name,
                task.number("length", factor=1e3, digits=6),
                task.micro("standard_uncertainty"),
                task.micro("expanded_uncertainty"),
                task.number("coverage_factor"),
                target,
                judged,
            ]
        )
    heads = ["task", "length, mm", "u, µm", "U, µm", "k of U", "target, µm", "within target"]
    return table("tasks", f"Measuring tasks{caveat}", heads, rows, (0, 6))


def lengths_words(result: QuotedData, target: str, caveat: str = "") -> Html:
    """Return a sentence on the lengths that the corrected machine measures, relative to the target
    if there is one.
    """
    u6 = result.at("quantities").data.get("U6")
    if u6 is None:
        return Html("The design has no evaluation points, so that no lengths are judged.")
    lengths = result.at("quantities", "U6")
    if u6["undetermined"]:
        part = "All" if u6["undetermined"] == u6["count"] else ""
        count = part or [lengths.number("undetermined"), " of ", lengths.number("count")]
        return joined([*count, " distances between corrected points are undetermined."])
    amounts = joined(
        [
            lengths.micro("average", digits=3),
            " µm on average and ",
            lengths.micro("maximum", digits=3),
            " µm at most",
        ]
    )
    if u6.get("within_target") is None:
        words = joined(
            ["Distances between corrected points have a standard uncertainty of ", amounts]
        )
        return joined([words, "; the file states no target."])
    by = uncertainty_words(u6["target_coverage_factor"])
    share = lengths.share("within_target")
    sentence = (
        f" of the distances between corrected points are within the target {target} ({by}){caveat};"
        " u is "
    )
    return joined([share, sentence, amounts, "."])


def scale_section(result: QuotedData) -> Html:
    """Where scale comes from."""
    if result.data.get("scale") is None:
        return sentence("Scale is undetermined or has no source.")
    scale = result.at("scale")
    carriers = [
        [
            carrier.text("text"),
            "" if carrier.data["without"] is None else carrier.micro("without", digits=3),
        ]
        for carrier in scale.at("carried_by").each()
    ]
    for row, carrier in zip(carriers, scale.data["carried_by"], strict=True):
        row[1] = row[1] if carrier["without"] is not None else UNDETERMINED
    scale_sentence = sentence(
        "Scale is known to ",
        scale.micro("standard_uncertainty", digits=3),
        " ppm (standard uncertainty).",
    )
    parts = [
        scale_sentence,
        table(
            "scale", "What carries scale", ["carried by", "u of scale without it, ppm"], carriers
        ),
    ]
    return joined(parts)


def estimates_table(result: QuotedData, names: list[str], name: str, caption: str) -> Html:
    """Estimates with standard and expanded uncertainties."""
    k = expansion(result.at("quantities"))
    rows = []
    for key in names:
        estimate = result.at("estimates", key)
        value, unit = estimate.amount("value", "unit", "standard_uncertainty")
        factor = 1e3 if unit == "mK" else 1e6
        u = estimate.number("standard_uncertainty", factor=factor, digits=3)
        expanded = estimate.number("standard_uncertainty", factor=k * factor, digits=3)
        rows.append([key, value, u, expanded, unit])
    heads = ["parameter", "value", "u", f"U, k = {k:g}", "unit"]
    made = table(name, caption, heads, rows, (0, 4), is_long=len(rows) > 40)
    return folded(caption, made, is_open=len(rows) <= 12) if rows else Html()


def misses_target(data: Mapping[str, Any]) -> bool:
    """True if a quantity or a measuring task of a result's data is not within its target."""
    shares = [quantity.get("within_target") for quantity in data["quantities"].values()]
    tasks = [task["within_target"] for task in data.get("tasks", {}).values()]
    return False in tasks or any(share is not None and share < 1.0 for share in shares)
