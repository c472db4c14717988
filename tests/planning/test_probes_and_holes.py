"""Plans with stars, re-indexed heads and holes: what a plan adds up is what a full computation of
the chosen design gives.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from ballplate.planning.search import value
from ballplate.results.study import predict
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Position
from ballplate.simulator.experiment.pool import with_chosen

from .small_pool import TEXT
from .test_information import problem_of, selections, written

BASE: dict[str, Any] = yaml.safe_load(TEXT)
SIDES = {"kind": "distances", "pairs": "corner sides", "standard_uncertainty": "0.8 um"}
POOL = BASE["pool"]
# Influence quantities are of plates only.
WITHOUT_BAR: dict[str, Any] = {
    "artefacts": {"plate": BASE["artefacts"]["plate"]},
    "calibration": [SIDES],
    "pool": {**POOL, "candidates": [one for one in POOL["candidates"] if one["name"] != "bar"]},
}
CHANGES: dict[str, dict[str, Any]] = {
    "star": {"stars": [{"standard_uncertainty": "0.2 um"}]},
    "star elsewhere": {"stars": [{"standard_uncertainty": "0.2 um", "place": "unknown"}]},
    "re-indexing": {
        **WITHOUT_BAR,
        "influences": [{"kind": "re-indexing", "standard_uncertainty": "0.7 um"}],
    },
    "holes": {
        "artefacts": {
            name: {**one, "reads": "in plane", "flatness": "3 um"}
            if one.get("role", "plate") == "plate"
            else one
            for name, one in BASE["artefacts"].items()
        }
    },
}


@pytest.mark.parametrize("name", CHANGES)
def test_equal_to_the_full_computation(tmp_path: Path, name: str) -> None:
    text = yaml.safe_dump({**BASE, **CHANGES[name]}, sort_keys=False)
    (experiment,) = load(written(tmp_path, text), planning=True)
    assert experiment.pool is not None
    problem, compared = problem_of(experiment, "U6"), 0
    for chosen in selections(experiment, 12, 7, 3):
        items = [experiment.pool.candidates[k] for k in chosen]
        if not any(isinstance(one.item, Position) for one in items):
            continue
        full, found = predict(with_chosen(experiment, items)), value(problem, chosen)
        assert np.isfinite(found) == (full.verdict.deficiency == 0)
        if np.isfinite(found):
            compared += 1
            assert found == pytest.approx(full.quantities["U6"].average, rel=1e-8)
    assert compared > 2
