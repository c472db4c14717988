"""Public names of a package, each loaded from the module that has it when it is first used.

A package such as `ballplate.simulator.design` is read by extensions; its modules are private. So
that a command loads only what it needs, no package imports its modules by itself (PEP 562).
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Any


def lazily(
    package: str, places: Mapping[str, Sequence[str]]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """`__getattr__` and `__dir__` of a package, with its public names by the module that has them.

    >>> load, names = lazily("ballplate.simulator.inputs", {"quantities": ["Target"]})
    >>> names(), load("Target").__name__
    (['Target'], 'Target')
    """
    modules = {name: module for module, names in places.items() for name in names}

    def load(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(f".{modules[name]}", package), name)
        setattr(sys.modules[package], name, value)
        return value

    return load, lambda: sorted(modules)
