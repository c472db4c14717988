"""Probing errors, scales of positions and reproducibility against the laws themselves, written down
beside the program, and in simulated campaigns.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
import yaml
from ballplate.cli import main
from ballplate.montecarlo.experiments import trials
from ballplate.planning.candidate_rows import draw
from ballplate.simulator.design.arrays import Design, nominal_state
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.design.observations.readings import reading_blocks
from ballplate.simulator.estimation.functions import linear_functions
from ballplate.simulator.estimation.gauss_newton import estimate, linearised_fit
from ballplate.simulator.estimation.linearisation import linearise
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.simulator.readings.generate import scale_readings
from ballplate.simulator.readings.simulated import simulated_readings
from ballplate.uncertainty.quantities import QUANTITIES
from numpy.typing import NDArray

from tests.influences import wording
from tests.influences.campaigns import shares_of
from tests.reference import dense
from tests.reference.small_quickstart import OF_ENTRIES, small_sections

Real = NDArray[np.float64]

# Of the probes down, right, left, back, front.
STYLI = np.array([[0, 0, -1], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]], float)

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


def probing_law(design: Design, arms: Real, e: Any) -> Any:
    probe = design.readings.probe
    return (1e-7 + e[0] + e[1:][probe])[:, None] * STYLI[probe]


def scale_law(design: Design, arms: Real, e: Any) -> Any:
    """Of a plate across an axis the scale of that axis shows nowhere and has no parameter."""
    across = [2, 2, 0, 0, 1, 1]
    table = np.zeros((6, 3), np.result_type(e, float))
    table[[[k] * 2 for k in range(6)], [[a for a in range(3) if a != b] for b in across]] = (
        e.reshape(6, 2)
    )
    return table[design.readings.position] * arms


def shared_law(*levels: str) -> Callable[[Design, Real, Any], Any]:
    def law(design: Design, arms: Real, e: Any) -> Any:
        readings = design.readings
        key = np.stack([getattr(readings, level) for level in levels], axis=1)
        _, number = np.unique(key, axis=0, return_inverse=True)
        return e.reshape(-1, 3)[number.ravel()]

    return law


@dataclass(frozen=True)
class Disturbance:
    """A statement with its law, and the standard uncertainties of the parameters of that."""

    settings: dict[str, Any]
    law: Callable[[Design, Real, Any], Any]
    spread: Real


def common_law(design: Design, arms: Real, e: Any) -> Any:
    return e[0] * STYLI[design.readings.probe]


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


def nominal_arms(design: Design) -> Real:
    readings, state = design.readings, nominal_state(design)
    return np.asarray(
        np.einsum("mij,mj->mi", state.rotations[readings.position], state.balls[readings.ball])
    )


def test_shift_and_derivative_are_those_of_the_law(
    small: bp.Experiment, disturbance: Disturbance
) -> None:
    design, plain = disturbed(small, disturbance), lay_out(small)
    arms, none = nominal_arms(design), np.zeros(len(disturbance.spread))
    assert len(design.influence_parameters) == len(none)
    blocks = reading_blocks(design, nominal_state(design), design.readings, nominal(design))
    assert blocks.by_influence is not None
    for k in range(len(none)):
        step = none + 1e-30j * (np.arange(len(none)) == k)
        slope = disturbance.law(design, arms, step).imag / 1e-30
        expected = -slope / design.machine.repeatability
        np.testing.assert_allclose(blocks.by_influence[:, :, k], expected, rtol=1e-12, atol=1e-6)
    same = reading_blocks(plain, nominal_state(plain), plain.readings, nominal(design))
    shift = disturbance.law(design, arms, none) / design.machine.repeatability
    np.testing.assert_allclose(blocks.residual, same.residual - shift, atol=1e-8)


def nominal(design: Design) -> Real:
    readings, state = design.readings, nominal_state(design)
    true = nominal_arms(design) + state.origins[readings.position]
    return np.asarray(true - state.probes[readings.probe])


def test_every_uncertainty_is_that_of_the_dense_computation(
    small: bp.Experiment, disturbance: Disturbance
) -> None:
    design, of = disturbed(small, disturbance), dense.planned(lay_out(small), 3, 3)
    arms, count, m = nominal_arms(design), len(disturbance.spread), 3 * len(design.readings)

    def rows(step: Any) -> Any:
        found = dense.residuals(of, step[: of.parameters])
        e = step[of.parameters :]
        shift = disturbance.law(design, arms, e) - disturbance.law(design, arms, 0.0 * e)
        found[:m] = found[:m] - (shift / design.machine.repeatability).ravel()
        return np.concatenate([found, e / disturbance.spread])

    found = dense.spread(dense.jacobian(rows, of.parameters + count))
    at = linearise(design)
    assert at.deficiency == found.deficiency == 0
    plain = dense.standard_uncertainties(of)
    for symbol, function in dense.quantities(of).items():
        wide = np.pad(dense.jacobian(function, of.parameters), ((0, 0), (0, count)))
        (functions,) = QUANTITIES[symbol].functions(design, at.layout)
        expected = found.of(wide)
        np.testing.assert_allclose(
            at.uncertainty(linear_functions(at, functions)), expected, rtol=1e-4
        )
        assert expected.mean() > plain[symbol].mean()


def test_monte_carlo_agrees(small: bp.Experiment, disturbance: Disturbance) -> None:
    outcome = trials(small.with_(influences=[disturbance.settings]), 500, 8).outcome
    assert outcome is not None
    for symbol in ("U5", "U6"):
        one = outcome.comparisons[symbol]
        assert abs(one.known.value - 0.95) < 5.0 * one.known.error
        assert not one.flags


def test_simulated_truths_are_drawn_from_the_statement(
    small: bp.Experiment, disturbance: Disturbance
) -> None:
    experiment = small.with_(influences=[disturbance.settings])
    count = 25
    drawn = np.array([simulated_readings(experiment, k).truth.influences for k in range(count)])
    stated = lay_out(experiment).influence_values
    off = (drawn - stated) / disturbance.spread
    assert (off**2).sum() == pytest.approx(off.size, rel=6.0 * np.sqrt(2.0 / off.size))


def campaigns(
    small: bp.Experiment, disturbance: Disturbance, is_declared: bool, count: int
) -> Iterator[tuple[Design, Real]]:
    """Campaigns by the law itself, whose truths are drawn from the statement."""
    design, plain = disturbed(small, disturbance), lay_out(small)
    told = design if is_declared else plain
    generator = np.random.default_rng(20261122)
    state, readings, given = nominal_state(plain), plain.readings, plain.of(CalibratedDistances)
    for _ in range(count):
        e = disturbance.spread * generator.standard_normal(len(disturbance.spread))
        shift = disturbance.law(plain, nominal_arms(plain), e)
        true = nominal_arms(plain) + state.origins[readings.position] + shift
        x = scale_readings(plain.model, true, state.a, state.probes[readings.probe])
        x += plain.machine.repeatability * generator.standard_normal(x.shape)
        wrong = given.value + given.uncertainty * generator.standard_normal(len(given))
        yield told.observed(given.given(value=wrong)), x


def test_a_bias_that_is_not_declared_is_that_of_a_dense_step(small: bp.Experiment) -> None:
    """Of every stylus alike by 0.3 um, without noise: what distances are wrong by, and S^2."""
    design = lay_out(small)
    x = nominal(design) + 3e-7 * STYLI[design.readings.probe]
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


@pytest.mark.long
@pytest.mark.parametrize("name", EVERY)
def test_the_page_states_what_is_wrong_otherwise(name: str, small: bp.Experiment) -> None:
    page = Path("docs/reference/validation.md").read_text(encoding="utf-8")
    lines = [one for one in page.splitlines() if one.startswith(f"| {name} |")]
    for is_declared, line in zip((True, False), lines, strict=True):
        told = [float(cell.split()[0]) for cell in line.split("|")[3:-1]]
        found = shares_of(campaigns(small, EVERY[name], is_declared, 400))
        within, size = found.within, found.size
        expected = [100 * within["U5"], 100 * within["U6"], size["U5"], size["U6"]]
        expected += [100 * found.noticed]
        assert told == pytest.approx(expected, rel=0.01, abs=0.5)


def test_a_plan_knows_what_they_leave(tmp_path: Path, disturbance: Disturbance) -> None:
    """Everything in the pool chosen is the design of all positions; its file reads again."""
    told, settings = small_sections(20), disturbance.settings
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
    limit = "ballplate.simulator.experiment.influences.MOST_SHARED"
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


def test_the_example_of_the_page_is_read() -> None:
    """Every kind is on the page that is about them."""
    page = Path("docs/how-to/shared-effects.md").read_text(encoding="utf-8")
    for kind in ("probing", "position scale", "reproducibility"):
        assert f"kind: {kind}" in page
