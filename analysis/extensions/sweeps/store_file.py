"""The file of a store: format, tables, and remedies for SQLite's errors.

A store is untrusted input: it may be truncated, of another program or version, or no file.
"""

from __future__ import annotations

import os
import sqlite3
from pathlib import Path, PurePath
from urllib.parse import quote

from ballplate.simulator.inputs import UnusableError, in_one_line

from .stored import damage

# Its number rises whenever tables change, or any experiment gets other results.
FORMAT = "ballplate sweep store 4"
# A format that is read but not continued.
EARLIER = "ballplate sweep store 3"

# Seconds to wait for another writing process.
PATIENCE = 20.0

MAGIC = b"SQLite format 3\0"
MEND = "name a store made by ballplate sweep"
RECOMPUTE = "name a new file with ballplate sweep --store to recompute; this one stays unchanged"

TABLES = """
CREATE TABLE about (name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE sweep (id INTEGER PRIMARY KEY, definition TEXT NOT NULL, digest BLOB);
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

# Remedies by the beginning of the names of SQLite's result codes.
WORDS = {
    "SQLITE_FULL": "cannot be written ({}); make room and restart: finished cases are stored",
    "SQLITE_IOERR": "cannot be written ({}); make room and restart: finished cases are stored",
    "SQLITE_BUSY": "another process is writing to it; wait for it, or end it",
    "SQLITE_READONLY": "cannot be written ({}); check its permissions and those of its folder",
    "SQLITE_CANTOPEN": "cannot be opened ({}); check its permissions and those of its folder",
    "SQLITE_CORRUPT": f"is damaged ({{}}); restore a copy, or {RECOMPUTE}",
}


class StoreError(UnusableError):
    """A store cannot be used; the text states the reason and the remedy."""

    def __init__(self, text: str) -> None:
        super().__init__(in_one_line(text))


def store_error(path: Path, error: sqlite3.Error) -> StoreError:
    """Return SQLite's error with its remedy."""
    name = getattr(error, "sqlite_errorname", None) or ""
    otherwise = f"is no store of ballplate sweep, or damaged ({{}}); {MEND}"
    words = next((words for start, words in WORDS.items() if name.startswith(start)), otherwise)
    return StoreError(f"{path}: {words.format(error)}")


def connected(path: Path, create: bool, damaged: bool) -> sqlite3.Connection:
    """Return a connection to a store, for reading or, with `create`, for writing.

    With `create`, a missing store is made. Without, even a store on a full or write-protected disk
    can be read.

    :raises StoreError: the file is no store and cannot become one or, unless `damaged` is allowed,
        a damaged one.
    :raises sqlite3.Error: SQLite cannot open it.
    """
    check_place(path, create)
    address = address_of(PurePath(os.path.abspath(path)))
    connection = _opened(f"{address}?mode={'rwc' if create else 'rw'}")
    try:
        if create:
            _prepare(path, connection)
            return connection
        # Otherwise SQLite refuses a file that lacks pages.
        connection.execute("PRAGMA writable_schema = ON")
        try:
            connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
        except sqlite3.OperationalError as error:
            log = Path(f"{path}-wal")
            unwritable = "SQLITE_CANTOPEN", "SQLITE_READONLY", "SQLITE_IOERR"
            is_in_use = log.exists() and log.stat().st_size > 0
            if is_in_use or not error.sqlite_errorname.startswith(unwritable):
                raise
            # SQLite reads without a lock if its log cannot be made, and no other process writes.
            connection.close()
            connection = _opened(f"{address}?immutable=1")
        connection.execute("PRAGMA query_only = ON")
        check_tables(path, connection)
        if not damaged:
            _check_soundness(path, connection)
    except BaseException:
        connection.close()
        raise
    return connection


def address_of(path: PurePath) -> str:
    """Return the URI by which SQLite opens the file of an absolute path.

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
    # Invalid text damages its row, not the whole store.
    connection.text_factory = lambda content: content.decode("utf-8", "replace")
    # SQLite runs no code from the file, and detects damage when it reads.
    connection.execute("PRAGMA trusted_schema = OFF")
    connection.execute("PRAGMA cell_size_check = ON")
    return connection


def check_place(path: Path, create: bool) -> None:
    """Refuse a file that is no store by its first bytes or, with `create`, cannot become one.

    :raises StoreError: the reason.
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
            f"{path}: its folder cannot be written; name another with --store, or change its"
            " permissions"
        )
    if start != MAGIC and (start or not create):
        raise StoreError(f"{path}: is no store of ballplate sweep; {MEND}")


def check_tables(path: Path, connection: sqlite3.Connection) -> str:
    """Return the format of a store. Refuse a database with tables other than a store's, or with
    views or triggers, which may run code.

    :raises StoreError: it has some.
    :raises sqlite3.Error: SQLite cannot read it.
    """
    query = "SELECT sql FROM sqlite_master WHERE type <> 'index' AND name NOT LIKE 'sqlite!_%'"
    statements = {str(text) for (text,) in connection.execute(f"{query} ESCAPE '!'")}
    stored_format = ""
    if any(text.startswith("CREATE TABLE about ") for text in statements):
        row = connection.execute("SELECT value FROM about WHERE name = 'format'").fetchone()
        stored_format = str(row[0]) if row else ""
    if stored_format not in (FORMAT, EARLIER) and stored_format.startswith(FORMAT[:-1]):
        number = stored_format[len(FORMAT) - 1 :]
        text = f"was made by another version of ballplate (format {number}); use that version"
        raise StoreError(f"{path}: {text}, or {RECOMPUTE}")
    tables = {text.strip() for text in TABLES.split(";")[:-1]}
    if stored_format not in (FORMAT, EARLIER) or statements != tables:
        raise StoreError(f"{path}: is no store of ballplate sweep but another database; {MEND}")
    return stored_format


def _prepare(path: Path, connection: sqlite3.Connection) -> None:
    """Make the tables of an empty store, or check those of an existing one.

    :raises StoreError: it is no store, a damaged one, or one of an earlier version.
    """
    has_tables = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
    if has_tables:
        if check_tables(path, connection) != FORMAT:
            raise StoreError(
                f"{path}: was computed by an earlier version of ballplate; ballplate sweep --export"
                f" reads it; {RECOMPUTE}"
            )
        _check_soundness(path, connection)
    connection.execute("PRAGMA journal_mode = WAL")
    # Rows are on disk when a call returns.
    connection.execute("PRAGMA synchronous = FULL")
    if not has_tables:
        connection.execute("BEGIN IMMEDIATE")
        for statement in TABLES.split(";"):
            connection.execute(statement)
        connection.execute("INSERT INTO about VALUES ('format', ?)", [FORMAT])
        connection.execute("COMMIT")


def _check_soundness(path: Path, connection: sqlite3.Connection) -> None:
    fault = damage(connection)
    if fault:
        text = "ballplate sweep --export reads the undamaged cases"
        raise StoreError(f"{path}: is damaged ({fault}); {text}; {RECOMPUTE}")
