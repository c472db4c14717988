"""Changes of YAML files and tables: one to three, either of the text (lines, characters, bytes) or
of the tree that the text means, drawn at random.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from random import Random
from typing import Any

import yaml


@dataclass(frozen=True)
class Raw:
    """Text that is written into the YAML as it is."""

    text: str


@dataclass(frozen=True)
class Vocabulary:
    """Words of a file format: keys, values with a meaning of their own, and values that fit certain
    keys badly.
    """

    keys: tuple[str, ...]
    words: tuple[str, ...] = ()
    wild: tuple[tuple[str, tuple[Any, ...]], ...] = ()


def vocabulary(schema: dict[str, Any], wild: dict[str, Sequence[Any]]) -> Vocabulary:
    """Words of a JSON Schema, and what is to be tried for some keys."""
    keys, words = dict[str, None](), dict[str, None]()

    def collect(part: Any) -> None:
        if isinstance(part, dict):
            properties = part.get("properties", {})
            keys.update(dict.fromkeys(properties))
            words.update(
                dict.fromkeys(str(one) for one in (*part.get("enum", ()), part.get("const", "all")))
            )
            for one in (*part.values(), *properties.values()):
                collect(one)
        elif isinstance(part, list):
            for one in part:
                collect(one)

    collect(schema)
    return Vocabulary(
        tuple(keys), tuple(words), tuple((key, tuple(values)) for key, values in wild.items())
    )


def bomb(levels: int, width: int) -> Raw:
    """Lists of aliases of lists of aliases: width to the power of levels values."""
    text = '&l0 ["ha"]'
    lists = [text]
    for level in range(1, levels):
        lists.append(f"&l{level} [{', '.join([f'*l{level - 1}'] * width)}]")
    return Raw(f"[{', '.join(lists)}]")


BIG = (10**5, 10**9, 10**12, 10**18, 10**30, 10**290, 2**63, 2**64, -1, 0, -(10**20))
SCALARS: tuple[Any, ...] = (
    None,
    True,
    False,
    "",
    " ",
    "?",
    "all",
    "x" * 100_000,
    "é" * 300,
    "a\nb",
    "a\tb",
    "\x1b[31mred",
    "\x00",
    "\u2028",
    "\x85",
    "\U0001f600",
    "a: b",
    "1e300 m",
    "1e-300 m",
    "-1 mm",
    "0 mm",
    "1e300 rad",
    "1e-300 rad",
    "1e400 m",
    "1e999999 m",
    "1e-999999 mm",
    "9" * 250 + " mm",
    "1,5 mm",
    "1 µm",
    "5 parsec",
    "5 deg",
    "5 ppm",
    "5",
    "NaN mm",
    "inf",
    "0.5 um + L/1000000",
    "1e-300 um + L/1e-300",
    "0 mm + L/1e300",
    "L/0",
    math.nan,
    math.inf,
    -math.inf,
    1e308,
    5e-324,
    0.0,
    1.5,
    Raw("9" * 299),
    Raw("9" * 5000),
    Raw("0x" + "f" * 290),
    Raw("1e999"),
    Raw("-1e-999"),
    Raw("!!python/object/apply:os.getcwd []"),
    Raw("!!python/name:os.system"),
    Raw("!!binary aGVsbG8="),
    Raw("!!set {a, b}"),
    Raw("!!timestamp 2001-12-14"),
    Raw("!custom {a: 1}"),
    Raw("!<tag:yaml.org,2002:int> 5"),
    Raw("*nowhere"),
    Raw("&a [*a]"),
    Raw("{<<: {a: 1}}"),
    Raw("{<<: *nowhere, kind: grid}"),
    Raw("{? [a, b] : c}"),
    Raw("{? {a: b} : c}"),
    Raw("{a: 1, a: 2}"),
    Raw('"\\ud800"'),
    Raw('"\\U0010ffff"'),
    Raw("[1, 2"),
    Raw("{a: 1"),
    Raw('"open'),
    Raw("@at"),
    Raw("`tick"),
    Raw("%percent"),
    Raw("| text"),
    Raw("- dash"),
    Raw("2001-12-14"),
    Raw("0o17"),
    Raw("1_000"),
    Raw("on"),
    "/dev/zero",
    "/dev/null",
    "/dev/stdin",
    "/",
    ".",
    "..",
    "missing.csv",
    "a\x00b.csv",
    "n" * 5000,
    "mutant.yaml",
    "readings.csv",
    "balls.csv",
    "curves.csv",
    "points.csv",
    "distances.csv",
    "loop.csv",
    "pipe.csv",
)


def _nested(depth: int, left: str, right: str) -> Raw:
    return Raw(left * depth + "1" + right * depth)


STRUCTURES: tuple[Callable[[Random], Any], ...] = (
    lambda _: [],
    lambda _: {},
    lambda _: [[]],
    lambda _: {"": 1},
    lambda _: {"kind": None},
    lambda _: bomb(10, 10),
    lambda _: bomb(5, 8),
    lambda _: bomb(100, 9),
    lambda random: _nested(random.choice((3, 45, 55, 1000, 20_000)), "[", "]"),
    lambda random: _nested(random.choice((3, 45, 55, 1000, 20_000)), "{a: ", "}"),
    lambda random: [random.choice(("0 mm", 1, "a", None))] * random.choice((3, 1000, 60_000)),
    lambda random: [str(k) for k in range(random.choice((3, 1000, 30_000)))],
    lambda random: {
        f"k{k}": random.choice((1, "0 mm", None)) for k in range(random.choice((3, 1000, 30_000)))
    },
    lambda random: [[f"{k} mm", "0 mm"] for k in range(random.choice((3, 1000, 30_000)))],
    lambda random: ["1 mm"] * random.randrange(5),
    lambda random: [random.choice(SCALARS) for _ in range(random.randrange(5))],
    lambda random: Raw(
        "&shared " + emit(random.choice(("1 mm", [1, 2], {"x": "0 mm", "y": "0 mm"})))
    ),
    lambda _: Raw("*shared"),
)


def wild_value(random: Random, key: str | int | None, words: Vocabulary) -> Any:
    """A value that most likely does not belong there."""
    own = dict(words.wild).get(str(key), ())
    draw = random.random()
    if own and draw < 0.6:
        return random.choice(own)
    if draw < 0.2:
        return random.choice(BIG)
    if draw < 0.3 and words.words:
        return random.choice(words.words)
    if draw < 0.7:
        return random.choice(SCALARS)
    return random.choice(STRUCTURES)(random)


def emit(value: Any) -> str:
    """YAML of a tree in one line."""
    if isinstance(value, Raw):
        return value.text
    if isinstance(value, dict):
        return "{" + ", ".join(f"{emit(key)}: {emit(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(emit(item) for item in value) + "]"
    if isinstance(value, float):
        return ".nan" if math.isnan(value) else repr(value).replace("inf", ".inf")
    if value is None:
        return "null"
    return json.dumps(value, ensure_ascii=bool(isinstance(value, str) and not value.isprintable()))


def emit_file(tree: Any) -> bytes:
    """YAML of a tree, the keys of its root each in a line of its own."""
    if isinstance(tree, dict) and tree:
        return "".join(f"{emit(key)}: {emit(item)}\n" for key, item in tree.items()).encode()
    return (emit(tree) + "\n").encode()


def _places(tree: Any) -> list[tuple[Any, Any]]:
    """Every container with each of its keys or indices."""
    found: list[tuple[Any, Any]] = []
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        for key in list(node) if isinstance(node, dict) else range(len(node)):
            found.append((node, key))
            if isinstance(node[key], dict | list):
                waiting.append(node[key])
    return found


def change_tree(random: Random, tree: Any, words: Vocabulary) -> str:
    """Change a tree in place; returns what was done."""
    places = _places(tree)
    if not places:
        return "nothing"
    node, key = random.choice(places)
    what = random.choice(
        ("replace",) * 8 + ("delete", "copy", "exchange", "rename", "add", "add", "wrap", "number")
    )
    name = f"{what} {str(key)[:30]}"
    if what == "replace":
        node[key] = wild_value(random, key, words)
    elif what == "delete":
        del node[key]
    elif what == "copy" and isinstance(node, list):
        node.insert(key, node[key])
    elif what == "exchange":
        other, place = random.choice(places)
        node[key], other[place] = json.loads(json.dumps(other[place], default=str)), node[key]
        # An exchange with something below itself would make a circle.
        node[key] = json.loads(json.dumps(node[key], default=str))
        try:
            json.dumps(tree, default=str)
        except ValueError:
            node[key] = None
            other[place] = None
    elif what == "rename" and isinstance(node, dict):
        node[random.choice((*words.keys, "", "<<", "a\nb", "\u2028", "k" * 300))] = node.pop(key)
    elif what == "add" and isinstance(node, dict):
        new = random.choice(words.keys or ("a",))
        node[new] = wild_value(random, new, words)
        name += f" beside: {new}"
    elif what == "wrap":
        node[key] = random.choice(
            ([node[key]], {"kind": node[key]}, [node[key]] * 50, {str(key): node[key]})
        )
    elif what == "number" and isinstance(node[key], str):
        digits = [i for i, letter in enumerate(node[key]) if letter.isdigit()]
        at = random.choice(digits) if digits else 0
        node[key] = (
            node[key][:at]
            + random.choice(("", "0", "-", "e9", "e300", "e-300", ".", ","))
            + node[key][at:]
        )
    else:
        node[key] = wild_value(random, key, words)
    return name


def _lines(content: bytes) -> list[bytes]:
    return content.splitlines(keepends=True) or [b"\n"]


def _delete_line(random: Random, content: bytes) -> bytes:
    lines = _lines(content)
    del lines[random.randrange(len(lines))]
    return b"".join(lines)


def _copy_line(random: Random, content: bytes) -> bytes:
    lines = _lines(content)
    i = random.randrange(len(lines))
    return b"".join([*lines[:i], *[lines[i]] * random.choice((2, 2, 50)), *lines[i + 1 :]])


def _exchange_lines(random: Random, content: bytes) -> bytes:
    lines = _lines(content)
    i, j = random.randrange(len(lines)), random.randrange(len(lines))
    lines[i], lines[j] = lines[j], lines[i]
    return b"".join(lines)


def _indent(random: Random, content: bytes) -> bytes:
    lines = _lines(content)
    i = random.randrange(len(lines))
    lines[i] = random.choice((b" ", b"    ", b"\t", b"- ", b"? ", b": ")) + lines[i]
    return b"".join(lines)


def _outdent(random: Random, content: bytes) -> bytes:
    lines = _lines(content)
    i = random.randrange(len(lines))
    lines[i] = lines[i].lstrip(b" ")
    return b"".join(lines)


ODD_BYTES = (
    *(bytes([k]) for k in (*range(32), 127, 128, 0xC0, 0xFE, 0xFF)),
    *(letter.encode() for letter in "\u2028\u00a0\u0085\ufeff\ufffe\U0001f600é"),
    b"\xed\xa0\x80",
    *(letter.encode() for letter in "{}[]&*!|>%@`'\"#,:-?0987654321 eLx"),
)


def _replace_character(random: Random, content: bytes) -> bytes:
    at = random.randrange(len(content) + 1)
    return content[:at] + random.choice(ODD_BYTES) + content[at + random.choice((0, 1)) :]


def _several_characters(random: Random, content: bytes) -> bytes:
    for _ in range(random.randrange(2, 20)):
        content = _replace_character(random, content)
    return content


def _exchange_characters(random: Random, content: bytes) -> bytes:
    at = random.randrange(max(len(content) - 1, 1))
    return content[:at] + content[at + 1 : at + 2] + content[at : at + 1] + content[at + 2 :]


def _truncate(random: Random, content: bytes) -> bytes:
    return content[: random.randrange(len(content) + 1)]


def _number(random: Random, content: bytes) -> bytes:
    """Another number in place of one."""
    at = [i for i in range(len(content)) if content[i : i + 1].isdigit()]
    if not at:
        return content
    i = random.choice(at)
    j = i
    while content[j : j + 1].isdigit():
        j += 1
    new = random.choice(
        (b"0", b"-1", b"1e9", b"100000", b"1000000000000", b"1e300", b"1e-300", b".nan", b"9" * 400)
    )
    return content[:i] + new + content[j:]


TEXT_CHANGES: dict[str, Callable[[Random, bytes], bytes]] = {
    "line deleted": _delete_line,
    "line copied": _copy_line,
    "lines exchanged": _exchange_lines,
    "indented": _indent,
    "outdented": _outdent,
    "character": _replace_character,
    "characters": _several_characters,
    "characters exchanged": _exchange_characters,
    "number": _number,
    "truncated": _truncate,
    "BOM": lambda _, content: b"\xef\xbb\xbf" + content,
    "UTF-16": lambda _, content: content.decode("utf-8", "replace").encode("utf-16"),
    "Latin 1": lambda _, content: (
        content.decode("utf-8", "replace").encode("latin-1", "replace") + b"# \xe9\n"
    ),
    "CRLF": lambda _, content: content.replace(b"\n", b"\r\n"),
    "CR": lambda _, content: content.replace(b"\n", b"\r"),
    "tabs": lambda _, content: content.replace(b"  ", b"\t"),
    "NUL at the end": lambda _, content: content + b"\0",
    "twice": lambda _, content: content + b"---\n" + content,
    "YAML version": lambda random, content: (
        random.choice((b"%YAML 1.1\n---\n", b"%YAML 3.0\n---\n", b"%A b\n")) + content
    ),
    "one line": lambda _, content: content.replace(b"\n", b" "),
    "emptied": lambda random, _: random.choice(
        (b"", b"\n", b"# nothing\n", b"---\n", b"null", b"...", b"\0")
    ),
}


def changed_text(random: Random, content: bytes) -> tuple[str, bytes]:
    """Text with one change, and what that is."""
    name = random.choice(list(TEXT_CHANGES))
    return name, TEXT_CHANGES[name](random, content)


def tree_of(content: bytes) -> str:
    """What a YAML file means, as JSON."""
    return json.dumps(yaml.load(content, Loader=yaml.SafeLoader), default=str)


def changed_yaml(
    random: Random, content: bytes, tree_text: str, words: Vocabulary
) -> tuple[list[str], bytes]:
    """A file with one to three changes, and what these are; `tree_text` is JSON of what the file
    means.
    """
    changes = []
    if random.random() < 0.65:
        tree = json.loads(tree_text)
        variants = tree.get("variants") if isinstance(tree, dict) else None
        if isinstance(variants, dict):
            kept = random.choice([*variants, None])
            tree.pop("variants")
            if kept is not None:
                tree["variants"] = {kept: variants[kept]}
        for _ in range(random.choice((1, 1, 2, 3))):
            changes.append(change_tree(random, tree, words))
        if random.random() < 0.03:
            tree, changes = wild_value(random, None, words), ["all"]
        content = emit_file(tree)
        if random.random() < 0.05:
            name, content = changed_text(random, content)
            changes.append(name)
    else:
        for _ in range(random.choice((1, 1, 2))):
            name, content = changed_text(random, content)
            changes.append(name)
    return changes, content


def _by_cells(
    change: Callable[[Random, list[list[bytes]]], None],
) -> Callable[[Random, bytes], bytes]:
    def changed(random: Random, content: bytes) -> bytes:
        rows = [line.split(b",") for line in content.splitlines()] or [[b""]]
        change(random, rows)
        return b"\n".join(b",".join(row) for row in rows) + b"\n"

    return changed


def _column(random: Random, rows: list[list[bytes]]) -> int:
    return random.randrange(len(rows[0]))


def _column_away(random: Random, rows: list[list[bytes]]) -> None:
    at = _column(random, rows)
    rows[:] = [row[:at] + row[at + 1 :] or [b""] for row in rows]


def _column_twice(random: Random, rows: list[list[bytes]]) -> None:
    at = _column(random, rows)
    rows[:] = [row[: at + 1] + row[at:] for row in rows]


def _columns_exchanged(random: Random, rows: list[list[bytes]]) -> None:
    at, to = _column(random, rows), _column(random, rows)
    for row in rows if random.random() < 0.5 else rows[:1]:
        if max(at, to) < len(row):
            row[at], row[to] = row[to], row[at]


def _heading(random: Random, rows: list[list[bytes]]) -> None:
    names = (
        b"u_um",
        b"x_MM",
        b"x",
        b"x_in",
        b"x_m",
        b"probe",
        b"",
        b"x_um",
        b"y_pm",
        b"position",
        b'"x_mm"',
        b"\x1b",
    )
    rows[0][_column(random, rows)] = random.choice(names)


CELLS = (
    *(
        b"",
        b"nan",
        b"inf",
        b"1e300",
        b"1e-300",
        b"1e999999",
        b"-1e9",
        b"0",
        b"9" * 5000,
        b"1e6",
        b"-500",
        b"1;5",
    ),
    *(
        b'"',
        b'""',
        b'"a',
        b'a"b',
        b'"1,5"',
        b"1,5",
        b"0x10",
        b"1_0",
        b"\xd9\xa1",
        b"\xe2\x80\xa8",
        b"\0",
        b"\xff",
    ),
    *(
        b"# comment",
        b"x" * 100_000,
        b"r1c1",
        b"\r",
        b"\n",
        b"\t",
        b" ",
        b"=1+1",
        b"a",
        b"z low",
        b"down",
    ),
)


def _cell(random: Random, rows: list[list[bytes]]) -> None:
    for _ in range(random.choice((1, 1, 5))):
        row = random.choice(rows)
        row[random.randrange(len(row))] = random.choice(CELLS)


def _column_of_one(random: Random, rows: list[list[bytes]]) -> None:
    at, cell = _column(random, rows), random.choice(CELLS)
    for row in rows[1:]:
        if at < len(row):
            row[at] = cell


def _column_added(random: Random, rows: list[list[bytes]]) -> None:
    cell = random.choice((b"0.2", b"0", b"1e-300", b"1e-12", b"1e12", b"1000000", b"a"))
    rows[:] = [[*rows[0], b"u_um"], *([*row, cell] for row in rows[1:])]


def _rows_mixed(random: Random, rows: list[list[bytes]]) -> None:
    below = rows[1:]
    random.shuffle(below)
    rows[1:] = below[: random.choice((0, 1, 3, len(below), len(below)))]


TABLE_CHANGES: dict[str, Callable[[Random, bytes], bytes]] = {
    "column away": _by_cells(_column_away),
    "column twice": _by_cells(_column_twice),
    "columns exchanged": _by_cells(_columns_exchanged),
    "heading": _by_cells(_heading),
    "cells": _by_cells(_cell),
    "column of one value": _by_cells(_column_of_one),
    "uncertainties": _by_cells(_column_added),
    "rows mixed": _by_cells(_rows_mixed),
    "decimal commas": lambda _, content: content.replace(b".", b","),
    "semicolons": lambda _, content: content.replace(b",", b";"),
    "tabs between": lambda _, content: content.replace(b",", b"\t"),
    "in quotes": lambda _, content: b'"' + content.replace(b",", b'","').replace(b"\n", b'"\n"'),
    "a million columns": lambda random, content: (
        random.choice((b",", b"a,", b"x_mm,")) * 10**6 + content
    ),
    "a hundred copies": lambda _, content: content * 100,
}


# Changes of changes may multiply.
MOST_BYTES = 20_000_000


def changed_table(random: Random, content: bytes) -> tuple[list[str], bytes]:
    """A comma-separated table with one change or two, and what these are."""
    changes = list[str]()
    for _ in range(random.choice((1, 1, 2))):
        every = TABLE_CHANGES if random.random() < 0.7 else TEXT_CHANGES
        changes.append(random.choice(list(every)))
        content = every[changes[-1]](random, content)[:MOST_BYTES]
    return changes, content
