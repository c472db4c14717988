"""Null directions of a design, and their description."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs.faces import lazily

# Public names of this package: extensions import these alone, and its modules are private.
if TYPE_CHECKING:
    from .directions import Direction, length, moved_positions
    from .verdicts import Verdict, null_changes, rank_complaint, verdict, weak_changes

__getattr__, __dir__ = lazily(__name__, __file__)
