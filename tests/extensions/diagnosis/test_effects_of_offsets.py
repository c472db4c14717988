"""What wrong probe offsets do to corrected points, against two complete fits that differ by them."""

from __future__ import annotations

import json
from pathlib import Path

import ballplate as bp
import numpy as np
import pytest
from ballplate.cli import main
from ballplate.extensions.diagnosis.bias_patterns import patterns
from ballplate.extensions.diagnosis.effects import changes_of
from ballplate.extensions.diagnosis.redundancy import reliability_of
from ballplate.extensions.diagnosis.response import responses
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.observations.priors import Priors
from ballplate.simulator.design.observations.readings import expected_readings
from ballplate.simulator.design.state import State
from ballplate.simulator.estimation.functions import Coordinates, Distances, MeasuredPoints
from ballplate.simulator.estimation.gauss_newton import iterate
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from numpy.typing import NDArray

from tests.extensions.diagnosis.designs import MIXED, PLATE, experiment
from tests.reference.designs import altered

Real = NDArray[np.float64]

ENDS = np.array([[100.0, 100.0, 100.0], [600.0, 100.0, 100.0]])
TASKS = """
  tasks:
    - {name: across, from: [100 mm, 100 mm, 100 mm], to: [600 mm, 100 mm, 100 mm], probes: [down, right]}
    - {name: upright, from: [300 mm, 200 mm, 100 mm], to: [500 mm, 250 mm, 800 mm], probes: [left, back]}
    - {name: alike, from: [300 mm, 200 mm, 100 mm], to: [500 mm, 250 mm, 800 mm], probes: [left, left]}
"""
SIZE = 1e-6


def with_tasks(text: str) -> str:
    """A design of three measuring tasks, two of which use two probes."""
    old = "evaluation: {points: {random: 12, seed: 1}, probe: down}"
    assert old in text
    return text.replace(
        old, "evaluation:\n  points: {random: 12, seed: 1}\n  probe: down" + TASKS.rstrip()
    )


def wrong(design: Design, probe: int, axis: int, size: float) -> Design:
    """The design with an offset that is stated too large; of an estimated one its prior is."""
    if design.probes.free[probe].any():
        given = design.of(Priors)
        value = given.value.copy()
        value[(given.probe == probe) & (given.component == axis)] += size
        return design.observed(given.given(value=value))
    offsets = design.probes.offsets.copy()
    offsets[probe, axis] += size
    return altered(design, probes={"offsets": offsets})


def corrected(design: Design, state: State, points: Real, probes: NDArray[np.int64]) -> Real:
    """Corrected points, by the error model alone."""
    return np.asarray(points + design.model.error(points, state.a, state.probes[probes]))


def fitted(design: Design, x: Real) -> State:
    solution = iterate(design, x, nominal_state(design))
    assert solution.status == "converged"
    return solution.state


def lengths(places: Real) -> Real:
    first, second = np.triu_indices(len(places), 1)
    return np.asarray(np.linalg.norm(places[first] - places[second], axis=1))


@pytest.mark.parametrize("text", [PLATE, MIXED], ids=["plate", "mixed"])
def test_effects_of_offsets_are_those_of_two_fits(text: str, tmp_path: Path) -> None:
    design = lay_out(experiment(tmp_path, with_tasks(text)))
    x = expected_readings(design, nominal_state(design), design.readings)
    result, at = reliability_of(design), linearise(design)
    given = patterns(design, at.state, None)
    # Distances over all probes, as a quantity that somebody adds may have.
    every = len(design.probes.names)
    points = design.evaluation.points
    mixed = MeasuredPoints(np.tile(points, (every, 1)), np.repeat(np.arange(every), len(points)))
    made = {
        kind: changes_of(at, kind(mixed), given)(np.zeros(0, np.int64))
        for kind in (Coordinates, Distances)
    }
    found = list(responses(at, given))
    tasks = design.tasks

    def all_of(biased: Design) -> dict[str, Real]:
        state = fitted(biased, x)
        ends = corrected(biased, state, tasks.points.reshape(-1, 3), tasks.probes.ravel())
        own = np.full(len(points), design.evaluation.probe)
        evaluated = corrected(biased, state, points, own)
        over_all = corrected(biased, state, mixed.points, mixed.probes)
        return {
            "U4": evaluated.ravel(),
            "U5": lengths(state.balls[design.plate_balls]),
            "U6": lengths(evaluated),
            "tasks": np.linalg.norm(ends[::2] - ends[1::2], axis=1),
            "mixed co-ordinates": over_all.ravel(),
            "mixed distances": lengths(over_all),
        }

    tried = []
    for k in given.of_kind("probe", "prior").tolist():
        if given.kind[k] == "probe":
            probe, axis = int(given.subject[k]), int(given.axis[k])
        else:
            priors = design.of(Priors)
            probe, axis = (int(one[given.subject[k]]) for one in (priors.probe, priors.component))
        sides = [all_of(wrong(design, probe, axis, sign * SIZE)) for sign in (1.0, -1.0)]
        expected = {
            name: np.abs(sides[0][name] - sides[1][name]).max() / (2.0 * SIZE) for name in sides[0]
        }
        (one,) = (one for one in found if k in one.index)
        where = int(np.flatnonzero(one.index == k)[0])
        told = {symbol: effect.change[k] for symbol, effect in result.effects.items()}
        told["mixed co-ordinates"] = made[Coordinates].largest(one).change[where]
        told["mixed distances"] = made[Distances].largest(one).change[where]
        assert told.keys() == expected.keys()
        for name, value in expected.items():
            assert told[name] == pytest.approx(value, rel=2e-3, abs=5e-6), (k, name)
        tried.append((given.kind[k], probe))
    assert len(tried) == 3 * every
    assert not any(result.is_harmless(k) for k in given.of_kind("probe").tolist())


def test_a_task_of_two_probes_is_judged_as_the_fits_of_a_file_say(tmp_path: Path) -> None:
    text = Path("designs/quickstart.yaml").read_text(encoding="utf-8")
    task = (
        "  probe: down\n  tasks: [{name: across, from: [100 mm, 100 mm, 100 mm],"
        " to: [600 mm, 100 mm, 100 mm], probes: [down, right]}]\n"
    )
    assert text.count("  probe: down\n") == 1
    text = text.replace("  probe: down\n", task)
    stated = {"down": "[0 mm,", "right": "[50 mm,", "left": "[-50 mm,"}
    larger = {"down": "[0.001 mm,", "right": "[50.001 mm,", "left": "[-49.999 mm,"}
    path, wrong_path = tmp_path / "t.yaml", tmp_path / "wrong.yaml"
    path.write_text(text, encoding="utf-8")
    start = bp.load(path)
    readings = bp.simulate(start, exact=True)

    def across(file: Path) -> float:
        places = bp.fit(bp.load(file), readings, sigma="given").correct(
            1e-3 * ENDS, ["down", "right"]
        )
        return float(np.linalg.norm(np.diff(places.points, axis=0)))

    events = {one["name"]: one for one in bp.reliability(start).to_dict()["events"]}
    before = across(path)
    for probe, old in stated.items():
        line = f"  {probe}: {old}"
        assert text.count(line) == 1
        wrong_path.write_text(text.replace(line, f"  {probe}: {larger[probe]}"), encoding="utf-8")
        expected = abs(across(wrong_path) - before) / SIZE
        assert expected > 0.9
        event = events[f"offset x of probe {probe}"]
        effect, mdb = event["effects"]["tasks"], event["minimal_detectable"]
        told = effect["per_unit"] if mdb is None else effect["change"] / mdb
        assert told == pytest.approx(expected, rel=1e-3)
        assert effect["at"] == "across"


def test_harmless_is_said_of_no_offset_that_a_task_may_feel(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Perpendicular to a task an offset does not change it, but does change other lengths."""
    text, path = with_tasks(PLATE), tmp_path / "it.yaml"
    path.write_text(text, encoding="utf-8")
    assert main(["run", "--reliability", str(path), "--json"]) == 0
    by_name = {one["name"]: one for one in json.loads(capsys.readouterr().out)["events"]}
    for axis in "xyz":
        assert by_name[f"offset {axis} of probe down"]["harmless"] is False
    assert by_name["offset y of probe down"]["effects"]["tasks"]["per_unit"] < 1e-6
    assert main(["run", "--reliability", str(path)]) == 0
    out = capsys.readouterr().out
    assert "harmless" not in out and "tasks, µm" in out
    assert "offset y of probe down; it changes distances between points of tasks' probes" in out
    # With one probe in all tasks no length knows the offset.
    path.write_text(
        text.replace("[down, right]", "[down, down]")
        .replace("[left, back]", "[down, down]")
        .replace("[left, left]", "[down, down]"),
        encoding="utf-8",
    )
    assert main(["run", "--reliability", str(path)]) == 0
    out = capsys.readouterr().out
    assert "harmless: offset x of probe down" in out
    assert "no distance changes, between balls or corrected points of probe down\n" in out


def test_a_probe_that_reads_nothing_is_judged_where_a_task_uses_it(tmp_path: Path) -> None:
    text = with_tasks(PLATE).replace("probes: [down, right]", "probes: [down, spare]")
    text = text.replace("  back: [0 mm", "  spare: [0 mm, -70 mm, 0 mm]\n  back: [0 mm")
    design = lay_out(experiment(tmp_path, text))
    spare = design.probes.names.index("spare")
    assert spare not in design.readings.probe
    result = reliability_of(design)
    (x, _, _) = (
        k for k in result.patterns.of_kind("probe").tolist() if result.patterns.subject[k] == spare
    )
    assert np.isinf(result.minimal_detectable[x]) and not result.is_harmless(x)
    # Nothing of it is in the estimate: the end of the task moves as the offset does.
    ends = [
        corrected(one, nominal_state(one), design.tasks.points[0], design.tasks.probes[0])
        for one in (design, wrong(design, spare, 0, SIZE))
    ]
    change = np.diff([np.linalg.norm(one[0] - one[1]) for one in ends])[0]
    assert result.effects["tasks"].change[x] == pytest.approx(abs(change) / SIZE, rel=1e-4)
