"""Defaults of the metric that depend on the number of dimensions."""

from __future__ import annotations

from pathlib import Path

import pytest
from ballplate.extensions.sweeps.fingerprint import fingerprint
from ballplate.simulator.experiment.loading import load


@pytest.mark.parametrize(
    ("file", "model", "stated"),
    [
        (
            "designs/hurt_foss/bar-bell.yaml",
            "error_model: {kind: metric}",
            "error_model: {kind: metric, scale: each}",
        ),
        (
            "designs/hocken_borchardt/real.yaml",
            "    error_model.scale: none\n",
            "    error_model: {kind: metric}\n",
        ),
    ],
)
def test_a_default_that_is_stated_is_the_same_experiment(
    tmp_path: Path, file: str, model: str, stated: str
) -> None:
    text = Path(file).read_text(encoding="utf-8")
    assert model in text
    (tmp_path / "one.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "other.yaml").write_text(text.replace(model, stated), encoding="utf-8")
    one, other = (
        [fingerprint(found) for found in load(tmp_path / name)]
        for name in ("one.yaml", "other.yaml")
    )
    assert one == other
