"""The cheapest order against every order there is, and run sheets against adding up by hand."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import permutations, product
from time import process_time

import numpy as np
import pytest
from ballplate.planning.changeover import MOST_PLACES, Setup, changeover, cheapest
from ballplate.planning.constraints import Budget, constraints
from ballplate.planning.run_sheet_tables import summary
from ballplate.planning.schedule import ordered, run_sheet
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import Candidate, ChangeTimes, Position, ReadingGroup
from ballplate.simulator.geometry.positions import Pose
from hypothesis import given, settings
from hypothesis import strategies as st

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


def every_order(members: Sequence[Setup]) -> Iterator[list[tuple[Setup, tuple[str, ...]]]]:
    """Every order of positions, and of the first and last probe within them."""
    for order in set(permutations(members)):
        ways = [
            list(permutations(sorted(kind.probes), 2)) or [tuple(kind.probes)] for kind in order
        ]
        for probes in product(*ways):
            yield list(zip(order, probes, strict=True))


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
@given(st.lists(kinds, min_size=1, max_size=5), change_times)
def test_least_change_over_of_all_orders(members: list[Setup], changes: ChangeTimes) -> None:
    least = least_of_all(members, changes)
    assert changeover(members, changes) == least
    own = [position(kind, str(k)) for k, kind in enumerate(members)]
    sequence, gap = ordered(own, changes)
    assert cost(sequence, changes) == least and gap == 0.0
    assert sorted(one.name for one, _ in sequence) == [str(k) for k in range(len(members))]
    for one, probes in sequence:
        assert sorted(probes) == sorted(
            {name for group in one.item.readings for name in group.probes}
        )


@settings(max_examples=25, deadline=None)
@given(kinds, st.lists(kinds, min_size=1, max_size=3), change_times)
def test_of_the_cheapest_orders_that_which_goes_on_from_what_is_done(
    before: Setup, members: list[Setup], changes: ChangeTimes
) -> None:
    done = position(before, "done")
    own = [position(kind, str(k)) for k, kind in enumerate(members)]
    ((first, _), *sequence), _ = ordered(own, changes, [done])
    assert first is done
    least = least_of_all(members, changes)
    assert cost(sequence, changes) == least
    ends = [(done, (probe,)) for probe in sorted(before.probes)]
    easiest = min(
        cost([end, (position(order[0][0], "p"), order[0][1])], changes)
        for order in every_order(members)
        for end in ends
        if cost([(position(kind, "p"), probes) for kind, probes in order], changes) == least
    )
    assert min(cost([end, sequence[0]], changes) for end in ends) == easiest


@settings(max_examples=25, deadline=None)
@given(kinds, st.lists(kinds, min_size=1, max_size=3), change_times)
def test_going_on_from_what_still_stands_is_paid(
    standing: Setup, members: list[Setup], changes: ChangeTimes
) -> None:
    rest = position(standing, "rest")
    own = [position(kind, str(k)) for k, kind in enumerate(members)]
    sequence, _ = ordered(own, changes, [], rest)
    assert sequence[0][0] is rest and sorted(sequence[0][1]) == sorted(standing.probes)
    least = least_of_all(members, changes, standing)
    assert cost(sequence, changes) == least == changeover(members, changes, standing)


def test_the_order_in_which_kinds_are_given_does_not_matter() -> None:
    some = [
        Setup("plate", plane, frozenset(probes))
        for plane in "xyz"
        for probes in (["a"], ["a", "b"])
    ]
    assert (
        len(
            {
                changeover(order, CHANGES)
                for order in (some, some[::-1], frozenset(some), tuple(some))
            }
        )
        == 1
    )
    assert changeover([], CHANGES) == 0.0


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


def test_set_ups_of_two_probes_on_both_sides_of_those_of_one() -> None:
    """The cheapest order parts two positions of one kind."""
    both, down = (Setup("plate", "z", frozenset(some)) for some in (["right", "down"], ["down"]))
    across = Setup("plate", "x", frozenset(["right"]))
    sequence, _ = ordered(
        [position(kind, str(k)) for k, kind in enumerate((both, both, down, down))], CHANGES
    )
    assert cost(sequence, CHANGES) == 0.0 == changeover([both, both, down, down], CHANGES)
    ends = [across, both, both, down, across]
    assert changeover(ends, CHANGES) == least_of_all(ends, CHANGES) == 1800.0
    # A choice that just fits the hours is allowed, and no less.
    own = [position(kind, str(k)) for k, kind in enumerate(ends)]
    for seconds, is_allowed in ((5 * 600.0 + 1800.0, True), (5 * 600.0 + 1799.0, False)):
        limits = constraints(own, CHANGES, Budget(seconds))
        assert limits.allows(range(5)) == is_allowed
        assert (2 in limits.additions([0, 1, 3, 4])) == is_allowed


@pytest.mark.parametrize("plane", [0.0, 60.0, 150.0, 240.0, 1800.0])
def test_random_positions_in_every_order(plane: float) -> None:
    """Times with which places are worth coming back to, and times with which they are not."""
    generator = np.random.default_rng(int(plane))
    changes = ChangeTimes(120.0, plane)
    for _ in range(25):
        members = random_members(generator, 6)
        assert changeover(members, changes) == least_of_all(members, changes), members


def test_beyond_what_is_gone_through_a_bound_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Against the least of all, which the search for few positions finds."""
    generator, gaps = np.random.default_rng(3), []
    for _ in range(40):
        changes = ChangeTimes(120.0, float(generator.choice([30.0, 60.0, 150.0])))
        members = random_members(generator, 10)
        own = [position(kind, str(k)) for k, kind in enumerate(members)]
        monkeypatch.setattr("ballplate.planning.changeover.MOST_POSITIONS", 12)
        sequence, gap = ordered(own, changes)
        least = cost(sequence, changes)
        assert gap == 0.0
        monkeypatch.setattr("ballplate.planning.changeover.MOST_POSITIONS", 5)
        near, gap = ordered(own, changes)
        assert cost(near, changes) - gap <= least <= cost(near, changes)
        assert sorted(one.name for one, _ in near) == sorted(one.name for one in own)
        gaps.append((cost(near, changes) - least, gap))
    # Some are not the least, and the bound is no longer than it may be.
    assert any(more > 0.0 for more, _ in gaps) and any(gap == 0.0 for _, gap in gaps)
    sheet = next(
        sheet
        for _ in range(100)
        if (sheet := run_sheet(sheet_of(generator), ChangeTimes(120.0, 60.0))).gap
    )
    assert f"(at most {sheet.gap / 60.0:.1f} min more than the least of any order)" in summary(
        sheet
    )


def sheet_of(generator: np.random.Generator) -> list[Candidate]:
    members = random_members(generator, 10)
    return [position(kind, str(k)) for k, kind in enumerate(members)]


def test_of_many_places_some_sets_are_followed() -> None:
    """Eighteen places, of which each leads on to the next."""
    names = [f"p{k}" for k in range(19)]
    many = [
        Setup(f"plate {k}", "z", frozenset(pair))
        for k, pair in enumerate(zip(names, names[1:], strict=False))
    ]
    assert len(many) > MOST_PLACES
    order = cheapest([(kind, 1) for kind in many], CHANGES)
    assert {visit.kind for visit in order.visits} == set(many)
    assert order.bound == 17 * CHANGES.plane <= order.seconds <= 17 * CHANGES.plane + 2 * 120.0


def test_of_many_kinds_the_order_is_exact() -> None:
    # Six places with three kinds each that share probes: one change of place fewer than places is
    # least.
    many = [
        Setup(artefact, plane, frozenset(probes))
        for artefact in ("a", "b")
        for plane in "xyz"
        for probes in (["l"], ["r", "l"], ["d", "l", "r"])
    ]
    order = cheapest([(kind, 1) for kind in many], CHANGES)
    assert changeover(many, CHANGES) == order.seconds == order.bound == 5 * CHANGES.plane
    assert {visit.kind for visit in order.visits} == set(many)


def test_six_kinds_take_a_moment() -> None:
    six = [
        Setup("plate", plane, frozenset(probes))
        for plane in "xyz"
        for probes in (["a"], ["a", "b"])
    ]
    changeover(six, CHANGES)
    began = process_time()
    for _ in range(1000):
        changeover(six, CHANGES)
    assert process_time() - began < 0.5


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
