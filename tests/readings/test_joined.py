"""Readings meet the rows of a design by what they are readings of: repeats, in any order."""

from __future__ import annotations

import ast
from collections import defaultdict
from dataclasses import replace
from functools import cache
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.extensions.assumptions.assumed import assumptions_of
from ballplate.extensions.assumptions.effects import _bias
from ballplate.simulator.design.arrays import Design, Readings
from ballplate.simulator.design.measurement import UnmatchedReadingsError, reading_uncertainties
from ballplate.simulator.design.objects import Balls
from ballplate.simulator.estimation.gauss_newton import estimate, newton_step
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.inputs.yamltree import to_python, written
from ballplate.simulator.readings.joining import joined, reading_keys
from ballplate.simulator.readings.observed_readings import observe
from ballplate.simulator.readings.simulated import exact_readings, on_stated_machine

from tests.reference.small_quickstart import small_quickstart, small_sections

TOP = Path(__file__).parents[2]
SHIPPED = sorted(
    path
    for path in (TOP / "designs").rglob("*.yaml")
    if path.parent.name not in ("sweeps", "machines", "parts", "planning")
)


@cache
def shipped(path: Path) -> list[bp.Experiment]:
    """The experiments of a file: the first and the last of many."""
    every = bp.load_all(path)
    return every if len(every) < 3 else [every[0], every[-1]]


def read_often(
    experiment: bp.Experiment, repeats: int, places: list[int], more_precisely: bool = False
) -> bp.Experiment:
    """The experiment with readings of some positions made `repeats` times as often, or once with
    the uncertainty of their mean.
    """
    entries = to_python(written(experiment.tree, "positions"))
    for k in places:
        groups = []
        for group in experiment.positions[k].readings:
            own = group.standard_uncertainty
            times = group.repeats
            if more_precisely:
                u = experiment.machine.repeatability if own is None else own
                own = u / np.sqrt(repeats)
            else:
                times *= repeats
            groups.append({"probes": list(group.probes), "balls": list(group.balls)})
            groups[-1]["repeats"] = times
            if own is not None:
                groups[-1]["standard_uncertainty"] = [f"{u!r} m" for u in own.tolist()]
        for key in ("probes", "balls", "repeats", "standard_uncertainty"):
            entries[k].pop(key, None)
        entries[k]["readings"] = groups
    return experiment.with_(positions=entries)


def some_readings() -> tuple[Design, Readings, np.ndarray]:
    """Readings of a design that reads some balls more often than others, in any order, each with
    a value of its own.
    """
    experiment = small_quickstart()
    experiment = read_often(read_often(experiment, 2, [0, 2]), 3, [2, 5])
    design = bp.lay_out(experiment)
    generator = np.random.default_rng(5)
    readings = design.readings.expanded()
    shuffled = readings.select(generator.permutation(len(readings)))
    return design, shuffled, generator.random((len(readings), 3))


def test_each_row_is_the_mean_of_its_own_readings() -> None:
    design, readings, x = some_readings()
    expected = defaultdict(list)
    for key, value in zip(reading_keys(readings), x, strict=True):
        expected[key].append(value)
    means = joined(design, design, readings, x)
    assert {len(values) for values in expected.values()} == {1, 2, 3, 6}
    for key, mean in zip(reading_keys(design.readings), means, strict=True):
        np.testing.assert_allclose(mean, np.mean(expected[key], axis=0), rtol=1e-14)


def test_names_match_whatever_their_indices() -> None:
    """The other design lists probes, balls and positions the other way round."""
    design, readings, x = some_readings()
    balls, positions, probes = design.balls, design.positions, design.probes
    back = replace(
        design,
        balls=Balls(balls.names[::-1], balls.artefact[::-1], balls.places[::-1]),
        positions=replace(positions, names=positions.names[::-1]),
        probes=replace(probes, names=probes.names[::-1]),
    )
    turned = replace(
        readings,
        ball=len(balls.names) - 1 - readings.ball,
        position=len(positions.names) - 1 - readings.position,
        probe=len(probes.names) - 1 - readings.probe,
    )
    np.testing.assert_array_equal(
        joined(design, back, turned, x), joined(design, design, readings, x)
    )


def test_the_same_readings_in_two_groups_are_taken_in_their_order() -> None:
    group = {"probes": ["down"]}
    twice = [group, {**group, "repeats": 2, "standard_uncertainty": "1 um"}]
    changes = {"positions[0].readings": twice, "positions[0].probes": None}
    design = bp.lay_out(small_quickstart().with_(changes))
    readings = design.readings.expanded()
    x = reading_uncertainties(design, readings)
    assert len(np.unique(x)) == 2
    np.testing.assert_array_equal(
        joined(design, design, readings, x), reading_uncertainties(design, design.readings)
    )


def test_other_readings_are_refused() -> None:
    design, readings, x = some_readings()
    every = np.arange(len(readings))
    other = replace(readings, probe=np.roll(readings.probe, 1))
    renamed = replace(design, probes=replace(design.probes, names=("a", *design.probes.names[1:])))
    for source, wrong, rows in (
        (design, readings.select(every[1:]), every[1:]),
        (design, readings.select(np.append(every, 0)), np.append(every, 0)),
        (design, readings, every[1:]),
        (design, other, every),
        (renamed, readings, every),
    ):
        with pytest.raises(UnmatchedReadingsError):
            joined(design, source, wrong, x[rows])


def test_nothing_is_estimated_from_rows_of_other_readings() -> None:
    design, readings, x = some_readings()
    for wrong in (x, x[: len(design.readings) - 1]):
        with pytest.raises(UnmatchedReadingsError):
            linearise(design, x=wrong)
        with pytest.raises(ValueError):
            estimate(design, wrong)
    with pytest.raises(UnmatchedReadingsError):
        observe(design, readings, x[1:])
    of_other = replace(design.readings, ball=np.zeros(len(design.readings), np.int64))
    two = replace(
        design,
        artefacts=replace(design.artefacts, names=("plate", "other")),
        balls=replace(design.balls, artefact=np.append(1, design.balls.artefact[1:])),
    )
    with pytest.raises(UnmatchedReadingsError):
        observe(two, of_other, x[: len(of_other)])


def step(design: Design, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The least-squares step from readings, and the uncertainties of the shared parameters."""
    at = linearise(design, x=x)
    return newton_step(design, at.factor, at.spectrum)[0], at.of_shared(np.eye(len(at.layout)))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: f"{path.parent.name}/{path.stem}")
@pytest.mark.parametrize("repeats", [2, 3])
def test_repeats_are_one_reading_of_their_mean(path: Path, repeats: int) -> None:
    """In one position and in all: plates, bars, gauges. Three ways to the same estimate: rows of
    means, one more precise reading, and, in any order, one row per repeat.
    """
    for experiment in shipped(path):
        count = len(experiment.positions)
        for places in ([count // 2], list(range(count))):
            design = bp.lay_out(read_often(experiment, repeats, places))
            on_truth, truth = on_stated_machine(experiment, design)
            readings, x = exact_readings(on_truth, truth)
            own, u = step(design, joined(design, on_truth, readings, x))

            precise = bp.lay_out(read_often(experiment, repeats, places, more_precisely=True))
            one = exact_readings(*on_stated_machine(experiment, precise))
            clock = any("hours" in name for name in readings.beside or {})
            if not clock:
                expected, same = step(precise, joined(precise, precise, *one))
                np.testing.assert_allclose(u, same, rtol=1e-6)
                assert np.nanmax(np.abs(own - expected) / u, initial=0.0) < 1e-5

            if len(design.gauge_positions):
                continue  # each reading of a gauge is a length along its own direction
            if design.influences:
                continue  # drifts follow the order of reading
            order = np.random.default_rng(1).permutation(len(x))
            shuffled = readings.select(order)
            observed = observe(design, shuffled, x[order])
            of_rows, again = step(observed.design, observed.x)
            np.testing.assert_allclose(u, again, rtol=1e-6)
            assert np.nanmax(np.abs(own - of_rows) / u, initial=0.0) < 1e-5


def chain_row(experiment: bp.Experiment) -> tuple[float, float]:
    """Errors of lengths, root mean square and largest, if the chain of axes is another one."""
    [chain] = [each for each in assumptions_of(experiment) if each.name == "chain"]
    return _bias(experiment, experiment.with_(chain.changes))


def assert_chain_rows_agree(experiment: bp.Experiment) -> None:
    count = len(experiment.positions)
    for repeats, places in ((2, [0]), (3, [count - 1]), (2, list(range(count)))):
        often, precise = (
            chain_row(read_often(experiment, repeats, places, more_precisely))
            for more_precisely in (False, True)
        )
        assert often == pytest.approx(precise, rel=1e-6)


def test_the_row_of_the_chain_is_that_of_more_precise_readings() -> None:
    """It was of metres where any position had repeats."""
    compared = 0
    for experiment in (experiment for path in SHIPPED[::5] for experiment in shipped(path)):
        lengths = bp.run(experiment).quantities.get("U6")
        if hasattr(experiment.error_model, "arrangement") and lengths and lengths.average > 0.0:
            assert_chain_rows_agree(experiment)
            compared += 1
    assert compared > 3


def with_standards() -> bp.Experiment:
    """The small quickstart with a bar and a Bryan gauge, and a ball that one position omits."""
    sections = small_sections()
    sections["artefacts"] |= {
        "bar": {"kind": "two_spheres", "length": "400 mm", "role": "length_standard"},
        "gauge": {
            "kind": "bryan_gauge",
            "radius": "200 mm",
            "directions": {"azimuths": 6, "elevations": ["20 deg", "60 deg"]},
        },
    }
    for position in sections["positions"]:
        position["artefact"] = "plate"
    sections["positions"][1]["balls"] = ["r1c1", "r1c3", "r3c1", "r2c2"]
    for name, artefact, origin in (
        ("along x", "bar", [300, 500, 400]),
        ("along x again", "bar", [200, 300, 700]),
        ("pivot", "gauge", [500, 500, 300]),
    ):
        pose = {"origin": [f"{value} mm" for value in origin]}
        position = {"name": name, "artefact": artefact, "pose": pose, "probes": ["down"]}
        sections["positions"].append(position)
    for item in sections["calibration"]:
        item["artefact"] = "plate"
    sections["calibration"] += [
        {"kind": "distances", "artefact": "bar", "pairs": "all", "standard_uncertainty": "0.3 um"},
        {"kind": "radius", "artefact": "gauge", "standard_uncertainty": "0.3 um"},
    ]
    return bp.experiment(sections)


def test_standards_and_unread_balls_too() -> None:
    """A length standard read twice ended `run`."""
    experiment = with_standards()
    assert_chain_rows_agree(experiment)
    for k in range(len(experiment.positions)):
        often = read_often(experiment, 2, [k])
        table = bp.assumptions(often)
        [row] = [effect for effect in table.effects if effect.assumption.name == "chain"]
        assert row.bias == chain_row(often)


def test_a_table_in_any_order_is_fitted_alike() -> None:
    experiment = read_often(read_often(with_standards(), 2, [0, 6]), 3, [1, 7])
    table = bp.simulate(experiment, seed=3)
    fits = [bp.fit(experiment, rows) for rows in (table, table.sample(frac=1.0, random_state=2))]
    for one, other in zip(*(fit.estimates for fit in fits), strict=True):
        assert one.value == pytest.approx(other.value, abs=1e-5 * one.standard_uncertainty)


# Modules that make readings of a design, and how these meet its rows.
MAKERS = {"exact_readings", "noisy_readings", "true_readings", "simulated_readings"}
WITHOUT_A_JOIN = {
    "analysis/api.py": "a table of the readings",
    "analysis/cli/simulate.py": "a table of the readings",
    "analysis/extensions/certificates/interface.py": "values of certificates alone",
    "analysis/montecarlo/_reference.py": "made of the rows of the design",
}


def test_whoever_makes_readings_joins_them() -> None:
    makers = set()
    for folder in ("analysis", "simulator"):
        for path in sorted((TOP / folder).rglob("*.py")):
            name = str(path.relative_to(TOP))
            if name.startswith("simulator/readings/"):
                continue
            text = path.read_text(encoding="utf-8")
            tree = ast.parse(text if "_readings" in text else "")
            imported = {
                alias.name
                for node in ast.walk(tree)
                if isinstance(node, ast.ImportFrom)
                for alias in node.names
            }
            if imported & MAKERS:
                makers.add(name)
                assert imported & {"joined", "observe"} or name in WITHOUT_A_JOIN, name
    assert makers >= WITHOUT_A_JOIN.keys()


def test_a_standard_read_with_two_uncertainties_is_fitted_as_predicted() -> None:
    """Its two groups were averaged, and the mean was taken twice."""
    group = {"probes": ["down"]}
    groups = [group, {**group, "standard_uncertainty": "3 um"}]
    changes = {"positions[6].readings": groups, "positions[6].probes": None}
    experiment = with_standards().with_(changes)
    fitted = bp.fit(experiment, bp.simulate(experiment, exact=True), sigma="given")
    assert len(fitted.design.readings) == len(bp.lay_out(experiment).readings)
    expected = bp.run(experiment)["U6"].average
    assert fitted.quantities["U6"].average == pytest.approx(expected, rel=1e-5)
