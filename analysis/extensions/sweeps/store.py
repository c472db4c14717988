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
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from ballplate.montecarlo import Accumulator, QuantityAccumulator
from ballplate.simulator.inputs import in_one_line, number_of

from .fingerprint import METHOD, METHODS, method_of
from .store_file import ANEW, StoreError, connected, in_words
from .stored import (
    DamagedError,
    StoredResults,
    check_digest,
    digest_of,
    plain,
    read_results,
    whole_results,
)
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
    """An open store; `texts` are those known by number, and `place` states the file from another in
    its place.
    """

    path: Path
    connection: sqlite3.Connection
    place: tuple[int, int]
    texts: dict[str, int] = field(default_factory=dict)

    def close(self) -> None:
        self.connection.close()


def open_store(path: Path, create: bool = False) -> Store:
    """Open a store for reading or, with `create`, for writing: it is made where there is none.

    :raises StoreError: no such store, a file that is none, or one that is damaged and to be written
        to.
    """
    try:
        connection = connected(path, create)
        place = os.stat(path)
    except sqlite3.Error as error:
        raise in_words(path, error) from None
    except UnicodeDecodeError:
        # Of what SQLite says about names that are no text.
        raise StoreError(f"{path}: is damaged; {ANEW}") from None
    return Store(path, connection, (place.st_dev, place.st_ino))


def ensure_in_place(store: Store) -> None:
    """Check that the file that is written to is the one that has the store's name.

    :raises StoreError: it was deleted, moved or replaced since it was opened.
    """
    with suppress(OSError):
        found = os.stat(store.path)
        if store.place == (found.st_dev, found.st_ino):
            return
    # SQLite leaves to its log what it wrote to a file that has moved.
    with suppress(sqlite3.Error):
        store.connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    raise StoreError(
        f"{store.path}: has been deleted, moved or replaced while the sweep ran, which ends here;"
        " if it was moved, it has the rows computed until then, and --store continues with it"
    )


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
        query = "SELECT coalesce(max(id), 0) + 1 FROM sweep"
        number = int(connection.execute(query).fetchone()[0])
        insert = "INSERT INTO sweep (id, definition, digest) VALUES (?, ?, ?)"
        connection.execute(insert, [number, text, digest_of(number, text)])
        connection.executemany(
            "INSERT INTO bundle (sweep, path, content, digest) VALUES (?, ?, ?, ?)",
            [(number, name, content, digest_of(number, name, content)) for name, content in files],
        )
    return number


def definitions(store: Store) -> dict[int, dict[str, Any]]:
    """Definitions of the sweeps of a store by number, with their words in lines.

    :raises StoreError: the store cannot be read, or a definition is not as it was stored.
    """
    with _reading(store) as connection:
        rows = connection.execute("SELECT id, definition, digest FROM sweep ORDER BY id").fetchall()
    for number, text, digest in rows:
        with _as_stored(store, f"the definition of sweep {number}"):
            check_digest(digest, number, text)
    return {number: plain(json.loads(text)) for number, text, _ in rows}


@contextmanager
def _as_stored(store: Store, what: str) -> Iterator[None]:
    try:
        yield
    except DamagedError as error:
        raise StoreError(f"{store.path}: is damaged: {what}: {error}; {ANEW}") from None


def chosen_sweep(store: Store, number: int | None) -> tuple[int, dict[str, Any]]:
    """The number and the definition of a sweep of the store: the one asked for, or the newest.

    :raises StoreError: there is no such sweep.
    """
    known = definitions(store)
    if not known or (number is not None and number not in known):
        raise StoreError(
            f"{store.path}: there is no such sweep; it has {', '.join(map(str, known)) or 'none'}"
        )
    number = max(known) if number is None else number
    return number, known[number]


def files(store: Store, sweep: int) -> tuple[tuple[str, bytes], ...]:
    """Files of a sweep by their path from the common folder.

    :raises StoreError: they cannot be read, or are not as they were stored.
    """
    query = "SELECT path, content, digest FROM bundle WHERE sweep = ? ORDER BY path"
    with _reading(store) as connection:
        rows = connection.execute(query, [sweep]).fetchall()
    for name, content, digest in rows:
        with _as_stored(store, f"the file {name} in it"):
            check_digest(digest, sweep, name, content)
    return tuple((name, content) for name, content, _ in rows)


def keys(store: Store, sweep: int) -> dict[int, str]:
    """Keys of the cells that are known, by number."""
    with _reading(store) as connection:
        rows = connection.execute("SELECT number, key, digest FROM cell WHERE sweep = ?", [sweep])
        return {k: key for k, key, digest in rows if digest == digest_of(sweep, k, key)}


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
    """Status by key and block of every result that is as it was stored."""
    with _reading(store) as connection:
        return {(key, block): status for key, block, status in whole_results(connection)}


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
    """The sums that `_packed` made bytes of."""
    line, _, body = content.partition(b"\n")
    head = json.loads(line)
    first, *arrays = np.split(np.frombuffer(body, "<f8"), np.cumsum(head["sizes"])[:-1])
    quantities = tuple(QuantityAccumulator(*arrays[k : k + 4]) for k in range(0, len(arrays), 4))
    failed = tuple(head["failed"])
    return Accumulator(head["count"], failed, head["passes"], first, head["rejected"], quantities)


def results(store: Store, sweep: int, count: int) -> StoredResults:
    """Results of a sweep of so many cells; those that are not done yet are left out.

    :raises StoreError: the store cannot be read.
    """
    with _reading(store) as connection:
        return read_results(connection, sweep, count)


def damaged_cells(path: Path, results: StoredResults, what_next: str) -> str:
    """Words for the cells of a store that are damaged; empty where none is."""
    if not results.damaged:
        return ""
    cells = sorted(results.damaged)
    more = f" and {len(cells) - 10} more" if len(cells) > 10 else ""
    counted = f"{number_of(len(cells), 'cell')} could not be read"
    text = f"{', '.join(map(str, cells[:10]))}{more} ({results.damaged[cells[0]]})"
    return in_one_line(f"{path}: {counted}: {text}; {what_next}")
