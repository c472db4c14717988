"""Text for terminals and pipes of any encoding, such as the code pages of Windows, which lack many
characters.
"""

from __future__ import annotations

import codecs
import sys
from argparse import Namespace
from typing import Any

from .interruption import named_paths

# Errors of encoding are answered under this name.
HANDLER = "ballplate.readable"

# What a character is told by where it cannot be written. A unit must stay the unit that it is.
SUBSTITUTES = {
    "µ": "u",
    "μ": "u",
    "°": "deg",
    "×": "x",
    "·": "*",
    "±": "+/-",
    "≤": "<=",
    "≥": ">=",
    "²": "^2",
    "³": "^3",
    "–": "-",
    "—": "-",
    "−": "-",
    "…": "...",
    "“": '"',
    "”": '"',
    "‘": "'",
    "’": "'",
    "→": "->",
    "←": "<-",
}

# Values of --format that other programs read; without one, report writes a page.
DATA_FORMATS = (None, "csv", "github", "html", "json", "junit", "latex", "markdown")


def readable(error: UnicodeError) -> tuple[str, int]:
    r"""Replace characters that an encoding lacks by plain ones, or by their numbers.

    >>> "0.5 µm ± 2 µm, Prüfkörper".encode("ascii", HANDLER)
    b'0.5 um +/- 2 um, Pr\\xfcfk\\xf6rper'
    """
    if not isinstance(error, UnicodeEncodeError):
        raise error
    text = ""
    for byte in error.object[error.start : error.end]:
        text += SUBSTITUTES.get(byte) or byte.encode("ascii", "backslashreplace").decode("ascii")
    return text, error.end


codecs.register_error(HANDLER, readable)


def write_readably(*streams: Any) -> None:
    """Let streams write what their encoding lacks in other characters, rather than fail or print
    question marks.
    """
    for stream in streams:
        if getattr(stream, "errors", None) in (
            "strict",
            "replace",
            "backslashreplace",
            "surrogateescape",
        ):
            stream.reconfigure(errors=HANDLER)


def write_data_in_utf8(options: Namespace) -> None:
    """Let standard output be UTF-8 where a program is to read it: JSON, CSV, pages and reports, but
    on no terminal.
    """
    stream: Any = sys.stdout
    is_data = (
        getattr(options, "json", False)
        or getattr(options, "prints_data", False)
        or getattr(options, "diff", False)
        or getattr(options, "format", "text") in DATA_FORMATS
        or any(str(path) == "-" for _, path in named_paths(options))
    )
    if is_data and hasattr(stream, "reconfigure") and not stream.isatty():
        stream.reconfigure(encoding="utf-8", errors=HANDLER, newline="\n")
