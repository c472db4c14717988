"""Positions, balls and probes from the names that a measuring program gives to features.

A rule is a name with fields in braces, such as {position}_{ball}_{probe}, and * for anything. For
a known experiment, capitals and characters other than letters and digits are ignored.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

from ballplate.simulator.design import Design
from ballplate.simulator.experiment import PLACE
from ballplate.simulator.inputs import ExperimentError, listing, refused, shorten

# Tried in this order where the experiment is known and no rule is given.
RULES = (
    "{position}_{ball}_{probe}",
    "{position}_{ball}",
    "{position}_{probe}_{ball}",
    "{ball}_{position}_{probe}",
    "{ball}_{position}",
    "{probe}_{position}_{ball}",
    "{ball}_{probe}",
    "{probe}_{ball}",
    "{ball}",
)
# How names of spheres begin in many programs.
PREFIXES = ("", "SPHERE_", "SPH_", "KUGEL_", "BALL_")
SEPARATORS = ("_", ".", "-", ":", "/", " ")
LONGEST_NAME = 200

Parts = Mapping[str, str]
NO_OTHERS: Mapping[str, str] = {}


@dataclass(frozen=True)
class Named:
    """The parts of each feature's name by a rule, None if it does not match; `numbered` are those
    given by number. `strange` ones are not the experiment's, and are matched by number and
    location like those of tables.
    """

    rule: str
    parts: tuple[Parts | None, ...]
    numbered: tuple[str, ...] = ()
    strange: bool = False


def fold(name: str) -> str:
    """A name in small letters and digits alone, numbers without zeros before them and apart from
    each other.

    >>> fold("z low: r1-C01"), fold("Z 1.02")
    ('zlowr1c1', 'z1_2')
    """
    apart = re.sub(r"(?<=[0-9])[\W_]+(?=[0-9])", "|", re.sub(r"(?<![0-9])0+(?=[0-9])", "", name))
    return re.sub(r"[^\w|]|_", "", apart).replace("|", "_").casefold()


def without_run(rule: str) -> str:
    """Return a rule without its run, for names that do not have it.

    >>> without_run("{run}_{ball}"), without_run("{position}/{ball}:{run}")
    ('{ball}', '{position}/{ball}')
    """
    signs = r"(?:[^\w{}*]|_)*"
    return re.sub(rf"^\{{run\}}{signs}|{signs}\{{run\}}", "", rule)


def named(
    names: Sequence[str],
    rule: str | None,
    design: Design | None,
    file: str,
    probes: Mapping[str, str] = NO_OTHERS,
) -> Named:
    """Return the parts of names by a rule, or by the one that they follow. `probes` are further
    names of those of the experiment.

    :raises ExperimentError: they follow several rules, or no rule.
    """
    if design is not None:
        return _known(names, rule, design, file, probes)
    rule = rule or _likely(names, file)
    patterns = _patterns(rule, {})
    parts = [_split(name, patterns) for name in names]
    for name, ways in zip(names, parts, strict=True):
        if len(ways) > 1:
            text = (
                f'the name "{shorten(name)}" can be parted as {rule} in several ways; name the'
                " experiment with --for, or another rule with --name"
            )
            raise refused(file, text)
    return Named(rule, tuple(ways[0] if ways else None for ways in parts))


def _patterns(rule: str, tables: Mapping[str, Collection[str]]) -> list[re.Pattern[str]]:
    """Return patterns of names by a rule, of the shortest and of the longest parts; parts are of
    the folded texts in `tables`, where they have any.
    """
    patterns = []
    for lazy in ("?", ""):
        pieces = [re.escape(piece).replace(r"\*", f".*{lazy}") for piece in PLACE.split(rule)]
        for i in range(1, len(pieces), 2):
            texts = sorted(tables.get(pieces[i], ()), key=len, reverse=not lazy)
            # Numbers are whole, with zeros before them or not.
            spelt = [
                "_?".join(
                    rf"(?<!\d)0*{word}(?!\d)" if word.isdigit() else word
                    for word in re.findall(r"\d+|[^\W\d_]", text)
                )
                for text in texts
            ]
            pieces[i] = f"(?P<{pieces[i]}>{'|'.join(spelt) or f'.+{lazy}'})"
        patterns.append(re.compile("".join(pieces), re.IGNORECASE if tables else 0))
    return patterns


def _split(name: str, patterns: Sequence[re.Pattern[str]]) -> list[Parts]:
    """Return the ways in which a name is parted."""
    matches = [pattern.fullmatch(name) for pattern in patterns if len(name) <= LONGEST_NAME]
    ways = [match.groupdict() for match in matches if match is not None]
    return [way for i, way in enumerate(ways) if way not in ways[:i]]


def _likely(names: Sequence[str], file: str) -> str:
    """The rule that names follow, by the number of their parts."""
    for separator in SEPARATORS:
        counts = {name.count(separator) + 1 for name in names}
        if len(counts) == 1 and (count := counts.pop()) in (2, 3):
            return separator.join(["{position}", "{ball}", "{probe}"][:count])
    if not any(separator in name for name in names for separator in SEPARATORS):
        return "{ball}"
    text = (
        f"no rule parts the names {listing((shorten(name, 30) for name in names), 3)} into"
        " position, ball and probe; name the experiment with --for, or the rule with --name"
    )
    raise refused(file, text)


def known_texts(
    place: str, design: Design, others: Mapping[str, str], is_numbered: bool = False
) -> dict[str, str]:
    """Return the names of an experiment for a field of a rule by what is written, folded, if that
    is of a single one; `others` are further names of probes, and numbers count from 1.
    """
    balls = [
        [design.balls.names[b] for b in design.balls.of(k)]
        for k in range(len(design.artefacts.names))
    ]
    lists: dict[str, Sequence[Sequence[str]]] = {
        "position": [design.positions.names],
        "probe": [design.probes.names],
        "ball": balls,
    }
    texts: dict[str, str] = {}
    for names in lists[place]:
        for number, name in enumerate(names, start=1):
            key = str(number) if is_numbered else fold(name)
            texts[key] = name if texts.get(key, name) == name else ""
    texts |= {fold(text): name for text, name in others.items() if place == "probe"}
    return {text: name for text, name in texts.items() if name}


def _known(
    names: Sequence[str], rule: str | None, design: Design, file: str, others: Mapping[str, str]
) -> Named:
    """Return the parts of names of an experiment, by the rule that most of them follow; by numbers
    if no rule matches names of balls or positions.
    """
    for numbered in ((), ("ball",), ("position", "ball")):
        prefixes = ("",) if numbered else PREFIXES
        rules = (
            [rule]
            if rule
            else [prefix + candidate_rule for candidate_rule in RULES for prefix in prefixes]
        )
        fitting = _fitting(
            names,
            [candidate_rule for candidate_rule in rules if _has(candidate_rule, numbered)],
            design,
            numbered,
            others,
        )
        if len(fitting) > 1:
            rules_text = " and ".join(candidate_rule.rule for candidate_rule in fitting[:2])
            text = f"the names can be read as {rules_text}; state the one that is right with --name"
            raise refused(file, text)
        if fitting:
            return fitting[0]
    if strange := _strange(names, rule, design, file):
        return strange
    some = listing((shorten(name, 30) for name in names), 3)
    text = (
        f"no names of the experiment in {some}; its positions are"
        f" {listing(design.positions.names, 3)}, its balls"
        f" {listing(dict.fromkeys(design.balls.names), 3)}; state the rule with --name, such as"
        " {position}_{ball}"
    )
    raise refused(file, text)


def _strange(names: Sequence[str], rule: str | None, design: Design, file: str) -> Named | None:
    """Return the parts of names that are not an experiment's, by the stated rule, or by one that
    all follow if these have numbers of balls; unavailable if the plane of a position has to be
    known to read it.
    """
    if design.positions.across is not None:
        return None
    try:
        strange = named(names, rule, None, file)
    except ExperimentError:
        return None
    parts = [part for part in strange.parts if part is not None and "ball" in part]
    is_clear = rule is not None or all(re.search("[0-9]", part["ball"]) for part in parts)
    whole = {tuple(part.values()) for part in parts}
    if not is_clear or "{position}" not in strange.rule or len(parts) < 2 or len(whole) < 2:
        return None
    return Named(strange.rule, strange.parts, strange=True)


def _parted(
    names: Sequence[str], rule: str, texts: Mapping[str, Mapping[str, str]]
) -> tuple[Parts | None, ...]:
    """Return the parts of names by a rule, with those of an experiment for their `texts`; None for
    a name of no way or of several.
    """
    patterns = _patterns(re.sub(r"(?:[^\w{}*]|_)+", "_", rule).strip("_"), texts)
    read: list[Parts | None] = []
    for name in names:
        ways = _split(re.sub(r"[\W_]+", "_", name).strip("_"), patterns)
        way = ways[0] if len(ways) == 1 else {}
        read.append({p: texts[p][fold(way[p])] if p in texts else way[p] for p in way} or None)
    return tuple(read)


def _lookup(rule: str, texts: Mapping[str, Mapping[str, str]]) -> dict[str, Parts | None]:
    """Return the parts of all names by a rule, folded; None for ambiguous ones."""
    places = PLACE.findall(rule)
    parts_by_name: dict[str, Parts | None] = {}
    for written in product(*(texts[place] for place in places)):
        parts = {place: texts[place][text] for place, text in zip(places, written, strict=True)}
        key = fold(rule.format(**dict(zip(places, written, strict=True))))
        parts_by_name[key] = None if parts_by_name.get(key, parts) != parts else parts
    return parts_by_name


def _has(rule: str, places: Sequence[str]) -> bool:
    return all(f"{{{place}}}" in rule for place in places)


def _fitting(
    names: Sequence[str],
    rules: Sequence[str],
    design: Design,
    numbered: Sequence[str],
    others: Mapping[str, str],
) -> list[Named]:
    """The rules by which the most names are those of an experiment, one for each way to read
    them.
    """
    fitting: list[Named] = []
    best = 1
    texts = {
        place: known_texts(place, design, others, place in numbered)
        for place in ("position", "ball", "probe")
    }
    for rule in rules:
        beginning = fold(re.split(r"[{*]", rule)[0])
        if not any(fold(name).startswith(beginning) for name in names):
            continue
        if "*" in rule or "{run}" in rule:
            parts = _parted(names, rule, texts)
        else:
            lookup = _lookup(rule, texts)
            parts = tuple(lookup.get(fold(name)) for name in names)
        count = sum(part is not None for part in parts)
        if count > best:
            fitting, best = [], count
        if count == best and all(candidate.parts != parts for candidate in fitting):
            fitting.append(Named(rule, parts, tuple(numbered)))
    return fitting


def position_of_file(stem: str, design: Design | None, file: str) -> str:
    """Return the position in a file's name: all of it, or the one of the experiment in it.

    :raises ExperimentError: it contains no position, or several.
    """
    if design is None:
        return stem
    words = [fold(word) for word in re.split(r"[\W_]+", stem) if word]
    joined = {"".join(words[i:j]) for i in range(len(words)) for j in range(i + 1, len(words) + 1)}
    names = [name for name in design.positions.names if fold(name) in joined]
    longest = max((len(fold(name)) for name in names), default=0)
    names = [name for name in names if len(fold(name)) == longest]
    if len(names) != 1 and len(design.positions.names) == 1:
        names = list(design.positions.names)
    if len(names) != 1:
        names_text = "none" if not names else " and ".join(names)
        text = (
            "neither the names of features nor the file's name identify the position"
            f" ({names_text}); add it to the file's name, or state the rule with --name"
        )
        raise refused(file, text)
    return names[0]
