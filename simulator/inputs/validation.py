"""Validation of a tree against settings."""

from __future__ import annotations

from functools import cache
from typing import Any, TypeVar, cast

from pydantic import TypeAdapter, ValidationError

from .messages import Steps
from .problems import Problems
from .wording import explain
from .yamltree import Node, to_python

T = TypeVar("T")


def validated(kind: type[T], root: Node, problems: Problems) -> T | None:
    """Return the settings of a type that a tree states, or None after adding messages."""
    adapter = type_adapter(cast(Any, kind))
    try:
        settings: T = adapter.validate_python(to_python(root))
        return settings
    except ValidationError as error:
        explain_in(problems, error, adapter, root)
        return None


def explain_in(
    problems: Problems,
    error: ValidationError,
    adapter: TypeAdapter[Any],
    node: Node,
    steps: Steps = (),
) -> None:
    """Add messages about a node at a path."""
    for explanation in explain(error.errors(include_url=False), node, _schema(adapter)):
        problems.add((*steps, *explanation.steps), explanation.text, explanation.of_key)


@cache
def type_adapter(kind: Any) -> TypeAdapter[Any]:
    """Return the validator of a type of settings, made once."""
    return TypeAdapter(kind)


@cache
def _schema(adapter: TypeAdapter[Any]) -> dict[str, Any]:
    return adapter.json_schema()
