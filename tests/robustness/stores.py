"""Changes of stores: of the file's bytes, of its pages, and of what its tables say."""

from __future__ import annotations

import json
import sqlite3
import struct
from collections.abc import Callable
from contextlib import closing
from random import Random
from typing import Any

from tests.robustness.mutations import Vocabulary, change_tree, changed_text

PAGE = 4096
# Bytes of the header that say whether the file is written with a write-ahead log.
VERSIONS = slice(18, 20)

VALUES: tuple[Any, ...] = (
    *(None, 0, -1, 1, 7, 10**9, 2**62, -(2**63), 1.5, 1e308, -1e308, float("inf"), 5e-324),
    *(
        "",
        " ",
        "done",
        "failed",
        "é" * 300,
        "x" * 100_000,
        "a\nb",
        "\x1b[31mred",
        "\0",
        "\u2028",
        "=1+1",
        "<b>&",
    ),
    *(
        "null",
        "[]",
        "{}",
        "5",
        '"a"',
        "[1, 2",
        "{",
        "NaN",
        "[" * 3000 + "]" * 3000,
        '{"a": NaN}',
        "[[]]",
        "[null]",
    ),
    *(
        b"",
        b"\0",
        b"\xff\xfe",
        b"\0" * 7,
        b"\0" * 8,
        b"\xff" * 8,
        b"\0" * 800,
        b"\xff" * 801,
        b"{}\n",
        b"x" * 9999,
    ),
    *(
        "../../outside.yaml",
        "/no-such-folder/outside.yaml",
        "C:\\a.yaml",
        ".",
        "con",
        "ballplate sweep store 2",
    ),
)
WORDS = Vocabulary(
    (
        "title",
        "source",
        "base",
        "axes",
        "cells",
        "trials",
        "seed",
        "record",
        "labels",
        "values",
        "unit",
        "name",
    ),
    ("m", "rad", "1", "", "U1", "U6", "text"),
    (
        (
            "cells",
            (
                [],
                [[0, 0]],
                [[9, 9]] * 6,
                [[-1, 0]] * 6,
                [[0]] * 6,
                [["a", "b"]] * 6,
                [[0, 0, 0]] * 6,
            ),
        ),
        ("values", ([], [1.0], ["a"] * 3, [None] * 3, [1e308] * 3, [[1]] * 3)),
        ("unit", ("m", "rad", "1", "", "mm", None, 5, "x" * 300)),
        ("column", ("cell", "status", "reason", "fingerprint", "", None, 5, "a\nb", "=a")),
        ("record", ([], ["U9"], "U1", None, ["U1"] * 99)),
    ),
)


def changed_store(random: Random, content: bytes) -> tuple[str, bytes]:
    """A store with one change, and what that is."""
    if random.random() < 0.35:
        name, change = random.choice(list(BYTES.items()))
        return name, change(random, content)
    name, in_tables = random.choice(list(TABLES.items()))
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as connection:
        connection.deserialize(content[:18] + b"\1\1" + content[20:])
        told = in_tables(random, connection)
        found = connection.serialize()
    return f"{name} {told}".strip(), found[:18] + content[VERSIONS] + found[20:]


def _flipped(random: Random, content: bytes) -> bytes:
    changed = bytearray(content)
    for _ in range(random.choice((1, 1, 5, 100))):
        changed[random.randrange(len(changed))] ^= 1 << random.randrange(8)
    return bytes(changed)


def _header(random: Random, content: bytes) -> bytes:
    """Other bytes in the header of the file: size of pages, versions, counters, encoding."""
    changed = bytearray(content)
    changed[random.randrange(100)] = random.randrange(256)
    return bytes(changed)


def _pages(content: bytes) -> list[bytes]:
    return [content[k : k + PAGE] for k in range(0, len(content), PAGE)]


def _pages_exchanged(random: Random, content: bytes) -> bytes:
    pages = _pages(content)
    j, k = random.randrange(len(pages)), random.randrange(len(pages))
    pages[j], pages[k] = pages[k], pages[j]
    return b"".join(pages)


def _page_filled(random: Random, content: bytes) -> bytes:
    pages = _pages(content)
    k = random.randrange(len(pages))
    pages[k] = random.choice((b"\0" * PAGE, b"\xff" * PAGE, random.randbytes(PAGE), b""))
    return b"".join(pages)


BYTES: dict[str, Callable[[Random, bytes], bytes]] = {
    "bits flipped": _flipped,
    "header": _header,
    "pages exchanged": _pages_exchanged,
    "page filled": _page_filled,
    "truncated": lambda random, content: content[: random.randrange(len(content))],
    "truncated to pages": lambda random, content: b"".join(_pages(content)[: random.randrange(12)]),
    "text": lambda random, content: changed_text(random, content)[1],
    "longer": lambda random, content: content + random.randbytes(random.choice((1, 100, PAGE))),
}


def _places(connection: sqlite3.Connection) -> list[tuple[str, str]]:
    tables = [
        name
        for (name,) in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
    ]
    return [
        (table, row[1])
        for table in tables
        for row in connection.execute(f'PRAGMA table_info("{table}")')
    ]


def _place(random: Random, connection: sqlite3.Connection) -> tuple[str, str]:
    """A table and a column of it, those that hold most of what is told more often."""
    places = _places(connection)
    often = [place for place in places if place[0] in ("result", "sweep", "cell", "about")]
    return random.choice(often if often and random.random() < 0.7 else places)


def _loosened(connection: sqlite3.Connection, table: str) -> None:
    """The same table without constraints, which anything can be entered into."""
    connection.execute(f'CREATE TABLE loose AS SELECT * FROM "{table}"')
    connection.execute(f'DROP TABLE "{table}"')
    connection.execute(f'ALTER TABLE loose RENAME TO "{table}"')


def _set(
    random: Random, connection: sqlite3.Connection, table: str, column: str, value: Any
) -> None:
    """Enter a value in one row or in all; as NULL, or twice, it may need a table without
    constraints.
    """
    rows = connection.execute(f'SELECT count(*) FROM "{table}"').fetchone()[0]
    one = random.randrange(max(rows, 1)) if random.random() < 0.6 else None
    keys = (
        ", ".join(row[1] for row in connection.execute(f'PRAGMA table_info("{table}")') if row[5])
        or "rowid"
    )
    where = (
        ""
        if one is None
        else f' WHERE ({keys}) = (SELECT {keys} FROM "{table}" LIMIT 1 OFFSET {one})'
    )
    try:
        connection.execute(f'UPDATE "{table}" SET "{column}" = ?{where}', [value])
    except sqlite3.Error:
        _loosened(connection, table)
        connection.execute(f'UPDATE "{table}" SET "{column}" = ?', [value])


def _value(random: Random, connection: sqlite3.Connection) -> str:
    table, column = _place(random, connection)
    value = random.choice(VALUES)
    _set(random, connection, table, column, value)
    return f"{table}.{column} = {str(value)[:20]!r}"


def _ill_text(random: Random, connection: sqlite3.Connection) -> str:
    """Text that is no UTF-8."""
    table, column = _place(random, connection)
    try:
        connection.execute(f'UPDATE "{table}" SET "{column}" = CAST(x\'ff41fe\' AS TEXT)')
    except sqlite3.Error:
        _loosened(connection, table)
        connection.execute(f'UPDATE "{table}" SET "{column}" = CAST(x\'ff41fe\' AS TEXT)')
    return f"{table}.{column}"


def _json(random: Random, connection: sqlite3.Connection) -> str:
    """Another tree in a text that is JSON: of a definition, of details, of names and versions."""
    table, column = random.choice(
        (("sweep", "definition"),) * 4 + (("result", "details"), ("text", "value"))
    )
    rows = (
        connection.execute(f'SELECT rowid, "{column}" FROM "{table}"') if table != "result" else []
    )
    known = list(rows) or list(connection.execute("SELECT key, details FROM result"))
    key, text = random.choice(known)
    tree = json.loads(text)
    told = change_tree(random, tree, WORDS)
    # Texts that YAML alone knows are written as they are.
    changed = json.dumps(tree, default=lambda one: getattr(one, "text", None))
    name = "key" if table == "result" else "rowid"
    connection.execute(f'UPDATE "{table}" SET "{column}" = ? WHERE {name} = ?', [changed, key])
    return f"{table}.{column}: {told}"


def _figures(random: Random, connection: sqlite3.Connection) -> str:
    """Other figures, or more, or fewer."""
    key, figures = random.choice(list(connection.execute("SELECT key, figures FROM result")))
    count = len(figures) // 8
    numbers = list(struct.unpack(f"<{count}d", figures))
    what = random.choice(("number", "more", "fewer", "half"))
    if what == "number" and numbers:
        wild = (float("nan"), float("inf"), -1.0, 1e308, 0.0, 5e-324)
        numbers[random.randrange(count)] = random.choice(wild)
    elif what == "more":
        numbers += numbers or [0.0]
    else:
        numbers = numbers[: count // 2]
    packed = struct.pack(f"<{len(numbers)}d", *numbers) + (b"\0" * 4 if what == "half" else b"")
    connection.execute("UPDATE result SET figures = ? WHERE key = ?", [packed, key])
    return what


def _schema(random: Random, connection: sqlite3.Connection) -> str:
    table, column = random.choice(_places(connection))
    _loosened(connection, table)
    statement = random.choice(
        (
            f'ALTER TABLE "{table}" DROP COLUMN "{column}"',
            f'ALTER TABLE "{table}" RENAME COLUMN "{column}" TO "other"',
            f'ALTER TABLE "{table}" RENAME TO "other"',
            f'DROP TABLE "{table}"',
            f'DELETE FROM "{table}"',
            f'ALTER TABLE "{table}" ADD COLUMN "other" TEXT',
            f'INSERT INTO "{table}" SELECT * FROM "{table}"',
            f'CREATE VIEW "other" AS SELECT * FROM "{table}"',
            "CREATE TRIGGER other BEFORE INSERT ON result BEGIN SELECT RAISE(ABORT, 'no'); END",
            "PRAGMA user_version = 99",
            "PRAGMA application_id = 99",
        )
    )
    try:
        connection.execute(statement)
    except sqlite3.Error:
        # The only column, or a table that is another one now.
        connection.execute(f'DROP TABLE IF EXISTS "{table}"')
    return statement


def _rows(random: Random, connection: sqlite3.Connection) -> str:
    """Rows away, so that others name what is not there."""
    statement = random.choice(
        (
            "DELETE FROM text WHERE id = (SELECT max(id) FROM text)",
            "DELETE FROM text",
            "DELETE FROM result WHERE key > (SELECT key FROM result LIMIT 1)",
            "DELETE FROM result",
            "DELETE FROM cell WHERE number % 2 = 0",
            "DELETE FROM about",
            "DELETE FROM sweep",
            "UPDATE sweep SET id = 7",
            "UPDATE cell SET sweep = 7",
            "UPDATE cell SET number = number + 100",
            "UPDATE cell SET number = number - 100",
            "UPDATE result SET block = block + 1",
            "UPDATE result SET status = 'done'",
            "UPDATE result SET status = 'failed'",
            "UPDATE result SET names = names + 100",
            "UPDATE about SET value = 'ballplate sweep store 0'",
            "UPDATE about SET value = 'ballplate sweep store 2'",
            "UPDATE about SET value = upper(value)",
        )
    )
    connection.execute(statement)
    return statement


TABLES: dict[str, Callable[[Random, sqlite3.Connection], str]] = {
    "value": _value,
    "another value": _value,
    "ill text": _ill_text,
    "JSON": _json,
    "figures": _figures,
    "schema": _schema,
    "rows": _rows,
}
