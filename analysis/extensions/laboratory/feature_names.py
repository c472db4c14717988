"""Positions, balls and probes from the names that a measuring program gives to features.

A rule is a name with fields in braces, such as {position}_{ball}_{probe}. For a known experiment,
capitals and characters other than letters and digits are ignored.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
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


def named(names: Sequence[str], rule: str | None, design: Design | None, file: str) -> Named:
    """Return the parts of names by a rule, or by the one that they follow.

    :raises ExperimentError: they follow several rules, or no rule.
    """
    if design is not None:
        return _known(names, rule, design, file)
    rule = rule or _likely(names, file)
    return Named(rule, tuple(_split(name, rule, file) for name in names))


def _split(name: str, rule: str, file: str) -> Parts | None:
    """Return the parts of a name of an unknown experiment, if it matches the rule."""
    pieces = PLACE.split(rule)
    parts = []
    for quantifier in ("+?", "+"):
        pattern = "".join(
            f"(?P<{piece}>.{quantifier})" if i % 2 else re.escape(piece)
            for i, piece in enumerate(pieces)
        )
        match = re.fullmatch(pattern, name[:LONGEST_NAME])
        if match is None or len(name) > LONGEST_NAME:
            return None
        parts.append(match.groupdict())
    if parts[0] != parts[1]:
        text = (
            f'the name "{shorten(name)}" can be parted as {rule} in several ways; name the'
            " experiment with --for, or another rule with --name"
        )
        raise refused(file, text)
    return parts[0]


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


def _lookup(rule: str, design: Design, numbered: Sequence[str]) -> dict[str, Parts | None]:
    """Return names by a rule of all balls in all positions with all probes, folded; None for
    ambiguous ones. Names contain the number, from 1, of `numbered` parts.
    """
    places = PLACE.findall(rule)
    positions = enumerate(design.positions.names) if "position" in places else ((-1, ""),)
    probes = design.probes.names if "probe" in places else ("",)
    parts_by_name: dict[str, Parts | None] = {}
    for (k, position), probe in product(positions, probes):
        artefacts = [int(design.positions.artefact[k])] if k >= 0 else design.artefacts.plates
        for artefact in artefacts:
            for number, b in enumerate(design.balls.of(artefact), start=1):
                every = {"position": position, "ball": design.balls.names[b], "probe": probe}
                numbers = {"position": str(k + 1), "ball": str(number)}
                written = {**every, **{name: numbers[name] for name in numbered}}
                parts = {name: every[name] for name in places}
                key = fold(rule.format(**written))
                parts_by_name[key] = None if parts_by_name.get(key, parts) != parts else parts
    return parts_by_name


def _known(names: Sequence[str], rule: str | None, design: Design, file: str) -> Named:
    """Return the parts of names of an experiment, by the rule that most of them follow; by numbers
    if no rule matches names of balls or positions.
    """
    folded = [fold(name) for name in names]
    for numbered in ((), ("ball",), ("position", "ball")):
        prefixes = ("",) if numbered else PREFIXES
        rules = (
            [rule]
            if rule
            else [prefix + candidate_rule for candidate_rule in RULES for prefix in prefixes]
        )
        fitting = _fitting(
            folded,
            [candidate_rule for candidate_rule in rules if _has(candidate_rule, numbered)],
            design,
            numbered,
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


def _has(rule: str, places: Sequence[str]) -> bool:
    return all(f"{{{place}}}" in rule for place in places)


def _fitting(
    folded: Sequence[str], rules: Sequence[str], design: Design, numbered: Sequence[str]
) -> list[Named]:
    """The rules by which the most names are those of an experiment, one for each way to read
    them.
    """
    fitting: list[Named] = []
    best = 1
    for rule in rules:
        beginning = fold(PLACE.split(rule)[0])
        if not any(name.startswith(beginning) for name in folded):
            continue
        lookup = _lookup(rule, design, numbered)
        parts = tuple(lookup.get(name) for name in folded)
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
