"""An error model that an extension provides, one ratio of all scales."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import ballplate as bp
import pytest

from tests.reference.installed_extension import install, said_with
from tests.reference.model_options import estimate

SCRIPT = """
import json, sys
import ballplate as bp
found = {}
for given in sys.argv[1:]:
    design = bp.experiment(json.loads(given))
    planned = bp.run(design, trials=20, workers=1)
    fitted = bp.fit(design, bp.simulate(design, exact=True))
    [scale] = [one for one in fitted.estimates if one.kind == "machine"]
    found[str(design.dimension)] = {
        "deficiency": planned.verdict.deficiency,
        "U3": planned.quantities["U3"].maximum,
        "U6": [planned.quantities["U6"].maximum, planned.quantities["U6"].average],
        "failed": len(planned.monte_carlo.outcome.failed),
        "scale": [scale.name, scale.value],
    }
print(json.dumps(found))
"""


def experiment(dimension: int) -> dict[str, Any]:
    return {
        "title": "one scale",
        "machine": {"volume": ["600 mm"] * dimension, "repeatability": "0.5 um"},
        "error_model": {"kind": "stretched"},
        "true_machine": {"kind": "coefficients", "values": {"scale": "12 ppm"}},
        "probes": {"tip": ["0 mm"] * dimension},
        "artefacts": {"plate": {"kind": "grid", "balls": [3, 3], "size": ["300 mm", "200 mm"]}},
        "positions": [
            {"name": name, "corner": {"x": x, "y": "100 mm"}}
            | ({"plane": "z", "level": "100 mm"} if dimension == 3 else {})
            for name, x in (("left", "100 mm"), ("right", "250 mm"))
        ],
        "calibration": [
            {"kind": "distances", "pairs": "corners", "standard_uncertainty": "0.3 um"}
        ],
        "evaluation": {"points": {"random": 10, "seed": 2}, "probe": "tip"},
        "expected_rank_deficiency": 0,
    }


def test_an_error_model_of_an_extension(tmp_path: Path) -> None:
    said = said_with(install(tmp_path), SCRIPT, *(json.dumps(experiment(d)) for d in (2, 3)))
    for dimension in (2, 3):
        # The design of the package itself, with another error model: its readings are the same.
        other = {"error_model": {"kind": "metric"}, "true_machine": {"kind": "zero"}}
        own = bp.run(bp.experiment(experiment(dimension) | other))
        found, of_copy = estimate(own.design, [lambda x, p: x]), said[str(dimension)]
        assert of_copy["deficiency"] == found.deficiency == 0
        assert of_copy["U3"] == pytest.approx(found.of_columns[0], rel=1e-7)
        expected = [found.lengths.max(), found.lengths.mean()]
        assert of_copy["U6"] == pytest.approx(expected, rel=1e-7)
        assert of_copy["failed"] == 0
        assert of_copy["scale"] == ["scale", pytest.approx(12e-6, rel=1e-6)]
