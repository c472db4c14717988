"""Reference pages made from the program itself: what stands in their place is never written by
hand.

A page says `<!-- file format -->` or `<!-- commands -->` where the reference is to stand.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ballplate.cli._parsers import GROUPS, parser as command_line
from ballplate.extensions.machine_files.machine_sections import schema as machine_schema
from ballplate.extensions.machine_files.map_sections import schema as map_schema
from ballplate.extensions.sweeps.sweep_schema import schema as sweep_schema
from ballplate.simulator.experiment.json_schema import schema
from ballplate.simulator.inputs.quantity_types import (
    Angle,
    Bending,
    Duration,
    Expansion,
    Length,
    Ratio,
    TargetFunction,
    TemperatureDifference,
)
from ballplate.simulator.inputs.units import KINDS
from pydantic import TypeAdapter
from sphinx.application import Sphinx

Schema = dict[str, Any]

TOP = Path(__file__).resolve().parents[2]

QUANTITIES = {
    TypeAdapter(kind).json_schema()["pattern"]: words
    for kind, words in (
        (Length, "length"),
        (Angle, "angle"),
        (Ratio, "ratio"),
        (TemperatureDifference, "temperature difference"),
        (Expansion, "thermal expansion"),
        (Bending, "angle per length"),
        (Duration, "duration"),
        (TargetFunction, "length, or one that grows as `A + L/K`"),
    )
}


def file_format() -> str:
    """The keys of an experiment file, section by section, as Markdown."""
    return _keys(schema())


def sweep_format() -> str:
    """The keys of a sweep file, section by section, as Markdown."""
    return _keys(sweep_schema())


def machine_format() -> str:
    """The keys of a machine file, section by section, as Markdown."""
    return _keys(machine_schema())


def map_format() -> str:
    """The keys of a map file, less those of error models, as Markdown."""
    whole = map_schema()
    told = whole["properties"]["error_model"]["description"]
    whole["properties"]["error_model"] = {"type": "object", "description": told}
    return _keys(whole)


def _keys(whole: Schema) -> str:
    sections = dict(_sections(whole))
    lines = ["## The file", "", *_table(whole, whole, sections)]
    for name, paths in sections.items():
        part = whole["$defs"][name]
        kind = part["properties"].get("kind", {}).get("const")
        title = f"`{paths[0]}`" + (f" of kind `{kind}`" if kind else "")
        lines += ["", f"({_anchor(name, whole)})=", f"### {title}", "", part["description"]]
        others = [path for path in dict.fromkeys(paths) if path != paths[0]]
        if others:
            lines += ["", f"The same may stand at {', '.join(f'`{path}`' for path in others)}."]
        lines += ["", *_table(part, whole, sections)]
    return "\n".join(lines)


def units() -> str:
    """The units of quantities as Markdown."""
    return "\n".join(
        f"- {kind}: {', '.join(f'`{unit}`' for unit in about.units)}"
        for kind, about in KINDS.items()
    )


def _sections(whole: Schema) -> Iterator[tuple[str, list[str]]]:
    """Names of the sections with the paths at which they stand, in the order in which a reader
    meets them.
    """
    paths: dict[str, list[str]] = {}

    def visit(part: Schema, path: str) -> None:
        for name, below in part.get("properties", {}).items():
            for reference, where in _references(below, f"{path}.{name}".lstrip(".")):
                is_new = reference not in paths
                paths.setdefault(reference, []).append(where)
                if is_new:
                    visit(whole["$defs"][reference], where)

    visit(whole, "")
    yield from paths.items()


def _references(part: Schema, path: str) -> Iterator[tuple[str, str]]:
    if "$ref" in part:
        yield part["$ref"].removeprefix("#/$defs/"), path
    for choice in (*part.get("anyOf", ()), *part.get("oneOf", ())):
        yield from _references(choice, path)
    if isinstance(part.get("items"), dict):
        yield from _references(part["items"], f"{path}[…]")
    if isinstance(part.get("additionalProperties"), dict):
        yield from _references(part["additionalProperties"], f"{path}.NAME")


def _table(part: Schema, whole: Schema, sections: dict[str, list[str]]) -> list[str]:
    # Of the whole file the variants may supply what it leaves out.
    required = part.get("required") or next(
        (one["required"] for one in part.get("anyOf", ())[1:]), []
    )
    lines = ["| key | value | default | meaning |", "|---|---|---|---|"]
    for name, below in part["properties"].items():
        if "default" in below and below["default"] not in ([], {}, ""):
            default = f"`{_written(below['default'])}`"
        else:
            default = "*required*" if name in required else ""
        meaning = below.get("description", "")
        cells = [f"`{name}`", _form(below, whole), default, meaning]
        lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return lines


def _written(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def _form(part: Schema, whole: Schema) -> str:
    """What may stand at a key, in words."""
    if "$ref" in part:
        name = part["$ref"].removeprefix("#/$defs/")
        kind = whole["$defs"][name]["properties"].get("kind", {}).get("const")
        return f"[{kind or 'mapping'}](#{_anchor(name, whole)})"
    choices = [*part.get("anyOf", ()), *part.get("oneOf", ())]
    if choices:
        return ", or ".join(dict.fromkeys(_form(choice, whole) for choice in choices))
    if "const" in part:
        return f"`{part['const']}`"
    if "enum" in part:
        return ", ".join(f"`{value}`" for value in part["enum"])
    kind = part.get("type")
    if kind == "array":
        return _list_form(part, whole)
    if kind == "object":
        below = part.get("additionalProperties")
        names = ", ".join(part.get("propertyNames", {}).get("enum", ["name"]))
        is_any = not isinstance(below, dict) or not below
        return f"{names} → {'any value' if is_any else _form(below, whole)}"
    if kind == "string":
        return QUANTITIES.get(part.get("pattern", ""), "text")
    if kind == ["string", "integer"]:
        return "text"
    words = {"integer": "whole number", "number": "number", "boolean": "`true` or `false`"}.get(
        str(kind), "any value"
    )
    return words + _range(part)


def _list_form(part: Schema, whole: Schema) -> str:
    below = part.get("items")
    if "prefixItems" in part:
        (below,) = {json.dumps(item): item for item in part["prefixItems"]}.values()
    form = _form(below, whole) if isinstance(below, dict) else "any value"
    lower, upper = part.get("minItems", 0), part.get("maxItems")
    if upper is None or upper > 3:
        return f"list of {form}"
    return ", or ".join(f"[{', '.join([form] * n)}]" for n in range(lower, upper + 1))


def _range(part: Schema) -> str:
    words = []
    for key, text in (("minimum", "from"), ("exclusiveMinimum", "above"), ("maximum", "to")):
        if key in part:
            words.append(f"{text} {part[key]}")
    return f" {' '.join(words)}" if words else ""


def _anchor(name: str, whole: Schema) -> str:
    # Several kinds of files have sections of the same name.
    prefixes = {"ballplate machine": "machine-file", "ballplate map": "map-file"}
    prefix = prefixes.get(whole["title"], "file-format")
    return f"{prefix}-{name.lower()}"


def _subparsers(top: argparse.ArgumentParser) -> Any:
    (found,) = (action for action in top._actions if isinstance(action, argparse._SubParsersAction))
    return found


def command_table() -> str:
    """The commands in the groups of the help, as Markdown."""
    listed = _subparsers(command_line())._choices_actions
    lines = ["| to | command | does |", "|---|---|---|"]
    for group, title in GROUPS.items():
        for action in (action for action in listed if action.group == group):
            name = f"[`{action.dest}`](#ballplate-{action.dest})"
            lines.append(f"| {title} | {name} | {action.help} |")
            title = ""
    return "\n".join(lines)


def commands() -> str:
    """All commands with their options, as Markdown."""
    top = command_line()
    lines = [*_usage(top), "", top.epilog or ""]
    for name, parser in _subparsers(top).choices.items():
        lines += ["", f"## ballplate {name}", "", *_usage(parser), "", parser.description or ""]
        lines += ["", f"```{{program}} ballplate {name}", "```"]
        for action in parser._actions:
            if not isinstance(action, argparse._HelpAction):
                lines += ["", "````{option} " + _invocation(action), _text(action), "````"]
    return "\n".join(lines)


def _usage(parser: argparse.ArgumentParser) -> list[str]:
    parser.formatter_class = lambda prog: argparse.HelpFormatter(prog, width=90)
    # From Python 3.14 on help has colours on a terminal, where this may well run.
    parser.color = False  # type: ignore[attr-defined, unused-ignore]
    # Without the word "usage: ", and the following lines as far to the left.
    return ["```text", *(line[7:] for line in parser.format_usage().rstrip().splitlines()), "```"]


def _invocation(action: argparse.Action) -> str:
    value = action.metavar or (
        f"{{{','.join(action.choices)}}}" if action.choices else action.dest.upper()
    )
    value = "" if action.nargs == 0 else value
    return ", ".join(f"{option} {value}".strip() for option in action.option_strings) or str(value)


def _text(action: argparse.Action) -> str:
    return (action.help or "").replace("%%", "%") + "."


PARTS = {
    "<!-- file format -->": file_format,
    "<!-- sweep format -->": sweep_format,
    "<!-- machine format -->": machine_format,
    "<!-- map format -->": map_format,
    "<!-- units -->": units,
    "<!-- command table -->": command_table,
    "<!-- commands -->": commands,
}


def _fill(app: Sphinx, page: str, source: list[str]) -> None:
    for marker, part in PARTS.items():
        if marker in source[0]:
            source[0] = source[0].replace(marker, part())
            # The program may have changed although the page has not.
            app.env.note_reread()


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("source-read", _fill)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
