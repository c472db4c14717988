"""A map is compared with its update: the fit of new readings with that map as prior knowledge."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ballplate as bp
from ballplate.extensions.maps.map_difference import MapDifference
from ballplate.simulator.experiment.model import Experiment
from scipy.stats import chi2

from tests.extensions.maps import wording
from tests.reference.small_quickstart import small_quickstart


def estimated(experiment: Experiment, seed: int) -> Any:
    return bp.fit(experiment, bp.simulate(experiment, seed))


def updated(path: Path, changed: dict[str, Any], seed: int) -> Any:
    """The fit of another campaign, on what may be another machine, that knows the map of a file."""
    readings = bp.simulate(small_quickstart().with_(changed), seed)
    known = small_quickstart().with_({"priors": [{"kind": "map", "file": str(path)}]})
    return bp.fit(known, readings)


def written(folder: Path, seed: int) -> Path:
    path = folder / f"{seed}.yaml"
    bp.write_map(estimated(small_quickstart(), seed).to_map(), path)
    return path


def test_readings_in_common_hide_changes_and_make_none(tmp_path: Path) -> None:
    """With twice the information the update has half the covariance C. Its difference from the
    first has C - C / 2, of which independent campaigns, C + C / 2, have three times as much.
    """
    total, dimensions = 0.0, 0
    for seed in (11, 12, 13):
        first = written(tmp_path, seed)
        found = bp.diff(first, updated(first, {}, seed + 50), grid=2)
        test = found.comparison.test
        assert test is not None and found.is_changed is None
        assert wording.READINGS_IN_COMMON_MAY_HIDE in found.headline()
        assert wording.NO_CHANGE_IS_SHOWN not in str(found)
        total, dimensions = total + 3.0 * test.statistic, dimensions + test.dimensions
    assert 1e-4 < chi2.cdf(total, dimensions) < 1.0 - 1e-4


def test_an_update_that_differs_shows_a_change(tmp_path: Path) -> None:
    first = written(tmp_path, 1)
    later = updated(first, {"true_machine.seed": 8}, 3)
    bp.write_map(later.to_map(), tmp_path / "later.yaml")
    for second in (later, tmp_path / "later.yaml"):
        found: MapDifference = bp.diff(first, second, grid=2)
        assert found.is_changed is True and found.to_dict()["readings_in_common"] == "some"
        assert found.notes[-1].startswith(wording.READINGS_ARE_THE_SAME_IN_BOTH)
        assert wording.BOTH_REST_ON_SOME in str(found)
        assert not found.to_dict()["same_readings"]
    # So do the new readings alone, of which there is no doubt.
    other = small_quickstart().with_({"true_machine.seed": 8})
    alone: Any = bp.fit(small_quickstart(), bp.simulate(other, 3))
    assert bp.diff(first, alone, grid=2).is_changed is True
