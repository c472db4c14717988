"""Campaigns with stars and re-indexed heads simulated by their definitions: coverage where they are
declared, and what the documentation says of where they are not.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ballplate.simulator.design.arrays import Design
from ballplate.simulator.design.measurement import nominal_state
from ballplate.simulator.design.observations.distances import CalibratedDistances
from ballplate.simulator.experiment.layout import lay_out
from ballplate.simulator.experiment.loading import written_in_python
from ballplate.simulator.experiment.model import Experiment

from tests.extensions.influences.campaigns import Shares, assert_covered, shares_of
from tests.reference.small_quickstart import small_sections

NAMES = tuple(small_sections()["probes"])
TIPS = np.array(
    [[0.0, 0.0, -0.05], [0.05, 0.0, 0.0], [-0.05, 0.0, 0.0], [0.0, 0.05, 0.0], [0.0, -0.05, 0.0]]
)
# Standard uncertainties of a tip in the star and of re-indexing, and by how much stars are turned.
TIP, SHIFT, TURN = 2e-7, 5e-7, 2e-4
PAGE = Path("docs/reference/validation.md")


def small(**changes: Any) -> Experiment:
    return written_in_python(small_sections(**changes), Path())


def with_tips(experiment: Experiment, tips: np.ndarray) -> Design:
    """The design with certified tips: of the star, or without one offsets held as certified."""
    stars = tuple(replace(one, coordinates=tips) for one in experiment.stars)
    probes = {
        name: replace(experiment.probes[name], offset=tip)
        for name, tip in zip(NAMES, tips, strict=True)
    }
    return lay_out(replace(experiment, stars=stars, probes=probes))


def coverage(told: Experiment, of_star: bool, count: int) -> Shares:
    """Campaigns on a machine without errors; what is certified of tips is wrong and the star turned,
    or tips are re-indexed.
    """
    return shares_of(_campaigns(told, of_star, count))


def _campaigns(told: Experiment, of_star: bool, count: int) -> Iterator[tuple[Design, np.ndarray]]:
    generator, design = np.random.default_rng(20261122), lay_out(told)
    for _ in range(count):
        p, one = TIPS, design
        if of_star:
            a, b, c = TURN * generator.standard_normal(3)
            p = TIPS + np.cross([a, b, c], TIPS)
            one = with_tips(told, TIPS + TIP * generator.standard_normal(TIPS.shape))
        readings, state = one.readings, nominal_state(one)
        arms = np.einsum(
            "mij,mj->mi", state.rotations[readings.position], state.balls[readings.ball]
        )
        x = arms + state.origins[readings.position] - p[readings.probe]
        if not of_star:
            shifts = SHIFT * generator.standard_normal((6, 5, 3))
            x -= shifts[readings.position, readings.probe]
        x += one.machine.repeatability * generator.standard_normal(x.shape)
        given = one.of(CalibratedDistances)
        wrong = given.value + given.uncertainty * generator.standard_normal(len(given))
        yield one.observed(given.given(value=wrong)), x


STAR = {"stars": [{"standard_uncertainty": "0.2 um"}]}
REINDEXED = {"influences": [{"kind": "re-indexing", "standard_uncertainty": "0.5 um"}]}
# By the rows of the documentation's table: what is told, and whether it is of a star.
TOLD: dict[str, tuple[dict[str, Any], bool]] = {
    "star, declared": (STAR, True),
    "star, offsets held as certified": ({}, True),
    "re-indexing, declared": (REINDEXED, False),
    "re-indexing, not declared": ({}, False),
}


@pytest.mark.parametrize("name", ["star, declared", "re-indexing, declared"])
def test_what_is_declared_is_covered(name: str) -> None:
    changes, of_star = TOLD[name]
    assert_covered(coverage(small(**changes), of_star, 20), 20)


@pytest.mark.long
@pytest.mark.parametrize("name", TOLD)
def test_the_page_states_what_is_wrong_otherwise(name: str) -> None:
    changes, of_star = TOLD[name]
    found = coverage(small(**changes), of_star, 1000)
    cells = [f"{100 * found.within[s]:.1f} %" for s in ("U5", "U6")]
    cells += [f"{found.size[s]:.3g}" for s in ("U5", "U6")]
    row = f"| {' | '.join([name, *cells, f'{100 * found.noticed:.1f} %'])} |"
    assert row in PAGE.read_text(encoding="utf-8"), row
