"""Messages for the file's author from pydantic's errors."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping as AnyMapping
from dataclasses import dataclass
from typing import Any

from pydantic_core import ErrorDetails

from .messages import MOST_MESSAGES, Steps
from .problems import written_keys
from .settings import LACKING, describe, hint, listing, shorten
from .yamltree import Mapping, Node, Scalar, Sequence, child, to_python, written

Schema = AnyMapping[str, Any]

# Keys that may state an expanded uncertainty in place of a standard one.
NOT_STANDARD = ("expanded_uncertainty", "uncertainty", "expanded", "u", "u95", "accuracy")
# Kinds by their synonyms, in lower case, letters only.
OTHER_NAMES = {
    **dict.fromkeys(("ballbar", "barbell", "dumbbell"), "two_spheres"),
    **dict.fromkeys(("bryangauge", "bryan"), "bryan_gauge"),
}

# Type of error → what was expected instead.
EXPECTED = {
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "int_parsing": "a whole number",
    "float_type": "a number",
    "bool_type": "true or false",
    "string_type": "a text",
    "tuple_type": "a list in brackets",
    "dict_type": "a mapping, key: value",
    "model_type": "a mapping, key: value",
    "model_attributes_type": "a mapping, key: value",
}
COMPARISONS = {
    "greater_than": ("gt", "above"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "below"),
    "less_than_equal": ("le", "at most"),
}


@dataclass(frozen=True)
class Explanation:
    """A path below the validated node and its message; ``of_key``: about the key, not its value."""

    steps: Steps
    text: str
    of_key: bool = False


def explain(errors: list[ErrorDetails], node: Node, schema: Schema) -> list[Explanation]:
    """Return explanations of errors in ``node``; ``schema`` is its JSON schema."""
    explanations = []
    choices: dict[Steps, dict[str, list[tuple[Explanation, bool]]]] = {}
    # More than `MOST_MESSAGES` are not reported.
    for error in errors[: 2 * MOST_MESSAGES]:
        steps, wrong, choice = _location(error, node)
        # Pydantic counts invalid entries as missing.
        items = getattr(wrong, "items", ())
        if error["type"] == "too_short" and items and len(items) >= error["ctx"]["min_length"]:
            continue
        explanation = _explain(error, steps, wrong, node, schema)
        if choice is None:
            explanations.append(explanation)
            continue
        above, label = choice
        # The choice fails because of the form that was written, not because of an error within it.
        is_other_form = explanation.steps == above and (
            error["type"] in EXPECTED
            or (error["type"] == "literal_error" and not isinstance(wrong, Scalar))
        )
        choices.setdefault(above, {}).setdefault(label, []).append((explanation, is_other_form))
    for by_label in choices.values():
        explanations += _nearest_choice(list(by_label.values()))
    return list(dict.fromkeys(explanations))


# Where a value may have several forms, pydantic tries all of them and reports why each has failed.
# An author wrote one form, and only its faults are of use. Forms that do not fit the kind of value
# at all, a list for a number, are left out, unless none fits. Of the rest the one that went
# furthest into the value before it failed is the likeliest. If several went equally far, the first
# fault of each is stated, joined by "or".
def _nearest_choice(choices: list[list[tuple[Explanation, bool]]]) -> list[Explanation]:
    # The choice that failed deepest in the tree is the one that the author meant.
    same_form = [
        choice for choice in choices if not any(other_form for _, other_form in choice)
    ] or choices
    deepest = max(len(explanation.steps) for choice in same_form for explanation, _ in choice)
    nearest = [
        choice for choice in same_form if any(len(error.steps) == deepest for error, _ in choice)
    ]
    if len(nearest) == 1:
        return [explanation for explanation, _ in nearest[0]]
    firsts = [choice[0][0] for choice in nearest]
    return [
        Explanation(firsts[0].steps, " – or: ".join(dict.fromkeys(first.text for first in firsts)))
    ]


def _location(error: ErrorDetails, root: Node) -> tuple[Steps, Node, tuple[Steps, str] | None]:
    """Return the path of an error, its node, or the one above if the last step does not exist, and
    the path at which one of several forms was tried, with that form.
    """
    # Pydantic's path mixes keys and indices of the file with names of what was tried: the kind of a
    # discriminated union, the form of another union, `[key]` for a fault of a key itself. Steps
    # that the file has are followed. A step equal to the kind of the mapping is its tag, but only
    # once, since a key may have that name too. The first remaining step names the form that was
    # tried.
    steps: Steps = ()
    node, choice, tagged = root, None, False
    for i, step in enumerate(error["loc"]):
        is_last = i == len(error["loc"]) - 1
        below = child(node, step)
        # The tag of a form, unless the file has such a key.
        if below is None and isinstance(step, str) and step.startswith("<"):
            continue
        if not tagged and isinstance(node, Mapping) and _kind(node) == step:
            tagged = True
        elif below is not None:
            steps, node, tagged = (*steps, step), below, False
        elif is_last and error["type"] == "missing":
            steps = (*steps, step)
        elif choice is None and step != "[key]":
            choice = (steps, str(step))
    return steps, node, choice


def _kind(node: Node) -> str | None:
    kind = child(node, "kind")
    return str(kind.value) if isinstance(kind, Scalar) else None


def _explain(
    error: ErrorDetails, steps: Steps, node: Node, root: Node, schema: Schema
) -> Explanation:
    kind, context = error["type"], error.get("ctx", {})
    value = (
        to_python(node) if isinstance(node, Scalar) else () if isinstance(node, Sequence) else {}
    )
    if kind == "missing":
        if isinstance(steps[-1], int):
            return Explanation(steps[:-1], _wrong_length(root, steps[:-1], schema))
        note = _description(schema, root, steps)
        return Explanation(steps, f'missing; add "{steps[-1]}"{note}')
    if kind == "extra_forbidden" or (kind == "literal_error" and error["loc"][-1:] == ("[key]",)):
        return _unknown_key(steps, root, schema)
    if isinstance(node, Scalar) and node.value is None:
        return Explanation(steps, "empty; give a value, or leave it out")
    if kind in ("union_tag_invalid", "union_tag_not_found", "open_tag_invalid"):
        kinds = _allowed(schema, root, (*steps, "kind"))
        tag = child(node, "kind")
        if tag is None:
            return Explanation((*steps, "kind"), f'missing; add "kind", one of: {listing(kinds)}')
        if isinstance(tag, Scalar) and tag.value is not None:
            synonym = OTHER_NAMES.get("".join(filter(str.isalnum, str(tag.value).casefold())))
            advice = f'write "{synonym}"' if synonym in kinds else hint(str(tag.value), kinds)
            if kind == "open_tag_invalid" and advice.startswith("known"):
                advice = f"{advice}; {LACKING}"
            return Explanation(
                (*steps, "kind"), f'unknown kind "{shorten(str(tag.value))}"; {advice}'
            )
        return Explanation((*steps, "kind"), f"expected one of: {listing(kinds)}")
    if kind == "literal_error":
        is_plane = not {"plane", "planes"}.isdisjoint(steps)
        if is_plane and isinstance(value, str) and (across := _across(value)):
            text = f'the plane "{value}" is normal to {across}; write {across}'
            return Explanation(steps, text)
        return Explanation(steps, _wrong_literal(value, _allowed(schema, root, steps)))
    if kind in EXPECTED:
        note = _description(schema, root, steps) if not steps or isinstance(steps[-1], str) else ""
        quotes = "; quote it" if kind == "string_type" and isinstance(node, Scalar) else ""
        return Explanation(
            steps, f"expected {EXPECTED[kind]}, found {describe(value)}{quotes}{note}"
        )
    if kind in ("too_short", "too_long", "string_too_short"):
        return Explanation(steps, _wrong_length(root, steps, schema))
    if kind in COMPARISONS:
        bound, word = COMPARISONS[kind]
        return Explanation(
            steps, f"{describe(value)} is out of range; give one {word} {context[bound]}"
        )
    if kind == "finite_number":
        return Explanation(steps, f"{describe(value)} is not finite; give a finite number")
    if kind == "string_pattern_mismatch":
        return Explanation(steps, f"{describe(value)} holds a control character; remove it")
    if kind == "value_error":
        return Explanation(steps, str(context["error"]))
    return Explanation(steps, error["msg"][:1].lower() + error["msg"][1:])


def _unknown_key(steps: Steps, root: Node, schema: Schema) -> Explanation:
    used = written_keys(root, *steps[:-1])
    forms = _schemas_at(schema, root, steps[:-1])
    # Of several forms those are meant that have most of the keys they need.
    needed = [len({*form.get("required", ())}.intersection(used)) for form in forms]
    keys = [
        key
        for form, count in zip(forms, needed, strict=True)
        if count == max(needed)
        for key in form.get("properties", form.get("propertyNames", {}).get("enum", ()))
        if key != steps[-1]
    ]
    free = [key for key in dict.fromkeys(keys) if key not in used]
    # The file may also have the key that was misspelt.
    advice = hint(str(steps[-1]), keys)
    advice = advice if advice.startswith("did") else hint(str(steps[-1]), free or keys)
    if "standard_uncertainty" in free and str(steps[-1]).casefold() in NOT_STANDARD:
        advice = (
            "uncertainties are standard ones, U / k of an expanded uncertainty U; give U / k as"
            " standard_uncertainty"
        )
    return Explanation(steps, f"unknown key; {advice}", of_key=True)


def _across(plane: str) -> str:
    """Return the axis normal to a plane of two axes; empty for other texts.

    >>> _across("xy"), _across("Z-X"), _across("xx")
    ('z', 'y', '')
    """
    axes = re.fullmatch("([xyz])[ /-]?([xyz])", plane.strip().casefold())
    normals = {"x", "y", "z"}.difference(axes.groups() if axes else ())
    return normals.pop() if len(normals) == 1 else ""


def _wrong_literal(value: Any, meanings: AnyMapping[str, str]) -> str:
    allowed = list(meanings)
    if isinstance(value, str):
        suggestion = hint(value, meanings)
        suggestion = "" if suggestion.startswith("known") else f"{suggestion} "
        if not suggestion:
            allowed = [
                f"{name} ({meaning})" if meaning else name for name, meaning in meanings.items()
            ]
        return f'unknown value "{shorten(value)}"; {suggestion}allowed: {listing(allowed, 12)}'
    return f"expected one of: {listing(allowed, 12)}; found {describe(value)}"


def _wrong_length(root: Node, steps: Steps, schema: Schema) -> str:
    node = written(root, *steps)
    if isinstance(node, Scalar):
        return "empty; give a text"
    items = getattr(node, "items", ())
    bounds = [
        (
            part.get("minItems", part.get("minProperties", 0)),
            part.get("maxItems", part.get("maxProperties")),
        )
        for part in _schemas_at(schema, root, steps)
        if part.get("type") == ("array" if isinstance(node, Sequence) else "object")
    ]
    lower, upper = bounds[0] if bounds else (1, None)
    if not items and upper is None:
        return "empty; give at least one entry" + _description(schema, root, steps)
    number = (
        str(lower)
        if lower == upper
        else f"at least {lower}"
        if upper is None
        else f"{lower} to {upper}"
    )
    if upper is not None and upper == lower + 1:
        number = f"{lower} or {upper}"
    plural = "entry" if len(items) == 1 else "entries"
    return f"has {len(items)} {plural}; {number} are needed{_description(schema, root, steps)}"


def _description(schema: Schema, root: Node, steps: Steps) -> str:
    for part in _schemas_at(schema, root, steps, expanded=False):
        # The description of a whole class is its docstring, written for another reader.
        if "description" in part and "properties" not in part:
            return f" ({part['description'].rstrip('.')})"
    return ""


def _allowed(schema: Schema, root: Node, steps: Steps) -> dict[str, str]:
    """Return the values allowed at a path, with their meanings if the schema has them."""
    allowed: dict[str, str] = {}
    for part in _schemas_at(schema, root, steps, any_kind=True):
        values = part.get("enum", [part["const"]] if "const" in part else [])
        meanings = part.get("enumDescriptions", [""] * len(values))
        allowed |= dict(zip(map(str, values), meanings, strict=True))
    return allowed


def _schemas_at(
    schema: Schema, root: Node, steps: Steps, expanded: bool = True, any_kind: bool = False
) -> list[Schema]:
    """Return the schemas that apply at a path, without those of other kinds."""
    matches: list[Schema] = [schema]
    node: Node | None = root
    for step in steps:
        parts = [
            part
            for branch in matches
            for part in _expand(branch, schema, None if any_kind else node)
        ]
        matches = [below for part in parts for below in _below(part, step)]
        node = child(node, step)
    if not expanded:
        return matches
    return [
        part for branch in matches for part in _expand(branch, schema, None if any_kind else node)
    ]


# The JSON schema, and not the classes, tells what would have been allowed: it has the kinds of
# extensions as well. Of a union of kinds only the one that the file names is followed, unless all
# are asked for, so that advice is not about another.
def _expand(part: Schema, schema: Schema, node: Node | None) -> Iterator[Schema]:
    if "$ref" in part:
        yield from _expand(schema["$defs"][part["$ref"].removeprefix("#/$defs/")], schema, node)
        return
    for choice in (*part.get("anyOf", ()), *part.get("oneOf", ())):
        yield from _expand(choice, schema, node)
    kind = part.get("properties", {}).get("kind", {}).get("const")
    if kind is None or node is None or _kind(node) in (None, kind):
        yield part


def _below(part: Schema, step: str | int) -> Iterator[Schema]:
    if isinstance(step, str):
        if step in part.get("properties", {}):
            yield part["properties"][step]
        elif isinstance(part.get("additionalProperties"), dict):
            yield part["additionalProperties"]
    elif step < len(part.get("prefixItems", ())):
        yield part["prefixItems"][step]
    elif isinstance(part.get("items"), dict):
        yield part["items"]
