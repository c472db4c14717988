"""Usual kinds of machine, their axes and tips: the tables of `tables.yaml`."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import Any

import yaml
from ballplate.simulator.machines import ARRANGEMENTS


@cache
def table(name: str) -> dict[str, Any]:
    """Return a table of `tables.yaml`."""
    text = files(__package__).joinpath("tables.yaml").read_text(encoding="utf-8")
    found: dict[str, Any] = yaml.safe_load(text)[name]
    return found


def machine_kind(text: str) -> str:
    """Return the name of a kind of machine, or of an arrangement.

    :raises ValueError: neither; names all.

    >>> machine_kind("Moving-bridge"), machine_kind("cx1")
    ('moving bridge', 'CX1')
    """
    return known("type of machine", text.replace("-", " "), [*table("kinds"), *ARRANGEMENTS])


def known(noun: str, text: str, names: list[str]) -> str:
    """Return the one of some names that a text has in any case.

    :raises ValueError: none; names all.
    """
    found = [name for name in names if name.lower() == text.strip().lower()]
    if not found:
        raise ValueError(f'unknown {noun} "{text}"; choose from {", ".join(names)}')
    return found[0]


def arrangement_of(kind: str, volume: tuple[float, ...]) -> str:
    """Return the name of the arrangement of a machine with this volume.

    >>> arrangement_of("gantry", (2.0, 3.0, 1.0)), arrangement_of("gantry", (3.0, 2.0, 1.0))
    ('MB1', 'MB2')
    """
    names: list[str] = table("kinds").get(kind, [kind])
    return names[-1] if volume[0] > volume[1] else names[0]


def chain_words(name: str, axes: str = "xyz") -> str:
    """Return which of some axes of an arrangement carries which.

    >>> chain_words("MB1"), chain_words("FB1")
    ('y carries x carries z', 'x carries z; y carries the workpiece')
    >>> chain_words("CX1", "xy")
    'x carries y carries the workpiece'
    """
    chain = ARRANGEMENTS[name]
    probe, workpiece = (
        " carries ".join(axis for axis in side if axis in axes)
        for side in (chain.probe_side, chain.workpiece_side)
    )
    return "; ".join(filter(None, [probe, workpiece and f"{workpiece} carries the workpiece"]))
