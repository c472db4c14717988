"""The JSON Schema of experiment files, for editors that complete and check while the file is written."""

from __future__ import annotations

from typing import Any

from .sections import ExperimentSettings

DRAFT = "https://json-schema.org/draft/2020-12/schema"


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of an experiment file."""
    tidied: dict[str, Any] = _tidied(ExperimentSettings.model_json_schema())
    # Variants may supply what the file itself leaves out, which no schema can tell.
    required = tidied.pop("required")
    tidied["anyOf"] = [{"required": ["variants"]}, {"required": required}]
    return {"$schema": DRAFT, **tidied, "title": "ballplate experiment"}


def _tidied(part: Any) -> Any:
    """Leave out what serves programs only: titles, OpenAPI's discriminators, null for an omitted key."""
    if isinstance(part, list):
        return [_tidied(item) for item in part]
    if not isinstance(part, dict):
        return part
    tidied: dict[str, Any] = {}
    for key, value in part.items():
        if key in ("properties", "$defs"):
            tidied[key] = {name: _tidied(below) for name, below in value.items()}
        elif key == "title" or key == "discriminator" or (key == "default" and not _is_writable(value, part)):
            continue
        else:
            tidied[key] = _tidied(value)
    choices: list[Any] = tidied.get("anyOf", [])
    if {"type": "null"} in choices:
        choices = [choice for choice in choices if choice != {"type": "null"}]
        tidied["anyOf"] = choices
    if len(choices) == 1:
        del tidied["anyOf"]
        tidied = {**choices[0], **tidied}
    # Whole numbers serve as names too.
    if isinstance(tidied.get("items"), dict) and tidied["items"] == {"minLength": 1, "type": "string"}:
        tidied["items"] = {"minLength": 1, "type": ["string", "integer"]}
    return tidied


def _is_writable(default: Any, part: dict[str, Any]) -> bool:
    """Tell whether a default could stand in the file: not null, nor the metres behind a text like 0 mm."""
    return default is not None and not (isinstance(default, float) and part.get("type") == "string")
