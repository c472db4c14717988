"""What lines print and write, kept as text: that of a line in full, of each option what it adds and
what it takes away.

`python -m tests.cli.outcomes` writes the files of the folder `outcomes` anew, with what a new line
`$ ...` in one of them shows; look at what changed before it is committed.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

FOLDER = Path(__file__).parent / "outcomes"
NUMBER = re.compile(r"(?<![#0-9a-f.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
# Lines with what is nothing but rounding.
NOTHING = re.compile(r"\de-(09|[1-9]\d)\b")
# Parts that are longer, as pages and drawings, are kept by what their numbers and words come to.
LONGEST = 6_000
# Today, and what a last digit changes altogether, as how many steps were computed.
CHANGING = (
    r'\{\s*"step": [^}]*\},?|"seconds": \d+\.\d{7,}|'
    r"\d{4}-\d\d-\d\d \d\d:\d\d UTC|(?<![.\w])[0-9a-f]{12,}\b|"
    r"openblas [^<]*|about [0-9.]+ (s|min)"
)


def shortened(outcome: str, folder: Path) -> list[str]:
    """Lines of an outcome without what changes from day to day."""
    text = re.sub(CHANGING, "CHANGING", outcome.replace(str(folder), "FOLDER"))
    lines = list[str]()
    for part in re.split(r"^(?=--file )", text, flags=re.MULTILINE):
        head, _, rest = part.partition("\n")
        if len(part) <= LONGEST:
            lines += part.splitlines()
        elif head.endswith((".sqlite", ".parquet")):
            lines.append(head)
        else:
            lines += [head, _digest(rest)]
    return [" ".join(line.split()) for line in lines if not NOTHING.search(line)]


def drawn(figure: Any) -> str:
    """What a figure of Matplotlib has, whatever its release makes of it: places, words, numbers."""

    def told(values: Any) -> str:
        values = np.asarray(values, float)[np.isfinite(values).all(axis=1)]
        sums = [f(values, axis=0).round(3).tolist() for f in (np.mean, np.std) if len(values)]
        return f"{len(values)}: {sums}"

    size = figure.get_size_inches().round(2).tolist()
    lines = [f"<title>{figure.get_label()}: {size}"]
    for axes in figure.axes:
        ends = np.round([axes.get_xlim(), axes.get_ylim(), *axes.get_position().get_points()], 3)
        lines.append(f"axes {axes.get_xlabel()}, {axes.get_ylabel()}: {ends.ravel().tolist()}")
        for line in axes.lines:
            form = (line.get_label(), line.get_color(), line.get_marker(), line.get_linestyle())
            form += (line.get_markersize(), line.get_linewidth())
            lines.append(f"line {form} {told(line.get_xydata())}")
        paths = [patch.get_path() for patch in axes.patches]
        paths += [path for some in axes.collections for path in some.get_paths()]
        lines += [f"path {told(path.vertices)}" for path in paths]
        for text in axes.texts:
            place = np.round([*getattr(text, "xyann", ()), *text.get_position()], 2).tolist()
            lines.append(f"text {text.get_text()} {place} {text.get_ha()} {text.get_va()}")
    for text in figure.texts:
        lines.append(f"text {text.get_text()} {np.round(text.get_position(), 3).tolist()}")
    for legend in (*figure.legends, *(axes.get_legend() for axes in figure.axes)):
        if legend is not None:
            lines.append(f"legend {legend._ncols} {[one.get_text() for one in legend.get_texts()]}")
    return "\n".join(lines)


def _digest(text: str) -> str:
    """What the words and all numbers of a page, a table, a drawing or data come to; the sum of
    logarithms notices a change of each. Less than 1e-10 may be nothing but rounding.
    """
    numbers = np.abs([float(one) for one in NUMBER.findall(text)])
    sizes = np.log10(1e10 * numbers[numbers > 1e-10])
    words = " ".join(NUMBER.sub("#", text).split())
    return f"... words {crc32(words.encode()) % 10**8:08d}, numbers {sizes.sum():.2f}"


def changes(without: Sequence[str], with_it: Sequence[str]) -> list[str]:
    """What an option adds to an outcome, and what it takes away."""
    added = [f"+ {line}" for line in with_it if line not in without]
    return added + [f"- {line}" for line in without if line not in with_it]


def are_alike(one: str, other: str) -> bool:
    """Whether two lines say the same; processors round numbers differently.

    >>> are_alike("U6 0.2591 µm of 4", "U6 0.2592 µm of 4"), are_alike("U6 0.26 of 4", "U6 0.26 of 5")
    (True, False)
    """
    if NUMBER.sub("#", one) != NUMBER.sub("#", other):
        return False
    if "... words " in one and not one.endswith("inf"):
        # Symmetric drawings have co-ordinates half-way between two tenths, and dozens of these are
        # rounded either way: each changes the logarithm by some thousandths.
        (words, total), (other_words, other_total) = (NUMBER.findall(each) for each in (one, other))
        return bool(words == other_words and abs(float(total) - float(other_total)) <= 0.05)
    return all(map(_is_near, NUMBER.findall(one), NUMBER.findall(other)))


def _is_near(one: str, other: str) -> bool:
    mantissa, _, exponent = one.partition("e")
    decimals = mantissa.partition(".")[2]
    a, b = float(one), float(other)
    if not decimals:
        return a == b
    if len(decimals) > 8:
        # A number in full; what is less than 1e-15 is zero, rounded.
        return abs(a - b) <= max(1e-6 * abs(a), 1e-15)
    return abs(a - b) <= 1.01 * 10.0 ** (int(exponent or 0) - len(decimals))


@cache
def kept() -> dict[str, list[str]]:
    """Kept lines, by the command line and the option."""
    found: dict[str, list[str]] = {}
    for path in sorted(FOLDER.glob("*.txt")):
        for block in path.read_text("utf-8").split("\n$ ")[1:]:
            name, *lines = block.rstrip("\n").split("\n")
            found[name] = lines
    return found


def keep(outcomes: Mapping[str, Sequence[str]]) -> None:
    """Write what is kept, a file for each command; what is alike stays as it is."""
    before = kept()
    texts: dict[str, str] = {}
    for name, lines in outcomes.items():
        was = before.get(name, [])
        if len(was) == len(lines) and all(map(are_alike, lines, was)):
            lines = was
        first = name.split("'")[1] if name[0] == "'" else name.split()[0].rstrip(":")
        command = re.sub(r"\W+", "-", first)
        text = texts.setdefault(command, "Written by `python -m tests.cli.outcomes`.\n")
        texts[command] = text + "\n".join([f"\n$ {name}", *lines, ""])
    for path in FOLDER.glob("*.txt"):
        path.unlink()
    for command, text in texts.items():
        (FOLDER / f"{command}.txt").write_text(text, "utf-8")


if __name__ == "__main__":
    from tempfile import TemporaryDirectory

    from tests.cli.shown import filled
    from tests.cli.test_options import every_outcome

    with TemporaryDirectory() as place:
        keep(every_outcome(filled(Path(place) / "kit")))
