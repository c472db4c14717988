"""A sweep's results as one page that needs no network, script or further file."""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby
from pathlib import PurePosixPath

import numpy as np
from ballplate.extensions.pages.charts import figure, figures
from ballplate.extensions.pages.design_views import volume_view
from ballplate.extensions.pages.document import Page, PageSection, facts_list, written
from ballplate.extensions.pages.elements import Html, element, folded, joined, note, sentence
from ballplate.extensions.pages.level_maps import MapPoint, even_bounds, level_legend, level_map
from ballplate.extensions.pages.spatial import still_figure
from ballplate.presentation import (
    MOST_BALLS,
    Block,
    Entry,
    Row,
    Table,
    micro,
    number,
    percent,
    uncertainty_words,
)
from ballplate.simulator.computing import Report, counted, unreported
from ballplate.simulator.design import Design
from ballplate.simulator.experiment import Experiment, lay_out

from ..error_map_uncertainty import error_map
from ..store import Store
from .answer import answer
from .cells import NoExperimentError, experiments
from .heatmaps import heat_maps
from .page_elements import groups_element, heat_element, table_element
from .plots import plot_figure
from .results import ReportedSweep, best_and_worst, cell_list, criterion
from .series import plots
from .store_comparison import StoreComparison
from .tables import report_tables
from .verdicts import failures, flags, ranks, weak

# Limits: values of an axis in the list of facts, positions that are shown unfolded.
LISTED, MOST_POSITIONS = 12, 8

# Temporary sweep file of the studio.
MADE_IN_STUDIO = ".ballplate-sweep.yaml"

FOOT = (
    "Lengths in micrometres and angles in microradians, standard uncertainties throughout. The"
    " places of the tables have the figures at full precision, in metres and radians, as"
    " data-value; ballplate sweep --export writes all of them."
)


def page(
    store: Store,
    results: ReportedSweep,
    run_modules: bool = False,
    report: Report = unreported,
    comparison: StoreComparison | None = None,
) -> str:
    """Return the page of a sweep.

    Experiments with code in Python are drawn only with `run_modules`; `report` receives progress.
    """
    along_axes = _plots(results, report)
    designs, drawn_map = _designs(store, results, run_modules, report)
    heats = [heat_element(heat, k) for k, heat in enumerate(heat_maps(results), start=1)]
    tables = [folded(table.caption, table_element(table)) for table in report_tables(results)]
    sections = [
        PageSection("answer", "Answer", _answer(results)),
        PageSection("comparison", "Compared with another sweep", _comparison(comparison)),
        PageSection("swept", "What was swept", facts_list(_facts(results))),
        PageSection("plots", "Along the axes", along_axes),
        PageSection("heat", "Over two axes", joined(heats)),
        PageSection("uncertainties", "Uncertainties", joined(tables)),
        PageSection("failed", "Failed cases", groups_element(failures(results))),
        PageSection("rank", "What the readings determine", _ranks(results)),
        PageSection("designs", "Designs", designs),
        PageSection("error-map", "The error map's uncertainty", drawn_map),
    ]
    return written(Page(results.title, sentence(_summary(results)), sections, FOOT))


def _answer(results: ReportedSweep) -> Html:
    found = answer(results)
    if found is None:
        return Html()
    kind = "verdict" if found.is_good else "verdict bad"
    parts = [element("p", found.sentences[0], class_=kind), *map(sentence, found.sentences[1:])]
    if found.worth:
        effects = [element("li", micro(str(worth))) for worth in found.worth]
        parts += [
            element("h3", "Effect of each axis"),
            sentence(f"The average of {found.symbol}, while all other axes stay:"),
            element("ul", *effects),
        ]
    return joined([*parts, table_element(found.settings)])


def _comparison(comparison: StoreComparison | None) -> Html:
    if comparison is None:
        return Html()
    settings = table_element(comparison.settings) if comparison.settings else ""
    return joined([*map(sentence, comparison.sentences), settings])


def _ranks(results: ReportedSweep) -> Html:
    """Return cells by rank and, below them, weak directions and differences of Monte Carlo."""
    of_rank, of_weak, of_trials = (
        groups_element(groups(results)) for groups in (ranks, weak, flags)
    )
    if not of_rank:
        return Html()
    parts = [element("h3", "Rank"), of_rank]
    if of_weak:
        parts += [element("h3", "Weakly determined"), of_weak]
    if of_trials:
        words = (
            "Differences from linear theory of more than four standard errors, and cases without"
            " Monte Carlo."
        )
        parts += [element("h3", "Monte Carlo"), note(words), of_trials]
    return joined(parts)


def _summary(results: ReportedSweep) -> str:
    parts = [f"{results.count('done')} of {len(results.cells)} cases done"]
    parts += [f"{results.count('failed')} failed"] if results.count("failed") else []
    parts += [f"{results.left} left"] if results.left else []
    unreadable = len(results.found.damaged)
    parts += [f"{unreadable} unreadable in the damaged store"] if unreadable else []
    return ", ".join(parts) + "."


def _source(path: str) -> tuple[str, str]:
    """Return the source of a sweep, from the path of its file in the store.

    >>> _source("plates/sizes.yaml"), _source("plates/.ballplate-sweep.yaml")
    (('Sweep file', 'plates/sizes.yaml'), ('Sweep', 'made in the studio'))
    """
    # Readers cannot look up a temporary file.
    if PurePosixPath(path).name == MADE_IN_STUDIO:
        return "Sweep", "made in the studio"
    return "Sweep file", path


def _facts(results: ReportedSweep) -> list[tuple[str, str]]:
    stored = results.definition
    base = stored["experiment"].get("title", "") if isinstance(stored["experiment"], dict) else ""
    facts = [
        _source(stored["source"]),
        ("Experiment", f"{stored['base']}: {base}" if base else stored["base"]),
    ]
    for axis in results.axes:
        labels = list(axis.labels)
        if len(labels) > LISTED:
            labels = [*labels[: LISTED - 1], f"… {labels[-1]} ({len(labels)} values)"]
        facts.append((f"Axis {axis.name}", ", ".join(labels)))
    if results.found.damaged:
        damaged = sorted(results.found.damaged)
        reason = results.found.damaged[damaged[0]]
        facts.append(("Unreadable cases", f"{cell_list(damaged)} ({reason})"))
    facts += [
        ("Recorded", ", ".join(stored["record"])),
        (
            "Monte Carlo",
            f"{stored['trials']} data sets of each case" if stored["trials"] else "none",
        ),
    ]
    facts += [("Seed", str(stored["seed"]))] if stored["trials"] else []
    names = [name for name in results.frame.columns if name.endswith("_version")]
    for name in names:
        versions = sorted(set(map(str, results.frame[name])))
        facts.append((f"Computed with {name.removesuffix('_version')}", ", ".join(versions)))
    return facts


def _plots(results: ReportedSweep, report: Report) -> Html:
    """Return plots against each axis, folded unless of the quantity that cells are judged by."""
    drawn = plots(results)
    judged = (criterion(results) or ("", ""))[0]
    parts = []
    for axis, axis_plots in groupby(
        counted(drawn, "plots", len(drawn), report), lambda plot: plot.axis.name
    ):
        of_judged: list[Html] = []
        of_others: list[Html] = []
        for plot in axis_plots:
            pictures = of_judged if plot.measure.figure == judged else of_others
            pictures.append(plot_figure(plot))
        parts += [element("h3", f"Against {axis}"), figures(*of_judged)]
        if of_others:
            summary = f"Other quantities against {axis}"
            parts.append(folded(summary, figures(*of_others), is_lengthy=len(of_others) > 4))
    return joined(parts)


def _designs(
    store: Store, results: ReportedSweep, run_modules: bool, report: Report
) -> tuple[Html, Html]:
    """Return the best and the worst cell's design, and the best one's error map."""
    cells, judged = best_and_worst(results), criterion(results)
    if not cells or judged is None:
        return Html(), Html()
    try:
        built = experiments(store, results, cells, run_modules)
    except NoExperimentError as error:
        return sentence(f"The designs cannot be drawn: {error}."), Html()
    symbol = judged[1].replace("_", " ")
    designs = []
    for k, (cell, experiment) in enumerate(
        counted(zip(cells, built, strict=True), "designs", len(cells), report)
    ):
        which = ("Smallest", "Largest")[k] if len(cells) > 1 else "The only"
        row = int(np.flatnonzero(results.frame["cell"] == cell)[0])
        value = results.value(judged[0], row)
        open_ = results.value(f"{judged[1]}_undetermined", row)
        text = f", {number(1e6 * value, 3)} µm" if not np.isnan(value) else ""
        text += f", {open_:.0f} undetermined" if open_ else ""
        heading = f"{which} average of {symbol}{text}: case {cell}, {results.label(cell)}"
        designs += [element("h3", heading), _drawn_design(experiment, cell)]
    return joined(designs), _drawn_map(built[0], results, cells[0])


def _drawn_design(experiment: Experiment, cell: int) -> Html:
    """Return the picture of a cell's design, and the positions as a table."""
    design = lay_out(experiment)
    caption = (
        "Positions in the volume by name, or by number as in the list: balls that are read, at"
        f" most {MOST_BALLS} of each, and from one ball the styli to the machine's reference point."
    )
    picture = still_figure(replace(volume_view(design), caption=caption))
    table = _positions(design, cell)
    listed = table_element(table)
    is_open = table.size <= MOST_POSITIONS
    return joined([figures(picture), folded("List of positions", listed, is_open=is_open)])


def _positions(design: Design, cell: int) -> Table:
    rows: list[Row] = []
    readings = design.readings
    for k, name in enumerate(design.positions.names):
        mine = readings.position == k
        if not mine.any():
            continue
        artefact = design.artefacts.names[design.positions.artefact[k]]
        probes = ", ".join(design.probes.names[probe] for probe in np.unique(readings.probe[mine]))
        count = len(np.unique(readings.ball[mine]))
        rows.append(Row((str(len(rows) + 1), name, artefact, probes), (Entry(str(count)),)))
    headings = ("number", "position", "artefact", "probes")
    caption = f"Positions of case {cell}"
    return Table(f"positions-{cell}", caption, headings, ("balls read",), (Block("", tuple(rows)),))


def _drawn_map(experiment: Experiment, results: ReportedSweep, cell: int) -> Html:
    """Return the error map's uncertainty in slices."""
    drawn = error_map(experiment)
    words = (
        f"Standard uncertainty of the error function of case {cell} ({results.label(cell)}), as"
        " the root mean square over the co-ordinates of a point, with the probe"
        f" {experiment.evaluation.probe}, in µm."
    )
    if any(np.isnan(level_slice.values).any() for level_slice in drawn.slices):
        words += " It is undetermined at points with –."
    if drawn.within is not None:
        words += (
            f" Of the distances between all points of this grid {percent(drawn.within)} are known"
            " to within the target uncertainty, by the"
            f" {uncertainty_words(experiment.coverage_factor)}."
        )
    values = np.stack([1e6 * level_slice.values for level_slice in drawn.slices])[:, ::4, ::4]
    known = values[np.isfinite(values)]
    bounds = even_bounds(float(known.min()), float(known.max())) if len(known) else (0.0,)
    pictures = []
    for level_slice, of_level in zip(drawn.slices, values, strict=True):
        level = "" if level_slice.level is None else f", z = {1e3 * level_slice.level + 0.0:.6g} mm"
        label = f"Map of standard uncertainties in µm{level}"
        points = [
            MapPoint(x, y, value if np.isfinite(value) else None)
            for y, row in zip(drawn.y[::4].tolist(), of_level.tolist(), strict=True)
            for x, value in zip(drawn.x[::4].tolist(), row, strict=True)
        ]
        pictures.append(figure(f"{label}.", level_map(points, bounds, label)))
    return joined(
        [
            sentence(words),
            figures(*pictures),
            level_legend(bounds, lambda bound: f"{bound:.3g} µm"),
        ]
    )
