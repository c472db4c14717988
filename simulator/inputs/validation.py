"""Validation of a tree against the settings that it should state."""

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
    """The settings of a kind that a tree states, or None after saying what is wrong with it."""
    adapter = type_adapter(cast(Any, kind))
    try:
        found: T = adapter.validate_python(to_python(root))
        return found
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
    """Add what is wrong with a node, which stands at a path."""
    for one in explain(error.errors(include_url=False), node, _schema(adapter)):
        problems.add((*steps, *one.steps), one.text, one.of_key)


@cache
def type_adapter(kind: Any) -> TypeAdapter[Any]:
    """What validates a kind of settings, made once."""
    return TypeAdapter(kind)


@cache
def _schema(adapter: TypeAdapter[Any]) -> dict[str, Any]:
    return adapter.json_schema()
