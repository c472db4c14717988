"""Keys of cells that stores hold stay valid: the fingerprints of shipped designs are those of
earlier versions.

A fingerprint that has to change means that all stores are computed anew: then the number of the
method rises with it.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from ballplate.extensions.sweeps.fingerprint import METHOD, fingerprint
from ballplate.simulator.experiment.loading import load

KEPT = [
    ("quickstart.yaml", "quickstart", "9cce15c3e7bebae2bfb31f6733a7fd4ae6c88151"),
    ("npl/6.1.1.yaml", "6.1.1[B]", "a5208313a57c127131205ebe5cb1a564f817f9f2"),
    ("npl/6.2.5.yaml", "6.2.5[n=5 NDEL=5]", "9df3395e9ad26ce79e60821532715427f59e7a47"),
    ("npl/5.3.yaml", "5.3[empirical fit]", "178497e70d875eda46d69c07cc550eaf69591ecc"),
    ("park/plate.yaml", "plate", "f54163fb5d72db3120769349c7a54e720bf858d5"),
    (
        "hocken_borchardt/dummy.yaml",
        "dummy[with scale]",
        "18a645280019e629b2393eb21817db311fd1304e",
    ),
]


@pytest.mark.parametrize(("file", "label", "kept"), KEPT)
def test_fingerprints_are_those_of_earlier_versions(file: str, label: str, kept: str) -> None:
    assert METHOD == 4
    found = {one.label: fingerprint(one) for one in load(Path("designs", file))}
    assert found[label] == kept


def test_offsets_that_are_estimated_keep_their_keys(tmp_path: Path) -> None:
    text = Path("designs/quickstart.yaml").read_text(encoding="utf-8")
    for name, old, known in (
        ("right", "[50 mm, 0 mm, 0 mm]", "unknown: true"),
        ("left", "[-50 mm, 0 mm, 0 mm]", "standard_uncertainty: 3 um"),
    ):
        assert f"{name}: {old}" in text
        text = text.replace(f"{name}: {old}", f"{name}: {{offset: {old}, {known}}}")
    (tmp_path / "plate.yaml").write_text(text, encoding="utf-8")
    kept = "f5e0993b067b5d08a77c2478653adb6195baf134"
    assert fingerprint(load(tmp_path / "plate.yaml")[0]) == kept
    # How the laboratory's tables are read says nothing of what is planned.
    more = "\nreadings: {coordinates: ball centres}\n"
    (tmp_path / "plate.yaml").write_text(text + more, encoding="utf-8")
    assert fingerprint(load(tmp_path / "plate.yaml")[0]) == kept
