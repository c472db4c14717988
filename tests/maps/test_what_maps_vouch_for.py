"""What a map does not contain is said wherever it is used: a conversion's residual, and scales that
nothing was compared with.
"""

from __future__ import annotations

from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.designs import shipped

from tests.maps import wording

POINTS = np.array([[0.0, 0.0, 0.0], [0.5, 0.5, 0.5]])
POORER = "{kind: kinematic, position_coefficients: 2, rotation_coefficients: 2}"
RICHER = "{kind: kinematic, position_coefficients: 7, rotation_coefficients: 7}"


@pytest.fixture(scope="module")
def fitted():
    return bp.fit(bp.quickstart(), bp.simulate(bp.quickstart())).to_map()


def test_a_poorer_model_says_by_how_much_it_differs(fitted, tmp_path: Path) -> None:
    converted = bp.convert(fitted, POORER)
    bp.write_map(converted.map, tmp_path / "poorer.yaml")
    read = bp.load_map(tmp_path / "poorer.yaml")
    assert read.conversion_residual == pytest.approx(converted.residual[0])
    assert converted.residual[0] > 5e-6
    told = bp.correct(read, POINTS).warnings
    assert any(wording.WHICH_DOES_NOT_CONTAIN in one for one in told)
    # Converted again it still says so, once.
    again = bp.convert(read, POORER).map
    assert [one.kind for one in again.left_out].count("conversion") == 1


def test_a_richer_model_is_no_prior(fitted, tmp_path: Path) -> None:
    bp.write_map(bp.convert(fitted, RICHER).map, tmp_path / "richer.yaml")
    changes = {
        "error_model.position_coefficients": 7,
        "error_model.rotation_coefficients": 7,
        "priors": [{"kind": "map", "file": str(tmp_path / "richer.yaml")}],
    }
    with pytest.raises(bp.ExperimentError, match=wording.WAS_CONVERTED_FROM_ANOTHER_ERROR_MODEL):
        bp.quickstart().with_(changes)


def test_lengths_by_the_machines_own_scales_are_told_as_such(fitted) -> None:
    own = bp.load(shipped("certified/two-dimensions.yaml"))
    told = bp.correct(bp.fit(own, bp.simulate(own)).to_map(), [[0.0, 0.0], [0.3, 0.0]]).warnings
    assert any("machine's own scales" in one for one in told)
    assert not any("own scales" in one for one in bp.correct(fitted, POINTS).warnings)
