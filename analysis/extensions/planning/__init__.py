"""Planning: positions chosen from a pool, their order, and the design as a file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs import lazily

# Public names of this package: other extensions import these alone.
if TYPE_CHECKING:
    from .campaign_choice import Request, campaign
    from .constraints import HOUR, Budget, Constraints
    from .criteria import DESCRIPTIONS, criterion
    from .information import Frames, pool_information
    from .pools import seconds_of
    from .remaining_candidates import Offer, offer
    from .room_lengths import in_lengths
    from .run_sheet_tables import price, sheet_data, sheet_lines, summary, times
    from .schedule import RunSheet, Step, run_sheet, steps_of
    from .search import Losses, SelectionProblem
    from .selection import Campaign
    from .set_ups import REST, SetUp, base_name, position_of, renamed
    from .short_names import names_of_plan

__getattr__, __dir__ = lazily(__name__, __file__)
