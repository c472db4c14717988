"""What nothing determines is refused, and never counted as determined."""

from __future__ import annotations

from dataclasses import dataclass, replace

import ballplate as bp
import numpy as np
import pytest
from ballplate.simulator.design import Calibration, CovarianceRoot, Observations, Priors
from ballplate.simulator.estimation import estimate
from ballplate.simulator.inputs.extensions import UnusableError


def test_a_ball_that_is_not_read_is_refused() -> None:
    design = bp.lay_out(bp.quickstart())
    label = design.ball_label(3)
    unread = replace(design, readings=design.readings.select(design.readings.ball != 3))
    with pytest.raises(UnusableError, match=f"ball {label} has fewer readings than co-ordinates"):
        assert bp.linearise(unread).rank
    with pytest.raises(UnusableError, match=f"ball {label} has"):
        estimate(unread, np.zeros((len(unread.readings), 3)))
    kept = np.flatnonzero(design.readings.ball == 3)[:1]
    once = replace(
        design,
        readings=design.readings.select(
            np.union1d(np.flatnonzero(design.readings.ball != 3), kept)
        ),
    )
    assert bp.linearise(once).deficiency == 0


@dataclass(frozen=True)
class OfTheMachine(Calibration):
    """Values of the machine that a certificate states with their covariance."""

    values: np.ndarray
    root: CovarianceRoot | None
    artefact: str = ""
    kind: str = "of the machine"

    def observed(self, first: int) -> Observations:
        none = np.zeros(0, np.int64)
        return Priors((), none, none, none, np.zeros((0, 69)), np.zeros(0), np.zeros(0), none)


def test_correlated_values_of_the_machine_are_not_dropped() -> None:
    root = CovarianceRoot(np.ones(2), np.eye(2), np.ones(2))
    experiment = replace(bp.quickstart(), calibration=(OfTheMachine(np.ones(2), root),))
    with pytest.raises(UnusableError, match="values of the machine cannot be correlated"):
        bp.lay_out(experiment)
