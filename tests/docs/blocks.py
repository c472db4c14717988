"""Output of commands that stands in the pages as text, because making it takes too long for every
build of the pages, or no build makes them: found, made anew and compared.

`python -m tests.docs.blocks [PAGE...]` writes these blocks, and the pictures that belong to them,
anew, those of all pages if none are named.
"""

from __future__ import annotations

import importlib
import re
import shlex
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tests.reference.copies import copy_file, copy_tree

TOP = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(TOP / "docs" / "_extensions"))
examples = importlib.import_module("console_examples")

PAGES = (
    Path("README.md"),
    Path("CONTRIBUTING.md"),
    *sorted(path.relative_to(TOP) for path in (TOP / "docs").rglob("*.md")),
)
FENCE = re.compile(r"^( *)(`{3,}|~{3,})(.*)\n((?:.*\n)*?)\1\2 *$", re.MULTILINE)
NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[-+]\d+)?")

# What a person types or writes, which no program prints, and what the pages' build makes.
INPUT = ("python", "sh", "yaml", "toml")
MADE = re.compile(
    r"\{(console|edit|eval-rst|figure|file|literalinclude|picture|python-run|study|toctree)\}"
)

# The last digit of figures may differ between processors, and bounds of plans are computed to 0.1 %.
NEAR = 1e-3


@dataclass(frozen=True)
class Block:
    """A command on a page and the lines of its output that the page shows."""

    page: Path
    command: str
    shown: tuple[str, ...]

    @property
    def pictures(self) -> tuple[Path, ...]:
        """Pictures beside the page that the command writes."""
        words = (Path(word) for word in shlex.split(self.command))
        names = (self.page.parent / word for word in words if word.suffix == ".svg")
        return tuple(name for name in names if (TOP / name).is_file())


def fences(page: Path) -> Iterator[tuple[str, str]]:
    """What the fences of a page say of their blocks, and the blocks."""
    for match in FENCE.finditer((TOP / page).read_text(encoding="utf-8")):
        yield match[3].strip(), match[4]


def is_compared(kind: str, text: str) -> bool:
    """Whether a block is one of those that are compared."""
    return kind == "console" and re.match(r"\$ (\.venv/bin/)?ballplate ", text) is not None


def blocks(page: Path) -> list[Block]:
    """The blocks of a page that are compared."""
    found = []
    for kind, text in fences(page):
        if is_compared(kind, text):
            command, *shown = text.splitlines()
            found.append(Block(page, command.partition("ballplate ")[2], tuple(shown)))
    return found


def parts(line: str) -> tuple[list[str], list[float]]:
    """What a line says besides its numbers, and these."""
    return NUMBER.sub("#", line).split(), [float(value) for value in NUMBER.findall(line)]


def made(block: Block, folder: Path) -> list[str]:
    """The output of a block's command, run in a folder, with the lines that the block shows and
    all alarms; dots stand for the others.

    :raises ValueError: the command fails, or prints no line of the kind of one that is shown.
    """
    copy_tree(TOP / "designs", folder / "designs", dirs_exist_ok=True)
    status, lines = examples.terminal_lines(f"ballplate {block.command}", folder)
    if status:
        raise ValueError(f"{block.page}: {block.command} has exit status {status}: {lines}")
    kept, at = [], 0
    for line in block.shown:
        if line == "…":
            continue
        kind = parts(line)[0]
        place = next((i for i in range(at, len(lines)) if parts(lines[i])[0] == kind), None)
        if place is None:
            raise ValueError(f"{block.page}: {block.command} prints no line like: {line}")
        kept.append(place)
        at = place + 1
    shown: list[str] = examples.with_gaps(lines, kept)
    return shown


def rewrite(page: Path) -> None:
    """Write the blocks of a page anew, and their pictures beside it."""
    text = (TOP / page).read_text(encoding="utf-8")
    for block in blocks(page):
        with tempfile.TemporaryDirectory() as folder:
            lines = made(block, Path(folder))
            for picture in block.pictures:
                copy_file(Path(folder, picture.name), TOP / picture)
        old = f"ballplate {block.command}\n" + "".join(f"{line}\n" for line in block.shown)
        new = f"ballplate {block.command}\n" + "".join(f"{line}\n" for line in lines)
        assert text.count(old) == 1, f"{page}: {block.command} stands there more than once"
        text = text.replace(old, new)
    (TOP / page).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    for name in sys.argv[1:] or PAGES:
        if blocks(Path(name)):
            print(name, flush=True)
            rewrite(Path(name))
