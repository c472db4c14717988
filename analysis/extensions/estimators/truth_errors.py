"""Bias and standard deviation of estimators against the true machine, over synthetic data sets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ballplate.simulator.machines import Array


@dataclass(frozen=True)
class TruthErrors:
    """Errors of the distances that an estimator corrects, over data sets, in metres.

    `bias` is the root mean square over pairs of points of the mean error, `scatter` that of the
    standard deviation, `rms` that of all errors. `chance` is the expected `bias` of an unbiased
    estimator, and `rms_error` the standard error of `rms`.
    """

    bias: float
    scatter: float
    rms: float
    chance: float
    rms_error: float

    @property
    def is_biased(self) -> bool:
        """Whether the bias is significant: beyond three times its chance level."""
        return self.bias > 3.0 * self.chance


def truth_errors(errors: Array) -> TruthErrors:
    """Return statistics of errors (t, p) of p distances in t data sets, at least two."""
    count = len(errors)
    squares = (errors**2).mean(axis=1)
    rms = float(np.sqrt(squares.mean()))
    scatter = float(np.sqrt(errors.var(axis=0, ddof=1).mean()))
    return TruthErrors(
        float(np.sqrt((errors.mean(axis=0) ** 2).mean())),
        scatter,
        rms,
        scatter / float(np.sqrt(count)),
        float(squares.std(ddof=1) / np.sqrt(count) / (2.0 * rms)) if rms > 0.0 else 0.0,
    )
