"""Plain data written as YAML in styles drawn at random."""

from __future__ import annotations

from random import Random
from typing import Any

import yaml

COMMENTS = ["", "", "  # plain", "\t# tab\tin it", "  # ünïcode → µm", "  # a: {b}, [c] # d 'e"]
# PyYAML's own scanner, without libyaml, takes no tab before a comment.
LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
if LOADER is yaml.SafeLoader:
    COMMENTS.remove("\t# tab\tin it")


def plain(text: str) -> Any:
    return yaml.load(text, Loader=LOADER)


class Writer:
    """Writes plain data as YAML in a style of its own: pieces of text, some of them values at a
    path.
    """

    def __init__(self, random: Random, comments: bool = True) -> None:
        self.random, self.comments = random, comments
        self.pieces: list[tuple[str, tuple[Any, ...] | None]] = []

    def put(self, text: str, path: tuple[Any, ...] | None = None) -> None:
        self.pieces.append((text, path))

    def scalar(self, value: Any, path: tuple[Any, ...]) -> None:
        text = str(value)
        if isinstance(value, str):
            is_plain = self.random.random() < 0.6 and value.replace(" ", "").isalnum()
            is_plain = is_plain and plain(value) == value
            single = "'" + value.replace("'", "''") + "'"
            text = value if is_plain else self.random.choice([single, f'"{value}"'])
        self.put(text, path)

    def key(self, key: str) -> None:
        quoted = not key.replace(" ", "").isalnum() or self.random.random() < 0.2
        self.put(f'"{key}": ' if quoted else f"{key}: ")

    def end(self) -> None:
        self.put(self.random.choice(COMMENTS) if self.comments else "")
        self.put("\n")
        while self.comments and self.random.random() < 0.2:
            self.put(self.random.choice(["\n", "# alone\n", "      # far {in\n", "   \n"]))

    def flow(self, value: Any, path: tuple[Any, ...]) -> None:
        if not isinstance(value, dict | list):
            self.scalar(value, path)
            return
        is_list = isinstance(value, list)
        self.put("[" if is_list else "{")
        items = list(enumerate(value)) if is_list else list(value.items())
        for k, (key, item) in enumerate(items):
            self.put(", " if k else self.random.choice(["", " "]))
            if not is_list:
                self.key(str(key))
            self.flow(item, (*path, key))
        self.put(self.random.choice(["", " "]))
        self.put("]" if is_list else "}")

    def block(self, value: Any, indent: int, path: tuple[Any, ...], is_begun: bool = False) -> None:
        """The lines of a list or mapping that has entries, the first one's indent already there."""
        is_list = isinstance(value, list)
        items = list(enumerate(value)) if is_list else list(value.items())
        for key, item in items:
            self.put("" if is_begun else " " * indent)
            is_begun = False
            if is_list:
                self.put("- ")
            else:
                self.key(str(key))
            if not isinstance(item, dict | list) or not item or self.random.random() < 0.4:
                self.flow(item, (*path, key))
                self.end()
            elif is_list:
                self.block(item, indent + 2, (*path, key), True)
            else:
                self.end()
                self.block(item, indent + self.random.choice([2, 3]), (*path, key))


def lines_ended(text: str, line_end: str, has_last: bool) -> str:
    return (text if has_last else text.rstrip("\n")).replace("\n", line_end)
