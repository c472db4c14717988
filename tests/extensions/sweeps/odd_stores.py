"""Stores with something wrong in them, each made of a good one, and files that are none."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Callable
from pathlib import Path

from ballplate.extensions.sweeps.stored import RESULTS, digest_of

Damage = Callable[[Path], object]


def by_sql(*statements: str) -> Damage:
    """Change a store as another program would, without any constraint in the way."""

    def change(path: Path) -> None:
        connection = sqlite3.connect(path, isolation_level=None)
        connection.execute("PRAGMA journal_mode = DELETE")
        connection.execute("PRAGMA ignore_check_constraints = ON")
        connection.execute("PRAGMA writable_schema = ON")
        for statement in statements:
            connection.execute(statement)
        connection.close()

    return change


# Rows of tables with digests: what these are of, and how many columns tell one row from another.
SIGNED = {
    "sweep": ("SELECT id, definition FROM sweep", ("id",)),
    "cell": ("SELECT sweep, number, key FROM cell", ("sweep", "number")),
    "result": (RESULTS.replace("CAST(seconds AS REAL), digest", "0"), ("key", "block")),
}


def signed(path: Path) -> None:
    """Give every row of a store the digest of what it says now, as whoever forges one would."""
    connection = sqlite3.connect(path, isolation_level=None)
    for table, (query, names) in SIGNED.items():
        where = " AND ".join(f"{name} = ?" for name in names)
        for row in connection.execute(query).fetchall():
            values = row[:-1] if table == "result" else row
            keys = values[: len(names)]
            connection.execute(
                f"UPDATE {table} SET digest = ? WHERE {where}", [digest_of(*values), *keys]
            )
    connection.close()


def settled(path: Path) -> None:
    """Everything in the one file."""
    by_sql()(path)


def cut(share: float) -> Damage:
    def apply(path: Path) -> None:
        settled(path)
        os.truncate(path, int(path.stat().st_size * share))

    return apply


def overwritten(place: int, content: bytes) -> Damage:
    def apply(path: Path) -> None:
        settled(path)
        with path.open("r+b") as stream:
            stream.seek(place)
            stream.write(content)

    return apply


def page_of(table: str) -> Damage:
    """Overwrite the first page of a table."""

    def apply(path: Path) -> None:
        settled(path)
        connection = sqlite3.connect(path)
        (page,) = connection.execute(
            "SELECT rootpage FROM sqlite_master WHERE name = ?", [table]
        ).fetchone()
        (size,) = connection.execute("PRAGMA page_size").fetchone()
        connection.close()
        overwritten((page - 1) * size, b"\xa5" * size)(path)

    return apply


def replaced(make: Damage) -> Damage:
    def apply(path: Path) -> None:
        path.unlink()
        make(path)

    return apply


def foreign(path: Path) -> None:
    connection = sqlite3.connect(path)
    connection.execute("CREATE TABLE moz_places (id INTEGER PRIMARY KEY, url TEXT)")
    connection.execute("INSERT INTO moz_places (url) VALUES ('https://example.org')")
    connection.commit()
    connection.close()


def loop(path: Path) -> None:
    other = path.with_name("other.sqlite")
    other.symlink_to(path.name)
    path.symlink_to(other.name)


# What is no store, whatever a command wants of it.
NO_STORES: dict[str, Damage] = {
    "text": replaced(lambda path: path.write_text("nonsense\n" * 1000, encoding="utf-8")),
    "zeros": replaced(lambda path: path.write_bytes(b"SQLite format 3\0" + b"\0" * 5000)),
    "foreign": replaced(foreign),
    "folder": replaced(Path.mkdir),
    "fifo": replaced(os.mkfifo),
    "zero": replaced(lambda path: path.symlink_to("/dev/zero")),
    "loop": replaced(loop),
    "newer format": by_sql("UPDATE about SET value = 'ballplate sweep store 99'"),
    "format of bytes": by_sql("UPDATE about SET value = x'ff00'"),
    "no about": by_sql("DROP TABLE about"),
    "no results": by_sql("DROP TABLE result"),
    "column missing": by_sql("ALTER TABLE result DROP COLUMN details"),
    "format 1": by_sql("UPDATE about SET value = 'ballplate sweep store 1'"),
    "view": by_sql(
        "ALTER TABLE cell RENAME TO real_cell",
        "CREATE VIEW cell AS WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM n) SELECT"
        " 1 AS sweep, x AS number, 'key' AS key FROM n",
    ),
    "trigger": by_sql("CREATE TRIGGER odd AFTER INSERT ON cell BEGIN DELETE FROM result; END"),
    "generated": by_sql("ALTER TABLE result ADD COLUMN more AS (hex(zeroblob(100000000)))"),
    "schema lost": overwritten(100, b"\xff" * 3000),
    "header lost": overwritten(0, b"\x00" * 100),
}


# What is a store still, in parts.
DAMAGED: dict[str, Damage] = {
    **{f"cut to {share}": cut(share) for share in (0.5, 0.9)},
    **{f"first page of {table}": page_of(table) for table in ("sweep", "cell", "text", "result")},
    "no definition": by_sql("DELETE FROM sweep"),
    "no keys": by_sql("DELETE FROM cell"),
    "no texts": by_sql("DELETE FROM text"),
    "definition no JSON": by_sql("UPDATE sweep SET definition = '{'"),
    "names no JSON": by_sql("UPDATE text SET value = 'x' WHERE id = 1"),
    "names too few": by_sql("UPDATE text SET value = '[\"U4_average_m\"]' WHERE id = 1"),
    "names unknown": by_sql("UPDATE result SET names = 99 WHERE rowid = 1"),
    "figures too short": by_sql("UPDATE result SET figures = x'00' WHERE rowid = 1"),
    "figures others": by_sql(
        "UPDATE result SET figures = zeroblob(length(figures)) WHERE rowid = 1"
    ),
    "status unknown": by_sql("UPDATE result SET status = 'DONE' WHERE rowid = 1"),
    "reason no text": by_sql(
        "UPDATE result SET reason = CAST(x'1b5b33316dff' AS TEXT) WHERE rowid = 1"
    ),
    "reason long": by_sql("UPDATE result SET reason = hex(zeroblob(3000000)) WHERE rowid = 1"),
    "seconds a text": by_sql("UPDATE result SET seconds = 'x' WHERE rowid = 1"),
    "seconds infinite": by_sql("UPDATE result SET seconds = 9e999 WHERE rowid = 1"),
    "details of numbers": by_sql(
        'UPDATE result SET details = \'{"weak": 3, "flags": [1]}\' WHERE rowid = 1'
    ),
    "tally no tally": by_sql("UPDATE result SET tally = x'00' WHERE rowid = 1"),
    "key of a late method": by_sql(f"UPDATE cell SET key = '{'9' * 5000} x' WHERE number = 0"),
    "key of bytes": by_sql("UPDATE cell SET key = x'ff' WHERE number = 0"),
    "number a text": by_sql("UPDATE cell SET number = 'x' WHERE number = 0"),
    "number huge": by_sql("UPDATE cell SET number = 9223372036854775807 WHERE number = 0"),
    "numbers exchanged": by_sql(
        "UPDATE cell SET number = 99 WHERE number = 0",
        "UPDATE cell SET number = 0 WHERE number = 1",
        "UPDATE cell SET number = 1 WHERE number = 99",
    ),
}
