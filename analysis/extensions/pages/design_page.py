"""The page of a design: its predicted rank and uncertainties before any measurement."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ballplate.simulator.design import Design

from .design_views import volume_view
from .document import Page, PageSection, facts_list, introduction, written
from .elements import Html, element, joined, note, sentence, table
from .length_sections import lengths_section
from .quoted import QuotedData
from .residual_sections import reliability_section
from .spatial import still_figure
from .uncertainty_sections import (
    lengths_words,
    misses_target,
    scale_section,
    task_table,
    uncertainty_table,
)

FOOT = (
    "Lengths are in micrometres and angles in microradians unless stated otherwise; u are standard"
    " uncertainties, U = k u expanded ones, predicted at zero machine error. Every value but those"
    " of lengths throughout the volume and of a part is that of ballplate run, reliability, check"
    " --suggest or sheet with --json: its data-path names the command and the path in the output."
)


@dataclass(frozen=True, eq=False)
class DesignContents:
    """Contents of a page of a design: plain data as printed by the commands, by the command's
    name; the `design`; `target` as text; the `file` and its assumptions. `unreliable` is the
    reason why there is no reliability among the data; `part` has sections on the dimensions of a
    part.
    """

    title: str
    data: Mapping[str, Any]
    design: Design
    target: str
    unreliable: str
    file: str
    facts: Sequence[tuple[str, str]]
    part: Sequence[PageSection] = ()


def design_page(contents: DesignContents) -> str:
    """The page as a file that needs no other."""
    quoted = {name: QuotedData(f"/{name}", data) for name, data in contents.data.items()}
    run = quoted["run"]
    sections = [
        PageSection("volume", "The experiment", _experiment(contents)),
        PageSection("rank", "What the readings determine", _rank(run)),
        PageSection("suggestions", "Suggested changes", _suggestions(quoted)),
        PageSection(
            "uncertainties",
            "Uncertainties",
            joined([uncertainty_table(run), task_table(run), _influences(run)]),
        ),
        *contents.part,
        PageSection("assumptions", "What is assumed", _assumptions(run)),
        PageSection(
            "lengths",
            "Lengths throughout the volume",
            lengths_section(quoted["lengths"], contents.target),
        ),
        PageSection("scale", "Where scale comes from", scale_section(run)),
        PageSection("reliability", "Reliability", _reliability(quoted, contents.unreliable)),
        PageSection("sheet", "Run sheet", _sheet(quoted["sheet"])),
    ]
    verdict = _verdict(run, contents.target)
    top = introduction(verdict, _is_good(run), contents.file)
    return written(Page(contents.title, top, sections, FOOT))


def _experiment(contents: DesignContents) -> Html:
    """Section on the volume with its artefacts, and on assumptions."""
    picture = still_figure(volume_view(contents.design))
    return element("div", picture, facts_list(contents.facts), class_="figures views")


def _is_good(run: QuotedData) -> bool:
    is_sure = run.data["as_expected"] and not run.data["weakly_determined"]
    return is_sure and not misses_target(run.data)


def _verdict(run: QuotedData, target: str) -> Html:
    data = run.data
    count = len(data["weakly_determined"])
    weak = (
        f"; {count} direction{'s are' if count > 1 else ' is'} weakly determined" if count else ""
    )
    counts = joined(
        [run.number("parameters"), " parameters from ", run.number("observations"), " observations"]
    )
    if data["rank_deficiency"]:
        expected = (
            "as the file expects" if data["as_expected"] else "which the file does not expect"
        )
        first = sentence(
            "Rank deficiency ",
            run.number("rank_deficiency"),
            f", {expected}: the readings leave ",
            run.number("rank_deficiency"),
            f" {'change' if data['rank_deficiency'] == 1 else 'changes'} of ",
            counts,
            f" undetermined{weak}.",
        )
    else:
        expected = "" if data["as_expected"] else ", though the file expects a deficiency"
        first = sentence(f"Full rank{expected}: the readings determine all ", counts, f"{weak}.")
    second = sentence(lengths_words(run, target))
    qualified = (
        sentence(each.text("text"), ".")
        for each in run.at("qualifications").each()
        if each.data["kind"] != "undetermined"
    )
    return joined([first, second, *qualified])


def _rank(run: QuotedData) -> Html:
    parts = []
    for key, title, words in (
        (
            "undetermined",
            "Undetermined",
            "These change together without changing any observation.",
        ),
        (
            "weakly_determined",
            "Weakly determined",
            "The observations are almost insensitive to these.",
        ),
    ):
        if run.data[key]:
            directions = (
                element("li", direction.text() if key == "undetermined" else direction.text("text"))
                for direction in run.at(key).each()
            )
            parts += [element("h3", title), note(words), element("ol", *directions)]
    if not parts:
        return sentence("No direction is undetermined or weakly determined.")
    return joined(parts)


# In one piece: the columns of one table, and what is said of them.
def _suggestions(quoted: Mapping[str, QuotedData]) -> Html:
    """Section on changes that would determine the rest, and their effects."""
    if quoted["check"].data.get("repairs") is None:
        return sentence("No repair is needed: no direction is undetermined or weakly determined.")
    repairs, run = quoted["check"].at("repairs"), quoted["run"]
    before = run.data["quantities"].get("U6", {}).get("average")
    now = (
        joined([" U6 is ", run.at("quantities", "U6").micro("average"), " µm on average now."])
        if before is not None
        else ""
    )
    rows = []
    for number, suggestion in enumerate(repairs.each(), start=1):
        changes = joined((change.text("text") for change in suggestion.at("changes").each()), "; ")
        edits = joined(
            element(
                "li",
                element("code", f"{edit['path']}: {json.dumps(edit['value'], ensure_ascii=False)}"),
            )
            for edit in suggestion.data["edits"]
        )
        u6, loose = (
            suggestion.micro(symbol) if suggestion.data[symbol] is not None else "-"
            for symbol in ("average_U6", "average_U6_with_uncertain_offsets")
        )
        rows.append(
            [
                f"repair {number}",
                changes,
                suggestion.number("rank_deficiency"),
                suggestion.number("weakly_determined"),
                u6,
                loose,
                suggestion.number("readings"),
                element("ul", edits, class_="edits"),
            ]
        )
    if not rows:
        return sentence("No changes were found that determine everything.")
    heads = [
        "",
        "change",
        "rank deficiency then",
        "weak directions then",
        "U6 average then, µm",
        "with 1 µm on exact offsets, µm",
        "more readings",
        "in the file",
    ]
    title = "Changes: moves, then readings, then certificates, each verified"
    made_table = table("repairs", title, heads, rows, (0, 1, 7))
    introduction = "Each change determines every direction."
    if any(row["rank_deficiency"] for row in repairs.data):
        introduction = "No change determines every direction."
    return joined([sentence(introduction, now), made_table])


def _influences(run: QuotedData) -> Html:
    if not run.data.get("influences"):
        return Html()
    rows = []
    for name, influence in zip(run.data["influences"], run.at("influences").each(), strict=True):
        u, unit = influence.amount("standard_uncertainty", "unit")
        stated_text = "unknown"
        if influence.data["stated_standard_uncertainty"] is not None:
            stated_text, _ = influence.amount("stated_standard_uncertainty", "unit")
        rows.append([name, stated_text, u, unit])
    heads = ["influence quantity", "u stated", "u after the readings", "unit"]
    return table("influences", "Influence quantities", heads, rows, (0, 3))


def _assumptions(run: QuotedData) -> Html:
    """Section on what the prediction takes for granted: U6 without it, and what states it."""
    if "assumptions" not in run:
        return Html()
    table_of = run.at("assumptions")
    rows = [["as the file states", "", table_of.micro("average"), table_of.micro("maximum"), ""]]
    for effect in table_of.at("assumptions").each():
        values = [
            effect.micro("average"),
            effect.micro("maximum"),
            effect.number("ratio", digits=3),
        ]
        rows.append([effect.text("assumed"), effect.text("instead"), *values])
    heads = ["assumed", "U6 in µm if instead", "u average", "u maximum", "times"]
    command = "ballplate run --assumptions prints the entries of the file that state each."
    return joined([table("assumptions", "Assumptions", heads, rows, (0, 1)), note(command)])


def _reliability(quoted: Mapping[str, QuotedData], unreliable: str) -> Html:
    if "reliability" not in quoted:
        return note(unreliable)
    return reliability_section(quoted["reliability"])


def _sheet(sheet: QuotedData) -> Html:
    """The order of positions."""
    rows = []
    for number, step in enumerate(sheet.at("steps").each(), start=1):
        change = step.text("change") if step.data["change"] else ""
        name = step.text("name")
        if step.data["description"]:
            name = joined([name, ": ", step.text("description")])
        rows.append(
            [
                str(number),
                name,
                step.text("set_up"),
                ", ".join(step.data["probes"]),
                step.text("balls"),
                step.number("readings"),
                change,
            ]
        )
    heads = ["", "position", "set up", "probes", "balls", "readings", "first change"]
    words = note("ballplate sheet prints it with boxes to tick off.")
    return joined([table("steps", "Order of positions", heads, rows, (0, 1, 2, 3, 4, 6)), words])
