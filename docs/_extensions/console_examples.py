"""Examples that run when the pages are built, so that what the pages show is what the program says.

Each page has a folder of its own with a copy of the designs, in which its examples follow one another:

`{console}`      lines that begin with `$ ` are commands; the output follows each of them. `:status:` is the exit status
                 of the last one, any other stops the build; `:shown:` cuts its output after so many lines.
`{file} NAME`    writes a file and shows it.
`{edit} NAME`    changes a file, as a difference: lines with `-` go, lines with `+` come, others stay.
`{python-run}`   runs a program and shows what it prints.
"""

from __future__ import annotations

import errno
import os
import pty
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.directives.code import container_wrapper
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxDirective

TOP = Path(__file__).resolve().parents[2]
COLUMNS = 100
LANGUAGES = {".yaml": "yaml", ".py": "python"}


class _Example(SphinxDirective):
    has_content = True

    @property
    def folder(self) -> Path:
        """The page's own folder; it is new whenever the page is read anew."""
        found: Any = self.env.temp_data.get("example_folder")
        if found is None:
            found = tempfile.TemporaryDirectory(prefix="ballplate-docs-")
            shutil.copytree(TOP / "designs", Path(found.name, "designs"))
            self.env.temp_data["example_folder"] = found
        return Path(found.name)

    def refuse(self, text: str) -> ExtensionError:
        source, line = self.get_source_info()
        return ExtensionError(f"{source}:{line}: {text}")

    def execute(self, arguments: list[str], expected: int) -> list[str]:
        """What a terminal shows of a command, line by line."""
        status, text = _on_terminal(arguments, self.folder)
        if status != expected:
            raise self.refuse(f"{arguments[-1]}\nexit status {status} instead of {expected}:\n{text}")
        text = text.replace("\r\n", "\n").replace(f"{self.folder}/", "")
        # What a progress bar has drawn is cleared again.
        return [line.rpartition("\r\x1b[K")[2].rstrip() for line in text.rstrip("\n").split("\n")] if text else []


class Console(_Example):
    option_spec = {"status": directives.nonnegative_int, "shown": directives.nonnegative_int}  # noqa: RUF012

    def run(self) -> list[nodes.Node]:
        commands = "\n".join(self.content).removeprefix("$ ").split("\n$ ")
        shown = []
        for i, command in enumerate(commands):
            is_last = i == len(commands) - 1
            lines = self.execute(["bash", "-o", "pipefail", "-c", command], self.options.get("status", 0) if is_last else 0)
            limit = self.options.get("shown", len(lines)) if is_last else len(lines)
            shown += [f"$ {command}", *lines[:limit], *(["…"] if limit < len(lines) else [])]
        return [nodes.literal_block("", "\n".join(shown), language="console")]


class File(_Example):
    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        name, text = self.arguments[0], "\n".join(self.content) + "\n"
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        block = nodes.literal_block("", text, language=LANGUAGES.get(path.suffix, "text"))
        return [container_wrapper(self, block, name)]


class Edit(_Example):
    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        path = self.folder / self.arguments[0]
        text = path.read_text(encoding="utf-8")
        old = "".join(f"{line[1:]}\n" for line in self.content if line[:1] in "- ")
        new = "".join(f"{line[1:]}\n" for line in self.content if line[:1] in "+ ")
        if text.count(old) != 1:
            raise self.refuse(f"{path.name} has these lines {text.count(old)} times instead of once:\n{old}")
        path.write_text(text.replace(old, new), encoding="utf-8")
        block = nodes.literal_block("", "\n".join(self.content), language="diff")
        return [container_wrapper(self, block, path.name)]


class PythonRun(_Example):
    def run(self) -> list[nodes.Node]:
        source = "\n".join(self.content)
        lines = self.execute([sys.executable, "-c", source], 0)
        blocks: list[nodes.Node] = [nodes.literal_block("", source, language="python")]
        return blocks + ([nodes.literal_block("", "\n".join(lines), language="text")] if lines else [])


def _on_terminal(arguments: list[str], folder: Path) -> tuple[int, str]:
    """Exit status of a command and what it writes to a terminal, standard error included."""
    ours, theirs = pty.openpty()
    # One thread, so that the last digits are the same in every build.
    environment = {
        **{key: value for key, value in os.environ.items() if not key.startswith(("GITHUB_", "SPHINX", "PYTHON"))},
        **dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1"),
        "COLUMNS": str(COLUMNS),
        "LC_ALL": "C.UTF-8",
        "NO_COLOR": "1",
        "PATH": f"{_tools()}:{os.environ['PATH']}",
        "PYTHONPATH": str(TOP),
        "TERM": "dumb",
    }
    process = subprocess.Popen(
        arguments, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=theirs, stderr=theirs
    )
    os.close(theirs)
    pieces = []
    while True:
        try:
            piece = os.read(ours, 65536)
        except OSError as error:
            # This is how Linux tells that the other end is closed.
            if error.errno != errno.EIO:
                raise
            piece = b""
        if not piece:
            break
        pieces.append(piece)
    os.close(ours)
    return process.wait(), b"".join(pieces).decode("utf-8", "replace")


_TOOLS: list[tempfile.TemporaryDirectory[str]] = []


def _tools() -> str:
    """A folder with the command `ballplate` of this source tree."""
    if not _TOOLS:
        _TOOLS.append(tempfile.TemporaryDirectory(prefix="ballplate-docs-"))
        program = Path(_TOOLS[0].name, "ballplate")
        code = "import sys; from analysis.cli import main; sys.exit(main())"
        program.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -c {shlex.quote(code)} "$@"\n', "utf-8")
        program.chmod(0o755)
    return _TOOLS[0].name


def _leave_folder(app: Sphinx, page: nodes.document) -> None:
    folder: Any = app.env.temp_data.pop("example_folder", None)
    if folder is not None:
        folder.cleanup()


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("doctree-read", _leave_folder)
    app.add_directive("console", Console)
    app.add_directive("file", File)
    app.add_directive("edit", Edit)
    app.add_directive("python-run", PythonRun)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
