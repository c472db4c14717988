"""Maps of fits, written and read again: every number to the bit, for every kind of error model."""

from __future__ import annotations

from pathlib import Path

import ballplate as bp
import numpy as np
import pytest

from tests.extensions.machine_files.kinds import MODELS, fit_of, write_files


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("maps")
    write_files(found)
    return found


@pytest.mark.parametrize("kind", MODELS)
def test_a_map_is_read_as_it_was_written(kind: str, folder: Path) -> None:
    fitted = fit_of(kind, folder).to_map("2026-11-22")
    # In another folder, from which files of models are found, too.
    path = folder / "below" / "map.yaml"
    path.parent.mkdir(exist_ok=True)
    bp.write_map(fitted, path)
    again = bp.load_map(path)
    for attribute in (
        "values",
        "covariance",
        "undetermined",
        "repeatability",
        "estimates",
        "scale",
    ):
        assert np.array_equal(getattr(again, attribute), getattr(fitted, attribute)), attribute
    assert np.array_equal(again.probes.offsets, fitted.probes.offsets)
    assert np.array_equal(again.probes.free, fitted.probes.free)
    assert again.volume.corners == fitted.volume.corners
    assert again.parameters == fitted.parameters
    for attribute in [
        *("title", "sigma", "sigma_is_estimated", "degrees_of_freedom", "coverage_factor"),
        *("frame", "temperatures", "left_out", "data", "experiment", "program", "date", "probe"),
    ]:
        assert getattr(again, attribute) == getattr(fitted, attribute), attribute
    before = path.read_bytes()
    bp.write_map(again, path)
    assert path.read_bytes() == before
