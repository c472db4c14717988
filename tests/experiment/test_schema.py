"""The JSON Schema has every key, with a description, and nothing else is allowed."""

import json
from collections.abc import Iterator
from functools import cache
from typing import Any

from ballplate.simulator.experiment import json_schema
from ballplate.simulator.experiment.sections import ExperimentSettings

from tests.reference.schemas import description

schema = cache(json_schema.schema)


def parts(part: Any) -> Iterator[dict[str, Any]]:
    if isinstance(part, dict):
        yield part
        for below in part.values():
            yield from parts(below)
    elif isinstance(part, list):
        for below in part:
            yield from parts(below)


def test_it_is_a_plain_schema_of_the_right_draft() -> None:
    written = schema()
    assert written["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert json.loads(json.dumps(written)) == written
    for part in parts(written):
        assert "discriminator" not in part
        assert part.get("type") != "null"
        if "$ref" in part:
            assert part["$ref"].removeprefix("#/$defs/") in written["$defs"]


def test_sections_are_closed_and_described() -> None:
    written = schema()
    for name, section in {"": written, **written["$defs"]}.items():
        assert section["additionalProperties"] is False, name
        for key, value in section["properties"].items():
            assert description(written, value), (name, key)


def test_variants_take_any_value_and_may_complete_the_file() -> None:
    written = schema()
    variants = written["properties"]["variants"]
    assert variants["type"] == "object"
    assert variants["additionalProperties"]["additionalProperties"] is True
    assert {"required": ["variants"]} in written["anyOf"]
    assert {"required": ["title", "machine", "error_model", "artefacts", "positions"]} in written[
        "anyOf"
    ]
    assert {"required": ["title", "machine", "error_model", "artefacts", "pool"]} in written[
        "anyOf"
    ]


def test_defaults_can_be_written_in_a_file() -> None:
    for part in parts(schema()):
        if "default" in part and isinstance(part.get("type"), str):
            types = {"string": str, "integer": int, "number": float, "array": list, "object": dict}
            types["boolean"] = bool
            assert isinstance(part["default"], types[part["type"]])


def test_the_keys_of_the_file() -> None:
    of_extensions = {"assumptions", "part"}
    assert set(schema()["properties"]) == set(ExperimentSettings.model_fields) | of_extensions
