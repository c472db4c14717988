"""Options of `ballplate init` that draft an experiment from a data sheet, and the same as questions
at a terminal.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable

from ballplate.cli import UsageError, argument_type

from .checked_draft import checked_draft
from .data_sheet import NEEDED, READERS, data_sheet
from .machine_tables import table


def add_data_sheet(parser: ArgumentParser) -> None:
    """Add the options of a data sheet to `ballplate init`."""
    parser.add_argument(
        "--example", action="store_true", help="write the example, without any question"
    )
    sheet = parser.add_argument_group(
        "a file for plan from the data sheet of a machine",
        "Without any of these, init asks for them at a terminal, and writes the example elsewhere.",
    )
    for name, read in READERS.items():
        help = table("entries")[name]["help"]
        sheet.add_argument(_option(name), metavar="TEXT", type=_readable(read), help=help)


def drafted(options: Namespace) -> tuple[str, str] | None:
    """Return the text of the drafted file and the next command; None for the example.

    :raises UsageError: values are missing or do not go together.
    """
    texts = {name: getattr(options, name) for name in READERS if getattr(options, name) is not None}
    if options.machine or options.example:
        if texts:
            raise UsageError("--machine and --example take no data sheet; give only one of them")
        return None
    is_terminal = bool(sys.stdin and sys.stdin.isatty() and sys.stdout.isatty())
    if not texts and not is_terminal:
        return None
    wanted = [name for name in (NEEDED if texts else READERS) if name not in texts]
    if wanted and not is_terminal:
        entries = table("entries")
        lacking = " ".join(f'{_option(name)} "{entries[name]["default"]}"' for name in wanted)
        raise UsageError(f"the data sheet lacks values; add for example {lacking}")
    for name in wanted:
        # In two dimensions one probe is all there is.
        if name != "tips" or len(READERS["volume"](texts["volume"])) == 3:
            texts[name] = _answer(name, texts, options)
    try:
        text, command, _ = checked_draft(options.file, data_sheet(texts), texts)
        return text, command
    except ValueError as error:
        raise UsageError(str(error)) from None


def _answer(name: str, texts: dict[str, str], options: Namespace) -> str:
    """Return an answer at the terminal that goes with the earlier ones; nothing is the default.

    :raises UsageError: the input ends.
    """
    entry = table("entries")[name]
    while True:
        default = entry["default"] or entry["usual"]
        print(f"{entry['question']} [{default}]: ", end="", file=sys.stderr, flush=True)
        line = sys.stdin.readline()
        if not line:
            raise UsageError(f"no answer for {_option(name)}; nothing is written")
        answer = line.strip() or str(entry["default"])
        try:
            stated = {**texts, name: answer}
            sheet = data_sheet(stated)
            # As soon as both are known, with usual tips and hours.
            if "plate" in stated:
                _ = sheet.places
            if name == "hours":
                checked_draft(options.file, sheet, stated)
        except ValueError as error:
            print(error, file=sys.stderr)
        else:
            return answer


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _readable(read: Callable[[str], object]) -> Callable[[str], str]:
    """Return the type of an argument that keeps its text, refused at once if it cannot be read."""

    def checked(text: str) -> str:
        read(text)
        return text

    return argument_type(checked)
