"""Atomic writing of files: each as a whole, several together or none."""

from __future__ import annotations

import errno
import os
import shutil
import signal
import stat
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from functools import partial
from pathlib import Path

from ballplate.simulator.computing.signals import interruptions_blocked

Writer = Callable[[Path], object]
"""A function that writes the file of a path, in the format of the name's suffix."""


class UnwrittenError(OSError):
    """A file cannot be written; the cause has the reason."""


def write_file(path: str | Path, content: bytes) -> None:
    """Write a file as a whole.

    :raises OSError: it cannot be written; the text names a missing folder.

    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     write_file(f"{folder}/page.html", b"<p>")
    ...     Path(folder, "page.html").read_bytes()
    b'<p>'
    """
    # Imported late: it loads numpy, and a command answers interruptions first.
    from ballplate.simulator.inputs.arguments import ensure_path

    ensure_path("path", path)
    path = Path(path)
    if not path.parent.is_dir():
        text = f"there is no folder {path.parent}; make it, or name another"
        raise FileNotFoundError(errno.ENOENT, text, str(path))
    write_files({path: lambda place: place.write_bytes(content)}, force=True)


def write_files(writers: Mapping[Path, Writer], force: bool) -> None:
    """Let each writer write its file: all of them or, if the system permits, none.

    Each is written to a temporary name in the same folder, with the permissions of the existing
    file, and renamed when all are on the disk. Links stay: their targets are replaced. Devices and
    pipes are written directly. Without `force` no existing file is replaced, even one created
    meanwhile. Signals wait while files are renamed or removed.

    :raises UnwrittenError: one cannot be written, or a library that it needs is not installed.
    """
    temporaries = {}
    path = Path()
    try:
        for path, writer in writers.items():
            if not is_device(path):
                temporaries[path] = temporary = beside(real(path))
                make(temporary)
                writer(temporary)
                _settle(temporary, real(path))
        for path, writer in writers.items():
            if is_device(path):
                _write_device(path, writer)
        with (
            interruptions_blocked(signal.SIGTERM),
            _exchange(force, len(temporaries) > 1) as replace,
        ):
            for path, temporary in temporaries.items():
                replace(temporary, real(path))
    except (OSError, UnicodeEncodeError, ImportError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise UnwrittenError(getattr(error, "errno", None), why, str(path)) from error
    finally:
        with interruptions_blocked(signal.SIGTERM):
            _remove(temporaries.values())


def status_of(path: Path) -> os.stat_result | None:
    """Return the status of a path, or None."""
    try:
        return path.stat()
    except (OSError, ValueError):
        return None


def real(path: Path) -> Path:
    """Return the target of a path's links."""
    return Path(os.path.realpath(path))


def is_device(path: Path) -> bool:
    """Return whether a path is a device or a pipe, which no file can replace."""
    status = status_of(path)
    return status is not None and not (stat.S_ISREG(status.st_mode) or stat.S_ISDIR(status.st_mode))


def beside(target: Path) -> Path:
    """Return a new temporary name in the folder of a file, with its suffix."""
    return target.with_name(f".ballplate-{os.urandom(8).hex()}{target.suffix.lower()}")


def make(path: Path) -> None:
    """Create a file with default permissions."""
    os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))


def _settle(temporary: Path, target: Path) -> None:
    """Flush a finished file to the disk, with the permissions of the file that it will replace."""
    with temporary.open("r+b") as stream:
        os.fsync(stream.fileno())
    before = status_of(target)
    if before is None:
        return
    if hasattr(os, "chown"):
        # Only root may change the owner.
        with suppress(OSError):
            os.chown(temporary, before.st_uid, before.st_gid)
    temporary.chmod(stat.S_IMODE(before.st_mode))


def _remove(paths: Iterable[Path]) -> None:
    for path in paths:
        with suppress(OSError):
            path.unlink(missing_ok=True)


@contextmanager
def _exchange(force: bool, are_several: bool) -> Iterator[Callable[[Path, Path], None]]:
    """Yield a function that replaces files; if it fails, restore those replaced before."""
    with ExitStack() as names, ExitStack() as back:

        def replace(temporary: Path, target: Path) -> None:
            undo: Callable[[], object] = partial(target.unlink, missing_ok=True)
            if force and status_of(target) is not None:
                backup = beside(target)
                undo = partial(os.replace, backup, target)
                try:
                    if are_several:
                        os.link(target, backup)
                        names.callback(_remove, [backup])
                except (OSError, NotImplementedError):
                    # Without hard links the former file cannot be restored.
                    undo = nullcontext
            _replace(temporary, target, force)
            if are_several:
                back.callback(undo)

        yield replace
        back.pop_all()


def _replace(temporary: Path, target: Path, force: bool) -> None:
    if not force:
        try:
            # Unlike a renaming, a link never replaces another file.
            os.link(temporary, target)
        except FileExistsError:
            raise
        except (OSError, NotImplementedError):
            # No hard links on this disk.
            if os.path.lexists(target):
                raise FileExistsError(
                    errno.EEXIST, os.strerror(errno.EEXIST), str(target)
                ) from None
        else:
            return
    os.replace(temporary, target)


def _write_device(path: Path, writer: Writer) -> None:
    # Drawings need a file that can be rewound, which a device or pipe cannot.
    with tempfile.TemporaryDirectory(prefix="ballplate-") as folder:
        whole = Path(folder, f"whole{path.suffix.lower()}")
        writer(whole)
        with whole.open("rb") as content, path.open("wb") as stream:
            shutil.copyfileobj(content, stream)
