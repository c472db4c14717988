"""Short orders against every order there is, and run sheets against adding up by hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from ballplate.extensions.planning.changeover import Setup, changeover
from ballplate.extensions.planning.constraints import Budget, constraints
from ballplate.extensions.planning.schedule import ordered, run_sheet
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Candidate, ChangeTimes, Position, ReadingGroup
from ballplate.simulator.geometry.poses import Pose
from hypothesis import given, settings, strategies as st

CHANGES = ChangeTimes(probe=120.0, plane=1800.0)

kinds = st.builds(
    Setup,
    st.sampled_from(["plate", "bar"]),
    st.sampled_from("xyz"),
    st.frozensets(st.sampled_from(["down", "left", "right"]), min_size=1),
)
change_times = st.builds(
    ChangeTimes, st.sampled_from([0.0, 120.0, 4000.0]), st.sampled_from([0.0, 100.0, 1800.0])
)


def position(kind: Setup, name: str, seconds: float = 600.0) -> Candidate:
    balls = np.arange(1)
    group = ReadingGroup(tuple(sorted(kind.probes)), ("1",), balls, 1)
    item = Position(name, kind.artefact, Pose(np.eye(3), np.zeros(3)), (group,))
    said = {
        "name": name,
        "plane": kind.plane,
        "level": "0 mm",
        "corner": {"x": "0 mm", "y": "0 mm"},
    }
    return Candidate(name, item, seconds, kind.plane, "", False, said)


def cost(sequence: Sequence[tuple[Candidate, Sequence[str]]], changes: ChangeTimes) -> float:
    total = 0.0
    for (one, probes), (other, next_probes) in zip(sequence, sequence[1:], strict=False):
        if (one.item.artefact, one.plane) != (other.item.artefact, other.plane):
            total += changes.plane
        if probes[-1] != next_probes[0]:
            total += changes.probe
    return total


def least_of_all(
    members: Sequence[Setup], changes: ChangeTimes, first: Setup | None = None
) -> float:
    """The least cost of every order of positions, after one of the kind `first`; of each order the
    cheapest probes are known from the least cost to come so far with each of them.
    """
    least = float("inf")
    for order in set(permutations(members)):
        costs, place = dict[str, float](), None
        for kind in [*([] if first is None else [first]), *order]:
            moved = changes.plane * (place not in (None, (kind.artefact, kind.plane)))
            place, begun = (kind.artefact, kind.plane), costs
            costs = {}
            for one, other in permutations(sorted(kind.probes) * 2, 2):
                if (one == other) == (len(kind.probes) == 1):
                    so_far = [cost + changes.probe * (p != one) for p, cost in begun.items()]
                    cost = min(so_far, default=0.0) + moved
                    costs[other] = min(cost, costs.get(other, cost))
        least = min(least, *costs.values()) if costs else 0.0
    return least


@settings(max_examples=60, deadline=None)
@given(st.lists(kinds, min_size=1, max_size=5), change_times, st.none() | kinds)
def test_the_change_over_is_that_of_the_order_printed(
    members: list[Setup], changes: ChangeTimes, standing: Setup | None
) -> None:
    """Of a position that still stands, going on from it included."""
    own = [position(kind, str(k)) for k, kind in enumerate(members)]
    rest = None if standing is None else position(standing, "rest")
    sequence = ordered(own, changes, [], rest)
    assert cost(sequence, changes) == changeover(members, changes, standing)
    assert cost(sequence, changes) >= least_of_all(members, changes, standing)
    names = [one.name for one, _ in sequence]
    assert names[0] == "rest" if rest is not None else "rest" not in names
    assert sorted(name for name in names if name != "rest") == [*map(str, range(len(members)))]
    for one, probes in sequence:
        assert sorted(probes) == sorted(
            {name for group in one.item.readings for name in group.probes}
        )


@settings(max_examples=25, deadline=None)
@given(kinds, st.lists(kinds, min_size=1, max_size=3), change_times)
def test_an_order_goes_on_from_what_is_done_without_a_price(
    before: Setup, members: list[Setup], changes: ChangeTimes
) -> None:
    done = position(before, "done")
    own = [position(kind, str(k)) for k, kind in enumerate(members)]
    (first, _), *sequence = ordered(own, changes, [done])
    assert first is done
    assert cost(sequence, changes) == changeover(members, changes)


def test_most_orders_are_the_shortest_and_others_a_few_minutes_longer() -> None:
    generator, more = np.random.default_rng(3), []
    for _ in range(60):
        members = random_members(generator, 6)
        more.append(changeover(members, CHANGES) - least_of_all(members, CHANGES))
    assert min(more) == 0.0 and max(more) <= 2 * CHANGES.probe
    assert sum(extra > 0.0 for extra in more) <= 0.1 * len(more)


def random_members(generator: np.random.Generator, count: int) -> list[Setup]:
    """Positions of a few kinds that share planes and probes, so that the order matters."""
    names = ["down", "left", "right", "back"]
    some = [
        Setup(
            ["plate", "bar"][int(generator.integers(4)) // 3],
            "xyz"[int(generator.integers(3))],
            frozenset(
                generator.choice(names, int(generator.choice([1, 1, 2, 2, 3])), False).tolist()
            ),
        )
        for _ in range(int(generator.integers(2, 7)))
    ]
    return [some[int(k)] for k in generator.integers(len(some), size=count)]


def test_a_choice_that_just_fits_the_hours_is_allowed() -> None:
    both, down = (Setup("plate", "z", frozenset(some)) for some in (["right", "down"], ["down"]))
    across = Setup("plate", "x", frozenset(["right"]))
    members = [across, both, down, down, across]
    assert changeover(members, CHANGES) == least_of_all(members, CHANGES) == 1800.0
    own = [position(kind, str(k)) for k, kind in enumerate(members)]
    for seconds, is_allowed in ((5 * 600.0 + 1800.0, True), (5 * 600.0 + 1799.0, False)):
        limits = constraints(own, CHANGES, Budget(seconds))
        assert limits.allows(range(5)) == is_allowed
        assert (2 in limits.additions([0, 1, 3, 4])) == is_allowed


def test_times_of_a_run_sheet_by_hand() -> None:
    (experiment,) = load("designs/planning/plate-pool.yaml", planning=True)
    assert experiment.pool is not None
    drawn = [one for one in experiment.pool.candidates if one.drawn]
    # 20 min and 49 readings of 15 s, of two probes twice as many and a change of 2 min.
    assert [one.seconds for one in drawn] == [1200 + 735] * 2 + [1200 + 1470 + 120] * 4
    sheet = run_sheet(drawn, experiment.pool.changes)
    # Two changes of plane, each with another probe; within a plane the second position begins where
    # the first ended.
    assert sheet.seconds == 2 * 1935 + 4 * 2790 + 2 * (1800 + 120)
    assert sheet.hours == sheet.seconds / 3600
    assert sum(step.readings for step in sheet.steps) == 2 * 49 + 4 * 98
    starts = [step.start for step in sheet.steps]
    spent = [step.seconds + step.change_seconds for step in sheet.steps]
    assert starts == pytest.approx([sum(spent[:k]) for k in range(6)])
    assert sheet.seconds == sum(spent)
    done = run_sheet(drawn, experiment.pool.changes, done=[drawn[4], drawn[0]])
    assert [step.name for step in done.steps][:2] == ["y low", "z low"]
    assert [step.done for step in done.steps] == [True] * 2 + [False] * 4
    # Going on from z: to the other z position, then to x and y; the first of them needs no change.
    assert done.steps[2].name == "z high"
    assert [step.start for step in done.steps[:3]] == [0.0] * 3 and done.steps[2].change == ""
    assert done.seconds == 1935 + 3 * 2790 + 2 * (1800 + 120)
    assert {one.name for one in done.chosen} == {one.name for one in drawn}


def test_items_of_calibration_are_paid_for() -> None:
    (experiment,) = load("designs/planning/campaign.yaml", planning=True)
    assert experiment.pool is not None
    by_name = {one.name: one for one in experiment.pool.candidates}
    sheet = run_sheet([by_name["flat low"], by_name["all distances"]], experiment.pool.changes)
    assert sheet.seconds == 900 + 25 * 12 + 90 * 60
    assert [one.name for one in sheet.calibration] == ["all distances"]


def test_what_is_done_may_have_other_readings_than_the_file_says() -> None:
    (experiment,) = load("designs/planning/campaign.yaml", planning=True)
    assert experiment.pool is not None
    upright = next(one for one in experiment.pool.candidates if one.name == "upright")
    assert isinstance(upright.item, Position)
    (group,) = upright.item.readings
    split = tuple(replace(group, probes=(probe,), balls=group.balls[:2]) for probe in group.probes)
    taken = replace(upright, item=replace(upright.item, readings=split))
    sheet = run_sheet(experiment.pool.candidates[:2], experiment.pool.changes, done=[taken])
    assert [step.name for step in sheet.steps] == ["upright", "flat low"]
    assert sheet.steps[0].balls == "r1c1, r1c2 with back; r1c1, r1c2 with front"
