"""The page of a fit: estimates from readings, their uncertainties, and their validity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from ballplate.simulator.machines import Array, Integers

from .curve_sections import curves_section
from .document import Page, PageSection, facts_list, introduction, written
from .elements import Html, element, joined, note, sentence, table
from .quoted import QuotedData
from .residual_sections import (
    diagnosis_section,
    reliability_section,
    residual_charts,
    residual_tables,
)
from .uncertainty_sections import (
    estimates_table,
    expansion,
    lengths_words,
    misses_target,
    task_table,
    uncertainty_table,
)

FOOT = (
    "Lengths are in micrometres and angles in microradians unless stated otherwise; u are standard"
    " uncertainties, U = k u expanded ones. Every value is that of ballplate fit or reliability"
    " with --json: its data-path names the command and the path in the output."
)


@dataclass(frozen=True, eq=False)
class PlateResiduals:
    """Readings (m,) of plates: what each differs by from the estimate (m, d) in standard
    uncertainties, NaN where a co-ordinate is not read, and indices of positions and probes with
    their names.
    """

    standardised: Array
    position: Integers
    probe: Integers
    positions: tuple[str, ...]
    probes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class FitContents:
    """Contents of a page of a fit: plain data of the fit and of its design's reliability (or the
    reason `unreliable`); the reason for untested residuals, possibly empty; `kinds` of the
    estimates by name; `target` as text; source `files` and
    assumptions; the `caveat` on the target; sections on the dimensions of a `part`.
    """

    title: str
    data: Mapping[str, Any]
    kinds: Mapping[str, str]
    reliability: Mapping[str, Any] | None
    unreliable: str
    untested: str
    residuals: PlateResiduals
    target: str
    files: Sequence[str]
    facts: Sequence[tuple[str, str]]
    caveat: str
    part: Sequence[PageSection] = ()


def fit_page(contents: FitContents) -> str:
    """The page as a file that needs no other."""
    fit = QuotedData("/fit", contents.data)
    has_result = contents.data["status"] == "converged"
    assumed = PageSection("assumed", "What was assumed", facts_list(contents.facts))
    sections = [_course(fit), assumed]
    if has_result:
        sections = [*_results(fit, contents), *sections]
    is_good = has_result and _is_good(contents.data)
    top = introduction(_verdict(fit, contents), is_good, *contents.files)
    return written(Page(contents.title, top, sections, FOOT))


def _results(fit: QuotedData, contents: FitContents) -> list[PageSection]:
    """The sections of a fit that has converged."""
    residuals = contents.residuals
    of_residuals = Html()
    if len(residuals.standardised):
        of_residuals = joined(
            [
                residual_charts(
                    residuals.standardised,
                    residuals.position,
                    residuals.probe,
                    residuals.positions,
                    residuals.probes,
                ),
                residual_tables(fit),
            ]
        )
    reliability = note(contents.unreliable)
    if contents.reliability is not None:
        reliability = reliability_section(QuotedData("/reliability", contents.reliability))
    return [
        PageSection("rank", "What the readings determine", _rank(fit)),
        PageSection(
            "lengths",
            "Uncertainties and target",
            joined([uncertainty_table(fit, contents.caveat), task_table(fit, contents.caveat)]),
        ),
        *contents.part,
        PageSection("curves", "Error curves", curves_section(fit)),
        PageSection(
            "asked", "What the readings contradict", diagnosis_section(fit, contents.untested)
        ),
        PageSection("residuals", "Residuals", of_residuals),
        PageSection("reliability", "Reliability", reliability),
        PageSection("adjustments", "Adjustments", _adjustments(fit)),
        PageSection("plate", "Plate", _plate(fit, contents.kinds)),
        PageSection("estimates", "Estimates", _estimates(fit, contents.kinds)),
    ]


def _is_good(data: Mapping[str, Any]) -> bool:
    """True if the page has no warning."""
    wrong = (
        data["degrees_of_freedom"] <= 0
        or data["complaint"]
        or data["weakly_determined"]
        or data["too_large"]
        or data.get("diagnosis", {}).get("contradicted")
        or data["warnings"]
    )
    return not wrong and not misses_target(data)


def _verdict(fit: QuotedData, contents: FitContents) -> Html:
    data = contents.data
    if data["status"] != "converged":
        first = sentence(f"The estimate has {data['status']}, and there are no results.")
        return joined([first, sentence(fit.text("complaint"))])
    rank = Html("Full rank")
    if data["rank_deficiency"]:
        rank = joined(["Rank deficiency ", fit.number("rank_deficiency"), ", as expected"])
    if data["complaint"]:
        rank = fit.text("complaint")
    scatter = "the residuals are no larger than stated"
    if data["degrees_of_freedom"] <= 0:
        scatter = "there is no redundancy, and residuals reveal no error"
    elif data["too_large"]:
        scatter = "the residuals are larger than the stated uncertainties explain"
    weak = len(data["weakly_determined"])
    if weak:
        many = "s are" if weak > 1 else " is"
        rank = joined([rank, f", {weak} direction{many} weakly determined"])
    count = len(data.get("diagnosis", {}).get("contradicted", ()))
    suspects = f", and the readings contradict {count} time{'s' * (count > 1)}" if count else ""
    estimated = "estimated from the residuals" if data["sigma_is_estimated"] else "as given"
    first = sentence(
        rank,
        f"; {scatter} (sigma = ",
        fit.number("sigma", digits=3),
        f", {estimated})",
        suspects,
        ".",
    )
    second = sentence(lengths_words(fit, contents.target, contents.caveat))
    warnings = [sentence("Warning: ", warning.text()) for warning in fit.at("warnings").each()]
    return joined([first, second, *warnings])


def _rank(fit: QuotedData) -> Html:
    data = fit.data
    parts = [
        sentence(
            fit.number("parameters"),
            " parameters, ",
            fit.number("observations"),
            " observations, ",
            fit.number("degrees_of_freedom"),
            " degrees of freedom.",
        )
    ]
    for key, title in (
        ("undetermined", "Undetermined"),
        ("weakly_determined", "Weakly determined"),
    ):
        if data[key]:
            words = (
                element("li", direction.text() if key == "undetermined" else direction.text("text"))
                for direction in fit.at(key).each()
            )
            parts += [element("h3", title), element("ol", *words)]
    for key, title in (
        ("planned_but_not_read", "Planned, but not read"),
        ("read_but_not_planned", "Read, but not planned"),
    ):
        if data[key]:
            words = (element("li", direction.text()) for direction in fit.at(key).each())
            parts += [element("h3", title), element("ul", *words)]
    return joined(parts)


def _course(fit: QuotedData) -> PageSection:
    """Section on the iterations."""
    rows = [
        [
            str(k),
            "" if k == 0 else iteration.number("step", digits=2),
            iteration.number("sum_of_squares", digits=6),
        ]
        for k, iteration in enumerate(fit.at("iterations").each())
    ]
    heads = ["iteration", "step, m and rad", "S²"]
    made_table = table("iterations", "Iterations", heads, rows)
    return PageSection("iterations", "Course of the fit", made_table)


def _adjustments(fit: QuotedData) -> Html:
    if "adjustments" not in fit:
        return Html()
    rows = []
    for adjustment in fit.at("adjustments").each():
        is_angle = adjustment.data["unit"] == "rad"
        factor = 180.0 * 3600.0 / np.pi if is_angle else 1e6
        names = ("value", "standard_uncertainty", "expanded_uncertainty")
        figures = [adjustment.number(name, factor=factor) for name in names]
        rows.append(
            [
                adjustment.text("what"),
                *figures,
                "arcsec" if is_angle else "µm/m",
                adjustment.text("words"),
            ]
        )
    heads = ["adjustment", "is off by", "u", "U, 95 %", "unit", "what to do"]
    words = "Errors of scales: true length less reading; errors of angles: excess over 90°."
    return joined([table("adjustments", "Scales and angles", heads, rows, (0, 4, 5)), note(words)])


def _plate(fit: QuotedData, kinds: Mapping[str, str]) -> Html:
    """Section on co-ordinates of the balls: in the plate's own axes, if it has any, and as
    estimated.
    """
    parts = []
    k = expansion(fit.at("quantities"))
    for number, plate in enumerate(fit.at("plates").each() if "plates" in fit else ()):
        name = list(fit.data["plates"])[number]
        rows = []
        for ball, ball_data in zip(plate.data["balls"], plate.at("balls").each(), strict=True):
            places = [ball_data.at(axis).number("value", factor=1e3, digits=9) for axis in "xy"]
            us = [ball_data.at(axis).micro("standard_uncertainty", digits=3) for axis in "xy"]
            expanded = [
                ball_data.at(axis).micro("standard_uncertainty", factor=k, digits=3)
                for axis in "xy"
            ]
            rows.append([ball, *places, *us, *expanded])
        heads = ["ball", "x, mm", "y, mm", "u of x, µm", "of y", f"U of x, k = {k:g}", "of y"]
        axes = plate.data["axes"]
        caption = f"{name}, in its own axes: origin in {axes['origin']}, and " + ", ".join(
            f"the {axis} axis through {ball}" for axis, ball in axes.items() if axis != "origin"
        )
        parts.append(table(f"plate-{number}", caption, heads, rows, is_long=len(rows) > 40))
    balls = [name for name, kind in kinds.items() if kind == "ball"]
    words = "Co-ordinates of the balls, as estimated"
    parts.append(estimates_table(fit, balls, "balls", words))
    return joined(parts)


def _estimates(fit: QuotedData, kinds: Mapping[str, str]) -> Html:
    titles = {
        "machine": "Parameters of the error model",
        "influence": "Influence quantities",
        "offset": "Offsets of probes",
        "length": "Lengths of standards",
        "rotation": "Rotations of positions",
        "origin": "Origins of positions",
    }
    parts = []
    for kind, caption in titles.items():
        names = [name for name, estimate in kinds.items() if estimate == kind]
        parts.append(estimates_table(fit, names, f"estimates-{kind}", caption))
    return joined(parts)
