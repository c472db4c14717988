"""The page of an acceptance test."""

from __future__ import annotations

import numpy as np
from ballplate.presentation import table_texts

from ..pages.charts import Chart, Trace, chart_svg, figure, legend
from ..pages.document import Page, PageSection, introduction, written
from ..pages.elements import Html, joined, note, sentence, table
from .acceptance_result import CLAIM, Acceptance

LIMITS = (("ink thin", "MPE"), ("alert thin", "less the guard band"))


def acceptance_page(found: Acceptance) -> str:
    """Return the page as a file that needs no other."""
    words = "errors of sets over their lengths, with the limits of each rule"
    (heads, *rows), are_numbers = table_texts(*found.columns())
    texts = [k for k, is_number in enumerate(are_numbers) if not is_number]
    sections = [
        PageSection("errors", "Errors", _picture(found, words)),
        PageSection("rules", "Rules", joined(map(sentence, found.told))),
        PageSection("sets", "Sets of three", table("sets", words, heads, rows, texts)),
    ]
    is_good = min(found.chances.values()) >= 0.5
    top = introduction(sentence(f"{found.headline()}."), is_good, found.label)
    return written(Page(found.title, joined([top, note(CLAIM)]), sections, CLAIM))


def _picture(found: Acceptance, words: str) -> Html:
    """Return errors from lowest to highest, and limits to both sides, over lengths."""
    lengths = found.sets.lengths
    x = np.array([0.0, lengths.max()])
    limits = list(zip(LIMITS, found.agreed.limits(x).values(), strict=False))
    traces = [
        Trace("line", style, 1e3 * x, sign * 1e6 * limit)
        for (style, _), limit in limits
        for sign in (1.0, -1.0)
    ]
    marks = [("line", *shown) for shown, _ in limits]
    for style, kind in (("s0 heavy", "E0"), ("s1 heavy", "E150")):
        chosen = found.sets.kinds == kind
        if chosen.any():
            marks.append(("line", style, f"95 % of the errors {kind}"))
        ends = np.stack([found.low, found.high, np.full(len(lengths), np.nan)], axis=1)[chosen]
        traces.append(Trace("line", style, 1e3 * np.repeat(lengths[chosen], 3), 1e6 * ends.ravel()))
    chart = chart_svg(Chart(traces, "length, mm", "error, µm", words))
    return figure(f"The {words}", chart, legend(*marks))
