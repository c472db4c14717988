"""Headings of a table of readings: roles, co-ordinates of probes, and units."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property

from ballplate.simulator.experiment import ColumnsSettings
from ballplate.simulator.inputs import hint, listing, shorten

from .heading_words import (
    AXIS_WORDS,
    LESS_CLEAR,
    LONGEST,
    MEASURED,
    NOMINAL,
    VALUES,
    WORDS,
    folded,
    heading,
    is_clock,
    quoted,
    unit_of_further,
)
from .uncertainty_headings import FACTORS, headed_uncertainty

# Roles of columns of text.
TEXTS = ("position", "ball", "probe")


class HeadingError(ValueError):
    """A line of headings with a fault; the text describes it."""


@dataclass(frozen=True)
class HeadedColumn:
    """A column by its index, with the unit in its heading; or the `constant` of all rows."""

    place: int
    unit: str | None = None
    constant: str | None = None


@dataclass(frozen=True)
class Group:
    """Columns of the co-ordinates of one reading: `axes` and the texts in their headings."""

    axes: tuple[HeadedColumn, ...]
    texts: Mapping[str, str]


@dataclass(frozen=True)
class Headings:
    """Columns of a table: by role, and of co-ordinates in `groups`, several in a wide table.

    `cells` are the headings, empty in a table without; `unused` those of unused columns. `by_axis`
    are the columns of axis and value of one row per axis, joined with co-ordinates behind the rest.
    `nominal` are the columns of nominal co-ordinates of a table without names of balls.
    """

    roles: Mapping[str, HeadedColumn]
    groups: tuple[Group, ...]
    cells: tuple[str, ...]
    by_axis: tuple[int, int] | None = None
    nominal: tuple[int, ...] = ()

    @cached_property
    def used(self) -> frozenset[int]:
        """Indices of the columns in use."""
        columns = *self.axes, *self.places.values(), *(self.by_axis or ()), *self.nominal
        return frozenset(columns)

    @property
    def axes(self) -> list[int]:
        """Indices of the columns of co-ordinates."""
        return [axis.place for group in self.groups for axis in group.axes]

    @property
    def places(self) -> dict[str, int]:
        """Indices of the other columns, by role."""
        return {
            role: column.place for role, column in self.roles.items() if column.constant is None
        }

    def name(self, place: int) -> str:
        """The heading of a column, or its number without one."""
        return self.cells[place] if self.cells else str(place + 1)

    @property
    def unused(self) -> tuple[str, ...]:
        return tuple(cell for i, cell in enumerate(self.cells) if cell and i not in self.used)


@dataclass(frozen=True)
class Vocabulary:
    """Names in headings: probes and positions, columns `stated`, and `further` ones of numbers,
    with their permitted units. The axes `empty` may have empty entries.
    """

    axes: tuple[str, ...]
    probes: tuple[str, ...]
    positions: tuple[str, ...]
    stated: ColumnsSettings | None = None
    further: Mapping[str, Mapping[str, Fraction]] = field(default_factory=dict)
    empty: Collection[str] = ()

    @cached_property
    def beside_axes(self) -> dict[str, dict[str, str]]:
        """Texts, folded, that a heading may contain with an axis, and the parts of a reading they
        state.
        """
        names_by_cell: dict[str, dict[str, str]] = {"": {}}
        probes = {folded(name): {"probe": name} for name in self.probes}
        positions = {folded(name): {"position": name} for name in self.positions}
        names_by_cell |= {word: texts for word, texts in (probes | positions).items() if word}
        if len(probes) * len(positions) <= 10_000:
            for position_name, texts in positions.items():
                for probe_name, more in probes.items():
                    names_by_cell |= {
                        f"{position_name} {probe_name}": texts | more,
                        f"{probe_name} {position_name}": texts | more,
                    }
        return names_by_cell


def read_headings(cells: Sequence[str], words: Vocabulary) -> Headings | None:
    """Return the columns that a line names, if it names co-ordinates.

    :raises HeadingError: it does so ambiguously, or lacks a stated column.
    """
    parsed = [heading(cell) for cell in cells]
    groups, by_axis = _stated_groups(cells, words) or _found_groups(cells, words), None
    if groups is None:
        if (by_axis := _axis_and_value(cells, words)) is None:
            return None
        unit = parsed[by_axis[1]][1]
        added = range(len(cells), len(cells) + len(words.axes))
        groups = (Group(tuple(HeadedColumn(i, unit) for i in added), {}),)
    columns_taken = {axis.place for group in groups for axis in group.axes} | {*(by_axis or ())}
    roles = _stated_roles(cells, words)
    columns_taken.update(column.place for column in roles.values())
    for name, units in words.further.items():
        units_found = {
            i: unit
            for i, cell in enumerate(cells)
            if (unit := unit_of_further(cell, name)) is not None
        }
        if (i := _only(name, list(units_found), cells)) is not None:
            if name.startswith("u_") and cells[i].lstrip().startswith("U"):
                text = f'"{shorten(cells[i])}" does not say which uncertainty it is; call it'
                raise HeadingError(f"{text} {name}_um if it is a standard one, or something else")
            unit = units_found[i]
            is_time = is_clock(unit, units)
            if not is_time and unit not in units:
                text = f'the unit in the column "{shorten(cells[i])}" is not known'
                raise HeadingError(f"{text}; write {listing(units)}")
            roles[name] = HeadedColumn(i, None if is_time else unit)
            columns_taken.add(i)
    for words_of in (WORDS, LESS_CLEAR):
        for role, words_known in words_of.items():
            if role in roles:
                continue
            places = [
                i
                for i, (name, _) in enumerate(parsed)
                if name in words_known and i not in columns_taken
            ]
            if (place := _only(role, places, cells)) is not None:
                roles[role] = HeadedColumn(place, parsed[place][1])
                columns_taken.add(place)
    if "u" in roles:
        _refuse_expanded(roles["u"], cells)
    else:
        roles |= _uncertainty(cells, columns_taken)
    names = (f"{cells[by_axis[1]]} {axis}" for axis in words.axes) if by_axis else ()
    nominal = () if "ball" in roles else _nominal(parsed, words)
    return Headings(roles, groups, (*cells, *names), by_axis, nominal)


def _nominal(parsed: Sequence[tuple[str, str | None]], words: Vocabulary) -> tuple[int, ...]:
    """Return the columns of nominal co-ordinates, if there is one of each axis."""
    columns: dict[str, int] = {}
    for i, (name, _) in enumerate(parsed):
        parts = name.split()
        axes = [part for part in parts if part in words.axes]
        if len(axes) == 1 and {*parts} & {*NOMINAL} and {*parts} <= {*axes, *NOMINAL, *MEASURED}:
            columns.setdefault(axes[0], i)
    return tuple(columns[axis] for axis in words.axes if len(columns) == len(words.axes))


def _axis_and_value(cells: Sequence[str], words: Vocabulary) -> tuple[int, int] | None:
    """Return the columns of axes and of values of a table of one row per axis, if it is one.

    :raises HeadingError: several columns could be one of them.
    """
    columns: list[int | None] = []
    for role, known in (("axis", AXIS_WORDS), ("value", VALUES)):
        stated = getattr(words.stated, role, None)
        names = [(i, heading(cell)[0].split()) for i, cell in enumerate(cells)]
        places = [i for i, name in names if name and {*known}.issuperset(name)]
        if stated is not None:
            places = [_stated_column(stated, cells).place]
        columns.append(_only(role, places, cells))
    of_axes, of_values = columns
    return None if of_axes is None or of_values is None else (of_axes, of_values)


def _uncertainty(cells: Sequence[str], columns_taken: set[int]) -> dict[str, HeadedColumn]:
    """The column u of uncertainties by what its heading says, and k of their coverage factors where
    they are expanded.

    :raises HeadingError: several columns could be it, or one does not say which uncertainty it is.
    """
    headings_found = {
        i: headed
        for i, cell in enumerate(cells)
        if i not in columns_taken
        and len(cell) <= LONGEST
        and (headed := headed_uncertainty(cell, heading)) is not None
    }
    for kind in ("standard", "expanded", "unclear"):
        places = [i for i, headed in headings_found.items() if headed[0] == kind]
        if (place := _only("u", places, cells)) is not None:
            break
    else:
        return {}
    named, (_, factor, stated_unit) = shorten(cells[place]), headings_found[place]
    unit = stated_unit or "um"
    column = {"u": HeadedColumn(place, stated_unit)}
    if kind == "standard":
        return column
    factors = [
        i
        for i, cell in enumerate(cells)
        if i not in columns_taken and i != place and heading(cell)[0] in FACTORS
    ]
    if kind == "unclear" and (factor is not None or not factors):
        raise HeadingError(
            f'"{named}" does not say which uncertainty it is; call it standard_uncertainty_{unit},'
            f" or expanded_uncertainty_{unit} beside a column k, or something else where it is"
            " none; or name it as the standard uncertainty under readings:"
            f" {{columns: {{u: {named}}}}}"
        )
    if len(factors) + (factor is not None) > 1:
        raise HeadingError(
            f'the coverage factor of "{named}" is stated more than once; keep only one'
        )
    if not factors and factor is None:
        raise HeadingError(
            f'"{named}" has no coverage factor; add a column k, or write it in the heading, as in'
            f" expanded_uncertainty (k=2) [{unit}]"
        )
    return column | {"k": HeadedColumn(factors[0] if factors else -1, constant=factor)}


def _refuse_expanded(column: HeadedColumn, cells: Sequence[str]) -> None:
    """Refuse a column named in the experiment file whose heading says that it is expanded.

    :raises HeadingError: it does.
    """
    cell = cells[column.place][:LONGEST] if column.place >= 0 else ""
    headed = headed_uncertainty(cell, heading)
    if headed is not None and headed[0] == "expanded":
        raise HeadingError(
            f'"{shorten(cell)}" is an expanded uncertainty, and readings: columns: u names standard'
            " uncertainties; remove u there: the heading suffices"
        )


def numbered_columns(words: Vocabulary, count: int) -> Headings:
    """Return the columns of a table without headings, all stated by number.

    :raises HeadingError: some are not.
    """
    cells = [""] * count
    groups = _stated_groups(cells, words)
    if groups is None:
        raise HeadingError(
            "without headings, give the numbers of columns: readings: {columns: {position: 1, ball:"
            " 2, x: 3, y: 4, z: 5}}"
        )
    return Headings(_stated_roles(cells, words), groups, ())


def _stated_roles(cells: Sequence[str], words: Vocabulary) -> dict[str, HeadedColumn]:
    return {
        role: _stated_column(name, cells)
        for role in (*TEXTS, "u")
        if (name := getattr(words.stated, role, None)) is not None
    }


def _only(role: str, places: Sequence[int], cells: Sequence[str]) -> int | None:
    """Return the one column that could be of a role; None without any.

    :raises HeadingError: several could be.
    """
    named = [cells[i] for i in places]
    if len(named) < 2:
        return places[0] if places else None
    if len(set(named)) == 1:
        raise HeadingError(_twice(role, named[0]))
    raise HeadingError(
        f"the columns {quoted(named)} could all be {role}; say which: readings: {{columns:"
        f" {{{role}: {shorten(named[0])}}}}}"
    )


def _twice(role: str, cell: str) -> str:
    return (
        f'the heading "{shorten(cell)}" occurs more than once, and could be {role}; correct it, or'
        f" give the number of the right column: readings: {{columns: {{{role}: …}}}}"
    )


def _stated_column(name: str, cells: Sequence[str]) -> HeadedColumn:
    """Return the column that the experiment file names, exactly, without its unit, or by its
    number.

    :raises HeadingError: it does not exist.
    """
    if name.startswith("="):
        return HeadedColumn(-1, constant=name[1:].strip())
    exact = [i for i, cell in enumerate(cells) if cell == name]
    alike = [i for i, cell in enumerate(cells) if name and heading(cell)[0] == folded(name)]
    for places in (exact, alike):
        if len(places) > 1:
            raise HeadingError(f'{len(places)} columns are called "{name}"; give the number of one')
        if places:
            return HeadedColumn(places[0], heading(cells[places[0]])[1])
    if re.fullmatch("[0-9]{1,9}", name) and 1 <= int(name) <= len(cells):
        return HeadedColumn(int(name) - 1, heading(cells[int(name) - 1])[1])
    there = hint(name, filter(None, cells))
    raise HeadingError(f'there is no column "{shorten(name)}"; {there}')


def _stated_groups(cells: Sequence[str], words: Vocabulary) -> tuple[Group, ...] | None:
    """Return groups of co-ordinates whose columns the experiment file names, if it names any.

    :raises HeadingError: it names missing columns, or only some.
    """
    columns_stated = {axis: getattr(words.stated, axis, None) for axis in words.axes}
    columns_given = {
        axis: columns for axis, columns in columns_stated.items() if columns is not None
    }
    if not columns_given:
        return None
    of_probes = [
        set(columns) if isinstance(columns, dict) else {""} for columns in columns_given.values()
    ]
    if any(probes != of_probes[0] for probes in of_probes):
        raise HeadingError("columns of x, y and z are of different probes; name the same")
    parsed = [heading(cell) for cell in cells]
    groups = []
    for probe in sorted(of_probes[0]):
        axes = []
        for axis in words.axes:
            named = columns_given.get(axis, axis)
            name = named[probe] if isinstance(named, dict) else named
            places = [i for i, (word, _) in enumerate(parsed) if word == axis]
            if axis not in columns_given and len(places) == 1:
                axes.append(HeadedColumn(places[0], parsed[places[0]][1]))
            elif name.startswith("="):
                raise HeadingError(f"{axis} is a co-ordinate of each reading; name its column")
            else:
                axes.append(_stated_column(name, cells))
        groups.append(Group(tuple(axes), {"probe": probe} if probe else {}))
    return tuple(groups)


def _found_groups(cells: Sequence[str], words: Vocabulary) -> tuple[Group, ...] | None:
    """Return groups of co-ordinates by the texts of headings next to an axis, if one is complete.

    :raises HeadingError: two columns could be the same co-ordinate.
    """
    parsed = [heading(cell) for cell in cells]
    columns_by_group: dict[str, dict[str, list[int]]] = {}
    for i, (name, _) in enumerate(parsed):
        parts = name.split()
        for k, axis in enumerate(parts):
            if axis not in words.axes:
                continue
            other_parts = [*parts[:k], *parts[k + 1 :]]
            beside = " ".join(other_parts)
            if beside not in words.beside_axes:
                beside = " ".join(word for word in other_parts if word not in MEASURED)
            if beside in words.beside_axes:
                columns_by_group.setdefault(beside, {}).setdefault(axis, []).append(i)
    groups = {
        beside: axes for beside, axes in columns_by_group.items() if set(axes) == set(words.axes)
    }
    if not groups:
        # With one axis missing, the heading of another stands where it should be.
        for axes in columns_by_group.values():
            for axis, places in axes.items():
                named = [cells[i] for i in places]
                if len(axes) == len(words.axes) - 1 and len(named) > len(set(named)):
                    raise HeadingError(_twice(axis, named[0]))
        return None
    for axes in groups.values():
        for axis, places in axes.items():
            _only(axis, places, cells)
    if "" in groups and len(groups) > 1:
        names = listing(beside for beside in groups if beside)
        raise HeadingError(
            f"there are plain co-ordinates and those of {names}; name the columns to use under"
            " readings: columns"
        )
    if "" not in groups and len(groups) < len(columns_by_group):
        names = listing(
            beside or "the others" for beside in columns_by_group if beside not in groups
        )
        text = f"not all of {listing(words.axes)} are there of {names}"
        raise HeadingError(f"{text}; add the others, or name those meant under readings: columns")
    return tuple(
        Group(
            tuple(HeadedColumn(axes[axis][0], parsed[axes[axis][0]][1]) for axis in words.axes),
            words.beside_axes[beside],
        )
        for beside, axes in groups.items()
    )
