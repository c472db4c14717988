"""How well influence quantities will be known, against the dense covariance."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ballplate.presentation.formatting import amount_of, number
from ballplate.results.prediction import check, predict
from ballplate.simulator.experiment.layout import lay_out

from tests.extensions.influences import wording
from tests.extensions.influences.campaigns import Real, dense_spread, file_with

PROBING = {"kind": "probing", "standard_uncertainty": "0.4 um", "between_probes": "0.2 um"}


def along_styli(design: Any, x: Real, e: Any) -> Any:
    """Balls are found farther along the styli, by what all have and what each has."""
    offsets = design.probes.offsets
    styli = offsets / np.linalg.norm(offsets, axis=1, keepdims=True)
    probe = design.readings.probe
    return (e[0] + e[1 + probe])[:, None] * styli[probe]


@pytest.mark.parametrize("is_known", [True, False])
def test_uncertainties_are_those_of_the_dense_covariance(tmp_path: Path, is_known: bool) -> None:
    stated = PROBING if is_known else {k: v for k, v in PROBING.items() if "standard" not in k}
    experiment = file_with(tmp_path, [stated])
    design, found = lay_out(experiment), predict(experiment)
    of_all = np.array([4e-7 if is_known else np.inf, *[2e-7] * len(design.probes.names)])
    spread, _ = dense_spread(design, along_styli, of_all)
    assert spread.deficiency == 0
    p = len(of_all)
    expected = np.sqrt(np.diag(spread.covariance)[-p:])
    assert [one.predicted for one in found.influences] == pytest.approx(expected, rel=1e-6)
    assert [one.stated for one in found.influences] == pytest.approx(of_all)
    data = json.loads(json.dumps(found.to_dict()["influences"], allow_nan=False))
    assert len(data) == p
    for one, u in zip(found.influences, expected, strict=True):
        assert data[one.name]["standard_uncertainty"] == pytest.approx(u, rel=1e-6)
        value, unit = amount_of(float(u), "m")
        (line,) = [line for line in found.lines() if line.startswith(f"{one.name}  ")]
        assert line.split()[-2:] == [number(value, 3), unit]
    first = next(line for line in found.lines() if line.startswith("probing error  "))
    assert ("unknown" in first) != is_known
    assert (data["probing error"]["stated_standard_uncertainty"] is None) != is_known


def test_what_is_undetermined_has_a_dash(tmp_path: Path) -> None:
    """Scales at one temperature throughout show their expansion as a scale error."""
    told = {
        "kind": "temperature",
        "scale_expansion": {"value": "8 um/m/K"},
        "scale_temperature": {"value": "22 degC"},
    }
    found = predict(file_with(tmp_path, [told]))
    named = {one.name: one for one in found.influences}
    assert np.isnan(named["expansion of the scales"].predicted)
    own = found.to_dict()["influences"]["expansion of the scales"]
    assert own["standard_uncertainty"] is None
    (line,) = [one for one in found.lines() if one.startswith("expansion of the scales  ")]
    assert line.split()[-3:] == ["unknown", "-", "ppm/K"]


def test_it_is_there_for_influences_alone_and_for_run_alone(tmp_path: Path) -> None:
    assert "influences" not in predict(file_with(tmp_path, None)).to_dict()
    assert not check(file_with(tmp_path, [PROBING])).influences


def test_thousands_are_counted(tmp_path: Path) -> None:
    each = {"kind": "reproducibility", "each": ["position", "ball"]}
    found = predict(file_with(tmp_path, [each | {"standard_uncertainty": "0.1 um"}]))
    assert len(found.influences) == len(found.to_dict()["influences"]) == 54 * 3
    assert any(f"({54 * 3 - 30} more are in --json)" in one for one in found.lines())


def test_plates_whose_balls_have_the_same_names_have_displacements_of_their_own(
    tmp_path: Path,
) -> None:
    """As if the balls of the second plate had other names."""
    each = {"kind": "reproducibility", "each": ["ball"], "standard_uncertainty": "0.2 um"}
    grid = {"kind": "grid", "balls": [2, 2], "size": ["400 mm", "400 mm"]}
    places = {"a": [0, 0], "b": [400, 0], "c": [0, 400], "d": [400, 400]}
    renamed = {name: [f"{x} mm", f"{y} mm", "0 mm"] for name, (x, y) in places.items()}
    corner = {"x": "100 mm", "y": "100 mm"}
    place = {"plane": "z", "corner": corner, "probes": ["down"]}
    positions = [
        place
        | {"name": f"{plate} {turn}", "level": level, "artefact": plate, "quarter_turns": turn}
        for plate, level in (("one", "200 mm"), ("two", "600 mm"))
        for turn in (0, 1)
    ]
    for one in positions[2:]:
        one["corner"] = {"x": "300 mm", "y": "200 mm"}
    positions[0]["repeats"] = 2
    known = [
        {"kind": "distances", "artefact": "one", "pairs": "all", "standard_uncertainty": "0.2 um"}
    ]
    beside: dict[str, Any] = {"positions": positions, "calibration": known}
    beside["error_model"] = {"kind": "metric"}
    of_names = [
        predict(file_with(tmp_path, [each], **beside, artefacts={"one": grid, "two": second}))
        for second in (grid, {"kind": "balls", "coordinates": renamed})
    ]
    same, other = (found.to_dict()["quantities"] for found in of_names)
    assert same["U5"]["average"] == pytest.approx(other["U5"]["average"], rel=1e-9)
    names = [one.name for one in of_names[0].influences]
    assert len(set(names)) == 2 * 4 * 3
    assert wording.DISPLACEMENT_OF_BALL in names
