"""Files that a result is asked to write."""

from __future__ import annotations

import errno
from pathlib import Path

from ballplate.simulator.inputs.arguments import ensure_path


def write_file(path: str | Path, content: bytes) -> None:
    """Write a file as a whole.

    :raises OSError: it cannot be written; where its folder is missing the text says so.

    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     write_file(f"{folder}/page.html", b"<p>")
    ...     Path(folder, "page.html").read_bytes()
    b'<p>'
    """
    ensure_path("path", path)
    path = Path(path)
    try:
        path.write_bytes(content)
    except FileNotFoundError:
        text = f"there is no folder {path.parent}; make it, or name another"
        raise FileNotFoundError(errno.ENOENT, text, str(path)) from None
