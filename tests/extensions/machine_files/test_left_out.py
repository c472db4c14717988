"""What a map holds of a fit and what it leaves out: nothing that was estimated vanishes silently."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
from ballplate.cli import main
from ballplate.designs import shipped

from tests.reference.small_quickstart import small_quickstart

TEMPERATURE = {
    "kind": "temperature",
    "artefact_expansion": {"value": "11.5 um/m/K", "standard_uncertainty": "0.6 um/m/K"},
    "artefact_temperature": {"value": "21.5 degC", "standard_uncertainty": "50 mK"},
    "scale_expansion": {"value": "8 um/m/K", "standard_uncertainty": "0.3 um/m/K"},
    "scale_temperature": {"value": "21 degC", "sensor_uncertainty": "30 mK"},
    "positions": {"z high": {"scales": "24 degC"}},
}


def with_influences(*influences: Any) -> bp.Experiment:
    return bp.quickstart().with_({"influences": list(influences)})


def test_every_estimate_is_held_or_left_out_by_name(tmp_path: Path) -> None:
    experiment = with_influences(TEMPERATURE).with_(
        {"probes.right": {"offset": ["50 mm", "0 mm", "0 mm"], "standard_uncertainty": "5 um"}}
    )
    fit = bp.fit(experiment, bp.simulate(experiment))
    fitted = fit.to_map()
    kinds = {one.kind for one in fit.estimates}
    # Poses and balls are those of the campaign's artefacts; a standard's length would be, too.
    assert kinds == {"machine", "offset", "influence", "origin", "rotation", "ball"}
    held = [one.name for one in fitted.parameters]
    assert held == [one.name for one in fit.estimates if one.kind in ("machine", "offset")]
    out = {one.name: one for one in fitted.left_out}
    influences = [one for one in fit.estimates if one.kind == "influence"]
    assert len(influences) >= 3 and list(out) == [one.name for one in influences]
    for one in influences:
        assert out[one.name].value == one.value and out[one.name].unit == one.unit
        assert out[one.name].standard_uncertainty == one.standard_uncertainty
    bp.write_map(fitted, tmp_path / "map.yaml")
    assert bp.load_map(tmp_path / "map.yaml").left_out == fitted.left_out
    # Five positions at 21 degC and one at 24.
    assert fitted.temperatures == {
        "reference": 20.0,
        "scales": pytest.approx(21.5),
        "artefact": 21.5,
    }


def test_lengths_by_the_machines_own_scales_are_told_as_such() -> None:
    """Which nothing was compared with."""
    for experiment, is_told in (
        (bp.load(shipped("certified/two-dimensions.yaml")), True),
        (small_quickstart(), False),
    ):
        fitted = bp.fit(experiment, bp.simulate(experiment)).to_map()
        points = np.zeros((2, experiment.dimension))
        points[1] = 0.3
        told = bp.correct(fitted, points).warnings
        assert any("machine's own scales" in one for one in told) == is_told


@pytest.mark.long
def test_the_marginal_of_the_machine_counts_what_is_left_out() -> None:
    """Uncertainties of the map are those beside the estimated influences, not with these held."""
    experiment = with_influences(TEMPERATURE)
    readings = bp.simulate(experiment)
    exact = {
        key: {"value": one["value"], "standard_uncertainty": "0 um/m/K"}
        if key.endswith("expansion")
        else {"value": one["value"]}
        for key, one in TEMPERATURE.items()
        if key not in ("kind", "positions")
    }
    held = TEMPERATURE | exact
    free, fixed = (
        bp.fit(with_influences(one), readings, sigma="given").to_map()
        for one in (TEMPERATURE, held)
    )
    assert not fixed.left_out and free.left_out
    ends = [[0.1, 0.5, 0.5], [0.9, 0.5, 0.5]]
    wide, narrow = (bp.correct(one, ends, lengths=[(0, 1)]).lengths[0] for one in (free, fixed))
    # The scale's expansion by 1.5 K over 0.8 m: 0.36 um besides.
    assert wide.standard_uncertainty > narrow.standard_uncertainty + 0.1e-6


def test_users_of_the_map_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    experiment = with_influences(TEMPERATURE)
    fit = bp.fit(experiment, bp.simulate(experiment))
    fitted = fit.to_map()
    bp.write_map(fitted, tmp_path / "map.yaml")
    (tmp_path / "points.csv").write_text("x_mm,y_mm,z_mm\n100,200,300\n")
    assert main(["correct", str(tmp_path / "map.yaml"), str(tmp_path / "points.csv")]) == 0
    captured = capsys.readouterr()
    count = len(fitted.left_out)
    assert f"{count} parameters of influence quantities that the fit estimated are not applied" in (
        captured.err
    )
    assert fitted.left_out[0].name in captured.err
    told = "temperatures of the campaign: reference 20 °C, scales 21.5 °C, artefact 21.5 °C"
    assert told in captured.out
    assert np.isfinite(fitted.covariance).all()
