"""The page of limits tells those that the program has."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from analysis import curve, estimators, lengths, volumetric
from analysis.cli import lengths as lengths_command
from analysis.cli import spline
from analysis.montecarlo import trials
from analysis.planning import criteria, information
from analysis.reach import search
from analysis.reliability import leftover
from analysis.sweeps import axes, bundle, load, settings
from simulator.experiment import (
    calibrations,
    checks,
    curves,
    machine_sections,
    messages,
    pool_groups,
    priors,
    references,
    sections,
    tables,
    variants,
    yamltree,
)
from simulator.geometry import artefacts, directions
from simulator.splines import read

PAGE = Path("docs/reference/limits.md")

LIMITS = {
    "size of a file": (yamltree.MOST_BYTES // 10**6,),
    "values in a YAML file": (yamltree.MOST_NODES,),
    "depth of a YAML file": (yamltree.DEEPEST,),
    "rows of a table": (tables.MOST_ROWS,),
    "columns of a table": (tables.MOST_COLUMNS,),
    "errors that are listed": (messages.MOST_MESSAGES,),
    "files that a sweep": (bundle.MOST_BYTES // 10**6,),
    "readings, repeats": (references.MOST_READINGS,),
    "balls of an artefact": (artefacts.MOST_BALLS, references.MOST_BALLS_OF_ALL),
    "parameters besides": (checks.MOST_SHARED,),
    "balls that calibrated": (calibrations.MOST_TIED_BALLS,),
    "lengths of standards": (checks.MOST_LENGTHS,),
    "lengths of one standard": (checks.MOST_JOINT_LENGTHS,),
    "directions of a gauge": (directions.MOST_DIRECTIONS,),
    "evaluation points |": (sections.MOST_POINTS,),
    "derivatives of": (checks.MOST_DERIVATIVES,),
    "measuring tasks": (sections.MOST_TASKS,),
    "priors": (priors.MOST_PRIORS,),
    "variants": (variants.MOST_VARIANTS,),
    "points of a curve": (curves.MOST_POINTS,),
    "coefficients of a polynomial": (machine_sections.MOST_COEFFICIENTS,),
    "`plan` | candidates of": (pool_groups.MOST_CANDIDATES,),
    "`plan` | candidates' matrices": (information.MOST_BYTES // 10**6,),
    "`plan` | evaluation points": (criteria.MOST_POINTS,),
    "balls, balls read": (variants.MOST_OF_ALL,),
    "`run --trials`": (trials.MOST_TRIALS,),
    "`sweep` | synthetic": (settings.MOST_TRIALS,),
    "`fit`, `reliability` |": (leftover.MOST_ENTRIES,),
    "`compare`, `fit --estimator` |": (estimators.MOST_DERIVATIVES,),
    "`compare --points`": (estimators.MOST_POINTS,),
    "`sweep` | cells": (load.MOST_CELLS,),
    "`sweep` | values": (axes.MOST_VALUES,),
    "`reach`": (search.MOST_POINTS,),
    "`lengths` |": (lengths.MOST_POINTS,),
    "`lengths --pairs`": (lengths_command.MOST_PAIRS,),
    "`map`": (volumetric.MOST_POINTS,),
    "`spline`": (read.MOST_POINTS, curve.MOST_COEFFICIENTS, spline.MOST_ORDER),
}


@pytest.mark.parametrize("what", LIMITS)
def test_the_page_tells_the_limit(what: str) -> None:
    (row,) = [line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith(f"| {what}")]
    numbers = [int(found.replace(" ", "")) for found in re.findall(r"[0-9]+(?: [0-9]{3})*", row)]
    assert tuple(numbers[-len(LIMITS[what]) :]) == LIMITS[what]
