"""Changes of a YAML text at given paths that keep every other byte."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import yaml
from ballplate.simulator.inputs import (
    LOADER,
    ExperimentError,
    Mark,
    Step,
    Steps,
    format_path,
    parse_tree,
    refused,
    to_python,
    yaml_text,
)

# What ends a line for YAML's parser.
LINE_END = re.compile("\r\n|[\n\r\x85\u2028\u2029]")
# Anchors and tags before a value.
PROPERTIES = re.compile(r"(?:[&!]\S*\s+)*")
# Columns of a new mapping in one line.
MOST_COLUMNS = 120


@dataclass(frozen=True)
class TextChange:
    """A value that is set at a path, possibly a new one, appended to the list there, or removed;
    or the indices of that list's entries in another order.
    """

    steps: Steps
    value: Any = None
    kind: Literal["set", "append", "remove", "order"] = "set"


@dataclass(frozen=True, eq=False)
class _Span:
    """Indices of a value in its text, without trailing spaces, and `column` of a block's entries,
    from 0.

    `entries` are keys, or indices, with the span of the key or item and of its value.
    """

    start: int
    end: int
    kind: Literal["scalar", "alias", "list", "mapping"]
    mark: Mark
    column: int = 0
    is_flow: bool = False
    anchor: str | None = None
    entries: tuple[tuple[Step, _Span, _Span], ...] = ()


@dataclass(frozen=True, eq=False)
class _Text:
    """A text with the spans of its values; `scalars` has the indices of all, keys included, and
    `aliases` their targets.
    """

    text: str
    root: _Span
    scalars: tuple[tuple[int, int], ...]
    aliases: frozenset[str]


def flow(value: Any) -> str:
    """Plain data as YAML in one line.

    >>> flow({"name": "z low", "corner": {"x": "0 mm"}, "probes": ["a, b", "1e-3"]})
    "{name: z low, corner: {x: 0 mm}, probes: ['a, b', '1e-3']}"
    """
    return yaml_text([value], flow_style=True).strip()[1:-1]


def with_changes(text: str, file: str, changes: Iterable[TextChange]) -> str:
    r"""Return the text with changes made in sequence; the rest keeps its meaning.

    :raises ExperimentError: a path with an alias or anchor; a comment there would be lost; or the
        rest of the text would change its meaning.

    >>> text = "plate: {balls: 5}  # ours\n"
    >>> with_changes(text, "example", [TextChange(("plate", "balls"), 6)])
    'plate: {balls: 6}  # ours\n'
    """
    data = to_python(parse_tree(text, file))
    for change in changes:
        spans = _spans(text, file)
        text, data = _changed(spans, change), changed_data(data, change)
        try:
            after = to_python(parse_tree(text, file))
        except ExperimentError:
            after = None
        if after != data:
            raise _refusal(
                _way(spans, change.steps)[-1],
                change.steps,
                "cannot be changed without the text about it; change it by hand",
            )
    return text


def changed_data(data: Any, change: TextChange) -> Any:
    """Return plain data, with tuples for lists, after a change.

    >>> changed_data({"a": (1,)}, TextChange(("a",), 2, "append"))
    {'a': (1, 2)}
    """
    step, later = change.steps[0], change.steps[1:]
    if isinstance(data, tuple):
        assert isinstance(step, int)
        items = list(data)
        if not later and change.kind == "remove":
            return (*items[:step], *items[step + 1 :])
        items[step] = _one_changed(items[step], later, change)
        return tuple(items)
    if not later and change.kind == "remove":
        return {key: value for key, value in data.items() if key != step}
    return {**data, step: _one_changed(data.get(step), later, change)}


def _one_changed(data: Any, steps: Steps, change: TextChange) -> Any:
    if steps:
        return changed_data(
            {} if data is None else data, TextChange(steps, change.value, change.kind)
        )
    value = _as_read(change.value)
    if change.kind == "order":
        return tuple(data[k] for k in value)
    return (*(data or ()), value) if change.kind == "append" else value


def _as_read(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _as_read(item) for key, item in value.items()}
    return tuple(map(_as_read, value)) if isinstance(value, list | tuple) else value


def _key(name: str) -> str:
    return yaml_text(name).removesuffix("\n...\n").strip()


def _spans(text: str, file: str) -> _Text:
    events: Iterator[Any] = iter(yaml.parse(text, Loader=LOADER))
    scalars = []
    aliases = set()

    def read(event: Any) -> _Span:
        start, end = event.start_mark.index, event.end_mark.index
        mark = Mark(file, event.start_mark.line + 1, event.start_mark.column + 1)
        if isinstance(event, yaml.AliasEvent):
            aliases.add(str(event.anchor))
            return _Span(start, end, "alias", mark)
        if isinstance(event, yaml.ScalarEvent):
            # A block's end is where something else begins.
            end = start + len(text[start:end].rstrip())
            properties = PROPERTIES.match(text, start, end)
            scalars.append((properties.end() if properties else start, end))
            return _Span(start, end, "scalar", mark, anchor=event.anchor)
        is_flow = text[start:end].endswith(("[", "{"))
        entries: list[tuple[Step, _Span, _Span]] = []
        is_list = isinstance(event, yaml.SequenceStartEvent)
        closing = yaml.SequenceEndEvent if is_list else yaml.MappingEndEvent
        for below in events:
            if isinstance(below, closing):
                break
            key = read(below)
            if is_list:
                entries.append((len(entries), key, key))
            else:
                entries.append((below.value, key, read(next(events))))
        stop = below.end_mark.index if is_flow else entries[-1][2].end
        column = (mark if is_list or not entries else entries[0][1].mark).column - 1
        kind: Literal["list", "mapping"] = "list" if is_list else "mapping"
        return _Span(start, stop, kind, mark, column, is_flow, event.anchor, tuple(entries))

    for event in events:
        if not isinstance(event, yaml.StreamStartEvent | yaml.DocumentStartEvent):
            break
    root = read(event)
    return _Text(text, root, tuple(scalars), frozenset(aliases))


def _way(text: _Text, steps: Steps) -> list[_Span]:
    """Return the values along a path, up to the last that exists."""
    way = [text.root]
    for step in steps:
        below = next((value for key, _, value in way[-1].entries if key == step), None)
        if below is None:
            break
        way.append(below)
    return way


def _refusal(span: _Span, steps: Steps, text: str) -> ExperimentError:
    mark = span.mark
    return refused(mark.file, text, format_path(steps), line=mark.line, column=mark.column)


def _changed(text: _Text, change: TextChange) -> str:
    way = _way(text, change.steps)
    for span in way:
        if span.kind == "alias":
            raise _refusal(
                span, change.steps, "is an alias; change the value at its anchor by hand"
            )
        if span.anchor in text.aliases:
            raise _refusal(
                span,
                change.steps,
                f"others refer to this as *{span.anchor}, and would change with it; change it by"
                " hand",
            )
    last, missing = way[-1], change.steps[len(way) - 1 :]
    is_empty = last.start == last.end and last is not text.root
    if missing and (change.kind == "remove" or not (last.kind == "mapping" or is_empty)):
        raise _refusal(
            last, change.steps, "there is no mapping or list to extend; write it by hand"
        )
    if change.kind == "remove":
        return _without(text, way[-2], last, change)
    if change.kind == "order":
        return _reordered(text.text, last, change.value)
    if change.kind == "append" and last.kind == "list":
        return _with_entry(text, last, change.value)
    value = [change.value] if change.kind == "append" else change.value
    for step in reversed(missing if is_empty else missing[1:]):
        value = {step: value}
    if missing and not is_empty:
        return _with_entry(text, last, value, str(missing[0]))
    return _with_value(text, way[-2], last, change, value)


def _with_value(text: _Text, above: _Span, span: _Span, change: TextChange, value: Any) -> str:
    _keep_what_is_told(text, span, span.start, span.end, change)
    written, old = flow(value), text.text[span.start : span.end]
    if old[:1] in ("'", '"') and isinstance(value, str) and not set(written) & set("'\"\\"):
        written = old[0] + written + old[0]
    if span.start and not text.text[span.start - 1].isspace() and not old:
        written = f" {written}"
    if not above.is_flow and span.mark.column - 1 <= above.column:
        # A list may begin below its key, and nothing else.
        written = f"  {written}"
    return text.text[: span.start] + written + text.text[span.end :]


def _with_entry(text: _Text, into: _Span, value: Any, key: str | None = None) -> str:
    """The text with an entry more at the end of a list or, with a key, of a mapping."""
    whole = text.text
    if into.is_flow:
        written = flow(value) if key is None else flow({key: value})[1:-1]
        if not into.entries:
            insert_at = into.end - 1
            return whole[:insert_at] + written + whole[insert_at:]
        _, first, last = into.entries[-1]
        line_start = _line_start(whole, first.start)
        indent = whole[line_start : first.start]
        if indent.strip() or len(into.entries) < 2:
            return f"{whole[: last.end]}, {written}{whole[last.end :]}"
        # One entry a line; what is told after the last one stays beside it.
        rest_end = _line_end(whole, last.end)
        tail = whole[last.end : min(rest_end, into.end - 1)]
        comma = "" if tail.lstrip().startswith(",") else ","
        if rest_end > into.end - 1:
            return (
                f"{whole[: last.end]}{comma}{_break(whole, 0)}{indent}{written}{whole[last.end :]}"
            )
        return (
            f"{whole[: last.end]}{comma}{tail}{_break(whole, rest_end)}{indent}{written}"
            f"{whole[rest_end:]}"
        )
    indent = " " * into.column
    end = _line_end(whole, into.end)
    new_line = _break(whole, end) + indent
    if key is None:
        is_block = not into.entries[-1][2].is_flow and into.entries[-1][2].kind == "mapping"
        if is_block and isinstance(value, dict):
            written = f"{new_line}  ".join(f"{_key(k)}: {flow(v)}" for k, v in value.items())
        else:
            written = flow(value)
        return f"{whole[:end]}{new_line}- {written}{whole[end:]}"
    return f"{whole[:end]}{new_line}{_of_key(key, value, new_line)}{whole[end:]}"


def _of_key(key: str, value: Any, new_line: str) -> str:
    """A key with its value in one line, or what would be too long for one in several."""
    written, below = f"{_key(key)}: {flow(value)}", f"{new_line}  "
    if isinstance(value, list | tuple) and value and isinstance(value[0], dict):
        return f"{_key(key)}:" + "".join(f"{below}- {flow(item)}" for item in value)
    if isinstance(value, dict) and len(written) > MOST_COLUMNS:
        lines = [below + _of_key(name, entry, below) for name, entry in value.items()]
        return f"{_key(key)}:" + "".join(lines)
    return written


def _reordered(whole: str, span: _Span, order: Sequence[int]) -> str:
    """The text with the entries of a list in another order, with the comments about each."""
    bounds = [(entry.start, entry.end) for _, _, entry in span.entries]
    if not span.is_flow:
        ends = [_line_end(whole, end) for _, end in bounds]
        first = _line_start(whole, bounds[0][0])
        # What stands above an entry, after the line of the one before, goes with it; what stands
        # above the first is about all.
        starts = [first, *(end + len(_break(whole, end)) for end in ends[:-1])]
        bounds = list(zip(starts, ends, strict=True))
    parts = [whole[start:end] for start, end in bounds]
    for (start, end), k in zip(reversed(bounds), reversed(order), strict=True):
        whole = whole[:start] + parts[k] + whole[end:]
    return whole


def _without(text: _Text, above: _Span, span: _Span, change: TextChange) -> str:
    whole = text.text
    k = next(k for k, (_, _, value) in enumerate(above.entries) if value is span)
    key = above.entries[k][1]
    line_start = _line_start(whole, key.start)
    if not above.is_flow and not whole[line_start : key.start].strip():
        start, end = line_start, _line_end(whole, span.end)
        following = LINE_END.match(whole, end)
        end = following.end() if following else end
    elif k + 1 < len(above.entries):
        start, end = key.start, above.entries[k + 1][1].start
    else:
        start, end = (above.entries[k - 1][2].end if k else key.start), span.end
    _keep_what_is_told(text, span, start, end, change)
    return whole[:start] + whole[end:]


def _keep_what_is_told(text: _Text, span: _Span, start: int, end: int, change: TextChange) -> None:
    """Refuse to take away comments, anchors and aliases.

    :raises ExperimentError: there are some between the indices.
    """
    inside = [scalar for scalar in text.scalars if start <= scalar[0] and scalar[1] <= end]
    ends = [start, *(scalar[1] for scalar in inside)]
    for gap_start, gap_end in zip(ends, [*(scalar[0] for scalar in inside), end], strict=True):
        mark = re.search("[#&*!]", text.text[gap_start:gap_end])
        if mark is not None:
            subject = {"#": "a comment", "&": "an anchor", "*": "an alias", "!": "a tag"}[mark[0]]
            before = text.text[: gap_start + mark.start()]
            lines = LINE_END.split(before)
            place = Mark(span.mark.file, len(lines), len(lines[-1]) + 1)
            raise place.refused(
                f"{subject} here would be lost by the change; change it by hand",
                format_path(change.steps),
            )


def _line_start(text: str, index: int) -> int:
    """Index of the start of the line that an index is in."""
    return max((line_end.end() for line_end in LINE_END.finditer(text, 0, index)), default=0)


def _line_end(text: str, start: int) -> int:
    """Index of the end of the line that an index is in."""
    line_end = LINE_END.search(text, start)
    return len(text) if line_end is None else line_end.start()


def _break(text: str, start: int) -> str:
    """Return the line end there, or else that of the first line."""
    line_break = LINE_END.match(text, start) or LINE_END.search(text)
    return "\n" if line_break is None else line_break[0]
