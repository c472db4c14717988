"""The rules for planners: their page says numbers of the stored tables alone, which a few lines
without the page's code reproduce, and the tables are those of the sweeps.
"""

from __future__ import annotations

import csv
import importlib
import math
import re
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import ballplate as bp
import pytest
import yaml

STUDY = Path("designs/study")
SWEEPS = STUDY / "sweeps"
PAGE = Path("docs/explanation/rules.md").read_text(encoding="utf-8")
RULES = re.split(r"^## ", PAGE, flags=re.MULTILINE)[1:]
PLACEHOLDER = r"\{\{(\w+)\}\}"

sys.path.insert(0, str(Path("docs/_extensions").resolve()))
study_rules = importlib.import_module("study_rules")

Row = dict[str, str]
U6 = "U6_average_um"


def rows(table: str) -> list[Row]:
    with (STUDY / "tables" / f"{table}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def column(table: str, name: str = U6, **where: str) -> dict[str, float]:
    """By machine."""
    found = [row for row in rows(table) if all(row[key] == text for key, text in where.items())]
    by = {row["machine"]: float(row[name]) for row in found}
    assert len(by) == len(found) > 0, (table, where)
    return by


def ratios(one: dict[str, float], other: dict[str, float]) -> list[float]:
    return [one[machine] / other[machine] for machine in one]


def ranged(values: Iterable[float], digits: int) -> str:
    ends = sorted(values)
    return " to ".join(dict.fromkeys(f"{end:.{digits}f}" for end in (ends[0], ends[-1])))


def times(one: dict[str, float], other: dict[str, float]) -> str:
    return ranged(ratios(one, other), 2)


def more(one: dict[str, float], other: dict[str, float]) -> str:
    return ranged([100 * (ratio - 1) for ratio in ratios(one, other)], 0)


def less(one: dict[str, float], other: dict[str, float]) -> str:
    return ranged([100 * (1 - ratio) for ratio in ratios(one, other)], 0)


def plan(count: int, name: str = U6) -> dict[str, float]:
    return column("positions", name, **{"positions limit": str(count)})


def recipe(name: str) -> dict[str, float]:
    return column("recipes", recipe=name)


def read(positions: str, repeats: int, balls: int = 5, name: str = U6) -> dict[str, float]:
    return column("balls", name, recipe=f"{positions} shifted, {repeats} times", balls=str(balls))


def assumed(recipe: str, **changed: str) -> dict[str, float]:
    usual = {"repeatability_m": "4e-07", "certificate_m": "2e-07"}
    usual |= {"common": "2.5e-07", "offsets_m": "5e-07"}
    return column("sensitivity", recipe=recipe, **usual | changed)


def noise(name: str, other: str, repeatability: str) -> str:
    return less(*(assumed(one, repeatability_m=repeatability) for one in (name, other)))


def everywhere(name: str, other: str) -> str:
    found = []
    for repeatability in ("2e-07", "4e-07", "8e-07"):
        key = {"repeatability_m": repeatability}
        found += ratios(assumed(name, **key), assumed(other, **key))
    for key in (
        {"certificate_m": "1e-07"},
        {"certificate_m": "4e-07"},
        {"common": "1e-07"},
        {"common": "5e-07"},
        {"offsets_m": "2.5e-07"},
        {"offsets_m": "1e-06"},
    ):
        found += ratios(assumed(name, **key), assumed(other, **key))
    return ranged(found, 2)


def hourly(first: int, last: int) -> str:
    one, other = plan(first), plan(last)
    hours = plan(first, "hours"), plan(last, "hours")
    return ranged(
        [
            100 * (1 - math.exp(math.log(other[m] / one[m]) / (hours[1][m] - hours[0][m])))
            for m in one
        ],
        0,
    )


def sizes(table: str, repeatability: str = "") -> dict[str, list[tuple[float, float]]]:
    by: dict[str, list[tuple[float, float]]] = {}
    for row in rows(table):
        if row.get("repeatability_m", "") == repeatability:
            by.setdefault(row["machine"], []).append((float(row["size_m"]), float(row[U6])))
    return {machine: sorted(pairs) for machine, pairs in by.items()}


def slopes(first: int, second: int) -> str:
    pairs = [(one[first], one[second]) for one in sizes("size-nine", "8e-07").values()]
    return ranged([-math.log(b[1] / a[1]) / math.log(b[0] / a[0]) for a, b in pairs], 1)


def of_size(repeatability: str) -> str:
    return ranged([one[0][1] / one[-1][1] for one in sizes("size-nine", repeatability).values()], 1)


def certificate(pairs: str, quality: str = "as drafted") -> dict[str, float]:
    return column("certificate", pairs=pairs, certificate=quality)


def bar(certified: str, is_long: bool) -> dict[str, float]:
    length = {"small": "350 mm", "gantry": "1400 mm" if is_long else "700 mm"}
    usual = "700 mm" if is_long else "350 mm"
    return {
        row["machine"]: float(row[U6])
        for row in rows("bar")
        if row["certified"] == certified and row["length"] == length.get(row["machine"], usual)
    }


def tips(name: str) -> str:
    return times(column("tips", tips=name), column("tips", tips="star, two tips of a plane"))


def open_with(name: str) -> str:
    return ranged(column("tips", "rank_deficiency", tips=name).values(), 0)


def heat(name: str) -> tuple[dict[str, float], dict[str, float]]:
    return tuple(column("temperature", thermometers=one) for one in (name, "0 K both"))  # type: ignore[return-value]


def model(count: int, name: str) -> str:
    key = {"recipe": name}
    one, four = (column("coefficients", coefficients=str(n), **key) for n in (count, 4))
    return times(one, four)


def lost(table: str, whole: str) -> str:
    all_read = column(table, read=whole)
    found = [row for row in rows(table) if row["read"] != whole]
    return ranged([100 * (float(row[U6]) / all_read[row["machine"]] - 1) for row in found], 0)


def shares(*names: str) -> str:
    even = column("planes", shares="3 x, 3 y, 3 z")
    return ranged([r for name in names for r in ratios(column("planes", shares=name), even)], 2)


def stylus(length: str, *machines: str) -> str:
    one, usual = column("tips-length", length=length), column("tips-length", length="60 mm")
    return ranged([one[machine] / usual[machine] for machine in machines or one], 2)


def offsets(text: str) -> tuple[dict[str, float], dict[str, float]]:
    return tuple(column("tips-known", offsets_m=one) for one in (text, "5e-07"))  # type: ignore[return-value]


def third(design: str, which: int = 0) -> dict[str, float]:
    """With the plate of 35 % of the shortest edge, or of 65 %."""
    found: dict[str, list[tuple[float, float]]] = {}
    for row in rows("plates"):
        if row["design"] == design:
            found.setdefault(row["machine"], []).append((float(row["size_m"]), float(row[U6])))
    return {machine: sorted(pairs)[which][1] for machine, pairs in found.items()}


PART, DRAFTED = "nine with two fifths of the", "nine as drafted"
SIX, NINE, TWELVE = "six shifted", "nine shifted", "twelve shifted"
CORNERS = "six in opposite corners"
ONCE = read("nine", 1)

AGAIN: dict[str, Callable[[], str]] = {
    "corners_six": lambda: times(recipe(CORNERS), plan(6)),
    "corners_twelve": lambda: times(recipe("twelve in corners"), plan(12)),
    "centred_six": lambda: times(recipe("six centred"), plan(6)),
    "diagonal_nine": lambda: times(recipe("nine along diagonals"), plan(9)),
    "shifted_six": lambda: times(recipe(SIX), plan(6)),
    "shifted_nine": lambda: times(recipe(NINE), plan(9)),
    "shifted_twelve": lambda: times(recipe(TWELVE), plan(12)),
    "drafted_six": lambda: times(recipe("six as drafted"), plan(6)),
    "drafted_nine": lambda: times(recipe("nine as drafted"), plan(9)),
    "drafted_twelve": lambda: times(recipe("twelve as drafted"), plan(12)),
    "corners_assumed": lambda: everywhere(CORNERS, SIX),
    "four_positions": lambda: times(plan(4), plan(6)),
    "gain_six": lambda: less(plan(9), plan(6)),
    "gain_nine": lambda: less(plan(12), plan(9)),
    "gain_twelve": lambda: less(plan(15), plan(12)),
    "hours_nine": lambda: ranged(plan(9, "hours").values(), 1),
    "hours_twelve": lambda: ranged(plan(12, "hours").values(), 1),
    "hourly_six": lambda: hourly(6, 9),
    "hourly_nine": lambda: hourly(9, 12),
    "hourly_twelve": lambda: hourly(12, 15),
    "gap_six": lambda: more(plan(6), plan(6, "bound_um")),
    "gap_twelve": lambda: more(plan(12), plan(12, "bound_um")),
    "more_precise": lambda: noise(TWELVE, NINE, "2e-07"),
    "less_precise": lambda: noise(TWELVE, NINE, "8e-07"),
    "open_without_x": lambda: ranged(
        column("planes", "rank_deficiency", shares="none across x").values(), 0
    ),
    "open_without_y": lambda: ranged(
        column("planes", "rank_deficiency", shares="none across y").values(), 0
    ),
    "without_z": lambda: shares("none across z"),
    "uneven": lambda: shares("5 x, 2 y, 2 z", "2 x, 5 y, 2 z", "2 x, 2 y, 5 z"),
    "inclined": lambda: times(
        column("inclined", pool="with inclined plates"),
        column("inclined", pool="across axes only"),
    ),
    "doubled": lambda: ranged([two[1][1] / two[0][1] for two in sizes("size").values()], 2),
    "size_small": lambda: slopes(0, 1),
    "size_large": lambda: slopes(-2, -1),
    "size_precise": lambda: of_size("2e-07"),
    "size_noisy": lambda: of_size("8e-07"),
    "balls_seven": lambda: times(read("nine", 1, 7), ONCE),
    "three_thrice": lambda: times(read("nine", 3, 3), ONCE),
    "three_twelve": lambda: times(read("twelve", 1, 3), ONCE),
    "five_six_thrice": lambda: times(read("six", 3), ONCE),
    "hours_five": lambda: ranged(read("nine", 1, name="hours").values(), 1),
    "hours_seven": lambda: ranged(read("nine", 1, 7, "hours").values(), 1),
    "hours_three_thrice": lambda: ranged(read("nine", 3, 3, "hours").values(), 1),
    "hours_three_twelve": lambda: ranged(read("twelve", 1, 3, "hours").values(), 1),
    "hours_five_six_thrice": lambda: ranged(read("six", 3, name="hours").values(), 1),
    "hours_twice": lambda: ranged(read("nine", 2, name="hours").values(), 1),
    "hours_twelve_once": lambda: ranged(read("twelve", 1, name="hours").values(), 1),
    "twice": lambda: less(read("nine", 2), ONCE),
    "twelve_once": lambda: less(read("twelve", 1), ONCE),
    "twice_precise": lambda: noise(f"{NINE}, read twice", NINE, "2e-07"),
    "twice_noisy": lambda: noise(f"{NINE}, read twice", NINE, "8e-07"),
    "sides": lambda: more(certificate("corner sides"), certificate("corners")),
    "diagonals": lambda: times(certificate("corner diagonals"), certificate("corner sides")),
    "all_distances": lambda: less(certificate("all"), certificate("corners")),
    "half_certificate": lambda: less(certificate("corners", "half"), certificate("corners")),
    "double_certificate": lambda: more(certificate("corners", "double"), certificate("corners")),
    "corners_third": lambda: times(third(CORNERS), third("six as drafted")),
    "corners_wide": lambda: times(third(CORNERS, -1), third("six as drafted", -1)),
    "twice_third": lambda: less(third("nine read twice"), third(DRAFTED)),
    "twelve_third": lambda: less(third("twelve as drafted"), third(DRAFTED)),
    "kelvin_third": lambda: times(third("nine at 0.1 K"), third(DRAFTED)),
    "six_third": lambda: times(third("nine with six coefficients"), third(DRAFTED)),
    "common_third": lambda: less(third(f"{PART} common part"), third(DRAFTED)),
    "other_third": lambda: less(third(f"{PART} other part"), third(DRAFTED)),
    "common_wide": lambda: less(third(f"{PART} common part", -1), third(DRAFTED, -1)),
    "other_wide": lambda: less(third(f"{PART} other part", -1), third(DRAFTED, -1)),
    "gain_third": lambda: less(third(DRAFTED), third("six as drafted")),
    "bar_alone": lambda: times(bar("bar", True), bar("plate", True)),
    "short_bar_alone": lambda: times(bar("bar", False), bar("plate", False)),
    "bar_besides": lambda: less(bar("plate and bar", True), bar("plate", True)),
    "one_tip": lambda: tips("one tip"),
    "two_tips": lambda: tips("two tips, both everywhere"),
    "three_tips": lambda: tips("three tips, two for upright plates"),
    "one_for_position": lambda: tips("star, one tip for a position"),
    "across_z": lambda: less(
        column("tips", tips="star, two tips across z as well"),
        column("tips", tips="star, two tips of a plane"),
    ),
    "open_one": lambda: open_with("one tip"),
    "open_two": lambda: open_with("two tips, both everywhere"),
    "open_plane": lambda: open_with("star, one tip for a plane"),
    "offsets_unknown": lambda: more(*offsets("1e-05")),
    "offsets_exact": lambda: less(*offsets("5e-08")),
    "short_stylus": lambda: stylus("20 mm"),
    "long_stylus": lambda: stylus("90 mm", "bridge", "cube", "long", "gantry"),
    "long_in_small": lambda: stylus("90 mm", "small"),
    "kelvin": lambda: times(*heat("0.1 K both")),
    "kelvin_common": lambda: times(*heat("0.1 K common")),
    "kelvin_each": lambda: times(*heat("0.1 K each")),
    "fiftieths": lambda: more(*heat("0.02 K both")),
    "hundredths": lambda: more(*heat("0.01 K both")),
    "three_coefficients": lambda: model(3, NINE),
    "five_coefficients": lambda: model(5, NINE),
    "six_coefficients": lambda: model(6, NINE),
    "six_in_six": lambda: model(6, SIX),
    "six_in_twelve": lambda: model(6, TWELVE),
    "six_in_corners": lambda: model(6, CORNERS),
    "lost_nine": lambda: lost("lost", "all"),
    "lost_six": lambda: lost("lost-six", "all six"),
    "lost_precise": lambda: more(
        *(assumed(one, repeatability_m="2e-07") for one in (f"{NINE} without y2", NINE))
    ),
    "lost_noisy": lambda: more(
        *(assumed(one, repeatability_m="8e-07") for one in (f"{NINE} without y2", NINE))
    ),
    "repeatability_half": lambda: less(assumed(NINE, repeatability_m="2e-07"), assumed(NINE)),
    "repeatability_double": lambda: more(assumed(NINE, repeatability_m="8e-07"), assumed(NINE)),
    "constant_double": lambda: more(assumed(NINE, certificate_m="4e-07"), assumed(NINE)),
    "common_double": lambda: more(assumed(NINE, common="5e-07"), assumed(NINE)),
    "offsets_double": lambda: more(assumed(NINE, offsets_m="1e-06"), assumed(NINE)),
}


@pytest.mark.parametrize("name", sorted(AGAIN))
def test_a_number_follows_from_the_tables(name: str) -> None:
    assert study_rules.NUMBERS[name]() == AGAIN[name]()


def test_every_number_is_on_the_page_and_checked() -> None:
    assert set(re.findall(PLACEHOLDER, PAGE)) == set(study_rules.NUMBERS) == {*AGAIN, "machines"}


def test_no_digit_stands_outside_of_placeholders() -> None:
    text = re.sub(r"^#.*|`[^`\n]+`|\bU6\b|" + PLACEHOLDER, "", PAGE, flags=re.MULTILINE)
    assert not re.findall(r".*\d.*", text)


@pytest.mark.parametrize("rule", RULES[:-1], ids=lambda rule: rule.splitlines()[0])
def test_a_rule_has_range_picture_limits_and_files(rule: str) -> None:
    assert re.search(PLACEHOLDER, rule) and re.search(r"```\{study\} \w+\n:alt: .{30,}", rule)
    assert all(f"**{word}**" in rule for word in ("Fails", "Sensitivity", "From"))
    for name in re.findall(r"`([\w-]+)\.yaml`", rule.partition("**From**")[2]):
        assert (SWEEPS / f"{name}.yaml").is_file() and rows(name)


def test_every_picture_is_shown() -> None:
    assert set(re.findall(r"\{study\} (\w+)", PAGE)) == set(study_rules.PICTURES)
    assert study_rules.picture("bar", "Bars & plates").startswith(b"<?xml")


def test_every_sweep_has_its_table() -> None:
    sweeps = {path.stem for path in SWEEPS.glob("*.yaml")}
    assert sweeps == {path.stem for path in (STUDY / "tables").glob("*.csv")}
    for name in sweeps:
        axes = yaml.safe_load((SWEEPS / f"{name}.yaml").read_text(encoding="utf-8"))["axes"]
        first = rows(name)[0]
        assert all(axis in first or f"{axis}_m" in first for axis in axes)
        assert {row["machine"] for row in rows(name)} == {
            experiment.name for experiment in bp.load_all(STUDY / "machines.yaml")
        }


def test_a_table_has_what_run_predicts() -> None:
    recipes = yaml.safe_load((SWEEPS / "recipes.yaml").read_text(encoding="utf-8"))
    points, recipes = (recipes["axes"][axis]["values"] for axis in ("points", "recipe"))
    chosen = {"positions": recipes[CORNERS], "evaluation.points": points["one hundred"]}
    for experiment in bp.load_all(STUDY / "machines.yaml"):
        predicted = bp.run(experiment.with_(chosen)).quantities["U6"].average
        assert recipe(CORNERS)[str(experiment.name)] == pytest.approx(1e6 * predicted, rel=1e-5)


def test_recipes_as_drafted_are_those_of_init() -> None:
    recipes = yaml.safe_load((SWEEPS / "recipes.yaml").read_text(encoding="utf-8"))
    values = recipes["axes"]["recipe"]["values"]
    drafts = yaml.safe_load(Path("analysis/extensions/drafting/tables.yaml").read_text("utf-8"))
    for name, draft in zip(("six", "nine", "twelve"), drafts["starts"]["star"]["z"], strict=True):
        of_study = [place(one) for one in values[f"{name} as drafted"]]
        assert of_study == [place(one) for one in draft], name


def place(position: dict[str, Any]) -> tuple[Any, ...]:
    keys = ("plane", "level", "corner")
    return *(position[key] for key in keys), position.get("quarter_turns", 0)
