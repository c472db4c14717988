"""The error model of docs/how-to/extend.md, one file and one line, in a copy of the package."""

from __future__ import annotations

import json
from pathlib import Path

import ballplate as bp
import pytest

from tests.reference.model_options import estimate
from tests.reference.package_copies import documented, package_copy, said_by_copy

SCRIPT = """
import json, sys
import ballplate as bp
design = bp.experiment(json.loads(sys.argv[1]))
planned = bp.run(design, trials=20, workers=1)
fitted = bp.fit(design, bp.simulate(design, exact=True))
[scale] = [one for one in fitted.estimates if one.kind == "machine"]
print(json.dumps({
    "deficiency": planned.verdict.deficiency,
    "U3": planned.quantities["U3"].maximum,
    "U6": [planned.quantities["U6"].maximum, planned.quantities["U6"].average],
    "failed": len(planned.monte_carlo.outcome.failed),
    "scale": [scale.name, scale.value],
}))
"""


@pytest.mark.parametrize("dimension", [2, 3])
def test_one_file_and_one_line_make_an_error_model(tmp_path: Path, dimension: int) -> None:
    package = package_copy(tmp_path)
    machines = package / "simulator" / "machines"
    file, entry = documented("**An error model**")
    (machines / "stretched.py").write_text(file, encoding="utf-8")
    settings = (machines / "settings.py").read_text(encoding="utf-8")
    imported, line = entry.strip().split("\n\n")
    after, before = "from .spatial_metric import", "    KINEMATIC,\n"
    assert after in settings and before in settings
    settings = settings.replace(after, f"{imported}\n{after}")
    settings = settings.replace(before, f"{before}{line}\n")
    (machines / "settings.py").write_text(settings, encoding="utf-8")
    given = {
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
    said = said_by_copy(tmp_path, SCRIPT, json.dumps(given))
    # The design of the package itself, with any error model: its readings are the same.
    own = bp.run(bp.experiment(given | {"error_model": {"kind": "metric"}, "true_machine": {
        "kind": "zero"}}))  # fmt: skip
    found = estimate(own.design, [lambda x, p: x])
    assert said["deficiency"] == found.deficiency == 0
    assert said["U3"] == pytest.approx(found.of_columns[0], rel=1e-7)
    assert said["U6"] == pytest.approx([found.lengths.max(), found.lengths.mean()], rel=1e-7)
    assert said["failed"] == 0
    assert said["scale"] == ["scale", pytest.approx(12e-6, rel=1e-6)]
