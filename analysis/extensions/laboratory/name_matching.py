"""Matching of positions, balls and probes of tables to the names in the experiment.

Other names are matched if one rule alone explains all of them: the same except case, signs and
zeros before numbers; the number in the experiment's order; or the location, if nominal ones
decide. Every match is reported.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from ballplate.simulator.design import Design
from ballplate.simulator.geometry import fit_motion, fixes_pose
from ballplate.simulator.inputs import FileRow, format_length, listing, shorten
from ballplate.simulator.machines import Array, Integers

from .heading_words import folded, quoted
from .probe_matching import Places, matched_probes, nominal_places

# A reading is of the ball whose place is nearer than this part of the distance to its nearest
# neighbour; a position is the one whose readings are on average as near, and others twice as far.
BY_PLACE = 0.3
CLEARER = 2.0
# Elements of the rotation of a plate that stands as planned differ by less from the nominal ones.
AS_PLANNED = 0.3
# Words that say what is numbered.
_KINDS = re.compile(r"(?:ball|sphere|kugel|position|pos|lage|p|b|k|s|no|nr)\s*")


@dataclass
class Names:
    """Matched names of a table, with notes and questions."""

    told: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)


def with_known_names(
    rows: Sequence[FileRow], design: Design, places: Places | None
) -> tuple[tuple[FileRow, ...], Names]:
    """Return rows with the names of the design, and notes on matched and unmatched names.

    `places` converts rows to locations of balls in the machine, in metres, if the table has them.
    """
    names = Names()
    positions, balls, probes = design.positions.names, set(design.balls.names), design.probes.names
    used = [list(dict.fromkeys(row.texts[i] for row in rows)) for i in range(3)]
    strange = [
        [name for name in used[0] if name not in positions],
        [name for name in used[1] if name not in balls],
        [name for name in used[2] if name not in probes and name],
    ]
    if not any(strange) and "" not in used[2]:
        return tuple(rows), names
    if strange[2]:
        rows = _renamed(rows, 2, _alike("probes", used[2], probes, names))
    if strange[1]:
        rows = _renamed(rows, 1, _alike("balls", used[1], list(design.balls.names), names))
    if strange[0]:
        rows = _renamed(rows, 0, _alike("positions", used[0], positions, names))
    rows = _matched_positions(rows, design, places, names)
    rows = _planned_probes(rows, design, names)
    rows = _matched_balls(rows, design, places, names)
    if not names.asked:
        by_offset, question = matched_probes(rows, design, places)
        if question:
            names.asked.append(question)
        if by_offset:
            names.told.append(f"probes matched by plan and place: {_pairs(by_offset, 8)}")
        rows = _renamed(rows, 2, by_offset)
    return tuple(rows), names


def _renamed(rows: Sequence[FileRow], role: int, names: Mapping[str, str]) -> Sequence[FileRow]:
    """Rows with other names in one role."""
    if not names:
        return rows
    names_by_texts = {}
    for row in rows:
        if row.texts not in names_by_texts:
            name = names.get(row.texts[role], row.texts[role])
            names_by_texts[row.texts] = (*row.texts[:role], name, *row.texts[role + 1 :])
    return [replace(row, texts=names_by_texts[row.texts]) for row in rows]


def _pairs(names: Mapping[str, str], limit: int = 4) -> str:
    return listing(
        (
            f"{shorten(from_name)} = {to_name}"
            for from_name, to_name in names.items()
            if from_name != to_name
        ),
        limit,
    )


def _alike(
    noun: str, used: Sequence[str], names_known: Sequence[str], names: Names
) -> dict[str, str]:
    """Return names that are the same except case, signs and zeros, if all of them are."""
    by_folded: dict[str, set[str]] = {}
    for name in names_known:
        by_folded.setdefault(folded(name), set()).add(name)
    matched = {}
    for name in used:
        if not name:
            continue
        options = {name} if name in names_known else by_folded.get(folded(name), set())
        if len(options) != 1:
            return {}
        matched[name] = options.pop()
    if len(set(matched.values())) < len(matched):
        return {}
    names.told.append(f"{noun} matched by name, ignoring case and signs: {_pairs(matched)}")
    return matched


def _numbers(names: Sequence[str], most: int) -> dict[str, int] | None:
    """Return the index, from 0, of each name that is a number in order, if all are."""
    numbers = {}
    for name in names:
        plain = _KINDS.sub("", folded(name), count=1) if not name.isdecimal() else folded(name)
        if not re.fullmatch("[0-9]{1,9}", plain) or not 1 <= int(plain) <= most:
            return None
        numbers[name] = int(plain) - 1
    return numbers if len(set(numbers.values())) == len(numbers) else None


def _planned_probes(rows: Sequence[FileRow], design: Design, names: Names) -> Sequence[FileRow]:
    """Rows without a probe's name with the only probe that is planned in their position."""
    if all(row.texts[2] for row in rows):
        return rows
    only = {}
    for k, name in enumerate(design.positions.names):
        probes = np.unique(design.readings.probe[design.readings.position == k])
        if len(probes) == 1:
            only[name] = design.probes.names[probes[0]]
    rows_completed = [
        replace(row, texts=(*row.texts[:2], row.texts[2] or only.get(row.texts[0], "")))
        for row in rows
    ]
    missing = sorted({row.texts[0] for row in rows_completed if not row.texts[2]})
    if missing:
        names.asked.append(
            f"no column says which probe was used in {listing(map(shorten, missing))}, where"
            " several are planned; name one: readings: {columns: {probe: …}}"
        )
        return rows
    names.told.append("probes are those planned for each position")
    return rows_completed


def _matched_positions(
    rows: Sequence[FileRow],
    design: Design,
    places: Places | None,
    names: Names,
) -> Sequence[FileRow]:
    """Return rows whose positions are identified by number or location."""
    names_known = design.positions.names
    used = list(dict.fromkeys(row.texts[0] for row in rows))
    strange = [name for name in used if name not in names_known]
    if 2 * len(strange) <= len(used):
        return _others_by_place(rows, used, strange, design, places, names)
    numbers = _numbers(used, len(names_known)) or {}
    by_number = {name: names_known[k] for name, k in numbers.items()}
    if places is None and len(by_number) == len(names_known):
        names.told.append(f"positions matched by number alone: {_pairs(by_number, 8)}")
        return _renamed(rows, 0, by_number)
    doubt = "part co-ordinates do not give their locations"
    if places is not None:
        by_place, doubt = _positions_by_place(rows, used, design, places, by_number)
        if by_place:
            how = "by number and location" if by_number else "by location"
            names.told.append(f"positions matched {how}: {_pairs(by_place, 8)}")
            return _renamed(rows, 0, by_place)
    names_listed = quoted(strange)
    names.asked.append(
        f"the positions {names_listed} are not in the experiment, and their locations do not"
        f" identify them ({doubt}); write names of the experiment: {listing(names_known)}"
    )
    return rows


def _others_by_place(
    rows: Sequence[FileRow],
    used: Sequence[str],
    strange: Sequence[str],
    design: Design,
    places: Places | None,
    names: Names,
) -> Sequence[FileRow]:
    """Return rows of a table most of whose positions are known, with the others identified by
    location.

    A few unknown names within a known position are slips of the pen, and stay.
    """
    if not strange or places is None:
        return rows
    by_place, _ = _positions_by_place(rows, strange, design, places, {})
    if not by_place or not set(by_place.values()).isdisjoint(used):
        return rows
    names.told.append(f"positions matched by location among those left: {_pairs(by_place, 8)}")
    return _renamed(rows, 0, by_place)


def _positions_by_place(
    rows: Sequence[FileRow],
    used: Sequence[str],
    design: Design,
    places: Places,
    expected: Mapping[str, str],
) -> tuple[dict[str, str], str]:
    """Return the position nearest to each one of the table, or a reason why there is none.

    One that is `expected`, by its number, need only be the nearest.
    """
    names = {name: i for i, name in enumerate(design.balls.names)}
    matched = {}
    for name in used:
        rows_of_name = [row for row in rows if row.texts[0] == name]
        places_of_name = places(rows_of_name)
        apart = []
        for k, known_name in enumerate(design.positions.names):
            balls = design.balls.of(design.positions.artefact[k])
            nominal = nominal_places(design, k, balls)
            index = [names.get(row.texts[1], -1) for row in rows_of_name]
            if all(i in balls for i in index):
                there = nominal[np.searchsorted(balls, index)]
                distance = np.sqrt(((places_of_name - there) ** 2).sum(axis=1))
            else:
                distance = _nearest(places_of_name, nominal)[0]
            limit = BY_PLACE * _pitch(design.balls.places[balls])
            apart.append((float(np.sqrt((distance**2).mean())), limit, known_name))
        apart.sort()
        (first, limit, known_name), second = (
            apart[0],
            apart[1] if len(apart) > 1 else (np.inf, 0, ""),
        )
        if name in expected:
            if known_name != expected[name]:
                return {}, f'"{shorten(name)}" is nearest to {known_name}, and not {expected[name]}'
            matched[name] = known_name
            continue
        if first > limit:
            return {}, (
                f'"{shorten(name)}" is {format_length(float(f"{first:.3g}"))} from {known_name},'
                " and may"
                f" be {format_length(float(f'{limit:.3g}'))}"
            )
        if second[0] < CLEARER * first or second[0] < limit:
            return {}, f'"{shorten(name)}" could be {known_name} or {second[2]}'
        matched[name] = known_name
    if len(set(matched.values())) < len(matched):
        return {}, "two would match the same position"
    return matched, ""


def _pitch(places: Array) -> float:
    """The least distance between balls (n, d)."""
    if len(places) < 2:
        return 0.0
    return float(_nearest(places, places, 2)[0].min())


def _nearest(seen_places: Array, places: Array, rank: int = 1) -> tuple[Array, Integers]:
    """Return distances (m,) to the nearest location, or to the second nearest, and its index."""
    from scipy.spatial import cKDTree

    distance, index = cKDTree(places).query(seen_places, [rank])
    return distance[:, 0], index[:, 0]


def _matched_balls(
    rows: Sequence[FileRow],
    design: Design,
    places: Places | None,
    findings: Names,
) -> Sequence[FileRow]:
    """Return rows whose balls are identified by number or location, artefact by artefact."""
    positions = {name: k for k, name in enumerate(design.positions.names)}
    if findings.asked or any(row.texts[0] not in positions for row in rows):
        return rows
    artefacts = np.array([design.positions.artefact[positions[row.texts[0]]] for row in rows])
    matched = list(rows)
    for artefact in np.unique(artefacts):
        members = np.flatnonzero(artefacts == artefact)
        balls = design.balls.of(artefact)
        names_known = [design.balls.names[b] for b in balls]
        of_own = [rows[i] for i in members.tolist()]
        used = list(dict.fromkeys(row.texts[1] for row in of_own))
        if 2 * sum(name not in names_known for name in used) <= len(used):
            continue
        names = _by_number(of_own, used, balls, design, places is None, findings) or _by_place(
            of_own, used, balls, design, places, findings
        )
        for i, row in zip(members, _renamed(of_own, 1, names), strict=True):
            matched[i] = row
    return matched


def _order_read(design: Design, artefact_balls: Integers) -> Integers:
    """Return the balls of an artefact in the order in which its positions read them; empty if
    these differ.
    """
    orders = []
    for k in range(len(design.positions.names)):
        balls_read = design.readings.ball[design.readings.position == k]
        order = tuple(dict.fromkeys(int(b) for b in balls_read if b in artefact_balls))
        if order:
            orders.append(order)
    if len(set(orders)) != 1 or len(orders[0]) < len(artefact_balls):
        # Where not all read all balls, the artefact's own order is meant if none departs from it.
        if all(list(order) == sorted(order) for order in orders):
            return artefact_balls
        return np.zeros(0, np.int64)
    return np.array(orders[0])


def _by_number(
    rows: Sequence[FileRow],
    used: Sequence[str],
    balls: Integers,
    design: Design,
    in_part: bool,
    findings: Names,
) -> dict[str, str]:
    """Match balls by number in reading order, if the readings then fit the artefact as planned, or
    with the axes of the artefact where they are `in_part` co-ordinates.
    """
    numbers, order = _numbers(used, len(balls)), _order_read(design, balls)
    if numbers is None or not len(order):
        return {}
    limit = BY_PLACE * _pitch(design.balls.places[balls])
    for name in dict.fromkeys(row.texts[0] for row in rows):
        for probe in dict.fromkeys(row.texts[2] for row in rows if row.texts[0] == name):
            rows_of_name = [row for row in rows if row.texts[0] == name and row.texts[2] == probe]
            places = design.balls.places[[order[numbers[row.texts[1]]] for row in rows_of_name]]
            seen_places = np.array([row.lengths[: design.dimension] for row in rows_of_name])
            if not fixes_pose(places):
                continue
            rotation, origin = fit_motion(places, seen_places)
            apart = np.sqrt(((places @ rotation.T + origin - seen_places) ** 2).sum(axis=1))
            # Most of them: a single wrong reading is no other numbering.
            if float(np.median(apart)) > limit:
                return {}
            # Of a symmetrical artefact turned otherwise, locations do not confirm its numbering.
            planned = design.positions.rotations[design.positions.names.index(name)]
            expected = np.eye(design.dimension) if in_part else planned
            if float(np.abs(rotation - expected).max()) > AS_PLANNED:
                return {}
    names = {name: design.balls.names[order[k]] for name, k in numbers.items()}
    findings.told.append(f"balls matched by number in reading order: {_pairs(names)}")
    return names


def _by_place(
    rows: Sequence[FileRow],
    used: Sequence[str],
    balls: Integers,
    design: Design,
    places: Places | None,
    findings: Names,
) -> dict[str, str]:
    """Match balls by the nearest nominal location, if each name has a different one."""
    names_known = [design.balls.names[b] for b in balls]
    strange = quoted(name for name in used if name not in names_known)
    text = f"the balls {strange} are not in the experiment, nor numbers in reading order that fit"
    if places is None or len(balls) < 2:
        findings.asked.append(f"{text}; write the names that it has: {listing(names_known)}")
        return {}
    limit = BY_PLACE * _pitch(design.balls.places[balls])
    index = {name: k for k, name in enumerate(design.positions.names)}
    names: dict[str, str] = {}
    for position in dict.fromkeys(row.texts[0] for row in rows):
        rows_of_position, k = [row for row in rows if row.texts[0] == position], index[position]
        nominal = nominal_places(design, k, balls)
        apart, nearest = _nearest(places(rows_of_position), nominal)
        for row, distance, ball in zip(rows_of_position, apart, nearest, strict=True):
            if distance > limit:
                shown = (format_length(float(f"{amount:.3g}")) for amount in (distance, limit))
                findings.asked.append(
                    f'{text}; "{shorten(row.texts[1])}" in {position} is {next(shown)} from the'
                    f" nearest ball, and may be {next(shown)}; write the names that it has"
                )
                return {}
            if names.setdefault(row.texts[1], names_known[ball]) != names_known[ball]:
                findings.asked.append(
                    f'{text}; "{shorten(row.texts[1])}" is {names[row.texts[1]]} in one position'
                    f" and {names_known[ball]} in {position} by its location; write names of the"
                    " experiment"
                )
                return {}
    # Names by nominal co-ordinates are others in each position.
    used_once = {(row.texts[0], row.texts[2], row.texts[1]) for row in rows}
    if len({(p, q, names[ball]) for p, q, ball in used_once}) < len(used_once):
        findings.asked.append(f"{text}; two have the same planned location")
        return {}
    findings.told.append(
        f"balls matched by location, within {format_length(float(f'{limit:.3g}'))} of the planned"
        f" one: {_pairs(names)}"
    )
    return names
