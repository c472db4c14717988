"""Assumptions of a prediction from Python."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.arguments import PathLike, experiment_of
from ballplate.simulator.experiment import Experiment

if TYPE_CHECKING:
    from .effects import Assumptions


def assumptions(experiment: Experiment | PathLike) -> Assumptions:
    """Return what the prediction of an experiment takes for granted, and U6 without each
    assumption, as `run --assumptions` prints it.

    :raises ValueError: the experiment has no two evaluation points, or U6 is undetermined or zero.

    >>> import ballplate as bp
    >>> [effect.assumption.name for effect in bp.assumptions(bp.quickstart()).effects[:2]]
    ['chain', 'temperature']
    """
    from .effects import predicted_assumptions

    return predicted_assumptions(experiment_of(experiment))
