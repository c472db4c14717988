"""Rows of a store, each checked; of a damaged file, those that can still be read."""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import numpy as np
from ballplate.simulator.inputs import in_lines
from ballplate.simulator.machines import Array, Integers
from ballplate.uncertainty import RECORDED_IF_TOLD
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    FiniteFloat,
    TypeAdapter,
    ValidationError,
)

from .store_columns import is_reserved

# Columns of a table that are no figures.
OWN = ("cell", "status", "reason", "data_set_seed", "fingerprint", "duration_s")

# Rows that cannot be read one behind the other, after which no further ones are looked for.
MOST_MISSES = 2000

OF_RESULT = "block, status, reason, seed, seconds, names, versions, figures, details, tally"
OTHER_CONTENT = "its content is not what was stored"


class UnreadableError(Exception):
    """A row cannot be read; the text says why."""


def _names(found: list[str]) -> tuple[str, ...]:
    """Names of figures.

    :raises ValueError: some are none, or are there twice.
    """
    if len(set(found)) < len(found) or not all(map(_is_figure, found)):
        raise ValueError
    return tuple(found)


def _is_figure(name: str) -> bool:
    is_own = name in OWN or name.endswith("_version")
    told = tuple(f"{symbol}_" for symbol in RECORDED_IF_TOLD)
    return name.isprintable() and not is_own and (is_reserved(name) or name.startswith(told))


Plain = Annotated[str, AfterValidator(in_lines)]


class _Kept(BaseModel):
    model_config = ConfigDict(strict=True, extra="ignore")


class _Axis(_Kept):
    name: Plain
    column: Plain
    unit: Literal["m", "rad", "1", ""]
    labels: Annotated[list[Plain], Field(min_length=1)]
    values: list[FiniteFloat]


class _Definition(_Kept):
    title: Plain
    source: str
    base: str
    sweep: Any
    experiment: Any
    files: dict[str, str]
    axes: Annotated[list[_Axis], Field(min_length=1)]
    cells: Annotated[list[list[Annotated[int, Field(ge=0)]]], Field(min_length=1)]
    trials: int | None
    seed: int
    record: list[Plain]


class _Details(_Kept):
    undetermined: list[Plain] = []
    weak: list[Plain] = []
    largest_at: dict[Plain, Plain] = {}
    monte_carlo: Plain = ""
    not_converged: list[int] = []
    flags: dict[Plain, list[Plain]] = {}


STRICT = ConfigDict(strict=True)
_VERSIONS: TypeAdapter[Any] = TypeAdapter(dict[Plain, Plain], config=STRICT)
_NAMES: TypeAdapter[Any] = TypeAdapter(Annotated[list[str], AfterValidator(_names)], config=STRICT)


def digest_of(*values: object) -> bytes:
    """A hash of a row's values, with their types and lengths, by which damage is noticed.

    >>> digest_of("ab", 1) == digest_of("a", "b1")
    False
    """
    found = hashlib.blake2b(digest_size=16)
    for value in values:
        content = value if isinstance(value, bytes) else str(value).encode("utf-8", "surrogatepass")
        found.update(f"{type(value).__name__} {len(content)} ".encode())
        found.update(content)
    return found.digest()


def _refuse(name: str) -> None:
    raise ValueError(f"{name} is no number of JSON")


_DECODER = json.JSONDecoder(parse_constant=_refuse)


def json_of(text: object) -> Any:
    """What a text of JSON says.

    :raises UnreadableError: no text, no JSON, or numbers that are none.
    """
    if not isinstance(text, str):
        raise UnreadableError("no text")
    try:
        return _DECODER.decode(text)
    except (ValueError, RecursionError):
        raise UnreadableError("no JSON") from None


def checked_definition(number: object, text: object, digest: object) -> dict[str, Any]:
    """A sweep's definition, in the form that `bundle.definition` gives it; its words without
    control characters.

    :raises UnreadableError: not in that form, or not as it was stored.
    """
    if digest is not None and digest != digest_of(number, text):
        raise UnreadableError(OTHER_CONTENT)
    found = json_of(text)
    try:
        kept = _Definition.model_validate(found)
    except (ValidationError, RecursionError) as error:
        first = (
            error.errors(include_url=False)[0]
            if isinstance(error, ValidationError)
            else {"loc": (), "msg": "?"}
        )
        place = ".".join(map(str, first["loc"]))
        raise UnreadableError(f"{place}: {first['msg']}") from None
    for axis in kept.axes:
        if axis.unit and len(axis.values) != len(axis.labels):
            raise UnreadableError(
                f"the axis {axis.name} has {len(axis.labels)} labels and {len(axis.values)} values"
            )
    columns = [axis.column for axis in kept.axes]
    if len(set(columns)) < len(columns) or any(map(is_reserved, columns)):
        raise UnreadableError("the axes have no columns of their own")
    counts = [len(axis.labels) for axis in kept.axes]
    for cell in kept.cells:
        if len(cell) != len(counts) or any(
            k >= count for k, count in zip(cell, counts, strict=True)
        ):
            raise UnreadableError("cells has values that the axes do not have")
    axes = [axis.model_dump() for axis in kept.axes]
    return {**found, "title": kept.title, "axes": axes, "record": kept.record}


@dataclass(frozen=True)
class StoredRow:
    """A result as it is stored; `figures` are 64-bit numbers, one for each of the `names`."""

    number: int
    key: str
    status: str
    reason: str
    seed: int
    seconds: float
    names: tuple[str, ...]
    versions: dict[str, str]
    figures: bytes
    details: dict[str, Any]


@dataclass
class Texts:
    """Texts of a store by number, and what was made of them: names of figures, and versions."""

    raw: dict[int, str]
    made: dict[tuple[int, str], Any] = field(default_factory=dict)

    def names_of(self, number: object) -> tuple[str, ...]:
        """Names of the figures of a row.

        :raises UnreadableError: no such text, or no names of figures.
        """
        found: tuple[str, ...] = self._made(number, "the names of its figures", _NAMES)
        return found

    def versions_of(self, number: object) -> dict[str, str]:
        """Versions that a row was computed with.

        :raises UnreadableError: no such text, or no versions.
        """
        what = "the versions that it was computed with"
        found: dict[str, str] = self._made(number, what, _VERSIONS)
        return found

    def _made(self, number: object, what: str, form: TypeAdapter[Any]) -> Any:
        if not isinstance(number, int) or number not in self.raw:
            raise UnreadableError(f"{what} are not there")
        if (number, what) not in self.made:
            try:
                self.made[number, what] = form.validate_python(json_of(self.raw[number]))
            except (UnreadableError, ValidationError):
                raise UnreadableError(f"{what} are none") from None
        return self.made[number, what]


def check_key(sweep: int, number: object, key: object, digest: object) -> None:
    """Check that an entry of a cell is as it was stored.

    :raises UnreadableError: it is not.
    """
    if not isinstance(number, int) or not isinstance(key, str) or not key.isprintable():
        raise UnreadableError("its entry is no number and key")
    if digest is not None and digest != digest_of(sweep, number, key):
        raise UnreadableError(OTHER_CONTENT)


def checked_row(number: int, key: str, raw: tuple[Any, ...], texts: Texts) -> StoredRow:
    """A row as it was stored: of the columns `OF_RESULT`, and its digest.

    :raises UnreadableError: a value that none can be, or not as it was stored.
    """
    block, status, reason, seed, seconds, names, versions, figures, details, tally, digest = raw
    of_names, of_versions = texts.names_of(names), texts.versions_of(versions)
    if digest is not None:
        kept = (
            key,
            block,
            status,
            reason,
            seed,
            texts.raw[names],
            figures,
            details,
            texts.raw[versions],
            tally,
        )
        if digest != digest_of(*kept):
            raise UnreadableError(OTHER_CONTENT)
    if (
        not isinstance(block, int)
        or block < 0
        or status not in ("done", "failed")
        or not isinstance(reason, str)
    ):
        raise UnreadableError("its block, status or reason is none")
    if not isinstance(seed, int) or not isinstance(seconds, float) or not np.isfinite(seconds):
        raise UnreadableError("its seed or duration is no number")
    if not isinstance(figures, bytes) or len(figures) != 8 * len(of_names):
        raise UnreadableError(f"its figures are not {len(of_names)} numbers")
    if tally is not None and not isinstance(tally, bytes):
        raise UnreadableError("its sums over data sets are none")
    try:
        told = _Details.model_validate(json_of(details)).model_dump(exclude_unset=True)
    except (UnreadableError, ValidationError):
        raise UnreadableError("what was told of it cannot be read") from None
    return StoredRow(
        number, key, status, in_lines(reason), seed, seconds, of_names, of_versions, figures, told
    )


@dataclass(frozen=True)
class StoredResults:
    """StoredResults of a sweep in the order of their cells; those not done yet are left out.

    `unreadable` says of other cells why they are not among them, and `strays` counts entries that
    belong to no cell of the sweep. `damage` is what SQLite finds wrong with the store, empty where
    nothing.
    """

    rows: list[StoredRow]
    unreadable: dict[int, str]
    strays: int = 0
    damage: str = ""

    @property
    def cells(self) -> Integers:
        """Cells (rows,), which count from 0."""
        return np.array([row.number for row in self.rows], np.int64)

    @property
    def keys(self) -> list[str]:
        return [row.key for row in self.rows]

    @property
    def figures(self) -> dict[str, Array]:
        """Figures by name, (rows,) each, NaN where a row has no such figure."""
        figures: dict[str, Array] = {}
        # Rows with the same names make a matrix.
        of_names: dict[int, list[int]] = {}
        for place, row in enumerate(self.rows):
            of_names.setdefault(id(row.names), []).append(place)
        for places in of_names.values():
            content = b"".join(self.rows[place].figures for place in places)
            matrix = np.frombuffer(content, "<f8").reshape(len(places), -1)
            for k, name in enumerate(self.rows[places[0]].names):
                figures.setdefault(name, np.full(len(self.rows), np.nan))[places] = matrix[:, k]
        return figures


def texts_of(connection: sqlite3.Connection) -> Texts:
    """All texts of a store.

    :raises sqlite3.Error: they cannot be read.
    """
    return Texts(dict(connection.execute("SELECT id, value FROM text").fetchall()))


def _salvaged_texts(connection: sqlite3.Connection) -> Texts:
    found: dict[int, str] = {}
    # The index holds them a second time.
    for source in ("text NOT INDEXED", "text INDEXED BY sqlite_autoindex_text_1"):
        try:
            for number, value in connection.execute(f"SELECT id, value FROM {source}"):
                found.setdefault(number, value)
        except sqlite3.DatabaseError:
            continue
    return Texts(found)


def read_rows(
    connection: sqlite3.Connection, sweep: int, count: int, has_digests: bool
) -> StoredResults:
    """The rows of the first `count` cells of a sweep, from a database that is sound.

    :raises sqlite3.Error: it is not, or cannot be read.
    """
    texts = texts_of(connection)
    rows: list[StoredRow] = []
    unreadable: dict[int, str] = {}
    strays = 0
    of_cell, of_result = ("cell.digest", "result.digest") if has_digests else ("NULL", "NULL")
    found = connection.execute(
        f"SELECT number, cell.key, {of_cell}, result.key, {OF_RESULT}, {of_result} FROM cell LEFT"
        " JOIN result ON result.key = cell.key AND block = 0 WHERE sweep = ? ORDER BY number",
        [sweep],
    )
    for number, key, digest, is_there, *raw in found:
        if not isinstance(number, int) or not 0 <= number < count:
            strays += 1
            continue
        try:
            check_key(sweep, number, key, digest)
            if is_there is not None:
                rows.append(checked_row(number, key, tuple(raw), texts))
        except UnreadableError as error:
            unreadable[number] = str(error)
    if len(rows) + len(unreadable) < count:
        # The rows of cells that seem not to be done may be there, under keys or blocks that are no
        # longer theirs.
        query = (
            f"SELECT key, {OF_RESULT}, {of_result} FROM result WHERE block = 0 AND key NOT IN"
            " (SELECT key FROM cell) OR typeof(block) <> 'integer' OR block < 0"
        )
        for key, *raw in connection.execute(query):
            try:
                checked_row(0, key, tuple(raw), texts)
            except UnreadableError:
                strays += 1
    return StoredResults(rows, unreadable, strays)


def salvaged_rows(
    connection: sqlite3.Connection, sweep: int, count: int, has_digests: bool
) -> StoredResults:
    """The rows of a sweep that can be read in a damaged database, each looked for by itself."""
    texts = _salvaged_texts(connection)
    digest = "digest" if has_digests else "NULL"
    # Of block 0 by key, as far as the pages of their table can be read.
    by_key = {key: tuple(raw) for key, *raw in _walked(connection, digest) if raw[0] == 0}
    rows: list[StoredRow] = []
    unreadable: dict[int, str] = {}
    for number in range(count):
        try:
            query = f"SELECT key, {digest} FROM cell WHERE sweep = ? AND number = ?"
            cell = connection.execute(query, [sweep, number]).fetchone()
            if cell is None:
                unreadable[number] = "no entry of it is found"
                continue
            check_key(sweep, number, *cell)
            raw = by_key.get(cell[0]) or _of_index(connection, cell[0], digest)
            rows.append(checked_row(number, cell[0], raw, texts))
        except (sqlite3.DatabaseError, UnreadableError) as error:
            unreadable[number] = str(error)
    return StoredResults(rows, unreadable)


def _of_index(connection: sqlite3.Connection, key: str, digest: str) -> tuple[Any, ...]:
    query = f"SELECT {OF_RESULT}, {digest} FROM result WHERE key = ? AND block = 0"
    found = connection.execute(query, [key]).fetchone()
    if found is None:
        raise UnreadableError("no result of it is found")
    return tuple(found)


def _walked(connection: sqlite3.Connection, digest: str) -> Iterator[tuple[Any, ...]]:
    query = (
        f"SELECT rowid, key, {OF_RESULT}, {digest} FROM result NOT INDEXED WHERE rowid > ? ORDER BY"
        " rowid"
    )
    place, misses = 0, 0
    while misses < MOST_MISSES:
        try:
            for row in connection.execute(query, [place]):
                place, misses = row[0], 0
                yield tuple(row[1:])
            return
        except sqlite3.DatabaseError:
            # Behind the page that cannot be read there may be others.
            place, misses = place + 1, misses + 1
