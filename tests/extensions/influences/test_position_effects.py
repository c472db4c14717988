"""Probing errors, scales of positions and reproducibility against the laws themselves, written down
beside the program, and in simulated campaigns.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
import yaml
from ballplate.cli import main
from ballplate.extensions.planning.candidate_rows import draw
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.observations.readings import reading_blocks
from ballplate.simulator.estimation.functions import linear_functions
from ballplate.simulator.estimation.gauss_newton import estimate, linearised_fit
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.readings.simulated import simulated_readings
from ballplate.uncertainty.quantities import QUANTITIES

from tests.extensions.influences import wording
from tests.extensions.influences.campaigns import Law, Real, nominal_arms
from tests.reference import dense
from tests.reference.small_quickstart import OF_ENTRIES, small_sections

STYLI = {
    "down": [0, 0, -1],
    "right": [1, 0, 0],
    "left": [-1, 0, 0],
    "back": [0, 1, 0],
    "front": [0, -1, 0],
}

PROBING = {
    "kind": "probing",
    "value": "0.1 um",
    "standard_uncertainty": "0.3 um",
    "between_probes": "0.1 um",
}
COMMON = {"kind": "probing", "standard_uncertainty": "0.1 um"}
SCALE = {"kind": "position scale", "standard_uncertainty": "0.5 um/m", "by_axis": True}
TURNS = {"kind": "reproducibility", "each": ["position", "probe"], "standard_uncertainty": "0.3 um"}
PLACES = {"kind": "reproducibility", "each": ["position", "ball"], "standard_uncertainty": "0.2 um"}


def along_styli(design: Design) -> Real:
    return np.array([STYLI[name] for name in design.probes.names], float)[design.readings.probe]


def probing_law(design: Design, x: Real, e: Any) -> Any:
    probe = design.readings.probe
    return (1e-7 + e[0] + e[1:][probe])[:, None] * along_styli(design)


def scale_law(design: Design, x: Real, e: Any) -> Any:
    """Of a plate across an axis the scale of that axis shows nowhere and has no parameter."""
    across = [2, 2, 0, 0, 1, 1]
    table = np.zeros((6, 3), np.result_type(e, float))
    table[[[k] * 2 for k in range(6)], [[a for a in range(3) if a != b] for b in across]] = (
        e.reshape(6, 2)
    )
    return table[design.readings.position] * nominal_arms(design)


def shared_law(*levels: str) -> Law:
    def law(design: Design, x: Real, e: Any) -> Any:
        readings = design.readings
        key = np.stack([getattr(readings, level) for level in levels], axis=1)
        _, number = np.unique(key, axis=0, return_inverse=True)
        return e.reshape(-1, 3)[number.ravel()]

    return law


@dataclass(frozen=True)
class Disturbance:
    """A statement with its law, and the standard uncertainties of the parameters of that."""

    settings: dict[str, Any]
    law: Law
    spread: Real


def common_law(design: Design, x: Real, e: Any) -> Any:
    return e[0] * along_styli(design)


# By their names in the table of the page.
EVERY = {
    "probing, 0.1 µm": Disturbance(COMMON, common_law, np.array([1e-7])),
    "probing, 0.3 µm": Disturbance(PROBING, probing_law, np.array([3e-7, *[1e-7] * 5])),
    "scale of each position": Disturbance(SCALE, scale_law, np.full(12, 5e-7)),
    "reproducibility of positions and probes": Disturbance(
        TURNS, shared_law("position", "probe"), np.full(3 * 10, 3e-7)
    ),
    "reproducibility of positions and balls": Disturbance(
        PLACES, shared_law("position", "ball"), np.full(3 * 54, 2e-7)
    ),
}


@pytest.fixture(scope="module")
def small() -> bp.Experiment:
    return bp.quickstart().with_(OF_ENTRIES | {"sigma": "given"})


@pytest.fixture(params=EVERY)
def disturbance(request: pytest.FixtureRequest) -> Disturbance:
    return EVERY[request.param]


def disturbed(small: bp.Experiment, disturbance: Disturbance) -> Design:
    return lay_out(small.with_(influences=[disturbance.settings]))


def nominal(design: Design) -> Real:
    readings, state = design.readings, nominal_state(design)
    true = nominal_arms(design) + state.origins[readings.position]
    return np.asarray(true - state.probes[readings.probe])


def test_simulated_truths_are_drawn_from_the_statement(
    small: bp.Experiment, disturbance: Disturbance
) -> None:
    experiment = small.with_(influences=[disturbance.settings])
    count = 25
    drawn = np.array([simulated_readings(experiment, k).truth.influences for k in range(count)])
    stated = lay_out(experiment).influence_values
    off = (drawn - stated) / disturbance.spread
    assert (off**2).sum() == pytest.approx(off.size, rel=6.0 * np.sqrt(2.0 / off.size))


def test_a_bias_that_is_not_declared_is_that_of_a_dense_step(small: bp.Experiment) -> None:
    """Of every stylus alike by 0.3 um, without noise: what distances are wrong by, and S^2."""
    design = lay_out(small)
    x = nominal(design) + 3e-7 * along_styli(design)
    solution = estimate(design, x)
    at = linearised_fit(design, solution)
    (functions,) = QUANTITIES["U6"].functions(design, at.layout)
    places, true = (functions.places.at(design, one) for one in (at.state, nominal_state(design)))
    first, second = np.triu_indices(len(places), 1)
    wrong = np.linalg.norm(places[first] - places[second], axis=1)
    wrong = wrong - np.linalg.norm(true[first] - true[second], axis=1)
    problem = replace(dense.planned(design, 3, 3), scales=x)
    step, _ = dense.least_squares_step(problem)
    rows = dense.jacobian(dense.quantities(problem)["U6"], problem.parameters)
    np.testing.assert_allclose(wrong, rows @ step, rtol=1e-3, atol=1e-10)
    left = dense.residuals(problem, step)
    assert solution.factor.sum_of_squares == pytest.approx(float(left @ left), rel=1e-3)
    # More than twice what is stated of them.
    ratio = wrong / at.uncertainty(linear_functions(at, functions))
    assert np.sqrt((ratio**2).mean()) > 2.0


@pytest.mark.parametrize(
    "name",
    [
        "probing, 0.3 µm",
        "scale of each position",
        "reproducibility of positions and probes",
        pytest.param("probing, 0.1 µm", marks=pytest.mark.long),
        pytest.param("reproducibility of positions and balls", marks=pytest.mark.long),
    ],
)
def test_a_plan_knows_what_they_leave(name: str, tmp_path: Path) -> None:
    """Everything in the pool chosen is the design of all positions; its file reads again."""
    told, settings = small_sections(20), EVERY[name].settings
    if settings["kind"] == "position scale":
        settings = settings | {"positions": ["z low", "x high", "y low"]}
    told["influences"] = [settings]
    (tmp_path / "all.yaml").write_text(yaml.safe_dump(told), encoding="utf-8")
    expected = bp.run(tmp_path / "all.yaml").quantities["U6"].average
    first, *others = told["positions"]
    pool = told | {"positions": [first], "pool": {"candidates": others}}
    (tmp_path / "pool.yaml").write_text(yaml.safe_dump(pool), encoding="utf-8")
    plan = bp.plan(tmp_path / "pool.yaml", "U6", positions=6)
    assert plan.to_dict()["value"] == pytest.approx(expected, rel=1e-6)
    command = ["plan", str(tmp_path / "pool.yaml"), "--positions", "4", "-q"]
    main([*command, "-o", str(tmp_path / "chosen.yaml")])
    chosen = bp.load(tmp_path / "chosen.yaml")
    assert len(chosen.positions) == 4
    assert lay_out(chosen).influence_parameters


def test_poses_of_a_pool_do_not_count(
    small: bp.Experiment, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A plan solves for those of a choice only: a limit that all positions exceed is none of it."""
    every = small.with_(influences=[SCALE])
    design, of_balls = lay_out(every), 3 * 9
    limit = "ballplate.simulator.experiment._influences.MOST_SHARED"
    monkeypatch.setattr(limit, design.parameter_count - of_balls - 1)
    with pytest.raises(ExperimentError, match=wording.LEAVE_POSITIONS_OR_CANDIDATES_OUT):
        lay_out(every)
    pool = draw(every, every.positions)
    assert pool.design.parameter_count == design.parameter_count
    # What all share are the errors of the machine.
    monkeypatch.setattr(limit, pool.shared - 1)
    with pytest.raises(ExperimentError, match=wording.LEAVE_POSITIONS_OR_CANDIDATES_OUT):
        draw(every, every.positions)


def test_unknown_values_are_free_parameters(small: bp.Experiment) -> None:
    free = small.with_(influences=[{"kind": "probing"}])
    plain = bp.run(small).quantities
    assert bp.check(free).verdict.deficiency == 0
    assert bp.run(free).quantities["U6"].average > plain["U6"].average
    # With probes that turn nowhere, nothing shows it: each position has one probe.
    positions = [
        {"name": name, "plane": "z", "level": level, "corner": corner, "probes": ["down"]}
        for name, level, corner in (
            ("low", "250 mm", {"x": "0 mm", "y": "0 mm"}),
            ("high", "750 mm", {"x": "250 mm", "y": "250 mm"}),
        )
    ]
    one = {"probes": {"down": ["0 mm", "0 mm", "-50 mm"]}, "positions": positions}
    before = bp.check(small.with_(**one)).verdict.deficiency
    verdict = bp.check(small.with_(influences=[{"kind": "probing"}], **one)).verdict
    assert verdict.deficiency == before + 1


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        (PROBING | {"probes": ["up"]}, 'unknown probe "up"'),
        (PROBING | {"directions": {"up": [0, 0, 1]}}, 'unknown probe "up"'),
        (PROBING | {"directions": {"down": [0, 0, 0]}}, "has no direction"),
        (PROBING | {"directions": {"down": [0, 1]}}, "has 2 co-ordinates"),
        (PROBING | {"between_probes": "-1 um"}, "between_probes: is below zero"),
        (SCALE | {"positions": ["nowhere"]}, 'unknown position "nowhere"'),
        (SCALE | {"standard_uncertainty": "-1 ppm"}, "is below zero"),
        (TURNS | {"each": ["probe", "probe"]}, "has one of them twice"),
        (TURNS | {"each": ["position"]}, "a displacement of a whole position is part of its pose"),
        (TURNS | {"standard_uncertainty": "-1 um"}, "is below zero"),
        (TURNS | {"each": ["axis"]}, "each"),
    ],
)
def test_wrong_statements_are_refused(
    settings: dict[str, Any], text: str, small: bp.Experiment
) -> None:
    with pytest.raises(ExperimentError, match=text):
        small.with_(influences=[settings])


def test_a_probe_without_an_offset_needs_a_direction(small: bp.Experiment) -> None:
    none = small.with_({"probes.down": ["0 mm"] * 3})
    with pytest.raises(ExperimentError, match=wording.A_PROBE_WITHOUT_AN_OFFSET_HAS):
        lay_out(none.with_(influences=[PROBING]))
    stated = {"directions": {"down": [0, 0, -2]}}
    design = lay_out(none.with_(influences=[PROBING | stated]))
    down = np.flatnonzero(design.readings.probe == 0)
    state = nominal_state(design)
    blocks = reading_blocks(design, state, design.readings.select(down), nominal(design)[down])
    assert blocks.by_influence is not None
    np.testing.assert_allclose(
        blocks.by_influence[:, :, 0] * design.machine.repeatability,
        np.broadcast_to([0.0, 0.0, 1.0], (len(down), 3)),
    )
