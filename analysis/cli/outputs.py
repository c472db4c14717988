"""Output files of a command: declared with its options, checked before any work, and written whole
or not at all.

`add_output` adds an option that names a file to write. Before the command runs, `check_outputs`
refuses files that cannot be written or whose writing would destroy something; `write_outputs`
writes.
"""

from __future__ import annotations

import importlib.util
import os
import signal
import stat
import sys
from argparse import Action, ArgumentParser, Namespace
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from ballplate.simulator.computing.signals import interruptions_blocked

if TYPE_CHECKING:
    from ballplate.presentation.files import Writer

    Contents = Mapping[Path, Writer | str] | Mapping[Path | None, Writer | str]
    """Contents of files, as text or by writers; the path is None if no option names the file."""
    from ballplate.simulator.inputs.messages import Message

EXISTS = "exists already; name a new file, or overwrite it with --force"
FORCE = "overwrite existing files"
REMEDY = (
    "check the folder, its permissions and its room, and whether another program has the file open"
)

# Options that name files which name others, as experiment, machine, map and part files do.
NAMING = ("files", "file", "earlier", "map", "tasks", "after", "design")

# What belongs to a store besides its file.
BESIDE_STORE = ("-wal", "-shm", "-journal", ".lock")


@dataclass(frozen=True)
class Needed:
    """Modules of an extra, for `what`, and the extra that installs them."""

    what: str
    modules: tuple[str, ...]
    extra: str

    @property
    def told(self) -> str:
        """Missing modules, and the command that installs them."""
        pronoun = "it" if len(self.modules) == 1 else "them"
        names = " and ".join(self.modules)
        return (
            f"{self.what} {names}; install {pronoun} with: python -m pip install"
            f" 'ballplate[{self.extra}]'"
        )

    @property
    def is_missing(self) -> bool:
        """True if one of the modules is not installed."""
        return any(importlib.util.find_spec(name) is None for name in self.modules)


PICTURE = Needed("pictures need", ("matplotlib",), "report")
PARQUET = Needed("Parquet needs", ("pyarrow",), "parquet")
XLSX = Needed("workbooks need", ("openpyxl",), "xlsx")


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
        """True if standard output is meant."""
        return self.takes_screen and str(self.path) == "-"


class UsageError(ValueError):
    """Options that do not go together, or one whose value cannot be used here."""


class OutputAction(Action):
    """An option that names a file to write; `options.outputs` has all given ones."""

    def __init__(
        self,
        *arguments: Any,
        needed: Callable[[Path], Needed | None] = lambda path: None,
        takes_screen: bool = False,
        **settings: Any,
    ) -> None:
        super().__init__(*arguments, **settings)
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
        other_outputs = [
            output for output in getattr(namespace, "outputs", ()) if output.dest != self.dest
        ]
        namespace.outputs = (*other_outputs, output)


def add_output(parser: Any, *names: str, metavar: str, help: str, **settings: Any) -> None:
    """Add an option that names a file to write.

    ``needed`` gives, by the file's name, the extra that writing it needs; with ``takes_screen``
    the name - is standard output.
    """
    parser.add_argument(
        *names, action=OutputAction, metavar=metavar, help=help, **{"type": Path, **settings}
    )


def add_force(parser: Any) -> None:
    """Add the permission to overwrite."""
    parser.add_argument("--force", action="store_true", help=FORCE)


def check_outputs(options: Namespace) -> None:
    """Refuse output files that cannot be written, or that exist, before the work.

    Devices and pipes are written directly, without checks. All other files that the options name
    are inputs.

    :raises UsageError: an output is an input, another output, or the target of standard output.
    :raises ExperimentError: a file exists, without `--force`; cannot be written; or needs an extra
        that is missing.
    """
    from ballplate.simulator.inputs.messages import ExperimentError

    chosen_outputs = getattr(options, "outputs", ())
    screens = [output.option for output in chosen_outputs if output.is_screen]
    if len(screens) > 1:
        raise UsageError(f"{' and '.join(screens)} both go to the screen; name a file for one")
    outputs = [output for output in chosen_outputs if not output.is_screen]
    if not outputs:
        return
    _refuse_screen(outputs)
    _refuse_same(outputs)
    _refuse_inputs(outputs, options)
    messages = []
    for output in outputs:
        messages += _reasons_against(output, options.force)
    if messages:
        raise ExperimentError(messages)


def _refuse_screen(outputs: list[Output]) -> None:
    from ballplate.presentation.files import is_device, status_of

    for output in outputs:
        if str(output.path) == "-":
            raise UsageError(
                f"{output.option} - would be standard output, which has the rest; name a file"
            )
        status = status_of(output.path)
        if status is not None and not is_device(output.path) and _is_standard_output(status):
            raise UsageError(
                f"{output.option} {output.path} is where standard output goes; name another file"
            )


def _refuse_same(outputs: list[Output]) -> None:
    from ballplate.presentation.files import real

    for first, second in combinations(outputs, 2):
        # There are disks on which capitals make no other file.
        if str(real(first.path)).casefold() == str(real(second.path)).casefold():
            raise UsageError(
                f"{first.option} {first.path} and {second.option} {second.path} are the same file;"
                " name"
                " another"
            )


def _refuse_inputs(outputs: list[Output], options: Namespace) -> None:
    from ballplate.presentation.files import status_of

    there = [
        (output, status_there)
        for output in outputs
        if (status_there := status_of(output.path)) and stat.S_ISREG(status_there.st_mode)
    ]
    if not there:
        return
    # Compared by the file itself, since links and different spellings of a path lead to one file.
    for path in inputs(options, {output.dest for output in outputs}):
        status = status_of(path)
        for output, status_there in there:
            if status is not None and os.path.samestat(status, status_there):
                raise UsageError(
                    f"{output.option} {output.path} would overwrite {path}, which is read; name"
                    " another"
                    " file"
                )


def named_paths(options: Namespace) -> Iterator[tuple[str, Path]]:
    """Paths among the options of a command, with the options' names."""
    for name, value in vars(options).items():
        for item in value if isinstance(value, list) else [value]:
            if isinstance(item, Path):
                yield name, item


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
    from ballplate.presentation.files import beside, is_device, make, real
    from ballplate.simulator.inputs.messages import Message

    path, reasons = output.path, []
    if output.needed is not None and output.needed.is_missing:
        reasons.append(output.needed.told)
    try:
        if path.is_dir():
            reasons.append("is a folder; name a file in it")
        elif not is_device(path):
            if path.exists() and not force:
                reasons.append(EXISTS)
            elif path.exists():
                # Without writing anything; tells of permissions, and of other programs that hold it
                # on Windows.
                path.open("r+b").close()
            # Whether the folder takes a file is known only after making one. Output is written to
            # such a file first and then moved, so that this tests what will be done.
            temporary = beside(real(path))
            with interruptions_blocked(signal.SIGTERM):
                make(temporary)
                temporary.unlink()
    except (OSError, ValueError) as error:
        reasons.append(_cannot(error))
    return [Message(str(path), 0, 0, "", reason) for reason in reasons]


def write_outputs(writers: Mapping[Path, Writer], force: bool) -> bool:
    """Write files as `write_files` does; False after saying why not."""
    from ballplate.presentation.files import UnwrittenError, is_device, status_of, write_files
    from ballplate.simulator.inputs.messages import Message

    try:
        if any(map(is_device, writers)):
            # What was printed before stands before it, where it is standard output.
            sys.stdout.flush()
        write_files(writers, force)
    except UnwrittenError as error:
        path = Path(error.filename)
        unchanged = (
            "" if status_of(path) is None or is_device(path) else "; the existing file is unchanged"
        )
        print(Message(str(path), 0, 0, "", _cannot(error.__cause__) + unchanged), file=sys.stderr)
        return False
    return True


def write(options: Namespace, contents: Contents) -> bool:
    """Write the files of a command; return true if all were written.

    Otherwise the command ends with the status of a file that cannot be used.
    """
    writers = {
        path: text_writer(partial(_print, content)) if isinstance(content, str) else content
        for path, content in contents.items()
        if path is not None
    }
    is_written = write_outputs(writers, options.force)
    options.is_written = is_written and options.is_written
    return bool(options.is_written)


def _print(text: str, stream: TextIO) -> None:
    stream.write(text)


def text_writer(print_to: Callable[[TextIO], object]) -> Writer:
    """Return a writer of text, in UTF-8 and with unchanged line ends."""

    def write_file(path: Path) -> None:
        with path.open("w", encoding="utf-8", newline="") as stream:
            print_to(stream)

    return write_file


def _cannot(error: BaseException | None) -> str:
    """That a file cannot be written, why, and what to do."""
    if isinstance(error, ImportError):
        missing = (error.name or "").partition(".")[0]
        for needed in (PICTURE, PARQUET, XLSX):
            if missing in needed.modules:
                return needed.told
        raise error
    if isinstance(error, FileExistsError):
        return EXISTS
    return f"cannot be written ({getattr(error, 'strerror', None) or error}); {REMEDY}"


def _is_standard_output(status: os.stat_result) -> bool:
    try:
        return os.path.samestat(status, os.fstat(1))
    except OSError:
        return False
