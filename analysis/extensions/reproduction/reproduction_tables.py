"""A reproduction as text, as Markdown, and as plain data."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from ballplate.presentation import Data, aligned, number, picked
from ballplate.simulator.inputs import number_of

from .compare import (
    ComparedColumn,
    ComparedErratum,
    ComparedFigure,
    ComparedProgress,
    ComparedRemark,
    PlacedFigure,
    ProgressLine,
    Reproduction,
    Section,
    Side,
)
from .published import (
    REPEATABILITY,
    SUM_OF_SQUARES,
    SYMBOLS,
    Document,
    Remark,
    Reservation,
    case_of,
)


@dataclass(frozen=True)
class Heading:
    """A heading; level 1 is the title."""

    level: int
    text: str


@dataclass(frozen=True)
class Grid:
    """A table: its head, its rows, and a mask of right-aligned columns."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    right: tuple[bool, ...]


# A string is a paragraph.
Block = Heading | str | Grid

QUANTILES = (0.0, 0.05, 0.5, 0.95, 1.0)


def reproduction_lines(reproduction: Reproduction) -> list[str]:
    """Return a reproduction as lines of text, with tables of at most 80 characters."""
    lines: list[str] = []
    for block in _blocks(reproduction):
        if isinstance(block, Heading):
            lines += [*([""] if lines else []), block.text]
        elif isinstance(block, str):
            lines.append(block)
        else:
            lines += ["", *aligned([block.head, *block.rows], block.right), ""]
    # One empty line replaces two, without any at the end.
    return [line for k, line in enumerate(lines) if line or any(lines[k + 1 : k + 2])]


def reproduction_markdown(reproduction: Reproduction) -> str:
    """Return a reproduction as Markdown, with the assumptions of each value."""
    parts = []
    for block in _blocks(reproduction, with_assumptions=True):
        if isinstance(block, Heading):
            parts.append(f"{'#' * block.level} {block.text}")
        elif isinstance(block, str):
            parts.append(block)
        else:
            marks = ["---:" if right else "---" for right in block.right]
            cells = [block.head, marks, *block.rows]
            parts.append(
                "\n".join(
                    f"| {' | '.join(cell.replace('|', '&#124;') for cell in row)} |"
                    for row in cells
                )
            )
    return "\n\n".join(parts)


def _blocks(reproduction: Reproduction, with_assumptions: bool = False) -> list[Block]:
    statements = reproduction.document.statements
    keys = {assumption for section in reproduction.sections for assumption in section.rests_on}
    blocks: list[Block] = [
        Heading(
            1, f"{statements.title}: published values, and those computed from the shipped designs"
        ),
        (
            "Ratios are published over computed values. They agree if they are within"
            f" {100 * statements.limits.figure:g} % after the common factor of their column, and"
            f" that factor is within {100 * statements.limits.factor:g} % of 1, unless a numbered"
            " exception states other limits."
        ),
        Heading(2, "Assumptions"),
    ]
    blocks += [
        f"{assumption.key}: {assumption.text}."
        for assumption in statements.assumptions
        if assumption.key in keys
    ]
    for section in reproduction.sections:
        blocks += _section_blocks(reproduction.document, section, with_assumptions)
    return blocks + _exception_blocks(reproduction) + _summary(reproduction)


def _section_blocks(document: Document, section: Section, with_assumptions: bool) -> list[Block]:
    blocks: list[Block] = [
        Heading(2, f"Section {section.name}: {section.title}"),
        f"Rests on {_resting(document, section)}.",
    ]
    if section.ranks:
        rows = [
            (
                case_of(statement.design),
                _rank(statement.published),
                _rank(statement.ours),
                yes(statement.agrees),
            )
            for statement in section.ranks
        ]
        blocks.append(_grid(("rank of", "published", "computed", "agrees"), rows, 1))
    if section.columns:
        blocks.append("Columns of tables, their common factor, and the largest deviation from it:")
        blocks.append(_factors(section.columns))
        text = (
            "Published and computed U in µm and µrad; their ratio, and the ratio after the common"
            " factor. Notes refer to the exceptions and open differences at the end."
        )
        blocks.append(text)
        blocks.append(_figures(section.columns, with_assumptions))
    blocks += [_remark(remark) for remark in section.remarks]
    for erratum in section.errata:
        blocks += _erratum(erratum)
    for progress in section.progress:
        blocks += _progress(progress)
    if section.differences:
        blocks += _differences(section)
    if section.skipped:
        blocks.append(f"Left out: {section.skipped}.")
    for block in section.illegible:
        blocks.append(f"Not legible in the copy at hand: Table {block.table}, {block.what}.")
    return blocks


def _grid(head: Sequence[str], rows: Iterable[Sequence[str]], left: int) -> Grid:
    """Return a table with `left` left-aligned columns; the last one, too, unless it is a number."""
    right = [False] * left + [True] * (len(head) - left)
    right[-1] = head[-1] not in ("agrees", "note", "rests on")
    if head[-1] == "rests on":
        right[-2] = False
    return Grid(tuple(head), tuple(tuple(row) for row in rows), tuple(right))


def yes(agrees: bool) -> str:
    """Return yes, or NO, which is conspicuous."""
    return "yes" if agrees else "NO"


def _rank(deficiency: int | str) -> str:
    if deficiency == "some":
        return "deficient"
    return f"deficient by {deficiency}" if deficiency else "full rank"


def _resting(document: Document, section: Section) -> str:
    """Return keys of the assumptions of a section, then those of single quantities."""
    chosen = [
        assumption
        for assumption in document.statements.assumptions
        if assumption.key in section.rests_on
    ]
    general = [assumption for assumption in chosen if not assumption.quantities]
    special = [assumption for assumption in chosen if assumption.quantities]
    text = f"assumptions {', '.join(assumption.key for assumption in general)}"
    return "; ".join(
        [
            text,
            *(
                f"{' and '.join(assumption.quantities)} on {assumption.key}"
                for assumption in special
            ),
        ]
    )


def _factors(columns: Sequence[ComparedColumn]) -> Grid:
    rows = []
    for compared_column in columns:
        compared = [f for f in compared_column.figures if f.exception is None]
        deviation = max(abs(f.adjusted - 1.0) for f in compared)
        rows.append(
            (
                compared_column.column.table,
                compared_column.column.statistic,
                compared_column.column.case,
                f"{compared_column.factor:.3f}",
                str(len(compared)),
                f"{100 * deviation:.1f}",
                yes(compared_column.agrees),
            )
        )
    head = ("table", "statistic", "case", "factor", "values", "off by at most, %", "agrees")
    return _grid(head, rows, 3)


def _figures(columns: Sequence[ComparedColumn], with_assumptions: bool) -> Grid:
    rows = []
    for compared_column in columns:
        for figure in compared_column.figures:
            row = [
                compared_column.column.table,
                figure.quantity,
                compared_column.column.statistic,
                compared_column.column.case,
                number(1e6 * figure.published, 5),
                number(1e6 * figure.ours, 5),
                f"{figure.ratio:.3f}",
                f"{figure.adjusted:.3f}",
                _note(figure),
            ]
            rows.append(row + ([", ".join(figure.rests_on)] if with_assumptions else []))
    head = ["table", "", "statistic", "case", "published", "computed", "ratio", "/ factor", "note"]
    return _grid(head + (["rests on"] if with_assumptions else []), rows, 4)


def _note(figure: ComparedFigure) -> str:
    words = [] if figure.agrees else ["DIFFERS"]
    if figure.exception is not None:
        words.append(f"{'open' if figure.exception.open else 'see'} {figure.exception.key}")
    return ", ".join(words)


def _remark(compared: ComparedRemark) -> str:
    ratios = f"{number(compared.least, 3)} to {number(compared.largest, 3)}"
    if number(compared.least, 3) == number(compared.largest, 3):
        ratios = number(compared.least, 3)
    names = ", ".join(compared.remark.quantities)
    against = " over the repeatability" if _over_repeatability(compared.remark) else ""
    verdict = "agrees" if compared.agrees else "DIFFERS"
    of_averages = "" if compared.remark.quantities == (SUM_OF_SQUARES,) else "averages of "
    return (
        f"Said: {compared.remark.text}. Ratio of {of_averages}{names}{against}: {ratios},"
        f" {_wanted(compared.remark)}; {verdict}."
    )


def _over_repeatability(remark: Remark) -> bool:
    return all(reference == REPEATABILITY for _, reference in remark.pairs)


def _wanted(remark: Remark) -> str:
    words = []
    if remark.at_least is not None:
        words.append(f"at least {remark.at_least:g}")
    if remark.at_most is not None:
        words.append(f"at most {remark.at_most:g}")
    return "has to be " + " and ".join(words)


def _erratum(compared: ComparedErratum) -> list[Block]:
    verdict = "confirmed" if compared.agrees else "NOT confirmed"
    blocks: list[Block] = [
        f"Erratum in Table {compared.erratum.table}: {compared.erratum.text}; {verdict}."
    ]
    for statistic in compared.erratum.statistics:
        rows = []
        for line in compared.lines:
            if line.statistic != statistic:
                continue
            for words, design, ratios, deviation in (
                ("headed", line.headed, line.ratios_as_headed, line.deviation_as_headed),
                ("meant", line.meant, line.ratios_as_meant, line.deviation_as_meant),
            ):
                shown = (f"{ratios[symbol]:.3f}" if symbol in ratios else "-" for symbol in SYMBOLS)
                rows.append((words, design, *shown, f"{100 * deviation:.0f}"))
        blocks.append(_grid((statistic, "ratio to that of", *SYMBOLS, "off, %"), rows, 2))
    return blocks


def _progress(compared: ComparedProgress) -> list[Block]:
    progress = compared.progress
    text = f"Table {progress.table}, {case_of(progress.design)}: "
    if progress.settles is None:
        text += f"published with {len(progress.steps)} iterations"
    else:
        text += f"published as {'settling' if progress.settles else 'not settling'}"
        text += f" within {len(progress.steps)} iterations" if progress.steps else ""
    text += (
        f", computed: {'settles' if compared.settled else 'does not'}"
        f" ({compared.iterations} in all); {_verdict(compared)}."
    )
    if progress.reason:
        text += f" Values without a limit: {progress.reason}."
    rows = [
        (
            line.quantity,
            _figure(line.published),
            _figure(line.ours),
            _wanted_of(line),
            "-" if line.rule == "shown" else yes(line.agrees),
        )
        for line in compared.lines
    ]
    return [
        text,
        _grid(("iteration", "published", "computed", "limit", "agrees"), rows, 1),
    ]


def _figure(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.3e}"


def _verdict(compared: ComparedProgress) -> str:
    return "agrees" if compared.agrees else "DIFFERS"


def _wanted_of(line: ProgressLine) -> str:
    if line.rule == "shown":
        return "not compared"
    return (
        f"at most {line.limit:g} times"
        if line.rule == "most"
        else f"within a factor {line.limit:g}"
    )


def _differences(section: Section) -> list[Block]:
    blocks = []
    rows = []
    for compared in section.differences:
        if compared.comparison.failed:
            blocks.append(
                f"{compared.difference.design}: {len(compared.comparison.failed)} data sets"
                " did not converge."
            )
        rows += [
            (
                case_of(compared.difference.design),
                {"rms": "rms", "maximum": "largest"}[part.quantity],
                number(1e6 * part.published),
                *(number(1e6 * value, 3) for _, value in _quantiles(part)),
                f"{100 * part.below:.0f} %",
                yes(part.agrees),
            )
            for part in compared.parts
        ]
    first = section.differences[0].comparison
    text = (
        "Corrected distances by an estimator of distances alone, minus those by the full one, in"
        f" µm: the value of the published data set, and the quantiles of {first.trials} data sets."
        " The value must be in their range, and within a factor"
        f" {section.differences[0].limit:g} of their median."
    )
    quantiles = ("least", *(f"{100 * q:.0f} %" for q in QUANTILES[1:-1]), "largest")
    head = ("case", "", "published", *quantiles, "below", "agrees")
    return [*blocks, text, _grid(head, rows, 2)]


def _excepted(reproduction: Reproduction) -> list[tuple[Reservation, list[ComparedFigure]]]:
    """Return exceptions of the sections' values, open ones first, each with its values."""
    figures = [
        f for section in reproduction.sections for column in section.columns for f in column.figures
    ]
    pairs = [
        (exception, [f for f in figures if f.exception == exception])
        for exception in sorted(
            reproduction.document.statements.exceptions, key=lambda exception: not exception.open
        )
    ]
    return [(exception, under) for exception, under in pairs if under]


def _exception_blocks(reproduction: Reproduction) -> list[Block]:
    blocks: list[Block] = []
    excepted = _excepted(reproduction)
    for title, is_open in (("Open differences", True), ("Exceptions with a reason", False)):
        chosen = [(exception, under) for exception, under in excepted if exception.open == is_open]
        sides = reproduction.sides if is_open else ()
        if chosen or sides:
            blocks.append(Heading(2, title))
        blocks += [_side(side) for side in sides]
        for exception, under in chosen:
            ratios = [f.adjusted for f in under]
            many = number_of(len(under), "value")
            between = " to ".join(
                dict.fromkeys(f"{value:.3f}" for value in (min(ratios), max(ratios)))
            )
            blocks.append(
                f"{exception.key}: {' and '.join(exception.quantities)} in"
                f" {_tables(exception)}, {many}: after the common factor {between} times the"
                f" computed ones, limits {exception.within[0]:g} to {exception.within[1]:g}."
                f" {_sentence(exception.reason)}"
            )
    return blocks


def _side(side: Side) -> str:
    """Return a sentence on a one-sided quantity."""
    one_sided, count = side.stated, len(side.ratios)
    where = f"{'all ' if side.above == count else f'{side.above} of '}{number_of(count, 'column')}"
    return (
        f"The printed {one_sided.statistic} {one_sided.quantity} is above the computed one in"
        f" {where}: after the common factor by {min(side.ratios):.3f} to {max(side.ratios):.3f}."
        f" {_sentence(one_sided.reason)}"
    )


def _tables(reservation: Reservation) -> str:
    *earlier, last = reservation.tables
    return f"Tables {', '.join(earlier)} and {last}" if earlier else f"Table {last}"


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


def _summary(reproduction: Reproduction) -> list[Block]:
    def every(part: str) -> list[Any]:
        return [
            statement for section in reproduction.sections for statement in getattr(section, part)
        ]

    columns = every("columns")
    figures = [figure for column in columns for figure in column.figures]
    regular = [f for f in figures if f.exception is None]
    counted: dict[str, list[bool]] = {
        "values of tables within the common limit": [f.agrees for f in regular],
        "exceptions within their own": [f.agrees for f in figures if f.exception is not None],
        "common factors": [column.factor_agrees for column in columns],
        "statements on rank": [statement.agrees for statement in every("ranks")],
        "remarks": [statement.agrees for statement in every("remarks")],
        "errata confirmed": [statement.agrees for statement in every("errata")],
        "fits of exact readings": [statement.agrees for statement in every("progress")],
        "differences of estimators": [
            p.agrees for statement in every("differences") for p in statement.parts
        ],
    }
    parts = [(words, f"{sum(are)} of {len(are)}") for words, are in counted.items() if are]
    unexplained = sum(len(under) for exception, under in _excepted(reproduction) if exception.open)
    if unexplained:
        parts.append(("open differences, unexplained", f"{unexplained} values"))
    parts += [
        (
            f"{side.stated.statistic} {side.stated.quantity} above computed",
            f"{side.above} of {len(side.ratios)}",
        )
        for side in reproduction.sides
    ]
    text = (
        "Everything compared agrees within the stated limits."
        if reproduction.agrees
        else "NOT everything compared agrees."
    )
    blocks: list[Block] = [Heading(2, "Summary"), _grid(("", "agree"), parts, 1), text]
    if regular:
        deviations = np.array([abs(f.adjusted - 1.0) for f in regular])
        factors = [column.factor for column in columns]
        text = (
            f"After the common factors, {min(factors):.3f} to {max(factors):.3f}, values without an"
            f" exception are off by {100 * float(np.median(deviations)):.1f} % (median) and"
            f" {100 * deviations.max():.1f} % at most."
        )
        blocks.append(text)
    return blocks


def reproduction_data(reproduction: Reproduction) -> Data:
    """Return a reproduction as plain data in metres and radians; None if undetermined."""
    statements = reproduction.document.statements
    keys = {key for section in reproduction.sections for key in section.rests_on}
    data = {
        "document": statements.title,
        "agrees": reproduction.agrees,
        "limits": statements.limits.model_dump(),
        "assumptions": {
            assumption.key: assumption.text
            for assumption in statements.assumptions
            if assumption.key in keys
        },
        "exceptions": {
            exception.key: {
                **picked(exception, "reason", "open", "within"),
                "figures": len(under),
            }
            for exception, under in _excepted(reproduction)
        },
        "one_sided": [
            {
                **picked(side.stated, "quantity", "statistic", "reason"),
                **{"columns": len(side.ratios), "above": side.above},
                **{"least_ratio": min(side.ratios), "largest_ratio": max(side.ratios)},
            }
            for side in reproduction.sides
        ],
        "sections": [_section_data(section) for section in reproduction.sections],
    }
    return data


# In one piece: one mapping, in the form in which the JSON has it.
def _section_data(section: Section) -> Data:
    return {
        "section": section.name,
        **picked(section, "title", "agrees"),
        "rests_on": section.rests_on,
        "ranks": [
            picked(rank, "design", "published", "ours", "gap", "agrees") for rank in section.ranks
        ],
        "factors": [
            {
                **picked(column.column, "table", "design", "statistic"),
                **picked(column, "factor", "within"),
                "agrees": column.factor_agrees,
            }
            for column in section.columns
        ],
        "figures": [
            _figure_data(column, figure) for column in section.columns for figure in column.figures
        ],
        "remarks": [
            {
                **picked(remark.remark, "text", "quantities", "at_least", "at_most"),
                "least_ratio": remark.least,
                "largest_ratio": remark.largest,
                "agrees": remark.agrees,
            }
            for remark in section.remarks
        ],
        "errata": [
            {
                **picked(compared.erratum, "table", "text"),
                "confirmed": compared.agrees,
                "columns": compared.lines,
            }
            for compared in section.errata
        ],
        "convergence": [
            {
                **picked(compared.progress, "table", "design"),
                "published_settles": compared.progress.settles,
                "ours_settles": compared.settled,
                **picked(compared, "iterations", "agrees"),
                "figures": [
                    picked(line, "quantity", "published", "ours", "rule", "limit", "agrees")
                    for line in compared.lines
                ],
            }
            for compared in section.progress
        ],
        "differences": [
            {
                "design": difference.difference.design,
                "trials": difference.comparison.trials,
                "not_converged": difference.comparison.failed,
                **{part.quantity: _placed_data(part) for part in difference.parts},
                "agrees": difference.agrees,
            }
            for difference in section.differences
        ],
        "illegible": [picked(block, "table", "what") for block in section.illegible],
        "left_out": section.skipped or None,
    }


def _figure_data(column: ComparedColumn, figure: ComparedFigure) -> Data:
    return {
        **picked(column.column, "table", "statistic", "case", "design"),
        **picked(figure, "quantity", "unit", "published", "ours", "ratio", "within", "agrees"),
        "ratio_after_factor": figure.adjusted,
        "exception": figure.exception.key if figure.exception else None,
        "rests_on": figure.rests_on,
    }


def _placed_data(part: PlacedFigure) -> Data:
    return {
        **picked(part, "published", "median", "agrees"),
        "quantiles": {str(q): v for q, v in _quantiles(part)},
        "share_below_published": part.below,
    }


def _quantiles(part: PlacedFigure) -> Iterator[tuple[float, float]]:
    """Return some shares with the quantiles of the values."""
    return zip(QUANTILES, np.quantile(part.values, QUANTILES), strict=True)
