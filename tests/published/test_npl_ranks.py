"""Every statement on rank of NPL Report CISE 15/98, section 6, from the shipped designs."""

from __future__ import annotations

from pathlib import Path

import pytest

from analysis.study import check
from simulator.experiment.load import load

DEFICIENCY = {
    **{f"6.1.1[{case}]": deficiency for case, deficiency in zip("ABCD", (0, 2, 0, 2), strict=True)},
    **{f"6.1.2[{case}]": 0 for case in "AB"},
    **{f"6.2.1[n={n} NDEL=5]": 0 for n in range(4, 10)},
    **{f"6.2.1[n={n} NDEL=7]": 6 if n == 4 else 0 for n in range(4, 10)},
    **{f"6.2.2[n={n} NDEL={ndel}]": 0 for n in (5, 7, 10, 13, 17, 21) for ndel in (5, 7)},
    "6.2.2[n=13 NDEL=10]": 0,
    "6.2.2[grid n=7 NDEL=10]": 3,
    **{f"6.2.6[n={n} {model}]": 0 for n in (5, 7) for model in ("kinematic", "empirical")},
}


@pytest.mark.parametrize("name", sorted({label.partition("[")[0] for label in DEFICIENCY}))
def test_rank_deficiencies(name: str) -> None:
    plans = {plan.label: plan for plan in map(check, load(f"designs/npl/{name}.yaml"))}
    stated = {label: n for label, n in DEFICIENCY.items() if label.partition("[")[0] == name}
    assert {label: plan.verdict.deficiency for label, plan in plans.items()} == stated
    assert all(plan.verdict.as_expected for plan in plans.values())
    # Exact deficiency stands apart from everything determined by many orders of magnitude.
    assert all(plan.verdict.gap > 1e8 for plan in plans.values())


@pytest.mark.parametrize("case", "CD")
def test_turned_and_moved_plates_need_no_particular_calibration(case: str, tmp_path: Path) -> None:
    text = Path("designs/npl/6.1.2.yaml").read_text(encoding="utf-8")
    balls = "all" if case == "C" else "corners"
    text += f"  {case}:\n    calibration: [{{kind: coordinates, balls: {balls}, standard_uncertainty: 0.2 um}}]\n"
    (tmp_path / "plate.yaml").write_text(text, encoding="utf-8")
    plans = [check(experiment) for experiment in load(tmp_path / "plate.yaml")]
    assert [plan.verdict.deficiency for plan in plans] == [0, 0, 0]


def test_symmetrical_errors_are_named() -> None:
    """Section 6.1.2: a symmetrical change of the balls is made good by symmetrical scale errors."""
    for experiment in load("designs/npl/6.1.1.yaml"):
        directions = check(experiment).verdict.null
        if experiment.name in ("B", "D"):
            assert len(directions) == 2
            for direction in directions:
                assert {part.name for part in direction.functions} == {"EXX", "EYY", "EZZ"}
                peaks = [abs(part.peak) for part in direction.functions]
                assert max(peaks) == pytest.approx(min(peaks), rel=1e-6)
                assert [part.name for part in direction.artefacts] == ["plate"]
                assert {"x middle", "y middle"} <= {part.name for part in direction.positions}
