"""Temperatures, expansions and uncertainties that no laboratory has are doubted at their places."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ballplate as bp
import pytest
from ballplate.simulator.experiment.model import Experiment

from tests.extensions.influences.campaigns import file_with

PLAUSIBLE: dict[str, Any] = {
    "kind": "temperature",
    "artefact_expansion": {"value": "11.5 um/m/K", "standard_uncertainty": "0.6 um/m/K"},
    "artefact_temperature": {"value": "21.5 degC", "standard_uncertainty": "50 mK"},
    "scale_expansion": {"value": "8 um/m/K", "standard_uncertainty": "0.3 um/m/K"},
    "scale_temperature": {"value": ["20.8 degC", "21 degC", "20 degC"]},
}


def told(folder: Path, path: tuple[Any, ...], value: Any) -> Experiment:
    stated = {key: dict(one) if isinstance(one, dict) else one for key, one in PLAUSIBLE.items()}
    inner: Any = stated
    for key in path[:-1]:
        inner = inner.setdefault(key, {})
    inner[path[-1]] = value
    return file_with(folder, [stated])


@pytest.mark.parametrize(
    ("path", "value", "where", "words"),
    [
        (("artefact_temperature", "value"), "215 degC", "", "is 215 degC"),
        (("artefact_temperature", "value"), "-51 degC", "", "is -51 degC"),
        (("reference",), "293 degC", "", "is 293 degC"),
        (("scale_temperature", "value"), ["20 degC", "210 degC", "20 degC"], "[1]", "is 210 degC"),
        (("positions", "z low"), {"artefact": "150 degC"}, "].artefact", "is 150 degC"),
        (("artefact_expansion", "value"), "1150 um/m/K", "", "is 1150 um/m/K, more than 100"),
        (("scale_expansion", "standard_uncertainty"), "101 um/m/K", "", "is 101 um/m/K"),
        (("artefact_temperature", "standard_uncertainty"), "50 K", "", "is 50 K, more than 10 K"),
        (("scale_temperature", "sensor_uncertainty"), "11 K", "", "is 11 K"),
    ],
)
def test_what_is_implausible_is_named(
    tmp_path: Path, path: tuple[str, ...], value: Any, where: str, words: str
) -> None:
    (doubt,) = told(tmp_path, path, value).doubts
    assert f"{path[-1]}{where}: {words}" in doubt
    assert words in doubt and "influences[0]" in doubt and path[0] in doubt


@pytest.mark.parametrize("value", ["-50 degC", "100 degC", "20 degC"])
def test_the_limits_themselves_are_not_doubted(tmp_path: Path, value: str) -> None:
    assert told(tmp_path, ("artefact_temperature", "value"), value).doubts == ()
    found = told(tmp_path, ("artefact_expansion", "value"), "100 um/m/K")
    assert found.doubts == ()


def test_a_column_of_temperatures_that_is_not_used_is_told_what_uses_it(tmp_path: Path) -> None:
    experiment = file_with(tmp_path, None)
    table = bp.simulate(experiment, seed=3)
    path = tmp_path / "readings.csv"
    for name, is_told in (("remark", False), ("temperature_artefact_degC", True)):
        table.assign(**{name: 21.5}).to_csv(path, index=False)
        said = " ".join(bp.fit(experiment, path).observed.table_notes)
        assert f'not used: "{name}"' in said
        assert ("kind: temperature" in said) == is_told
