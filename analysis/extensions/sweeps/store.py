"""The store of a sweep: one SQLite file, written by one process, that survives interruptions.

Every row is on disk before it is reported. The key of a result is the fingerprint of what was
computed, and the replicate block; so a cell that was computed once is never computed again,
whichever sweep file asks for it, unless a later version computes by another method.
"""

from __future__ import annotations

import json
import os
import sqlite3
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from itertools import count as numbers_from
from pathlib import Path
from typing import Any

import numpy as np
from ballplate.montecarlo import Accumulator, QuantityAccumulator
from ballplate.simulator.inputs import in_one_line

from .fingerprint import METHOD, METHODS, method_of
from .load import MOST_CELLS
from .store_file import (
    GO_ON,
    NEWEST,
    WITH_DIGEST,
    StoreError,
    connected,
    damage,
    format_of,
    in_words,
    is_damage,
    unnumbered,
)
from .stored import (
    OF_RESULT,
    StoredResults,
    UnreadableError,
    check_key,
    checked_definition,
    checked_row,
    digest_of,
    read_rows,
    salvaged_rows,
    texts_of,
)
from .task import CellResult

FORMAT = f"ballplate sweep store {NEWEST}"

TABLES = """
CREATE TABLE about (name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE sweep (id INTEGER PRIMARY KEY, definition TEXT NOT NULL, digest BLOB);
CREATE TABLE bundle (
    sweep INTEGER, path TEXT, content BLOB NOT NULL, digest BLOB, PRIMARY KEY (sweep, path)
) WITHOUT ROWID;
CREATE TABLE cell (
    sweep INTEGER, number INTEGER, key TEXT NOT NULL, digest BLOB, PRIMARY KEY (sweep, number)
) WITHOUT ROWID;
CREATE TABLE text (id INTEGER PRIMARY KEY, value TEXT NOT NULL UNIQUE);
CREATE TABLE result (
    key TEXT, block INTEGER, status TEXT NOT NULL, reason TEXT NOT NULL, seed INTEGER NOT NULL,
    names INTEGER NOT NULL REFERENCES text, figures BLOB NOT NULL, details TEXT NOT NULL,
    versions INTEGER NOT NULL REFERENCES text, seconds REAL NOT NULL, tally BLOB, digest BLOB,
    PRIMARY KEY (key, block)
);
"""

COLUMNS = (
    *("key", "block", "status", "reason", "seed", "names", "figures", "details", "versions"),
    *("seconds", "tally", "digest"),
)
INSERT = (
    f"INSERT INTO result ({', '.join(COLUMNS)}) VALUES ({', '.join('?' * len(COLUMNS))})"
    " ON CONFLICT (key, block) DO UPDATE"
    f" SET {', '.join(f'{column} = excluded.{column}' for column in COLUMNS[2:])}"
    " WHERE result.status = 'failed'"
)


@dataclass
class Store:
    """An open store; `texts` are those known by number.

    `has_digests` is False of the first format, `damage` says what showed as it was opened, and
    `place` states the file from another in its place.
    """

    path: Path
    connection: sqlite3.Connection
    has_digests: bool = True
    damage: str = ""
    place: tuple[int, int] | None = None
    texts: dict[str, int] = field(default_factory=dict)

    def close(self) -> None:
        self.connection.close()

    @property
    def digest(self) -> str:
        """The column of digests, or what stands for it."""
        return "digest" if self.has_digests else "NULL"


def open_store(path: Path, create: bool = False) -> Store:
    """Open a store for reading or, with `create`, for writing: it is made where there is none.

    A store of an earlier format is read as it is, and brought to the newest format before it is
    written to.

    :raises StoreError: no such store, a file that is none, or one that is damaged and to be written
        to.
    """
    connection = None
    try:
        connection, wrong = connected(path, create)
        found = format_of(path, connection)
        if create:
            _prepare(path, connection, found)
        elif found is None:
            raise StoreError(f"{path}: is empty; name a store that ballplate sweep has made")
        place = os.stat(path)
        return Store(path, connection, create or found != 1, wrong, (place.st_dev, place.st_ino))
    except (sqlite3.Error, UnicodeDecodeError, OSError, StoreError) as error:
        if connection is not None:
            connection.close()
        if isinstance(error, UnicodeDecodeError):
            # Of what SQLite says about names that are no text.
            raise StoreError(
                f"{path}: is damaged (names of its tables are no text); restore a copy"
            ) from None
        if isinstance(error, sqlite3.Error) and create and is_damage(error):
            raise StoreError(f"{path}: is damaged ({error}); {GO_ON}") from None
        if isinstance(error, sqlite3.Error):
            raise in_words(path, error) from None
        raise


def _prepare(path: Path, connection: sqlite3.Connection, found: int | None) -> None:
    """Make the tables of an empty store, and of a store one of the newest format.

    :raises StoreError: the store is damaged.
    """
    if found is not None:
        wrong = damage(connection) or unnumbered(connection)
        if wrong:
            raise StoreError(f"{path}: is damaged ({wrong}); {GO_ON}")
    connection.execute("PRAGMA journal_mode = WAL")
    # What is written is on disk when the call returns.
    connection.execute("PRAGMA synchronous = FULL")
    if found == NEWEST:
        return
    connection.execute("BEGIN IMMEDIATE")
    known = format_of(path, connection)
    if known is None:
        for statement in TABLES.split(";"):
            connection.execute(statement)
        connection.execute("INSERT INTO about VALUES ('format', ?)", [FORMAT])
    elif known == 1:
        for table in WITH_DIGEST:
            connection.execute(f"ALTER TABLE {table} ADD COLUMN digest BLOB")
        connection.execute("UPDATE about SET value = ? WHERE name = 'format'", [FORMAT])
    connection.execute("COMMIT")


def ensure_in_place(store: Store) -> None:
    """Check that the file that is written to is the one that has the store's name.

    :raises StoreError: it was deleted, moved or replaced since it was opened.
    """
    try:
        found = os.stat(store.path)
        is_same = store.place in (None, (found.st_dev, found.st_ino))
        what = "has been replaced by another file"
    except OSError:
        is_same, what = False, "has been deleted or moved"
    if not is_same:
        # SQLite leaves to its log what it wrote to a file that has moved.
        with suppress(sqlite3.Error):
            store.connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        text = (
            "the sweep ends here, and nothing was written to what is there now; if the store was"
            " moved, it has the "
        )
        text += "rows computed until then, and --store continues with it"
        raise StoreError(f"{store.path}: {what} while the sweep ran; {text}")


@contextmanager
def _transaction(store: Store) -> Iterator[sqlite3.Connection]:
    """All or nothing, on disk at the end, in the file that has the store's name.

    :raises StoreError: the disk is full, the file cannot be written, or it is no longer there.
    """
    ensure_in_place(store)
    try:
        store.connection.execute("BEGIN IMMEDIATE")
        try:
            yield store.connection
        except BaseException:
            store.connection.execute("ROLLBACK")
            raise
        store.connection.execute("COMMIT")
    except sqlite3.Error as error:
        store.texts.clear()
        raise in_words(store.path, error) from None
    ensure_in_place(store)


@contextmanager
def _reading(store: Store) -> Iterator[sqlite3.Connection]:
    """What SQLite says while a store is read, in words.

    :raises StoreError: the store cannot be read.
    """
    try:
        yield store.connection
    except sqlite3.Error as error:
        raise in_words(store.path, error) from None


def add_sweep(store: Store, definition: dict[str, Any], files: Iterable[tuple[str, bytes]]) -> int:
    """Enter a sweep's definition and files, and return its number.

    :raises StoreError: the store cannot be written, or a file has a name that is no text.
    """
    files = tuple(files)
    for name, _ in files:
        if not name.isprintable():
            raise StoreError(
                f"{store.path}: cannot keep a file of the name {name}; give it one of printable"
                " characters"
            )
    with _transaction(store) as connection:
        text = json.dumps(definition, sort_keys=True)
        # Of a sweep whose definition is lost there may be cells.
        used = "SELECT id FROM sweep UNION SELECT sweep FROM bundle UNION SELECT sweep FROM cell"
        taken = {one for (one,) in connection.execute(used)}
        number = next(number for number in numbers_from(1) if number not in taken)
        insert = "INSERT INTO sweep (id, definition, digest) VALUES (?, ?, ?)"
        connection.execute(insert, [number, text, digest_of(number, text)])
        connection.executemany(
            "INSERT INTO bundle (sweep, path, content, digest) VALUES (?, ?, ?, ?)",
            [(number, name, content, digest_of(number, name, content)) for name, content in files],
        )
    return number


def definitions(store: Store) -> tuple[dict[int, dict[str, Any]], dict[int, str]]:
    """Definitions of the sweeps of a store by number, and of those that cannot be read why.

    :raises StoreError: the store cannot be read.
    """
    found: dict[int, dict[str, Any]] = {}
    unreadable: dict[int, str] = {}
    with _reading(store) as connection:
        rows = connection.execute(
            f"SELECT id, definition, {store.digest} FROM sweep ORDER BY id"
        ).fetchall()
    for number, text, digest in rows:
        try:
            found[number] = checked_definition(number, text, digest)
        except UnreadableError as error:
            unreadable[number] = str(error)
    return found, unreadable


def definition_of(store: Store, sweep: int) -> dict[str, Any]:
    """Definition of one sweep of the store.

    :raises StoreError: it cannot be read.
    """
    try:
        query = f"SELECT definition, {store.digest} FROM sweep WHERE id = ?"
        row = store.connection.execute(query, [sweep]).fetchone()
        if row is None:
            raise UnreadableError("it is not there")
        return checked_definition(sweep, *row)
    except (sqlite3.DatabaseError, UnreadableError) as error:
        text = (
            f"the definition of sweep {sweep} cannot be read ({error}); ballplate export gives"
            " its cells by their numbers"
        )
        raise StoreError(f"{store.path}: {text}") from None


def chosen_sweep(store: Store, number: int | None) -> int:
    """The number of a sweep of the store: the one asked for, or the newest.

    :raises StoreError: there is no such sweep.
    """
    known: set[int] = set()
    for table, column in (("sweep", "id"), ("cell", "sweep")):
        try:
            found = store.connection.execute(f"SELECT DISTINCT {column} FROM {table}").fetchall()
        except sqlite3.DatabaseError as error:
            if not is_damage(error):
                raise in_words(store.path, error) from None
            continue
        known |= {one for (one,) in found if isinstance(one, int)}
    if not known or (number is not None and number not in known):
        raise StoreError(
            f"{store.path}: there is no such sweep; it has"
            f" {', '.join(map(str, sorted(known))) or 'none'}"
        )
    return max(known) if number is None else number


def files(store: Store, sweep: int) -> tuple[tuple[str, bytes], ...]:
    """Files of a sweep by their path from the common folder.

    :raises StoreError: they cannot be read, or are not as they were stored.
    """
    query = f"SELECT path, content, {store.digest} FROM bundle WHERE sweep = ? ORDER BY path"
    with _reading(store) as connection:
        rows = connection.execute(query, [sweep]).fetchall()
    for name, content, digest in rows:
        is_file = isinstance(name, str) and isinstance(content, bytes)
        if not is_file or (digest is not None and digest != digest_of(sweep, name, content)):
            raise StoreError(f"{store.path}: the file {name} in it is not as it was stored")
    return tuple((name, content) for name, content, _ in rows)


def keys(store: Store, sweep: int) -> dict[int, str]:
    """Keys of the cells that are known, by number."""
    with _reading(store) as connection:
        rows = connection.execute(
            "SELECT number, key FROM cell WHERE sweep = ?", [sweep]
        ).fetchall()
    return {number: key for number, key in rows if isinstance(number, int) and isinstance(key, str)}


def of_other_methods(found: Iterable[str]) -> list[str]:
    """Words for rows with these keys that this version would compute by another method; none where
    there are none.
    """
    told = []
    for method, count in sorted(Counter(map(method_of, found)).items()):
        if method == METHOD:
            continue
        since = [text for number, text in METHODS.items() if method < number <= METHOD and text]
        why = f"before corrections to {'; '.join(since)}" if since else "of a later version"
        rows = f"{count} row{' was' if count == 1 else 's were'} computed by method {method}"
        told.append(f"{rows}, {why}; this version computes by method {METHOD}")
    return told


def statuses(store: Store) -> dict[tuple[str, int], str]:
    """Status of every result by key and block."""
    with _reading(store) as connection:
        rows = connection.execute("SELECT key, block, status FROM result").fetchall()
    return {(key, block): status for key, block, status in rows}


def mend(store: Store, sweep: int, count: int) -> tuple[dict[int, str], int]:
    """Take out what is not as it was stored, so that it is computed anew.

    Of a sweep's cells why, by their number, and how many entries belonged to none of them.

    :raises StoreError: the store cannot be read or written.
    """
    found: dict[int, str] = {}
    strays = 0
    with _transaction(store) as connection:
        texts = texts_of(connection)
        bad: dict[object, str] = {}
        places: list[tuple[int]] = []
        rows = connection.execute(f"SELECT rowid, key, {OF_RESULT}, {store.digest} FROM result")
        for place, key, *raw in rows:
            try:
                if not isinstance(key, str):
                    raise UnreadableError("its key is none")
                checked_row(0, key, tuple(raw), texts)
                if raw[0] and raw[-2] is not None:
                    _unpacked(raw[-2])
            except UnreadableError as error:
                bad[key] = str(error)
                places.append((place,))
        connection.executemany("DELETE FROM result WHERE rowid = ?", places)
        entries = connection.execute(
            f"SELECT sweep, number, key, {store.digest} FROM cell"
        ).fetchall()
        owned = {key for _, _, key, _ in entries}
        for of_sweep, number, key, digest in entries:
            try:
                check_key(of_sweep, number, key, digest)
                reason = bad.get(key, "")
            except UnreadableError as error:
                reason = str(error)
                connection.execute(
                    "DELETE FROM cell WHERE sweep IS ? AND number IS ?", [of_sweep, number]
                )
            if reason and of_sweep == sweep and isinstance(number, int) and 0 <= number < count:
                found[number] = reason
            elif reason:
                strays += 1
    return found, strays + len(bad.keys() - owned)


def add_keys(store: Store, sweep: int, found: dict[int, str]) -> None:
    """Enter what cells' keys are."""
    with _transaction(store) as connection:
        connection.executemany(
            "INSERT OR REPLACE INTO cell (sweep, number, key, digest) VALUES (?, ?, ?, ?)",
            [(sweep, number, key, digest_of(sweep, number, key)) for number, key in found.items()],
        )


def add_rows(store: Store, sweep: int, rows: Iterable[CellResult]) -> None:
    """Write rows: on disk when this returns. A result that is there already stays, unless it had
    failed.
    """
    with _transaction(store) as connection:
        for row in rows:
            of_names, of_versions = json.dumps(list(row.figures)), json.dumps(dict(row.versions))
            names, versions = _text(store, of_names), _text(store, of_versions)
            # Of a file's name there may be characters that no text on disk can have.
            reason = row.reason.encode("utf-8", "backslashreplace").decode()
            figures = np.array(list(row.figures.values()), "<f8").tobytes()
            details = json.dumps(row.details, ensure_ascii=True, sort_keys=True)
            tally = None if row.tally is None else _packed(row.tally)
            first = row.key, row.block, row.status, reason, row.seed
            digest = digest_of(*first, of_names, figures, details, of_versions, tally)
            connection.execute(
                INSERT,
                [*first, names, figures, details, versions, row.seconds, tally, digest],
            )
            connection.execute(
                "INSERT OR REPLACE INTO cell (sweep, number, key, digest) VALUES (?, ?, ?, ?)",
                [sweep, row.number, row.key, digest_of(sweep, row.number, row.key)],
            )
            if row.block == 0 and row.status == "done":
                # The sums over blocks have been used, but for the time that they took.
                spent = "SELECT coalesce(sum(seconds), 0) FROM result WHERE key = ? AND block > 0"
                update = (
                    f"UPDATE result SET seconds = seconds + ({spent}) WHERE key = ? AND block = 0"
                )
                connection.execute(update, [row.key, row.key])
                connection.execute("DELETE FROM result WHERE key = ? AND block > 0", [row.key])


def _text(store: Store, value: str) -> int:
    if value not in store.texts:
        found = store.connection.execute("SELECT id FROM text WHERE value = ?", [value]).fetchone()
        if found is None:
            found = [
                store.connection.execute("INSERT INTO text (value) VALUES (?)", [value]).lastrowid
            ]
        store.texts[value] = int(found[0])
    return store.texts[value]


def block_tally(store: Store, key: str, block: int) -> Accumulator | None:
    """The sums of a replicate block; None where the cell has no replicates for a reason."""
    with _reading(store) as connection:
        row = connection.execute(
            "SELECT tally FROM result WHERE key = ? AND block = ?", [key, block]
        ).fetchone()
    return None if row is None or row[0] is None else _unpacked(row[0])


def _packed(accumulator: Accumulator) -> bytes:
    """Sums as bytes: a line of JSON, then all arrays as 64-bit numbers."""
    arrays = [accumulator.residual]
    for one in accumulator.quantities:
        arrays += [one.errors, one.squares, one.numbers, one.numbers_squared]
    head = {
        "count": accumulator.count,
        "failed": list(accumulator.failed),
        "passes": accumulator.passes,
        "rejected": accumulator.rejected,
        "sizes": [len(array) for array in arrays],
    }
    return json.dumps(head).encode() + b"\n" + np.concatenate(arrays).astype("<f8").tobytes()


def _unpacked(content: bytes) -> Accumulator:
    """The sums that `_packed` made bytes of.

    :raises UnreadableError: it did not.
    """
    line, _, body = content.partition(b"\n")
    try:
        head = json.loads(line)
        arrays = np.split(np.frombuffer(body, "<f8"), np.cumsum(head["sizes"])[:-1])
        if [len(array) for array in arrays] != head["sizes"] or len(arrays) % 4 != 1:
            raise ValueError
        quantities = tuple(
            QuantityAccumulator(*arrays[k : k + 4]) for k in range(1, len(arrays), 4)
        )
        return Accumulator(
            head["count"],
            tuple(head["failed"]),
            head["passes"],
            arrays[0],
            head["rejected"],
            quantities,
        )
    except (ValueError, TypeError, KeyError, IndexError, RecursionError):
        raise UnreadableError("its sums over data sets are none") from None


def results(store: Store, sweep: int, count: int | None = None) -> StoredResults:
    """Results of the first `count` cells of a sweep, or of all; cells that are not done yet are
    left out.

    Each row is checked. Of a damaged store they are the rows that can be read.

    :raises StoreError: the store cannot be read, or nothing of it.
    """
    wrong = store.damage
    try:
        if count is None:
            found = store.connection.execute(
                "SELECT max(number) FROM cell WHERE sweep = ? AND typeof(number) = 'integer'",
                [sweep],
            ).fetchone()[0]
            count = 0 if found is None else min(int(found) + 1, MOST_CELLS)
        reading = read_rows(store.connection, sweep, count, store.has_digests)
        if not wrong and (reading.unreadable or reading.strays or len(reading.rows) < count):
            wrong = damage(store.connection)
    except sqlite3.DatabaseError as error:
        if not is_damage(error):
            raise in_words(store.path, error) from None
        wrong = damage(store.connection) or str(error)
    if wrong:
        reading = salvaged_rows(store.connection, sweep, count or 0, store.has_digests)
    if (wrong or reading.unreadable) and not reading.rows:
        why = wrong or next(iter(reading.unreadable.values()))
        text = (
            f"none of its cells can be read ({why}); restore a copy, or start anew with ballplate"
            " sweep --store"
        )
        raise StoreError(f"{store.path}: is damaged: {text} and a new name")
    return replace(reading, damage=wrong)


def unread(
    path: Path, unreadable: dict[int, str], strays: int, count: int, wrong: str, what_next: str
) -> str:
    """Words for what of a store could not be read; empty where everything was."""
    if not unreadable and not strays and not wrong:
        return ""
    cells = sorted(unreadable)
    told = (
        f"{len(cells)} of {count} cells could not be read"
        if cells
        else "what it holds is not all as it was stored"
    )
    if cells:
        some = ", ".join(map(str, cells[:10])) + (
            f" and {len(cells) - 10} more" if len(cells) > 10 else ""
        )
        told += f": {some} ({unreadable[cells[0]]})"
    told += (
        f"; {strays} {'entry belongs' if strays == 1 else 'entries belong'} to no cell"
        if strays
        else ""
    )
    told += f"; SQLite finds: {wrong}" if wrong else ""
    return in_one_line(f"{path}: {told}; {what_next}")
