"""Orders of a plan against all orders that there are, and what drift does against readings that
are estimated again.
"""

from __future__ import annotations

from itertools import permutations, product
from pathlib import Path
from typing import Any

import ballplate as bp
import numpy as np
import pytest
import yaml
from ballplate.extensions.campaign.drift_in_orders import drift_effect
from ballplate.extensions.campaign.least_drift import _Drift, _Ways, least_drift
from ballplate.planning.changeover import kind_of
from ballplate.planning.orders import ORDERS, ReadingOrder, in_order, with_probes
from ballplate.planning.schedule import RunSheet, run_sheet
from ballplate.planning.selection import Campaign
from ballplate.simulator.design.arrays import nominal_state
from ballplate.simulator.design.observations.readings import expected_readings
from ballplate.simulator.estimation.gauss_newton import estimate
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Candidate, Position
from ballplate.simulator.experiment.pool import with_chosen
from ballplate.simulator.inputs.messages import ExperimentError
from ballplate.uncertainty.kernel_quantities import evaluation_points
from numpy.typing import NDArray

from tests.extensions.campaign import wording
from tests.reference.small_quickstart import small_sections

Real = NDArray[np.float64]
SET_UP, READING, PROBE, PLANE = 900.0, 12.0, 120.0, 1500.0
TIMES = {"set_up": "15 min", "reading": "12 s", "probe_change": "2 min", "plane_change": "25 min"}
DRIFT = {
    "kind": "drift",
    "axes": {"standard_uncertainty": "0.5 um/h"},
    "scale": {"standard_uncertainty": "0.3 ppm/h"},
}


def pool_file(folder: Path, count: int = 6, **changed: Any) -> Path:
    """The first example's positions as a pool, with a smaller plate and fewer coefficients."""
    told = small_sections(true_machine={"kind": "zero"})
    first, *others = told["positions"][:count]
    told |= {"positions": [first], "pool": {"candidates": others, "times": TIMES}}
    path = folder / "pool.yaml"
    path.write_text(yaml.safe_dump(told | changed), encoding="utf-8")
    return path


def planned(folder: Path, order: Any = None, count: int = 6, **changed: Any) -> Campaign:
    return bp.plan(pool_file(folder, count, **changed), positions=count, order=order)


def positions_of(campaign: Campaign) -> list[Candidate]:
    return [one for one in campaign.chosen if isinstance(one.item, Position)]


def changes_of(sequence: Any) -> float:
    """Seconds of change-over between positions with their probes in order."""
    seconds = 0.0
    for (one, probes), (other, others) in zip(sequence, sequence[1:], strict=False):
        seconds += PLANE * (kind_of(one).plane != kind_of(other).plane)
        seconds += PROBE * (probes[-1] != others[0])
    return seconds


def probe_orders(own: Any) -> Any:
    """All ways to read positions in this order with their probes in any."""
    return (
        list(zip(own, probes, strict=True))
        for probes in product(*(permutations(one.item.probes) for one in own))
    )


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    return planned(tmp_path_factory.mktemp("five"), "least-drift", 5)


def test_probes_leave_the_fewest_changes(campaign: Campaign) -> None:
    own = positions_of(campaign)
    generator = np.random.default_rng(5)
    for _ in range(12):
        mixed = [own[k] for k in generator.permutation(len(own))]
        least = min(changes_of(one) for one in probe_orders(mixed))
        assert changes_of(with_probes(mixed, campaign.pool.changes)) == least


def test_the_least_change_over_is_that_of_all_orders(campaign: Campaign) -> None:
    own = positions_of(campaign)
    every = min(
        changes_of(with_probes(mixed, campaign.pool.changes)) for mixed in permutations(own)
    )
    told = {one.order: one.change_seconds for one in campaign.orders.effects}
    assert told["change-over"] == every
    assert list(told) == list(ORDERS) and min(told.values()) == every


def test_mirrored_orders_go_there_and_back(tmp_path: Path) -> None:
    campaign = planned(tmp_path, "mirrored")
    planes = [step.plane for step in campaign.sheet.steps]
    assert planes == planes[::-1] and len(set(planes)) == 3
    names = sorted(step.name for step in campaign.sheet.steps)
    assert names == sorted(one.name for one in campaign.chosen)


def test_single_positions_stand_in_the_middle(campaign: Campaign) -> None:
    """Of five positions one plane has one alone."""
    sequence = in_order(positions_of(campaign), campaign.pool.changes, ReadingOrder("mirrored"))
    planes = [one.plane for one, _ in sequence]
    assert planes[2] == "y" and planes[:2] == planes[:2:-1] and len(set(planes)) == 3


def test_blocks_have_each_plane_once_and_are_those_of_the_seed(tmp_path: Path) -> None:
    path, found = pool_file(tmp_path), []
    for seed in (1, 1, 2):
        campaign = bp.plan(path, positions=6, order="blocks", seed=seed)
        planes = [step.plane for step in campaign.sheet.steps]
        assert sorted(planes[:3]) == sorted(planes[3:]) == ["x", "y", "z"]
        found.append([step.name for step in campaign.sheet.steps])
    assert found[0] == found[1] and found[1] != found[2]


def middles(sheet: RunSheet) -> dict[tuple[str, str], Real]:
    """When balls are read, in seconds, by position and probe, as the times are stated."""
    found, clock = {}, 0.0
    for step in sheet.steps:
        clock += step.change_seconds + SET_UP
        count = step.readings // len(step.probes)
        for k, probe in enumerate(step.probes):
            clock += PROBE * (k > 0)
            found[step.name, probe] = clock + READING * (np.arange(count) + 0.5)
            clock += READING * count
    return found


def changed_distances(campaign: Campaign, sheet: RunSheet, axis: int) -> Real:
    """By how much distances of a fit are wrong that knows of no drift, of 1 um/h along an axis, or
    of 1 ppm/h of the scales where that is -1.
    """
    chosen = with_chosen(campaign.experiment, sheet.written)
    design = lay_out(chosen)
    state, readings = nominal_state(design), design.readings
    x = expected_readings(design, state, readings)
    by_step = middles(sheet)
    t = np.concatenate(
        [
            by_step[design.positions.names[k], design.probes.names[probe]]
            for k, probe in dict.fromkeys(
                zip(readings.position.tolist(), readings.probe.tolist(), strict=True)
            )
        ]
    )
    hours = (t - t.mean())[:, None] / 3600.0
    drifted = x + 1e-6 * hours * (x if axis < 0 else np.eye(3)[axis])
    lengths = []
    for seen in (drifted, x):
        places = evaluation_points(design).at(design, estimate(design, seen).state)
        first, second = np.triu_indices(len(places), 1)
        lengths.append(np.linalg.norm(places[first] - places[second], axis=1))
    return np.abs(lengths[0] - lengths[1])


def test_what_a_drift_does_is_what_readings_with_it_do(campaign: Campaign) -> None:
    for told in campaign.orders.effects:
        sheet = run_sheet(
            campaign.chosen,
            campaign.pool.changes,
            order=campaign.order if told.order == "least-drift" else ReadingOrder(told.order, 1),
        )
        assert told.seconds == pytest.approx(sheet.seconds)
        of_scale = changed_distances(campaign, sheet, -1).max()
        of_point = max(changed_distances(campaign, sheet, axis).max() for axis in range(3))
        assert told.of_scale == pytest.approx(of_scale, rel=1e-3)
        assert told.of_point == pytest.approx(of_point, rel=1e-3)


def times_of(sequence: Any) -> dict[tuple[str, str], float]:
    """When positions in this order, each with its probes in order, are read with each probe, in
    seconds to the middle of these readings.
    """
    found, clock = {}, 0.0
    for k, (one, probes) in enumerate(sequence):
        clock += changes_of(sequence[k - 1 : k + 1]) + SET_UP
        for i, probe in enumerate(probes):
            block = READING * one.readings / len(probes)
            clock += PROBE * (i > 0) + block
            found[one.name, probe] = clock - 0.5 * block
    return found


def responses(campaign: Campaign) -> tuple[dict[tuple[str, str], Real], Real]:
    """Changes of distances by scales that are 1 ppm wrong in what is read in a position with one
    probe, and by 1 ppm/h within these, each from a fit.
    """
    chosen = with_chosen(campaign.experiment, campaign.chosen)
    design = lay_out(chosen)
    x = expected_readings(design, nominal_state(design), design.readings)
    places = evaluation_points(design)

    def lengths(share: Real) -> Real:
        state = estimate(design, x * (1.0 + 1e-6 * share[:, None])).state
        at = places.at(design, state)
        first, second = np.triu_indices(len(at), 1)
        return np.asarray(np.linalg.norm(at[first] - at[second], axis=1))

    right = lengths(np.zeros(len(x)))
    found, within = {}, np.zeros(len(x))
    pairs = np.stack([design.readings.position, design.readings.probe], axis=1)
    for position, probe in np.unique(pairs, axis=0):
        is_here = (pairs == [position, probe]).all(axis=1)
        k = np.arange(is_here.sum())
        within[is_here] = READING * (k - k.mean()) / 3600.0
        name = design.positions.names[position], design.probes.names[probe]
        found[name] = lengths(is_here.astype(float)) - right
    return found, lengths(within) - right


def test_no_order_has_less_drift_of_the_scales(campaign: Campaign) -> None:
    """All orders of five positions, 120, and of the probes within them."""
    own = positions_of(campaign)
    by_block, within = responses(campaign)
    weight = {
        (one.name, probe): one.readings / len(one.item.probes)
        for one in own
        for probe in one.item.probes
    }
    effects = np.array([by_block[name] for name in weight])

    def effect(sequence: Any) -> float:
        times = times_of(sequence)
        hours = np.array([times[name] for name in weight]) / 3600.0
        hours -= np.average(hours, weights=list(weight.values()))
        return float(np.abs(hours @ effects + within).max())

    every = {
        tuple((one.name, probes) for one, probes in way): effect(way)
        for mixed in permutations(own)
        for way in probe_orders(mixed)
    }
    assert len(every) == 120 * 8
    told = {one.order: one.of_scale for one in campaign.orders.effects}
    chosen = tuple((step.name, step.probes) for step in campaign.sheet.steps)
    assert every[chosen] == pytest.approx(min(every.values()), rel=1e-6)
    assert told["least-drift"] == pytest.approx(every[chosen], rel=1e-3)
    # The probes that leave the fewest changes are not those with the least drift.
    least = min(effect(with_probes(one, campaign.pool.changes)) for one in permutations(own))
    assert every[chosen] < 0.99 * least and max(every.values()) > 1.5 * least


@pytest.mark.parametrize("seed", range(6))
def test_the_order_of_the_least_drift_is_that_of_all_orders_computed_one_by_one(seed: int) -> None:
    """Four positions, two of which can be read in two ways, with effects at random; some of the
    orders are equal but for what is changed between positions.
    """
    rng = np.random.default_rng(seed)
    each = (
        (0, ("a",)),
        (1, ("a", "b")),
        (1, ("b", "a")),
        (2, ("b",)),
        (3, ("a", "b")),
        (3, ("b", "a")),
    )
    of_block = np.array([0, 1, 1, 2, 3, 3])
    is_own = of_block == np.array([k for k, _ in each])[:, None]
    middles = np.where(is_own, rng.uniform(0.0, 0.5, is_own.shape), 0.0)
    takes, change = rng.uniform(0.5, 1.0, len(each)), rng.choice([0.0, 0.25], (6, 6))
    weight, effects = rng.uniform(1.0, 3.0, 6), rng.normal(size=(30, 7))
    if seed % 2:
        # Only what lies within blocks counts, so that all orders do the same.
        effects[:, :-1] = 0.0
    ways = ((0,), (1, 2), (3,), (4, 5))
    every = [one for order in permutations(range(4)) for one in product(*(ways[k] for k in order))]
    sizes, changes = [], []
    for sequence in every:
        hours, start = np.zeros(6), 0.0
        for way, following in zip(sequence, (*sequence[1:], None), strict=True):
            hours[is_own[way]] = start + middles[way, is_own[way]]
            start += takes[way] + (0.0 if following is None else change[way, following])
        hours -= (weight @ hours) / weight.sum()
        sizes.append(np.abs(effects[:, :-1] @ hours + effects[:, -1]).max())
        changes.append(sum(change[one] for one in zip(sequence, sequence[1:], strict=False)))
    drift = _Drift(_Ways(each, middles, is_own, takes, change), weight, effects)
    found, size = drift.least(np.array(every))
    assert size == pytest.approx(min(sizes), rel=1e-8)
    equal = [k for k, one in enumerate(sizes) if one <= min(sizes) * (1.0 + 1e-9)]
    assert len(equal) == (len(every) if seed % 2 else 1)
    at = every.index(tuple(found))
    assert at in equal and changes[at] == min(changes[k] for k in equal)


def test_exchanges_find_an_order_near_the_least(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    campaign = planned(tmp_path, "least-drift")
    monkeypatch.setattr("ballplate.extensions.campaign.least_drift.MOST_TRIED", 3)
    least = {one.order: one.of_scale for one in campaign.orders.effects}["least-drift"]
    for seed in range(1, 6):
        args = campaign.experiment, campaign.chosen, campaign.pool.changes
        order = ReadingOrder("least-drift", seed, least_drift(*args, seed))
        sheet = run_sheet(campaign.chosen, campaign.pool.changes, order=order)
        near = drift_effect(args[0], order.name, sheet, args[2], campaign.orders.size).of_scale
        assert least * (1.0 - 1e-6) <= near <= 1.03 * least


def test_the_file_of_a_plan_has_the_times_of_its_order(tmp_path: Path) -> None:
    for order in ("change-over", "blocks"):
        campaign = planned(tmp_path, order, influences=[DRIFT])
        (tmp_path / "chosen.yaml").write_text(campaign.to_yaml(tmp_path), encoding="utf-8")
        (chosen,) = load(tmp_path / "chosen.yaml")
        assert [one.name for one in chosen.positions] == [one.name for one in campaign.sheet.steps]
        told = bp.run(chosen).to_dict()["quantities"]["U6"]["average"]
        expected = campaign.prediction.to_dict()["quantities"]["U6"]["average"]
        assert told == pytest.approx(expected, rel=1e-9)
        beside = lay_out(chosen).readings.beside
        assert beside is not None
        (hours,) = [values for name, values in beside.items() if name.startswith("hours")]
        t = np.concatenate([np.asarray(one) for one in middles(campaign.sheet).values()])
        np.testing.assert_allclose(hours, (t - t.mean()) / 3600.0, rtol=0, atol=1e-6)


def test_a_drift_has_no_part_in_the_choice_and_is_told(tmp_path: Path) -> None:
    with_drift, without = planned(tmp_path, influences=[DRIFT]), planned(tmp_path)
    assert with_drift.value == pytest.approx(without.value, rel=1e-12)
    lines = "\n".join(with_drift.lines())
    assert wording.POSITIONS_WERE_CHOSEN_AS_IF_NOTHING in lines and "0.3000 ppm/h" in lines
    assert not without.orders and "drift" not in "\n".join(without.lines())
    u6 = [one.prediction.to_dict()["quantities"]["U6"]["average"] for one in (with_drift, without)]
    assert u6[0] > u6[1]


def test_sizes_of_drift_scale_what_it_does(tmp_path: Path) -> None:
    path = pool_file(tmp_path)
    one = bp.plan(path, positions=6, drift=["1 um/h", "1 ppm/h"])
    other = bp.plan(path, positions=6, drift=["3 um/h", "0.5 ppm/h"])
    for first, second in zip(one.orders.effects, other.orders.effects, strict=True):
        assert second.of_point == pytest.approx(3.0 * first.of_point, rel=1e-6)
        assert second.of_scale == pytest.approx(0.5 * first.of_scale, rel=1e-6)
        assert second.estimated == pytest.approx(first.estimated, rel=1e-6)
        assert first.estimated > first.without


def test_more_hours_than_allowed_are_told(tmp_path: Path) -> None:
    campaign = bp.plan(pool_file(tmp_path), hours=3.0, order="mirrored")
    (line,) = [one for one in campaign.lines() if one.startswith("mirrored")]
    assert line.endswith(wording.CHOSEN_MORE_HOURS_THAN_ALLOWED)


def test_a_campaign_that_has_begun_has_its_order(tmp_path: Path) -> None:
    path = pool_file(tmp_path)
    readings = bp.simulate(load(_drawn(tmp_path))[0], seed=1)
    done = readings[readings["position"] == "z low"]
    with pytest.raises(ExperimentError, match=wording.HAS_BEGUN_AND_ITS_TIMES):
        bp.plan(path, positions=3, done=done, order="mirrored")


def _drawn(folder: Path) -> Path:
    told = yaml.safe_load((folder / "pool.yaml").read_text(encoding="utf-8"))
    told["positions"] += told.pop("pool")["candidates"]
    (folder / "drawn.yaml").write_text(yaml.safe_dump(told), encoding="utf-8")
    return folder / "drawn.yaml"


def test_drift_of_length_standards_is_refused_or_told(tmp_path: Path) -> None:
    told = yaml.safe_load(pool_file(tmp_path).read_text(encoding="utf-8"))
    bar = {"kind": "two_spheres", "length": "500 mm", "role": "length_standard"}
    told["artefacts"]["bar"] = bar
    places = [one | {"artefact": "plate"} for one in told["pool"]["candidates"]]
    bars = {"name": "bar", "artefact": "bar", "plane": "z", "level": "300 mm", "probes": ["down"]}
    bars |= {"corner": {"x": "100 mm", "y": "100 mm"}}
    told["pool"]["candidates"] = [*places, bars]
    told["positions"] = [one | {"artefact": "plate"} for one in told["positions"]]
    told["pool"]["limits"] = {"keep": ["bar"]}
    calibration = [told["calibration"][0] | {"artefact": "plate"}]
    length = {"kind": "distances", "artefact": "bar", "pairs": "all"}
    told["calibration"] = [*calibration, length | {"standard_uncertainty": "0.2 um"}]
    path = tmp_path / "bar.yaml"
    path.write_text(yaml.safe_dump(told), encoding="utf-8")
    lines = "\n".join(bp.plan(path, positions=7, order="mirrored").lines())
    assert wording.NO_FIGURES_OF_DRIFT in lines
    with pytest.raises(ExperimentError, match="has length standards"):
        bp.plan(path, positions=7, order="least-drift")
