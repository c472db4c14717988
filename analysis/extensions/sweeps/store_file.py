"""The file of a store: its kind, the form of its tables, and SQLite's errors in words.

A store is input like any file: it may be cut off, of another program, of a later version, or no
file at all.
"""

from __future__ import annotations

import os
import sqlite3
from pathlib import Path, PurePath
from urllib.parse import quote

from ballplate.simulator.inputs import UnusableError, in_one_line

FORMAT = "ballplate sweep store 2"

# Seconds to wait for another process that writes.
PATIENCE = 20.0

MAGIC = b"SQLite format 3\0"
MEND = "name a store that ballplate sweep has made"
ANEW = "ballplate sweep with --store and a new name computes anew, and leaves this file as it is"

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

# What SQLite's result codes mean to the person whose store it is, by the beginning of their names.
WORDS = {
    "SQLITE_FULL": "cannot be written ({}); make room, then start again: nothing done is lost",
    "SQLITE_IOERR": "cannot be written ({}); make room, then start again: nothing done is lost",
    "SQLITE_BUSY": "another process is writing to it; wait for it, or end it",
    "SQLITE_READONLY": "cannot be written ({}); check its permissions and those of its folder",
    "SQLITE_CANTOPEN": "cannot be opened ({}); check its permissions and those of its folder",
    "SQLITE_CORRUPT": f"is damaged ({{}}); restore a copy, or {ANEW}",
}


class StoreError(UnusableError):
    """A store cannot be used; the text says why, and what would help."""

    def __init__(self, text: str) -> None:
        super().__init__(in_one_line(text))


def in_words(path: Path, error: sqlite3.Error) -> StoreError:
    """What SQLite says of a store, and what would help."""
    name = getattr(error, "sqlite_errorname", None) or ""
    other = f"is no store of ballplate sweep, or damaged ({{}}); {MEND}"
    words = next((words for start, words in WORDS.items() if name.startswith(start)), other)
    return StoreError(f"{path}: {words.format(error)}")


def connected(path: Path, create: bool) -> sqlite3.Connection:
    """A connection to a store, of whose tables those can be read that are whole; with `create`, to
    one that is sound, made where there is none.

    Without `create` it only reads, also where nothing can be written.

    :raises StoreError: no file that is, or may become, a store; with `create`, a damaged one.
    :raises sqlite3.Error: SQLite cannot open it.
    """
    check_place(path, create)
    address = address_of(PurePath(os.path.abspath(path)))
    connection = _opened(f"{address}?mode={'rwc' if create else 'rw'}")
    try:
        if create:
            _prepare(path, connection)
            return connection
        # So SQLite looks at a file from which pages are missing.
        connection.execute("PRAGMA writable_schema = ON")
        try:
            connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
        except sqlite3.OperationalError as error:
            log = Path(f"{path}-wal")
            closed = "SQLITE_CANTOPEN", "SQLITE_READONLY", "SQLITE_IOERR"
            is_in_use = log.exists() and log.stat().st_size > 0
            if is_in_use or not error.sqlite_errorname.startswith(closed):
                raise
            # In a place that cannot be written, or is full, as long as nobody else writes to it.
            connection.close()
            connection = _opened(f"{address}?immutable=1")
        connection.execute("PRAGMA query_only = ON")
        check_tables(path, connection)
    except BaseException:
        connection.close()
        raise
    return connection


def address_of(path: PurePath) -> str:
    """The address by which SQLite opens the file of an absolute path.

    >>> from pathlib import PurePosixPath, PureWindowsPath
    >>> address_of(PurePosixPath("/a b/c"))
    'file:///a%20b/c'
    >>> address_of(PureWindowsPath("C:/a")), address_of(PureWindowsPath("//server/share/a"))
    ('file:///C%3A/a', 'file:////server/share/a')
    """
    text = path.as_posix()
    return f"file://{'' if text.startswith('/') else '/'}{quote(os.fsencode(text))}"


def _opened(address: str) -> sqlite3.Connection:
    connection = sqlite3.connect(address, uri=True, isolation_level=None, timeout=PATIENCE)
    # Text that is none is a matter of its row, not of the whole store.
    connection.text_factory = lambda content: content.decode("utf-8", "replace")
    # Nothing that the file defines is computed, and damage is noticed where it is met.
    connection.execute("PRAGMA trusted_schema = OFF")
    connection.execute("PRAGMA cell_size_check = ON")
    return connection


def check_place(path: Path, create: bool) -> None:
    """Refuse what is no file that is a store as its beginning tells or, with `create`, could become
    one.

    :raises StoreError: it is not.
    """
    if path.exists() and not path.is_file():
        raise StoreError(f"{path}: is no file; {MEND}")
    try:
        with open(path, "rb") as stream:
            start = stream.read(len(MAGIC))
    except FileNotFoundError:
        if not create:
            raise StoreError(
                f"{path}: there is no such store; make it with ballplate sweep"
            ) from None
        start = b""
        if not path.parent.is_dir():
            words = f"there is no folder {path.parent}; make it, or name another"
            raise StoreError(f"{path}: {words}") from None
    except OSError as error:
        raise StoreError(
            f"{path}: cannot be opened ({error.strerror}); check its name and permissions"
        ) from None
    if create and not os.access(
        path.parent, os.W_OK | os.X_OK, effective_ids=os.access in os.supports_effective_ids
    ):
        raise StoreError(
            f"{path}: its folder cannot be written; name another with --store, or see to its"
            " permissions"
        )
    if start != MAGIC and (start or not create):
        raise StoreError(f"{path}: is no store of ballplate sweep; {MEND}")


def check_tables(path: Path, connection: sqlite3.Connection) -> None:
    """Refuse a database with other tables than those of a store, or with views or triggers, which
    could make reading and writing do anything.

    :raises StoreError: it has.
    :raises sqlite3.Error: SQLite cannot read it.
    """
    query = "SELECT sql FROM sqlite_master WHERE type <> 'index' AND name NOT LIKE 'sqlite!_%'"
    statements = {str(text) for (text,) in connection.execute(f"{query} ESCAPE '!'")}
    made = ""
    if any(text.startswith("CREATE TABLE about ") for text in statements):
        found = connection.execute("SELECT value FROM about WHERE name = 'format'").fetchone()
        made = str(found[0]) if found else ""
    if made != FORMAT and made.startswith(FORMAT[:-1]):
        text = f"was made by another version of ballplate (format {made[len(FORMAT) - 1 :]})"
        raise StoreError(f"{path}: {text}; use that version, or {ANEW}")
    if made != FORMAT or statements != {text.strip() for text in TABLES.split(";")[:-1]}:
        raise StoreError(f"{path}: is no store of ballplate sweep but another database; {MEND}")


def _prepare(path: Path, connection: sqlite3.Connection) -> None:
    """Make the tables of an empty store, and check those of another one.

    :raises StoreError: it is none, or damaged.
    """
    has_tables = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
    if has_tables:
        check_tables(path, connection)
        wrong = damage(connection)
        if wrong:
            raise StoreError(
                f"{path}: is damaged ({wrong}); ballplate sweep --export and --report give the"
                f" whole cells, and {ANEW}"
            )
    connection.execute("PRAGMA journal_mode = WAL")
    # What is written is on disk when the call returns.
    connection.execute("PRAGMA synchronous = FULL")
    if not has_tables:
        connection.execute("BEGIN IMMEDIATE")
        for statement in TABLES.split(";"):
            connection.execute(statement)
        connection.execute("INSERT INTO about VALUES ('format', ?)", [FORMAT])
        connection.execute("COMMIT")


def damage(connection: sqlite3.Connection) -> str:
    """What SQLite's integrity check finds wrong with a database; empty where it is sound."""
    try:
        (text,) = connection.execute("PRAGMA integrity_check(1)").fetchone()
    except sqlite3.DatabaseError as error:
        return str(error)
    return "" if text == "ok" else str(text)[:200]
