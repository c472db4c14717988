"""What a map does not contain is said where it is used: scales that nothing was compared with."""

from __future__ import annotations

import ballplate as bp
import numpy as np
import pytest
from ballplate.designs import shipped

POINTS = np.array([[0.0, 0.0, 0.0], [0.5, 0.5, 0.5]])


@pytest.fixture(scope="module")
def fitted():
    return bp.fit(bp.quickstart(), bp.simulate(bp.quickstart())).to_map()


def test_lengths_by_the_machines_own_scales_are_told_as_such(fitted) -> None:
    own = bp.load(shipped("certified/two-dimensions.yaml"))
    told = bp.correct(bp.fit(own, bp.simulate(own)).to_map(), [[0.0, 0.0], [0.3, 0.0]]).warnings
    assert any("machine's own scales" in one for one in told)
    assert not any("own scales" in one for one in bp.correct(fitted, POINTS).warnings)
