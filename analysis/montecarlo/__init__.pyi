# Public names of this package, each loaded from its module when it is first used.
from .accumulator import Accumulator as Accumulator, QuantityAccumulator as QuantityAccumulator
from .experiments import (
    MOST_TRIALS as MOST_TRIALS,
    Trials as Trials,
    block_of_trials as block_of_trials,
    combined as combined,
    trials as trials,
)
from .figures import (
    MonteCarloEstimate as MonteCarloEstimate,
    MonteCarloOutcome as MonteCarloOutcome,
)
