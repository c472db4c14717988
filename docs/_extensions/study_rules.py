"""Numbers and pictures of the rules for planners, from the tables in `designs/study/tables`.

A page says `{{name}}` where a number of `NUMBERS` is to stand, and shows a picture of `PICTURES` by
a `{study} NAME` with `:alt:` and its text below. Numbers are the range over the machines.
"""

from __future__ import annotations

import base64
import html
import re
import tempfile
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from ballplate.presentation.svg import (
    MARKERS,
    MUTED,
    SERIES,
    common_legend,
    drawing,
    placed_axes,
    save,
)
from ballplate.simulator.inputs import parse_length
from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxDirective

STUDY = Path(__file__).resolve().parents[2] / "designs" / "study"
MACHINES = ("small", "bridge", "cube", "long", "gantry")
PLACEHOLDER = re.compile(r"\{\{(\w+)\}\}")

AVERAGE, DEFICIENCY = "U6_average_um", "rank_deficiency"
Values = pd.Series  # by machine


@cache
def table(name: str) -> pd.DataFrame:
    """The table of a sweep."""
    return pd.read_csv(STUDY / "tables" / f"{name}.csv")


def rows(name: str, **where: object) -> pd.DataFrame:
    """The rows of a table with these values; lengths are compared to a millionth."""
    found = table(name)
    for column, value in where.items():
        column = column.replace("_limit", " limit")
        kept = (
            np.isclose(found[column], value, rtol=1e-6, atol=0.0)
            if isinstance(value, float)
            else found[column] == value
        )
        found = found[kept]
    return found


def values(name: str, column: str = AVERAGE, **where: object) -> Values:
    """A column of the rows with these values, by machine."""
    found = rows(name, **where).set_index("machine")[column]
    if not found.index.is_unique or not len(found):
        raise ExtensionError(f"{name}: not one row for a machine at {where}")
    return found.reindex([machine for machine in MACHINES if machine in found.index])


def ranged(some: Iterable[float], form: str) -> str:
    """The smallest and the largest of some values, as text; one of them if they look alike."""
    ends = [format(end, form) for end in (min(some), max(some))]
    return " to ".join(dict.fromkeys(ends))


def times(some: Values) -> str:
    """Ratios."""
    return ranged(some, ".2f")


def less(some: Values) -> str:
    """What ratios are below 1, in percent."""
    return ranged(100 * (1 - some), ".0f")


def more(some: Values) -> str:
    """What ratios are above 1, in percent."""
    return ranged(100 * (some - 1), ".0f")


def planned(count: int, column: str = AVERAGE) -> Values:
    return values("positions", column, positions_limit=count)


def recipe(name: str) -> Values:
    return values("recipes", recipe=name)


def gain(first: int, last: int) -> str:
    """Percent that a planned number of positions is better than another."""
    return less(planned(last) / planned(first))


def hours_more(first: int, last: int) -> str:
    return ranged(planned(last, "hours") - planned(first, "hours"), ".1f")


def hourly(first: int, last: int) -> Values:
    """Percent of U6 that each hour between two numbers of positions saves."""
    hours = planned(last, "hours") - planned(first, "hours")
    return 100 * (1 - (planned(last) / planned(first)) ** (1 / hours))


def assumed(first: str, second: str) -> pd.Series:
    """Ratios of U6 of two recipes under all assumptions, on all machines."""
    kept = ["machine", "repeatability_m", "certificate_m", "common", "offsets_m"]
    by = [rows("sensitivity", recipe=one).set_index(kept)[AVERAGE] for one in (first, second)]
    return by[0] / by[1]


def by_repeatability(first: str, second: str, repeatability: float) -> Values:
    ratios = assumed(first, second).reset_index()
    where = np.isclose(ratios["repeatability_m"], repeatability, rtol=1e-6)
    return ratios[where].set_index("machine")[AVERAGE]


def influence(**changed: float) -> Values:
    """U6 of nine positions with changed assumptions, relative to the middle of all."""
    middle = {"repeatability_m": 4e-7, "certificate_m": 2e-7, "common": 2.5e-7, "offsets_m": 5e-7}
    there = {"recipe": "nine shifted"}
    return values("sensitivity", **there, **(middle | changed)) / values(
        "sensitivity", **there, **middle
    )


def doubled() -> Values:
    """U6 of a plate relative to that of one half as long, in six hours."""
    by = table("size").sort_values("size_m").groupby("machine")[AVERAGE]
    return by.last() / by.first()


def elasticity(is_largest: bool) -> Values:
    """Percent that U6 falls as the plate becomes one percent longer, between the two smallest or
    largest plates; in nine positions that repeat to 0.8 um.
    """
    found = {}
    for machine in MACHINES:
        some = rows("size-nine", machine=machine, repeatability_m=8e-7)
        size = some.set_index("size_m")[AVERAGE].sort_index()
        two = size.iloc[-2:] if is_largest else size.iloc[:2]
        found[machine] = -np.diff(np.log(two))[0] / np.diff(np.log(two.index))[0]
    return pd.Series(found)


def ends_of_size(repeatability: float) -> Values:
    """U6 of the smallest plate relative to that of the largest, in nine positions."""
    found = rows("size-nine", repeatability_m=repeatability).sort_values("size_m")
    by = found.groupby("machine")[AVERAGE]
    return by.first() / by.last()


def balls(count: int, positions: str = "nine", repeats: int = 1, column: str = AVERAGE) -> Values:
    name = f"{positions} shifted, {repeats} times"
    return values("balls", column, recipe=name, balls=count)


def compared(count: int, positions: str, repeats: int) -> Values:
    """U6 of so many balls along a side, positions and repeats, relative to five balls in nine
    positions read once.
    """
    return balls(count, positions, repeats) / balls(5)


def hours_of(count: int, positions: str, repeats: int) -> str:
    return ranged(balls(count, positions, repeats, "hours"), ".1f")


def certificate(pairs: str, quality: str = "as drafted") -> Values:
    return values("certificate", pairs=pairs, certificate=quality)


def bar(certified: str, longest: bool = True) -> Values:
    found = rows("bar", certified=certified)
    lengths = found["length"].str.split().str[0].astype(int)
    order = found.assign(length=lengths).sort_values("length").groupby("machine")[AVERAGE]
    return order.last() if longest else order.first()


def tips(name: str, column: str = AVERAGE) -> Values:
    return values("tips", column, tips=name)


STAR = "star, two tips of a plane"


def known(offsets: float) -> Values:
    return values("tips-known", offsets_m=offsets) / values("tips-known", offsets_m=5e-7)


def stylus(length: str) -> Values:
    usual = values("tips-length", length="60 mm")
    return (values("tips-length", length=length) / usual).dropna()


def thermometers(name: str) -> Values:
    exact = values("temperature", thermometers="0 K both")
    return values("temperature", thermometers=name) / exact


def coefficients(count: int, name: str) -> Values:
    """U6 with a number of coefficients, relative to four, in the positions of a recipe."""
    found = [values("coefficients", coefficients=some, recipe=name) for some in (count, 4)]
    return found[0] / found[1]


def shares(name: str) -> Values:
    return values("planes", shares=name) / values("planes", shares="3 x, 3 y, 3 z")


def uneven() -> pd.Series:
    """Nine positions of which five are across one axis, relative to three across each."""
    return pd.concat([shares(name) for name in ("5 x, 2 y, 2 z", "2 x, 5 y, 2 z", "2 x, 2 y, 5 z")])


def losses(name: str, whole: str) -> pd.Series:
    """U6 without each of the positions, relative to that with all."""
    found = table(name)
    rest = found[found["read"] != whole].set_index("machine")[AVERAGE]
    return rest / values(name, read=whole).reindex(rest.index)


def of_plate(design: str, other: str = "nine as drafted", is_small: bool = True) -> Values:
    """U6 of a design relative to another, with the smallest or the largest plate of each machine:
    35 or 65 % of the shortest edge.
    """
    sizes = table("plates").groupby("machine")["size_m"]
    chosen = sizes.transform("min" if is_small else "max") == table("plates")["size_m"]
    by = table("plates")[chosen].pivot(index="machine", columns="design", values=AVERAGE)
    return by[design] / by[other]


COMMON, OTHER = (f"nine with two fifths of the {part} part" for part in ("common", "other"))
OPPOSITE = ("six in opposite corners", "six as drafted")

NUMBERS: dict[str, Callable[[], str]] = {
    "corners_six": lambda: times(recipe("six in opposite corners") / planned(6)),
    "corners_twelve": lambda: times(recipe("twelve in corners") / planned(12)),
    "centred_six": lambda: times(recipe("six centred") / planned(6)),
    "diagonal_nine": lambda: times(recipe("nine along diagonals") / planned(9)),
    "shifted_six": lambda: times(recipe("six shifted") / planned(6)),
    "shifted_nine": lambda: times(recipe("nine shifted") / planned(9)),
    "shifted_twelve": lambda: times(recipe("twelve shifted") / planned(12)),
    "drafted_six": lambda: times(recipe("six as drafted") / planned(6)),
    "drafted_nine": lambda: times(recipe("nine as drafted") / planned(9)),
    "drafted_twelve": lambda: times(recipe("twelve as drafted") / planned(12)),
    "corners_assumed": lambda: times(assumed("six in opposite corners", "six shifted")),
    "four_positions": lambda: times(planned(4) / planned(6)),
    "gain_six": lambda: gain(6, 9),
    "gain_nine": lambda: gain(9, 12),
    "gain_twelve": lambda: gain(12, 15),
    "hours_nine": lambda: ranged(planned(9, "hours"), ".1f"),
    "hours_twelve": lambda: ranged(planned(12, "hours"), ".1f"),
    "hourly_six": lambda: ranged(hourly(6, 9), ".0f"),
    "hourly_nine": lambda: ranged(hourly(9, 12), ".0f"),
    "hourly_twelve": lambda: ranged(hourly(12, 15), ".0f"),
    "gap_six": lambda: more(planned(6) / planned(6, "bound_um")),
    "gap_twelve": lambda: more(planned(12) / planned(12, "bound_um")),
    "more_precise": lambda: less(by_repeatability("twelve shifted", "nine shifted", 2e-7)),
    "less_precise": lambda: less(by_repeatability("twelve shifted", "nine shifted", 8e-7)),
    "open_without_x": lambda: ranged(values("planes", DEFICIENCY, shares="none across x"), ".0f"),
    "open_without_y": lambda: ranged(values("planes", DEFICIENCY, shares="none across y"), ".0f"),
    "without_z": lambda: times(shares("none across z")),
    "uneven": lambda: times(uneven()),
    "doubled": lambda: times(doubled()),
    "size_small": lambda: ranged(elasticity(False), ".1f"),
    "size_large": lambda: ranged(elasticity(True), ".1f"),
    "size_precise": lambda: ranged(ends_of_size(2e-7), ".1f"),
    "size_noisy": lambda: ranged(ends_of_size(8e-7), ".1f"),
    "balls_seven": lambda: times(compared(7, "nine", 1)),
    "three_thrice": lambda: times(compared(3, "nine", 3)),
    "three_twelve": lambda: times(compared(3, "twelve", 1)),
    "five_six_thrice": lambda: times(compared(5, "six", 3)),
    "hours_five": lambda: hours_of(5, "nine", 1),
    "hours_seven": lambda: hours_of(7, "nine", 1),
    "hours_three_thrice": lambda: hours_of(3, "nine", 3),
    "hours_three_twelve": lambda: hours_of(3, "twelve", 1),
    "hours_five_six_thrice": lambda: hours_of(5, "six", 3),
    "hours_twice": lambda: hours_of(5, "nine", 2),
    "hours_twelve_once": lambda: hours_of(5, "twelve", 1),
    "twice": lambda: less(compared(5, "nine", 2)),
    "twelve_once": lambda: less(compared(5, "twelve", 1)),
    "twice_precise": lambda: less(
        by_repeatability("nine shifted, read twice", "nine shifted", 2e-7)
    ),
    "twice_noisy": lambda: less(by_repeatability("nine shifted, read twice", "nine shifted", 8e-7)),
    "sides": lambda: more(certificate("corner sides") / certificate("corners")),
    "diagonals": lambda: times(certificate("corner diagonals") / certificate("corner sides")),
    "all_distances": lambda: less(certificate("all") / certificate("corners")),
    "half_certificate": lambda: less(certificate("corners", "half") / certificate("corners")),
    "double_certificate": lambda: more(certificate("corners", "double") / certificate("corners")),
    "corners_third": lambda: times(of_plate(*OPPOSITE)),
    "corners_wide": lambda: times(of_plate(*OPPOSITE, is_small=False)),
    "twice_third": lambda: less(of_plate("nine read twice")),
    "twelve_third": lambda: less(of_plate("twelve as drafted")),
    "kelvin_third": lambda: times(of_plate("nine at 0.1 K")),
    "six_third": lambda: times(of_plate("nine with six coefficients")),
    "common_third": lambda: less(of_plate(COMMON)),
    "other_third": lambda: less(of_plate(OTHER)),
    "common_wide": lambda: less(of_plate(COMMON, is_small=False)),
    "other_wide": lambda: less(of_plate(OTHER, is_small=False)),
    "gain_third": lambda: less(of_plate("nine as drafted", "six as drafted")),
    "bar_alone": lambda: times(bar("bar") / bar("plate")),
    "short_bar_alone": lambda: times(bar("bar", False) / bar("plate", False)),
    "bar_besides": lambda: less(bar("plate and bar") / bar("plate")),
    "one_tip": lambda: times(tips("one tip") / tips(STAR)),
    "two_tips": lambda: times(tips("two tips, both everywhere") / tips(STAR)),
    "three_tips": lambda: times(tips("three tips, two for upright plates") / tips(STAR)),
    "one_for_position": lambda: times(tips("star, one tip for a position") / tips(STAR)),
    "across_z": lambda: less(tips("star, two tips across z as well") / tips(STAR)),
    "open_one": lambda: ranged(tips("one tip", DEFICIENCY), ".0f"),
    "open_two": lambda: ranged(tips("two tips, both everywhere", DEFICIENCY), ".0f"),
    "open_plane": lambda: ranged(tips("star, one tip for a plane", DEFICIENCY), ".0f"),
    "offsets_unknown": lambda: more(known(1e-5)),
    "offsets_exact": lambda: less(known(5e-8)),
    "short_stylus": lambda: times(stylus("20 mm")),
    "long_stylus": lambda: times(stylus("90 mm").drop("small")),
    "long_in_small": lambda: times(stylus("90 mm")[["small"]]),
    "kelvin": lambda: times(thermometers("0.1 K both")),
    "kelvin_common": lambda: times(thermometers("0.1 K common")),
    "kelvin_each": lambda: times(thermometers("0.1 K each")),
    "hundredths": lambda: more(thermometers("0.01 K both")),
    "fiftieths": lambda: more(thermometers("0.02 K both")),
    "three_coefficients": lambda: times(coefficients(3, "nine shifted")),
    "five_coefficients": lambda: times(coefficients(5, "nine shifted")),
    "six_coefficients": lambda: times(coefficients(6, "nine shifted")),
    "six_in_six": lambda: times(coefficients(6, "six shifted")),
    "six_in_twelve": lambda: times(coefficients(6, "twelve shifted")),
    "six_in_corners": lambda: times(coefficients(6, "six in opposite corners")),
    "inclined": lambda: times(
        values("inclined", pool="with inclined plates")
        / values("inclined", pool="across axes only")
    ),
    "lost_nine": lambda: more(losses("lost", "all")),
    "lost_six": lambda: more(losses("lost-six", "all six")),
    "lost_precise": lambda: more(by_repeatability("nine shifted without y2", "nine shifted", 2e-7)),
    "lost_noisy": lambda: more(by_repeatability("nine shifted without y2", "nine shifted", 8e-7)),
    "repeatability_half": lambda: less(influence(repeatability_m=2e-7)),
    "repeatability_double": lambda: more(influence(repeatability_m=8e-7)),
    "constant_double": lambda: more(influence(certificate_m=4e-7)),
    "common_double": lambda: more(influence(common=5e-7)),
    "offsets_double": lambda: more(influence(offsets_m=1e-6)),
}


def machines() -> str:
    """The machines of the study as a table."""
    base = yaml.safe_load((STUDY / "machines.yaml").read_text(encoding="utf-8"))
    lines = [
        "| machine | volume | plate | of the shortest edge | repeatability |",
        "|---" * 5 + "|",
    ]
    for name, changes in base["variants"].items():
        volume = changes.get("machine.volume", base["machine"]["volume"])
        size = changes.get("artefacts.plate.size", base["artefacts"]["plate"]["size"])
        repeatability = changes.get("machine.repeatability", base["machine"]["repeatability"])
        share = parse_length(size[0]) / min(map(parse_length, volume))
        cells = (name, " x ".join(volume), size[0], f"{share:.0%}", repeatability)
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines).replace(" um ", " µm ").replace("%", " %")


NUMBERS["machines"] = machines


def _relative(found: pd.DataFrame, by: str, to: pd.Series) -> pd.DataFrame:
    """U6 by `by` (rows) and machine (columns), relative to that of each machine in `to`."""
    wide = found.pivot_table(index=by, columns="machine", values=AVERAGE, sort=False)
    return (wide / to)[[machine for machine in MACHINES if machine in wide]]


def _positions() -> pd.DataFrame:
    return _relative(table("positions"), "positions limit", planned(6))


def _recipes() -> pd.DataFrame:
    found = table("recipes")
    counts = found["recipe"].str.split().str[0].map({"six": 6, "nine": 9, "twelve": 12})
    best = [
        planned(count)[machine] for count, machine in zip(counts, found["machine"], strict=True)
    ]
    return _relative(
        found.assign(**{AVERAGE: found[AVERAGE] / best}), "recipe", pd.Series(1.0, list(MACHINES))
    )


def _size() -> pd.DataFrame:
    found = rows("size-nine", repeatability_m=8e-7)
    largest = found.sort_values("size_m").groupby("machine")[AVERAGE].last()
    return _relative(found.assign(size=1e3 * found["size_m"]), "size", largest).sort_index()


def _balls() -> pd.DataFrame:
    found = table("balls")
    found = found[found["balls"].isin([3, 5, 7])]
    words = found["recipe"].str.split(r" shifted, | times", regex=True)
    named = words.str[0] + ", " + found["balls"].map("{0} x {0}, read ".format)
    named += words.str[1].map({"1": "once", "2": "twice", "3": "thrice"})
    named += found["hours"].map(", {:.1f} h".format)
    found = found.assign(name=named).sort_values("hours", kind="stable")
    return _relative(found[found["hours"].between(4.8, 8.0)], "name", balls(5))


def _repeats() -> pd.DataFrame:
    found = rows("balls", balls=5)
    name = found["recipe"].str.replace(" shifted", "") + found["hours"].map(", {:.1f} h".format)
    return _relative(
        found.assign(name=name).sort_values("hours", kind="stable"), "name", balls(5, "six")
    )


def _known() -> pd.DataFrame:
    found = table("tips-known")
    return _relative(
        found.assign(offsets=1e6 * found["offsets_m"]),
        "offsets",
        values("tips-known", offsets_m=5e-7),
    )


def _certificate() -> pd.DataFrame:
    found = table("certificate")
    named = found.assign(name=found["pairs"] + ", " + found["certificate"])
    kept = named["pairs"].isin(["corner sides", "corners", "all"]) & named["certificate"].isin(
        ["half", "as drafted", "double"]
    )
    return _relative(named[kept], "name", certificate("corners"))


def _bar() -> pd.DataFrame:
    found = table("bar")
    lengths = found["length"].str.split().str[0].astype(int)
    longest = lengths == lengths.groupby(found["machine"]).transform("max")
    return _relative(found[longest], "certified", bar("plate"))


def _tips() -> pd.DataFrame:
    found = table("tips").dropna(subset=[AVERAGE])
    return _relative(found, "tips", tips(STAR))


def _temperature() -> pd.DataFrame:
    exact = values("temperature", thermometers="0 K both")
    return _relative(table("temperature"), "thermometers", exact)


def _coefficients() -> pd.DataFrame:
    found = rows("coefficients", recipe="nine shifted")
    return _relative(
        found, "coefficients", values("coefficients", coefficients=4, recipe="nine shifted")
    )


def _planes() -> pd.DataFrame:
    return _relative(table("planes"), "shares", values("planes", shares="3 x, 3 y, 3 z"))


def _lost() -> pd.DataFrame:
    whole = values("lost", read="all")
    found = table("lost")
    return _relative(found[found["read"] != "all"].iloc[::-1], "read", whole)


# What is drawn, the words at its axis, and what U6 is relative to.
PICTURES: dict[str, tuple[Callable[[], pd.DataFrame], str, str]] = {
    "recipes": (_recipes, "", "planned positions of the same number"),
    "positions": (_positions, "positions, planned", "six positions"),
    "planes": (_planes, "", "three across each axis"),
    "size": (_size, "side of the plate in mm", "the largest plate"),
    "balls": (_balls, "", "nine positions of five by five balls read once"),
    "repeats": (_repeats, "", "six positions read once"),
    "known": (_known, "standard uncertainty of the offsets in µm", "half a micrometre"),
    "certificate": (_certificate, "", "corners, as drafted"),
    "bar": (_bar, "", "certified plate"),
    "tips": (_tips, "", "first row"),
    "temperature": (_temperature, "", "temperatures exactly known"),
    "coefficients": (_coefficients, "coefficients of each error", "four"),
    "lost": (_lost, "", "all nine positions"),
}

LEFT, WIDTH, BOTTOM, TOP, ROW = 190.0, 520.0, 38.0, 26.0, 17.0


def picture(name: str, words: str) -> bytes:
    """The picture of a name as SVG: curves over numbers, points beside names."""
    make, label, reference = PICTURES[name]
    shown = make()
    is_named = shown.index.dtype == object or isinstance(shown.index.dtype, pd.StringDtype)
    inner, left = (ROW * len(shown), LEFT) if is_named else (170.0, 48.0)
    with drawing(inner + BOTTOM + TOP, WIDTH) as figure:
        axes = placed_axes(figure, left, BOTTOM, WIDTH - left - 12.0, inner)
        places = np.arange(len(shown))[::-1] if is_named else shown.index.to_numpy(float)
        for machine, colour, marker in zip(MACHINES, SERIES, MARKERS, strict=False):
            line = shown[machine].to_numpy()
            there = np.isfinite(line)
            across = (line[there], places[there])
            axes.plot(
                *(across if is_named else across[::-1]),
                color=colour,
                marker=marker,
                label=machine,
                linestyle="none" if is_named else "-",
                alpha=0.85,
            )
        along, scale = (axes.xaxis, axes.set_xscale) if is_named else (axes.yaxis, axes.set_yscale)
        scale("log")
        ends = np.nanmin(shown.to_numpy()), np.nanmax(shown.to_numpy())
        steps = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1, 1.2, 1.5, 2, 3, 4, 6, 8)
        ticks = [step for step in steps if ends[0] / 1.12 <= step <= ends[1] * 1.12]
        along.set_ticks(ticks, [f"{tick:g}" for tick in ticks])
        along.set_ticks([], minor=True)
        axes.grid(True)
        draw_one = axes.axvline if is_named else axes.axhline
        draw_one(1.0, color=MUTED, linewidth=1.2)
        if is_named:
            axes.set_yticks(places, [str(index) for index in shown.index])
            axes.set_ylim(-0.6, len(shown) - 0.4)
            axes.set_xlabel(f"U6 relative to {reference}")
        else:
            axes.set_xlabel(label)
            axes.set_ylabel(f"U6 relative to {reference}")
            if places.max() / places.min() > 20:
                axes.set_xscale("log")
                axes.set_xticks(places, [f"{place:g}" for place in places])
                axes.set_xticks([], minor=True)
            elif places.max() < 20:
                axes.set_xticks(places)
        common_legend(figure, axes, loc="upper left", ncols=5, borderpad=0.1, handletextpad=0.3)
        with tempfile.TemporaryDirectory() as folder:
            save(figure, Path(folder) / "picture.svg", words)
            return (Path(folder) / "picture.svg").read_bytes()


class StudyPicture(SphinxDirective):
    """A picture of the study, with its text."""

    required_arguments = 1
    has_content = True
    option_spec = {"alt": directives.unchanged_required}

    def run(self) -> list[nodes.Node]:
        words = self.options["alt"]
        data = base64.b64encode(picture(self.arguments[0], words)).decode("ascii")
        shown = f'<img src="data:image/svg+xml;base64,{data}" alt="{html.escape(words)}">'
        caption = nodes.caption()
        parsed, messages = self.parse_inline("\n".join(self.content))
        caption += parsed
        figure = nodes.figure()
        figure += [nodes.raw("", shown, format="html"), caption, *messages]
        return [figure]


def filled(text: str) -> str:
    """The text of a page with its numbers."""
    return PLACEHOLDER.sub(lambda match: NUMBERS[match[1]](), text)


def _fill(app: Sphinx, page: str, source: list[str]) -> None:
    if page != "explanation/rules":
        return
    unknown = set(PLACEHOLDER.findall(source[0])) - set(NUMBERS)
    if unknown:
        raise ExtensionError(f"{page}: no number {', '.join(sorted(unknown))} in study_rules.py")
    source[0] = filled(source[0])
    # The tables may have changed although the page has not.
    app.env.note_reread()


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("source-read", _fill)
    app.add_directive("study", StudyPicture)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
