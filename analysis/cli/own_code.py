"""Errors in code of the person's own, which a command was given."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from ballplate.simulator.inputs.own_code import own_frame, told

from .outputs import inputs


def told_of_own_code(error: BaseException, options: Namespace) -> str:
    """Where an error arose in a module that a file of the command names, or one that is installed,
    and which; empty where it did not.
    """
    frame = own_frame(error)
    if frame is None:
        return ""
    path = Path(frame.filename)
    named = {one.resolve() for one in inputs(options, set())}
    if path.resolve() not in named and "site-packages" not in path.parts:
        return ""
    place = f"{frame.filename}:{frame.lineno}: in {frame.name}, code of your own"
    return f"{place}: {told(error, None)}"
