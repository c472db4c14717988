"""A YAML file as a tree of nodes with line and column.

PyYAML's events are used, because its constructors follow YAML 1.1 (where ``on`` is true and 1e-6 is
a text), drop duplicate keys and expand aliases without bound. Scalars follow the core schema of
YAML 1.2.
"""

from __future__ import annotations

import re
import stat
from collections import abc
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from .decoding import refuse_binary, refuse_long_lines
from .messages import MORE_ERRORS, MOST_MESSAGES, ExperimentError, Message, Step, Steps, refused
from .settings import listing, shorten

# Far beyond any experiment. Functions that walk a tree call themselves at each level.
DEEPEST = 50
MOST_NODES = 500_000
# Room for a table of a million rows.
MOST_BYTES = 200_000_000

# Characters that YAML 1.2 does not allow even in quotes.
NOT_PRINTABLE = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")

LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)

# Unquoted scalars that are neither texts nor numbers.
WORDS = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}

# Part of the YAML parser's message → fact and remedy for the author.
REMEDIES = (
    (
        "mapping values are not allowed",
        ("a second “: ” in one line; quote a text that contains it, and check the indentation"),
    ),
    ("unexpected end of stream", "a quotation mark is never closed; close it"),
    ("cannot start any token", "a text cannot begin with this character; quote it"),
    ("',' or ']'", "a list in brackets is never closed or lacks a comma; write [a, b]"),
    (
        "',' or '}'",
        (
            "a mapping in braces is never closed or lacks a comma; write {a: 1, b: 2}, quotes about"
            " a text with brackets"
        ),
    ),
    ("could not find expected ':'", "a key without “: ”; write key: value"),
    ("did not find expected key", "a key is expected here; check the indentation and the quotes"),
    (
        "'-' indicator",
        "a list entry is expected here; begin it with “- ” and check the indentation",
    ),
    (
        "<block end>",
        "this does not belong to the lines above; check the indentation and the quotes",
    ),
    ("version", "only YAML 1.2 is read; remove the %YAML line"),
    ("incompatible", "only YAML 1.2 is read; remove the %YAML line"),
)


@dataclass(frozen=True, slots=True)
class Mark:
    """A location in a file; line and column count from 1."""

    file: str
    line: int
    column: int

    def message(self, path: str, text: str) -> Message:
        """Return a message with this location."""
        return Message(self.file, self.line, self.column, path, text)

    def refused(self, text: str, path: str = "") -> ExperimentError:
        """Return the only error of a file, at this location."""
        return ExperimentError([self.message(path, text)])


@dataclass(frozen=True, eq=False)
class Scalar:
    """A single value: a text, a number, true, false or None."""

    mark: Mark
    value: str | int | float | bool | None


@dataclass(frozen=True, eq=False)
class Sequence:
    """A list."""

    mark: Mark
    items: tuple[Node, ...]


@dataclass(frozen=True, eq=False)
class Mapping:
    """A mapping; ``key_marks`` are the locations of its keys."""

    mark: Mark
    items: dict[str, Node]
    key_marks: dict[str, Mark]


Node = Scalar | Sequence | Mapping


def read_tree(path: Path, substituted: list[Message] | None = None) -> Node:
    """Read a YAML file; see ``parse_tree``.

    :raises ExperimentError: the file cannot be read, is not YAML, is empty, holds several
        documents, repeats a key or uses merge keys, tags or recursive aliases.
    """
    return parse_tree(read_text(path), str(path), substituted)


@dataclass(frozen=True)
class GivenText:
    """A text that is in no file, with the name that messages use for it."""

    name: str
    text: str

    def __str__(self) -> str:
        return self.name


def read_bytes(path: Path | GivenText) -> bytes:
    """Return the content of a file.

    :raises ExperimentError: the file is missing, is a directory, is too large or cannot be read.
    """
    if isinstance(path, GivenText):
        return path.text.encode("utf-8", errors="surrogatepass")
    file = str(path)
    try:
        kind = path.stat().st_mode
        if stat.S_ISDIR(kind):
            raise refused(file, "this is a folder; name a file in it")
        if stat.S_ISCHR(kind) or stat.S_ISBLK(kind) or stat.S_ISSOCK(kind):
            raise refused(file, "this is a device; name a file")
        # A pipe of the shell has a writer; another might be awaited for ever.
        if stat.S_ISFIFO(kind) and not file.startswith(("/dev/", "/proc/")):
            raise refused(file, "this is a pipe; name a file")
        with path.open("rb") as stream:
            content = stream.read(MOST_BYTES + 1)
    except FileNotFoundError:
        raise refused(file, "there is no such file; check the name and the folder") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise refused(file, f"cannot be read ({reason}); check its name and permissions") from None
    if len(content) > MOST_BYTES:
        raise refused(file, f"has more than {MOST_BYTES // 10**6} MB; leave some of it out")
    return content


def read_text(path: Path | GivenText) -> str:
    """Read a UTF-8 text file.

    :raises ExperimentError: the file is missing, is a directory, cannot be read or is not UTF-8.
    """
    if isinstance(path, GivenText):
        return path.text
    return utf8_text(read_bytes(path), str(path))


def utf8_text(content: bytes, file: str) -> str:
    """Return the text of a UTF-8 file's content; ``file`` is named in messages.

    :raises ExperimentError: it is not UTF-8, or has too long a line.
    """
    refuse_binary(content, file)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = content[: error.start].decode("utf-8", errors="replace")
        line, column = before.count("\n") + 1, len(before) - before.rfind("\n")
        text = (
            f"byte 0x{content[error.start]:02x} is not UTF-8; save the file with the encoding UTF-8"
        )
        raise ExperimentError([Message(file, line, column, "", text)]) from None
    refuse_long_lines(text, file)
    return text


def parse_tree(text: str, file: str, substituted: list[Message] | None = None) -> Node:
    """Read YAML text; ``file`` is named in messages.

    ``substituted``, if given, collects errors that leave a usable tree, such as a repeated key.

    :raises ExperimentError: as ``read_tree``.

    >>> to_python(parse_tree("a: [1e-6, on, 010]", "example"))
    {'a': (1e-06, 'on', 10)}
    """
    builder = _Builder(file)
    control = NOT_PRINTABLE.search(text)
    if control is not None:
        before = text[: control.start()]
        location = Mark(file, before.count("\n") + 1, len(before) - before.rfind("\n"))
        builder.stop(
            location, f"the control character U+{ord(control[0]):04X} is not allowed; remove it"
        )
    try:
        for event in yaml.parse(text, Loader=LOADER):
            builder.take(event)
    except yaml.MarkedYAMLError as error:
        # Since 6.0.4, PyYAML refuses a thousand brackets in a line before it yields the first.
        end = error.problem_mark
        if end is not None and "nesting depth" in str(error.problem):
            # What is left is deeper than `DEEPEST` already, and refused with the line.
            return parse_tree(text[: end.index], file)
        builder.messages.append(_syntax_message(error, text, file))
        builder.root = None
    if builder.messages and (substituted is None or builder.root is None):
        raise ExperimentError(sorted(builder.messages))
    if substituted is not None:
        substituted += builder.messages
    if builder.root is None:
        raise refused(
            file,
            "the file is empty; write at least title, machine, error_model, artefacts and"
            " positions",
        )
    return builder.root


def to_list(value: Any) -> Any:
    """Return plain data with lists for tuples."""
    if isinstance(value, abc.Mapping):
        return {key: to_list(item) for key, item in value.items()}
    return [to_list(item) for item in value] if isinstance(value, tuple | list) else value


def to_python(node: Node) -> Any:
    """Return the value of a node: dict, tuple, text, number, bool or None."""
    if isinstance(node, Scalar):
        return node.value
    if isinstance(node, Sequence):
        return tuple(to_python(item) for item in node.items)
    return {key: to_python(item) for key, item in node.items.items()}


def child(node: Node | None, step: Step) -> Node | None:
    """Return the node at a key or an index, or None."""
    if isinstance(node, Mapping) and isinstance(step, str):
        return node.items.get(step)
    if isinstance(node, Sequence) and isinstance(step, int) and 0 <= step < len(node.items):
        return node.items[step]
    return None


def written(root: Node, *steps: Step) -> Node | None:
    """Return the value at a path, or None."""
    node: Node | None = root
    for step in steps:
        node = child(node, step)
    return node


def mark_of(root: Node, steps: Steps, of_key: bool = False) -> Mark:
    """Return the location of a path, or of its nearest existing parent.

    A block below its key is located at the key, since the block's first line is only its first
    entry.
    """
    node, mark = root, root.mark
    for step in steps:
        below = child(node, step)
        if below is None:
            break
        key_mark = node.key_marks[str(step)] if isinstance(node, Mapping) else below.mark
        on_same_line = (key_mark.file, key_mark.line) == (below.mark.file, below.mark.line)
        mark = below.mark if on_same_line and not (of_key and step == steps[-1]) else key_mark
        node = below
    return mark


def walk(node: Node, steps: Steps = ()) -> Iterator[tuple[Steps, Node]]:
    """Yield every node with its path, parents first."""
    yield steps, node
    if isinstance(node, Mapping):
        for key, item in node.items.items():
            yield from walk(item, (*steps, key))
    elif isinstance(node, Sequence):
        for i, item in enumerate(node.items):
            yield from walk(item, (*steps, i))


def resolve_scalar(text: str) -> str | int | float | bool | None:
    """Return the value of an unquoted scalar in the core schema of YAML 1.2.

    :raises ValueError: a whole number of more than 300 digits.

    >>> texts = ("1e-6", "yes", "010", "0o10", "12:30", "~", "-.inf", "TRUE")
    >>> [resolve_scalar(text) for text in texts]
    [1e-06, 'yes', 10, 8, '12:30', None, -inf, True]
    """
    if text in WORDS:
        return WORDS[text]
    if text[0] not in "+-.0123456789":
        return text
    if len(text) > 300 and re.fullmatch(r"[-+]?[0-9]+|0[ox][0-9a-fA-F]+", text):
        raise ValueError("a number with more than 300 digits; write it with an exponent")
    if re.fullmatch(r"[-+]?[0-9]+", text):
        return int(text)
    if re.fullmatch(r"0o[0-7]+", text):
        return int(text[2:], 8)
    if re.fullmatch(r"0x[0-9a-fA-F]+", text):
        return int(text[2:], 16)
    if re.fullmatch(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?", text):
        return float(text)
    if re.fullmatch(r"[-+]?\.(inf|Inf|INF)", text):
        return float(text.replace(".", ""))
    return float("nan") if text in (".nan", ".NaN", ".NAN") else text


@dataclass(eq=False)
class _Open:
    """A list or a mapping that has not ended yet."""

    mark: Mark
    anchor: str | None
    items: list[Node]
    entries: dict[str, Node] | None = None
    key_marks: dict[str, Mark] | None = None
    key: str | None = None
    # A key that cannot be used; its value is read and dropped.
    key_is_refused: bool = False
    size: int = 1
    # Levels below it so far, those of aliases included.
    height: int = 0


class _Builder:
    """Builder of nodes from YAML events; collects refused ones."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.messages: list[Message] = []
        self.root: Node | None = None
        self.documents = 0
        self.stack: list[_Open] = []
        # With the number of values in it and of levels below it.
        self.anchors: dict[str, tuple[Node, int, int]] = {}

    def refuse(self, mark: Mark, text: str) -> None:
        if len(self.messages) >= MOST_MESSAGES:
            raise ExperimentError([*sorted(self.messages), mark.message("", MORE_ERRORS)])
        self.messages.append(mark.message("", text))

    def stop(self, mark: Mark, text: str) -> None:
        self.refuse(mark, text)
        raise ExperimentError(sorted(self.messages))

    def take(self, event: Any) -> None:
        mark = Mark(self.file, event.start_mark.line + 1, event.start_mark.column + 1)
        if isinstance(event, yaml.DocumentStartEvent):
            self.documents += 1
            if self.documents > 1:
                self.stop(
                    mark,
                    "a second document begins here; write one experiment per file, or use variants",
                )
        elif isinstance(event, yaml.ScalarEvent):
            self._tagged(event, mark)
            self._scalar(event, mark)
        elif isinstance(event, yaml.AliasEvent):
            self._alias(str(event.anchor), mark)
        elif isinstance(event, yaml.SequenceStartEvent | yaml.MappingStartEvent):
            self._tagged(event, mark)
            self._open(event, mark)
        elif isinstance(event, yaml.SequenceEndEvent | yaml.MappingEndEvent):
            opened = self.stack.pop()
            node = (
                Sequence(opened.mark, tuple(opened.items))
                if opened.entries is None
                else Mapping(opened.mark, opened.entries, opened.key_marks or {})
            )
            self._add(node, opened.anchor, opened.size, opened.height)

    def _tagged(self, event: Any, mark: Mark) -> None:
        if event.tag not in (None, "!", "tag:yaml.org,2002:str"):
            name = event.tag.replace("tag:yaml.org,2002:", "!!")
            self.refuse(mark, f"the tag {shorten(name)} has no meaning here; remove it")

    def _open(self, event: Any, mark: Mark) -> None:
        if len(self.stack) >= DEEPEST:
            self.stop(mark, f"nested more than {DEEPEST} deep; check the brackets")
        opened = _Open(mark, event.anchor, [])
        if isinstance(event, yaml.MappingStartEvent):
            opened.entries, opened.key_marks = {}, {}
        # While it is open, an alias to it would be recursive.
        if event.anchor:
            self.anchors.pop(event.anchor, None)
        self.stack.append(opened)

    def _scalar(self, event: Any, mark: Mark) -> None:
        parent = self.stack[-1] if self.stack else None
        is_plain = event.implicit[0] and event.tag is None
        if (
            parent
            and parent.entries is not None
            and parent.key is None
            and not parent.key_is_refused
        ):
            self._key(parent, event.value, is_plain, mark)
            return
        value: str | int | float | bool | None = event.value
        if is_plain:
            try:
                value = resolve_scalar(event.value)
            except ValueError as error:
                self.refuse(mark, str(error))
                value = 0
        # An empty document has an empty scalar for its content.
        if value is None and self.root is None and not self.stack:
            return
        self._add(Scalar(mark, value), event.anchor)

    def _key(self, parent: _Open, key: str, is_plain: bool, mark: Mark) -> None:
        entries, key_marks = parent.entries, parent.key_marks
        assert entries is not None and key_marks is not None
        parent.key_is_refused = True
        if key == "<<" and is_plain:
            self.refuse(
                mark,
                "merge keys (<<) are not read; repeat the keys, or use an alias for a whole value",
            )
        elif not key:
            self.refuse(mark, "an empty key; write a name before the colon")
        elif key in entries:
            self.refuse(
                mark,
                f'the key "{shorten(key)}" is already in line {key_marks[key].line}; remove one'
                " of the two",
            )
        else:
            parent.key, parent.key_is_refused = key, False
            key_marks[key] = mark

    def _alias(self, anchor: str, mark: Mark) -> None:
        if anchor in self.anchors:
            # An alias shares the node, and costs nothing here. But whoever walks the tree meets all
            # of it again, and a few lines could name billions of values: its size counts as if it
            # were written out.
            node, size, height = self.anchors[anchor]
            self._add(replace(node, mark=mark), None, size, height)
            return
        if any(opened.anchor == anchor for opened in self.stack):
            self.stop(
                mark,
                f"the alias *{anchor} is inside the value that it refers to; write the value out",
            )
        anchors = listing(f"&{name}" for name in self.anchors)
        self.refuse(
            mark,
            f"no anchor &{anchor}; " + (f"known: {anchors}" if anchors else "write the value out"),
        )
        self._add(Scalar(mark, "?"), None)

    def _add(self, node: Node, anchor: str | None, size: int = 1, height: int = 0) -> None:
        if anchor:
            self.anchors[anchor] = (node, size, height)
        if not self.stack:
            self.root = node
            return
        parent = self.stack[-1]
        parent.size += size
        parent.height = max(parent.height, height + 1)
        if len(self.stack) + height > DEEPEST:
            self.stop(node.mark, f"nested more than {DEEPEST} deep by this alias; write less of it")
        if parent.size > MOST_NODES:
            self.stop(
                node.mark,
                f"more than {MOST_NODES} values, aliases counted in full; move long lists into a"
                " CSV file",
            )
        if parent.entries is None:
            parent.items.append(node)
        elif parent.key is not None:
            parent.entries[parent.key] = node
            parent.key = None
        elif parent.key_is_refused:
            parent.key_is_refused = False
        else:
            self.refuse(node.mark, "a key must be a single word or text; write key: value")
            parent.key_is_refused = True


def _syntax_message(error: yaml.MarkedYAMLError, text: str, file: str) -> Message:
    mark = error.problem_mark or error.context_mark
    line, column = (mark.line, mark.column) if mark else (0, 0)
    lines = text.splitlines()
    problem = error.problem or "not YAML"
    if line < len(lines) and lines[line][column : column + 1] == "\t":
        remedy = "a tab; indent with spaces"
    else:
        remedy = next(
            (remedy for part, remedy in REMEDIES if part in problem),
            f"{problem}; check the punctuation",
        )
    # The parser notices an unclosed bracket or quote only at the end; it was opened where the
    # context says.
    if error.context_mark and "never closed" in remedy:
        line, column = error.context_mark.line, error.context_mark.column
    return Message(file, line + 1, column + 1, "", f"not valid YAML: {remedy}")
