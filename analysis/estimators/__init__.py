"""Alternative estimators: of distances, by reversal, by length equations."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs.faces import lazily

# Public names of this package: extensions import these alone, and its modules are private.
if TYPE_CHECKING:
    from .distances import compare_estimators

__getattr__, __dir__ = lazily(__name__, __file__)
