"""Files that a command writes: declared with its options, checked before any work, and put in place
whole or not.

An option that names a file to be written is added by `add_output`. `check_outputs` then refuses,
before the command runs, whatever cannot be written or would destroy something; `write_outputs`
writes.
"""

from __future__ import annotations

import errno
import importlib.util
import os
import re
import shutil
import stat
import sys
import tempfile
from argparse import Action, ArgumentParser, Namespace
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext, suppress
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, TextIO

from .interruption import named_paths

if TYPE_CHECKING:
    from ballplate.simulator.inputs.messages import Message

EXISTS = "exists already; name a new file, or overwrite it with --force"
FORCE = "overwrite existing files"

# Options that name files which name others, as experiment, machine and map files do.
NAMING = ("files", "file", "earlier", "map", "tasks", "after")

# Names of files that a process has open; the group is the number of one of this process.
OPEN_FILE = re.compile(
    r"/dev/(?:stdout|stderr|fd/([0-9]+))|/proc/(?:self/fd/([0-9]+)|[^/]+/(?:task/[^/]+/)?fd/[0-9]+)"
)

# What belongs to a store besides its file.
BESIDE_STORE = ("-wal", "-shm", "-journal", ".lock")

Writer = Callable[[Path], object]
"""Writes a file of the kind that the path's name ends in."""

Contents = Mapping[Path, Writer | str] | Mapping[Path | None, Writer | str]
"""What files are to hold, texts or by writers; None stands for one that no option names."""


@dataclass(frozen=True)
class Needed:
    """Modules beside those that every installation has: for `what`, and the extra that installs
    them.
    """

    what: str
    modules: tuple[str, ...]
    extra: str

    @property
    def told(self) -> str:
        """What is missing, and how to get it."""
        them = "it" if len(self.modules) == 1 else "them"
        names = " and ".join(self.modules)
        return (
            f"{self.what} {names}; install {them} with: python -m pip install"
            f" 'ballplate[{self.extra}]'"
        )

    @property
    def is_missing(self) -> bool:
        """Whether one of the modules is not installed."""
        return any(importlib.util.find_spec(name) is None for name in self.modules)


PICTURE = Needed("pictures need", ("matplotlib",), "report")
PAGE = Needed("a page needs", ("jinja2", "matplotlib"), "report")
PARQUET = Needed("Parquet needs", ("pyarrow",), "parquet")


@dataclass(frozen=True)
class Output:
    """A file that a command is to write, by the option that names it."""

    dest: str
    option: str
    path: Path
    needed: Needed | None
    takes_screen: bool

    @property
    def is_screen(self) -> bool:
        """Whether standard output is meant."""
        return self.takes_screen and str(self.path) == "-"


class UsageError(ValueError):
    """Options that do not go together, or one whose value cannot be used here."""


class OutputAction(Action):
    """An option that names a file to be written; `options.outputs` has all of them that are
    given.
    """

    def __init__(
        self,
        *arguments: Any,
        needed: Callable[[Path], Needed | None] = lambda path: None,
        takes_screen: bool = False,
        **others: Any,
    ) -> None:
        super().__init__(*arguments, **others)
        self.needed, self.takes_screen = needed, takes_screen

    def __call__(
        self, parser: ArgumentParser, namespace: Namespace, values: Any, option_string: Any = None
    ) -> None:
        setattr(namespace, self.dest, values)
        output = Output(
            self.dest,
            option_string or str(self.metavar),
            values,
            self.needed(values),
            self.takes_screen,
        )
        others = [one for one in getattr(namespace, "outputs", ()) if one.dest != self.dest]
        namespace.outputs = (*others, output)


def add_output(parser: Any, *names: str, metavar: str, help: str, **settings: Any) -> None:
    """Add an option that names a file to be written.

    ``needed`` gives, by the file's name, what writing it needs beside what every installation has;
    with ``takes_screen`` the name - means standard output.
    """
    parser.add_argument(
        *names, action=OutputAction, metavar=metavar, help=help, **{"type": Path, **settings}
    )


def add_force(parser: Any) -> None:
    """Add the permission to overwrite."""
    parser.add_argument("--force", action="store_true", help=FORCE)


def check_outputs(options: Namespace) -> None:
    """Refuse files that cannot be written, or in whose place something stands, before the work and
    not after it.

    Devices and pipes are written as they are, and are not checked. Whatever else the options name
    is read.

    :raises UsageError: an output is an input, another output, or where standard output goes.
    :raises ExperimentError: without `--force` there is one already; one cannot be written; an extra
        is missing.
    """
    from ballplate.simulator.inputs.messages import ExperimentError

    given = getattr(options, "outputs", ())
    screens = [one.option for one in given if one.is_screen]
    if len(screens) > 1:
        raise UsageError(f"{' and '.join(screens)} both go to the screen; name a file for one")
    outputs = [one for one in given if not one.is_screen]
    _refuse_screen(outputs)
    # What is tried is taken away.
    held = options.interruption.held
    with held():
        _refuse_same(outputs)
    _refuse_inputs(outputs, options)
    messages = []
    for one in outputs:
        with held():
            messages += _reasons_against(one, options.force)
    if messages:
        raise ExperimentError(messages)


def check_overwritten(path: Path) -> None:
    """Refuse a file that cannot be put in the place of the one that is there.

    :raises ExperimentError: it cannot be written.
    """
    from ballplate.simulator.inputs.messages import ExperimentError

    reasons = _reasons_against(Output("files", "--fix", path, None, False), force=True)
    if reasons:
        raise ExperimentError(reasons)


def _refuse_screen(outputs: list[Output]) -> None:
    for one in outputs:
        if str(one.path) == "-":
            raise UsageError(
                f"{one.option} - would be standard output, which has the rest; name a file"
            )
        found = _status(one.path)
        if found is not None and not _is_in_place(one.path) and _is_standard_output(found):
            raise UsageError(
                f"{one.option} {one.path} is where standard output goes; name another file"
            )


def _refuse_same(outputs: list[Output]) -> None:
    for one, other in combinations(outputs, 2):
        first, second = _target(one.path), _target(other.path)
        is_same = first == second
        if first.parent == second.parent and first.name.casefold() == second.name.casefold():
            is_same |= _is_case_blind(first.parent)
        if is_same:
            raise UsageError(
                f"{one.option} {one.path} and {other.option} {other.path} are the same file; name"
                " another"
            )


def _refuse_inputs(outputs: list[Output], options: Namespace) -> None:
    there = [
        (one, found)
        for one in outputs
        if (found := _status(one.path)) and stat.S_ISREG(found.st_mode)
    ]
    if not there:
        return
    for path in inputs(options, {one.dest for one in outputs}):
        status = _status(path)
        for one, found in there:
            if status is not None and os.path.samestat(status, found):
                raise UsageError(
                    f"{one.option} {one.path} would overwrite {path}, which is read; name another"
                    " file"
                )


def inputs(options: Namespace, outputs: set[str]) -> Iterator[Path]:
    """Files that the options name and that are not written, and those that these files name."""
    from ballplate.simulator.experiment.named_files import named_by

    for name, path in named_paths(options):
        if name in outputs:
            continue
        yield path
        if name == "store" and path.name:
            yield from (path.with_name(path.name + ending) for ending in BESIDE_STORE)
        if name in NAMING and path.suffix.lower() != ".csv":
            yield from named_by(path)


def _reasons_against(output: Output, force: bool) -> list[Message]:
    """Why an output cannot be written."""
    from ballplate.simulator.inputs.messages import Message

    path, reasons = output.path, []
    if output.needed is not None and output.needed.is_missing:
        reasons.append(output.needed.told)
    try:
        found = _status_or_none(path)
        if found is not None and stat.S_ISDIR(found.st_mode):
            reasons.append("is a folder; name a file in it")
        elif found is None or not _is_in_place(path):
            if found is not None and not force:
                reasons.append(EXISTS)
            elif found is not None:
                # Without writing anything; tells of permissions, and of other programs that hold it
                # on Windows.
                path.open("r+b").close()
            with _tried(_target(path)):
                pass
    except (OSError, ValueError) as error:
        reasons.append(_cannot(error))
    return [Message(str(path), 0, 0, "", reason) for reason in reasons]


def write_outputs(
    writers: Mapping[Path, Writer],
    force: bool,
    held: Callable[[], AbstractContextManager[None]] = nullcontext,
) -> bool:
    """Let each writer write its file, all of them or, as far as the system allows, none; False
    after saying why not.

    Each is written beside its place under another name and put there only when all have been
    written to the disk, with the permissions of the file that was there before. A link stays one:
    what it leads to is replaced. Devices and pipes are written as they are. Without `force` no file
    is put in the place of another that has come meanwhile. `held` keeps signals back while files
    are put into their places or taken away.
    """
    from ballplate.simulator.inputs.messages import Message

    temporaries: dict[Path, Path] = {}
    path = Path()
    try:
        for path, writer in writers.items():
            if not _is_in_place(path):
                temporaries[path] = temporary = _beside(_target(path))
                _make(temporary)
                writer(temporary)
                _settle(temporary, _target(path))
        for path, writer in writers.items():
            if _is_in_place(path):
                _write_in_place(path, writer)
        with held(), _exchange(force) as put:
            for path, temporary in temporaries.items():
                put(temporary, _target(path))
    except (OSError, UnicodeEncodeError, ImportError) as error:
        kept = (
            "" if _status(path) is None or _is_in_place(path) else "; the file there is as it was"
        )
        print(Message(str(path), 0, 0, "", _cannot(error) + kept), file=sys.stderr)
        return False
    finally:
        with held():
            _remove(temporaries.values())
    return True


def write(options: Namespace, contents: Contents) -> bool:
    """Write the files of a command.

    The command ends with the status of a file that cannot be used if one of them cannot be written;
    whether they are.
    """
    writers = {
        path: text_writer(partial(_print, content)) if isinstance(content, str) else content
        for path, content in contents.items()
        if path is not None
    }
    is_written = write_outputs(writers, options.force, options.interruption.held)
    options.is_written = is_written and options.is_written
    return bool(options.is_written)


def _print(text: str, stream: TextIO) -> None:
    stream.write(text)


def text_writer(print_to: Callable[[TextIO], object]) -> Writer:
    """A writer of text, in UTF-8 and with line ends as they are."""

    def write_file(path: Path) -> None:
        with path.open("w", encoding="utf-8", newline="") as stream:
            print_to(stream)

    return write_file


def _cannot(error: Exception) -> str:
    """That a file cannot be written, why, and what to do."""
    if isinstance(error, ImportError):
        missing = (error.name or "").partition(".")[0]
        for needed in (PICTURE, PAGE, PARQUET):
            if missing in needed.modules:
                return needed.told
        raise error
    if isinstance(error, FileExistsError):
        return EXISTS
    number = getattr(error, "errno", None)
    remedies = {
        errno.ENOENT: "check the folder",
        errno.ENOTDIR: "check the folder",
        errno.ENOSPC: "make room, or name a file on another disk",
        errno.EDQUOT: "make room, or name a file on another disk",
        errno.EFBIG: (
            "files may not be so large here; raise the limit, or name a file on another disk"
        ),
        errno.EROFS: "name a file on another disk",
        errno.ENAMETOOLONG: "name it shorter",
    }
    remedy = remedies.get(number or 0, "name another file")
    if isinstance(error, PermissionError):
        remedy = (
            "if another program has it open, close it there; check the permissions, or name another"
            " file"
        )
    return f"cannot be written ({getattr(error, 'strerror', None) or error}); {remedy}"


def _status(path: Path) -> os.stat_result | None:
    """What there is, None where that cannot be told."""
    try:
        return path.stat()
    except (OSError, ValueError):
        return None


def _status_or_none(path: Path) -> os.stat_result | None:
    """What there is, None where there is nothing.

    :raises OSError: it cannot be told.
    """
    try:
        return path.stat()
    except FileNotFoundError:
        return None


def _target(path: Path) -> Path:
    """Where a path leads to by its links."""
    return Path(os.path.realpath(path))


def _is_in_place(path: Path) -> bool:
    """Whether it is a device, a pipe, or an open file of the process's, of which no other can take
    the place.
    """
    if OPEN_FILE.fullmatch(os.path.abspath(path)):
        return True
    found = _status(path)
    return found is not None and not stat.S_ISREG(found.st_mode) and not stat.S_ISDIR(found.st_mode)


def _is_standard_output(status: os.stat_result) -> bool:
    try:
        return os.path.samestat(status, os.fstat(1))
    except OSError:
        return False


def _is_case_blind(folder: Path) -> bool:
    """Whether names in a folder that differ in capitals alone mean the same file; False where
    nothing can be tried.
    """
    try:
        with _tried(folder / "a") as temporary:
            return temporary.with_name(temporary.name.upper()).exists()
    except OSError:
        return False


@contextmanager
def _tried(target: Path) -> Iterator[Path]:
    """An empty file beside another one, for as long as it takes to see what the folder makes of
    it.
    """
    path = _beside(target)
    try:
        _make(path)
        yield path
    finally:
        with suppress(OSError):
            path.unlink()


def _beside(target: Path) -> Path:
    """A name that no other file has, beside one, for a content of the same kind."""
    return target.with_name(f".ballplate-{os.urandom(8).hex()}{target.suffix.lower()}")


def _make(path: Path) -> None:
    """Make a new file with the permissions that new files have."""
    os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))


def _settle(temporary: Path, target: Path) -> None:
    """Give a finished file the permissions of the one whose place it takes, and have all of it on
    the disk.
    """
    with temporary.open("r+b") as stream:
        os.fsync(stream.fileno())
    before = _status(target)
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
def _exchange(force: bool) -> Iterator[Callable[[Path, Path], None]]:
    """Put files in the places of others; if one cannot be put, those before it go back."""
    with ExitStack() as names, ExitStack() as back:

        def put(temporary: Path, target: Path) -> None:
            undo: Callable[[], object] = partial(target.unlink, missing_ok=True)
            if force and _status(target) is not None:
                kept = _beside(target)
                undo = partial(os.replace, kept, target)
                try:
                    os.link(target, kept)
                    names.callback(_remove, [kept])
                except (OSError, NotImplementedError):
                    # On disks without hard links the file that was there cannot come back.
                    undo = nullcontext
            _put(temporary, target, force)
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


def _write_in_place(path: Path, writer: Writer) -> None:
    """Write a device or pipe: what is drawn may need a file in which one can go back."""
    with tempfile.TemporaryDirectory(prefix="ballplate-") as folder:
        whole = Path(folder, f"whole{path.suffix.lower()}")
        writer(whole)
        found = _status(path)
        with whole.open("rb") as content:
            if found is not None and _is_standard_output(found) and hasattr(sys.stdout, "buffer"):
                sys.stdout.flush()
                shutil.copyfileobj(content, sys.stdout.buffer)
                sys.stdout.buffer.flush()
            else:
                with _in_place(path, found) as stream:
                    shutil.copyfileobj(content, stream)


def _in_place(path: Path, status: os.stat_result | None) -> BinaryIO:
    """A device or pipe to be written, or an open file of the process's, which goes on where it is
    and loses nothing.
    """
    own = OPEN_FILE.fullmatch(os.path.abspath(path))
    if own is None or status is None or not stat.S_ISREG(status.st_mode):
        return path.open("wb")
    number = own[1] or own[2]
    return os.fdopen(os.dup(int(number)), "wb") if number else path.open("ab")
