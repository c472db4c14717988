"""Temperature of artefacts and scales against what is written down beside the program: the
physical model with all its products, in dense computations and in simulated campaigns.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from ballplate.cli import main
from ballplate.rank.verdicts import verdict
from ballplate.results.estimator_choice import fit_readings
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.estimation.functions import linear_functions
from ballplate.simulator.estimation.gauss_newton import estimate
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.readings.observed_readings import observe
from ballplate.simulator.readings.reading_files import read_readings, write_readings
from ballplate.simulator.readings.simulated import simulated_readings
from ballplate.uncertainty.quantities import QUANTITIES

from tests.extensions.influences import wording
from tests.extensions.influences.campaigns import dense_spread, file_with, nominal_arms

TOP = Path(__file__).parents[3]

PLATE = {"value": 11.5e-6, "u": 0.6e-6}
SCALE = {"value": 8e-6, "u": 0.3e-6}
# Above 20 degC, in the six positions; uncertainties of each, and of a sensor, in K.
PLATES, SCALES = [1.5, 1.2, 1.8, 1.5, 1.5, 1.5], [0.8, 0.5, 0.8, 0.8, 1.1, 0.8]
EACH, SENSOR = 0.05, 0.03
STATED = {
    "kind": "temperature",
    "artefact_expansion": {"value": "11.5 um/m/K", "standard_uncertainty": "0.6 um/m/K"},
    "artefact_temperature": {
        "value": "21.5 degC",
        "standard_uncertainty": "50 mK",
        "sensor_uncertainty": "30 mK",
    },
    "scale_expansion": {"value": "8 ppm/K", "standard_uncertainty": "0.3 um/m/degC"},
    "scale_temperature": {
        "value": "20.8 degC",
        "standard_uncertainty": "50 mK",
        "sensor_uncertainty": "30 mK",
    },
    "positions": {
        "z high": {"artefact": "21.2 degC", "scales": "20.5 degC"},
        "x low": {"artefact": "21.8 degC"},
        "y low": {"scales": "21.1 degC"},
    },
}


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Experiment:
    return file_with(tmp_path_factory.mktemp("drawn"), [STATED])


def test_the_parameters_are_those_stated(drawn: Experiment) -> None:
    found = [(p.name, p.unit, p.value, p.uncertainty) for p in lay_out(drawn).influence_parameters]
    places = ["z low", "z high", "x low", "x high", "y low", "y high"]
    assert found == [
        ("expansion of plate", "1/K", 11.5e-6, 0.6e-6),
        (wording.SENSOR_ERROR_OF_PLATE, "K", 0.0, SENSOR),
        *((f"temperature error of plate in {place}", "K", 0.0, EACH) for place in places),
        (wording.EXPANSION_OF_THE_SCALES, "1/K", 8e-6, 0.3e-6),
        (wording.SENSOR_ERROR_OF_THE_SCALES, "K", 0.0, SENSOR),
        *((f"temperature error of the scales in {place}", "K", 0.0, EACH) for place in places),
    ]
    assert lay_out(drawn).parameter_count == len(linearise(lay_out(drawn)).layout) + 27


# The parameters in their order: expansion, sensor and six temperatures, of plate and of scales.
EXPECTED = np.array([PLATE["value"], 0.0, *[0.0] * 6, SCALE["value"], 0.0, *[0.0] * 6])
SPREAD = np.array([PLATE["u"], SENSOR, *[EACH] * 6, SCALE["u"], SENSOR, *[EACH] * 6])


def expanded(arms: Any, x: Any, position: Any, e: Any) -> Any:
    """What the temperatures add to locations, by the law itself, with parameters e (16,)."""
    of_plate = e[0] * (np.array(PLATES)[position] + e[1] + e[2:8][position])
    of_scales = e[8] * (np.array(SCALES)[position] + e[9] + e[10:][position])
    return of_plate[:, None] * arms - of_scales[:, None] * x


def law(design: Design, x: Any, e: Any) -> Any:
    """What they add where balls are as stated, with parameters e (16,) beside their values."""
    return expanded(nominal_arms(design), x, design.readings.position, EXPECTED + e)


def test_a_distance_is_as_uncertain_as_its_plate_expands(tmp_path: Path) -> None:
    """On a perfect machine whose scale is known, L u(b) t is all that is left of a distance."""
    temperature = {
        "kind": "temperature",
        "artefact_expansion": {"value": "10 um/m/K", "standard_uncertainty": "1 um/m/K"},
        "artefact_temperature": {"value": "23 degC"},
    }
    told = {
        "machine": {"volume": ["1 m", "1 m", "1 m"], "repeatability": "1e-3 nm"},
        "calibration": [],
        "priors": [
            {"parameter": name, "standard_uncertainty": "1e-3 nm"}
            for name in ("EXX", "EYX", "EZX", "EXY", "EYY", "EZY", "EXZ", "EYZ", "EZZ")
        ],
    }
    design = lay_out(file_with(tmp_path, [temperature], **told))
    at = linearise(design)
    (functions,) = QUANTITIES["U5"].functions(design, at.layout)
    first, second = np.triu_indices(9, 1)
    length = np.linalg.norm(design.balls.places[first] - design.balls.places[second], axis=1)
    np.testing.assert_allclose(
        at.uncertainty(linear_functions(at, functions)), length * 3.0 * 1e-6, rtol=1e-3
    )


def as_told(change: dict[str, Any], folder: Path) -> Experiment:
    """The statement with some keys changed; None leaves a key out."""
    told = {key: value for key, value in (STATED | change).items() if value is not None}
    return file_with(folder, [told])


# The values without their uncertainties.
EXACT = {
    "artefact_expansion": {"value": "11.5 um/m/K", "standard_uncertainty": "0 um/m/K"},
    "artefact_temperature": {"value": "21.5 degC"},
    "scale_expansion": {"value": "8 um/m/K", "standard_uncertainty": "0 um/m/K"},
    "scale_temperature": {"value": "20.8 degC"},
}
UNKNOWN = {
    "artefact_expansion": {"value": "11.5 um/m/K"},
    "artefact_temperature": {"value": "21.5 degC"},
    "scale_expansion": {"value": "8 um/m/K"},
    "scale_temperature": {"value": "20.8 degC"},
}


@pytest.mark.parametrize(
    ("places", "deficiency"),
    [
        # A scale that is wrong by one ratio everywhere is a machine error like that.
        ({}, 1),
        ({"x low": {"artefact": "21.8 degC"}}, 1),
        ({"x low": {"scales": "21.1 degC"}}, 0),
        # What is just at the reference temperature does not expand.
        ({place: {"artefact": "20 degC", "scales": "20 degC"} for place in "zxy"}, 2),
    ],
)
def test_the_verdict_tells_what_cannot_be_told_apart(
    tmp_path: Path, places: dict[str, Any], deficiency: int
) -> None:
    if "z" in places:
        places = {f"{one} {level}": place for one, place in places.items() for level in HIGH_LOW}
    design = lay_out(as_told(UNKNOWN | {"positions": places}, tmp_path))
    found = verdict(linearise(design))
    assert found.deficiency == deficiency
    # The same of the law, in a dense computation.
    plates, scales = (
        np.array([20.0 + part.differences[k] for k in range(6)]) - 20.0
        for part in design.influences[0].parts  # type: ignore[attr-defined]
    )

    def expansions(of: Design, x: Any, e: Any) -> Any:
        place = of.readings.position[:, None]
        return e[0] * plates[place] * nominal_arms(of) - e[1] * scales[place] * x

    assert dense_spread(design, expansions, np.full(2, np.inf))[0].deficiency == deficiency
    told = "; ".join(map(str, found.null))
    assert (wording.EXPANSION_OF_THE_SCALES in told) == (deficiency > 0)
    assert ("expansion of plate" in told) == (deficiency > 1)


HIGH_LOW = ("low", "high")


def test_temperatures_of_readings_are_those_of_their_positions(
    drawn: Experiment, tmp_path: Path
) -> None:
    """Temperatures in the file are the same as those of positions that are stated so."""
    simulated = simulated_readings(drawn, seed=4)
    with (tmp_path / "plain.csv").open("w", encoding="utf-8", newline="") as stream:
        write_readings(stream, simulated.design, simulated.readings, simulated.x)
    lines = (tmp_path / "plain.csv").read_text(encoding="utf-8").splitlines()
    place = simulated.readings.position
    told = [f"{lines[0]},temperature_artefact_degC,temperature_scales_degC"] + [
        f"{line},{20 + PLATES[k]},{20 + SCALES[k]}"
        for line, k in zip(lines[1:], place, strict=True)
    ]
    (tmp_path / "told.csv").write_text("\n".join(told) + "\n", encoding="utf-8")
    anywhere = {"artefact_temperature", "scale_temperature"}
    other = as_told(
        {key: STATED[key] | {"value": "24 degC"} for key in anywhere} | {"positions": None},
        tmp_path,
    )
    one, same, wrong = (
        estimate(observed.design, observed.x).state
        for observed in (
            read_readings(tmp_path / "plain.csv", lay_out(drawn)),
            read_readings(tmp_path / "told.csv", lay_out(other)),
            read_readings(tmp_path / "plain.csv", lay_out(other)),
        )
    )
    np.testing.assert_allclose(same.balls, one.balls, rtol=0, atol=1e-12)
    np.testing.assert_allclose(same.influences, one.influences, rtol=0, atol=1e-12)
    assert np.abs(wrong.balls - one.balls).max() > 1e-8


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"artefact_temperature": None}, "artefact_expansion and artefact_temperature go together"),
        ({"positions": {"z lwo": {"scales": "21 degC"}}}, 'did you mean "z low"?'),
        ({"artefact": "plat"}, 'did you mean "plate"?'),
        ({"scale_temperature": {"value": ["21 degC", "20 degC"]}}, "has 2 axes, but"),
        (
            {"artefact_temperature": {"value": ["21 degC", "20 degC", "20 degC"]}},
            "an artefact has no axes",
        ),
        (
            {"scale_temperature": {"value": "21 degC", "standard_uncertainty": "-50 mK"}},
            "is below zero",
        ),
        ({"artefact_temperature": {"value": "294 K"}}, "is no temperature"),
        ({"scale_expansion": {"value": "8 um"}}, "is a length; a thermal expansion is expected"),
        (
            {
                "artefact_expansion": None,
                "artefact_temperature": None,
                "scale_expansion": None,
                "scale_temperature": None,
                "positions": None,
            },
            "nothing expands",
        ),
        (
            {"positions": {"z low": {"artefact": "21 degC", "scales": ["21 degC"] * 3}}},
            "positions[z low].scales: has one temperature for each axis, and other positions one for",
        ),
        (
            {
                "scale_temperature": {"value": ["21 degC"] * 3},
                "positions": {"z low": {"scales": "21 degC"}},
            },
            "has one temperature for all axes, and other positions one for each; state all in the",
        ),
    ],
)
def test_what_is_wrong_is_told_at_its_place(
    tmp_path: Path, change: dict[str, Any], expected: str
) -> None:
    with pytest.raises(ExperimentError) as caught:
        as_told(change, tmp_path)
    assert expected in str(caught.value) and "influences[0]" in str(caught.value)


def test_length_standards_are_refused(tmp_path: Path) -> None:
    told = yaml.safe_load((TOP / "designs" / "quickstart.yaml").read_text(encoding="utf-8"))
    bar = {"kind": "two_spheres", "length": "500 mm", "role": "length_standard"}
    places = [one | {"artefact": "plate"} for one in told["positions"]]
    bars = {"name": "bar", "artefact": "bar", "plane": "z", "level": "300 mm", "probes": ["down"]}
    bars |= {"corner": {"x": "100 mm", "y": "100 mm"}}
    told |= {"positions": [*places, bars], "influences": [STATED]}
    told["artefacts"]["bar"] = bar
    told["calibration"] = [told["calibration"][0] | {"artefact": "plate"}]
    (tmp_path / "bar.yaml").write_text(yaml.safe_dump(told), encoding="utf-8")
    with pytest.raises(ExperimentError, match='"bar" is a length standard'):
        load(tmp_path / "bar.yaml")


def test_other_estimators_refuse(drawn: Experiment) -> None:
    simulated = simulated_readings(drawn)
    observed = observe(simulated.design, simulated.readings, simulated.x)
    for estimator in ("distances", "reversal", "length-equations"):
        with pytest.raises(ExperimentError, match=wording.DOES_NOT_KNOW_INFLUENCE_QUANTITIES):
            fit_readings(drawn, observed, estimator)


def test_the_file_of_a_plan_has_temperatures_of_its_positions(tmp_path: Path) -> None:
    file_with(tmp_path, [STATED])
    told = yaml.safe_load((tmp_path / "file.yaml").read_text(encoding="utf-8"))
    told["pool"] = {"candidates": told.pop("positions")}
    (tmp_path / "pool.yaml").write_text(yaml.safe_dump(told), encoding="utf-8")
    command = ["plan", str(tmp_path / "pool.yaml"), "--positions", "3", "-q"]
    main([*command, "-o", str(tmp_path / "chosen.yaml")])
    (chosen,) = load(tmp_path / "chosen.yaml")
    names = [one.name for one in chosen.positions]
    (item,) = yaml.safe_load((tmp_path / "chosen.yaml").read_text(encoding="utf-8"))["influences"]
    assert item.get("positions", {}) == {
        name: at for name, at in STATED["positions"].items() if name in names
    }
