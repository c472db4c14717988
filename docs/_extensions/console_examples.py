"""Examples that run when the pages are built, so that what the pages show is what the program says.

Each page has a folder of its own with a copy of the designs, in which its examples follow one
another:

`{console}`      lines that begin with `$ ` are commands, and their output follows them. `:status:`
                 is the exit status of the last one, any other ends the build. Of its output
                 `:only:` shows lines with a pattern, `:from:` what follows the first such line,
                 `:shown:` so many lines; dots stand for the others, and no alarm is left out.
`{file} NAME`    writes a file and shows it. `{edit} NAME`    changes a file, as a difference: lines
with `-` go, lines with `+` come, others stay. `{python-run}`   runs a program and shows what it
prints. `:continued:` goes on where the page's last program has ended,
                 with its names, as the cells of a notebook do. `{picture} NAME` shows an SVG or PNG
file that an example has written, or a page of HTML in a frame, with `:alt:` for those who do not
                 see it and its text below.
"""

from __future__ import annotations

import base64
import contextlib
import errno
import gc
import html
import importlib
import io
import os
import pickle
import pty
import re
import shlex
import shutil
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterable
from pathlib import Path
from types import ModuleType
from typing import Any

# One thread, so that the last digits are the same in every build; NumPy asks for it when it is
# loaded.
os.environ.update(
    dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
)

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.directives.code import container_wrapper
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxDirective

TOP = Path(__file__).resolve().parents[2]
PICTURES = {".svg": "image/svg+xml", ".png": "image/png", ".html": "text/html"}
# Where a program leaves its names for the next one, in the page's folder.
NAMES = ".names"
LANGUAGES = {".yaml": "yaml", ".yml": "yaml", ".py": "python"}
TERMINAL = {
    "COLUMNS": "100",
    "LC_ALL": "C.UTF-8",
    "NO_COLOR": "1",
    "PYTHONPATH": str(TOP),
    "TERM": "dumb",
}
# What the commands load when they are run; loaded before, it takes no time for each of them.
LOADED_BEFORE = (
    "ballplate.extensions.ci.github",
    "ballplate.cli",
    "ballplate.extensions.ci.junit",
    "ballplate.montecarlo.experiments",
    "ballplate.montecarlo.comparison_tables",
    "matplotlib.figure",
    "ballplate.simulator.readings.simulated",
    "ballplate.simulator.readings.reading_files",
    "scipy.interpolate",
    "scipy.linalg",
    "scipy.spatial",
    "scipy.special",
)


# Lines that no example leaves out, and how a line begins that goes on with the one before.
ALARM = re.compile(
    r"^(\S+: )?(warning|reason|note|rank deficiency|weakly determined|Too optimistic)\b"
    r"|^contradicted\b|^<-|cannot follow|did not converge|\bNOT?\b"
)
CONTINUED = re.compile(r"^  (?! )")


def with_gaps(lines: list[str], chosen: Iterable[int]) -> list[str]:
    """Lines of the numbers chosen and all alarms, each to its end, with dots in the place of
    others.
    """
    shown: list[str] = []
    kept = {*chosen, *(i for i, line in enumerate(lines) if ALARM.search(line))}
    for i, line in enumerate(lines):
        if i in kept or (i - 1 in kept and CONTINUED.search(line)):
            kept.add(i)
            shown.append(line)
        elif shown[-1:] != ["…"]:
            shown.append("…")
    return shown


class _Example(SphinxDirective):
    has_content = True

    @property
    def folder(self) -> Path:
        """The page's own folder; it is new whenever the page is read anew."""
        found: Any = self.env.temp_data.get("example_folder")
        if found is None:
            found = tempfile.TemporaryDirectory(prefix="ballplate-docs-")
            # Without their modes: a checkout may be one that cannot be written.
            designs = Path(found.name, "designs")
            shutil.copytree(TOP / "designs", designs, copy_function=shutil.copyfile)
            for path in (designs, *designs.rglob("*")):
                if path.is_dir():
                    path.chmod(0o755)
            self.env.temp_data["example_folder"] = found
        return Path(found.name)

    def refuse(self, text: str) -> ExtensionError:
        source, line = self.get_source_info()
        return ExtensionError(f"{source}:{line}: {text}")

    def execute(self, what: str, action: Callable[[], int], expected: int = 0) -> list[str]:
        """What a terminal shows of a command, line by line."""
        status, lines = _lines_on_terminal(action, self.folder)
        if status != expected:
            text = "\n".join(lines)
            raise self.refuse(f"{what}\nexit status {status} instead of {expected}:\n{text}")
        return lines


class Console(_Example):
    option_spec = {
        "status": directives.nonnegative_int,
        "only": directives.unchanged,
        "from": directives.unchanged,
        "shown": directives.nonnegative_int,
    }

    def run(self) -> list[nodes.Node]:
        *before, last = "\n".join(self.content).removeprefix("$ ").split("\n$ ")
        shown = []
        for command in before:
            shown += [f"$ {command}", *self.execute(command, _command(command))]
        lines = self.execute(last, _command(last), self.options.get("status", 0))
        shown += [f"$ {last}", *self.selected(lines)]
        return [nodes.literal_block("", "\n".join(shown), language="console")]

    def selected(self, lines: list[str]) -> list[str]:
        """The lines that the options ask for, and all alarms, with dots where others are left
        out.
        """
        kept = list(range(len(lines)))
        for option in ("from", "only"):
            pattern = self.options.get(option)
            if pattern is None:
                continue
            places = [i for i in kept if re.search(pattern, lines[i])]
            if not places:
                raise self.refuse(f'no line has "{pattern}":\n' + "\n".join(lines))
            kept = kept[places[0] :] if option == "from" else places
        return with_gaps(lines, kept[: self.options.get("shown")])


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
            raise self.refuse(
                f"{path.name} has these lines {text.count(old)} times instead of once:\n{old}"
            )
        path.write_text(text.replace(old, new), encoding="utf-8")
        block = nodes.literal_block("", "\n".join(self.content), language="diff")
        return [container_wrapper(self, block, path.name)]


class PythonRun(_Example):
    option_spec = {"continued": directives.flag}

    def run(self) -> list[nodes.Node]:
        source = "\n".join(self.content)
        names = self.folder / NAMES
        if "continued" not in self.options:
            names.unlink(missing_ok=True)
        lines = self.execute(source, lambda: _program(source, names))
        blocks: list[nodes.Node] = [nodes.literal_block("", source, language="python")]
        return blocks + (
            [nodes.literal_block("", "\n".join(lines), language="text")] if lines else []
        )


class Picture(_Example):
    required_arguments = 1
    option_spec = {"alt": directives.unchanged_required}

    def run(self) -> list[nodes.Node]:
        path = self.folder / self.arguments[0]
        if "alt" not in self.options or path.suffix not in PICTURES or not path.is_file():
            raise self.refuse(
                f"{self.arguments[0]} is no SVG, PNG or HTML file that an example has written, or"
                " has no :alt:"
            )
        # As an address the picture keeps its ids to itself, and needs no file that outlives the
        # page's folder.
        alt = html.escape(self.options["alt"], quote=True)
        if path.suffix == ".html":
            page = html.escape(path.read_text(encoding="utf-8"), quote=True)
            shown = f'<iframe class="page" srcdoc="{page}" title="{alt}"></iframe>'
        else:
            data = base64.b64encode(path.read_bytes()).decode("ascii")
            shown = f'<img src="data:{PICTURES[path.suffix]};base64,{data}" alt="{alt}">'
        figure = nodes.figure()
        figure += nodes.raw("", shown, format="html")
        if self.content:
            caption = nodes.caption()
            parsed, messages = self.parse_inline("\n".join(self.content))
            caption += parsed
            figure += [caption, *messages]
        return [figure]


def _command(command: str) -> Callable[[], int]:
    """What runs a line of the shell, the program itself without one where that does as well."""
    if not command.startswith("ballplate ") or set(command) & set("|&;<>()*?$`\\~#"):
        return lambda: os.execvp("bash", ["bash", "-o", "pipefail", "-c", command])

    def run() -> int:
        from ballplate.cli import main

        return main(shlex.split(command)[1:])

    return run


class _Pickler(pickle.Pickler):
    def reducer_override(self, value: Any) -> Any:
        """Modules are imported again."""
        return (
            (importlib.import_module, (value.__name__,))
            if isinstance(value, ModuleType)
            else NotImplemented
        )


def _program(source: str, path: Path) -> int:
    """Run a program with the names that the last one has left in a file, and leave its own, but for
    what stays open.
    """
    kept: dict[str, bytes] = pickle.loads(path.read_bytes()) if path.exists() else {}
    names: dict[str, Any] = {"__name__": "__main__"} | {
        name: pickle.loads(value) for name, value in kept.items()
    }
    exec(source, names)
    for name in [name for name in names if not name.startswith("__")]:
        found = io.BytesIO()
        with contextlib.suppress(pickle.PicklingError, AttributeError, TypeError):
            _Pickler(found).dump(names[name])
            kept[name] = found.getvalue()
    path.write_bytes(pickle.dumps(kept))
    return 0


def terminal_lines(command: str, folder: Path) -> tuple[int, list[str]]:
    """Exit status of a line of the shell, and what a terminal shows of it."""
    return _lines_on_terminal(_command(command), folder)


def _lines_on_terminal(action: Callable[[], int], folder: Path) -> tuple[int, list[str]]:
    status, text = _on_terminal(action, folder)
    text = text.replace("\r\n", "\n").replace(f"{folder}/", "")
    # What a progress bar has drawn is cleared again.
    lines = [line.rpartition("\r")[2].rstrip() for line in text.rstrip("\n").split("\n")]
    return status, lines if text else []


def _on_terminal(action: Callable[[], int], folder: Path) -> tuple[int, str]:
    """Exit status of an action in a process of its own, and what it writes to its terminal."""
    tools = _tools()
    process, terminal = pty.fork()
    if process == 0:
        status = 1
        # What the pages are made of is not searched for garbage once more in each process.
        gc.freeze()
        try:
            os.chdir(folder)
            os.environ.update(TERMINAL, PATH=f"{tools}:{os.environ['PATH']}")
            os.environ.pop("GITHUB_WORKSPACE", None)
            sys.stdout, sys.stderr = (
                os.fdopen(i, "w", buffering=1, encoding="utf-8") for i in (1, 2)
            )
            sys.path.insert(0, str(TOP))
            status = action()
            sys.stdout.flush()
        except SystemExit as end:
            status = end.code if isinstance(end.code, int) else 1
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(status)
    pieces = []
    while True:
        try:
            piece = os.read(terminal, 65536)
        except OSError as error:
            # This is how Linux tells that the other end is closed.
            if error.errno != errno.EIO:
                raise
            piece = b""
        if not piece:
            break
        pieces.append(piece)
    # Not before: an action whose terminal is closed as it ends is told to hang up.
    _, status = os.waitpid(process, 0)
    os.close(terminal)
    return os.waitstatus_to_exitcode(status), b"".join(pieces).decode("utf-8", "replace")


_TOOLS: list[tempfile.TemporaryDirectory[str]] = []


def _tools() -> str:
    """A folder with the command `ballplate` of this source tree, for the shell."""
    if not _TOOLS:
        _TOOLS.append(tempfile.TemporaryDirectory(prefix="ballplate-docs-"))
        program = Path(_TOOLS[0].name, "ballplate")
        code = "import sys; from ballplate.cli import main; sys.exit(main())"
        program.write_text(
            f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -c {shlex.quote(code)} "$@"\n', "utf-8"
        )
        program.chmod(0o755)
    return _TOOLS[0].name


def _leave_folder(app: Sphinx, page: nodes.document) -> None:
    folder: Any = app.env.temp_data.pop("example_folder", None)
    if folder is not None:
        folder.cleanup()


def setup(app: Sphinx) -> dict[str, bool]:
    for module in LOADED_BEFORE:
        importlib.import_module(module)
    app.connect("doctree-read", _leave_folder)
    app.add_directive("console", Console)
    app.add_directive("file", File)
    app.add_directive("edit", Edit)
    app.add_directive("picture", Picture)
    app.add_directive("python-run", PythonRun)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
