"""Plain data written as YAML."""

from __future__ import annotations

from math import inf
from typing import Any, ClassVar

import yaml

from .yamltree import resolve_scalar


class PlainDumper(yaml.SafeDumper):
    """Writer without aliases that quotes texts with another meaning under YAML 1.1 or 1.2."""

    quote: ClassVar[str] = "'"

    def ignore_aliases(self, data: Any) -> bool:
        return True

    def represent_text(self, text: str) -> yaml.ScalarNode:
        try:
            is_text = resolve_scalar(text) is text
        except ValueError:
            is_text = False
        style = None if is_text else self.quote
        return self.represent_scalar("tag:yaml.org,2002:str", text, style=style)


PlainDumper.add_representer(str, PlainDumper.represent_text)


def yaml_text(
    data: Any,
    flow_style: bool | None = False,
    width: float = inf,
    dumper: type[PlainDumper] = PlainDumper,
) -> str:
    """Return plain data as YAML: in blocks, in one line (`flow_style` true), or with the innermost
    lists and mappings in one line each if nothing there is quoted (None), in lines of `width`.

    >>> print(yaml_text({"probes": ["down", "up"], "name": "1e-3"}, None), end="")
    probes: [down, up]
    name: '1e-3'
    """
    text: str = yaml.dump(
        data,
        Dumper=dumper,
        default_flow_style=flow_style,
        sort_keys=False,
        allow_unicode=True,
        width=width,
    )
    return text
