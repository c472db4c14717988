"""Repairs of designs: whatever is proposed is written out as a file and computed again, and
compared with a search that tries everything.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from itertools import combinations
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from ballplate.extensions.planning.pools import seconds_of
from ballplate.extensions.repair.candidates import candidates, further_readings
from ballplate.extensions.repair.changes import Change, ChangeKind, changed
from ballplate.extensions.repair.mending import with_experiment
from ballplate.extensions.repair.repair_search import loosened, repairs
from ballplate.extensions.repair.repairs import Repairs
from ballplate.extensions.repair.search import Losses, best_set, change_pool, mean_target
from ballplate.extensions.repair.written import Edit
from ballplate.presentation.formatting import number
from ballplate.results.checked_files import Wanted, check_files
from ballplate.results.prediction import check, predict
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import load
from ballplate.simulator.experiment.model import (
    AtMost,
    Candidate,
    ChangeTimes,
    Experiment,
    Pool,
    Position,
)

from tests.extensions.repair import wording
from tests.reference import dense
from tests.reference.small_quickstart import small_sections

DEFICIENT = [
    ("npl/6.1.1", "B"),
    pytest.param("npl/6.2.1", "n=4 NDEL=7", marks=pytest.mark.long),
    ("hocken_borchardt/angles", "half a turn"),
    ("hocken_borchardt/angles", "shifted only"),
    ("hurt_foss/bar-bell", "length unknown"),
    ("hurt_foss/bar-bell", "flat"),
    ("hurt_foss/bar-bell", "one axis"),
    ("hurt_foss/bryan-gauge", "radius unknown"),
]


@cache
def design(file: str, variant: str | None) -> Experiment:
    return next(one for one in load(f"designs/{file}.yaml") if one.name == variant)


@cache
def repaired(file: str, variant: str) -> Repairs:
    return repairs(design(file, variant))


def plain(path: Path, variant: str | None) -> dict[str, Any]:
    """What a file says, with a variant of it written out."""
    said: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
    for key, value in (said.pop("variants", {}) or {}).get(variant, {}).items():
        put(said, key, value)
    said.pop("expected_rank_deficiency", None)
    return said


def put(said: dict[str, Any], path: str, value: Any, is_new: bool = False) -> None:
    """Set what stands at a path, of which entries of lists are chosen by index or by name."""
    steps = path.replace("]", "").replace("[", "\0").split("\0")
    steps = [*steps[0].split("."), *(part for step in steps[1:] for part in step.split(".", 1))]
    at: Any = said
    for step in steps[:-1]:
        at = at[place(at, step)] if isinstance(at, list) else at.setdefault(step, {})
    last: Any = place(at, steps[-1]) if isinstance(at, list) else steps[-1]
    if is_new:
        at.setdefault(last, []).append(value)
    else:
        at[last] = value


def place(entries: list[Any], step: str) -> int:
    return (
        int(step)
        if step.isdigit()
        else next(k for k, one in enumerate(entries) if one["name"] == step)
    )


def written_out(said: dict[str, Any], edits: Iterable[Edit], folder: Path) -> Experiment:
    """The experiment of the file with edits in it."""
    for edit in edits:
        put(said, edit.path, edit.value, edit.is_new)
    path = folder / "repaired.yaml"
    path.write_text(yaml.safe_dump(said), encoding="utf-8")
    (found,) = load(path)
    return found


def hold(said: dict[str, Any], experiment: Experiment, found: Repairs, folder: Path) -> None:
    """What each repair prints is what the file with its edits has."""
    for repair in found.repairs:
        after = written_out(dict(yaml.safe_load(yaml.safe_dump(said))), repair.edits, folder)
        planned, verdict = predict(after), check(after).verdict
        assert (verdict.deficiency, len(verdict.weak)) == (repair.deficiency, repair.weak)
        assert f"smallest singular value {repair.smallest:.3g}" in repair.outcome
        rank = verdict.singular_values[-1 - verdict.deficiency]
        np.testing.assert_allclose(rank, repair.smallest, rtol=1e-5)
        assert ("full rank" in repair.outcome) == (not verdict.deficiency)
        if planned.lengths is not None:
            assert f"average U6 {number(1e6 * planned.lengths.average)} µm" in repair.outcome
        more = sum(one.count for one in after.positions)
        assert repair.readings == more - sum(one.count for one in experiment.positions)
        if experiment.pool is None:
            was, now = (sum(map(seconds_of, one.positions)) for one in (experiment, after))
            assert repair.seconds == pytest.approx(now - was)
        assert len({one.name for one in after.positions}) == len(after.positions)


@pytest.mark.parametrize("file, variant", DEFICIENT)
def test_repaired_files_have_what_is_printed(file: str, variant: str, tmp_path: Path) -> None:
    found = repaired(file, variant)
    assert found.repairs and not found.repairs[0].deficiency
    assert [one.order for one in found.repairs] == sorted(one.order for one in found.repairs)
    hold(plain(Path(f"designs/{file}.yaml"), variant), design(file, variant), found, tmp_path)


@pytest.mark.parametrize("file, variant", DEFICIENT)
def test_the_first_repair_is_written_into_the_shipped_file(
    file: str, variant: str, tmp_path: Path
) -> None:
    """Nothing of the file is another than before but the one variant, read by PyYAML alone."""
    source = Path(f"designs/{file}.yaml")
    text = source.read_text(encoding="utf-8")
    experiment = design(file, variant)
    repair = repaired(file, variant).repairs[0]
    new = with_experiment(text, source, experiment, changed(experiment, repair.changes))
    before, after = yaml.safe_load(text), yaml.safe_load(new)
    assert after["variants"].pop(variant) != before["variants"].pop(variant)
    assert after == before and list(after["variants"]) == list(before["variants"])
    lines = [line.partition("#")[2] for line in text.split("\n") if "#" in line]
    assert [line.partition("#")[2] for line in new.split("\n") if "#" in line] == lines
    path = tmp_path / source.name
    path.write_text(new, encoding="utf-8")
    path.write_text(yaml.safe_dump(plain(path, variant)), encoding="utf-8")
    (read,) = load(path)
    assert check(read).verdict.deficiency == 0


def test_a_dense_computation_agrees() -> None:
    experiment = design("npl/6.1.1", "B")
    for changes in [(), *(one.changes for one in repaired("npl/6.1.1", "B").repairs)]:
        after = lay_out(changed(experiment, changes))
        problem = dense.planned(after, 5, 5)
        whole = dense.jacobian(
            lambda step, of=problem: dense.residuals(of, step), problem.parameters
        )  # type: ignore[misc]
        assert dense.spread(whole).deficiency == (0 if changes else 2)


def small(**changed: Any) -> dict[str, Any]:
    """The small example with one probe in each plane and no target."""
    said = small_sections(20, 1, kept=True, **changed)
    said["error_model"]["rotation_coefficients"] = 2
    said["artefacts"]["plate"]["size"] = ["600 mm", "600 mm"]
    for one in said["positions"]:
        one["probes"] = one["probes"][:1]
    del said["target_uncertainty"], said["expected_rank_deficiency"], said["true_machine"]
    return said


def only_probe() -> dict[str, Any]:
    said = small(probes={"down": ["0 mm", "0 mm", "-50 mm"]})
    for one in said["positions"]:
        one["probes"] = ["down"]
    return said


def one_plane() -> dict[str, Any]:
    said = small()
    said["positions"] = [one for one in said["positions"] if one["plane"] == "z"]
    return said


def no_length() -> dict[str, Any]:
    return small(calibration=[])


def nothing_known() -> dict[str, Any]:
    """Neither a certificate nor tips at known distances."""
    return only_probe() | {"calibration": []}


def flat_metric() -> dict[str, Any]:
    return {
        "title": "one position",
        "machine": {"volume": ["900 mm", "900 mm"], "repeatability": ["0.3 um", "0.2 um"]},
        "error_model": {"kind": "metric", "scale": "x"},
        "artefacts": {"plate": {"kind": "grid", "balls": [4, 4], "size": ["360 mm", "360 mm"]}},
        "positions": [{"name": "only", "corner": {"x": "100 mm", "y": "200 mm"}}],
    }


def empirical() -> dict[str, Any]:
    said = one_plane()
    said["error_model"] = {"kind": "empirical", "terms": "quadratic"}
    return said


TRAPS = {
    one.__name__: one
    for one in (only_probe, one_plane, no_length, nothing_known, flat_metric, empirical)
}


def loaded(said: dict[str, Any], folder: Path) -> Experiment:
    path = folder / "trap.yaml"
    path.write_text(yaml.safe_dump(said), encoding="utf-8")
    (found,) = load(path, planning=True)
    return found


@pytest.mark.parametrize(
    "trap", [*list(TRAPS)[:-1], pytest.param("empirical", marks=pytest.mark.long)]
)
def test_traps(trap: str, tmp_path: Path) -> None:
    experiment = loaded(TRAPS[trap](), tmp_path)
    found = repairs(experiment)
    assert check(experiment).verdict.deficiency
    assert found.repairs and not found.repairs[0].deficiency, found.lines()
    hold(TRAPS[trap](), experiment, found, tmp_path)
    for k, repair in enumerate(found.repairs, 1):
        (line,) = (one for one in found.lines() if one.startswith(f"repair {k}: "))
        after = written_out(TRAPS[trap](), repair.edits, tmp_path)
        scale = check(after).scale
        assert scale is not None
        assert scale.rests_on_offsets == (wording.SCALE_RESTS_ON_PROBE_OFFSETS in line)
        loose = re.search(r"average U6 [\d.e+-]+ µm, ([\d.e+-]+) µm with 1 µm on the exact", line)
        assert (loose is not None) == (len(after.probes) > 1)
        if loose is not None:
            said = yaml.safe_load((tmp_path / "repaired.yaml").read_text(encoding="utf-8"))
            for name in [*said["probes"]][1:]:
                offset = {"offset": said["probes"][name], "standard_uncertainty": "1 um"}
                said["probes"][name] = offset
            uncertain = predict(loaded(said, tmp_path)).quantities["U6"].average
            assert loose[1] == number(1e6 * uncertain)


def test_an_unknown_scale_needs_a_length_or_a_probe(tmp_path: Path) -> None:
    found = repairs(loaded(nothing_known(), tmp_path))
    assert found.repairs
    for one in found.repairs:
        assert any(change.kind is ChangeKind.CERTIFICATE for change in one.changes)


# The search compared with one that tries everything.


def everything(
    experiment: Experiment, changes: Iterable[Change], size: int
) -> list[tuple[float, float, tuple[Change, ...]]]:
    """Every set of a size of compatible changes that determines everything well, by the full
    computation of the changed design: minutes, U6 with uncertain offsets, changes.
    """
    found = []
    for chosen in combinations(changes, size):
        if len({one.subject for one in chosen}) < size:
            continue
        after = changed(experiment, chosen)
        if loosened(after) < inf:
            verdict = check(after).verdict
            if not verdict.deficiency and not verdict.weak:
                seconds = sum(one.seconds + 600.0 * one.values for one in chosen)
                found.append((seconds, loosened(after), chosen))
    return found


@pytest.mark.parametrize("kind", ChangeKind)
@pytest.mark.parametrize("trap", ["one_plane", "only_probe"])
def test_single_changes_are_those_of_a_complete_search(
    trap: str, kind: ChangeKind, tmp_path: Path
) -> None:
    experiment = loaded(TRAPS[trap](), tmp_path)
    changes = candidates(experiment)[::3]
    every = everything(experiment, [one for one in changes if one.kind is kind], 1)
    pool = change_pool(experiment, changes)
    assert pool is not None

    def is_sound(members: frozenset[int]) -> bool:
        verdict = check(changed(experiment, pool.of(members))).verdict
        return not verdict.deficiency and not verdict.weak

    members, is_enough = best_set(pool, (kind,), is_sound, Losses(pool.problem))
    if not every:
        assert not is_enough or len(members) > 1
        return
    assert is_enough
    seconds, u6, _ = min(every, key=lambda one: one[:2])
    assert pool.effort(members) <= seconds * (1.0 + 1e-9)
    if len(members) == 1 and pool.effort(members) == pytest.approx(seconds):
        assert loosened(changed(experiment, pool.of(members))) == pytest.approx(u6, rel=1e-6)


def test_pairs_of_moves_are_those_of_a_complete_search(tmp_path: Path) -> None:
    """With a target that one move does not meet."""
    experiment = loaded(few(example()), tmp_path)
    moves = [one for one in candidates(experiment) if one.kind is ChangeKind.MOVE][::8]
    best = [min(u6 for _, u6, _ in everything(experiment, moves, size)) for size in (1, 2)]
    assert best[1] < 0.95 * best[0]
    pool = change_pool(experiment, moves)
    assert pool is not None
    for limit, size in ((0.5 * sum(best), 2), (1.01 * best[0], 1)):
        aimed = replace(pool, limit=limit)
        losses = Losses(pool.problem)
        members, is_enough = best_set(aimed, (ChangeKind.MOVE,), lambda members: True, losses)
        assert is_enough and len(members) == size
        found = loosened(changed(experiment, pool.of(members)))
        assert found == pytest.approx(best[size - 1], rel=1e-6)


@pytest.mark.parametrize("chosen", [(), (3, 40), (7, 90, 200)])
def test_information_of_changes_is_that_of_the_changed_design(chosen: tuple[int, ...]) -> None:
    """The criterion of sets, moves and additions and certificates among them."""
    experiment = load(Path("designs/quickstart.yaml"))[0]
    changes = candidates(experiment)[::2]
    pool = change_pool(experiment, changes)
    assert pool is not None
    members = frozenset(k % len(changes) for k in chosen)
    after = changed(experiment, pool.of(members))
    assert Losses(pool.problem).of(members) == pytest.approx(loosened(after), rel=1e-6)


def example(size: str = "750 mm", corner: str = "125 mm", **changed: Any) -> dict[str, Any]:
    """The first example with another plate, all corners alike and no turns."""
    said: dict[str, Any] = yaml.safe_load(Path("designs/quickstart.yaml").read_text("utf-8"))
    said["artefacts"]["plate"]["size"] = [size, size]
    for one in said["positions"]:
        one.pop("quarter_turns", None)
        one["corner"] = dict.fromkeys(one["corner"], corner)
    return said | changed


def few(said: dict[str, Any]) -> dict[str, Any]:
    """A design with fewer balls, points and coefficients."""
    said["artefacts"]["plate"]["balls"] = [3, 3]
    said["evaluation"]["points"]["random"] = 20
    said["error_model"] |= {"position_coefficients": 3, "rotation_coefficients": 3}
    return said


def test_moves_of_positions_replace_invented_distances(tmp_path: Path) -> None:
    """Turning *x high* and shifting *y high* by -125 mm gives 0.274 µm; 62 distances 0.379."""
    experiment = loaded(example(), tmp_path)
    by_hand = example()
    by_hand["positions"][3]["quarter_turns"] = 1
    by_hand["positions"][5]["corner"]["x"] = "0 mm"
    of_hand = loosened(loaded(by_hand, tmp_path))
    assert 1e6 * of_hand == pytest.approx(0.274, abs=0.001)
    found = repairs(experiment)
    hold(example(), experiment, found, tmp_path)
    assert all(change.kind is ChangeKind.MOVE for change in found.repairs[0].changes)
    assert found.repairs[0].loosened <= of_hand


def test_a_target_that_is_missed_at_full_rank_is_met(tmp_path: Path) -> None:
    said = few(example(corner="0 mm")) | {"target_uncertainty": "0.19 um"}
    said["positions"][1]["quarter_turns"] = 1
    said["positions"][2]["quarter_turns"] = 1
    experiment = loaded(said, tmp_path)
    verdict = check(experiment).verdict
    assert not verdict.deficiency and loosened(experiment) > mean_target(experiment)
    found = repairs(experiment)
    hold(said, experiment, found, tmp_path)
    assert found.repairs[0].loosened <= mean_target(experiment)


def test_weak_directions(tmp_path: Path) -> None:
    experiment = design("certified/weak", None)
    before = check(experiment).verdict
    assert not before.deficiency and before.weak
    found = repairs(experiment)
    assert found.repairs and not found.repairs[0].weak
    hold(plain(Path("designs/certified/weak.yaml"), None), experiment, found, tmp_path)


def test_positions_read_twice_as_often() -> None:
    (experiment,) = load(Path("designs/quickstart.yaml"))
    twice = [one.item for one in further_readings(experiment) if "twice as often" in one.words]
    assert [place.name for place in twice] == [place.name for place in experiment.positions]
    assert {group.repeats for place in twice for group in place.readings} == {2}


def test_what_a_plan_cannot_weigh_is_said(tmp_path: Path) -> None:
    prior = {"parameter": "z high: origin x", "standard_uncertainty": "1 um"}
    experiment = loaded(one_plane() | {"priors": [prior]}, tmp_path)
    (line,) = repairs(experiment).lines()
    assert wording.A_PLAN_CANNOT_WEIGH in line


def pool_of(
    experiment: Experiment,
    seconds: list[float],
    at_most: tuple[AtMost, ...] = (),
    forbidden: Any = (),
) -> Pool:
    """Positions of the experiment, drawn, then three to add: one that tells nothing, and two that
    tell all.
    """
    drawn = [Candidate(one.name, one, 600.0, "", "", True, {}) for one in experiment.positions]
    low = experiment.positions[0]
    shifted = replace(low.pose, origin=low.pose.origin + np.array([0.0, 0.0, 0.4]))
    turned = replace(
        low.pose, rotation=low.pose.rotation @ np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    )
    turned = replace(turned, origin=low.pose.origin + np.array([0.75, 0.0, 0.2]))
    aside = replace(low.pose, origin=low.pose.origin + np.array([0.125, 0.0, 0.3]))
    named = [("in between", shifted), ("turned", turned), ("aside", aside)]
    more = [
        Candidate(name, Position(name, "plate", pose, low.readings), time, "z", "more", False, {})
        for (name, pose), time in zip(named, seconds, strict=True)
    ]
    return Pool(
        (*drawn, *more),
        ChangeTimes(60.0, 600.0),
        (),
        at_most,
        {},
        np.reshape(forbidden, (-1, 2, 3)),
        None,
    )


def test_the_cheapest_of_a_pool() -> None:
    """What costs nothing comes before what the pool has a price for, and without a target that
    before what takes longer.
    """
    experiment = replace(design("npl/6.1.1", "B"), target_uncertainty=None)
    pool = pool_of(experiment, [60.0, 5400.0, 600.0])
    moved, read = repairs(replace(experiment, pool=pool)).repairs
    assert [one.kind for one in moved.changes] == [ChangeKind.MOVE]
    (change,) = read.changes
    assert change.words == wording.ADD_OF_THE_POOL and read.seconds == 600.0


def test_a_pool_of_a_file(tmp_path: Path) -> None:
    """Two positions left of a day's plan; of its pool also the bar, which nothing else places."""
    said = plain(Path("designs/planning/campaign.yaml"), None)
    path = tmp_path / "campaign.yaml"
    path.write_text(yaml.safe_dump(said), encoding="utf-8")
    (checked,) = check_files([path], wanted=Wanted(repairs=True))
    (one,) = checked.designs
    assert isinstance(one.suggestions, Repairs) and one.prediction.verdict.deficiency
    first = one.suggestions.repairs[0]
    assert any(change.candidate >= 0 for change in first.changes)
    after = check(written_out(said, first.edits, tmp_path)).verdict
    assert not after.deficiency and not after.weak
