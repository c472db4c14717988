"""Planning: positions chosen from a pool, their order, the design as a file, and its repair."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs.faces import lazily

# Public names of this package: extensions import these alone, and its modules are private.
if TYPE_CHECKING:
    from .campaign_choice import Request, campaign
    from .checked_files import (
        CheckedDesign,
        CheckedFile,
        Wanted,
        advised,
        check_files,
        checked_design,
    )
    from .choice import Gain, Selection
    from .constraints import HOUR, Budget, Spent
    from .criteria import DESCRIPTIONS
    from .positions_read import groups_taken
    from .run_sheet_tables import price, sheet_data, sheet_lines, summary, times
    from .schedule import RunSheet, Step, ball_words, change_over, place_words

__getattr__, __dir__ = lazily(__name__, __file__)
