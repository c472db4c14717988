"""Descriptions in JSON Schemas."""

from __future__ import annotations

from typing import Any


def description(schema: dict[str, Any], value: dict[str, Any]) -> str:
    """Description of a key's `value`, or of the definition that it refers to: that of a key that an
    extension provides.
    """
    if "description" in value or "$ref" not in value:
        return str(value.get("description", ""))
    return str(schema["$defs"][value["$ref"].rpartition("/")[2]].get("description", ""))
