"""Rows of a store. Each has a digest, by which damaged rows are detected and left out."""

from __future__ import annotations

import hashlib
import json
import sqlite3
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from ballplate.simulator.inputs import in_lines
from ballplate.simulator.machines import Array, Integers

# Results with their texts: the values of their digests, the duration and the digest.
RESULTS = (
    "SELECT result.key, block, status, reason, seed, names.value, figures, details, versions.value,"
    " tally, CAST(seconds AS REAL), digest FROM result"
    " LEFT JOIN text AS names ON names.id = result.names"
    " LEFT JOIN text AS versions ON versions.id = result.versions"
)


# Place of the details among these values.
DETAILS = 7

# Other rows with digests.
SIGNED = (
    "SELECT id, definition, digest FROM sweep",
    "SELECT sweep, number, key, digest FROM cell",
)

CHANGED = "its content has changed since it was stored"


class DamagedError(Exception):
    """A row is damaged; the text states the reason."""


def digest_of(*values: object) -> bytes:
    """Return a hash of a row's values, with their types and lengths.

    >>> digest_of("ab", 1) == digest_of("a", "b1")
    False
    """
    digest = hashlib.blake2b(digest_size=16)
    for value in values:
        content = value if isinstance(value, bytes) else str(value).encode("utf-8", "surrogatepass")
        digest.update(f"{type(value).__name__} {len(content)} ".encode())
        digest.update(content)
    return digest.digest()


def check_digest(digest: object, *values: object) -> None:
    """Check that values are those that were stored.

    :raises DamagedError: they are not.
    """
    if digest != digest_of(*values):
        raise DamagedError(CHANGED)


def plain(value: Any) -> Any:
    """Return JSON data, in which texts are lines without control characters."""
    if isinstance(value, dict):
        return {in_lines(name): plain(item) for name, item in value.items()}
    if isinstance(value, list):
        return [plain(item) for item in value]
    return in_lines(value) if isinstance(value, str) else value


@lru_cache(maxsize=1000)
def _of_json(text: str) -> Any:
    return plain(json.loads(text))


@dataclass(frozen=True)
class StoredRow:
    """A stored result; `figures` are 64-bit numbers, one for each of the `names`."""

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


def whole_row(number: int, values: tuple[Any, ...]) -> StoredRow:
    """Return a row of `RESULTS`.

    :raises DamagedError: it is damaged.
    """
    *content, seconds, digest = values
    check_digest(digest, *content)
    key, _, status, reason, seed, names, figures, details, versions, _ = content
    texts = tuple(_of_json(names)), _of_json(versions)
    more = plain(json.loads(details))
    return StoredRow(number, key, status, in_lines(reason), seed, seconds, *texts, figures, more)


@dataclass(frozen=True)
class StoredResults:
    """Results of a sweep in the order of their cells, without unfinished ones.

    `damaged` has the faults of unreadable cells.
    """

    rows: list[StoredRow]
    damaged: dict[int, str] = field(default_factory=dict)

    @property
    def cells(self) -> Integers:
        """Cells (rows,), counted from 0."""
        return np.array([row.number for row in self.rows], np.int64)

    @property
    def keys(self) -> list[str]:
        return [row.key for row in self.rows]

    @property
    def figures(self) -> dict[str, Array]:
        """Values by name, (rows,) each, NaN if a row lacks one."""
        figures: dict[str, Array] = {}
        # Rows with the same names make a matrix.
        of_names: dict[tuple[str, ...], list[int]] = {}
        for place, row in enumerate(self.rows):
            of_names.setdefault(row.names, []).append(place)
        for names, places in of_names.items():
            content = b"".join(self.rows[place].figures for place in places)
            matrix = np.frombuffer(content, "<f8").reshape(len(places), -1)
            for k, name in enumerate(names):
                figures.setdefault(name, np.full(len(self.rows), np.nan))[places] = matrix[:, k]
        return figures


def read_results(connection: sqlite3.Connection, sweep: int, count: int) -> StoredResults:
    """Return the rows of a sweep of `count` cells.

    :raises sqlite3.OperationalError: the store cannot be read.
    """
    rows = []
    damaged = {}
    missing = []
    # One query for each cell, so that a damaged page costs only its own rows.
    for number in range(count):
        try:
            key = _key(connection, sweep, number)
            values = connection.execute(f"{RESULTS} WHERE key = ? AND block = 0", [key]).fetchone()
            if values is None:
                missing.append(number)
            else:
                rows.append(whole_row(number, values))
        except sqlite3.OperationalError:
            raise
        except (sqlite3.DatabaseError, DamagedError) as error:
            damaged[number] = str(error)
    # In a damaged file, the result of a missing cell may be lost.
    fault = file_damage(connection) if missing or damaged else ""
    return StoredResults(rows, damaged | (dict.fromkeys(missing, fault) if fault else {}))


def _key(connection: sqlite3.Connection, sweep: int, number: int) -> str | None:
    query = "SELECT key, digest FROM cell WHERE sweep = ? AND number = ?"
    values = connection.execute(query, [sweep, number]).fetchone()
    if values is None:
        return None
    check_digest(values[1], sweep, number, values[0])
    return str(values[0])


def damage(connection: sqlite3.Connection) -> str:
    """Return the first fault of a store; empty in a sound one."""
    fault = file_damage(connection)
    if fault:
        return fault
    for query in SIGNED:
        for *values, digest in connection.execute(query):
            if digest != digest_of(*values):
                return CHANGED
    for *values, _, digest in connection.execute(RESULTS):
        if digest != digest_of(*values):
            return CHANGED
    return ""


def file_damage(connection: sqlite3.Connection) -> str:
    """Return the first fault that SQLite's integrity check finds; empty in a sound database."""
    try:
        (text,) = connection.execute("PRAGMA integrity_check(1)").fetchone()
    except sqlite3.DatabaseError as error:
        return str(error)
    return "" if text == "ok" else str(text)[:200]
