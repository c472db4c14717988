"""The page of limits tells those that the program has."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from ballplate.estimators import distances as estimators
from ballplate.extensions.diagnosis import remainders as leftover
from ballplate.extensions.maps import correction
from ballplate.extensions.maps import volumetric_errors as volumetric
from ballplate.extensions.requirements import root_search as search
from ballplate.extensions.splines import curve_options
from ballplate.extensions.splines import error_curve as curve
from ballplate.extensions.splines import read_points as read
from ballplate.extensions.sweeps import axes, bundle, load
from ballplate.extensions.sweeps import sweep_settings as settings
from ballplate.montecarlo import trial_runs as trials
from ballplate.planning import criteria, information
from ballplate.simulator.design import lookup
from ballplate.simulator.design.observations import distances, joint_values
from ballplate.simulator.experiment import (
    checks,
    machine_sections,
    pool_groups,
    priors,
    references,
    sections,
    variants,
)
from ballplate.simulator.experiment import (
    curve_files as curves,
)
from ballplate.simulator.geometry import artefacts
from ballplate.simulator.geometry import listed_directions as directions
from ballplate.simulator.inputs import decoding, messages, tables, yamltree
from ballplate.simulator.inputs import settings as input_settings

PAGE = Path("docs/reference/limits.md")

LIMITS = {
    "size of a file": (yamltree.MOST_BYTES // 10**6,),
    "characters of a line": (decoding.MOST_IN_LINE,),
    "values in a YAML file": (yamltree.MOST_NODES,),
    "depth of a YAML file": (yamltree.DEEPEST,),
    "rows of a table": (tables.MOST_ROWS,),
    "columns of a table": (tables.MOST_COLUMNS,),
    "errors that are listed": (messages.MOST_MESSAGES,),
    "files that a sweep": (bundle.MOST_BYTES // 10**6,),
    "readings, repeats": (lookup.MOST_READINGS,),
    "balls of an artefact": (artefacts.MOST_BALLS, references.MOST_BALLS_OF_ALL),
    "parameters besides": (checks.MOST_SHARED,),
    "balls that calibrated": (distances.MOST_TIED_BALLS,),
    "correlated values": (joint_values.MOST_JOINT_VALUES,),
    "lengths of standards": (checks.MOST_LENGTHS,),
    "lengths of one standard": (checks.MOST_JOINT_LENGTHS,),
    "directions of a gauge": (directions.MOST_DIRECTIONS,),
    "evaluation points |": (sections.MOST_POINTS,),
    "derivatives of": (checks.MOST_DERIVATIVES,),
    "measuring tasks": (input_settings.MOST_SEVERAL,),
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
    "`fit`, `run --reliability` |": (leftover.MOST_ENTRIES,),
    "`compare`, `fit --estimator` |": (estimators.MOST_DERIVATIVES,),
    "`compare --points`": (estimators.MOST_POINTS,),
    "`sweep` | cases": (load.MOST_CELLS,),
    "`sweep` | values": (axes.MOST_VALUES,),
    "`reach`": (search.MOST_POINTS,),
    "`correct --covariance`": (correction.MOST_CO_ORDINATES,),
    "`map`": (volumetric.MOST_POINTS,),
    "`spline`": (read.MOST_POINTS, curve.MOST_COEFFICIENTS, curve_options.MOST_ORDER),
}


@pytest.mark.parametrize("what", LIMITS)
def test_the_page_tells_the_limit(what: str) -> None:
    (row,) = [
        line
        for line in PAGE.read_text(encoding="utf-8").splitlines()
        if line.startswith(f"| {what}")
    ]
    numbers = [int(found.replace(" ", "")) for found in re.findall(r"[0-9]+(?: [0-9]{3})*", row)]
    assert tuple(numbers[-len(LIMITS[what]) :]) == LIMITS[what]
