"""Drift of the reference point and of the scales against what is written down beside the program:
the law itself, in dense computations and in simulated campaigns.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from ballplate.rank.verdicts import verdict
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.estimation.gauss_newton import estimate
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.model import Experiment
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.readings.reading_files import read_readings, write_readings
from ballplate.simulator.readings.simulated import simulated_readings

from tests.extensions.influences import wording
from tests.extensions.influences.campaigns import Real, dense_spread, file_with, told_on_page
from tests.reference import dense

# Seconds: set-up, reading, change of probe.
SET_UP, READING, CHANGE = 1800.0, 20.0, 90.0
TIMES = {"set_up": "30 min", "reading": "20 s", "probe_change": "90 s"}
POINT, SCALE = 2e-6, 1e-6
SPREAD = np.array([POINT, POINT, POINT, SCALE])
STATED = {
    "kind": "drift",
    "axes": {"standard_uncertainty": "2 um/h"},
    "scale": {"standard_uncertainty": "1 ppm/h"},
    "times": TIMES,
}


def hours(design: Design) -> Real:
    """When readings are made, one after the other, from their mean on."""
    clock, middles, before = 0.0, [], (-1, -1)
    readings = design.readings
    for position, probe, repeats in zip(
        readings.position, readings.probe, readings.repeats, strict=True
    ):
        if position != before[0]:
            clock += SET_UP
        elif probe != before[1]:
            clock += CHANGE
        middles.append(clock + repeats * READING / 2)
        clock += repeats * READING
        before = (position, probe)
    weights = readings.repeats / readings.repeats.sum()
    return (np.array(middles) - float(np.array(middles) @ weights)) / 3600.0


def law(design: Design, x: Any, e: Any) -> Any:
    """What drifts e (4,) of the point and of the scales add to locations."""
    t = hours(design)[:, None]
    return t * e[:3] + e[3] * t * x


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Experiment:
    return file_with(tmp_path_factory.mktemp("drawn"), [STATED])


def test_the_parameters_are_those_stated(tmp_path: Path) -> None:
    listed = STATED | {
        "axes": [
            {"value": "1 um/h", "standard_uncertainty": "0.5 um/h"},
            {"standard_uncertainty": "0 um/h"},
            {"value": "-3 nm/min"},
        ],
        "scale": [{}, {"value": "0.2 ppm/h"}, {"standard_uncertainty": "1 um/m/h"}],
    }
    design = lay_out(file_with(tmp_path, [listed]))
    (drift,) = design.influences
    found = [(p.name, p.unit, p.value, p.uncertainty) for p in drift.parameters]
    assert found == [
        ("drift along x", "m/h", 1e-6, 5e-7),
        ("drift along y", "m/h", 0.0, 0.0),
        ("drift along z", "m/h", pytest.approx(-1.8e-7), np.inf),
        (wording.DRIFT_OF_SCALE_3, "1/h", 0.0, np.inf),
        (wording.DRIFT_OF_SCALE_2, "1/h", 2e-7, np.inf),
        (wording.DRIFT_OF_SCALE, "1/h", 0.0, 1e-6),
    ]
    assert len(design.influence_parameters) == 5


UNKNOWN = {"kind": "drift", "axes": {}, "scale": {}}


@pytest.mark.parametrize(
    ("times", "deficiency"),
    [
        # A point that drifts between positions alone is where these stand.
        ({"set_up": "1 h", "reading": "0 s"}, 3),
        # Nothing at all takes time.
        ({"reading": "0 s"}, 4),
        ({"set_up": "1 h", "reading": "20 s"}, 0),
    ],
)
def test_the_verdict_tells_what_cannot_be_told_apart(
    tmp_path: Path, times: dict[str, str], deficiency: int
) -> None:
    design = lay_out(file_with(tmp_path, [UNKNOWN | {"times": times}]))
    found = verdict(linearise(design))
    assert found.deficiency == deficiency
    told = "; ".join(map(str, found.null))
    for axis in "xyz":
        assert (f"drift along {axis}" in told) == (deficiency > 0)
    assert (wording.DRIFT_OF_THE_SCALES in told) == (deficiency > 3)


def with_times(path: Path, values: Real, column: str) -> Path:
    """The file of readings with a column of times."""
    lines = path.read_text(encoding="utf-8").splitlines()
    told = [f"{lines[0]},{column}"]
    told += [f"{line},{value!r}" for line, value in zip(lines[1:], values.tolist(), strict=True)]
    found = path.with_name(f"{column}.csv")
    found.write_text("\n".join(told) + "\n", encoding="utf-8")
    return found


def test_times_of_the_file_replace_those_of_the_order(drawn: Experiment, tmp_path: Path) -> None:
    simulated = simulated_readings(drawn, seed=4)
    with (tmp_path / "plain.csv").open("w", encoding="utf-8", newline="") as stream:
        write_readings(stream, simulated.design, simulated.readings, simulated.x)
    design = lay_out(drawn)
    # From any zero on, in any unit.
    t = 3600.0 * hours(design) + 35000.0
    files = [
        (tmp_path / "plain.csv", design),
        (with_times(tmp_path / "plain.csv", t, "time_s"), lay_out(other_times(tmp_path))),
        (with_times(tmp_path / "plain.csv", t / 60.0, "time_min"), lay_out(other_times(tmp_path))),
        (tmp_path / "plain.csv", lay_out(other_times(tmp_path))),
    ]
    one, same, again, wrong = (
        estimate(seen.design, seen.x).state
        for seen in (read_readings(path, of) for path, of in files)
    )
    for other in (same, again):
        np.testing.assert_allclose(other.balls, one.balls, rtol=0, atol=1e-12)
        np.testing.assert_allclose(other.influences, one.influences, rtol=0, atol=1e-12)
    assert np.abs(wrong.balls - one.balls).max() > 1e-8


def other_times(folder: Path) -> Experiment:
    return file_with(folder, [STATED | {"times": {"set_up": "10 h", "reading": "1 s"}}])


def test_stated_starts_are_those_of_the_clock(drawn: Experiment, tmp_path: Path) -> None:
    """Positions that begin when they would by the times are read at the same time."""
    design = lay_out(drawn)
    t, position = hours(design), design.readings.position
    starts = {
        name: {"start": f"{3600.0 * (t[position == k][0] - t[0]):.9f} s"}
        for k, name in enumerate(design.positions.names)
    }
    times = {"reading": "20 s", "probe_change": "90 s"}
    other = lay_out(file_with(tmp_path, [STATED | {"times": times, "positions": starts}]))
    for of, label in ((design, "stated"), (other, "starts")):
        beside = of.readings.beside
        assert beside is not None
        (column,) = [values for name, values in beside.items() if name.startswith("hours")]
        np.testing.assert_allclose(column, t, rtol=0, atol=1e-9, err_msg=label)


def test_simulated_readings_without_noise_give_the_truth_back(tmp_path: Path) -> None:
    """Each repeat at its own time, as in a file that has them one after the other."""
    known = STATED | {
        "axes": {"value": "3 um/h", "standard_uncertainty": "2 um/h"},
        "scale": {"value": "2 ppm/h", "standard_uncertainty": "1 ppm/h"},
    }
    places = yaml.safe_load(Path("designs/quickstart.yaml").read_text(encoding="utf-8"))[
        "positions"
    ]
    experiment = file_with(tmp_path, [known], positions=[one | {"repeats": 2} for one in places])
    simulated = simulated_readings(experiment, exact=True)
    with (tmp_path / "exact.csv").open("w", encoding="utf-8", newline="") as stream:
        write_readings(stream, simulated.design, simulated.readings, simulated.x)
    observed = read_readings(tmp_path / "exact.csv", lay_out(experiment))
    found = estimate(observed.design, observed.x)
    np.testing.assert_allclose(found.state.influences, [3e-6] * 3 + [2e-6], rtol=0, atol=2e-9)
    np.testing.assert_allclose(found.state.balls, simulated.truth.balls, rtol=0, atol=1e-10)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"axes": None, "scale": None}, "nothing drifts; add axes or scale"),
        ({"axes": {"value": "1 um"}}, "is a length; a length per time is expected"),
        ({"scale": {"value": "1 um/h"}}, "is a length per time; a ratio per time is expected"),
        ({"axes": [{}, {}]}, "has 2 axes, but the experiment has 3"),
        ({"scale": {"standard_uncertainty": "-1 ppm/h"}}, "is below zero"),
        ({"positions": {"z lwo": {"start": "1 h"}}}, 'did you mean "z low"?'),
    ],
)
def test_what_is_wrong_is_told_at_its_place(
    tmp_path: Path, change: dict[str, Any], expected: str
) -> None:
    told = {key: value for key, value in (STATED | change).items() if value is not None}
    with pytest.raises(ExperimentError) as caught:
        file_with(tmp_path, [told])
    assert expected in str(caught.value) and "influences[0]" in str(caught.value)


# What is read again, by the name of the row on the documentation's page.
def _again(name: str) -> list[dict[str, Any]]:
    text = Path("designs/quickstart.yaml").read_text(encoding="utf-8")
    places: list[dict[str, Any]] = yaml.safe_load(text)["positions"]
    if name == "the first position at the end":
        return [*places, places[0] | {"name": "z low again"}]
    if name == "the corners at the end of each position":
        groups = [{"balls": "all"}, {"balls": ["r1c1", "r1c3", "r3c1", "r3c3"]}]
        return [
            {key: value for key, value in one.items() if key != "probes"}
            | {"readings": [group | {"probes": one["probes"]} for group in groups]}
            for one in places
        ]
    return places


@pytest.mark.parametrize(
    "name", ["nothing", "the first position at the end", "the corners at the end of each position"]
)
def test_the_page_states_what_reading_again_buys(name: str, tmp_path: Path) -> None:
    """The uncertainties of unknown drifts, and the mean U6 with them, by the dense computation."""
    places = _again(name)
    design = lay_out(file_with(tmp_path, [UNKNOWN | {"times": TIMES}], positions=places))
    found, of = dense_spread(design, law, np.full(4, np.inf))
    u = np.sqrt(np.diag(found.covariance))[-4:]
    rows = np.pad(dense.jacobian(dense.quantities(of)["U6"], of.parameters), ((0, 0), (0, 4)))
    without = dense.standard_uncertainties(of, symbols=["U6"])["U6"].mean()
    expected = [1e6 * u[:3].max(), 1e6 * u[3], 1e6 * found.of(rows).mean(), 1e6 * without]
    assert told_on_page(name) == pytest.approx(expected, rel=0.01)
    at = linearise(design)
    own = at.of_shared(np.eye(len(at.layout))[at.layout.influences])
    np.testing.assert_allclose(own, u, rtol=1e-6)
