"""Alternative estimators, and how far they are from the full one: of distances, by reversal, by
length equations.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs import lazily

# Public names of this package: other extensions import these alone.
if TYPE_CHECKING:
    from .distances import compare_estimators

__getattr__, __dir__ = lazily(__name__, __file__)
