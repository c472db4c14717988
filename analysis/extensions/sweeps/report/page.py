"""A sweep's results as one page that needs no network, script or further file."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from importlib import resources
from itertools import groupby
from pathlib import PurePosixPath
from typing import Any

import numpy as np
from ballplate.extensions.pages.document import style
from ballplate.presentation import (
    MOST_BALLS,
    Block,
    Entry,
    Row,
    Scene,
    Table,
    micro,
    number,
    percent,
    scene,
    uncertainty_words,
)
from ballplate.simulator.computing import Report, counted, unreported
from ballplate.simulator.experiment import Experiment, lay_out
from ballplate.simulator.inputs import in_one_line, listing
from ballplate.uncertainty import DESCRIPTIONS

from ..error_map_uncertainty import error_map
from ..store import Store
from ..store_columns import symbol_column
from .answer import answer
from .cells import NoExperimentError, experiments
from .design_pictures import probes_svg, scene_svg, slice_svg, slice_words
from .heatmaps import heat_maps
from .plots import plot_svg
from .results import ReportedSweep, best_and_worst, cell_list, criterion
from .series import Plot, plots
from .store_comparison import StoreComparison
from .tables import report_tables
from .verdicts import failures, flags, ranks, weak

# Values of an axis in the list of facts.
LISTED = 12

# Temporary sweep file of the studio.
MADE_IN_STUDIO = ".ballplate-sweep.yaml"


@dataclass(frozen=True)
class Drawing:
    """A picture with its caption."""

    svg: str
    caption: str


@dataclass(frozen=True)
class DrawnDesign:
    """A cell's design: the picture, its probes, and the positions as a table."""

    cell: int
    heading: str
    scene: str
    probes: str
    caption: str
    positions: Table


@dataclass(frozen=True)
class DrawnMap:
    """The error map's uncertainty in slices."""

    words: str
    figures: tuple[Drawing, ...]


def page(
    store: Store,
    results: ReportedSweep,
    run_modules: bool = False,
    report: Report = unreported,
    comparison: StoreComparison | None = None,
) -> str:
    """Return the page of a sweep.

    Experiments with code in Python are drawn only with `run_modules`; `report` receives progress.

    :raises ImportError: jinja2 or matplotlib is not installed.
    """
    from jinja2 import Environment, StrictUndefined

    environment = Environment(
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters.update(micro=micro, full=repr)
    package = resources.files(__package__)
    template = environment.from_string(
        package.joinpath("template.html").read_text(encoding="utf-8")
    )
    drawn = plots(results)
    context: dict[str, Any] = {
        "title": in_one_line(results.title),
        "summary": _summary(results),
        "style": style(),
        "facts": _facts(results),
        "answer": answer(results),
        "comparison": comparison,
        "failures": failures(results),
        "tables": report_tables(results),
        "plots": _plots(drawn, (criterion(results) or ("", ""))[1], report),
        "has_trials": any(len(line.actual) for plot in drawn for line in plot.panels[0].lines),
        "heats": heat_maps(results),
        "ranks": ranks(results),
        "weak": weak(results),
        "flags": flags(results),
        **_designs(store, results, run_modules, report),
    }
    context["sections"] = _sections(context)
    return re.sub(r"\n{2,}", "\n", template.render(context)).lstrip() + "\n"


def _sections(context: dict[str, Any]) -> list[tuple[str, str]]:
    sections = [
        ("answer", "Answer", context["answer"]),
        ("comparison", "Compared with another sweep", context["comparison"]),
        ("swept", "What was swept", True),
        ("plots", "Along the axes", context["plots"]),
        ("heat", "Over two axes", context["heats"]),
        ("uncertainties", "Uncertainties", context["tables"]),
        ("failed", "Failed cells", context["failures"].shown),
        ("rank", "What the readings determine", context["ranks"].shown),
        ("designs", "Designs", context["designs"] or context["no_designs"]),
        ("error-map", "The error map's uncertainty", context["error_map"]),
    ]
    return [(name, words) for name, words, is_there in sections if is_there]


def _summary(results: ReportedSweep) -> str:
    parts = [f"{results.count('done')} of {len(results.cells)} cells done"]
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
    return "Sweep file", in_one_line(path)


def _facts(results: ReportedSweep) -> list[tuple[str, str]]:
    stored = results.definition
    base = stored["experiment"].get("title", "") if isinstance(stored["experiment"], dict) else ""
    facts = [
        _source(stored["source"]),
        ("Experiment", in_one_line(stored["base"]) + (f": {in_one_line(base)}" if base else "")),
    ]
    for axis in results.axes:
        labels = list(axis.labels)
        if len(labels) > LISTED:
            labels = [*labels[: LISTED - 1], f"… {labels[-1]} ({len(labels)} values)"]
        facts.append((f"Axis {axis.name}", ", ".join(labels)))
    cells = f"{len(results.cells)}: {results.count('done')} done, "
    cells += f"{results.count('failed')} failed, {results.left} left"
    if results.found.damaged:
        damaged = sorted(results.found.damaged)
        reason = in_one_line(results.found.damaged[damaged[0]])
        cells += f", {len(damaged)} unreadable: {cell_list(damaged)} ({reason})"
    facts += [
        ("Cells", cells),
        ("Recorded", ", ".join(stored["record"])),
        (
            "Monte Carlo",
            f"{stored['trials']} data sets of each cell" if stored["trials"] else "none",
        ),
    ]
    facts += [("Seed", str(stored["seed"]))] if stored["trials"] else []
    names = [name for name in results.frame.columns if name.endswith("_version")]
    counts = Counter(zip(*(results.frame[name].tolist() for name in names), strict=True))
    for versions, count in counts.items():
        words = ", ".join(
            f"{name.removesuffix('_version')} {version}"
            for name, version in zip(names, versions, strict=True)
        )
        facts.append(("Computed with", words if len(counts) == 1 else f"{words} ({count} cells)"))
    return facts


def _plots(
    drawn: list[Plot], judged: str, report: Report
) -> list[tuple[str, list[Drawing], list[Drawing]]]:
    """Return plots against each axis: of the quantity that cells are judged by, and of others."""
    plots_by_axis = []
    count = 0
    for axis, axis_plots in groupby(
        counted(drawn, "plots", len(drawn), report), lambda plot: plot.axis.name
    ):
        figures: tuple[list[Drawing], list[Drawing]] = [], []
        for plot in axis_plots:
            count += 1
            caption = f"{plot.symbol}, {DESCRIPTIONS[plot.symbol]}, against {plot.axis.name}."
            picture = plot_svg(plot, f"plot{count}")
            of_others = symbol_column(plot.symbol) != judged
            figures[of_others].append(Drawing(picture, f"{caption} {plot.note}".strip()))
        plots_by_axis.append((axis, *figures))
    return plots_by_axis


def _designs(
    store: Store, results: ReportedSweep, run_modules: bool, report: Report
) -> dict[str, Any]:
    """Return the best and the worst cell's design, and the best one's error map."""
    empty: dict[str, Any] = {"designs": [], "no_designs": "", "error_map": None}
    cells, judged = best_and_worst(results), criterion(results)
    if not cells or judged is None:
        return empty
    try:
        built = experiments(store, results, cells, run_modules)
    except NoExperimentError as error:
        return {**empty, "no_designs": str(error)}
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
        heading = f"{which} average of {symbol}{text}: cell {cell}, {results.label(cell)}"
        designs.append(_drawn_design(experiment, cell, heading, k))
    return {**empty, "designs": designs, "error_map": _drawn_map(built[0], results, cells[0])}


def _drawn_design(experiment: Experiment, cell: int, heading: str, k: int) -> DrawnDesign:
    design = lay_out(experiment)
    drawn = scene(design)
    sizes = " x ".join(f"{1000 * size:.6g}" for size in design.machine.volume.size)
    words = f"Volume of {sizes} mm with {len(drawn.places)} positions, which the table below lists."
    caption = (
        "Positions in the volume: balls that are read (circles), and from one ball the styli to the"
        " machine's reference point (squares)."
    )
    if not drawn.is_named:
        caption += " Positions are numbered as in the table."
    if any(place.read > MOST_BALLS for place in drawn.places):
        caption += " Only some of the balls are drawn."
    has_offsets = any(tip.any() for _, tip in drawn.tips)
    probes = (
        probes_svg(drawn, f"probes{k}", f"Tips of the probes {listing(experiment.probes)}")
        if has_offsets
        else ""
    )
    return DrawnDesign(
        cell,
        heading,
        scene_svg(drawn, f"scene{k}", words),
        probes,
        caption,
        _positions(drawn, cell),
    )


def _positions(drawn: Scene, cell: int) -> Table:
    rows = [
        Row(
            (str(place.number), place.name, place.artefact, ", ".join(place.probes)),
            (Entry(str(place.read)),),
        )
        for place in sorted(drawn.places, key=lambda place: place.number)
    ]
    headings = ("number", "position", "artefact", "probes")
    caption = f"Positions of cell {cell}"
    return Table(f"positions-{cell}", caption, headings, ("balls read",), (Block("", tuple(rows)),))


def _drawn_map(experiment: Experiment, results: ReportedSweep, cell: int) -> DrawnMap:
    drawn = error_map(experiment)
    words = (
        f"Standard uncertainty of the error function of cell {cell} ({results.label(cell)}), as the"
        " root mean square over the co-ordinates of a point, with the probe"
        f" {experiment.evaluation.probe}, in µm."
    )
    if any(np.isnan(level_slice.values).any() for level_slice in drawn.slices):
        words += " Hatched regions are undetermined."
    if drawn.within is not None:
        words += (
            f" Of the distances between all points of this grid {percent(drawn.within)} are known"
            " to within the target uncertainty, by the"
            f" {uncertainty_words(experiment.coverage_factor)}."
        )
    figures = []
    for k, level_slice in enumerate(drawn.slices):
        slice_text = slice_words(level_slice)
        caption = slice_text[0].upper() + slice_text[1:] + "."
        figures.append(
            Drawing(
                slice_svg(
                    drawn, level_slice, f"slice{k}", f"Map of standard uncertainties, {slice_text}"
                ),
                caption,
            )
        )
    return DrawnMap(words, tuple(figures))
