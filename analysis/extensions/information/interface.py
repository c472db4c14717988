"""Information of positions from Python."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ballplate.arguments import PathLike, experiment_of
from ballplate.simulator.experiment import Experiment

if TYPE_CHECKING:
    from .position_information import PositionInformation


def information(
    experiment: Experiment | PathLike, added: Sequence[Experiment] = ()
) -> PositionInformation:
    """Return how much of each error's information goes with each position of an experiment, as `run
    --errors` prints it.

    `added` are the same experiment with a further position each, last: candidates, whose columns
    have the information that they would add.

    >>> import ballplate as bp
    >>> bp.information(bp.quickstart()).headline()
    'U6 0.143 µm, without x high 0.290 µm'
    """
    from ballplate.results import check

    from .position_information import position_information

    return position_information(check(experiment_of(experiment)), added)
