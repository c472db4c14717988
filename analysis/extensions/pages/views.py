"""Results as pictures in space that notebooks show."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from ballplate.presentation import box_edges, projection
from ballplate.rank import Direction, Verdict
from ballplate.results import reading_residuals
from ballplate.simulator.computing import single_threaded
from ballplate.simulator.design import Design, measured
from ballplate.simulator.estimation import Linearisation, Solution
from ballplate.simulator.inputs import Target
from ballplate.simulator.readings import ObservedReadings

from .design_views import ball_views, motion_view, point_view, volume_view
from .motions import Motion, null_motions, weak_motions
from .residual_sections import residual_view
from .spatial import SpatialPicture

# A notebook keeps every picture that it has shown: balls that are drawn of all positions together,
# where they stand and where they move, and directions of each kind.
MOST_DRAWN, MOST_MOVING, MOST_DIRECTIONS = 1000, 150, 4


def position_picture(design: Design) -> SpatialPicture:
    """Positions in the volume."""
    return volume_view(design, max(MOST_DRAWN // max(len(design.positions.names), 1), 1))


def residual_pictures(observed: ObservedReadings, solution: Solution) -> tuple[SpatialPicture, ...]:
    """Return pictures of residuals of a fit at the balls of plates; possibly empty."""
    design = observed.design
    if not len(design.plate_readings):
        return ()
    readings, residuals, _ = reading_residuals(design, solution, observed.x)
    shown = np.where(measured(design, readings), residuals, 0.0)
    volume = design.machine.volume
    edges, _ = box_edges(volume.lower, volume.upper, projection(design.dimension)[1])
    return (residual_view(observed.x[design.plate_readings], shown, edges),)


@single_threaded
def judged_pictures(
    linearisation: Linearisation,
    judged: Verdict,
    target: Target | None,
    sigma: float = 1.0,
    residuals: Sequence[SpatialPicture] = (),
) -> tuple[SpatialPicture, ...]:
    """Return pictures of a design with its rank, the most important first: an undetermined
    direction, if any, positions, `residuals`, ellipsoids of points and balls with `sigma` times
    the stated uncertainties, further undetermined directions, and weak ones.
    """
    coverage_factor = 1.0 if target is None else target.coverage_factor
    factor = coverage_factor if coverage_factor != 1.0 else 2.0
    undetermined = list(
        _moving(linearisation, null_motions(linearisation), judged.null, "Undetermined")
    )
    weak = _moving(
        linearisation, weak_motions(linearisation, target), judged.weak, "Weakly determined"
    )
    points = (
        [point_view(linearisation, factor, sigma)]
        if len(linearisation.design.evaluation.points)
        else []
    )
    balls = ball_views(linearisation, factor, sigma)
    first = [*undetermined[:1], position_picture(linearisation.design), *residuals]
    return (*first, *points, *balls, *undetermined[1:], *weak)


def _moving(
    linearisation: Linearisation,
    motions: Sequence[Motion],
    directions: Sequence[Direction],
    kind: str,
) -> Iterator[SpatialPicture]:
    """Return the first few directions that move anything."""
    of_count = f" of {len(directions)}" if len(directions) > 1 else ""
    shown = 0
    for k, (motion, direction) in enumerate(zip(motions, directions, strict=True), start=1):
        name, words = f"{kind.lower().replace(' ', '-')}-{k}", f"{kind} {k}{of_count}"
        picture = motion_view(linearisation, motion, name, str(direction), words, MOST_MOVING)
        if picture is not None:
            shown += 1
            yield picture
        if shown == MOST_DIRECTIONS:
            return
