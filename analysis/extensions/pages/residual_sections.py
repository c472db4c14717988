"""Sections on residuals of a fit: flagged readings, reliability."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from ballplate.presentation import SHOWN
from ballplate.simulator.inputs import listing
from ballplate.simulator.machines import Array, Integers

from .charts import Chart, Trace, chart_svg, figure, figures, legend
from .elements import Html, element, joined, note, sentence, table
from .quoted import QuotedData

AXES = "xyz"
# Readings whose residuals have room for large dots.
FEW = 400
# Biases that a table names.
MOST = 12


def _size(values: Array) -> str:
    """Return the class of dots: small if there are many."""
    return "" if len(values) <= FEW else "fine"


def dots_by_group(values: Array, group: Integers, names: Sequence[str], across: str) -> Html:
    """Return standardised residuals (m, d), NaN without a reading, by group."""
    d = values.shape[1]
    traces = []
    for k in range(d):
        shift = 0.22 * (k - 0.5 * (d - 1))
        traces.append(Trace("dots", f"{_size(values)} s{k}", group + shift, values[:, k]))
    words = f"standardised residuals by {across}"
    chart = Chart(traces, across, "standardised residual", words, tuple(enumerate(names)))
    return chart_svg(chart)


def dots_in_order(values: Array) -> Html:
    """Standardised residuals (m, d) in the order of the readings."""
    order = np.arange(1.0, len(values) + 1.0)
    traces = [
        Trace("dots", f"{_size(values)} s{k}", order, values[:, k]) for k in range(values.shape[1])
    ]
    words = "standardised residuals in the order of the readings"
    return chart_svg(Chart(traces, "number of the reading", "standardised residual", words))


def residual_charts(
    values: Array,
    position: Integers,
    probe: Integers,
    positions: Sequence[str],
    probes: Sequence[str],
) -> Html:
    """Standardised residuals against position, order and direction."""
    axes = [("dots", f"s{k}", f"along {AXES[k]}") for k in range(values.shape[1])]
    note = "Positions are numbered as in the table below." if len(positions) > 6 else ""
    return joined(
        [
            legend(*axes),
            figures(
                figure(
                    f"Residuals by position, in standard uncertainties. {note}",
                    dots_by_group(values, position, positions, "position"),
                ),
                figure(
                    "Residuals in the order of the readings: a drift would show.",
                    dots_in_order(values),
                ),
                figure(
                    "Residuals by probe, and so by the direction from which balls are probed.",
                    dots_by_group(values, probe, probes, "probe"),
                ),
            ),
        ]
    )


def residual_tables(fit: QuotedData) -> Html:
    """Root mean squares by position, probe and direction, and the largest residuals."""
    parts = []
    for kind, words in (("position", "position"), ("probe", "probe"), ("axis", "direction")):
        rows = [
            [
                *([str(k)] if kind == "position" else []),
                residual.text("name"),
                residual.number("count"),
                residual.micro("root_mean_square"),
                residual.number("standardised"),
            ]
            for k, residual in enumerate(fit.at("residuals", f"by_{kind}").each(), start=1)
        ]
        heads = ["number"] if kind == "position" else []
        heads += [words, "co-ordinates", "root mean square, µm", "in standard uncertainties"]
        texts = (0, 1) if kind == "position" else (0,)
        caption = f"Residuals by {words}"
        parts.append(table(f"residuals-{kind}", caption, heads, rows, texts, len(rows) > 30))
    rows = [
        [
            *(residual.text(name) for name in ("position", "ball", "probe", "axis")),
            residual.micro("value"),
            residual.number("standard_uncertainties"),
        ]
        for residual in fit.at("largest_residuals").each()
    ]
    heads = ["position", "ball", "probe", "along", "µm", "standard uncertainties"]
    parts.append(table("largest", "Largest residuals", heads, rows, (0, 1, 2, 3)))
    return joined(parts)


def diagnosis_section(fit: QuotedData, untested: str) -> Html:
    """Section on what the readings contradict, and the answer to each assumption, or why the
    residuals were not tested.
    """
    if untested:
        return sentence(f"Not tested: {untested}.")
    if "diagnosis" not in fit:
        return Html()
    diagnosis = fit.at("diagnosis")
    items = [element("li", each.text("words")) for each in diagnosis.at("contradicted").each()]
    first = sentence("The readings contradict nothing.")
    if items:
        first = joined([sentence("The readings contradict:"), element("ol", *items)])
    rows = []
    for each in diagnosis.at("tested").each():
        size, unit = each.amount("noticed_from", "unit")
        noticed = joined([size, f" {unit}"]) if each.data["noticed_from"] is not None else "-"
        not_seen = listing(each.data["not_seen"], 4)
        rows.append([each.text("assumed"), each.number("p_value", digits=2), noticed, not_seen])
    heads = ["assumption tested", "p-value", "smallest effect that would show", "cannot be tested"]
    words = "Noticed in four of five campaigns; p-value: of a larger effect if it is right."
    return joined([first, table("answers", "Assumptions", heads, rows, (0, 3)), note(words)])


def reliability_section(reliability: QuotedData) -> Html:
    """Section on detectable biases, and effects of undetectable ones."""
    data = reliability.data
    words = sentence(
        "The observations have a redundancy of ",
        reliability.number("redundancy"),
        " in all, of ",
        reliability.number("observations"),
        ". A bias of the size of the MDB (minimal detectable bias) is found with a power of ",
        reliability.share("power"),
        " by a test with a false alarm of ",
        reliability.share("false_alarm"),
        "; the change that it causes in lengths is the largest that goes unnoticed.",
    )
    parts = [words]
    symbol = "U6" if any("U6" in event["effects"] for event in data["events"]) else "U5"
    for key, title in (("observations_by_name", "Observations"), ("events", "Events")):
        every = list(enumerate(data[key]))
        # What cannot be detected and does harm first, then by what it changes.
        every.sort(key=lambda pair: (-_harm(pair[1], symbol), pair[0]))
        rows = [_bias(reliability.at(key, k), symbol) for k, _ in every[:MOST]]
        if rows:
            heads = ["bias", "MDB", "found by fit from", "unit", f"changes {symbol} by, µm", "at"]
            caption = f"{title} that matter most"
            parts.append(table(f"reliability-{key}", caption, heads, rows, (0, 3, 5)))
            count_left = len(every) - len(rows)
            note_of_rest = (
                f"{count_left} others are in the output of ballplate run --reliability --json."
            )
            parts.append(note(note_of_rest) if count_left else Html())
    return joined(parts)


def _harm(bias: Mapping[str, Any], symbol: str) -> float:
    """Return the largest effect of an undetected bias; infinite if it can never be detected."""
    if bias["minimal_detectable"] is None:
        return -1.0 if bias.get("harmless") else np.inf
    # Equal effects stay in their order, whatever the rounding.
    return float(f"{bias['effects'].get(symbol, {}).get('change', 0.0):.6g}")


def _bias(event: QuotedData, symbol: str) -> list[str]:
    has_bias = event.data["minimal_detectable"] is not None
    effect = event.at("effects", symbol) if has_bias and symbol in event.data["effects"] else None
    harmless = "never; harmless" if event.data.get("harmless") else "never"
    fit = event.micro("found_by_fit", digits=3) if event.data["found_by_fit"] is not None else "-"
    return [
        event.text("name"),
        event.micro("minimal_detectable", digits=3) if has_bias else harmless,
        fit,
        SHOWN[event.data["unit"]],
        effect.micro("change", digits=3) if effect is not None else "-",
        effect.text("at") if effect is not None else "",
    ]
