"""The JSON Schema of experiment files, for editors that complete and check while the file is
written.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from ballplate.simulator.inputs.extensions import MissingExtensionError, names, provided
from pydantic import create_model

from .sections import ExperimentSettings

DRAFT = "https://json-schema.org/draft/2020-12/schema"


def schema() -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of an experiment file, without what extensions provide
    that are not installed.
    """
    keys: dict[str, Any] = {}
    for key in names("sections", with_registered=True):
        with suppress(MissingExtensionError):
            keys[key] = (provided("sections", key, "SETTINGS"), None)
    settings = ExperimentSettings
    if keys:
        about = ExperimentSettings.__doc__
        settings = create_model("Experiment", __base__=ExperimentSettings, __doc__=about, **keys)
    document: dict[str, Any] = tidied(settings.model_json_schema())
    # Variants may supply what the file itself leaves out, which no schema can tell.
    required = document.pop("required")
    # Positions may be chosen from a pool.
    pooled = [key if key != "positions" else "pool" for key in required]
    document["anyOf"] = [{"required": ["variants"]}, {"required": required}, {"required": pooled}]
    return {"$schema": DRAFT, **document, "title": "ballplate experiment"}


def tidied(part: Any) -> Any:
    """Return a schema without entries for programs: titles, discriminators, null for omitted
    keys.
    """
    if isinstance(part, list):
        return [tidied(item) for item in part]
    if not isinstance(part, dict):
        return part
    tidy: dict[str, Any] = {}
    for key, value in part.items():
        if key in ("properties", "$defs"):
            tidy[key] = {name: tidied(below) for name, below in value.items()}
        elif (
            key == "title"
            or key == "discriminator"
            or (key == "default" and not _is_writable(value, part))
        ):
            continue
        elif key == "description" and isinstance(value, str):
            # Docstrings have line ends.
            tidy[key] = " ".join(value.split())
        else:
            tidy[key] = tidied(value)
    choices: list[Any] = tidy.get("anyOf", [])
    if {"type": "null"} in choices:
        choices = [choice for choice in choices if choice != {"type": "null"}]
        tidy["anyOf"] = choices
    if len(choices) == 1:
        del tidy["anyOf"]
        tidy = {**choices[0], **tidy}
    # Whole numbers serve as names too.
    if isinstance(tidy.get("items"), dict) and tidy["items"] == {
        "minLength": 1,
        "type": "string",
    }:
        tidy["items"] = {"minLength": 1, "type": ["string", "integer"]}
    return tidy


def _is_writable(default: Any, part: dict[str, Any]) -> bool:
    """True if a default could stand in the file: not null, nor the metres behind a text like
    0 mm.
    """
    return default is not None and not (isinstance(default, float) and part.get("type") == "string")
