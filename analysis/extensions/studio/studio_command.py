"""`ballplate studio`: a design in the browser, moved and changed, with its uncertainties."""

from __future__ import annotations

from argparse import ArgumentParser, ArgumentTypeError, Namespace
from importlib.resources import files
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

from ballplate.cli import Needed, UsageError, add_file, note, whole

if TYPE_CHECKING:
    from .session import Session

STUDIO = Needed("the studio needs", ("starlette", "uvicorn"), "studio")

DESCRIPTION = (
    "Serve a page, to this machine only, on which the positions of a design are dragged, turned,"
    " added and switched off, and its settings changed, with rank, uncertainties and map after"
    " every move. Without FILE, or if it does not exist, the page asks the questions of init. The"
    " page is served until Ctrl-C; the file is written when Save is pressed."
)


def add_options(parser: ArgumentParser) -> None:
    add_file(parser, needed=False)
    parser.add_argument(
        "--port", metavar="N", type=_port, default=0, help="port; default: any that is free"
    )
    parser.add_argument(
        "--no-browser", action="store_true", help="print the address, and open no browser"
    )


def _port(text: str) -> int:
    port = whole(text)
    if not port < 2**16:
        raise ArgumentTypeError(f"a port is at most 65535, not {port}")
    return port


def named_file(path: Path) -> Path:
    """Return the path of a design: itself, or that of a new file in a folder."""
    if not path.is_dir():
        return path
    numbers = (f"-{number}" if number > 1 else "" for number in count(1))
    names = (path / f"design{number}.yaml" for number in numbers)
    return next(name for name in names if not name.exists())


def unsaved(session: Session) -> str:
    """Return the note at the end of the studio."""
    from .recovery import kept_in

    if session.is_saved:
        return "all changes are saved"
    kept = session.kept()
    if kept is None:
        return "changes are not saved, and could not be kept in the folder of the file"
    is_own = kept == kept_in(session.path)
    remedy = "the same command restores them" if is_own else "another studio has the file"
    return f"changes are not saved, and are in {kept.name}: {remedy}"


def run(options: Namespace) -> int:
    """Serve the page until the command is interrupted."""
    if STUDIO.is_missing:
        raise UsageError(STUDIO.told)
    if len(options.variant) > 1:
        raise UsageError("the studio shows one variant at a time; name one")
    from .serving import serve
    from .session import Session

    path = named_file(options.files or Path())
    template = files("ballplate.cli").joinpath("template.yaml").read_text(encoding="utf-8")
    session = Session(path, options.variant[0] if options.variant else None, template)
    if not path.exists():
        note(options, f"{path} is new: the page asks for the machine, or opens another file")

    def tell(address: str) -> None:
        print(address, flush=True)
        note(options, "the studio runs until Ctrl-C")
        if not options.no_browser:
            from webbrowser import open_new_tab

            open_new_tab(address)

    options.interruption.kept = lambda: unsaved(session)
    try:
        serve(session, options.port, tell, options.interruption.answer)
    except OSError as error:
        reason = error.strerror or str(error)
        raise UsageError(f"port {options.port} cannot be had: {reason}; name another") from None
    return 0
