"""Uncertainties of a part's dimensions by a design, before it is measured, or by a map."""

from __future__ import annotations

import math
from pathlib import Path

from ballplate.results import check
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.design import Design
from ballplate.simulator.estimation import Linearisation, displacements, linearise
from ballplate.simulator.experiment import Experiment, lay_out
from ballplate.simulator.inputs import Array, GivenText
from ballplate.uncertainty import Quantity, can_stretch, combined_uncertainties, member_root
from scipy.stats import chi2

from ..machine_files import FittedMap
from ..maps.corrected_points import corrected, drawn_rows
from ..maps.correction import OWN_SCALES, map_cautions
from ..maps.realisations import Draws
from .drawn_parts import machines_of_design, machines_of_map, with_draws
from .measured_parts import read_part_points, with_readings
from .part import Workpiece
from .part_result import PartUncertainty, dimension_uncertainties
from .part_values import COVERAGE, LaidPart, laid_in_design, lay_out_part
from .touched import ProbingMachine, of_design

NO_DRAWS = Draws()
BY_DESIGN = "the readings of the design leave it open"
BY_MAP = "the map leaves it open"


def part_uncertainty(design: Design, quantity: Quantity) -> PartUncertainty:
    """Return the dimensions of the part of a design with the uncertainties of its quantity."""
    laid = design.once(laid_in_design)
    dimensions = dimension_uncertainties(laid.part, quantity.named, BY_DESIGN)
    return PartUncertainty("", laid, dimensions)


@single_threaded
def by_design(part: Workpiece, experiment: Experiment, draws: Draws = NO_DRAWS) -> PartUncertainty:
    """Return the dimensions of a part on the corrected machine of an experiment's design.

    :raises ValueError: as `lay_out_part`.
    """
    design = lay_out(experiment)
    laid = lay_out_part(part, of_design(design))
    at = linearise(design)
    root = member_root(laid.combinations, displacements(at, laid.combinations.places))
    named = combined_uncertainties(laid.combinations, root)
    found = PartUncertainty(
        experiment.label,
        laid,
        dimension_uncertainties(part, named, BY_DESIGN),
        qualified=conditions(experiment, at),
    )
    if not draws.count:
        return found
    return with_draws(found, machines_of_design(at, draws.count, draws.seed), draws.seed)


def conditions(experiment: Experiment, at: Linearisation) -> tuple[str, ...]:
    """Return what predictions for a design take for granted, as lines of text."""
    lines = check(experiment, at.design).qualified
    return tuple(lines if can_stretch(at.design, at.state) else [*lines, OWN_SCALES])


@single_threaded
def by_map(
    part: Workpiece,
    fitted: FittedMap,
    draws: Draws = NO_DRAWS,
    readings: Path | GivenText | None = None,
    with_offsets: bool = False,
) -> PartUncertainty:
    """Return the dimensions of a part on the machine corrected by a map, and by `readings` of its
    points, scale readings or, `with_offsets`, those with the stated offsets of probes.

    :raises ValueError: as `lay_out_part`.
    :raises ExperimentError: as `read_part_points`.
    """
    names = fitted.probes.names
    machine = ProbingMachine(fitted.volume, names, fitted.drawn_offsets, names.index(fitted.probe))
    laid = lay_out_part(part, machine)
    named = combined_uncertainties(laid.combinations, _map_root(laid, fitted))
    freedom = max(fitted.degrees_of_freedom, 1)
    largest = fitted.sigma**2 * freedom / chi2.ppf(0.05, freedom)
    waves = math.sqrt(max(largest - 1.0, 0.0)) * float(fitted.repeatability.max())
    found = PartUncertainty(
        fitted.experiment or fitted.title,
        laid,
        dimension_uncertainties(part, named, BY_MAP),
        waves if fitted.sigma_is_estimated else None,
        tuple(filter(None, map_cautions(fitted, COVERAGE))),
    )
    if draws.count:
        found = with_draws(found, machines_of_map(fitted, draws.count, draws.seed), draws.seed)
    if readings is None:
        return found
    x = read_part_points(readings, laid)
    offsets = machine.offsets[laid.points.probes] if with_offsets else 0.0
    return with_readings(found, fitted, x - offsets)


def _map_root(laid: LaidPart, fitted: FittedMap) -> Array:
    """Return a square root (k, r) of the covariance of a part's members by a map."""
    places, weights = laid.combinations.places, laid.combinations.weights
    _, rows = corrected(fitted, places.points, places.probes)
    drawn = drawn_rows(fitted, places.points, places.probes)
    flat = (places.points.size, len(fitted.scale))
    return fitted.function_root(
        weights @ rows.reshape(flat), None if drawn is None else weights @ drawn.reshape(flat)
    )
