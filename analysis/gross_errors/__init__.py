"""Reliability in the sense of Baarda: biases of observations that a test finds, and the effects
of those that it does not find.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs.faces import lazily

# Public names of this package: extensions import these alone, and its modules are private.
if TYPE_CHECKING:
    from .bias_patterns import DRIFTS, Patterns, patterns, single_kinds
    from .cause_search import FAMILY
    from .events import event_groups
    from .exact_values import diagnosis_of_all
    from .names import name
    from .refits import diagnosis_with_refits
    from .remainders import Columns, Leftover, columns_of_balls, leftover, too_many_entries
    from .wording import diagnosis_words, refit_words, suspect_words

__getattr__, __dir__ = lazily(__name__, __file__)
