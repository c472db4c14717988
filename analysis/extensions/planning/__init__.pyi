# Public names of this package, each loaded from its module when it is first used.
from .campaign_choice import Request as Request, campaign as campaign
from .constraints import (
    HOUR as HOUR,
    Budget as Budget,
    Constraints as Constraints,
    Spent as Spent,
    with_chosen as with_chosen,
)
from .criteria import DESCRIPTIONS as DESCRIPTIONS, criterion as criterion
from .information import Frames as Frames, pool_information as pool_information
from .own_cost import settings_as_drawn as settings_as_drawn, spent_as_drawn as spent_as_drawn
from .pools import seconds_of as seconds_of
from .remaining_candidates import Offer as Offer, offer as offer
from .room_lengths import in_lengths as in_lengths
from .run_sheet_tables import (
    price as price,
    sheet_data as sheet_data,
    sheet_lines as sheet_lines,
    summary as summary,
    times as times,
)
from .schedule import (
    RunSheet as RunSheet,
    Step as Step,
    run_sheet as run_sheet,
    steps_of as steps_of,
)
from .search import Losses as Losses, SelectionProblem as SelectionProblem
from .selection import Campaign as Campaign
from .set_ups import (
    REST as REST,
    SetUp as SetUp,
    base_name as base_name,
    position_of as position_of,
    renamed as renamed,
)
from .short_names import names_of_plan as names_of_plan
