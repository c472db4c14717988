"""Monte Carlo: repeated estimates of synthetic readings, compared with linearised uncertainties."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ballplate.simulator.inputs.faces import lazily

# Public names of this package: extensions import these alone, and its modules are private.
if TYPE_CHECKING:
    from .accumulator import Accumulator, QuantityAccumulator
    from .experiments import Trials, block_of_trials, combined, trials
    from .figures import MonteCarloEstimate, MonteCarloOutcome
    from .trial_runs import MOST_TRIALS

__getattr__, __dir__ = lazily(__name__, __file__)
