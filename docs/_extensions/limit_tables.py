"""The limits of size, as tables of what the program itself compares with.

A page says `<!-- limits of files -->`, of experiments or of commands, where the table is to stand.
"""

from __future__ import annotations

from ballplate.extensions.diagnosis import remainders
from ballplate.extensions.estimators import distances as estimators
from ballplate.extensions.machine_files import curve_files, machine_sections
from ballplate.extensions.maps import correction, volumetric_errors as volumetric
from ballplate.extensions.planning import criteria, information, pool_groups
from ballplate.extensions.requirements import root_search
from ballplate.extensions.splines import error_curve, read_points
from ballplate.extensions.sweeps import axes, bundle, load, sweep_settings
from ballplate.montecarlo import experiments
from ballplate.simulator.design.observations import calibration, joint_values
from ballplate.simulator.experiment import _priors, changes, references, sections, size_checks
from ballplate.simulator.experiment._artefacts import MOST_BALLS, MOST_BALLS_OF_ALL
from ballplate.simulator.geometry.artefacts import MOST_DIRECTIONS
from ballplate.simulator.inputs import decoding, messages, settings, tables, yamltree
from sphinx.application import Sphinx

MEGABYTE = 10**6

# What is limited, and the limits.
LIMITS = {
    "files": {
        "size of a file, MB": (yamltree.MOST_BYTES // MEGABYTE,),
        "characters of a line": (decoding.MOST_IN_LINE,),
        "values, and depth, of a YAML file, aliases counted in full": (
            yamltree.MOST_NODES,
            yamltree.DEEPEST,
        ),
        "rows, and columns, of a table": (tables.MOST_ROWS, tables.MOST_COLUMNS),
        "errors that are listed": (messages.MOST_MESSAGES,),
        "files that a sweep takes along, MB": (bundle.MOST_BYTES // MEGABYTE,),
    },
    "experiments": {
        "readings, repeats counted": (references.MOST_READINGS,),
        "balls of an artefact, and of all artefacts": (
            MOST_BALLS,
            MOST_BALLS_OF_ALL,
        ),
        "shared parameters: poses, machine errors, probe offsets": (size_checks.MOST_SHARED,),
        "balls that calibrated distances tie together": (calibration.MOST_TIED_BALLS,),
        "correlated values of one calibration item": (joint_values.MOST_JOINT_VALUES,),
        "lengths of standards, one for each position and probe": (size_checks.MOST_LENGTHS,),
        "lengths of one standard that share balls": (size_checks.MOST_JOINT_LENGTHS,),
        "directions of a gauge": (MOST_DIRECTIONS,),
        "evaluation points": (sections.MOST_POINTS,),
        "evaluation points times axes times machine errors": (size_checks.MOST_DERIVATIVES,),
        "measuring tasks": (settings.MOST_SEVERAL,),
        "priors": (_priors.MOST_PRIORS,),
        "variants, and balls, values and points of all": (
            changes.MOST_VARIANTS,
            changes.MOST_OF_ALL,
        ),
        "points of a curve of a true machine": (curve_files.MOST_POINTS,),
        "coefficients of a polynomial in a machine file": (machine_sections.MOST_COEFFICIENTS,),
    },
    "commands": {
        "`plan`: candidates": (pool_groups.MOST_CANDIDATES,),
        "`plan`: candidates' matrices, MB": (information.MOST_BYTES // MEGABYTE,),
        "`plan`: evaluation points, with U6 and U6-maximum": (criteria.MOST_POINTS,),
        "`run --trials`, `compare --trials`: data sets": (experiments.MOST_TRIALS,),
        "`sweep`: data sets of a case": (sweep_settings.MOST_TRIALS,),
        "`sweep`: cases, values of an axis": (load.MOST_CELLS, axes.MOST_VALUES),
        "`fit`, `run --reliability`: observations times shared parameters": (
            remainders.MOST_ENTRIES,
        ),
        "`compare`, `fit --estimator`: distances times parameters": (estimators.MOST_DERIVATIVES,),
        "`compare --points`: pairs of points": (estimators.MOST_POINTS,),
        "`reach`: evaluation points": (root_search.MOST_POINTS,),
        "`correct --covariance`: co-ordinates": (correction.MOST_CO_ORDINATES,),
        "`map`: points": (volumetric.MOST_POINTS,),
        "`spline`: points, coefficients": (read_points.MOST_POINTS, error_curve.MOST_COEFFICIENTS),
    },
}


def table(name: str) -> str:
    """The limits of files, experiments or commands as a Markdown table."""
    lines = ["| what | limit |", "|---|---:|"]
    for what, numbers in LIMITS[name].items():
        # With blanks between groups of three digits, from five digits on.
        written = (f"{n:,}".replace(",", " ") if n > 9999 else str(n) for n in numbers)
        lines.append(f"| {what} | {', '.join(written)} |")
    return "\n".join(lines)


def _fill(app: Sphinx, page: str, source: list[str]) -> None:
    for name in LIMITS:
        source[0] = source[0].replace(f"<!-- limits of {name} -->", table(name))


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("source-read", _fill)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
