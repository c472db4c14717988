"""Public names of a package, each loaded from its module on first use (PEP 562).

Extensions import from packages such as `ballplate.simulator.design`, whose modules are private. So
that a command loads only the modules that it needs, a package imports them later: the imports under
`if TYPE_CHECKING:` serve as the table of public names.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any


@cache
def public_names(file: str) -> dict[str, str]:
    """Return the public names of the package whose `__init__.py` is `file`, with their modules."""
    body = ast.parse(Path(file).read_text(encoding="utf-8")).body
    [imports] = [
        statement.body
        for statement in body
        if isinstance(statement, ast.If)
        and isinstance(statement.test, ast.Name)
        and statement.test.id == "TYPE_CHECKING"
    ]
    return {
        name.name: f"{statement.module}"
        for statement in imports
        if isinstance(statement, ast.ImportFrom)
        for name in statement.names
    }


def lazily(package: str, file: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return `__getattr__` and `__dir__` of a package, from its `__name__` and `__file__`."""

    def load(name: str) -> Any:
        module = None if name.startswith("__") else public_names(file).get(name)
        if module is None:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(f".{module}", package), name)
        setattr(sys.modules[package], name, value)
        return value

    return load, lambda: sorted(public_names(file))
