"""Repairs of deficient and weak designs: whatever is told is written out as a file and computed
again.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from ballplate.extensions.repair import repair_search
from ballplate.extensions.repair.changes import Change, ChangeKind, apply_all
from ballplate.extensions.repair.judging import examine, judge
from ballplate.extensions.repair.mending import invents, mended, to_write
from ballplate.extensions.repair.offers import offers
from ballplate.extensions.repair.repair_search import Repair, Repairs, repairs
from ballplate.extensions.repair.repair_tables import repair_lines
from ballplate.extensions.repair.screening import rank_of, seen_by
from ballplate.planning.checked_files import Wanted, check_files
from ballplate.results.checked_designs import check, predict
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
from ballplate.uncertainty.scale import with_offsets
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.extensions.repair import wording
from tests.reference import dense

NPL = Path("designs/npl")
DEFICIENT = [
    ("npl/6.1.1", "B"),
    ("npl/6.1.1", "D"),
    ("npl/6.2.1", "n=4 NDEL=7"),
    ("npl/6.2.2", "grid n=7 NDEL=10"),
    ("hocken_borchardt/angles", "half a turn"),
    ("hocken_borchardt/angles", "shifted only"),
    ("hocken_borchardt/angles", "half a turn, equal scales"),
    ("hurt_foss/bar-bell", "length unknown"),
    ("hurt_foss/bar-bell", "flat"),
    ("hurt_foss/bar-bell", "one axis"),
    ("hurt_foss/bar-bell", "axes only"),
    ("hurt_foss/bryan-gauge", "radius unknown"),
]


@cache
def design(file: str, variant: str) -> Experiment:
    return next(one for one in load(f"designs/{file}.yaml") if one.name == variant)


@cache
def repaired(file: str, variant: str) -> Repairs:
    found = repairs(
        design(file, variant), most=2 if variant in ("D", "n=4 NDEL=7", "grid n=7 NDEL=10") else 3
    )
    assert found is not None
    return found


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


def written_out(said: dict[str, Any], repair: Repair, folder: Path) -> Experiment:
    """The experiment of the file with a repair's edits in it."""
    for edit in repair.edits:
        put(said, edit.path, edit.value, edit.is_new)
    path = folder / "repaired.yaml"
    path.write_text(yaml.safe_dump(said), encoding="utf-8")
    (found,) = load(path)
    return found


@pytest.mark.parametrize("file, variant", DEFICIENT)
def test_repaired_files_have_full_rank(file: str, variant: str, tmp_path: Path) -> None:
    found = repaired(file, variant)
    before = check(design(file, variant)).verdict
    assert found.complete
    for repair in found.complete:
        after = check(
            written_out(plain(Path(f"designs/{file}.yaml"), variant), repair, tmp_path)
        ).verdict
        assert after.deficiency == repair.deficiency == 0
        assert len(after.weak) == repair.weak
        np.testing.assert_allclose(after.singular_values[-1], repair.smallest, rtol=1e-5)
        assert repair.removes == tuple(range(before.deficiency))
    for repair in found.partial:
        after = check(
            written_out(plain(Path(f"designs/{file}.yaml"), variant), repair, tmp_path)
        ).verdict
        assert after.deficiency == repair.deficiency == before.deficiency - len(repair.removes)
        # What is left open has no part in what is said to be removed.
        gone = {part.name for k in repair.removes for part in before.null[k].functions}
        stays = {
            part.name
            for k, one in enumerate(before.null)
            if k not in repair.removes
            for part in one.functions
        }
        assert not (gone - stays) & {part.name for one in after.null for part in one.functions}


@pytest.mark.parametrize("file, variant", DEFICIENT)
def test_the_first_repair_is_written_into_the_shipped_file(
    file: str, variant: str, tmp_path: Path
) -> None:
    """Nothing of the file is another than before but the one variant, read by PyYAML alone."""
    source = Path(f"designs/{file}.yaml")
    text = source.read_text(encoding="utf-8")
    found_repairs = repaired(file, variant)
    repair = to_write(found_repairs, check(design(file, variant)).verdict)
    if repair is None:
        # Only certificates are left, which --fix prints and the studio writes.
        assert found_repairs is not None
        repair = found_repairs.complete[0]
        assert invents(repair)
    new = mended(text, source, variant, repair)
    before, after = yaml.safe_load(text), yaml.safe_load(new)
    assert after["variants"].pop(variant)["expected_rank_deficiency"] == 0
    assert before["variants"].pop(variant)["expected_rank_deficiency"] > 0
    assert after == before and list(after["variants"]) == list(before["variants"])
    lines = [line.partition("#")[2] for line in text.split("\n") if "#" in line]
    assert [line.partition("#")[2] for line in new.split("\n") if "#" in line] == lines
    path = tmp_path / source.name
    path.write_text(new, encoding="utf-8")
    said = plain(path, variant)
    path.write_text(yaml.safe_dump(said), encoding="utf-8")
    (found,) = load(path)
    assert check(found).verdict.deficiency == 0
    if file == "npl/6.1.1":
        problem = dense.planned(lay_out(found), 5, 5)
        whole = dense.jacobian(lambda step: dense.residuals(problem, step), problem.parameters)
        assert dense.spread(whole).deficiency == 0


def frees_scale(experiment: Experiment, repair: Repair, rest: list[Change]) -> bool:
    """Whether what is left out of a repair is a certificate without which U6 is twice as large where
    offsets are known to a micrometre.
    """
    loose = predict(with_offsets(apply_all(rest, experiment), 1e-6)).quantities["U6"].average
    assert repair.loosened is not None and repair.changes[-1].kind is ChangeKind.CERTIFICATE
    return loose > 2.0 * repair.loosened.total / repair.loosened.count


@pytest.mark.parametrize("file, variant", DEFICIENT)
def test_nothing_can_be_left_out(file: str, variant: str) -> None:
    experiment = design(file, variant)
    for repair in repaired(file, variant).complete:
        for left_out in repair.changes if len(repair.changes) > 1 else ():
            rest = [one for one in repair.changes if one is not left_out]
            verdict = check(apply_all(rest, experiment)).verdict
            assert (
                verdict.deficiency
                or len(verdict.weak) > repair.weak
                or frees_scale(experiment, repair, rest)
            )


@pytest.mark.parametrize("file, variant", DEFICIENT[:1])
def test_a_dense_computation_agrees(file: str, variant: str) -> None:
    experiment = design(file, variant)
    for changes in [(), *(one.changes for one in repaired(file, variant).complete)]:
        changed = lay_out(apply_all(changes, experiment))
        problem = dense.planned(changed, 5, 5)
        whole = dense.jacobian(
            lambda step, of=problem: dense.residuals(of, step), problem.parameters
        )  # type: ignore[misc]
        assert dense.spread(whole).deficiency == (0 if changes else 2)


FLAT = """\
title: two level positions
machine: {volume: [700 mm, 1000 mm, 600 mm], repeatability: 0.5 um}
error_model:
  {kind: kinematic, arrangement: MB2, position_coefficients: 4, rotation_coefficients: 4}
probes: {down: [0 mm, 0 mm, -120 mm], right: [80 mm, 0 mm, -60 mm], left: [-80 mm, 0 mm, -60 mm]}
artefacts: {plate: {kind: grid, balls: [6, 5], size: [500 mm, 400 mm]}}
positions:
  - {name: low, plane: z, level: 50 mm, corner: {x: 100 mm, y: 50 mm}, probes: [down]}
  - {name: high, plane: z, level: 450 mm, corner: {x: 100 mm, y: 500 mm}, quarter_turns: 1,
     probes: [down]}
calibration: [{kind: coordinates, balls: [r1c1, r1c6, r5c1], standard_uncertainty: 0.4 um}]
evaluation: {points: {random: 20, seed: 1}, probe: down}
"""


def test_more_readings_help_two_level_positions(tmp_path: Path) -> None:
    path = tmp_path / "flat.yaml"
    path.write_text(FLAT)
    experiment = load(path)[0]
    found = repairs(experiment)
    assert found is not None and found.complete
    for one in found.complete:
        problem = dense.planned(lay_out(apply_all(one.changes, experiment)), 4, 4)
        whole = dense.jacobian(
            lambda step, of=problem: dense.residuals(of, step), problem.parameters
        )  # type: ignore[misc]
        assert dense.spread(whole).deficiency == 0


def test_words_name_errors_and_positions() -> None:
    experiment = design("npl/6.1.1", "B")
    lines = repair_lines(repaired("npl/6.1.1", "B"), check(experiment).verdict)
    first, written = lines[:2]
    assert wording.REPAIR_TURN_POSITION_BY_ONE_QUARTER in first
    assert wording.FULL_RANK_AND_NOTHING_IS_WEAKLY in first
    assert "; removes undetermined 1 and 2 (" in first and "scale rests" not in first
    assert all(name in first for name in ("EXX", "EYY", "EZZ", wording.SMALLEST_SINGULAR_VALUE))
    assert written.startswith(wording.REPAIR_IN_THE_FILE_POSITIONS)
    kinds = [[one.kind for one in each.changes] for each in repaired("npl/6.1.1", "B").complete]
    assert kinds == [
        [ChangeKind.MOVE, ChangeKind.CERTIFICATE],
        [ChangeKind.MOVE],
        [ChangeKind.READ_MORE],
    ]


@pytest.mark.parametrize("file, variant", DEFICIENT[:3])
def test_screening_tells_the_rank(file: str, variant: str) -> None:
    """Rows of added observations on the null directions against the full computation."""
    base = examine(design(file, variant))
    additions = [
        one
        for changes in offers(base.experiment).values()
        for one in changes
        if one.adds is not None
    ]
    seen = seen_by(base, additions)
    assert len(seen) == len(additions)
    generator = np.random.default_rng(3)
    for k in generator.choice(len(additions), 12, replace=False):
        after = judge(base.experiment, (additions[k],))
        assert after is not None and after.deficiency == base.judged.deficiency - rank_of(
            [seen[additions[k]]]
        )
    for _ in range(6):
        chosen = [additions[k] for k in generator.choice(len(additions), 2, replace=False)]
        after = judge(base.experiment, chosen)
        assert after is not None
        assert after.deficiency == base.judged.deficiency - rank_of([seen[one] for one in chosen])


def small(**changed: Any) -> dict[str, Any]:
    """A small plate in three planes, every length of which can be changed by its path."""
    across = {"x": ("right", ["y", "z"]), "y": ("back", ["z", "x"]), "z": ("down", ["x", "y"])}
    said: dict[str, Any] = {
        "title": "trap",
        "machine": {"volume": ["600 mm"] * 3, "repeatability": "0.2 um"},
        "error_model": {
            "kind": "kinematic",
            "position_coefficients": 3,
            "rotation_coefficients": 2,
        },
        "probes": {
            "down": ["0 mm", "0 mm", "-50 mm"],
            "right": ["50 mm", "0 mm", "0 mm"],
            "back": ["0 mm", "50 mm", "0 mm"],
        },
        "artefacts": {"plate": {"kind": "grid", "balls": [4, 4], "size": ["400 mm", "400 mm"]}},
        "positions": [
            {
                "name": f"{plane} {where}",
                "plane": plane,
                "level": level,
                "corner": dict.fromkeys(axes, corner),
                "quarter_turns": turns,
                "probes": [probe],
            }
            for plane, (probe, axes) in across.items()
            for where, level, corner, turns in (
                ("low", "100 mm", "60 mm", 0),
                ("high", "500 mm", "150 mm", 1),
            )
        ],
        "calibration": [
            {"kind": "distances", "pairs": "corner sides", "standard_uncertainty": "0.2 um"}
        ],
        "evaluation": {"points": {"random": 60, "seed": 1}, "probe": "down"},
    }
    for path, value in changed.items():
        said[path] = value
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
        "machine": {"volume": ["900 mm", "900 mm"], "repeatability": "0.2 um"},
        "error_model": {"kind": "metric", "scale": "x"},
        "artefacts": {"plate": {"kind": "grid", "balls": [4, 4], "size": ["360 mm", "360 mm"]}},
        "positions": [{"name": "only", "corner": {"x": "100 mm", "y": "200 mm"}}],
    }


def empirical() -> dict[str, Any]:
    said = one_plane()
    said["error_model"] = {"kind": "empirical", "terms": "quadratic"}
    return said


def of_a_file() -> dict[str, Any]:
    said = one_plane()
    said["machine"]["volume"] = ["1000 mm", "800 mm", "600 mm"]
    path = Path("designs/park/machines/gec-like.yaml").resolve()
    said["error_model"] = {"kind": "machine", "file": str(path)}
    return said


TRAPS = {
    one.__name__: one
    for one in (only_probe, one_plane, no_length, nothing_known, flat_metric, empirical, of_a_file)
}


def loaded(said: dict[str, Any], folder: Path) -> Experiment:
    path = folder / "trap.yaml"
    path.write_text(yaml.safe_dump(said), encoding="utf-8")
    (found,) = load(path)
    return found


@pytest.mark.parametrize("trap", sorted(TRAPS))
def test_traps(trap: str, tmp_path: Path) -> None:
    said = TRAPS[trap]()
    experiment = loaded(said, tmp_path)
    before = check(experiment).verdict
    found = repairs(experiment, most=2)
    assert before.deficiency and found is not None and found.complete, repair_lines(found, before)
    for repair in found.complete:
        after = check(written_out(TRAPS[trap](), repair, tmp_path)).verdict
        assert after.deficiency == repair.deficiency == 0 and len(after.weak) == repair.weak


def test_an_unknown_scale_needs_a_length(tmp_path: Path) -> None:
    experiment = loaded(nothing_known(), tmp_path)
    found = repairs(experiment, most=1)
    assert found is not None
    for repair in found.complete:
        words = " ".join(change.words for change in repair.changes)
        assert "calibrate the " in words or wording.A_NEW_PROBE in words


@pytest.mark.parametrize("variant, most", [("A w=0.01", 1), ("C w=0.01", 1)])
def test_weak_directions(variant: str, most: int, tmp_path: Path) -> None:
    experiment = design("npl/6.1.1-weights", variant)
    before = check(experiment).verdict
    assert not before.deficiency and before.weak
    found = repairs(experiment, most)
    assert found is not None and len(found.complete) == most and not found.partial
    for repair in found.complete:
        said = plain(NPL / "6.1.1-weights.yaml", variant)
        after = check(written_out(said, repair, tmp_path)).verdict
        assert not after.deficiency and not after.weak and not repair.weak
    assert "removes" not in " ".join(repair_lines(found, before))


def test_nothing_to_repair() -> None:
    assert repairs(design("npl/6.1.1", "A")) is None


def test_what_cannot_be_repaired_is_said() -> None:
    experiment = design("hurt_foss/bryan-gauge", "one plane")
    (line,) = repair_lines(repairs(experiment), check(experiment).verdict)
    assert line.startswith(wording.NO_CHANGES_WERE_FOUND_THAT_DETERMINE)


def test_changes_that_lead_out_of_the_volume_do_not_go_together() -> None:
    """By the scale readings of every ball with every probe in the moved position."""
    experiment = design("npl/6.1.1", "B")
    found = offers(experiment)
    search = repair_search._Search(examine(experiment), 1)
    lower, upper = experiment.machine.volume.lower, experiment.machine.volume.upper
    inside = {True: 0, False: 0}
    for pair in product(found[ChangeKind.MOVE], found[ChangeKind.READ_MORE]):
        changed = apply_all(pair, experiment)
        scales = [
            np.array(changed.layouts[one.artefact].coordinates)[group.ball_indices]
            @ one.pose.rotation.T
            + one.pose.origin
            - changed.probes[probe].offset
            for one in changed.positions
            for group in one.readings
            for probe in group.probes
        ]
        every = np.concatenate(scales)
        fits = bool(((every >= lower - 1e-9) & (every <= upper + 1e-9)).all())
        inside[fits] += 1
        assert search.may_be(pair) == fits
    assert min(inside.values()) > 10


def pool_of(experiment: Experiment, seconds: list[float], at_most: tuple[AtMost, ...] = ()) -> Pool:
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
        (*drawn, *more), ChangeTimes(60.0, 600.0), (), at_most, {}, np.zeros((0, 2, 3)), None
    )


def from_pool(experiment: Experiment, pool: Pool) -> list[str]:
    found = repairs(replace(experiment, pool=pool), most=1)
    assert found is not None
    return [
        change.words
        for one in found.complete
        for change in one.changes
        if change.kind == ChangeKind.POOL
    ]


def test_the_cheapest_of_a_pool() -> None:
    experiment = design("npl/6.1.1", "B")
    assert from_pool(experiment, pool_of(experiment, [60.0, 5400.0, 1800.0])) == [
        wording.ADD_OF_THE_POOL_MIN
    ]
    # Of the two only as many as the limits leave.
    no_more = (AtMost((4, 6), 0),)
    pool = pool_of(experiment, [60.0, 5400.0, 1800.0], no_more)
    assert from_pool(experiment, pool) == [wording.ADD_OF_THE_POOL]


def test_what_costs_nothing_is_told_before_what_the_pool_has_a_price_for() -> None:
    experiment = design("npl/6.1.1", "B")
    found = repairs(replace(experiment, pool=pool_of(experiment, [60.0, 5400.0, 1800.0])), most=2)
    assert found is not None and not any(one.weak or one.is_faint for one in found.complete)
    assert [[change.kind for change in one.changes] for one in found.complete] == [
        [ChangeKind.MOVE],
        [ChangeKind.POOL],
    ]


def test_a_pool_of_a_file(tmp_path: Path) -> None:
    """Two positions left of a day's plan; of its pool also the bar, which nothing else places."""
    said = plain(Path("designs/planning/campaign.yaml"), None)
    path = tmp_path / "campaign.yaml"
    path.write_text(yaml.safe_dump(said), encoding="utf-8")
    (checked,) = check_files([path], wanted=Wanted(repairs=True))
    (one,) = checked.designs
    suggested = one.suggestions.repairs
    assert suggested is not None and one.prediction.verdict.deficiency
    first = suggested.complete[0]
    assert [change.kind for change in first.changes] == [ChangeKind.POOL]
    after = check(written_out(said, first, tmp_path)).verdict
    assert not after.deficiency and not after.weak


def test_other_additions_than_the_pools_are_not_told() -> None:
    experiment = design("npl/6.1.1", "B")
    found = offers(replace(experiment, pool=pool_of(experiment, [1.0, 2.0, 3.0])))
    assert ChangeKind.ADD_POSITION not in found and ChangeKind.CERTIFICATE not in found
    assert [one.cost for one in found[ChangeKind.POOL]] == [1.0, 2.0, 3.0]


def test_a_set_of_a_pool_is_minimal() -> None:
    """Distances of one line each, of which two are needed."""
    experiment = design("npl/6.1.1", "B")
    single = [one for one in offers(experiment)[ChangeKind.CERTIFICATE] if one.cost == 1.0]
    drawn = [Candidate(one.name, one, 600.0, "", "", True, {}) for one in experiment.positions]
    more = [
        Candidate(one.words, one.adds, 60.0 * (k + 1), "", "", False, {})
        for k, one in enumerate(single)
        if one.adds is not None
    ]
    pool = Pool((*drawn, *more), ChangeTimes(0.0, 0.0), (), (), {}, np.zeros((0, 2, 3)), None)
    found = repairs(replace(experiment, pool=pool), most=1)
    assert found is not None
    chosen = found.complete[0].changes
    assert [one.kind for one in chosen] == [ChangeKind.POOL, ChangeKind.POOL]
    base = examine(experiment)
    costs = {frozenset((a, b)): a.cost + b.cost for a in chosen for b in chosen if a is not b}
    seen = seen_by(base, single)
    cheapest = min(
        (60.0 * (i + 1) + 60.0 * (k + 1))
        for i, one in enumerate(single)
        for k, other in enumerate(single[:i])
        if rank_of([seen[one], seen[other]]) == 2
    )
    assert set(costs.values()) == {cheapest}


@settings(
    max_examples=3, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
@given(
    chosen=st.sets(st.integers(0, 5), min_size=1, max_size=3),
    coefficients=st.integers(2, 3),
    turns=st.integers(0, 3),
    with_length=st.booleans(),
)
def test_whatever_is_told_holds(
    tmp_path_factory: pytest.TempPathFactory,
    chosen: set[int],
    coefficients: int,
    turns: int,
    with_length: bool,
) -> None:
    folder = tmp_path_factory.mktemp("any")

    def said() -> dict[str, Any]:
        found = small()
        found["positions"] = [found["positions"][k] for k in sorted(chosen)]
        found["positions"][-1]["quarter_turns"] = turns
        found["error_model"]["position_coefficients"] = coefficients
        found["artefacts"]["plate"]["balls"] = [3, 3]
        found["calibration"] = found["calibration"] if with_length else []
        return found

    experiment = loaded(said(), folder)
    before = check(experiment).verdict
    found = repairs(experiment, most=2)
    if found is None:
        assert not before.deficiency and not before.weak
        return
    for repair in (*found.complete, *found.partial):
        after = check(written_out(said(), repair, folder)).verdict
        assert (after.deficiency, len(after.weak)) == (repair.deficiency, repair.weak)
    for repair in found.complete:
        assert not repair.deficiency
        for one in repair.changes if len(repair.changes) > 1 else ():
            rest = [other for other in repair.changes if other is not one]
            left = judge(experiment, rest)
            assert left is not None and (
                left.deficiency or left.weak > repair.weak or frees_scale(experiment, repair, rest)
            )


def test_suggestions_do_not_ask_for_all_candidates_in_one_design(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Parameters of influence quantities that each candidate brings do not add up."""
    each = {"kind": "reproducibility", "each": ["position", "ball"], "standard_uncertainty": "1 um"}
    few = {"balls": [2, 2], "size": ["500 mm", "500 mm"], "kind": "grid"}
    base = load("designs/quickstart.yaml")[0].with_(
        {"influences": [each], "artefacts.plate": few, "error_model": {"kind": "metric"}}
    )
    deficient = replace(base, positions=base.positions[:1])
    at_large = repairs(deficient, most=1)
    shared = examine(deficient).at.design
    most = shared.parameter_count + 100
    monkeypatch.setattr("ballplate.simulator.experiment.influences.MOST_SHARED", most)
    limited = repairs(deficient, most=1)
    assert at_large is not None and limited is not None
    assert limited.complete
    assert [one.edits for one in limited.complete] == [one.edits for one in at_large.complete]
