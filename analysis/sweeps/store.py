"""The store of a sweep: one SQLite file, written by one process, that survives whatever happens to it.

Every row is on disk before it is reported. The key of a result is the fingerprint of what was computed, and the
replicate block; so a cell that was computed once is never computed again, whichever sweep file asks for it, unless a
later version computes by another method.
"""

from __future__ import annotations

import json
import sqlite3
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from ballplate.simulator.machines.protocol import Array, Integers

from ..montecarlo.tally import QuantityTally, Tally
from .fingerprint import METHOD, METHODS, method_of
from .task import Row

FORMAT = "ballplate sweep store 1"

TABLES = """
CREATE TABLE about (name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE sweep (id INTEGER PRIMARY KEY, definition TEXT NOT NULL);
CREATE TABLE bundle (sweep INTEGER, path TEXT, content BLOB NOT NULL, PRIMARY KEY (sweep, path)) WITHOUT ROWID;
CREATE TABLE cell (sweep INTEGER, number INTEGER, key TEXT NOT NULL, PRIMARY KEY (sweep, number)) WITHOUT ROWID;
CREATE TABLE text (id INTEGER PRIMARY KEY, value TEXT NOT NULL UNIQUE);
CREATE TABLE result (
    key TEXT, block INTEGER, status TEXT NOT NULL, reason TEXT NOT NULL, seed INTEGER NOT NULL,
    names INTEGER NOT NULL REFERENCES text, figures BLOB NOT NULL, details TEXT NOT NULL,
    versions INTEGER NOT NULL REFERENCES text, seconds REAL NOT NULL, tally BLOB,
    PRIMARY KEY (key, block)
);
"""

COLUMNS = "key, block, status, reason, seed, names, figures, details, versions, seconds, tally"


class StoreError(Exception):
    """A store cannot be used; the text says why, and what would help."""


@dataclass
class Store:
    """An open store; `texts` are those known by number."""

    path: Path
    connection: sqlite3.Connection
    texts: dict[str, int] = field(default_factory=dict)

    def close(self) -> None:
        self.connection.close()


def open_store(path: Path, create: bool = False) -> Store:
    """Open a store, or make it.

    :raises StoreError: no such store, or a file that is none.
    """
    if not create and not path.is_file():
        raise StoreError(f"{path}: there is no such store; make it with ballplate sweep")
    try:
        connection = _connected(path) if create else _readable(path)
        found = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
        if not found and create:
            connection.execute("BEGIN IMMEDIATE")
            if not connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]:
                for statement in TABLES.split(";"):
                    connection.execute(statement)
                connection.execute("INSERT INTO about VALUES ('format', ?)", [FORMAT])
            connection.execute("COMMIT")
        known = connection.execute("SELECT value FROM about WHERE name = 'format'").fetchone()
    except sqlite3.Error as error:
        raise _told(path, error) from None
    if known is None or known[0] != FORMAT:
        raise StoreError(f"{path}: is no store of this version of ballplate sweep; name one that it has made")
    return Store(path, connection, {})


def _connected(path: Path) -> sqlite3.Connection:
    connection = sqlite3.connect(path, isolation_level=None, timeout=20.0)
    connection.execute("PRAGMA journal_mode = WAL")
    # What is written is on disk when the call returns.
    connection.execute("PRAGMA synchronous = FULL")
    return connection


def _readable(path: Path) -> sqlite3.Connection:
    """A connection that reads only, also where nothing can be written."""
    address = path.resolve().as_uri()
    connection = sqlite3.connect(f"{address}?mode=rw", uri=True, isolation_level=None, timeout=20.0)
    try:
        connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
    except sqlite3.OperationalError:
        # In a place that cannot be written, as long as nobody else writes to the store.
        connection.close()
        connection = sqlite3.connect(f"{address}?immutable=1", uri=True, isolation_level=None)
    connection.execute("PRAGMA query_only = ON")
    return connection


def _told(path: Path, error: sqlite3.Error) -> StoreError:
    text = str(error)
    if "not a database" in text or "no such table" in text or "malformed" in text:
        return StoreError(f"{path}: is no store of ballplate sweep ({text}); name one that it has made")
    if "full" in text or "disk I/O" in text:
        return StoreError(f"{path}: cannot be written ({text}); make room, then start again: nothing done is lost")
    if "locked" in text:
        return StoreError(f"{path}: another process is writing to it; wait for it, or end it")
    return StoreError(f"{path}: cannot be used ({text}); check its name and permissions")


@contextmanager
def _transaction(store: Store) -> Iterator[sqlite3.Connection]:
    """All or nothing, on disk at the end.

    :raises StoreError: the disk is full, or the file cannot be written.
    """
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
        raise _told(store.path, error) from None


def add_sweep(store: Store, definition: dict[str, Any], files: Iterable[tuple[str, bytes]]) -> int:
    """Enter a sweep's definition and files, and return its number."""
    with _transaction(store) as connection:
        text = json.dumps(definition, ensure_ascii=False, sort_keys=True)
        number = int(connection.execute("INSERT INTO sweep (definition) VALUES (?)", [text]).lastrowid or 0)
        connection.executemany(
            "INSERT INTO bundle VALUES (?, ?, ?)", [(number, name, content) for name, content in files]
        )
    return number


def sweeps(store: Store) -> dict[int, dict[str, Any]]:
    """Definitions of the sweeps of a store by number."""
    try:
        rows = store.connection.execute("SELECT id, definition FROM sweep ORDER BY id").fetchall()
    except sqlite3.Error as error:
        raise _told(store.path, error) from None
    return {number: json.loads(text) for number, text in rows}


def definition_of(store: Store, sweep: int) -> dict[str, Any]:
    """Definition of one sweep of the store."""
    return dict(
        json.loads(store.connection.execute("SELECT definition FROM sweep WHERE id = ?", [sweep]).fetchone()[0])
    )


def chosen_sweep(store: Store, number: int | None) -> int:
    """The number of a sweep of the store: the one asked for, or the newest.

    :raises StoreError: there is no such sweep.
    """
    try:
        known = [one for (one,) in store.connection.execute("SELECT id FROM sweep ORDER BY id")]
    except sqlite3.Error as error:
        raise _told(store.path, error) from None
    if not known or (number is not None and number not in known):
        raise StoreError(f"{store.path}: there is no such sweep; it has {', '.join(map(str, known)) or 'none'}")
    return known[-1] if number is None else number


def files(store: Store, sweep: int) -> tuple[tuple[str, bytes], ...]:
    """Files of a sweep by their path from the common folder."""
    rows = store.connection.execute("SELECT path, content FROM bundle WHERE sweep = ? ORDER BY path", [sweep])
    return tuple((name, bytes(content)) for name, content in rows)


def keys(store: Store, sweep: int) -> dict[int, str]:
    """Keys of the cells that are known, by number."""
    return dict(store.connection.execute("SELECT number, key FROM cell WHERE sweep = ?", [sweep]).fetchall())


def methods(store: Store, sweep: int) -> dict[int, int]:
    """How many of a sweep's cells have a result by each method, by its number."""
    rows = store.connection.execute(
        "SELECT cell.key FROM cell JOIN result ON result.key = cell.key AND block = 0 WHERE sweep = ?", [sweep]
    )
    return dict(sorted(Counter(method_of(key) for (key,) in rows).items()))


def of_other_methods(store: Store, sweep: int) -> list[str]:
    """Words for rows that this version would compute by another method; none where there are none."""
    found = []
    for method, count in methods(store, sweep).items():
        if method == METHOD:
            continue
        since = [text for number, text in METHODS.items() if method < number <= METHOD and text]
        why = f"before corrections to {'; '.join(since)}" if since else "of a later version"
        rows = f"{count} row{' was' if count == 1 else 's were'} computed by method {method}"
        found.append(f"{rows}, {why}; this version computes by method {METHOD}")
    return found


def statuses(store: Store) -> dict[tuple[str, int], str]:
    """Status of every result by key and block."""
    rows = store.connection.execute("SELECT key, block, status FROM result")
    return {(key, block): status for key, block, status in rows}


def add_keys(store: Store, sweep: int, found: dict[int, str]) -> None:
    """Enter what cells' keys are."""
    with _transaction(store) as connection:
        connection.executemany(
            "INSERT OR REPLACE INTO cell (sweep, number, key) VALUES (?, ?, ?)",
            [(sweep, number, key) for number, key in found.items()],
        )


def add_rows(store: Store, sweep: int, rows: Iterable[Row]) -> None:
    """Write rows: on disk when this returns. A result that is there already stays, unless it had failed."""
    with _transaction(store) as connection:
        for row in rows:
            names = _text(store, json.dumps(list(row.figures)))
            versions = _text(store, json.dumps(dict(row.versions)))
            connection.execute(
                f"INSERT INTO result ({COLUMNS}) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT (key, block) DO "
                "UPDATE SET status = excluded.status, reason = excluded.reason, seed = excluded.seed, "
                "names = excluded.names, figures = excluded.figures, details = excluded.details, "
                "versions = excluded.versions, seconds = excluded.seconds, tally = excluded.tally "
                "WHERE result.status = 'failed'",
                [
                    row.key,
                    row.block,
                    row.status,
                    row.reason,
                    row.seed,
                    names,
                    np.array(list(row.figures.values()), "<f8").tobytes(),
                    json.dumps(row.details, ensure_ascii=False, sort_keys=True),
                    versions,
                    row.seconds,
                    None if row.tally is None else _packed(row.tally),
                ],
            )
            connection.execute(
                "INSERT OR REPLACE INTO cell (sweep, number, key) VALUES (?, ?, ?)", [sweep, row.number, row.key]
            )
            if row.block == 0 and row.status == "done":
                # The sums over blocks have been used, but for the time that they took.
                spent = "SELECT coalesce(sum(seconds), 0) FROM result WHERE key = ? AND block > 0"
                update = f"UPDATE result SET seconds = seconds + ({spent}) WHERE key = ? AND block = 0"
                connection.execute(update, [row.key, row.key])
                connection.execute("DELETE FROM result WHERE key = ? AND block > 0", [row.key])


def _text(store: Store, value: str) -> int:
    if value not in store.texts:
        found = store.connection.execute("SELECT id FROM text WHERE value = ?", [value]).fetchone()
        if found is None:
            found = [store.connection.execute("INSERT INTO text (value) VALUES (?)", [value]).lastrowid]
        store.texts[value] = int(found[0])
    return store.texts[value]


def block_tally(store: Store, key: str, block: int) -> Tally | None:
    """The sums of a replicate block; None where the cell has no replicates for a reason."""
    row = store.connection.execute("SELECT tally FROM result WHERE key = ? AND block = ?", [key, block]).fetchone()
    return None if row is None or row[0] is None else _unpacked(row[0])


def _packed(tally: Tally) -> bytes:
    """Sums as bytes: a line of JSON, then all arrays as 64-bit numbers."""
    arrays = [tally.residual]
    for one in tally.quantities:
        arrays += [one.errors, one.squares, one.numbers, one.numbers_squared]
    head = {
        "count": tally.count,
        "failed": list(tally.failed),
        "passes": tally.passes,
        "rejected": tally.rejected,
        "sizes": [len(array) for array in arrays],
    }
    return json.dumps(head).encode() + b"\n" + np.concatenate(arrays).astype("<f8").tobytes()


def _unpacked(content: bytes) -> Tally:
    line, _, body = content.partition(b"\n")
    head = json.loads(line)
    arrays = np.split(np.frombuffer(body, "<f8"), np.cumsum(head["sizes"])[:-1])
    quantities = tuple(QuantityTally(*arrays[k : k + 4]) for k in range(1, len(arrays), 4))
    return Tally(head["count"], tuple(head["failed"]), head["passes"], arrays[0], head["rejected"], quantities)


@dataclass(frozen=True)
class Results:
    """Results of a sweep's cells (n,) in their order; `cells` count from 0, `seconds` is what each took.

    `figures` by name, (n,) each, NaN where a cell has no such figure; `versions` by name, a text for each cell.
    """

    cells: Integers
    keys: list[str]
    statuses: list[str]
    reasons: list[str]
    seeds: Integers
    seconds: Array
    figures: dict[str, Array]
    versions: dict[str, list[str]]


def results(store: Store, sweep: int) -> Results:
    """Results of a sweep; cells that are not done yet are left out.

    :raises StoreError: the store cannot be read.
    """
    try:
        texts = {number: json.loads(value) for number, value in store.connection.execute("SELECT id, value FROM text")}
        rows = store.connection.execute(
            "SELECT number, cell.key, status, reason, seed, seconds, names, versions, figures FROM cell JOIN result "
            "ON result.key = cell.key AND block = 0 WHERE sweep = ? ORDER BY number",
            [sweep],
        ).fetchall()
    except sqlite3.Error as error:
        raise _told(store.path, error) from None
    columns: list[list[Any]] = [list(column) for column in zip(*rows, strict=True)] or [[] for _ in range(9)]
    numbers, found_keys, found_statuses, reasons, seeds, seconds, names, versions, blobs = columns
    # Rows with the same names make a matrix.
    figures: dict[str, Array] = {}
    of_names: dict[int, list[int]] = {}
    for place, number in enumerate(names):
        of_names.setdefault(number, []).append(place)
    for number, places in of_names.items():
        matrix = np.frombuffer(b"".join(blobs[place] for place in places), "<f8").reshape(len(places), -1)
        for k, name in enumerate(texts[number]):
            figures.setdefault(name, np.full(len(rows), np.nan))[places] = matrix[:, k]
    of_versions = {number: texts[number] for number in dict.fromkeys(versions)}
    kinds = dict.fromkeys(name for one in of_versions.values() for name in one)
    return Results(
        np.array(numbers, np.int64),
        found_keys,
        found_statuses,
        reasons,
        np.array(seeds, np.int64),
        np.array(seconds, float),
        figures,
        {name: [of_versions[number].get(name, "") for number in versions] for name in kinds},
    )


def all_details(store: Store, sweep: int) -> Iterator[tuple[int, dict[str, Any]]]:
    """Texts of the results of a sweep's cells, by number, in their order."""
    rows = store.connection.execute(
        "SELECT number, details FROM cell JOIN result ON result.key = cell.key AND block = 0 WHERE sweep = ? "
        "ORDER BY number",
        [sweep],
    )
    return ((number, json.loads(text)) for number, text in rows)
