"""The store of a sweep: one SQLite file, written by one process, that survives interruptions.

Every row is on disk before it is reported. A result's key is the fingerprint of the computation,
with the replicate block. So no sweep computes a cell again that the store has.
"""

from __future__ import annotations

import json
import os
import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from ballplate.montecarlo import Accumulator, QuantityAccumulator

from .store_file import RECOMPUTE, StoreError, connected, store_error
from .stored import DETAILS, RESULTS, StoredResults, digest_of, plain, read_results
from .task import CellResult

COLUMNS = (
    *("key", "block", "status", "reason", "seed", "names", "figures", "details", "versions"),
    *("seconds", "tally", "digest"),
)
INSERT = (
    f"INSERT INTO result ({', '.join(COLUMNS)}) VALUES ({', '.join('?' * len(COLUMNS))})"
    " ON CONFLICT (key, block) DO UPDATE"
    f" SET {', '.join(f'{column} = excluded.{column}' for column in COLUMNS[2:])}"
    " WHERE result.status <> 'done' OR excluded.status = 'done'"
)


@dataclass
class Store:
    """An open store. `texts` caches numbers of texts; `place` has device and inode of the file."""

    path: Path
    connection: sqlite3.Connection
    place: tuple[int, int]
    texts: dict[str, int] = field(default_factory=dict)

    def close(self) -> None:
        self.connection.close()


def open_store(path: Path, create: bool = False, damaged: bool = False) -> Store:
    """Open a store for reading or, with `create`, for writing; then a missing store is made.

    :raises StoreError: no such store, a file that is no store, or unless `damaged` is allowed a
        damaged one.
    """
    try:
        connection = connected(path, create, damaged)
        status = os.stat(path)
    except sqlite3.Error as error:
        raise store_error(path, error) from None
    except UnicodeDecodeError:
        # SQLite's message quotes invalid text.
        raise StoreError(f"{path}: is damaged; {RECOMPUTE}") from None
    return Store(path, connection, (status.st_dev, status.st_ino))


def ensure_in_place(store: Store) -> None:
    """Check that the open file still has the store's name.

    :raises StoreError: it was deleted, moved or replaced since it was opened.
    """
    with suppress(OSError):
        status = os.stat(store.path)
        if store.place == (status.st_dev, status.st_ino):
            return
    # The last rows are only in the log, whose name did not move with the file.
    with suppress(sqlite3.Error):
        store.connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    raise StoreError(
        f"{store.path}: was deleted, moved or replaced while the sweep ran, which ends here; to"
        " continue with a moved store, name it with --store"
    )


@contextmanager
def _transaction(store: Store) -> Iterator[sqlite3.Connection]:
    """Write all or nothing, on disk at the end, in the file that has the store's name.

    :raises StoreError: the disk is full, or the file is missing or cannot be written.
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
        raise store_error(store.path, error) from None


@contextmanager
def _reading(store: Store) -> Iterator[sqlite3.Connection]:
    """Read, with SQLite's errors as StoreError."""
    try:
        yield store.connection
    except sqlite3.Error as error:
        raise store_error(store.path, error) from None


def add_sweep(store: Store, definition: dict[str, Any]) -> int:
    """Enter a sweep's definition, and return its number.

    :raises StoreError: the store cannot be written.
    """
    with _transaction(store) as connection:
        text = json.dumps(definition, sort_keys=True)
        query = "SELECT coalesce(max(id), 0) + 1 FROM sweep"
        number = int(connection.execute(query).fetchone()[0])
        insert = "INSERT INTO sweep (id, definition, digest) VALUES (?, ?, ?)"
        connection.execute(insert, [number, text, digest_of(number, text)])
    return number


def definitions(store: Store) -> dict[int, dict[str, Any]]:
    """Return the definitions of the sweeps of a store by number, without control characters.

    :raises StoreError: the store cannot be read, or a definition is damaged.
    """
    with _reading(store) as connection:
        rows = connection.execute("SELECT id, definition, digest FROM sweep ORDER BY id").fetchall()
    for number, text, digest in rows:
        if digest != digest_of(number, text):
            text = f"is damaged: the definition of sweep {number} has changed; {RECOMPUTE}"
            raise StoreError(f"{store.path}: {text}")
    return {number: plain(json.loads(text)) for number, text, _ in rows}


def chosen_sweep(store: Store, number: int | None) -> tuple[int, dict[str, Any]]:
    """Return number and definition of a sweep of the store, the newest by default.

    :raises StoreError: there is no such sweep.
    """
    defined = definitions(store)
    if not defined or (number is not None and number not in defined):
        raise StoreError(
            f"{store.path}: there is no such sweep; it has {', '.join(map(str, defined)) or 'none'}"
        )
    number = max(defined) if number is None else number
    return number, defined[number]


def keys(store: Store, sweep: int) -> dict[int, str]:
    """Return the known keys of cells by number."""
    with _reading(store) as connection:
        return dict(connection.execute("SELECT number, key FROM cell WHERE sweep = ?", [sweep]))


def statuses(store: Store) -> dict[tuple[str, int], str]:
    """Return the status of every result by key and block."""
    with _reading(store) as connection:
        rows = connection.execute("SELECT key, block, status FROM result")
        return {(key, block): status for key, block, status in rows}


def add_keys(store: Store, sweep: int, cell_keys: dict[int, str]) -> None:
    """Enter keys of cells."""
    with _transaction(store) as connection:
        for number, key in cell_keys.items():
            _add_key(connection, sweep, number, key)


def _add_key(connection: sqlite3.Connection, sweep: int, number: int, key: str) -> None:
    insert = "INSERT OR REPLACE INTO cell (sweep, number, key, digest) VALUES (?, ?, ?, ?)"
    connection.execute(insert, [sweep, number, key, digest_of(sweep, number, key)])


def add_rows(store: Store, sweep: int, rows: Iterable[CellResult]) -> None:
    """Write rows, on disk when this returns. A finished result that is there already remains."""
    with _transaction(store) as connection:
        for row in rows:
            of_names, of_versions = json.dumps(list(row.figures)), json.dumps(dict(row.versions))
            names, versions = _text(store, of_names), _text(store, of_versions)
            # Names of files may have characters that UTF-8 cannot encode.
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
            _add_key(connection, sweep, row.number, row.key)
            if row.block == 0 and row.status == "done":
                # The sums over blocks are used up, except for their computing time.
                seconds = "SELECT coalesce(sum(seconds), 0) FROM result WHERE key = ? AND block > 0"
                update = f"UPDATE result SET seconds = seconds + ({seconds})"
                connection.execute(f"{update} WHERE key = ? AND block = 0", [row.key, row.key])
                connection.execute("DELETE FROM result WHERE key = ? AND block > 0", [row.key])


def details_of(store: Store, key: str) -> dict[str, Any]:
    """Return the texts of a finished cell."""
    with _reading(store) as connection:
        query = "SELECT details FROM result WHERE key = ? AND block = 0"
        return dict(json.loads(connection.execute(query, [key]).fetchone()[0]))


def add_details(store: Store, key: str, more: dict[str, Any]) -> None:
    """Enter more texts of a finished cell."""
    text = json.dumps({**details_of(store, key), **more}, ensure_ascii=True, sort_keys=True)
    with _transaction(store) as connection:
        query = f"{RESULTS} WHERE key = ? AND block = 0"
        *content, _, _ = connection.execute(query, [key]).fetchone()
        content[DETAILS] = text
        update = "UPDATE result SET details = ?, digest = ? WHERE key = ? AND block = 0"
        connection.execute(update, [text, digest_of(*content), key])


def _text(store: Store, value: str) -> int:
    if value not in store.texts:
        row = store.connection.execute("SELECT id FROM text WHERE value = ?", [value]).fetchone()
        if row is None:
            row = [
                store.connection.execute("INSERT INTO text (value) VALUES (?)", [value]).lastrowid
            ]
        store.texts[value] = int(row[0])
    return store.texts[value]


def block_tally(store: Store, key: str, block: int) -> Accumulator | None:
    """Return the sums of a replicate block; None if the cell cannot have replicates."""
    with _reading(store) as connection:
        row = connection.execute(
            "SELECT tally FROM result WHERE key = ? AND block = ?", [key, block]
        ).fetchone()
    return None if row is None or row[0] is None else _unpacked(row[0])


def _packed(accumulator: Accumulator) -> bytes:
    """Return sums as bytes: a line of JSON, then all arrays as 64-bit numbers."""
    arrays = [accumulator.residual]
    for quantity in accumulator.quantities:
        arrays += [quantity.errors, quantity.squares, quantity.numbers, quantity.numbers_squared]
    head = {
        "count": accumulator.count,
        "failed": list(accumulator.failed),
        "passes": accumulator.passes,
        "rejected": accumulator.rejected,
        "sizes": [len(array) for array in arrays],
    }
    return json.dumps(head).encode() + b"\n" + np.concatenate(arrays).astype("<f8").tobytes()


def _unpacked(content: bytes) -> Accumulator:
    """Return the sums from the bytes of `_packed`."""
    line, _, body = content.partition(b"\n")
    head = json.loads(line)
    first, *arrays = np.split(np.frombuffer(body, "<f8"), np.cumsum(head["sizes"])[:-1])
    quantities = tuple(QuantityAccumulator(*arrays[k : k + 4]) for k in range(0, len(arrays), 4))
    failed = tuple(head["failed"])
    return Accumulator(head["count"], failed, head["passes"], first, head["rejected"], quantities)


def results(store: Store, sweep: int, count: int) -> StoredResults:
    """Return the results of a sweep of `count` cells, without unfinished cells.

    :raises StoreError: the store cannot be read.
    """
    with _reading(store) as connection:
        return read_results(connection, sweep, count)
