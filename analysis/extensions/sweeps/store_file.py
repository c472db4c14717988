"""The file of a store: its kind, whether it can be used as a database, and SQLite's errors in
words.

A store is input like any file: it may be cut off, of another program, of a later version, or no
file at all.
"""

from __future__ import annotations

import os
import re
import sqlite3
import stat
from collections.abc import Callable
from pathlib import Path, PurePath
from urllib.parse import quote

from ballplate.simulator.inputs import UnusableError, in_one_line

# The second format has digests of what it keeps; rows that came from the first have none.
NEWEST = 2

# Seconds to wait for another process that writes.
PATIENCE = 20.0

MAGIC = b"SQLite format 3\0"
MEND = "name a store that ballplate sweep has made"
GO_ON = (
    "ballplate export and report give what can still be read, and ballplate sweep with --store and"
    " a new name computes everything anew"
)

COLUMNS = {
    "about": {"name", "value"},
    "sweep": {"id", "definition"},
    "bundle": {"sweep", "path", "content"},
    "cell": {"sweep", "number", "key"},
    "text": {"id", "value"},
    "result": {
        *(
            "key",
            "block",
            "status",
            "reason",
            "seed",
            "names",
            "figures",
            "details",
            "versions",
            "seconds",
            "tally",
        ),
    },
}
# Tables whose rows have a digest.
WITH_DIGEST = ("sweep", "bundle", "cell", "result")

# Kinds of places that keep no store, as their modes tell them.
NO_FILES: tuple[tuple[Callable[[int], bool], str], ...] = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)

# What SQLite's result codes mean to the person whose store it is, by the beginning of their names.
WORDS = {
    "SQLITE_FULL": "cannot be written ({}); make room, then start again: nothing done is lost",
    "SQLITE_IOERR": "cannot be written ({}); make room, then start again: nothing done is lost",
    "SQLITE_BUSY": "another process is writing to it; wait for it, or end it",
    "SQLITE_LOCKED": "another process is writing to it; wait for it, or end it",
    "SQLITE_READONLY": "cannot be written ({}); check its permissions and those of its folder",
    "SQLITE_PERM": "cannot be opened ({}); check its permissions and those of its folder",
    "SQLITE_CANTOPEN": (
        "cannot be opened ({}); check its permissions, its folder's, and those of its -wal and -shm"
    ),
    "SQLITE_NOTADB": f"is no store of ballplate sweep, or its beginning is damaged ({{}}); {MEND}",
    "SQLITE_CORRUPT": (
        "is damaged ({}); restore a copy, or start anew with ballplate sweep --store and a new name"
    ),
}


class StoreError(UnusableError):
    """A store cannot be used; the text says why, and what would help."""

    def __init__(self, text: str) -> None:
        super().__init__(in_one_line(text))


def in_words(path: Path, error: sqlite3.Error) -> StoreError:
    """What SQLite says of a store, and what would help."""
    name = getattr(error, "sqlite_errorname", None) or ""
    for start, words in WORDS.items():
        if name.startswith(start):
            return StoreError(f"{path}: {words.format(error)}")
    return StoreError(f"{path}: cannot be used as a store ({error}); {MEND}")


def connected(path: Path, create: bool) -> tuple[sqlite3.Connection, str]:
    """A connection to what is a store as far as its beginning tells, and what damage shows; with
    `create` to a new one.

    Without `create` it only reads, also where nothing can be written, or where the end of the file
    is missing. Nothing blocks, and nothing is written yet.

    :raises StoreError: no file that is, or may become, a store.
    :raises sqlite3.Error: SQLite cannot open it.
    """
    check_place(path, create)
    address = address_of(PurePath(os.path.abspath(path)))
    if create:
        return _opened(f"{address}?mode=rwc"), ""
    connection, wrong = _opened(f"{address}?mode=rw"), ""
    try:
        connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
    except sqlite3.OperationalError as error:
        connection.close()
        if not error.sqlite_errorname.startswith(
            ("SQLITE_CANTOPEN", "SQLITE_READONLY", "SQLITE_IOERR")
        ):
            raise
        # In a place that cannot be written, or is full, as long as nobody else writes to the store.
        log = Path(f"{path}-wal")
        if log.exists() and log.stat().st_size > 0:
            words = (
                f"the latest changes are in {log.name}, which cannot be read in this folder"
                f" ({error})"
            )
            raise StoreError(
                f"{path}: {words}; copy both to a folder that can be written"
            ) from None
        connection = _opened(f"{address}?immutable=1")
    except sqlite3.DatabaseError as error:
        if not is_damage(error):
            connection.close()
            raise
        # So SQLite looks at a file from which pages are missing.
        connection.execute("PRAGMA writable_schema = ON")
        wrong = str(error)
    connection.execute("PRAGMA query_only = ON")
    return connection, wrong


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


def is_damage(error: sqlite3.Error) -> bool:
    """Whether it is the content of the file that is wrong."""
    return (getattr(error, "sqlite_errorname", None) or "").startswith("SQLITE_CORRUPT")


def _opened(address: str) -> sqlite3.Connection:
    connection = sqlite3.connect(address, uri=True, isolation_level=None, timeout=PATIENCE)
    # Text that is none is a matter of its row, not of the whole store.
    connection.text_factory = lambda content: content.decode("utf-8", "replace")
    # Nothing that the file defines is computed, and damage is noticed where it is met.
    connection.execute("PRAGMA trusted_schema = OFF")
    connection.execute("PRAGMA cell_size_check = ON")
    return connection


def is_same_file(one: Path, other: Path) -> bool:
    """Whether two names mean the same file, which may not be there yet."""
    try:
        return one.resolve() == other.resolve()
    except (OSError, RuntimeError):
        # Links in a circle lead to no file.
        return False


def check_place(path: Path, create: bool) -> None:
    """Refuse what is no file that is a store as its beginning tells or, with `create`, could become
    one.

    :raises StoreError: it is not.
    """
    try:
        found = os.stat(path)
        for is_kind, words in NO_FILES:
            if is_kind(found.st_mode):
                raise StoreError(f"{path}: is {words}, which keeps no store; name a file")
        with open(path, "rb") as stream:
            start = stream.read(100)
    except FileNotFoundError:
        if path.is_symlink():
            raise StoreError(
                f"{path}: is a link to a file that is not there; name a file"
            ) from None
        start = b""
        if create and not path.parent.is_dir():
            words = f"there is no folder {path.parent}; make it, or name another"
            raise StoreError(f"{path}: {words}") from None
        if not create:
            words = "there is no such store; make it with ballplate sweep"
            raise StoreError(f"{path}: {words}") from None
    except OSError as error:
        raise StoreError(
            f"{path}: cannot be opened ({error.strerror}); check its name and permissions"
        ) from None
    if create and not _is_writable(path.parent):
        raise StoreError(
            f"{path}: its folder cannot be written; name another with --store, or see to its"
            " permissions"
        )
    if not start and not create:
        raise StoreError(f"{path}: is empty; {MEND}")
    if start and not start.startswith(MAGIC[: len(start)]):
        what = " but a text file" if _is_text(start) else ", or its beginning is damaged"
        raise StoreError(f"{path}: is no store of ballplate sweep{what}; {MEND}")
    if 0 < len(start) < 100:
        raise StoreError(
            f"{path}: is cut off after {len(start)} bytes, so that nothing of it can be read;"
            f" {MEND}"
        )


def _is_writable(folder: Path) -> bool:
    is_effective = os.access in os.supports_effective_ids
    return not folder.is_dir() or os.access(folder, os.W_OK | os.X_OK, effective_ids=is_effective)


def _is_text(start: bytes) -> bool:
    return re.search(rb"[\x00-\x08\x0e-\x1a]", start) is None


def format_of(path: Path, connection: sqlite3.Connection) -> int | None:
    """The format of a store by its number, after a look at what the database consists of; None of
    an empty one.

    :raises StoreError: a database that is no store, a store of a later version, or one without
        parts that it needs.
    :raises sqlite3.Error: SQLite cannot read it.
    """
    parts = connection.execute("SELECT type, name, sql FROM sqlite_master").fetchall()
    if not parts:
        return None
    tables = {name for kind, name, _ in parts if kind == "table"}
    known = None
    if "about" in tables:
        row = connection.execute("SELECT value FROM about WHERE name = 'format'").fetchone()
        known = (
            re.fullmatch(r"ballplate sweep store ([1-9][0-9]{0,8})", str(row[0]), re.ASCII)
            if row
            else None
        )
    if known is None:
        names = ", ".join(sorted(map(str, tables))[:4])
        held = f"with the tables {names}" if names else "without tables"
        raise StoreError(f"{path}: is no store of ballplate sweep but a database {held}; {MEND}")
    number = int(known[1])
    if number > NEWEST:
        text = (
            f"was made by a later version of ballplate (format {number}, and this version reads up"
            f" to {NEWEST})"
        )
        raise StoreError(f"{path}: {text}; use that version")
    for kind, name, text in parts:
        # Views, triggers and virtual tables could make reading and writing do anything.
        if kind not in ("table", "index") or str(text or "").upper().startswith("CREATE VIRTUAL"):
            raise StoreError(
                f"{path}: has a {kind} {name}, which ballplate never makes; do not trust it, and"
                f" {MEND}"
            )
    _check_columns(path, connection, number)
    return number


def _check_columns(path: Path, connection: sqlite3.Connection, number: int) -> None:
    for table, columns in COLUMNS.items():
        found = connection.execute(f"PRAGMA table_xinfo({table})").fetchall()
        if any(hidden for *_, hidden in found):
            words = f"computes columns of {table}, as ballplate never does"
            raise StoreError(f"{path}: {words}; do not trust it, and {MEND}")
        needed = columns | ({"digest"} if number > 1 and table in WITH_DIGEST else set())
        missing = sorted(needed - {name for _, name, *_ in found})
        if not found:
            raise StoreError(
                f"{path}: lacks the table {table}, which every store has; restore a copy, or {MEND}"
            )
        if missing:
            words = f"lacks {', '.join(missing)} in the table {table}"
            raise StoreError(f"{path}: {words}, which every store has; restore a copy, or {MEND}")


def unnumbered(connection: sqlite3.Connection) -> str:
    """That SQLite does not number the texts of a store, by which results refer to them; empty where
    it does.
    """
    columns = connection.execute("PRAGMA table_info(text)").fetchall()
    keys = [(name, str(kind).upper()) for _, name, kind, _, _, place in columns if place]
    return "" if keys == [("id", "INTEGER")] else "its texts are not numbered"


def damage(connection: sqlite3.Connection) -> str:
    """What SQLite's integrity check finds wrong with a database, in short; empty where it is
    sound.
    """
    try:
        lines = [str(line) for (line,) in connection.execute("PRAGMA integrity_check(3)")]
    except sqlite3.DatabaseError as error:
        return str(error)
    except UnicodeDecodeError:
        return "names that are no text"
    if lines == ["ok"]:
        return ""
    told = "; ".join(" ".join(line.split()) for line in lines)
    return in_one_line(told.replace("*** in database main *** ", ""))[:200]
