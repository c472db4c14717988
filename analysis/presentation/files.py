"""Files that are written: each is put in its place as a whole, and several together or none."""

from __future__ import annotations

import errno
import os
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from functools import partial
from pathlib import Path

Writer = Callable[[Path], object]
"""Writes a file of the kind that the path's name ends in."""


class UnwrittenError(OSError):
    """A file cannot be written; the cause says why."""


def write_file(path: str | Path, content: bytes) -> None:
    """Write a file as a whole.

    :raises OSError: it cannot be written; where its folder is missing the text says so.

    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     write_file(f"{folder}/page.html", b"<p>")
    ...     Path(folder, "page.html").read_bytes()
    b'<p>'
    """
    # Loads numpy, which the commands do only when interruptions are answered.
    from ballplate.simulator.inputs.arguments import ensure_path

    ensure_path("path", path)
    path = Path(path)
    if not path.parent.is_dir():
        text = f"there is no folder {path.parent}; make it, or name another"
        raise FileNotFoundError(errno.ENOENT, text, str(path))
    write_files({path: lambda place: place.write_bytes(content)}, force=True)


def write_files(
    writers: Mapping[Path, Writer],
    force: bool,
    held: Callable[[], AbstractContextManager[None]] = nullcontext,
) -> None:
    """Let each writer write its file, all of them or, as far as the system allows, none.

    Each is written beside its place under another name and put there only when all have been
    written to the disk, with the permissions of the file that was there before. A link stays one:
    what it leads to is replaced. Devices and pipes are written as they are. Without `force` no file
    is put in the place of another that has come meanwhile. `held` keeps signals back while files
    are put into their places or taken away.

    :raises UnwrittenError: one of them cannot be written, or what it needs is not installed.
    """
    temporaries: dict[Path, Path] = {}
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
        with held(), _exchange(force, len(temporaries) > 1) as put:
            for path, temporary in temporaries.items():
                put(temporary, real(path))
    except (OSError, UnicodeEncodeError, ImportError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise UnwrittenError(getattr(error, "errno", None), why, str(path)) from error
    finally:
        with held():
            _remove(temporaries.values())


def status_of(path: Path) -> os.stat_result | None:
    """What there is, None where that cannot be told."""
    try:
        return path.stat()
    except (OSError, ValueError):
        return None


def real(path: Path) -> Path:
    """Where a path leads to by its links."""
    return Path(os.path.realpath(path))


def is_device(path: Path) -> bool:
    """Whether it is a device or a pipe, of which no file can take the place."""
    status = status_of(path)
    return status is not None and not (stat.S_ISREG(status.st_mode) or stat.S_ISDIR(status.st_mode))


def beside(target: Path) -> Path:
    """A name that no other file has, beside one, for a content of the same kind."""
    return target.with_name(f".ballplate-{os.urandom(8).hex()}{target.suffix.lower()}")


def make(path: Path) -> None:
    """Make a new file with the permissions that new files have."""
    os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))


def _settle(temporary: Path, target: Path) -> None:
    """Give a finished file the permissions of the one whose place it takes, and have all of it on
    the disk.
    """
    with temporary.open("r+b") as stream:
        os.fsync(stream.fileno())
    before = status_of(target)
    if before is None:
        return
    if hasattr(os, "chown"):
        # Of root, who may give files away; others own what they write.
        with suppress(OSError):
            os.chown(temporary, before.st_uid, before.st_gid)
    temporary.chmod(stat.S_IMODE(before.st_mode))


def _remove(paths: Iterable[Path]) -> None:
    for path in paths:
        with suppress(OSError):
            path.unlink(missing_ok=True)


@contextmanager
def _exchange(force: bool, are_several: bool) -> Iterator[Callable[[Path, Path], None]]:
    """Put files in the places of others; if one cannot be put, those before it go back."""
    with ExitStack() as names, ExitStack() as back:

        def put(temporary: Path, target: Path) -> None:
            undo: Callable[[], object] = partial(target.unlink, missing_ok=True)
            if force and status_of(target) is not None:
                kept = beside(target)
                undo = partial(os.replace, kept, target)
                try:
                    if are_several:
                        os.link(target, kept)
                        names.callback(_remove, [kept])
                except (OSError, NotImplementedError):
                    # On disks without hard links the file that was there cannot come back.
                    undo = nullcontext
            _put(temporary, target, force)
            if are_several:
                back.callback(undo)

        yield put
        back.pop_all()


def _put(temporary: Path, target: Path, force: bool) -> None:
    if not force:
        try:
            # Unlike a change of name this never takes the place of another file.
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
    """Write a device or pipe: what is drawn may need a file in which one can go back."""
    with tempfile.TemporaryDirectory(prefix="ballplate-") as folder:
        whole = Path(folder, f"whole{path.suffix.lower()}")
        writer(whole)
        with whole.open("rb") as content, path.open("wb") as stream:
            shutil.copyfileobj(content, stream)
