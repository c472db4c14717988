"""Every statement on rank of NPL Report CISE 15/98, section 6, from the shipped designs."""

from __future__ import annotations

from pathlib import Path

import pytest
from ballplate.extensions.reproduction.compare import compare_rank
from ballplate.extensions.reproduction.published import npl
from ballplate.extensions.reproduction.shipped import Shipped, planned
from ballplate.results.prediction import check
from ballplate.simulator.experiment.loading import load

STATEMENTS = [(one, design) for one in npl().ranks for design in one.designs]
# Deficiencies for which the report has no number.
FOUND = {"6.2.1[n=4 NDEL=7]": 6, "6.2.2[grid n=7 NDEL=10]": 3}


@pytest.mark.parametrize("name", sorted({design.partition("[")[0] for _, design in STATEMENTS}))
def test_rank_deficiencies(name: str) -> None:
    shipped = Shipped(Path("designs/npl"))
    for statement, design in STATEMENTS:
        if design.partition("[")[0] == name:
            found = compare_rank(shipped, design, statement)
            assert found.agrees and found.computed == FOUND.get(design, statement.deficiency), (
                design
            )
            # Exact deficiency stands apart from everything determined by many orders of magnitude.
            assert planned(shipped, design).verdict.gap > 1e8
    assert all(
        check(experiment).verdict.as_expected for experiment in load(f"designs/npl/{name}.yaml")
    )


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
